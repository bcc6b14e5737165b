// SPDX-License-Identifier: MIT
#ifndef FM_BVH_LAYOUT_H
#define FM_BVH_LAYOUT_H

// How the tree of the CPU lies in memory: nodes of eight boxes, and leaves of up to eight triangles, both so that a loop over the
// eight is a loop over the lanes of a vector.

#include "base/cpu.h"
#include "mesh/bvh.h"

enum {
    FM_BVH_WIDTH = 8,
    // The builder splits by halves from 64 levels on, so that 64 + 32 levels are enough for 2^31 triangles. Each level leaves seven
    // others to come back to.
    FM_BVH_DEEP = 64,
    FM_BVH_STACK = (FM_BVH_DEEP + 32) * (FM_BVH_WIDTH - 1) + 1,
};

static const uint32_t FM_BVH_LEAF = UINT32_C(1) << 31;  // the rest of a child's number is a leaf's

// Unused children have boxes that are inside out, infinitely so. Children have greater numbers than their parents.
typedef struct fm_bvh_node {
    float low[3][FM_BVH_WIDTH], high[3][FM_BVH_WIDTH];
    uint32_t child[FM_BVH_WIDTH];
} fm_bvh_node;

// A triangle in a frame of its own: its longest edge runs from the origin to (base, 0, 0), its third corner is (cx, cy, 0) with
// cy >= 0. Distances to borders come from products of unit vectors with a position relative to a corner, so that slivers are no
// worse than other triangles. Unused lanes repeat the last triangle.
typedef struct fm_bvh_leaf {
    float corner[3][FM_BVH_WIDTH], x[3][FM_BVH_WIDTH], y[3][FM_BVH_WIDTH], normal[3][FM_BVH_WIDTH];
    float base[FM_BVH_WIDTH], cx[FM_BVH_WIDTH], cy[FM_BVH_WIDTH];
    float over_ca[FM_BVH_WIDTH], over_cb[FM_BVH_WIDTH];  // 1 / squared length of the edges to the third corner
    uint32_t triangle[FM_BVH_WIDTH];
} fm_bvh_leaf;

typedef struct fm_bvh_kernels {
    // Index of the nearest triangle and its squared distance, both unchanged if none is nearer than that.
    void (*nearest)(const fm_bvh *bvh, const float position[3], float *distance2, uint32_t *triangle);
    fm_mesh_hit (*cast)(const fm_mesh *mesh, const fm_mesh_ray *ray, bool any);
    double (*winding)(const fm_mesh *mesh, const float position[3], float accuracy);  // 4 pi times the number
} fm_bvh_kernels;

extern const fm_bvh_kernels fm_bvh_kernels_portable;
#ifdef FM_X86_KERNELS
extern const fm_bvh_kernels fm_bvh_kernels_avx2;
#endif

struct fm_bvh {
    uint64_t version, built_version;  // of the mesh
    const fm_bvh_kernels *kernels;
    fm_bvh_node *nodes;
    fm_bvh_leaf *leaves;
    uint32_t node_count, leaf_count;  // no nodes: no triangles. The root is node 0
    uint32_t node_room, leaf_room;    // in the arrays
    uint32_t triangle_count;          // in the leaves
};

// On failure its arrays may be there or not.
fm_result fm_bvh_build(const fm_mesh *mesh, fm_bvh *bvh);
// Leaves and boxes for the present positions. False when other triangles fit than were built in: it must be built anew.
bool fm_bvh_refit(const fm_mesh *mesh, fm_bvh *bvh);

#endif
