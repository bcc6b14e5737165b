// SPDX-License-Identifier: MIT
// Pictures on Vulkan: beams for tiles of pixels, then one kernel from ray to pixel.

#include "render/render.h"

#include "world/gpu_world.h"

#include <stdlib.h>
#include <string.h>

enum { IN_FLIGHT = 3, BEAM_THREADS = 32 };

// What the host writes for a picture in flight, and what the kernel sums up for the host.
typedef struct frame {
    fm_buffer *extra;  // FM_EXTRA_BYTES
    fm_buffer *stats;  // FM_STATS_WORDS 32-bit words
    fm_ticket ticket;
} frame;

struct fm_gpu_render {
    fm_gpu *gpu;
    fm_buffer *picture, *beam, *pick;
    uint32_t width, height;  // of `picture` and `beam`
    frame frames[IN_FLIGHT];
    uint32_t frame;    // of the newest picture
    uint32_t counted;  // ... that was counted
};

fm_result fm_gpu_render_create(fm_renderer *renderer) {
    const fm_allocator *allocator = &renderer->context->allocator;
    fm_gpu_render *own = fm_alloc_zero(allocator, sizeof *own, "a renderer");
    if (!own) {
        return FM_ERROR_OUT_OF_HOST_MEMORY;
    }
    renderer->gpu = own;
    own->gpu = renderer->context->gpu;
    FM_TRY(fm_buffer_create(own->gpu, FM_PURPOSE_READBACK, sizeof(uint32_t[6]), false, &own->pick));
    for (int i = 0; i < IN_FLIGHT; i++) {
        frame *f = &own->frames[i];
        FM_TRY(fm_buffer_create(own->gpu, FM_PURPOSE_UPLOAD, FM_EXTRA_BYTES, false, &f->extra));
        FM_TRY(fm_buffer_create(own->gpu, FM_PURPOSE_READBACK, 4 * FM_STATS_WORDS, false, &f->stats));
        uint8_t *extra = fm_buffer_mapped(f->extra);
        const uint64_t stats = fm_buffer_address(f->stats);
        memset(extra, 0, FM_EXTRA_BYTES);
        memcpy(extra + FM_EXTRA_STATS, &stats, sizeof stats);
        memcpy(extra + FM_EXTRA_MAP, renderer->map, sizeof renderer->map);
    }
    return FM_OK;
}

void fm_gpu_render_destroy(fm_renderer *renderer) {
    fm_gpu_render *own = renderer->gpu;
    if (!own) {
        return;
    }
    // A lost device has nothing in flight.
    (void)fm_gpu_wait(own->gpu, fm_gpu_newest(own->gpu));
    for (int i = 0; i < IN_FLIGHT; i++) {
        fm_buffer_destroy(own->frames[i].extra);
        fm_buffer_destroy(own->frames[i].stats);
    }
    fm_buffer_destroy(own->picture);
    fm_buffer_destroy(own->beam);
    fm_buffer_destroy(own->pick);
    fm_free(&renderer->context->allocator, own, sizeof *own);
    renderer->gpu = NULL;
}

static uint64_t tiles_of(uint32_t width, uint32_t height) {
    return fm_div_up(width, FM_TILE) * fm_div_up(height, FM_TILE);
}

static fm_result make_room(fm_gpu_render *own, uint32_t width, uint32_t height) {
    if (own->width == width && own->height == height) {
        return FM_OK;
    }
    fm_buffer *picture, *beam;
    FM_TRY(fm_buffer_create(own->gpu, FM_PURPOSE_PICTURES, 4 * (uint64_t)width * height, false, &picture));
    fm_result status = fm_buffer_create(own->gpu, FM_PURPOSE_PICTURES, 4 * tiles_of(width, height), false, &beam);
    if (status != FM_OK) {
        fm_buffer_destroy(picture);
        return status;
    }
    (void)fm_gpu_wait(own->gpu, fm_gpu_newest(own->gpu));
    fm_buffer_destroy(own->picture);
    fm_buffer_destroy(own->beam);
    own->picture = picture;
    own->beam = beam;
    own->width = width;
    own->height = height;
    return FM_OK;
}

static void set_world(const fm_world *world, fm_march_push *push) {
    const fm_gpu_world *gpu = world->gpu;
    push->field = fm_buffer_address(gpu->field);
    push->colors = gpu->colors ? fm_buffer_address(gpu->colors) : 0;
    push->bits = fm_buffer_address(gpu->bits);
}

// Whether elements need 64 bits. Tests set the variable, for worlds of that size are not for them.
static bool is_large(const fm_world *world) {
    return fm_voxels(world->desc.shape) > UINT32_MAX || getenv("FATHOM_LARGE");
}

static fm_result dispatch(const fm_gpu_render *own, fm_slot *slot, fm_kernel kernel, const uint32_t *constants, uint32_t count,
                          const fm_march_push *push, uint64_t groups) {
    const fm_dispatch what = {.kernel = kernel,
                              .constants = constants,
                              .constant_count = count,
                              .push = push,
                              .push_bytes = sizeof *push,
                              .groups = groups};
    return fm_commands_dispatch(own->gpu, slot, &what);
}

static fm_result record(const fm_gpu_render *own, const fm_world *world, const fm_picture *picture, fm_slot *slot) {
    const fm_render_desc *desc = &picture->desc;
    fm_march_push push = picture->push;
    set_world(world, &push);
    push.picture = fm_buffer_address(own->picture);
    push.beam = fm_buffer_address(own->beam);
    push.extra = fm_buffer_address(own->frames[own->frame].extra);
    const uint64_t tiles = tiles_of(desc->width, desc->height);
    const bool beams = desc->march != FM_MARCH_PLAIN;
    const uint32_t constants[] = {world->desc.format,      desc->march,      is_large(world), desc->view,  desc->shadow,
                                  desc->ambient_occlusion, picture->preview, beams,           desc->count, desc->crosshair};
    if (beams) {
        FM_TRY(dispatch(own, slot, FM_KERNEL_MARCH_BEAM, constants, 3, &push, fm_div_up(tiles, BEAM_THREADS)));
        fm_commands_pass(own->gpu, slot, "beam", 4 * tiles);
    }
    FM_TRY(dispatch(own, slot, FM_KERNEL_MARCH, constants, sizeof constants / sizeof constants[0], &push, tiles));
    fm_commands_pass(own->gpu, slot, "march", 4 * (uint64_t)desc->width * desc->height);
    return FM_OK;
}

fm_result fm_gpu_render_picture(fm_renderer *renderer, const fm_world *world, const fm_picture *picture, fm_ticket *ticket) {
    fm_gpu_render *own = renderer->gpu;
    FM_TRY(make_room(own, picture->desc.width, picture->desc.height));
    own->frame = (own->frame + 1) % IN_FLIGHT;
    frame *f = &own->frames[own->frame];
    FM_TRY(fm_gpu_wait(own->gpu, f->ticket));
    if (picture->desc.count) {
        memset(fm_buffer_mapped(f->stats), 0, 4 * FM_STATS_WORDS);
    }
    memcpy((uint8_t *)fm_buffer_mapped(f->extra) + FM_EXTRA_BRUSH, &picture->brush, sizeof picture->brush);
    fm_slot *slot;
    FM_TRY(fm_commands_begin(own->gpu, &slot));
    FM_TRY(record(own, world, picture, slot));
    fm_ticket newest;
    FM_TRY(fm_commands_submit(own->gpu, slot, &newest));
    f->ticket = newest;
    if (picture->desc.count) {
        own->counted = own->frame;
    }
    if (ticket) {
        *ticket = newest;
        return FM_OK;
    }
    return fm_gpu_wait(own->gpu, newest);
}

fm_result fm_gpu_render_pick(fm_renderer *renderer, const fm_world *world, const fm_picture *picture, float x, float y,
                             fm_pick *pick) {
    const fm_gpu_render *own = renderer->gpu;
    fm_march_push push = picture->push;
    set_world(world, &push);
    push.picture = fm_buffer_address(own->pick);
    memcpy(&push.pixels, &x, sizeof x);
    memcpy(&push.slice, &y, sizeof y);
    const uint32_t constants[] = {world->desc.format, picture->desc.march, is_large(world)};
    fm_slot *slot;
    FM_TRY(fm_commands_begin(own->gpu, &slot));
    FM_TRY(dispatch(own, slot, FM_KERNEL_PICK, constants, 3, &push, 1));
    FM_TRY(fm_commands_submit(own->gpu, slot, NULL));
    const uint32_t *words = fm_buffer_mapped(own->pick);
    *pick = (fm_pick){.hit = words[0] != 0};
    if (pick->hit) {
        memcpy(pick->voxel, words + 1, sizeof pick->voxel);
        memcpy(&pick->face, words + 4, sizeof pick->face);
        memcpy(&pick->distance, words + 5, sizeof pick->distance);
    }
    return FM_OK;
}

fm_result fm_gpu_render_read(fm_renderer *renderer, uint8_t *pixels) {
    const fm_gpu_render *own = renderer->gpu;
    return fm_buffer_download_at(own->picture, 0, pixels, 4 * (uint64_t)own->width * own->height);
}

void fm_gpu_render_describe(const fm_renderer *renderer, fm_volume_buffer *buffer) {
    fm_buffer_describe(renderer->gpu->picture, buffer);
    buffer->size = 4 * (uint64_t)renderer->gpu->width * renderer->gpu->height;
}

fm_result fm_gpu_render_stats(fm_renderer *renderer) {
    const fm_gpu_render *own = renderer->gpu;
    const frame *f = &own->frames[own->counted];
    FM_TRY(fm_gpu_wait(own->gpu, f->ticket));
    const uint32_t *words = fm_buffer_mapped(f->stats);
    renderer->stats = (fm_render_stats){.rays = words[FM_STATS_RAYS] | (uint64_t)words[FM_STATS_RAYS + 1] << 32,
                                        .hits = words[FM_STATS_HITS] | (uint64_t)words[FM_STATS_HITS + 1] << 32,
                                        .steps = words[FM_STATS_STEPS] | (uint64_t)words[FM_STATS_STEPS + 1] << 32,
                                        .most_steps = words[FM_STATS_MOST],
                                        .wrong = words[FM_STATS_WRONG] | (uint64_t)words[FM_STATS_WRONG + 1] << 32};
    return FM_OK;
}
