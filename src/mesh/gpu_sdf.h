// SPDX-License-Identifier: MIT
#ifndef FM_GPU_SDF_H
#define FM_GPU_SDF_H

// A field on its way to the device, for gpu_sdf.c and gpu_near.c.

#include "mesh/gpu_tree.h"
#include "mesh/sdf.h"
#include "mesh/topology.h"

typedef struct fm_sdf_job {
    fm_mesh *mesh;
    const fm_sdf_plan *plan;
    fm_gpu *gpu;
    fm_buffer *scratch;  // where push.scratch is
    uint64_t texel_bytes;
    uint32_t constants[3];  // as sdf.glsl has them
    fm_sdf_push push;
} fm_sdf_job;

// Of scratch memory.
uint64_t fm_gpu_near_bytes(const fm_sdf_job *j);
// Records a field without signs, by pseudonormals or by crossings. What is needed of the mesh is recorded, passes have ended. Ends
// passes "sign" where crossings are counted, "near", "nearest", "flood" but for FM_FAR_BAND, "far" for FM_FAR_EXACT, else "fill".
fm_result fm_gpu_near_record(fm_sdf_job *j, fm_slot *slot);

#endif
