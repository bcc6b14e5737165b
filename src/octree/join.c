// SPDX-License-Identifier: MIT
// The words above those of chunks, up to the top grid; and the bounds of what is empty.

#include "octree/build.h"

#include <math.h>

uint32_t fm_octree_bound_word(const fm_octree_build *build, float bound) {
    // Less what rounding may have added.
    double cells = fmax(0, (double)bound * (1 - 1e-6) - 1e-4);
    if (build->desc->share && cells > 0) {
        // Few different ones, or no two subtrees would be alike.
        cells = exp2(floor(2 * log2(cells)) / 2);
    }
    return fm_octree_empty_word(cells * build->cell, (double)build->octree->head.cutoff);
}

fm_result fm_octree_more_words(fm_octree *octree, uint64_t more) {
    if (octree->words.count + more > FM_NODE_EMPTY) {
        return fm_fail(FM_ERROR_UNSUPPORTED, "nodes need more than 2^30 words: choose a smaller size");
    }
    return fm_octree_reserve(octree, &octree->words, more) ? FM_OK : FM_ERROR_OUT_OF_HOST_MEMORY;
}

static bool is_empty(uint32_t word) {
    return word >= FM_NODE_EMPTY && word <= INT32_MAX;
}

// Of the chunk that holds a node of at most its level; 0: it is empty.
static uint32_t slot_of(const fm_octree_build *build, int level, uint32_t x, uint32_t y, uint32_t z) {
    const int up = FM_CHUNK_LEVEL - level;
    const uint32_t at[3] = {x >> up, y >> up, z >> up};
    for (int axis = 0; axis < 3; axis++) {
        if (at[axis] >= build->chunks[axis]) {
            return 0;
        }
    }
    return build->slots[fm_node_at(build->chunks, at[0], at[1], at[2])];
}

static uint32_t root_word(const fm_octree_build *build, uint32_t slot, uint32_t x, uint32_t y, uint32_t z) {
    const uint32_t edge = (uint32_t)FM_CHUNK >> build->leaf_most, mask = edge - 1;
    const uint32_t shape[3] = {edge, edge, edge};
    const uint64_t first = (uint64_t)(slot - 1) * edge * edge * edge;
    return ((const uint32_t *)build->roots.data)[first + fm_node_at(shape, x & mask, y & mask, z & mask)];
}

static bool beyond_box(const fm_octree_build *build, int level, uint32_t x, uint32_t y, uint32_t z) {
    return (uint64_t)x << level >= build->cells[0] || (uint64_t)y << level >= build->cells[1] ||
           (uint64_t)z << level >= build->cells[2];
}

// `counted`: empty leaves of chunks have been.
static fm_result word_of(fm_octree_build *build, int level, uint32_t x, uint32_t y, uint32_t z, uint32_t *word) {
    fm_octree *octree = build->octree;
    const uint32_t slot = level <= FM_CHUNK_LEVEL ? slot_of(build, level, x, y, z) : 0;
    if (beyond_box(build, level, x, y, z) || (level <= FM_CHUNK_LEVEL && slot == 0)) {
        *word = fm_octree_bound_word(build, fm_octree_far_bound(&build->far, level, x, y, z));
        octree->info.empty++;
        return FM_OK;
    }
    if (level == build->leaf_most) {
        // A chunk narrower than the others has no nodes beyond the box, which is found out above.
        *word = root_word(build, slot, x, y, z);
        return FM_OK;
    }
    uint32_t children[8], least = UINT32_MAX;
    const uint64_t group = octree->words.count;
    FM_TRY(fm_octree_more_words(octree, 8));
    octree->words.count += 8;
    bool empty = true;
    for (uint32_t i = 0; i < 8; i++) {
        FM_TRY(word_of(build, level - 1, 2 * x + (i & 1), 2 * y + (i >> 1 & 1), 2 * z + (i >> 2), &children[i]));
        empty = empty && is_empty(children[i]);
        least = children[i] < least ? children[i] : least;
    }
    if (empty) {
        octree->words.count = group;
        octree->info.empty -= 7;
        *word = least;
        return FM_OK;
    }
    for (uint32_t i = 0; i < 8; i++) {
        ((uint32_t *)octree->words.data)[group + i] = children[i];
    }
    octree->info.internal++;
    *word = (uint32_t)group;
    return FM_OK;
}

fm_result fm_octree_join(fm_octree_build *build) {
    fm_octree *octree = build->octree;
    const uint32_t *top = octree->info.top;
    for (uint32_t z = 0; z < top[2]; z++) {
        for (uint32_t y = 0; y < top[1]; y++) {
            for (uint32_t x = 0; x < top[0]; x++) {
                uint32_t word;
                FM_TRY(word_of(build, (int)octree->info.levels, x, y, z, &word));
                ((uint32_t *)octree->words.data)[fm_node_at(top, x, y, z)] = word;
            }
        }
    }
    return FM_OK;
}
