// SPDX-License-Identifier: MIT
// Pictures on Vulkan: beams for tiles of pixels, then one kernel from ray to pixel.

#include "render/render.h"

#include "gpu/compute.h"
#include "render/gpu_frames.h"
#include "world/refs.h"

#include <stdlib.h>
#include <string.h>

enum { BEAM_THREADS = 32 };

// Buffers of a picture.
enum { PICTURE, BEAM };

struct fm_gpu_render {
    fm_gpu *gpu;
    fm_gpu_frames frames;  // whose constants are FM_EXTRA_BYTES
    fm_flights picks;      // of fm_gpu_pick
    fm_flights tallies;    // what the kernels sum up of a counted picture: FM_STATS_WORDS 32-bit words
    bool large;            // elements have 64 bits in every world
};

fm_result fm_gpu_render_create(fm_renderer *renderer) {
    const fm_allocator *allocator = &renderer->context->allocator;
    fm_gpu_render *own = fm_alloc_zero(allocator, sizeof *own, "a renderer");
    if (!own) {
        return FM_ERROR_OUT_OF_HOST_MEMORY;
    }
    renderer->gpu = own;
    own->gpu = own->frames.gpu = renderer->context->gpu;
    // Tests set the variable, for worlds of more than 2^32 voxels are not for them.
    own->large = getenv("FATHOM_LARGE") != NULL;
    return FM_OK;
}

void fm_gpu_render_destroy(fm_renderer *renderer) {
    fm_gpu_render *own = renderer->gpu;
    if (!own) {
        return;
    }
    fm_gpu_frames_destroy(&own->frames);
    fm_flights_destroy(&own->picks);
    fm_flights_destroy(&own->tallies);
    fm_free(&renderer->context->allocator, own, sizeof *own);
    renderer->gpu = NULL;
}

static uint64_t tiles_of(uint32_t width, uint32_t height) {
    return fm_div_up(width, FM_TILE) * fm_div_up(height, FM_TILE);
}

static void set_world(const fm_world *world, fm_march_push *push) {
    const fm_world_refs refs = fm_gpu_world_refs(world);
    push->field = refs.field;
    push->colors = refs.colors;
    push->bits = refs.bits;
}

static bool is_large(const fm_gpu_render *own, const fm_world *world) {
    return own->large || fm_voxels(world->desc.shape) > UINT32_MAX;
}

static fm_result dispatch(const fm_gpu_render *own, fm_slot *slot, fm_kernel kernel, const uint32_t *constants, uint32_t count,
                          const void *push, uint32_t push_bytes, uint64_t groups) {
    const fm_dispatch what = {.kernel = kernel,
                              .constants = constants,
                              .constant_count = count,
                              .push = push,
                              .push_bytes = push_bytes,
                              .groups = groups};
    return fm_commands_dispatch(own->gpu, slot, &what);
}

typedef struct work {
    fm_renderer *renderer;
    const fm_world *world;
    const fm_picture *picture;
} work;

static fm_result record(const work *w, const fm_gpu_room *to, const fm_flight *extra, fm_slot *slot) {
    const fm_gpu_render *own = w->renderer->gpu;
    const fm_world *world = w->world;
    const fm_picture *picture = w->picture;
    const fm_render_desc *desc = &picture->desc;
    fm_march_push push = picture->push;
    set_world(world, &push);
    push.picture = fm_buffer_address(to->buffers[PICTURE]);
    push.beam = fm_buffer_address(to->buffers[BEAM]);
    push.extra = fm_buffer_address(extra->buffer);
    const uint64_t tiles = tiles_of(desc->width, desc->height);
    const uint32_t constants[] = {world->desc.format, desc->march,    is_large(own, world),    desc->count,      desc->view,
                                  desc->shadow,       picture->beams, desc->ambient_occlusion, picture->preview, desc->crosshair};
    if (picture->beams) {
        FM_TRY(dispatch(own, slot, FM_KERNEL_MARCH_BEAM, constants, 4, &push, sizeof push, fm_div_up(tiles, BEAM_THREADS)));
        fm_commands_pass(own->gpu, slot, "beam", 4 * tiles);
    }
    FM_TRY(dispatch(own, slot, FM_KERNEL_MARCH, constants, sizeof constants / sizeof constants[0], &push, sizeof push, tiles));
    fm_commands_pass(own->gpu, slot, "march", 4 * (uint64_t)desc->width * desc->height);
    return FM_OK;
}

// Sums of 0 for a picture to come; those of the newest counted one stay.
static fm_result clear_tally(fm_gpu_render *own, uint64_t *address) {
    fm_flight *tally;
    FM_TRY(fm_flights_take(&own->tallies, own->gpu, FM_PURPOSE_READBACK, 4 * FM_STATS_WORDS, &tally));
    memset(fm_buffer_mapped(tally->buffer), 0, 4 * FM_STATS_WORDS);
    *address = fm_buffer_address(tally->buffer);
    return FM_OK;
}

static fm_result submit(void *user, const fm_gpu_room *to, const fm_flight *flight, fm_ticket *ticket) {
    const work *w = user;
    fm_gpu_render *own = w->renderer->gpu;
    const bool count = w->picture->desc.count;
    uint8_t *extra = fm_buffer_mapped(flight->buffer);
    uint64_t tally = 0;
    if (count) {
        FM_TRY(clear_tally(own, &tally));
    }
    memset(extra, 0, FM_EXTRA_BRUSH);
    memcpy(extra + FM_EXTRA_STATS, &tally, sizeof tally);
    memcpy(extra + FM_EXTRA_BRUSH, &w->picture->brush, sizeof w->picture->brush);
    memcpy(extra + FM_EXTRA_MAP, w->renderer->map, sizeof w->renderer->map);
    fm_slot *slot;
    FM_TRY(fm_commands_begin(own->gpu, &slot));
    FM_TRY(record(w, to, flight, slot));
    FM_TRY(fm_commands_submit(own->gpu, slot, ticket));
    if (count) {
        fm_flights_sent(&own->tallies, *ticket);
    }
    return FM_OK;
}

fm_result fm_gpu_render_picture(fm_renderer *renderer, const fm_world *world, const fm_picture *picture, fm_ticket *ticket) {
    const uint32_t width = picture->desc.width, height = picture->desc.height;
    const uint64_t bytes[FM_FRAME_BUFFERS] = {[PICTURE] = 4 * (uint64_t)width * height, [BEAM] = 4 * tiles_of(width, height)};
    work w = {renderer, world, picture};
    return fm_gpu_frames_picture(&renderer->gpu->frames, bytes, FM_EXTRA_BYTES, submit, &w, ticket);
}

fm_result fm_gpu_pick_begin(fm_renderer *renderer, const fm_world *world, const fm_picture *picture, const float way[3],
                            fm_ticket *ticket) {
    fm_gpu_render *own = renderer->gpu;
    const fm_world_refs refs = fm_gpu_world_refs(world);
    fm_flight *flight;
    FM_TRY(fm_flights_take(&own->picks, own->gpu, FM_PURPOSE_READBACK, sizeof(fm_gpu_pick), &flight));
    fm_pick_push push = {.field = refs.field,
                         .bits = refs.bits,
                         .found = fm_buffer_address(flight->buffer),
                         .size_xy = picture->push.size_xy,
                         .size_z = picture->push.size_z};
    memcpy(push.origin, picture->push.origin, sizeof push.origin);
    memcpy(push.way, way, sizeof push.way);
    const uint32_t constants[] = {world->desc.format, picture->desc.march, is_large(own, world)};
    fm_slot *slot;
    FM_TRY(fm_commands_begin(own->gpu, &slot));
    FM_TRY(dispatch(own, slot, FM_KERNEL_PICK, constants, 3, &push, sizeof push, 1));
    fm_commands_pass(own->gpu, slot, "pick", sizeof(fm_gpu_pick));
    FM_TRY(fm_commands_submit(own->gpu, slot, ticket));
    fm_flights_sent(&own->picks, *ticket);
    return FM_OK;
}

fm_result fm_gpu_pick_end(fm_renderer *renderer, fm_ticket ticket, fm_pick *result) {
    const fm_gpu_render *own = renderer->gpu;
    uint32_t i = 0;
    while (i < FM_FLIGHTS && (ticket == 0 || own->picks.all[i].ticket != ticket)) {
        i++;
    }
    if (i == FM_FLIGHTS) {
        return fm_fail(FM_ERROR_INVALID_ARGUMENT, "ticket is %llu: that of one of the newest %d picks is wanted",
                       (unsigned long long)ticket, FM_FLIGHTS);
    }
    FM_TRY(fm_gpu_wait(own->gpu, ticket));
    const fm_gpu_pick *found = fm_buffer_mapped(own->picks.all[i].buffer);
    *result = (fm_pick){.hit = found->hit != 0};
    if (result->hit) {
        memcpy(result->voxel, found->voxel, sizeof result->voxel);
        result->face = found->face;
        result->distance = found->distance;
    }
    return FM_OK;
}

fm_result fm_gpu_render_read(fm_renderer *renderer, uint8_t *pixels) {
    return fm_buffer_download_at(renderer->gpu->frames.room.buffers[PICTURE], 0, pixels,
                                 4 * (uint64_t)renderer->width * renderer->height);
}

void fm_gpu_render_describe(const fm_renderer *renderer, fm_volume_buffer *buffer) {
    fm_buffer_describe(renderer->gpu->frames.room.buffers[PICTURE], buffer);
    buffer->size = 4 * (uint64_t)renderer->width * renderer->height;
}

fm_result fm_gpu_render_stats(fm_renderer *renderer) {
    const fm_gpu_render *own = renderer->gpu;
    const fm_flight *tally = fm_flights_newest(&own->tallies);
    FM_TRY(fm_gpu_wait(own->gpu, tally->ticket));
    const uint32_t *words = fm_buffer_mapped(tally->buffer);
    uint64_t sums[FM_SUM_COUNT];
    for (int i = 0; i < FM_SUM_COUNT; i++) {
        sums[i] = words[2 * i] | (uint64_t)words[2 * i + 1] << 32;
    }
    renderer->stats = (fm_render_stats){.rays = sums[FM_SUM_RAYS],
                                        .hits = sums[FM_SUM_HITS],
                                        .steps = sums[FM_SUM_STEPS],
                                        .most_steps = words[FM_STATS_MOST],
                                        .beam_reads = sums[FM_SUM_BEAM],
                                        .sun_reads = sums[FM_SUM_SUN],
                                        .occlusion_reads = sums[FM_SUM_OPEN],
                                        .wrong = sums[FM_SUM_WRONG]};
    return FM_OK;
}
