// SPDX-License-Identifier: MIT
#ifndef FM_RTSDF_H
#define FM_RTSDF_H

// What RTSDF works from once the caller's words are checked, and its two backends.

#include "fathom/sdf.h"
#include "mesh/mesh.h"
#include "mesh/voxel_grid.h"
#include "shaders/include/rtsdf_rule.h"
#include "volume/volume.h"

enum { FM_MAX_FLOOD_STEPS = 16 };

typedef struct fm_gpu_rtsdf fm_gpu_rtsdf;  // gpu_rtsdf.c

struct fm_rtsdf {
    fm_context *context;
    fm_volume *coarse, *fine;
    fm_voxel_grid grid;  // of the coarse field's voxels
    float weight[3];     // fm_seed_distance2
    float unit;          // smallest edge of a coarse voxel
    float beta, mask, alpha, bias;
    float origin[3], spacing[3];  // of the fine field's texels
    uint32_t rays, seed;
    int steps[FM_MAX_FLOOD_STEPS];
    int step_count;
    uint32_t frame;  // since the beginning, or the last reset
    void *memory;    // of the CPU backend
    fm_gpu_rtsdf *gpu;
};

// Bytes of a bit for each coarse texel, in rows of whole words, and of a seed for each.
uint64_t fm_rtsdf_bits_bytes(const fm_rtsdf *rtsdf);
uint64_t fm_rtsdf_seed_bytes(const fm_rtsdf *rtsdf);

// Bytes that the passes "flood" and "trace" must move.
uint64_t fm_rtsdf_flood_bytes(const fm_rtsdf *rtsdf);
uint64_t fm_rtsdf_trace_bytes(const fm_rtsdf *rtsdf);

fm_result fm_host_rtsdf_create(fm_rtsdf *rtsdf);
void fm_host_rtsdf_destroy(fm_rtsdf *rtsdf);
fm_result fm_host_rtsdf_update(fm_rtsdf *rtsdf, fm_mesh *mesh);

fm_result fm_gpu_rtsdf_create(fm_rtsdf *rtsdf);
// Waits for work in flight.
void fm_gpu_rtsdf_destroy(fm_rtsdf *rtsdf);
fm_result fm_gpu_rtsdf_update(fm_rtsdf *rtsdf, fm_mesh *mesh, fm_ticket *ticket);

#endif
