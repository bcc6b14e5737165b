// SPDX-License-Identifier: MIT
// A scene of a mesh's copies, of which some turn.

#include "mesh.h"

#include <math.h>

static const double most_angle = 0.15, full_turn = 6.283185307179586;

// Two by two by two cubes, each as large as the mesh's, from its lower corner on.
fm_transform3 bench_mesh_place(const bench_mesh_case *what, uint32_t object, uint32_t pose) {
    const bench_mesh *mesh = what->mesh;
    const double size = mesh->high[0] - mesh->low[0], x = (mesh->low[0] + mesh->high[0]) / 2,
                 y = (mesh->low[1] + mesh->high[1]) / 2;
    const bool moves = object < what->moving;
    const double angle = moves ? most_angle * sin(full_turn * pose / BENCH_MESH_POSES + object) : 0, c = cos(angle), s = sin(angle);
    return (fm_transform3){{{(float)c, (float)-s, 0, (float)(x - c * x + s * y + (object & 1) * size)},
                            {(float)s, (float)c, 0, (float)(y - s * x - c * y + (object >> 1 & 1) * size)},
                            {0, 0, 1, (float)((object >> 2 & 1) * size)}}};
}

fm_volume_desc bench_mesh_grid(const bench_mesh_case *what) {
    const double cubes = bench_mesh_objects(what) > 1 ? 2 : 1;
    fm_volume_desc grid = {.shape = {what->edge, what->edge, what->edge}, .type = FM_TYPE_F32};
    for (int i = 0; i < 3; i++) {
        grid.spacing[i] = cubes * (what->mesh->high[i] - what->mesh->low[i]) / what->edge;
        grid.origin[i] = what->mesh->low[i] + grid.spacing[i] / 2;
    }
    return grid;
}

uint32_t bench_mesh_objects(const bench_mesh_case *what) {
    return what->mode == BENCH_MESH_COMPOSE || what->mode == BENCH_MESH_SCENE ? BENCH_MESH_OBJECTS : 1;
}

bool bench_mesh_scene_move(const bench_mesh_case *what, fm_scene *scene, uint32_t pose) {
    bool good = true;
    for (uint32_t object = 0; good && object < what->moving; object++) {
        const fm_transform3 place = bench_mesh_place(what, object, pose);
        good = fm_scene_move(scene, object, &place) == FM_OK;
    }
    return good;
}

fm_scene *bench_mesh_scene(const bench_mesh_case *what, fm_context *context, uint32_t pose) {
    fm_scene *scene = NULL;
    fm_mesh *mesh = bench_mesh_on(what->mesh, context, 0);
    bool good = mesh && fm_scene_create(context, &scene) == FM_OK;
    for (uint32_t object = 0; good && object < BENCH_MESH_OBJECTS; object++) {
        const fm_transform3 place = bench_mesh_place(what, object, pose);
        good = fm_scene_add(scene, mesh, &place, NULL) == FM_OK;
    }
    fm_mesh_destroy(mesh);
    if (good) {
        return scene;
    }
    fm_scene_destroy(scene);
    return NULL;
}
