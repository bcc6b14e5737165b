// SPDX-License-Identifier: MIT
#ifndef FM_MESH_H
#define FM_MESH_H

// What a mesh holds. Everything but its arrays is made when it is first needed.

#include "fathom/mesh.h"
#include "volume/context.h"

#include <math.h>

typedef struct fm_topology fm_topology;  // topology.h
typedef struct fm_bvh fm_bvh;            // bvh.h
typedef struct fm_winding fm_winding;    // winding.h
typedef struct fm_gpu_mesh fm_gpu_mesh;  // gpu_mesh.h

struct fm_mesh {
    fm_context *context;
    float (*vertices)[3];
    uint32_t (*triangles)[3];
    uint64_t vertex_count, triangle_count;
    uint64_t version;          // rises whenever positions change
    uint64_t host_version;     // rises whenever those in host memory do: a scene's move on the device alone
    uint64_t rebuild_version;  // a tree built for an earlier version is not refitted but built anew
    fm_topology *topology;
    fm_bvh *bvh;
    fm_winding *winding;
    fm_gpu_mesh *gpu;  // NULL on the CPU backend
    // Whether two triangles intersect: worked out once for the positions of the `host_version` that is told.
    bool intersects_known, intersects;
    uint64_t intersects_version;
    float low[3], high[3];  // fm_mesh_bounds, of the positions of `box_version`
    uint64_t box_version;   // plus 1
};

// Host memory of meshes, counted as such; else as fm_alloc and fm_free. For the thread of the context.
void *fm_mesh_alloc(fm_context *context, uint64_t bytes, const char *what);
void *fm_mesh_alloc_zero(fm_context *context, uint64_t bytes, const char *what);
void fm_mesh_free(fm_context *context, void *memory, uint64_t bytes);

// A box that holds the triangles that take part, at their present positions, on the device too; there what a scene has moved may
// leave some room in it. Low above high where there is none. Cheap: once a version a look at each triangle, or of a scene at each
// object.
void fm_mesh_bounds(fm_mesh *mesh, float low[3], float high[3]);

// A coordinate whose square, and sums of such squares, a float can hold.
static inline bool fm_coordinate_fits(float x) {
    return fabsf(x) <= 1e18f;  // false for NaN
}

// Whether the triangle takes part: see fathom/mesh.h.
static inline bool fm_triangle_fits(const fm_mesh *mesh, uint64_t triangle) {
    for (int corner = 0; corner < 3; corner++) {
        const float *p = mesh->vertices[mesh->triangles[triangle][corner]];
        if (!fm_coordinate_fits(p[0]) || !fm_coordinate_fits(p[1]) || !fm_coordinate_fits(p[2])) {
            return false;
        }
    }
    return true;
}

#endif
