// SPDX-License-Identifier: MIT
// Nodes of TREE64: see shaders/include/octree_tree64_rule.h.

#include "octree/voxels.h"
#include "shaders/include/octree_tree64_rule.h"

#include <string.h>

enum { NODE_WORDS = FM_TREE64_WORDS };

static uint32_t branch_of(uint32_t level) {
    (void)level;
    return 2;
}

// What the voxels of a node whose children are all empty or solid become: one number for all, or one for each.
static fm_result numbers_of(fm_voxel_trees *trees, const fm_voxel_ref *children, uint32_t *base) {
    uint32_t count = 0, number = 0;
    bool same = true;
    for (uint32_t i = 0; i < FM_BRANCHES; i++) {
        if (children[i].type == FM_REF_SOLID) {
            same = same && (count == 0 || children[i].w[0] == number);
            number = children[i].w[0];
            count++;
        }
    }
    if (same) {
        FM_TRY(fm_voxel_number(trees, number, base));
        *base |= FM_TREE64_LEAF | FM_TREE64_SAME;
        return FM_OK;
    }
    uint64_t first;
    FM_TRY(fm_voxel_room(trees, &trees->octree->values, count, 1u << 30, &first));
    uint32_t *values = (uint32_t *)(void *)trees->octree->values.data + first;
    for (uint32_t i = 0; i < FM_BRANCHES; i++) {
        if (children[i].type == FM_REF_SOLID) {
            *values++ = children[i].w[0];
        }
    }
    *base = (uint32_t)first | FM_TREE64_LEAF;
    return FM_OK;
}

// The words of a cell that is not empty, as they stand among its siblings.
static fm_result words_of(fm_voxel_trees *trees, const fm_voxel_ref *cell, uint32_t words[NODE_WORDS]) {
    if (cell->type == FM_REF_NODE) {
        memcpy(words, cell->w, NODE_WORDS * sizeof *words);
        return FM_OK;
    }
    words[0] = words[1] = UINT32_MAX;
    FM_TRY(fm_voxel_number(trees, cell->w[0], &words[2]));
    words[2] |= FM_TREE64_LEAF | FM_TREE64_SAME;
    return FM_OK;
}

static fm_voxel_ref ref_of(const fm_voxel_trees *trees, const uint32_t words[NODE_WORDS]) {
    fm_voxel_ref ref = {.type = FM_REF_NODE};
    if ((words[0] & words[1]) == UINT32_MAX &&
        (words[2] & (FM_TREE64_LEAF | FM_TREE64_SAME)) == (FM_TREE64_LEAF | FM_TREE64_SAME)) {
        ref.type = FM_REF_SOLID;
        ref.w[0] = ((const uint32_t *)(const void *)trees->octree->values.data)[words[2] & FM_TREE64_INDEX];
        return ref;
    }
    memcpy(ref.w, words, NODE_WORDS * sizeof *words);
    return ref;
}

static fm_result add_words(fm_voxel_trees *trees, uint64_t count, uint64_t *first) {
    return fm_voxel_room(trees, &trees->octree->words, count, (uint64_t)FM_TREE64_INDEX + 1, first);
}

// Whether children that are there can do without a third word: leaves of one number, all of them.
static bool all_thin(const fm_voxel_trees *trees, const fm_voxel_ref *children, uint32_t *number) {
    const uint32_t *values = (const uint32_t *)(const void *)trees->octree->values.data, same = FM_TREE64_LEAF | FM_TREE64_SAME;
    bool any = false;
    for (uint32_t i = 0; i < FM_BRANCHES; i++) {
        if (children[i].type == FM_REF_EMPTY) {
            continue;
        }
        if (children[i].type == FM_REF_NODE && (children[i].w[2] & same) != same) {
            return false;
        }
        const uint32_t its = children[i].type == FM_REF_SOLID ? children[i].w[0] : values[children[i].w[2] & FM_TREE64_INDEX];
        if (any && its != *number) {
            return false;
        }
        *number = its;
        any = true;
    }
    return any;
}

static fm_result write_thin(fm_voxel_trees *trees, const fm_voxel_ref *children, uint32_t count, uint32_t number, uint32_t *base) {
    uint64_t first;
    uint32_t index;
    FM_TRY(fm_voxel_number(trees, number, &index));
    FM_TRY(add_words(trees, 1 + 2 * (uint64_t)count, &first));
    uint32_t *words = fm_voxel_words(trees) + first;
    *words++ = index;
    for (uint32_t i = 0; i < FM_BRANCHES; i++) {
        if (children[i].type != FM_REF_EMPTY) {
            *words++ = children[i].type == FM_REF_SOLID ? UINT32_MAX : children[i].w[0];
            *words++ = children[i].type == FM_REF_SOLID ? UINT32_MAX : children[i].w[1];
        }
    }
    *base = (uint32_t)(first + 1) | FM_TREE64_SAME;
    return FM_OK;
}

static fm_result write_nodes(fm_voxel_trees *trees, const fm_voxel_ref *children, uint32_t count, uint32_t *base) {
    uint64_t first;
    uint32_t number = 0;
    if (all_thin(trees, children, &number)) {
        return write_thin(trees, children, count, number, base);
    }
    FM_TRY(add_words(trees, (uint64_t)count * NODE_WORDS, &first));
    uint64_t at = first;
    for (uint32_t i = 0; i < FM_BRANCHES; i++) {
        if (children[i].type != FM_REF_EMPTY) {
            FM_TRY(words_of(trees, &children[i], fm_voxel_words(trees) + at));
            at += NODE_WORDS;
        }
    }
    *base = (uint32_t)first;
    return FM_OK;
}

static fm_result join(fm_voxel_trees *trees, uint32_t level, const fm_voxel_ref *children, fm_voxel_ref *node) {
    (void)level;
    uint64_t mask = 0;
    uint32_t nodes = 0, count = 0, base;
    for (uint32_t i = 0; i < FM_BRANCHES; i++) {
        mask |= (uint64_t)(children[i].type != FM_REF_EMPTY) << i;
        count += children[i].type != FM_REF_EMPTY;
        nodes += children[i].type == FM_REF_NODE;
    }
    FM_TRY(nodes == 0 ? numbers_of(trees, children, &base) : write_nodes(trees, children, count, &base));
    *node = (fm_voxel_ref){.type = FM_REF_NODE, .w = {(uint32_t)mask, (uint32_t)(mask >> 32), base}};
    return FM_OK;
}

static void split(const fm_voxel_trees *trees, uint32_t level, const fm_voxel_ref *node, fm_voxel_ref *children) {
    (void)level;
    const uint64_t mask = node->w[0] | (uint64_t)node->w[1] << 32;
    const uint32_t *values = (const uint32_t *)(const void *)trees->octree->values.data, *words = fm_voxel_words(trees);
    const bool leaf = node->w[2] & FM_TREE64_LEAF, same = node->w[2] & FM_TREE64_SAME;
    uint64_t at = node->w[2] & FM_TREE64_INDEX;
    const uint32_t thin = !leaf && same ? words[at - 1] : 0;
    for (uint32_t i = 0; i < FM_BRANCHES; i++) {
        children[i] = (fm_voxel_ref){0};
        if (!(mask >> i & 1)) {
            continue;
        }
        if (leaf) {
            children[i].type = FM_REF_SOLID;
            children[i].w[0] = values[at];
            at += !same;
        } else if (same) {
            const uint32_t whole[NODE_WORDS] = {words[at], words[at + 1], thin | FM_TREE64_LEAF | FM_TREE64_SAME};
            children[i] = ref_of(trees, whole);
            at += 2;
        } else {
            children[i] = ref_of(trees, words + at);
            at += NODE_WORDS;
        }
    }
}

static fm_result place(fm_voxel_trees *trees, const fm_voxel_ref *cell, uint32_t *word) {
    *word = 0;
    if (cell->type == FM_REF_EMPTY) {
        return FM_OK;
    }
    uint64_t first;
    uint32_t words[NODE_WORDS];
    FM_TRY(words_of(trees, cell, words));
    FM_TRY(add_words(trees, NODE_WORDS, &first));
    memcpy(fm_voxel_words(trees) + first, words, sizeof words);
    *word = (uint32_t)first;
    return FM_OK;
}

static fm_voxel_ref placed(const fm_voxel_trees *trees, uint32_t word) {
    return word == 0 ? (fm_voxel_ref){0} : ref_of(trees, fm_voxel_words(trees) + word);
}

const fm_voxel_kind fm_kind_tree64 = {branch_of, join, split, NULL, place, placed, false, false};
