// SPDX-License-Identifier: MIT
// Pictures of octrees on Vulkan: beams, first rays and second rays, a kernel each.

#include "gpu/compute.h"
#include "render/octree_picture.h"

#include <string.h>

enum { IN_FLIGHT = 3, BEAM_THREADS = 32, BUFFERS = 4 };

// Where pictures of a size go: pixels, seconds, beams, picture.
typedef struct room {
    fm_buffer *pixels, *seconds, *beams, *picture;
} room;

struct fm_gpu_octree_renderer {
    fm_gpu *gpu;
    room room;
    fm_buffer *scenes[IN_FLIGHT];
    fm_ticket tickets[IN_FLIGHT];
    uint32_t next;
};

fm_result fm_gpu_octree_picture_create(fm_octree_renderer *renderer) {
    fm_gpu_octree_renderer *own = fm_alloc_zero(&renderer->context->allocator, sizeof *own, "a renderer of octrees");
    if (!own) {
        return FM_ERROR_OUT_OF_HOST_MEMORY;
    }
    renderer->gpu = own;
    own->gpu = renderer->context->gpu;
    for (int i = 0; i < IN_FLIGHT; i++) {
        FM_TRY(fm_buffer_create(own->gpu, FM_PURPOSE_UPLOAD, sizeof(fm_octree_scene), false, &own->scenes[i]));
    }
    return FM_OK;
}

static void destroy_room(const room *r) {
    fm_buffer_destroy(r->pixels);
    fm_buffer_destroy(r->seconds);
    fm_buffer_destroy(r->beams);
    fm_buffer_destroy(r->picture);
}

void fm_gpu_octree_picture_destroy(fm_octree_renderer *renderer) {
    fm_gpu_octree_renderer *own = renderer->gpu;
    if (!own) {
        return;
    }
    // A lost device has nothing in flight.
    (void)fm_gpu_wait(own->gpu, fm_gpu_newest(own->gpu));
    for (int i = 0; i < IN_FLIGHT; i++) {
        fm_buffer_destroy(own->scenes[i]);
    }
    destroy_room(&own->room);
    fm_free(&renderer->context->allocator, own, sizeof *own);
    renderer->gpu = NULL;
}

static uint64_t tiles_of(uint64_t width, uint64_t height) {
    return fm_div_up(width, FM_OCTREE_TILE) * fm_div_up(height, FM_OCTREE_TILE);
}

static fm_result make_room(const fm_gpu_octree_renderer *own, uint64_t width, uint64_t height, room *made) {
    *made = (room){0};
    fm_buffer **buffers[BUFFERS] = {&made->pixels, &made->seconds, &made->beams, &made->picture};
    const uint64_t pixels = width * height,
                   bytes[BUFFERS] = {sizeof(fm_octree_pixel) * pixels, 8 * pixels, 8 * tiles_of(width, height), 4 * pixels};
    for (int i = 0; i < BUFFERS; i++) {
        const fm_result status = fm_buffer_create(own->gpu, FM_PURPOSE_PICTURES, bytes[i], false, buffers[i]);
        if (status != FM_OK) {
            destroy_room(made);
            return status;
        }
    }
    return FM_OK;
}

typedef struct work {
    fm_gpu_octree_renderer *own;
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
    return fm_commands_dispatch(w->own->gpu, w->slot, &what);
}

static fm_result record_picture(const work *w, const fm_octree_picture *picture) {
    const fm_octree_render_desc *desc = &picture->desc;
    const fm_octree_head *head = &picture->octree->head;
    const uint64_t pixels = (uint64_t)desc->width * desc->height, tiles = tiles_of(desc->width, desc->height);
    const uint32_t kind = (uint32_t)head->kind, code = (uint32_t)head->code, stepped = (uint32_t)picture->scene.stepped;
    const uint32_t streamed = picture->scene.grid.parts != 0;
    const uint32_t first[7] = {kind, code, stepped, streamed, desc->view, picture->beams, picture->second};
    if (picture->beams) {
        FM_TRY(dispatch(w, FM_KERNEL_OCTREE_BEAM, first, fm_div_up(tiles, BEAM_THREADS)));
        fm_commands_pass(w->own->gpu, w->slot, "beams", 8 * tiles);
    }
    FM_TRY(dispatch(w, FM_KERNEL_OCTREE_PRIMARY, first, tiles));
    fm_commands_pass(w->own->gpu, w->slot, "primary", pixels * (sizeof(fm_octree_pixel) + (picture->second ? 0 : 4)));
    if (picture->second) {
        const uint32_t second[7] = {kind, code, stepped, streamed, desc->shadow, desc->reflection > 0, desc->refraction > 0};
        FM_TRY(dispatch(w, FM_KERNEL_OCTREE_SECOND, second, tiles));
        fm_commands_pass(w->own->gpu, w->slot, "second", pixels * (sizeof(fm_octree_pixel) + 4));
    }
    return FM_OK;
}

static fm_result submit(fm_octree_renderer *renderer, fm_octree_picture *picture, const room *to, fm_ticket *ticket) {
    fm_gpu_octree_renderer *own = renderer->gpu;
    const uint32_t at = own->next;
    FM_TRY(fm_gpu_wait(own->gpu, own->tickets[at]));
    fm_octree_scene *scene = &picture->scene;
    FM_TRY(fm_gpu_octree_head(picture->octree, &scene->head));
    scene->pixels = fm_buffer_address(to->pixels);
    scene->seconds = picture->desc.count ? fm_buffer_address(to->seconds) : 0;
    scene->beams = fm_buffer_address(to->beams);
    scene->picture = fm_buffer_address(to->picture);
    memcpy(fm_buffer_mapped(own->scenes[at]), scene, sizeof *scene);
    work w = {.own = own, .push = {.scene = fm_buffer_address(own->scenes[at])}};
    FM_TRY(fm_commands_begin(own->gpu, &w.slot));
    FM_TRY(record_picture(&w, picture));
    FM_TRY(fm_commands_submit(own->gpu, w.slot, ticket));
    own->tickets[at] = *ticket;
    own->next = (at + 1) % IN_FLIGHT;
    return FM_OK;
}

fm_result fm_gpu_octree_picture(fm_octree_renderer *renderer, fm_octree_picture *picture, fm_ticket *ticket) {
    fm_gpu_octree_renderer *own = renderer->gpu;
    const uint32_t width = picture->desc.width, height = picture->desc.height;
    if (renderer->width == width && renderer->height == height) {
        return submit(renderer, picture, &own->room, ticket);
    }
    // The newest picture stays where it is until another one is sure to come.
    room made;
    FM_TRY(make_room(own, width, height, &made));
    const fm_ticket before = fm_gpu_newest(own->gpu);
    const fm_result status = submit(renderer, picture, &made, ticket);
    if (status != FM_OK) {
        destroy_room(&made);
        return status;
    }
    (void)fm_gpu_wait(own->gpu, before);
    destroy_room(&own->room);
    own->room = made;
    return FM_OK;
}

fm_result fm_gpu_octree_picture_read(fm_octree_renderer *renderer, uint8_t *pixels) {
    return fm_buffer_download_at(renderer->gpu->room.picture, 0, pixels, 4 * (uint64_t)renderer->width * renderer->height);
}

void fm_gpu_octree_picture_describe(const fm_octree_renderer *renderer, fm_volume_buffer *buffer) {
    fm_buffer_describe(renderer->gpu->room.picture, buffer);
    buffer->size = 4 * (uint64_t)renderer->width * renderer->height;
}

fm_result fm_gpu_octree_picture_words(fm_octree_renderer *renderer, fm_octree_pixel *pixels, uint32_t (*seconds)[2],
                                      uint32_t (*beams)[2]) {
    const room *r = &renderer->gpu->room;
    const uint64_t count = (uint64_t)renderer->width * renderer->height;
    FM_TRY(fm_buffer_download_at(r->pixels, 0, pixels, count * sizeof *pixels));
    if (seconds && renderer->has_seconds) {
        FM_TRY(fm_buffer_download_at(r->seconds, 0, seconds, count * sizeof *seconds));
    }
    return beams && renderer->has_beams
               ? fm_buffer_download_at(r->beams, 0, beams, tiles_of(renderer->width, renderer->height) * sizeof *beams)
               : FM_OK;
}
