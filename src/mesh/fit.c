// SPDX-License-Identifier: MIT
// A grid around a mesh.

#include "fathom/sdf.h"
#include "mesh/mesh.h"

enum { MOST_VOXELS = 16384 };

// The box of the triangles that take part; a unit box around the mesh when it has no extent.
static void box_of(const fm_mesh *mesh, double low[3], double high[3]) {
    for (int axis = 0; axis < 3; axis++) {
        low[axis] = INFINITY;
        high[axis] = -INFINITY;
    }
    for (uint64_t i = 0; i < mesh->triangle_count; i++) {
        if (!fm_triangle_fits(mesh, i)) {
            continue;
        }
        for (int corner = 0; corner < 3; corner++) {
            const float *p = mesh->vertices[mesh->triangles[i][corner]];
            for (int axis = 0; axis < 3; axis++) {
                low[axis] = fmin(low[axis], (double)p[axis]);
                high[axis] = fmax(high[axis], (double)p[axis]);
            }
        }
    }
    const bool none = low[0] > high[0];
    const bool point = !none && low[0] == high[0] && low[1] == high[1] && low[2] == high[2];
    for (int axis = 0; (none || point) && axis < 3; axis++) {
        const double centre = none ? 0 : low[axis];
        low[axis] = centre - 0.5;
        high[axis] = centre + 0.5;
    }
}

fm_result fm_mesh_fit(fm_mesh *mesh, uint32_t longest, uint32_t margin, fm_volume_desc *grid) {
    if (!mesh || !grid) {
        return fm_fail(FM_ERROR_INVALID_ARGUMENT, "%s is NULL", mesh ? "grid" : "mesh");
    }
    if (longest == 0 || longest > MOST_VOXELS) {
        return fm_fail(FM_ERROR_INVALID_ARGUMENT, "longest is %u: 1 to %d voxels", longest, MOST_VOXELS);
    }
    if (margin > (longest - 1) / 2) {
        return fm_fail(FM_ERROR_INVALID_ARGUMENT, "margin is %u: at most %u of %u voxels, so that one is left", margin,
                       (longest - 1) / 2, longest);
    }
    double low[3], high[3];
    box_of(mesh, low, high);
    const double extent = fmax(high[0] - low[0], fmax(high[1] - low[1], high[2] - low[2]));
    const double spacing = extent / (longest - 2 * margin);
    uint32_t *const counts[3] = {&grid->shape.x, &grid->shape.y, &grid->shape.z};
    for (int axis = 0; axis < 3; axis++) {
        // The longest edge is a whole number of voxels but for rounding, which must not add one.
        const double voxels = fmax(1, ceil((high[axis] - low[axis]) / spacing * (1 - 1e-12)));
        *counts[axis] = (uint32_t)voxels + 2 * margin;
        grid->spacing[axis] = spacing;
        grid->origin[axis] = (low[axis] + high[axis]) / 2 - (*counts[axis] - 1) / 2.0 * spacing;
    }
    return FM_OK;
}
