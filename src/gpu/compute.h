// SPDX-License-Identifier: MIT
#ifndef FM_COMPUTE_H
#define FM_COMPUTE_H

// Kernels and their dispatch, for the drivers of kernels outside this folder (transform/gpu_*.c).
//
// Work is recorded into one of a few slots (a command buffer with its timestamps) as a row of named passes with a full barrier
// between them. A submission signals the timeline semaphore with its ticket.

#include "gpu/gpu.h"

typedef struct fm_slot fm_slot;

enum { FM_MAX_SPECIALIZATION = 16 };

// The compute kernels, one a SPIR-V module; CMakeLists.txt here says from which shader and variant.
typedef enum fm_kernel {
    FM_KERNEL_COPY = 0,
    FM_KERNEL_ENCODE,
    FM_KERNEL_SAMPLE,
    FM_KERNEL_SCAN_F16,
    FM_KERNEL_SCAN_U32,
    FM_KERNEL_PARABOLA,
    FM_KERNEL_WAYS,
    FM_KERNEL_HALVE,
    FM_KERNEL_ENVELOPE_F32,
    FM_KERNEL_ENVELOPE_U32,
    FM_KERNEL_SEARCH_F32,
    FM_KERNEL_SEARCH_U32,
    FM_KERNEL_BRUTE_F32,
    FM_KERNEL_BRUTE_U32,
    FM_KERNEL_WORLD_ROWS,
    FM_KERNEL_WORLD_SCAN_F16,
    FM_KERNEL_WORLD_SCAN_U32,
    FM_KERNEL_WORLD_ENVELOPE,
    FM_KERNEL_CHUNK_BRUTE,
    FM_KERNEL_CHUNK_FIM,
    FM_KERNEL_CHUNK_FINISH,
    FM_KERNEL_CHUNK_FLOOD,
    FM_KERNEL_CHUNK_RELAX,
    FM_KERNEL_CHUNK_SITES,
    FM_KERNEL_MARCH,
    FM_KERNEL_MARCH_BEAM,
    FM_KERNEL_PICK,
    FM_KERNEL_DEFER_MAP,
    FM_KERNEL_DEFER_BLUR,
    FM_KERNEL_DEFER_SURFACE,
    FM_KERNEL_DEFER_LIGHT,
    FM_KERNEL_DEFER_RESOLVE,
    FM_KERNEL_VOXELIZE,
    FM_KERNEL_VOXELIZE_LARGE,
    FM_KERNEL_VOXELIZE_FILL,
    FM_KERNEL_RTSDF_FLOOD,
    FM_KERNEL_RTSDF_TRACE,
    FM_KERNEL_TREE_BOUNDS,
    FM_KERNEL_TREE_CODES,
    FM_KERNEL_TREE_COUNT,
    FM_KERNEL_TREE_SCAN,
    FM_KERNEL_TREE_SCATTER,
    FM_KERNEL_TREE_LINK,
    FM_KERNEL_TREE_MOMENTS,
    FM_KERNEL_MESH_QUERY,
    FM_KERNEL_MESH_WINDING,
    FM_KERNEL_MESH_NORMALS,
    FM_KERNEL_MESH_SDF_BLOCKS,
    FM_KERNEL_MESH_SDF_TEXELS,
    FM_KERNEL_MESH_SDF_FILL,
    FM_KERNEL_MESH_NEAR,
    FM_KERNEL_MESH_NEAR_LARGE,
    FM_KERNEL_MESH_NEAR_LIST,
    FM_KERNEL_MESH_NEAR_TEXELS,
    FM_KERNEL_MESH_NEAR_FLOODED,
    FM_KERNEL_MESH_NEAR_ALL,
    FM_KERNEL_MESH_NEAR_ROWS,
    FM_KERNEL_MESH_NEAR_SIDE,
    FM_KERNEL_MESH_NEAR_FLOOD,
    FM_KERNEL_MESH_NEAR_FAR,
    FM_KERNEL_MESH_NEAR_FILL,
    FM_KERNEL_OCTREE_BEAM,
    FM_KERNEL_OCTREE_BUILD_BRICKS,
    FM_KERNEL_OCTREE_BUILD_CORNERS,
    FM_KERNEL_OCTREE_BUILD_EMIT,
    FM_KERNEL_OCTREE_BUILD_MERGE,
    FM_KERNEL_OCTREE_BUILD_NODES,
    FM_KERNEL_OCTREE_BUILD_ROWS,
    FM_KERNEL_OCTREE_BUILD_SCAN,
    FM_KERNEL_OCTREE_BUILD_WORDS,
    FM_KERNEL_OCTREE_CAST,
    FM_KERNEL_OCTREE_GATHER,
    FM_KERNEL_OCTREE_PRIMARY,
    FM_KERNEL_OCTREE_SECOND,
    FM_KERNEL_SCENE_MOVE,
    FM_KERNEL_COMPOSE,
    FM_KERNEL_COUNT
} fm_kernel;

typedef struct fm_dispatch {
    fm_kernel kernel;
    const uint32_t *constants;  // specialisation constants with ids 0, 1, ...
    uint32_t constant_count;
    const void *push;
    uint32_t push_bytes;
    uint64_t groups;  // folded over two axes; the kernel ignores groups past the last
    // Not NULL: the three 32-bit group counts that the device finds at this offset, a multiple of 4, take the place of `groups`.
    const fm_buffer *indirect;
    uint64_t indirect_offset;
} fm_dispatch;

// Takes the next slot, waiting for its last use, and starts recording.
fm_result fm_commands_begin(fm_gpu *gpu, fm_slot **slot);
// Records a dispatch. Errors leave the slot as it was but for what had been recorded: begin anew.
fm_result fm_commands_dispatch(fm_gpu *gpu, fm_slot *slot, const fm_dispatch *dispatch);
// What was recorded becomes visible to what follows: to kernels, transfers and the counts of indirect dispatches.
void fm_commands_barrier(fm_gpu *gpu, fm_slot *slot);
// Both are transfers, ordered against other work by barriers only. Offset and size of a fill are multiples of 4; the two ranges
// of a copy do not overlap.
void fm_commands_fill(fm_gpu *gpu, fm_slot *slot, fm_buffer *buffer, uint64_t offset, uint64_t bytes, uint32_t value);
void fm_commands_copy(fm_gpu *gpu, fm_slot *slot, const fm_buffer *source, uint64_t source_offset, fm_buffer *target,
                      uint64_t target_offset, uint64_t bytes);
// Ends a pass: what was recorded since the last one becomes visible to what follows, and its time is taken. The passes of a
// slot may repeat a name; they are added up when listed.
void fm_commands_pass(fm_gpu *gpu, fm_slot *slot, const char *name, uint64_t bytes);
// Ends the recording and submits it. On failure the slot is free again. `ticket` NULL: waits.
fm_result fm_commands_submit(fm_gpu *gpu, fm_slot *slot, fm_ticket *ticket);
// Submits what was recorded, waits for it and begins anew. The passes so far are listed with those that follow.
fm_result fm_commands_flush(fm_gpu *gpu, fm_slot **slot);

uint64_t fm_buffer_address(const fm_buffer *buffer);

// Device scratch memory of at least `bytes`, kept by the context. Waits for the work in flight when it must grow.
fm_result fm_gpu_scratch(fm_gpu *gpu, uint64_t bytes, uint64_t *address);
// Its buffer, for counts of indirect dispatches; until the next call of fm_gpu_scratch.
fm_buffer *fm_gpu_scratch_buffer(const fm_gpu *gpu);

#endif
