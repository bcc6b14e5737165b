// SPDX-License-Identifier: MIT
// Nodes of DAG: see shaders/include/octree_dag_rule.h. A node is looked up by what it says before it is written, so that nodes that
// say the same are one, and with them all that is below. Voxels' numbers are not kept: with them hardly any two parts of a coloured
// world would be alike.

#include "octree/voxels.h"
#include "shaders/include/octree_dag_rule.h"

#include <string.h>

enum { MOST_WORDS = 9, FIRST_ROOM = 1 << 10 };

static uint32_t branch_of(uint32_t level) {
    return level == FM_DAG_LEAF_LEVEL ? 2 : 1;
}

// The last bit tells leaves from other nodes. One of two words may say the same as a leaf, but copies turn its second, where a
// child begins, into another.
static uint32_t hash_of(bool leaf, const uint32_t *words, uint32_t count) {
    uint64_t hash = 0x9e3779b97f4a7c15u;
    for (uint32_t i = 0; i < count; i++) {
        hash = (hash ^ words[i]) * 0xff51afd7ed558ccdu;
        hash ^= hash >> 32;
    }
    return (uint32_t)hash >> 1 | (uint32_t)leaf << 31;
}

// Where the node is, or where it belongs.
static uint64_t slot_of(const fm_voxel_trees *trees, uint32_t hash, const uint32_t *words, uint32_t count) {
    const uint64_t end = trees->octree->words.count;
    uint64_t slot = hash & (trees->node_room - 1);
    for (; trees->nodes[slot].word != 0; slot = (slot + 1) & (trees->node_room - 1)) {
        const uint64_t at = trees->nodes[slot].word;
        if (trees->nodes[slot].hash == hash && at + count <= end &&
            memcmp(fm_voxel_words(trees) + at, words, count * sizeof *words) == 0) {
            break;
        }
    }
    return slot;
}

static fm_result grow(fm_voxel_trees *trees) {
    fm_context *context = trees->octree->context;
    const uint64_t old_room = trees->node_room, room = old_room > 0 ? 2 * old_room : FIRST_ROOM;
    fm_voxel_known *old = trees->nodes, *nodes = fm_octree_alloc_zero(context, room * sizeof *nodes, "the nodes of an octree");
    if (!nodes) {
        return FM_ERROR_OUT_OF_HOST_MEMORY;
    }
    for (uint64_t i = 0; i < old_room; i++) {
        uint64_t slot = old[i].hash & (room - 1);
        while (old[i].word != 0 && nodes[slot].word != 0) {
            slot = (slot + 1) & (room - 1);
        }
        nodes[slot] = old[i].word != 0 ? old[i] : nodes[slot];
    }
    fm_octree_free(context, old, old_room * sizeof *old);
    trees->nodes = nodes;
    trees->node_room = room;
    return FM_OK;
}

static fm_result node_of(fm_voxel_trees *trees, bool leaf, const uint32_t *words, uint32_t count, uint32_t *node) {
    if (2 * trees->node_used >= trees->node_room) {
        FM_TRY(grow(trees));
    }
    const uint32_t hash = hash_of(leaf, words, count);
    fm_voxel_known *known = &trees->nodes[slot_of(trees, hash, words, count)];
    if (known->word == 0) {
        uint64_t first;
        FM_TRY(fm_voxel_room(trees, &trees->octree->words, count, FM_DAG_SOLID, &first));
        memcpy(fm_voxel_words(trees) + first, words, count * sizeof *words);
        *known = (fm_voxel_known){(uint32_t)first, hash};
        trees->node_used++;
        trees->node_count++;
    }
    *node = known->word;
    return FM_OK;
}

static fm_result join(fm_voxel_trees *trees, uint32_t level, const fm_voxel_ref *children, fm_voxel_ref *node) {
    uint32_t words[MOST_WORDS] = {0}, count = level == FM_DAG_LEAF_LEVEL ? 2 : 1;
    for (uint32_t i = 0; i < 1u << 3 * branch_of(level); i++) {
        if (children[i].type == FM_REF_EMPTY) {
            continue;
        }
        words[i / 32] |= 1u << i % 32;
        if (level != FM_DAG_LEAF_LEVEL) {
            words[count++] = children[i].type == FM_REF_SOLID ? FM_DAG_SOLID : children[i].w[0];
        }
    }
    *node = (fm_voxel_ref){.type = FM_REF_NODE};
    return node_of(trees, level == FM_DAG_LEAF_LEVEL, words, count, &node->w[0]);
}

static fm_voxel_ref placed(const fm_voxel_trees *trees, uint32_t word) {
    (void)trees;
    fm_voxel_ref ref = {.type = word == 0 ? FM_REF_EMPTY : word == FM_DAG_SOLID ? FM_REF_SOLID : FM_REF_NODE};
    ref.w[0] = ref.type == FM_REF_SOLID ? 1 : word;
    return ref;
}

static void split(const fm_voxel_trees *trees, uint32_t level, const fm_voxel_ref *node, fm_voxel_ref *children) {
    const uint32_t *words = fm_voxel_words(trees) + node->w[0], *next = words + 1;
    for (uint32_t i = 0; i < 1u << 3 * branch_of(level); i++) {
        const bool there = words[i / 32] >> i % 32 & 1;
        const uint32_t word = !there ? 0 : level == FM_DAG_LEAF_LEVEL ? FM_DAG_SOLID : *next++;
        children[i] = placed(trees, word);
    }
}

static fm_result place(fm_voxel_trees *trees, const fm_voxel_ref *cell, uint32_t *word) {
    (void)trees;
    *word = cell->type == FM_REF_EMPTY ? 0 : cell->type == FM_REF_SOLID ? FM_DAG_SOLID : cell->w[0];
    return FM_OK;
}

const fm_voxel_kind fm_kind_dag = {branch_of, join, split, NULL, place, placed, true, true};
