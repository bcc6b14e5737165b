// SPDX-License-Identifier: MIT
#ifndef FM_MESH_GRID_H
#define FM_MESH_GRID_H

// Grids laid over a mesh, and which triangles reach which of their slices.

#include "mesh/mesh.h"

#include <math.h>

// Texel (x, y, z) is the point origin + (x, y, z) spacing.
typedef struct fm_grid {
    fm_shape shape;
    double spacing[3], origin[3];
} fm_grid;

static inline double fm_grid_at(const fm_grid *grid, int axis, int64_t index) {
    return grid->origin[axis] + (double)index * grid->spacing[axis];
}

// The grid is cut along z into slabs, so that each is one worker's. A slab lists, in rising order, the triangles that come within
// a voxel of its slices and of the grid's rows.
typedef struct fm_slabs {
    uint32_t depth;  // slices of a slab, the last may have fewer
    uint32_t count;
    uint64_t *first;  // count + 1
    uint32_t *triangles;
} fm_slabs;

fm_result fm_slabs_make(const fm_mesh *mesh, const fm_grid *grid, fm_slabs *slabs);
void fm_slabs_destroy(const fm_allocator *allocator, fm_slabs *slabs);

// Adds to changes[x + shape.x y] of slice z how many of the listed triangles more a ray along x leaves than it enters right after
// texel (x, y, z), so that the sum over a row from its end back to a texel counts the ray that starts there. Of meshes without a
// boundary that is the winding number: triangles that share an edge agree on which of them the ray passes.
void fm_crossings_add(const fm_mesh *mesh, const fm_grid *grid, const uint32_t *triangles, uint64_t count, uint32_t z,
                      int32_t *changes);

#endif
