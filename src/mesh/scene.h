// SPDX-License-Identifier: MIT
#ifndef FM_MESH_SCENE_H
#define FM_MESH_SCENE_H

// A scene of objects: all of their vertices as they came, in one array, and the mesh that they move to.

#include "mesh/mesh.h"

typedef struct fm_scene_object {
    uint64_t first_vertex, vertex_count;
    uint64_t first_triangle, triangle_count;
    uint64_t shape_version;  // from 1, rises whenever it is deformed
    fm_transform3 place;
    float low[3], high[3];  // of its triangles at rest, for the `shape_version` of `boxed`
    uint64_t boxed;         // 0: not known
    bool moved;             // since the last update
    bool deformed;          // likewise; then `moved` is set too
} fm_scene_object;

typedef struct fm_gpu_scene fm_gpu_scene;

struct fm_scene {
    fm_context *context;
    fm_mesh *mesh;  // of the objects of the last update
    fm_scene_object *objects;
    float (*rest)[3];          // vertices in the objects' own frames
    uint32_t (*triangles)[3];  // of the scene's vertices
    uint64_t object_count, vertex_count, triangle_count;
    uint64_t object_room, vertex_room, triangle_room;
    bool grown;         // objects were added since the last update
    fm_gpu_scene *gpu;  // gpu_scene.h's
};

// Sets what fm_mesh_bounds says of the scene's mesh, from where the objects are: for updates that the host's arrays do not follow.
void fm_scene_bound(fm_scene *scene);

// A place in a float each: ((x a + y b) + z c) + d.
static inline void fm_transform3_point(const fm_transform3 *place, const float from[3], float to[3]) {
    for (int row = 0; row < 3; row++) {
        const float *m = place->rows[row];
        to[row] = m[0] * from[0] + m[1] * from[1] + m[2] * from[2] + m[3];
    }
}

#endif
