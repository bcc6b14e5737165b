// SPDX-License-Identifier: MIT
// Nodes of CONTOURS: see shaders/include/octree_contours_rule.h. A cell's contour holds what is left of its children by theirs. Of
// the axes, the diagonals, and the mean of the children's normals the direction is taken along which least of the cell is left.

#include "octree/voxel_contours.h"
#include "octree/voxels.h"
#include "shaders/include/octree_contours_rule.h"

#include <stdlib.h>
#include <string.h>

enum { MOST_NEAR = (1 << 15) - 1, MOST_LIST = (1 << 24) - 1 };

// A contour is kept, so that those around it are the tighter, while it leaves less than all of a cell. It is written, so that rays
// read it, where it leaves this much of a node; of a voxel it is its shape.
static const double kept = 0.9, written = 0.25;

static uint32_t branch_of(uint32_t level) {
    (void)level;
    return 1;
}

// ---------------------------------------------------------------------------------------------------------------------------
// Contours
// ---------------------------------------------------------------------------------------------------------------------------

static bool is_written(const fm_voxel_ref *cell) {
    double sum = 0;
    for (int i = 0; i < 3; i++) {
        sum += abs(fm_contour_normal(cell->contour, i)) / 31.0;
    }
    return cell->contour && (cell->type == FM_REF_SOLID || (double)fm_contour_thickness(cell->contour) <= written * sum);
}

// What children leave of their cell, in the cell's coordinates, and the mean of their normals.
static uint32_t points_of(const fm_voxel_ref *children, double (*points)[3], double normal[3]) {
    uint32_t count = 0;
    for (int c = 0; c < 8; c++) {
        if (children[c].type == FM_REF_EMPTY) {
            continue;
        }
        const uint32_t added = fm_contour_hull(children[c].contour, points + count);
        for (uint32_t k = 0; k < added; k++, count++) {
            for (int i = 0; i < 3; i++) {
                points[count][i] = 0.5 * (points[count][i] + (c >> i & 1 ? 1 : -1));
            }
        }
        if (children[c].contour) {
            double n[3];
            for (int i = 0; i < 3; i++) {
                n[i] = fm_contour_normal(children[c].contour, i);
            }
            fm_contour_add_normal(n, normal);
        }
    }
    return count;
}

static uint32_t contour_around(const fm_voxel_trees *trees, const fm_voxel_ref *children) {
    double points[8 * FM_HULL_POINTS][3], normal[3] = {0};
    bool full = true;  // of what has no contour
    for (int c = 0; c < 8; c++) {
        full = full && children[c].type != FM_REF_EMPTY && !children[c].contour;
    }
    if (full || trees->octree->desc.threshold < 0) {
        return 0;
    }
    const uint32_t count = points_of(children, points, normal);
    fm_planes planes;
    fm_planes_begin(&planes, normal);
    fm_planes_hold(&planes, (const double(*)[3])points, count);
    return fm_planes_contour(&planes, kept, 0);
}

// ---------------------------------------------------------------------------------------------------------------------------
// Nodes. Of a reference to one, w[0] is where its children's descriptors begin, w[1] the two bytes of its children, w[2] where its
// list is, w[3] the byte of contours.
// ---------------------------------------------------------------------------------------------------------------------------

static uint32_t list_length(const fm_voxel_ref *node) {
    return 1 + (uint32_t)__builtin_popcount(node->w[3]);
}

static fm_result numbers_of(fm_voxel_trees *trees, const fm_voxel_ref *children, uint32_t *base) {
    uint32_t count = 0, number = 0;
    bool same = true;
    for (int i = 0; i < 8; i++) {
        if (children[i].type == FM_REF_SOLID) {
            same = same && (count == 0 || children[i].w[0] == number);
            number = children[i].w[0];
            count++;
        }
    }
    *base = 0;
    if (count == 0) {
        return FM_OK;
    }
    if (same) {
        FM_TRY(fm_voxel_number(trees, number, base));
        *base |= FM_CONTOURS_SAME;
        return FM_OK;
    }
    uint64_t first;
    FM_TRY(fm_voxel_room(trees, &trees->octree->values, count, 1u << 31, &first));
    uint32_t *values = (uint32_t *)(void *)trees->octree->values.data + first;
    for (int i = 0; i < 8; i++) {
        if (children[i].type == FM_REF_SOLID) {
            *values++ = children[i].w[0];
        }
    }
    *base = (uint32_t)first;
    return FM_OK;
}

static fm_result add_words(fm_voxel_trees *trees, uint64_t count, uint64_t *first) {
    return fm_voxel_room(trees, &trees->octree->words, count, 1u << 31, first);
}

// Writes a node's list anew behind what there is, when it is too far away for a descriptor at `place`.
static fm_result near_list(fm_voxel_trees *trees, fm_voxel_ref *node, uint64_t place) {
    if (place - node->w[2] <= MOST_LIST) {
        return FM_OK;
    }
    uint64_t first;
    FM_TRY(add_words(trees, list_length(node), &first));
    uint32_t *words = fm_voxel_words(trees);
    memcpy(words + first, words + node->w[2], list_length(node) * sizeof *words);
    node->w[2] = (uint32_t)first;
    return FM_OK;
}

// The descriptors of nodes, side by side, and behind them the words of those whose children are far.
static fm_result write_nodes(fm_voxel_trees *trees, fm_voxel_ref *nodes, uint32_t count, uint32_t *place) {
    // Lists that are copied lie in front, and one word makes the place even.
    for (uint32_t i = 0; i < count; i++) {
        FM_TRY(near_list(trees, &nodes[i], trees->octree->words.count + 128));
    }
    uint64_t first, behind;
    FM_TRY(add_words(trees, trees->octree->words.count % 2 + 2 * count, &first));
    if (first % 2 != 0) {
        fm_voxel_words(trees)[first++] = 0;
    }
    for (uint32_t i = 0; i < count; i++) {
        const uint64_t at = first + 2 * i, back = (at - nodes[i].w[0]) / 2;
        uint32_t pointer = nodes[i].w[0] == 0 ? 0 : (uint32_t)back << 17;
        if (nodes[i].w[0] != 0 && back > MOST_NEAR) {
            FM_TRY(add_words(trees, 1, &behind));
            fm_voxel_words(trees)[behind] = nodes[i].w[0];
            pointer = (uint32_t)(behind - at) << 17 | FM_CONTOURS_FAR;
        }
        fm_voxel_words(trees)[at] = pointer | nodes[i].w[1];
        fm_voxel_words(trees)[at + 1] = (uint32_t)(at - nodes[i].w[2]) << 8 | nodes[i].w[3];
    }
    *place = (uint32_t)first;
    return FM_OK;
}

static fm_result join(fm_voxel_trees *trees, uint32_t level, const fm_voxel_ref *children, fm_voxel_ref *node) {
    (void)level;
    fm_voxel_ref nodes[8];
    uint32_t count = 0, contours = 0, list[9];
    *node = (fm_voxel_ref){.type = FM_REF_NODE};
    for (uint32_t i = 0; i < 8; i++) {
        node->w[1] |= (children[i].type != FM_REF_EMPTY) << (8 + i) | (children[i].type == FM_REF_SOLID) << i;
        if (children[i].type != FM_REF_EMPTY && is_written(&children[i])) {
            list[++contours] = children[i].contour;
            node->w[3] |= 1u << i;
        }
        if (children[i].type == FM_REF_NODE) {
            nodes[count++] = children[i];
        }
    }
    FM_TRY(numbers_of(trees, children, &list[0]));
    if (count > 0) {
        FM_TRY(write_nodes(trees, nodes, count, &node->w[0]));
    }
    uint64_t first;
    FM_TRY(add_words(trees, list_length(node), &first));
    memcpy(fm_voxel_words(trees) + first, list, list_length(node) * sizeof *list);
    node->w[2] = (uint32_t)first;
    return FM_OK;
}

static fm_voxel_ref node_at(const fm_voxel_trees *trees, uint32_t place) {
    const fm_octree_head head = fm_octree_host_head(trees->octree);
    const uint32_t *words = fm_voxel_words(trees) + place;
    fm_voxel_ref ref = {.type = FM_REF_NODE, .w = {0, words[0] & 0xffff, place - (words[1] >> 8), words[1] & 0xff}};
    // Other pointers lead nowhere.
    const bool nodes = (words[0] >> 8 & ~words[0] & 255) != 0;
    ref.w[0] = nodes ? fm_contours_children(head, place, words[0]) : 0;
    return ref;
}

static void split(const fm_voxel_trees *trees, uint32_t level, const fm_voxel_ref *node, fm_voxel_ref *children) {
    (void)level;
    const uint32_t *list = fm_voxel_words(trees) + node->w[2];
    const uint32_t *values = (const uint32_t *)(const void *)trees->octree->values.data, base = list[0];
    uint32_t place = node->w[0], number = base & ~FM_CONTOURS_SAME;
    for (uint32_t i = 0; i < 8; i++) {
        const bool there = node->w[1] >> (8 + i) & 1, leaf = node->w[1] >> i & 1;
        children[i] = (fm_voxel_ref){0};
        if (there && leaf) {
            children[i].type = FM_REF_SOLID;
            children[i].w[0] = values[number];
            number += !(base & FM_CONTOURS_SAME);
        } else if (there) {
            children[i] = node_at(trees, place);
            place += 2;
        }
        children[i].contour = node->w[3] >> i & 1 ? *++list : 0;
    }
}

static fm_result place_top(fm_voxel_trees *trees, const fm_voxel_ref *cell, uint32_t *word) {
    *word = 0;
    if (cell->type == FM_REF_SOLID) {
        FM_TRY(fm_voxel_number(trees, cell->w[0], word));
        *word |= FM_CONTOURS_SOLID;
    } else if (cell->type == FM_REF_NODE) {
        fm_voxel_ref node = *cell;
        FM_TRY(write_nodes(trees, &node, 1, word));
    }
    return FM_OK;
}

static fm_voxel_ref placed(const fm_voxel_trees *trees, uint32_t word) {
    fm_voxel_ref ref = {0};
    if (word & FM_CONTOURS_SOLID) {
        ref.type = FM_REF_SOLID;
        ref.w[0] = ((const uint32_t *)(const void *)trees->octree->values.data)[word & ~FM_CONTOURS_SOLID];
    } else if (word != 0) {
        ref = node_at(trees, word);
    }
    return ref;
}

const fm_voxel_kind fm_kind_contours = {branch_of, join, split, contour_around, place_top, placed, false, false};
