// SPDX-License-Identifier: MIT
#ifndef OCTREE_BUILD_COMMON_H
#define OCTREE_BUILD_COMMON_H

// Octrees with leaves of eight values, held against sums over all triangles of their mesh.

#include "check.h"
#include "mesh_oracle.h"
#include "random.h"

#include "octree/octree.h"
#include "shaders/include/vcp_rule.h"

#include <stdlib.h>
#include <string.h>

typedef struct tree_node {
    int level;
    uint32_t at[3];  // in nodes of its level
    uint32_t word;
} tree_node;

typedef void (*tree_fn)(void *user, const fm_octree *octree, const tree_node *node);

static inline uint32_t tree_word(const fm_octree *octree, uint64_t i) {
    return ((const uint32_t *)octree->words.data)[i];
}

static inline void tree_walk(const fm_octree *octree, const tree_node *node, uint8_t *seen, tree_fn fn, void *user) {
    if (node->word >= FM_NODE_EMPTY) {
        fn(user, octree, node);
        return;
    }
    if (!CHECK(node->level > 0) || !CHECK(node->word + UINT64_C(8) <= octree->words.count)) {
        return;
    }
    CHECK(octree->info.shared || !seen[node->word]);
    seen[node->word] = 1;
    for (uint32_t i = 0; i < 8; i++) {
        const tree_node child = {node->level - 1,
                                 {2 * node->at[0] + (i & 1), 2 * node->at[1] + (i >> 1 & 1), 2 * node->at[2] + (i >> 2)},
                                 tree_word(octree, node->word + i)};
        tree_walk(octree, &child, seen, fn, user);
    }
}

// Calls `fn` for each leaf, empty ones too.
static inline void tree_leaves(const fm_octree *octree, tree_fn fn, void *user) {
    const uint32_t *top = octree->info.top;
    uint8_t *seen = calloc(octree->words.count, 1);
    for (uint32_t z = 0; z < top[2]; z++) {
        for (uint32_t y = 0; y < top[1]; y++) {
            for (uint32_t x = 0; x < top[0]; x++) {
                const uint64_t i = x + (uint64_t)top[0] * (y + (uint64_t)top[1] * z);
                const tree_node node = {(int)octree->info.levels, {x, y, z}, tree_word(octree, i)};
                tree_walk(octree, &node, seen, fn, user);
            }
        }
    }
    free(seen);
}

// The leaf that holds a place in finest cells.
static inline tree_node tree_find(const fm_octree *octree, const double cells[3]) {
    const uint32_t *top = octree->info.top;
    tree_node node = {.level = (int)octree->info.levels};
    uint64_t word = 0, stride = 1;
    for (int axis = 0; axis < 3; axis++) {
        const double index = floor(cells[axis] / (double)(1u << node.level));
        node.at[axis] = (uint32_t)fmin(fmax(index, 0), top[axis] - 1.0);
        word += node.at[axis] * stride;
        stride *= top[axis];
    }
    node.word = tree_word(octree, word);
    while (node.word < FM_NODE_EMPTY) {
        node.level--;
        uint32_t child = 0;
        for (int axis = 0; axis < 3; axis++) {
            const uint32_t half = cells[axis] >= (2.0 * node.at[axis] + 1) * (double)(1u << node.level);
            node.at[axis] = 2 * node.at[axis] + half;
            child |= half << axis;
        }
        node.word = tree_word(octree, node.word + child);
    }
    return node;
}

static inline bool tree_is_empty(const tree_node *node) {
    return node->word >= FM_NODE_EMPTY && node->word <= INT32_MAX;
}

// In world units.
static inline double tree_bound(const fm_octree *octree, const tree_node *node) {
    return (node->word - (double)FM_NODE_EMPTY) / (FM_NODE_EMPTY - 1.0) * (double)octree->head.cutoff;
}

static inline oracle_point tree_place(const fm_octree *octree, const double cells[3]) {
    const fm_octree_info *info = &octree->info;
    return (oracle_point){info->origin[0] + cells[0] * info->cell, info->origin[1] + cells[1] * info->cell,
                          info->origin[2] + cells[2] * info->cell};
}

// Value `corner` (x + 2 y + 4 z) of a leaf stands here.
static inline uint64_t tree_value(const tree_node *node, uint32_t corner) {
    return 4 * ((uint64_t)~node->word + (corner & 1)) + (corner >> 1);
}

// A vector in world units.
static inline fm_v3 tree_vector(const fm_octree *octree, const tree_node *node, uint32_t corner) {
    const uint64_t value = tree_value(node, corner);
    if (octree->info.code == FM_OCTREE_FLOATS) {
        const float *v = (const float *)octree->values.data + 3 * value;
        return (fm_v3){v[0], v[1], v[2]};
    }
    const float unit = FM_OCTREE_REACH * octree->head.cell * (float)(1u << node->level);
    const uint32_t word = octree->info.code == FM_OCTREE_SHORT ? ((const uint16_t *)octree->values.data)[value]
                                                               : ((const uint32_t *)octree->values.data)[value];
    return fm_vcp_decode(word, (int)octree->info.code, unit);
}

static inline double tree_uniform(uint64_t *seed) {
    return (double)(test_random(seed) >> 11) * 0x1p-53;
}

static inline oracle_point random_on_triangle(const scene_mesh *mesh, uint64_t triangle, uint64_t *seed) {
    const double a = sqrt(tree_uniform(seed)), b = tree_uniform(seed);
    const double shares[3] = {1 - a, a * (1 - b), a * b};
    oracle_point p = {0, 0, 0};
    for (int i = 0; i < 3; i++) {
        const oracle_point c = oracle_corner(mesh, triangle, i);
        p = (oracle_point){p.x + shares[i] * c.x, p.y + shares[i] * c.y, p.z + shares[i] * c.z};
    }
    return p;
}

#endif
