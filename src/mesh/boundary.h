// SPDX-License-Identifier: MIT
#ifndef FM_BOUNDARY_H
#define FM_BOUNDARY_H

// The boundary of a mesh and what its winding number owes to it.
//
// The boundary is the chain of edges that do not cancel when every triangle contributes its three, in its own direction. Away from
// the surface the winding number is smooth: its gradient there is that of the boundary alone (the law of Biot and Savart), at most
// the sum of length / (4 pi distance^2) over the boundary's edges. And were a curtain let down from the boundary to infinity, mesh
// and curtain would go around each point a whole number of times: so the fraction of the winding number is minus the curtain's.

#include "mesh/grid.h"

typedef struct fm_boundary_edge {
    double from[3], to[3];
    int32_t times;  // above 0 in the direction of the triangles
} fm_boundary_edge;

typedef struct fm_boundary {
    uint64_t count, capacity;
    fm_boundary_edge *edges;
} fm_boundary;

// Prepares the mesh's topology.
fm_result fm_boundary_make(fm_mesh *mesh, fm_boundary *boundary);
void fm_boundary_destroy(const fm_allocator *allocator, fm_boundary *boundary);

// What the winding number may change by for each unit of length within `radius` of a place; +infinity next to the boundary.
double fm_boundary_gradient(const fm_boundary *boundary, const double at[3], double radius);
// The winding number of the boundary's curtain but for a whole number.
double fm_boundary_curtain(const fm_boundary *boundary, const double at[3]);

// fm_sign_winding for a mesh with a boundary.
fm_result fm_sign_open(fm_mesh *mesh, const fm_grid *grid, double band, const fm_boundary *boundary, float *distance);

#endif
