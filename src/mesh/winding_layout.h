// SPDX-License-Identifier: MIT
#ifndef FM_WINDING_LAYOUT_H
#define FM_WINDING_LAYOUT_H

// What each child of a node of the tree sums up to, seen from afar: eight lanes, as bvh_layout.h.

#include "mesh/bvh_layout.h"
#include "mesh/winding.h"

// Moments about the centre, in units of the radius. With u the unit vector from the position to the centre and s the radius over
// the distance, the child's winding number is (s^2 N.u + s^3 M(u) + s^4 (C(u) + V.u)) / 4 pi: what Barill et al. give as the Taylor
// series of the solid angle, sorted by powers of u.
typedef struct fm_winding_lanes {
    float centre[3][FM_BVH_WIDTH], radius[FM_BVH_WIDTH];
    float normal[3][FM_BVH_WIDTH];  // N: sum of areas times normals
    float square[6][FM_BVH_WIDTH];  // M: of xx, yy, zz, xy, yz, zx of u
    float cube[10][FM_BVH_WIDTH];   // C: of xxx, yyy, zzz, xxy, xxz, yyx, yyz, zzx, zzy, xyz
    float vector[3][FM_BVH_WIDTH];  // V
} fm_winding_lanes;

struct fm_winding {
    uint64_t version;
    fm_winding_lanes *nodes;  // of the tree
    uint32_t node_room;
};

// 4 pi times the winding number of a triangle. Source: van Oosterom and Strackee 1983, "The solid angle of a plane triangle".
double fm_solid_angle(const fm_mesh *mesh, uint32_t triangle, const float position[3]);

#endif
