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
    fm_buffer *voxels;  // of a volume of the grid's shape
    fm_buffer *lists;   // device memory for fm_voxelize_list_bytes from `lists_at` (a multiple of 16) on
    uint64_t lists_at;
} fm_voxelize_job;

uint64_t fm_voxelize_list_bytes(uint64_t triangles);
// Fewest bytes that it must move.
uint64_t fm_voxelize_bytes(const fm_voxelize_job *job);
// Records the surface's voxels, all others cleared. What is needed of the mesh must be visible; a barrier or the end of the pass
// makes the voxels so.
fm_result fm_gpu_voxelize_surface(fm_gpu *gpu, fm_slot *slot, const fm_voxelize_job *job);

#endif
