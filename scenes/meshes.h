// SPDX-License-Identifier: MIT
#ifndef FM_SCENES_MESHES_H
#define FM_SCENES_MESHES_H

// Deterministic procedural meshes for tests and benchmarks. Faces are counter-clockwise seen from outside.

#include "fathom/mesh.h"

typedef struct scene_mesh {
    float (*vertices)[3];
    uint32_t (*triangles)[3];
    uint64_t vertex_count, triangle_count;
} scene_mesh;

// Memory from malloc. All of these make a mesh without vertices and triangles when there is none to be had.
void scene_mesh_free(scene_mesh *mesh);
fm_mesh_desc scene_mesh_describe(const scene_mesh *mesh);

// Closed: 2 sectors (rings - 1) triangles; the poles lie on the z axis. At least 2 rings and 3 sectors.
scene_mesh scene_mesh_sphere(uint32_t rings, uint32_t sectors, const float centre[3], float radius);
// Closed, around the z axis: 2 rings sectors triangles. At least 3 of each.
scene_mesh scene_mesh_torus(uint32_t rings, uint32_t sectors, const float centre[3], float radius, float tube);
// Closed: 12 triangles.
scene_mesh scene_mesh_box(const float low[3], const float high[3]);
// Open: a square of edge `size` around the centre, of 2 cells^2 triangles that face +z, with waves of height `wave`.
scene_mesh scene_mesh_sheet(uint32_t cells, const float centre[3], float size, float wave);
// Closed, and runs through itself: two tubes with flat ends, one along x and one along y, of length `size` and a quarter of that
// as their diameter. 8 sectors triangles.
scene_mesh scene_mesh_tubes(uint32_t sectors, const float centre[3], float size);
// Triangles that share nothing, with edges of about `edge`, within the cube of `size` around the centre.
scene_mesh scene_mesh_soup(uint32_t triangles, uint64_t seed, const float centre[3], float size, float edge);

#endif
