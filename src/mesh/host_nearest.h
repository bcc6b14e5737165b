// SPDX-License-Identifier: MIT
#ifndef FM_HOST_NEAREST_H
#define FM_HOST_NEAREST_H

#include "mesh/grid.h"

typedef struct fm_nearest_field {
    const fm_mesh *mesh;
    fm_grid grid;
    double band;        // in world units; texels farther than this are not computed
    float hide_beyond;  // texels farther than this get no triangle
    bool sided;         // negative behind the nearest feature's pseudonormal, for which the mesh's are prepared
    float *distance;
    uint32_t *triangles;  // may be NULL
} fm_nearest_field;

// Distances to the mesh, +infinity where they are not computed. Errors: FM_ERROR_OUT_OF_HOST_MEMORY, and FM_ERROR_UNSUPPORTED for
// an axis that is too long; before anything is written.
fm_result fm_host_nearest(const fm_nearest_field *field);

#endif
