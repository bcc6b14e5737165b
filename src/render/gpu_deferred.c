// SPDX-License-Identifier: MIT
// Deferred pictures on Vulkan: the shadow map, surfaces, light and the picture, a kernel each.

#include "mesh/gpu_mesh.h"
#include "render/deferred.h"
#include "render/gpu_frames.h"

#include <string.h>

enum { TILE = 8 };

// Buffers of a picture.
enum { SURFACES, LIGHT, HISTORY, OTHER_HISTORY, PICTURE };

struct fm_gpu_deferred {
    fm_gpu *gpu;
    fm_gpu_frames frames;
    fm_buffer *map, *blurred;
    uint64_t map_bytes;
};

fm_result fm_gpu_deferred_create(fm_deferred *deferred) {
    fm_gpu_deferred *own = fm_alloc_zero(&deferred->context->allocator, sizeof *own, "a deferred renderer");
    if (!own) {
        return FM_ERROR_OUT_OF_HOST_MEMORY;
    }
    deferred->gpu = own;
    own->gpu = own->frames.gpu = deferred->context->gpu;
    return FM_OK;
}

void fm_gpu_deferred_destroy(fm_deferred *deferred) {
    fm_gpu_deferred *own = deferred->gpu;
    if (!own) {
        return;
    }
    fm_gpu_frames_destroy(&own->frames);
    fm_buffer_destroy(own->map);
    fm_buffer_destroy(own->blurred);
    fm_free(&deferred->context->allocator, own, sizeof *own);
    deferred->gpu = NULL;
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
    const fm_deferred *deferred;
    fm_deferred_picture *picture;
    fm_gpu *gpu;
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
    return fm_commands_dispatch(w->gpu, w->slot, &what);
}

static uint64_t tiles_of(uint64_t width, uint64_t height) {
    return fm_div_up(width, TILE) * fm_div_up(height, TILE);
}

static fm_result record_map(const work *w, uint64_t edge) {
    const uint64_t groups = FM_CASCADES * tiles_of(edge, edge), bytes = FM_CASCADES * edge * edge * 4 * FM_MAP_FLOATS;
    FM_TRY(dispatch(w, FM_KERNEL_DEFER_MAP, NULL, 0, groups));
    for (uint32_t down = 0; down < 2; down++) {
        fm_commands_barrier(w->gpu, w->slot);
        FM_TRY(dispatch(w, FM_KERNEL_DEFER_BLUR, &down, 1, groups));
    }
    fm_commands_pass(w->gpu, w->slot, "map", 5 * bytes);
    return FM_OK;
}

static fm_result record_picture(const work *w, const fm_deferred_desc *desc) {
    const uint64_t pixels = (uint64_t)desc->width * desc->height, groups = tiles_of(desc->width, desc->height);
    if (desc->shadows == FM_SHADOWS_MAP) {
        FM_TRY(record_map(w, desc->map_edge));
    }
    FM_TRY(dispatch(w, FM_KERNEL_DEFER_SURFACE, &(const uint32_t){desc->surface}, 1, groups));
    fm_commands_pass(w->gpu, w->slot, "surface", pixels * sizeof(fm_defer_surface));
    FM_TRY(dispatch(w, FM_KERNEL_DEFER_LIGHT, (const uint32_t[]){desc->shadows, desc->view}, 2, groups));
    fm_commands_pass(w->gpu, w->slot, "light", pixels * (sizeof(fm_defer_surface) + 16));
    FM_TRY(dispatch(w, FM_KERNEL_DEFER_RESOLVE, NULL, 0, groups));
    fm_commands_pass(w->gpu, w->slot, "resolve", pixels * (sizeof(fm_defer_surface) + 36));
    return FM_OK;
}

static uint64_t address_of(const fm_gpu_room *room, int buffer) {
    return fm_buffer_address(room->buffers[buffer]);
}

static void set_addresses(const fm_deferred *deferred, const fm_deferred_desc *desc, const fm_gpu_room *to, fm_defer_scene *scene) {
    const fm_gpu_deferred *own = deferred->gpu;
    if (desc->mesh) {
        scene->mesh = fm_gpu_mesh_refs(desc->mesh);
    }
    scene->field = desc->field ? fm_buffer_address(desc->field->buffer) : 0;
    scene->surfaces = address_of(to, SURFACES);
    scene->light = address_of(to, LIGHT);
    scene->history = address_of(to, deferred->history ? OTHER_HISTORY : HISTORY);
    scene->next_history = address_of(to, deferred->history ? HISTORY : OTHER_HISTORY);
    scene->picture = address_of(to, PICTURE);
    scene->map = own->map ? fm_buffer_address(own->map) : 0;
    scene->blurred = own->blurred ? fm_buffer_address(own->blurred) : 0;
}

static fm_result record(work *w, const fm_gpu_room *to, fm_buffer *scene) {
    fm_deferred_picture *picture = w->picture;
    if (picture->desc.mesh) {
        FM_TRY(fm_gpu_mesh_tree(picture->desc.mesh, w->slot, true));
    }
    set_addresses(w->deferred, &picture->desc, to, &picture->scene);
    memcpy(fm_buffer_mapped(scene), &picture->scene, sizeof picture->scene);
    w->push.scene = fm_buffer_address(scene);
    return record_picture(w, &picture->desc);
}

static fm_result submit(void *user, const fm_gpu_room *to, const fm_flight *scene, fm_ticket *ticket) {
    work *w = user;
    FM_TRY(fm_commands_begin(w->gpu, &w->slot));
    fm_result status = record(w, to, scene->buffer);
    status = status == FM_OK ? fm_commands_submit(w->gpu, w->slot, ticket) : status;
    if (status != FM_OK && w->picture->desc.mesh) {
        fm_gpu_mesh_forget(w->picture->desc.mesh);
    }
    return status;
}

fm_result fm_gpu_deferred_picture(fm_deferred *deferred, fm_deferred_picture *picture, fm_ticket *ticket) {
    fm_gpu_deferred *own = deferred->gpu;
    fm_deferred_desc *desc = &picture->desc;
    desc->map_edge = picture->scene.map_edge;
    if (desc->shadows == FM_SHADOWS_MAP) {
        FM_TRY(make_map(own, FM_CASCADES * (uint64_t)desc->map_edge * desc->map_edge * 4 * FM_MAP_FLOATS));
    }
    const uint64_t pixels = (uint64_t)desc->width * desc->height;
    const uint64_t bytes[FM_FRAME_BUFFERS] = {[SURFACES] = sizeof(fm_defer_surface) * pixels,
                                              [LIGHT] = 16 * pixels,
                                              [HISTORY] = 16 * pixels,
                                              [OTHER_HISTORY] = 16 * pixels,
                                              [PICTURE] = 4 * pixels};
    work w = {.deferred = deferred, .picture = picture, .gpu = own->gpu};
    return fm_gpu_frames_picture(&own->frames, bytes, sizeof picture->scene, submit, &w, ticket);
}

static uint64_t pixels_of(const fm_deferred *deferred) {
    return (uint64_t)deferred->width * deferred->height;
}

fm_result fm_gpu_deferred_read(fm_deferred *deferred, uint8_t *pixels) {
    return fm_buffer_download_at(deferred->gpu->frames.room.buffers[PICTURE], 0, pixels, 4 * pixels_of(deferred));
}

void fm_gpu_deferred_describe(const fm_deferred *deferred, fm_volume_buffer *buffer) {
    fm_buffer_describe(deferred->gpu->frames.room.buffers[PICTURE], buffer);
    buffer->size = 4 * pixels_of(deferred);
}

fm_result fm_gpu_deferred_surfaces(fm_deferred *deferred, fm_defer_surface *surfaces) {
    return fm_buffer_download_at(deferred->gpu->frames.room.buffers[SURFACES], 0, surfaces, sizeof *surfaces * pixels_of(deferred));
}

fm_result fm_gpu_deferred_lights(fm_deferred *deferred, float *light) {
    return fm_buffer_download_at(deferred->gpu->frames.room.buffers[LIGHT], 0, light, 16 * pixels_of(deferred));
}
