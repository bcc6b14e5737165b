// SPDX-License-Identifier: MIT
#ifndef FM_DESCENT_H
#define FM_DESCENT_H

// The nearest triangle to every texel of a grid, by descent: a cube of texels has a list of the triangles that can be nearest to
// any of its texels, and is cut into eight, whose lists are drawn from its own, until the texels themselves are left.
//
// With c the middle of a cube whose texels lie within c + [-e, e], r = |e|, and T the triangle nearest to c: as distances to convex
// things are convex, a triangle S of distance s to c, seen in the direction g (the gradient), is at least s + g . x away from c +
// x. T is at most sqrt(t^2 + 2 t h . x + x^2) <= t + h . x + r^2 / 2t away, and at most t + r. So S is nowhere nearest if
//     s - r > t + r   or   s - t > |g - h| . e + r^2 / 2t.
// The second keeps the lists short far from the mesh, where all triangles are about equally far but seen in other directions.
// Computed in floats around the cube, with room for their rounding.

#include "mesh/grid.h"
#include "mesh/topology.h"

// A sphere around a triangle, in the descent's unit from the grid's middle, and centred in the triangle.
typedef struct fm_sphere {
    float centre[3];
    float radius;
} fm_sphere;

// A triangle in a frame of its own: the origin is its point nearest to the middle of the cube it was prepared for, so that nothing
// large cancels near it; n is its normal, u and v span its plane. In (u, v) an edge runs along its direction from `start` to `end`,
// with the origin `aside` to its right. The foot of what is inside lies on the longest edge.
typedef struct fm_prepared {
    float origin[3], u[3], v[3], n[3];
    float direction[3][2], start[3], end[3], aside[3];
    uint32_t triangle;
    int32_t longest;  // edge
} fm_prepared;

enum {
    DESCENT_LANES = 8,
    DESCENT_LEVELS = 27,       // a cube of level k has 2^k texels along each axis
    DESCENT_ITEM_LEVEL = 5,    // of the cubes that are handed to the workers
    DESCENT_LOCAL_LEVEL = 4,   // of those whose triangles are prepared
    DESCENT_LOCAL_MOST = 8192  // triangles that are prepared at once
};

// What a worker has of a level on the way to its last item.
typedef enum fm_descent_known { DESCENT_NOTHING = 0, DESCENT_LIST, DESCENT_SPLIT } fm_descent_known;

typedef struct fm_descent_worker {
    fm_descent_known known[DESCENT_LEVELS];
    uint64_t code[DESCENT_LEVELS];    // in Morton order, of the cube that the level's list is for
    uint32_t wanted[DESCENT_LEVELS];  // which of its eighths may have texels in the band
    uint64_t count[DESCENT_LEVELS];
    uint32_t *list[DESCENT_LEVELS];  // numbers of spheres; none for the cube that holds the grid: all
    uint8_t *mask[DESCENT_LEVELS];   // for each of the list, which of the cube's eighths it can be nearest in
    // Of prepared triangles, likewise.
    uint32_t *local_list[DESCENT_LOCAL_LEVEL + 1];
    uint8_t *local_mask[DESCENT_LOCAL_LEVEL + 1];
    fm_prepared *prepared;
    void *distances;  // a vector each
} fm_descent_worker;

typedef struct fm_descent {
    const fm_mesh *mesh;
    fm_grid grid;
    int levels;             // level of the cube that holds the grid, at least 1
    const uint64_t *items;  // cubes of DESCENT_ITEM_LEVEL, or the one that holds the grid, in Morton order
    double unit;            // length of the descent's unit
    double middle[3];       // of the grid, in world units
    float half_grid;        // bound of the coordinates of texels, in the descent's unit
    float band;             // texels farther than this need not be computed; in the descent's unit
    float band2;            // its square
    float hide_beyond;      // in world units: farther texels get no triangle
    bool sided;             // distances get the sign of the nearest feature's pseudonormal
    const fm_sphere *spheres;
    const uint32_t *ids;  // of the spheres
    uint64_t count;
    float *distance;      // +infinity where a texel was not computed, must be set so before
    uint32_t *triangles;  // may be NULL; likewise FM_NO_TRIANGLE
    fm_descent_worker *workers;
} fm_descent;

// Works on items; `user` is the fm_descent.
void fm_descend_portable(void *user, uint64_t begin, uint64_t end, uint32_t worker);
void fm_descend_avx2(void *user, uint64_t begin, uint64_t end, uint32_t worker);

#endif
