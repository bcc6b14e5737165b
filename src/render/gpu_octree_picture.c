// SPDX-License-Identifier: MIT
// Pictures of octrees on Vulkan: beams, first rays and second rays, a kernel each.

#include "gpu/compute.h"
#include "render/gpu_frames.h"
#include "render/octree_picture.h"

#include <string.h>

enum { BEAM_THREADS = 32 };

// Buffers of a picture.
enum { PIXELS, SECONDS, BEAMS, PICTURE };

struct fm_gpu_octree_renderer {
    fm_gpu_frames frames;
};

fm_result fm_gpu_octree_picture_create(fm_octree_renderer *renderer) {
    renderer->gpu = fm_alloc_zero(&renderer->context->allocator, sizeof *renderer->gpu, "a renderer of octrees");
    if (!renderer->gpu) {
        return FM_ERROR_OUT_OF_HOST_MEMORY;
    }
    renderer->gpu->frames.gpu = renderer->context->gpu;
    return FM_OK;
}

void fm_gpu_octree_picture_destroy(fm_octree_renderer *renderer) {
    if (renderer->gpu) {
        fm_gpu_frames_destroy(&renderer->gpu->frames);
        fm_free(&renderer->context->allocator, renderer->gpu, sizeof *renderer->gpu);
        renderer->gpu = NULL;
    }
}

static uint64_t tiles_of(uint64_t width, uint64_t height) {
    return fm_div_up(width, FM_OCTREE_TILE) * fm_div_up(height, FM_OCTREE_TILE);
}

typedef struct work {
    fm_gpu *gpu;
    fm_octree_picture *picture;
    fm_slot *slot;
    fm_octree_picture_push push;
} work;

static fm_result dispatch(const work *w, fm_kernel kernel, const uint32_t constants[7], uint64_t groups) {
    const fm_dispatch what = {.kernel = kernel,
                              .constants = constants,
                              .constant_count = kernel == FM_KERNEL_OCTREE_BEAM ? 4 : 7,
                              .push = &w->push,
                              .push_bytes = sizeof w->push,
                              .groups = groups};
    return fm_commands_dispatch(w->gpu, w->slot, &what);
}

static fm_result record_picture(const work *w) {
    const fm_octree_picture *picture = w->picture;
    const fm_octree_render_desc *desc = &picture->desc;
    const fm_octree_head *head = &picture->octree->head;
    const uint64_t pixels = (uint64_t)desc->width * desc->height, tiles = tiles_of(desc->width, desc->height);
    const uint32_t kind = (uint32_t)head->kind, code = (uint32_t)head->code, stepped = (uint32_t)picture->scene.stepped;
    const uint32_t streamed = picture->scene.grid.parts != 0;
    const uint32_t first[7] = {kind, code, stepped, streamed, desc->view, picture->beams, picture->second};
    if (picture->beams) {
        FM_TRY(dispatch(w, FM_KERNEL_OCTREE_BEAM, first, fm_div_up(tiles, BEAM_THREADS)));
        fm_commands_pass(w->gpu, w->slot, "beams", 8 * tiles);
    }
    FM_TRY(dispatch(w, FM_KERNEL_OCTREE_PRIMARY, first, tiles));
    fm_commands_pass(w->gpu, w->slot, "primary", pixels * (sizeof(fm_octree_pixel) + (picture->second ? 0 : 4)));
    if (picture->second) {
        const uint32_t second[7] = {kind, code, stepped, streamed, desc->shadow, desc->reflection > 0, desc->refraction > 0};
        FM_TRY(dispatch(w, FM_KERNEL_OCTREE_SECOND, second, tiles));
        fm_commands_pass(w->gpu, w->slot, "second", pixels * (sizeof(fm_octree_pixel) + 4));
    }
    return FM_OK;
}

static uint64_t address_of(const fm_gpu_room *room, int buffer) {
    return fm_buffer_address(room->buffers[buffer]);
}

static fm_result submit(void *user, const fm_gpu_room *to, const fm_flight *flight, fm_ticket *ticket) {
    work *w = user;
    fm_octree_scene *scene = &w->picture->scene;
    FM_TRY(fm_gpu_octree_head(w->picture->octree, &scene->head));
    scene->pixels = address_of(to, PIXELS);
    scene->seconds = w->picture->desc.count && w->picture->second ? address_of(to, SECONDS) : 0;
    scene->beams = address_of(to, BEAMS);
    scene->picture = address_of(to, PICTURE);
    memcpy(fm_buffer_mapped(flight->buffer), scene, sizeof *scene);
    w->push.scene = fm_buffer_address(flight->buffer);
    FM_TRY(fm_commands_begin(w->gpu, &w->slot));
    FM_TRY(record_picture(w));
    return fm_commands_submit(w->gpu, w->slot, ticket);
}

fm_result fm_gpu_octree_picture(fm_octree_renderer *renderer, fm_octree_picture *picture, fm_ticket *ticket) {
    const fm_octree_render_desc *desc = &picture->desc;
    const uint64_t pixels = (uint64_t)desc->width * desc->height;
    const uint64_t bytes[FM_FRAME_BUFFERS] = {[PIXELS] = sizeof(fm_octree_pixel) * pixels,
                                              [SECONDS] = desc->count && picture->second ? 8 * pixels : 0,
                                              [BEAMS] = 8 * tiles_of(desc->width, desc->height),
                                              [PICTURE] = 4 * pixels};
    work w = {.gpu = renderer->context->gpu, .picture = picture};
    return fm_gpu_frames_picture(&renderer->gpu->frames, bytes, sizeof picture->scene, submit, &w, ticket);
}

fm_result fm_gpu_octree_picture_read(fm_octree_renderer *renderer, uint8_t *pixels) {
    return fm_buffer_download_at(renderer->gpu->frames.room.buffers[PICTURE], 0, pixels,
                                 4 * (uint64_t)renderer->width * renderer->height);
}

void fm_gpu_octree_picture_describe(const fm_octree_renderer *renderer, fm_volume_buffer *buffer) {
    fm_buffer_describe(renderer->gpu->frames.room.buffers[PICTURE], buffer);
    buffer->size = 4 * (uint64_t)renderer->width * renderer->height;
}

fm_result fm_gpu_octree_picture_words(fm_octree_renderer *renderer, fm_octree_pixel *pixels, uint32_t (*seconds)[2],
                                      uint32_t (*beams)[2]) {
    fm_buffer *const *from = renderer->gpu->frames.room.buffers;
    const uint64_t count = (uint64_t)renderer->width * renderer->height;
    FM_TRY(fm_buffer_download_at(from[PIXELS], 0, pixels, count * sizeof *pixels));
    if (seconds && renderer->has_seconds) {
        FM_TRY(fm_buffer_download_at(from[SECONDS], 0, seconds, count * sizeof *seconds));
    }
    return beams && renderer->has_beams
               ? fm_buffer_download_at(from[BEAMS], 0, beams, tiles_of(renderer->width, renderer->height) * sizeof *beams)
               : FM_OK;
}
