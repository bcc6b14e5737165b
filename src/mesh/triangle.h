// SPDX-License-Identifier: MIT
#ifndef FM_TRIANGLE_H
#define FM_TRIANGLE_H

// One triangle alone: its nearest point, and a ray through it.

#include "mesh/bvh.h"

// A point as seen from the query's position.
typedef struct fm_point_on_triangle {
    double distance2;
    double offset[3];
    fm_feature feature;
} fm_point_on_triangle;

// Exact to some units in the last place of a double, of any triangle whose coordinates fit.
fm_point_on_triangle fm_point_nearest(const float *const corners[3], const float position[3]);

// A ray turned so that it runs along its longest axis, in doubles.
typedef struct fm_sheared_ray {
    int axes[3];  // which axes are x, y, z now
    double shear[3];
    const fm_mesh_ray *ray;
} fm_sheared_ray;

// False for a ray that hits nothing: with numbers that are not finite (`last` may be infinite), an origin that does not fit, or no
// direction.
bool fm_ray_shear(const fm_mesh_ray *ray, fm_sheared_ray *sheared);

// Replaces the hit by that of the triangle, if there is one within the ray's range and nearer.
void fm_ray_triangle(const fm_mesh *mesh, uint32_t triangle, const fm_sheared_ray *ray, fm_mesh_hit *hit);

#endif
