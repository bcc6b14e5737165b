// SPDX-License-Identifier: MIT
#ifndef FM_SDF_H
#define FM_SDF_H

// What a field is worked from once the caller's words are checked.

#include "fathom/sdf.h"
#include "mesh/mesh.h"
#include "volume/volume.h"

typedef struct fm_sdf_plan {
    fm_shape shape;
    double spacing[3], origin[3];  // finite, spacing above 0
    // Half the band's width in world units, above 0: texels at most as far are exact. +infinity under FM_FAR_EXACT.
    float band;
    fm_far far_texels;
    fm_sign sign;  // never AUTO
} fm_sdf_plan;

// What sign AUTO stands for, and why.
fm_result fm_sign_resolve(fm_mesh *mesh, fm_sign wanted, fm_sdf_info *info);

// `triangles` may be NULL. The arguments have been checked: types, shapes, where they lie.
fm_result fm_host_sdf(fm_mesh *mesh, const fm_sdf_plan *plan, fm_volume *distance, fm_volume *triangles);
fm_result fm_gpu_mesh_sdf(fm_mesh *mesh, const fm_sdf_plan *plan, fm_volume *distance, fm_volume *triangles, fm_ticket *ticket);

#endif
