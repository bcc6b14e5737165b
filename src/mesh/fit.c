// SPDX-License-Identifier: MIT
// A grid around a mesh.

#include "fathom/sdf.h"
#include "mesh/mesh.h"

enum { MOST_VOXELS = 16384 };

// The mesh's box; a unit box around the mesh when it has no extent.
static void box_of(fm_mesh *mesh, double low[3], double high[3]) {
    float least[3], most[3];
    fm_mesh_bounds(mesh, least, most);
    for (int axis = 0; axis < 3; axis++) {
        low[axis] = least[axis];
        high[axis] = most[axis];
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
