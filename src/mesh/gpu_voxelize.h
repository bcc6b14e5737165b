// SPDX-License-Identifier: MIT
#ifndef FM_GPU_VOXELIZE_H
#define FM_GPU_VOXELIZE_H

// Voxelisation as a part of what others record.

#include "gpu/compute.h"
#include "mesh/mesh.h"
#include "shaders/include/mesh_shared.h"

typedef struct fm_voxelize_job {
    fm_mesh_refs mesh;
    fm_voxel_grid grid;
    bool thin;          // FM_SEPARATION_6
    bool bits;          // FM_TYPE_BITS, else FM_TYPE_U8
    fm_buffer *voxels;  // of a volume of the grid's shape, from `voxels_at` (a multiple of 16) on
    uint64_t voxels_at;
    fm_buffer *lists;  // device memory for fm_voxelize_list_bytes from `lists_at` (a multiple of 16) on
    uint64_t lists_at;
} fm_voxelize_job;

// Kernels over all triangles of a mesh: `small` lists those that are too much for one invocation, `large` does the listed ones.
typedef struct fm_triangle_work {
    fm_kernel small, large;
    uint32_t *constants;  // of both; the last is 1 while `large` has FM_VOXELIZE_PARTS groups a triangle, and is changed
    uint32_t constant_count;
    const void *push;  // holds the address of the lists
    uint32_t push_bytes;
    uint32_t triangle_count;
    fm_buffer *lists;  // device memory for fm_voxelize_list_bytes from `lists_at` (a multiple of 16) on
    uint64_t lists_at;
} fm_triangle_work;

uint64_t fm_voxelize_list_bytes(uint64_t triangles);
// Begins with a barrier and ends without one.
fm_result fm_gpu_triangles(fm_gpu *gpu, fm_slot *slot, const fm_triangle_work *work);
// gpu_near.c: marks the blocks that triangles come nearer to than `reach`, in world units, which is filled in in `push`'s. `lists`
// is where push->lists is. Begins and ends likewise.
fm_result fm_gpu_near_mark(fm_gpu *gpu, fm_slot *slot, fm_near_push *push, float reach, fm_buffer *lists, uint64_t lists_at);
// Fewest bytes that it must move.
uint64_t fm_voxelize_bytes(const fm_voxelize_job *job);
// Records the surface's voxels, all others cleared. What is needed of the mesh must be visible; a barrier or the end of the pass
// makes the voxels so.
fm_result fm_gpu_voxelize_surface(fm_gpu *gpu, fm_slot *slot, const fm_voxelize_job *job);
// Slices whose crossings are counted at a time, and the bytes that their counts take.
uint32_t fm_voxelize_slab(const fm_voxel_grid *grid, uint64_t *bytes);
// Sets the voxels whose centre is inside, beside those that are set. Counts take the lists' buffer from `counts_at` on. What is
// needed of the mesh and the voxels must be visible. Ends passes of that name.
fm_result fm_gpu_voxelize_inside(fm_gpu *gpu, fm_slot *slot, const fm_voxelize_job *job, uint64_t counts_at, const char *pass);

#endif
