// SPDX-License-Identifier: MIT
#include "mesh/scene.h"

#include "gpu/gpu.h"
#include "mesh/gpu_scene.h"

#include <inttypes.h>
#include <string.h>

static const uint64_t MOST_TRIANGLES = (UINT64_C(1) << 31) - 1;

fm_result fm_scene_create(fm_context *context, fm_scene **result) {
    if (!context || !result) {
        return fm_fail(FM_ERROR_INVALID_ARGUMENT, "%s is NULL", context ? "scene" : "context");
    }
    fm_scene *scene = fm_mesh_alloc_zero(context, sizeof *scene, "a scene");
    if (!scene) {
        return FM_ERROR_OUT_OF_HOST_MEMORY;
    }
    scene->context = context;
    const fm_result status = fm_mesh_create(context, NULL, &scene->mesh);
    if (status != FM_OK) {
        fm_scene_destroy(scene);
        return status;
    }
    *result = scene;
    return FM_OK;
}

void fm_scene_destroy(fm_scene *scene) {
    if (!scene) {
        return;
    }
    fm_context *context = scene->context;
    fm_gpu_scene_destroy(scene);
    fm_mesh_destroy(scene->mesh);
    fm_mesh_free(context, scene->objects, scene->object_room * sizeof *scene->objects);
    fm_mesh_free(context, scene->rest, scene->vertex_room * sizeof *scene->rest);
    fm_mesh_free(context, scene->triangles, scene->triangle_room * sizeof *scene->triangles);
    fm_mesh_free(context, scene, sizeof *scene);
}

fm_mesh *fm_scene_mesh(fm_scene *scene) {
    return scene ? scene->mesh : NULL;
}

// Room for `count` elements in an array that has room for `*room`.
static fm_result make_room(fm_context *context, void **array, uint64_t *room, uint64_t used, uint64_t count, size_t size) {
    if (count <= *room) {
        return FM_OK;
    }
    const uint64_t wanted = fm_max_u64(count, 2 * *room);
    void *larger = fm_mesh_alloc(context, wanted * size, "a scene");
    if (!larger) {
        return FM_ERROR_OUT_OF_HOST_MEMORY;
    }
    if (used > 0) {
        memcpy(larger, *array, used * size);
    }
    fm_mesh_free(context, *array, *room * size);
    *array = larger;
    *room = wanted;
    return FM_OK;
}

static fm_result check_place(const fm_transform3 *place) {
    if (!place) {
        return fm_fail(FM_ERROR_INVALID_ARGUMENT, "place is NULL");
    }
    for (int row = 0; row < 3; row++) {
        for (int column = 0; column < 4; column++) {
            if (!isfinite(place->rows[row][column])) {
                return fm_fail(FM_ERROR_INVALID_ARGUMENT, "place: row %d, column %d is %g: a finite number is needed", row, column,
                               (double)place->rows[row][column]);
            }
        }
    }
    return FM_OK;
}

static fm_result check_object(const fm_scene *scene, uint32_t object) {
    if (!scene) {
        return fm_fail(FM_ERROR_INVALID_ARGUMENT, "scene is NULL");
    }
    if (object >= scene->object_count) {
        return fm_fail(FM_ERROR_INVALID_ARGUMENT, "object is %u: the scene has %" PRIu64, object, scene->object_count);
    }
    return FM_OK;
}

static fm_result check_added(const fm_scene *scene, const fm_mesh *mesh) {
    if (!scene || !mesh) {
        return fm_fail(FM_ERROR_INVALID_ARGUMENT, "%s is NULL", scene ? "mesh" : "scene");
    }
    if (mesh->context != scene->context) {
        return fm_fail(FM_ERROR_INVALID_ARGUMENT, "mesh is of another context than the scene");
    }
    if (mesh->vertex_count > UINT32_MAX - scene->vertex_count) {
        return fm_fail(FM_ERROR_INVALID_ARGUMENT, "the scene would have %" PRIu64 " vertices: at most %u",
                       mesh->vertex_count + scene->vertex_count, UINT32_MAX);
    }
    if (mesh->triangle_count > MOST_TRIANGLES - scene->triangle_count) {
        return fm_fail(FM_ERROR_INVALID_ARGUMENT, "the scene would have %" PRIu64 " triangles: at most %" PRIu64,
                       mesh->triangle_count + scene->triangle_count, MOST_TRIANGLES);
    }
    return FM_OK;
}

fm_result fm_scene_add(fm_scene *scene, const fm_mesh *mesh, const fm_transform3 *place, uint32_t *object) {
    FM_TRY(check_added(scene, mesh));
    FM_TRY(check_place(place));
    fm_context *context = scene->context;
    const uint64_t vertices = scene->vertex_count, triangles = scene->triangle_count;
    FM_TRY(make_room(context, (void **)&scene->objects, &scene->object_room, scene->object_count, scene->object_count + 1,
                     sizeof *scene->objects));
    FM_TRY(make_room(context, (void **)&scene->rest, &scene->vertex_room, vertices, vertices + mesh->vertex_count,
                     sizeof *scene->rest));
    FM_TRY(make_room(context, (void **)&scene->triangles, &scene->triangle_room, triangles, triangles + mesh->triangle_count,
                     sizeof *scene->triangles));
    for (uint64_t i = 0; i < mesh->vertex_count; i++) {
        memcpy(scene->rest[vertices + i], mesh->vertices[i], sizeof *scene->rest);
    }
    for (uint64_t i = 0; i < mesh->triangle_count; i++) {
        for (int k = 0; k < 3; k++) {
            scene->triangles[triangles + i][k] = (uint32_t)vertices + mesh->triangles[i][k];
        }
    }
    if (object) {
        *object = (uint32_t)scene->object_count;
    }
    scene->objects[scene->object_count++] = (fm_scene_object){.first_vertex = vertices,
                                                              .vertex_count = mesh->vertex_count,
                                                              .first_triangle = triangles,
                                                              .triangle_count = mesh->triangle_count,
                                                              .shape_version = 1,
                                                              .place = *place,
                                                              .moved = true};
    scene->vertex_count += mesh->vertex_count;
    scene->triangle_count += mesh->triangle_count;
    scene->grown = true;
    return FM_OK;
}

fm_result fm_scene_move(fm_scene *scene, uint32_t object, const fm_transform3 *place) {
    FM_TRY(check_object(scene, object));
    FM_TRY(check_place(place));
    fm_scene_object *moved = &scene->objects[object];
    moved->moved |= memcmp(&moved->place, place, sizeof *place) != 0;
    moved->place = *place;
    return FM_OK;
}

fm_result fm_scene_deform(fm_scene *scene, uint32_t object, const float (*vertices)[3]) {
    FM_TRY(check_object(scene, object));
    fm_scene_object *deformed = &scene->objects[object];
    if (!vertices && deformed->vertex_count > 0) {
        return fm_fail(FM_ERROR_INVALID_ARGUMENT, "vertices is NULL: %" PRIu64 " positions are needed", deformed->vertex_count);
    }
    if (deformed->vertex_count > 0) {
        memcpy(scene->rest[deformed->first_vertex], vertices, deformed->vertex_count * sizeof *vertices);
        deformed->moved = deformed->deformed = true;
        deformed->shape_version++;
    }
    return FM_OK;
}

// ---------------------------------------------------------------------------------------------------------------------------
// Updates
// ---------------------------------------------------------------------------------------------------------------------------

typedef struct move_job {
    const fm_scene_object *object;
    const float (*from)[3];
    float (*to)[3];
} move_job;

static void move_vertices(void *user, uint64_t begin, uint64_t end, uint32_t worker) {
    (void)worker;
    const move_job *job = user;
    for (uint64_t i = begin; i < end; i++) {
        fm_transform3_point(&job->object->place, job->from[i], job->to[i]);
    }
}

static void move_object(const fm_scene *scene, const fm_scene_object *object, float (*vertices)[3]) {
    if (object->vertex_count == 0) {
        return;
    }
    move_job job = {object, (const float(*)[3])scene->rest + object->first_vertex, vertices + object->first_vertex};
    fm_pool_run(scene->context->pool, object->vertex_count, 4096, move_vertices, &job);
}

// A mesh of all objects where they are now: two of one shape must not lie in one place, where their edges would be joined.
static fm_result grow(fm_scene *scene) {
    fm_context *context = scene->context;
    const uint64_t bytes = scene->vertex_count * sizeof *scene->rest;
    float(*placed)[3] = fm_mesh_alloc(context, bytes, "a scene");
    if (!placed) {
        return FM_ERROR_OUT_OF_HOST_MEMORY;
    }
    for (uint64_t i = 0; i < scene->object_count; i++) {
        move_object(scene, &scene->objects[i], placed);
    }
    const fm_mesh_desc desc = {(const float(*)[3])placed, scene->vertex_count, (const uint32_t(*)[3])scene->triangles,
                               scene->triangle_count};
    fm_mesh *mesh;
    const fm_result status = fm_mesh_create(context, &desc, &mesh);
    fm_mesh_free(context, placed, bytes);
    FM_TRY(status);
    fm_gpu_scene_destroy(scene);
    fm_mesh_destroy(scene->mesh);
    scene->mesh = mesh;
    scene->grown = false;
    return FM_OK;
}

static void settle(fm_scene *scene) {
    for (uint64_t i = 0; i < scene->object_count; i++) {
        scene->objects[i].moved = scene->objects[i].deformed = false;
    }
}

static fm_result move_all(fm_scene *scene, fm_tree tree, fm_ticket *ticket) {
    fm_mesh *mesh = scene->mesh;
    bool any = false;
    for (uint64_t i = 0; i < scene->object_count; i++) {
        any |= scene->objects[i].moved;
    }
    if (!any) {
        return FM_OK;
    }
    mesh->rebuild_version = tree == FM_TREE_REBUILD ? mesh->version + 1 : mesh->rebuild_version;
    if (mesh->gpu) {
        FM_TRY(fm_gpu_scene_update(scene, ticket));
        fm_scene_bound(scene);
        return FM_OK;
    }
    for (uint64_t i = 0; i < scene->object_count; i++) {
        if (scene->objects[i].moved) {
            move_object(scene, &scene->objects[i], mesh->vertices);
        }
    }
    mesh->version++;
    mesh->host_version++;
    return FM_OK;
}

fm_result fm_scene_update(fm_scene *scene, fm_tree tree, fm_ticket *ticket) {
    if (!scene) {
        return fm_fail(FM_ERROR_INVALID_ARGUMENT, "scene is NULL");
    }
    if ((unsigned)tree > FM_TREE_REBUILD) {
        return fm_fail(FM_ERROR_INVALID_ARGUMENT, "tree is %d: one of FM_TREE_REFIT, FM_TREE_REBUILD", (int)tree);
    }
    fm_ticket done = scene->context->gpu ? fm_gpu_newest(scene->context->gpu) : 0;
    FM_TRY(scene->grown ? grow(scene) : move_all(scene, tree, ticket ? &done : NULL));
    settle(scene);
    if (ticket) {
        *ticket = done;
    }
    return FM_OK;
}
