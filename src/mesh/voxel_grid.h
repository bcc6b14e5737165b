// SPDX-License-Identifier: MIT
#ifndef FM_VOXEL_GRID_H
#define FM_VOXEL_GRID_H

// The grid of a volume, for the rule that says which voxels a triangle sets.

#include "fathom/fathom.h"
#include "shaders/include/voxel_rule.h"

#include <float.h>

static inline float fm_voxel_float(double x) {
    return (float)fmin(fmax(x, -FLT_MAX), FLT_MAX);
}

// `desc` of a volume, whose spacing is filled in; no axis above FM_VOXEL_MOST.
static inline fm_voxel_grid fm_voxel_grid_of(const fm_volume_desc *desc) {
    fm_voxel_grid grid = {.shape = {(int)desc->shape.x, (int)desc->shape.y, (int)desc->shape.z}};
    for (int i = 0; i < 3; i++) {
        const double low = desc->origin[i] - desc->spacing[i] / 2;
        grid.low[i] = fm_voxel_float(low);
        grid.rest[i] = fm_voxel_float(low - grid.low[i]);
        grid.scale[i] = fm_voxel_float(1 / desc->spacing[i]);
    }
    return grid;
}

#endif
