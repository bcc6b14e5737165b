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
fm_point_on_triangle fm_triangle_point(const fm_mesh *mesh, uint32_t triangle, const float position[3]);

// A ray turned so that it runs along its longest axis, in doubles.
typedef struct fm_sheared_ray {
    int axes[3];  // which axes are x, y, z now
    double origin[3], shear[3];
    float first, last;
} fm_sheared_ray;

// False for a ray that hits nothing: with numbers that are not finite (`first` and `last` may be infinite), an origin that does not
// fit, or no direction.
bool fm_ray_shear(const fm_mesh_ray *ray, fm_sheared_ray *sheared);

// Replaces the hit by that of a triangle which the ray passes, if it is within the ray's range and nearer. `weights` are twice the
// areas that the ray and two corners span, seen along the ray, of the edges opposite to corners 0, 1, 2; `along` are the corners'
// places along the ray's longest axis.
void fm_ray_keep(const fm_sheared_ray *ray, uint32_t triangle, const double weights[3], const double along[3], fm_mesh_hit *hit);

#endif
