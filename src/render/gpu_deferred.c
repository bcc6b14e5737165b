// SPDX-License-Identifier: MIT
// Deferred pictures on Vulkan: the shadow map, surfaces, light and the picture, a kernel each.

#include "mesh/gpu_mesh.h"
#include "render/deferred.h"

#include <string.h>

enum { IN_FLIGHT = 3, TILE = 8 };

// Where pictures of a size go.
typedef struct room {
    fm_buffer *surfaces, *light, *history[2], *picture;
} room;

struct fm_gpu_deferred {
    fm_gpu *gpu;
    room room;
    fm_buffer *map, *blurred;
    uint64_t map_bytes;
    fm_buffer *scenes[IN_FLIGHT];
    fm_ticket tickets[IN_FLIGHT];
    uint32_t next;
};

fm_result fm_gpu_deferred_create(fm_deferred *deferred) {
    fm_gpu_deferred *own = fm_alloc_zero(&deferred->context->allocator, sizeof *own, "a deferred renderer");
    if (!own) {
        return FM_ERROR_OUT_OF_HOST_MEMORY;
    }
    deferred->gpu = own;
    own->gpu = deferred->context->gpu;
    for (int i = 0; i < IN_FLIGHT; i++) {
        FM_TRY(fm_buffer_create(own->gpu, FM_PURPOSE_UPLOAD, sizeof(fm_defer_scene), false, &own->scenes[i]));
    }
    return FM_OK;
}

static void destroy_room(const room *r) {
    fm_buffer_destroy(r->surfaces);
    fm_buffer_destroy(r->light);
    fm_buffer_destroy(r->history[0]);
    fm_buffer_destroy(r->history[1]);
    fm_buffer_destroy(r->picture);
}

void fm_gpu_deferred_destroy(fm_deferred *deferred) {
    fm_gpu_deferred *own = deferred->gpu;
    if (!own) {
        return;
    }
    // A lost device has nothing in flight.
    (void)fm_gpu_wait(own->gpu, fm_gpu_newest(own->gpu));
    for (int i = 0; i < IN_FLIGHT; i++) {
        fm_buffer_destroy(own->scenes[i]);
    }
    destroy_room(&own->room);
    fm_buffer_destroy(own->map);
    fm_buffer_destroy(own->blurred);
    fm_free(&deferred->context->allocator, own, sizeof *own);
    deferred->gpu = NULL;
}

static fm_result make_room(const fm_gpu_deferred *own, uint64_t pixels, room *made) {
    *made = (room){0};
    fm_buffer **buffers[] = {&made->surfaces, &made->light, &made->history[0], &made->history[1], &made->picture};
    const uint64_t bytes[] = {sizeof(fm_defer_surface), 16, 16, 16, 4};
    for (int i = 0; i < 5; i++) {
        const fm_result status = fm_buffer_create(own->gpu, FM_PURPOSE_PICTURES, bytes[i] * pixels, false, buffers[i]);
        if (status != FM_OK) {
            destroy_room(made);
            return status;
        }
    }
    return FM_OK;
}

// The map is made anew for each picture, so that nothing is kept of it but its memory.
static fm_result make_map(fm_gpu_deferred *own, uint64_t bytes) {
    if (own->map_bytes >= bytes) {
        return FM_OK;
    }
    FM_TRY(fm_gpu_wait(own->gpu, fm_gpu_newest(own->gpu)));
    fm_buffer_destroy(own->map);
    fm_buffer_destroy(own->blurred);
    own->map = own->blurred = NULL;
    own->map_bytes = 0;
    FM_TRY(fm_buffer_create(own->gpu, FM_PURPOSE_PICTURES, bytes, false, &own->map));
    FM_TRY(fm_buffer_create(own->gpu, FM_PURPOSE_PICTURES, bytes, false, &own->blurred));
    own->map_bytes = bytes;
    return FM_OK;
}

typedef struct work {
    fm_gpu_deferred *own;
    fm_slot *slot;
    fm_defer_push push;
} work;

static fm_result dispatch(const work *w, fm_kernel kernel, const uint32_t *constants, uint32_t count, uint64_t groups) {
    const fm_dispatch what = {.kernel = kernel,
                              .constants = constants,
                              .constant_count = count,
                              .push = &w->push,
                              .push_bytes = sizeof w->push,
                              .groups = groups};
    return fm_commands_dispatch(w->own->gpu, w->slot, &what);
}

static uint64_t tiles_of(uint64_t width, uint64_t height) {
    return fm_div_up(width, TILE) * fm_div_up(height, TILE);
}

static fm_result record_map(const work *w, uint64_t edge) {
    const uint64_t groups = FM_CASCADES * tiles_of(edge, edge), bytes = FM_CASCADES * edge * edge * 4 * FM_MAP_FLOATS;
    FM_TRY(dispatch(w, FM_KERNEL_DEFER_MAP, NULL, 0, groups));
    for (uint32_t down = 0; down < 2; down++) {
        fm_commands_barrier(w->own->gpu, w->slot);
        FM_TRY(dispatch(w, FM_KERNEL_DEFER_BLUR, &down, 1, groups));
    }
    fm_commands_pass(w->own->gpu, w->slot, "map", 5 * bytes);
    return FM_OK;
}

static fm_result record_picture(const work *w, const fm_deferred_desc *desc) {
    const uint64_t pixels = (uint64_t)desc->width * desc->height, groups = tiles_of(desc->width, desc->height);
    if (desc->shadows == FM_SHADOWS_MAP) {
        FM_TRY(record_map(w, desc->map_edge));
    }
    FM_TRY(dispatch(w, FM_KERNEL_DEFER_SURFACE, &(const uint32_t){desc->surface}, 1, groups));
    fm_commands_pass(w->own->gpu, w->slot, "surface", pixels * sizeof(fm_defer_surface));
    FM_TRY(dispatch(w, FM_KERNEL_DEFER_LIGHT, (const uint32_t[]){desc->shadows, desc->view}, 2, groups));
    fm_commands_pass(w->own->gpu, w->slot, "light", pixels * (sizeof(fm_defer_surface) + 16));
    FM_TRY(dispatch(w, FM_KERNEL_DEFER_RESOLVE, NULL, 0, groups));
    fm_commands_pass(w->own->gpu, w->slot, "resolve", pixels * (sizeof(fm_defer_surface) + 36));
    return FM_OK;
}

static void set_addresses(const fm_deferred *deferred, const fm_deferred_desc *desc, const room *to, fm_defer_scene *scene) {
    const fm_gpu_deferred *own = deferred->gpu;
    if (desc->mesh) {
        scene->mesh = fm_gpu_mesh_refs(desc->mesh);
    }
    scene->field = desc->field ? fm_buffer_address(desc->field->buffer) : 0;
    scene->surfaces = fm_buffer_address(to->surfaces);
    scene->light = fm_buffer_address(to->light);
    scene->history = fm_buffer_address(to->history[deferred->history]);
    scene->next_history = fm_buffer_address(to->history[deferred->history ^ 1]);
    scene->picture = fm_buffer_address(to->picture);
    scene->map = own->map ? fm_buffer_address(own->map) : 0;
    scene->blurred = own->blurred ? fm_buffer_address(own->blurred) : 0;
}

static fm_result record(work *w, const fm_deferred *deferred, fm_deferred_picture *picture, const room *to, fm_buffer *scene) {
    if (picture->desc.mesh) {
        FM_TRY(fm_gpu_mesh_tree(picture->desc.mesh, w->slot, true));
    }
    set_addresses(deferred, &picture->desc, to, &picture->scene);
    memcpy(fm_buffer_mapped(scene), &picture->scene, sizeof picture->scene);
    w->push.scene = fm_buffer_address(scene);
    return record_picture(w, &picture->desc);
}

static fm_result submit(fm_deferred *deferred, fm_deferred_picture *picture, const room *to, fm_ticket *ticket) {
    fm_gpu_deferred *own = deferred->gpu;
    const uint32_t at = own->next;
    FM_TRY(fm_gpu_wait(own->gpu, own->tickets[at]));
    work w = {.own = own};
    FM_TRY(fm_commands_begin(own->gpu, &w.slot));
    fm_result status = record(&w, deferred, picture, to, own->scenes[at]);
    status = status == FM_OK ? fm_commands_submit(own->gpu, w.slot, ticket) : status;
    if (status != FM_OK) {
        if (picture->desc.mesh) {
            fm_gpu_mesh_forget(picture->desc.mesh);
        }
        return status;
    }
    own->tickets[at] = *ticket;
    own->next = (at + 1) % IN_FLIGHT;
    return FM_OK;
}

fm_result fm_gpu_deferred_picture(fm_deferred *deferred, fm_deferred_picture *picture, fm_ticket *ticket) {
    fm_gpu_deferred *own = deferred->gpu;
    fm_deferred_desc *desc = &picture->desc;
    desc->map_edge = picture->scene.map_edge;
    if (desc->shadows == FM_SHADOWS_MAP) {
        FM_TRY(make_map(own, FM_CASCADES * (uint64_t)desc->map_edge * desc->map_edge * 4 * FM_MAP_FLOATS));
    }
    if (deferred->width == desc->width && deferred->height == desc->height) {
        return submit(deferred, picture, &own->room, ticket);
    }
    // The newest picture stays where it is until another one is sure to come.
    room made;
    FM_TRY(make_room(own, (uint64_t)desc->width * desc->height, &made));
    const fm_ticket before = fm_gpu_newest(own->gpu);
    const fm_result status = submit(deferred, picture, &made, ticket);
    if (status != FM_OK) {
        destroy_room(&made);
        return status;
    }
    (void)fm_gpu_wait(own->gpu, before);
    destroy_room(&own->room);
    own->room = made;
    return FM_OK;
}

static uint64_t pixels_of(const fm_deferred *deferred) {
    return (uint64_t)deferred->width * deferred->height;
}

fm_result fm_gpu_deferred_read(fm_deferred *deferred, uint8_t *pixels) {
    return fm_buffer_download_at(deferred->gpu->room.picture, 0, pixels, 4 * pixels_of(deferred));
}

void fm_gpu_deferred_describe(const fm_deferred *deferred, fm_volume_buffer *buffer) {
    fm_buffer_describe(deferred->gpu->room.picture, buffer);
    buffer->size = 4 * pixels_of(deferred);
}

fm_result fm_gpu_deferred_surfaces(fm_deferred *deferred, fm_defer_surface *surfaces) {
    return fm_buffer_download_at(deferred->gpu->room.surfaces, 0, surfaces, sizeof *surfaces * pixels_of(deferred));
}

fm_result fm_gpu_deferred_lights(fm_deferred *deferred, float *light) {
    return fm_buffer_download_at(deferred->gpu->room.light, 0, light, 16 * pixels_of(deferred));
}
