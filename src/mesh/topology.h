// SPDX-License-Identifier: MIT
#ifndef FM_TOPOLOGY_H
#define FM_TOPOLOGY_H

// What is joined to what, by position, and the normals that tell a side from it.

#include "mesh/bvh.h"

// What is joined stays while the same triangles are dropped; measures follow the positions. Of a mesh on the device both are of the
// positions in host memory.
struct fm_topology {
    fm_mesh_info info;
    uint64_t edition;           // of what is joined: another number whenever it was made anew
    uint64_t checked_version;   // the mesh's `host_version` for which the dropped triangles are known to be these
    uint64_t measured_version;  // and for which box, area, volume and triangles without area are measured, plus 1
    uint32_t *dropped;          // a bit each triangle
    uint64_t positions;         // different ones, of vertices that no triangle names too
    uint32_t *distinct;         // a vertex: the number of its position
    uint32_t (*across)[3];  // a triangle's edge (0: corners 0 and 1): the other triangle of a manifold edge, else FM_NO_TRIANGLE
    // Angle-weighted normals, not of unit length, of the positions of `normals_version`; doubles, for sums of small angles.
    double (*corner_normals)[3];  // by distinct position
    uint64_t normals_version;
};

// Makes the mesh's topology with its info but for the measures, if it is not there or other triangles are dropped now.
fm_result fm_topology_prepare(fm_mesh *mesh);
// The normals too, for the present positions.
fm_result fm_pseudonormals_prepare(fm_mesh *mesh);
void fm_topology_destroy(fm_mesh *mesh);

// The pseudonormal of a triangle's feature, not of unit length. Source: Baerentzen and Aanaes 2005, "Signed distance computation
// using the angle weighted pseudonormal".
void fm_pseudonormal(const fm_mesh *mesh, uint32_t triangle, fm_feature feature, double normal[3]);

// Whether any two triangles that share no position intersect; kept for the present positions.
fm_result fm_mesh_intersects(fm_mesh *mesh, bool *intersects);

#endif
