// SPDX-License-Identifier: MIT
#ifndef FM_GPU_BUILD_H
#define FM_GPU_BUILD_H

// A build of an octree on the device, for gpu_build.c and gpu_octree.c.

#include "gpu/gpu.h"
#include "octree/octree.h"
#include "shaders/include/octree_build_shared.h"

typedef struct fm_slot fm_slot;

enum {
    FM_BUILD_NEAR,          // bits and list of blocks, their slots, the plan
    FM_BUILD_CORNER_STORE,  // what corners know
    FM_BUILD_NODES,         // all that is small
    FM_BUILD_ROW_STORE,     // leaves of rows
    FM_BUILD_ANSWERS,       // counts on their way to the host
    FM_BUILD_SENT,          // the plan on its way to the device
    FM_BUILD_WORDS,         // the octree's; these three follow each other
    FM_BUILD_VALUES,
    FM_BUILD_ATTRIBUTES,
    FM_BUILD_BUFFERS
};

typedef struct fm_gpu_build {
    fm_gpu *gpu;
    fm_mesh *mesh;               // in finest cells
    const fm_octree_desc *desc;  // filled
    fm_octree *octree;
    fm_slot *slot;
    fm_build_plan plan;
    fm_buffer *buffers[FM_BUILD_BUFFERS];
    uint64_t bytes, most_bytes;  // of the buffers
    uint32_t blocks[3];          // of corners
    uint64_t above, nodes, items, rows;
    uint64_t entries_at, lists_at, slots_at, plan_at;  // in NEAR
    uint64_t list_at[2], items_at, totals_at, sums;    // in NODES; the last an address
    uint64_t slots, words;
    uint32_t groups, columns;
} fm_gpu_build;

// Takes over buffers of the octree's words, values and attributes (NULL: none), which hold what the host's arrays hold, and leaves
// NULL in their place.
fm_result fm_gpu_octree_adopt(fm_octree *octree, fm_buffer **arrays);

#endif
