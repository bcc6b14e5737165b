// SPDX-License-Identifier: MIT
#ifndef FM_BVH_H
#define FM_BVH_H

// The bounding volume hierarchy of the CPU: built by the surface area heuristic, refitted when vertices move.

#include "mesh/mesh.h"

// The feature of a triangle that a nearest point lies on: what decides which normal tells the side.
typedef enum fm_feature {
    FM_FEATURE_FACE = 0,
    FM_FEATURE_EDGE_0,  // between corners 0 and 1; 1: corners 1 and 2; 2: corners 2 and 0
    FM_FEATURE_EDGE_1,
    FM_FEATURE_EDGE_2,
    FM_FEATURE_CORNER_0,
    FM_FEATURE_CORNER_1,
    FM_FEATURE_CORNER_2,
} fm_feature;

typedef struct fm_nearest {
    float distance2;    // squared; +infinity: none within the bound
    uint32_t triangle;  // FM_NO_TRIANGLE likewise
    fm_feature feature;
    float point[3];
} fm_nearest;

// Makes the mesh's tree, or brings it up to date; threads of the mesh's context work on it.
fm_result fm_bvh_prepare(fm_mesh *mesh);
void fm_bvh_destroy(fm_context *context, fm_bvh *bvh);

// The queries take a mesh whose tree is prepared. They may run on many threads at once.

// `nearest` holds a first guess on entry, as a bound: only what is nearer replaces it.
void fm_bvh_nearest(const fm_mesh *mesh, const float position[3], fm_nearest *nearest);
// NaN-bearing rays hit nothing.
fm_mesh_hit fm_bvh_cast(const fm_mesh *mesh, const fm_mesh_ray *ray, bool any);

// Calls `fn` for triangles that may overlap the box, among them all that do.
typedef void (*fm_bvh_fn)(void *user, uint32_t triangle);
void fm_bvh_overlaps(const fm_mesh *mesh, const float low[3], const float high[3], fm_bvh_fn fn, void *user);

// The nearest point of one triangle, for guesses; its corners must fit (fm_triangle_fits). Computed in double precision.
fm_nearest fm_triangle_nearest(const fm_mesh *mesh, uint32_t triangle, const float position[3]);

#endif
