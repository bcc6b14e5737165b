// SPDX-License-Identifier: MIT
// Scenes on Vulkan. The vertices as they came lie on the device; what an update brings, the places of the objects that have
// moved and the new vertices of those that are deformed, goes through one of a few upload buffers, so that the host waits for
// nothing.

#include "mesh/gpu_scene.h"

#include "gpu/flights.h"
#include "mesh/gpu_mesh.h"

#include <string.h>

struct fm_gpu_scene {
    fm_gpu *gpu;
    fm_buffer *rest;
    fm_flights flights;
};

// What an upload buffer holds: runs, places, vertices.
typedef struct cargo {
    uint64_t runs, moved;  // numbers
    uint64_t places_at, vertices_at, bytes;
} cargo;

void fm_gpu_scene_destroy(fm_scene *scene) {
    struct fm_gpu_scene *own = scene->gpu;
    if (!own) {
        return;
    }
    (void)fm_gpu_wait(own->gpu, fm_gpu_newest(own->gpu));
    fm_buffer_destroy(own->rest);
    fm_flights_destroy(&own->flights);
    fm_free(&scene->context->allocator, own, sizeof *own);
    scene->gpu = NULL;
}

// The vertices of all objects as they are now, after which none is new to the device.
static fm_result create(fm_scene *scene) {
    struct fm_gpu_scene *own = fm_alloc_zero(&scene->context->allocator, sizeof *own, "a scene on the device");
    if (!own) {
        return FM_ERROR_OUT_OF_HOST_MEMORY;
    }
    own->gpu = scene->context->gpu;
    scene->gpu = own;
    const uint64_t bytes = scene->vertex_count * sizeof *scene->rest;
    fm_result status = fm_buffer_create(own->gpu, FM_PURPOSE_MESHES, fm_max_u64(bytes, 16), false, &own->rest);
    if (status == FM_OK && bytes > 0) {
        status = fm_buffer_upload_at(own->rest, 0, scene->rest, bytes);
    }
    if (status != FM_OK) {
        fm_gpu_scene_destroy(scene);
    }
    return status;
}

static cargo measure(const fm_scene *scene) {
    cargo c = {0};
    uint64_t vertices = 0;
    for (uint64_t i = 0; i < scene->object_count; i++) {
        const fm_scene_object *object = &scene->objects[i];
        if (object->moved) {
            c.moved++;
            c.runs += fm_div_up(object->vertex_count, FM_SCENE_RUN);
            vertices += object->deformed ? object->vertex_count : 0;
        }
    }
    c.places_at = c.runs * sizeof(fm_gpu_run);
    c.vertices_at = c.places_at + c.moved * sizeof(fm_transform3);
    c.bytes = c.vertices_at + vertices * sizeof(float[3]);
    return c;
}

static fm_gpu_run *write_runs(const fm_scene_object *object, uint32_t place, fm_gpu_run *run) {
    for (uint64_t done = 0; done < object->vertex_count; done += FM_SCENE_RUN) {
        *run++ = (fm_gpu_run){.first = (uint32_t)(object->first_vertex + done),
                              .count = (uint32_t)fm_min_u64(object->vertex_count - done, FM_SCENE_RUN),
                              .place = place};
    }
    return run;
}

// Fills the upload buffer and records the copies out of it.
static void load(const fm_scene *scene, fm_slot *slot, const fm_flight *f, const cargo *c) {
    const struct fm_gpu_scene *own = scene->gpu;
    char *memory = fm_buffer_mapped(f->buffer);
    fm_gpu_run *run = (fm_gpu_run *)(void *)memory;
    uint32_t place = 0;
    uint64_t at = c->vertices_at;
    for (uint64_t i = 0; i < scene->object_count; i++) {
        const fm_scene_object *object = &scene->objects[i];
        if (!object->moved) {
            continue;
        }
        run = write_runs(object, place, run);
        memcpy(memory + c->places_at + place++ * sizeof object->place, &object->place, sizeof object->place);
        if (object->deformed) {
            const uint64_t bytes = object->vertex_count * sizeof *scene->rest;
            memcpy(memory + at, scene->rest + object->first_vertex, bytes);
            fm_commands_copy(own->gpu, slot, f->buffer, at, own->rest, object->first_vertex * sizeof *scene->rest, bytes);
            at += bytes;
        }
    }
    fm_commands_barrier(own->gpu, slot);
}

static fm_result record(const fm_scene *scene, fm_slot *slot, const fm_flight *f, const cargo *c) {
    const struct fm_gpu_scene *own = scene->gpu;
    const fm_address upload = fm_buffer_address(f->buffer);
    const fm_scene_push push = {.rest = fm_buffer_address(own->rest),
                                .vertices = fm_gpu_mesh_vertices(scene->mesh),
                                .runs = upload,
                                .places = upload + c->places_at,
                                .run_count = (uint32_t)c->runs};
    const fm_dispatch dispatch = {.kernel = FM_KERNEL_SCENE_MOVE, .push = &push, .push_bytes = sizeof push, .groups = c->runs};
    load(scene, slot, f, c);
    FM_TRY(fm_commands_dispatch(own->gpu, slot, &dispatch));
    fm_commands_pass(own->gpu, slot, "scene", c->runs * (sizeof(fm_gpu_run) + FM_SCENE_RUN * UINT64_C(24)));
    fm_gpu_mesh_touch(scene->mesh);
    return fm_gpu_mesh_tree(scene->mesh, slot, true);
}

fm_result fm_gpu_scene_update(fm_scene *scene, fm_ticket *ticket) {
    if (!scene->gpu) {
        FM_TRY(create(scene));
    }
    struct fm_gpu_scene *own = scene->gpu;
    const cargo c = measure(scene);
    if (c.runs == 0) {
        return FM_OK;
    }
    fm_flight *f;
    FM_TRY(fm_flights_take(&own->flights, own->gpu, FM_PURPOSE_UPLOAD, c.bytes, &f));
    fm_slot *slot;
    fm_ticket done;
    FM_TRY(fm_commands_begin(own->gpu, &slot));
    fm_result status = record(scene, slot, f, &c);
    if (status == FM_OK) {
        status = fm_commands_submit(own->gpu, slot, &done);
    }
    if (status != FM_OK) {
        fm_gpu_mesh_forget(scene->mesh);
        return status;
    }
    fm_flights_sent(&own->flights, done);
    if (!ticket) {
        return fm_gpu_wait(own->gpu, done);
    }
    *ticket = done;
    return FM_OK;
}
