// SPDX-License-Identifier: MIT
// Nodes of VOXELS: words as octree_shared.h tells, children of a node side by side. Empty leaves promise no distance.

#include "octree/voxels.h"

static uint32_t branch_of(uint32_t level) {
    (void)level;
    return 1;
}

static fm_result word_of(fm_voxel_trees *trees, const fm_voxel_ref *cell, uint32_t *word) {
    uint32_t index = 0;
    if (cell->type == FM_REF_SOLID) {
        FM_TRY(fm_voxel_number(trees, cell->w[0], &index));
    }
    *word = cell->type == FM_REF_EMPTY ? FM_NODE_EMPTY : cell->type == FM_REF_SOLID ? ~index : cell->w[0];
    return FM_OK;
}

static fm_voxel_ref ref_of(const fm_voxel_trees *trees, uint32_t word) {
    fm_voxel_ref ref = {.type = FM_REF_EMPTY};
    if (word >> 31 != 0) {
        ref.type = FM_REF_SOLID;
        ref.w[0] = ((const uint32_t *)(const void *)trees->octree->values.data)[~word];
    } else if (word < FM_NODE_EMPTY) {
        ref.type = FM_REF_NODE;
        ref.w[0] = word;
    }
    return ref;
}

static fm_result join(fm_voxel_trees *trees, uint32_t level, const fm_voxel_ref *children, fm_voxel_ref *node) {
    (void)level;
    uint64_t first;
    FM_TRY(fm_voxel_room(trees, &trees->octree->words, 8, FM_NODE_EMPTY, &first));
    for (uint32_t i = 0; i < 8; i++) {
        FM_TRY(word_of(trees, &children[i], &fm_voxel_words(trees)[first + i]));
    }
    *node = (fm_voxel_ref){.type = FM_REF_NODE, .w = {(uint32_t)first}};
    return FM_OK;
}

static void split(const fm_voxel_trees *trees, uint32_t level, const fm_voxel_ref *node, fm_voxel_ref *children) {
    (void)level;
    for (uint32_t i = 0; i < 8; i++) {
        children[i] = ref_of(trees, fm_voxel_words(trees)[node->w[0] + i]);
    }
}

const fm_voxel_kind fm_kind_voxels = {branch_of, join, split, NULL, word_of, ref_of, false, false};
