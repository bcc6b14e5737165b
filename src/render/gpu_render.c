// SPDX-License-Identifier: MIT
// Pictures on Vulkan: beams for tiles of pixels, then one kernel from ray to pixel.

#include "render/render.h"

#include "world/gpu_world.h"

#include <stdlib.h>
#include <string.h>

enum { IN_FLIGHT = 3, BEAM_THREADS = 32 };

// What the host writes for a picture in flight.
typedef struct frame {
    fm_buffer *extra;  // FM_EXTRA_BYTES
    fm_ticket ticket;
} frame;

// What the kernels sum up for the host, of a counted picture.
typedef struct tally {
    fm_buffer *sums;  // FM_STATS_WORDS 32-bit words
    fm_ticket ticket;
} tally;

// A pick in flight.
typedef struct pick {
    fm_buffer *found;  // fm_gpu_pick
    fm_ticket ticket;
} pick;

// Where a picture goes.
typedef struct room {
    fm_buffer *picture, *beam;
} room;

struct fm_gpu_render {
    fm_gpu *gpu;
    room room;  // of the newest picture
    pick picks[IN_FLIGHT];
    uint32_t pick;  // the newest
    frame frames[IN_FLIGHT];
    uint32_t frame;  // of the newest picture
    tally tallies[IN_FLIGHT];
    uint32_t tally;  // of the newest picture that was counted
    bool large;      // elements have 64 bits in every world
};

fm_result fm_gpu_render_create(fm_renderer *renderer) {
    const fm_allocator *allocator = &renderer->context->allocator;
    fm_gpu_render *own = fm_alloc_zero(allocator, sizeof *own, "a renderer");
    if (!own) {
        return FM_ERROR_OUT_OF_HOST_MEMORY;
    }
    renderer->gpu = own;
    own->gpu = renderer->context->gpu;
    // Tests set the variable, for worlds of more than 2^32 voxels are not for them.
    own->large = getenv("FATHOM_LARGE") != NULL;
    for (int i = 0; i < IN_FLIGHT; i++) {
        FM_TRY(fm_buffer_create(own->gpu, FM_PURPOSE_READBACK, sizeof(fm_gpu_pick), false, &own->picks[i].found));
        frame *f = &own->frames[i];
        FM_TRY(fm_buffer_create(own->gpu, FM_PURPOSE_UPLOAD, FM_EXTRA_BYTES, false, &f->extra));
        FM_TRY(fm_buffer_create(own->gpu, FM_PURPOSE_READBACK, 4 * FM_STATS_WORDS, false, &own->tallies[i].sums));
        uint8_t *extra = fm_buffer_mapped(f->extra);
        memset(extra, 0, FM_EXTRA_BYTES);
        memcpy(extra + FM_EXTRA_MAP, renderer->map, sizeof renderer->map);
    }
    return FM_OK;
}

static void destroy_room(const room *r) {
    fm_buffer_destroy(r->picture);
    fm_buffer_destroy(r->beam);
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
        fm_buffer_destroy(own->tallies[i].sums);
        fm_buffer_destroy(own->picks[i].found);
    }
    destroy_room(&own->room);
    fm_free(&renderer->context->allocator, own, sizeof *own);
    renderer->gpu = NULL;
}

static uint64_t tiles_of(uint32_t width, uint32_t height) {
    return fm_div_up(width, FM_TILE) * fm_div_up(height, FM_TILE);
}

static fm_result make_room(const fm_gpu_render *own, uint32_t width, uint32_t height, room *made) {
    *made = (room){0};
    FM_TRY(fm_buffer_create(own->gpu, FM_PURPOSE_PICTURES, 4 * (uint64_t)width * height, false, &made->picture));
    fm_result status = fm_buffer_create(own->gpu, FM_PURPOSE_PICTURES, 4 * tiles_of(width, height), false, &made->beam);
    if (status != FM_OK) {
        fm_buffer_destroy(made->picture);
    }
    return status;
}

static void set_world(const fm_world *world, fm_march_push *push) {
    const fm_gpu_world *gpu = world->gpu;
    push->field = fm_buffer_address(gpu->field);
    push->colors = gpu->colors ? fm_buffer_address(gpu->colors) : 0;
    push->bits = fm_buffer_address(gpu->bits);
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

static fm_result record(const fm_gpu_render *own, const fm_world *world, const fm_picture *picture, const room *to, const frame *f,
                        fm_slot *slot) {
    const fm_render_desc *desc = &picture->desc;
    fm_march_push push = picture->push;
    set_world(world, &push);
    push.picture = fm_buffer_address(to->picture);
    push.beam = fm_buffer_address(to->beam);
    push.extra = fm_buffer_address(f->extra);
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
static fm_result clear_tally(fm_gpu_render *own, const frame *f, tally *t) {
    FM_TRY(fm_gpu_wait(own->gpu, t->ticket));
    const uint64_t address = fm_buffer_address(t->sums);
    memcpy((uint8_t *)fm_buffer_mapped(f->extra) + FM_EXTRA_STATS, &address, sizeof address);
    memset(fm_buffer_mapped(t->sums), 0, 4 * FM_STATS_WORDS);
    return FM_OK;
}

static fm_result submit(fm_gpu_render *own, const fm_world *world, const fm_picture *picture, const room *to, fm_ticket *ticket) {
    const uint32_t next = (own->frame + 1) % IN_FLIGHT;
    const uint32_t next_tally = (own->tally + 1) % IN_FLIGHT;
    frame *f = &own->frames[next];
    FM_TRY(fm_gpu_wait(own->gpu, f->ticket));
    memcpy((uint8_t *)fm_buffer_mapped(f->extra) + FM_EXTRA_BRUSH, &picture->brush, sizeof picture->brush);
    fm_slot *slot;
    FM_TRY(fm_commands_begin(own->gpu, &slot));
    FM_TRY(record(own, world, picture, to, f, slot));
    if (picture->desc.count) {
        FM_TRY(clear_tally(own, f, &own->tallies[next_tally]));
    }
    FM_TRY(fm_commands_submit(own->gpu, slot, ticket));
    f->ticket = *ticket;
    own->frame = next;
    if (picture->desc.count) {
        own->tallies[next_tally].ticket = *ticket;
        own->tally = next_tally;
    }
    return FM_OK;
}

fm_result fm_gpu_render_picture(fm_renderer *renderer, const fm_world *world, const fm_picture *picture, fm_ticket *ticket) {
    fm_gpu_render *own = renderer->gpu;
    const uint32_t width = picture->desc.width, height = picture->desc.height;
    if (renderer->width == width && renderer->height == height) {
        return submit(own, world, picture, &own->room, ticket);
    }
    // The newest picture stays where it is until another one is sure to come.
    room made;
    FM_TRY(make_room(own, width, height, &made));
    const fm_ticket before = fm_gpu_newest(own->gpu);
    const fm_result status = submit(own, world, picture, &made, ticket);
    if (status != FM_OK) {
        destroy_room(&made);
        return status;
    }
    (void)fm_gpu_wait(own->gpu, before);
    destroy_room(&own->room);
    own->room = made;
    return FM_OK;
}

fm_result fm_gpu_pick_begin(fm_renderer *renderer, const fm_world *world, const fm_picture *picture, const float way[3],
                            fm_ticket *ticket) {
    fm_gpu_render *own = renderer->gpu;
    const uint32_t next = (own->pick + 1) % IN_FLIGHT;
    FM_TRY(fm_gpu_wait(own->gpu, own->picks[next].ticket));
    fm_pick_push push = {.field = fm_buffer_address(world->gpu->field),
                         .bits = fm_buffer_address(world->gpu->bits),
                         .found = fm_buffer_address(own->picks[next].found),
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
    own->picks[next].ticket = *ticket;
    own->pick = next;
    return FM_OK;
}

fm_result fm_gpu_pick_end(fm_renderer *renderer, fm_ticket ticket, fm_pick *result) {
    const fm_gpu_render *own = renderer->gpu;
    uint32_t i = 0;
    while (i < IN_FLIGHT && (ticket == 0 || own->picks[i].ticket != ticket)) {
        i++;
    }
    if (i == IN_FLIGHT) {
        return fm_fail(FM_ERROR_INVALID_ARGUMENT, "ticket is %llu: that of one of the newest %d picks is wanted",
                       (unsigned long long)ticket, IN_FLIGHT);
    }
    FM_TRY(fm_gpu_wait(own->gpu, ticket));
    const fm_gpu_pick *found = fm_buffer_mapped(own->picks[i].found);
    *result = (fm_pick){.hit = found->hit != 0};
    if (result->hit) {
        memcpy(result->voxel, found->voxel, sizeof result->voxel);
        result->face = found->face;
        result->distance = found->distance;
    }
    return FM_OK;
}

fm_result fm_gpu_render_read(fm_renderer *renderer, uint8_t *pixels) {
    return fm_buffer_download_at(renderer->gpu->room.picture, 0, pixels, 4 * (uint64_t)renderer->width * renderer->height);
}

void fm_gpu_render_describe(const fm_renderer *renderer, fm_volume_buffer *buffer) {
    fm_buffer_describe(renderer->gpu->room.picture, buffer);
    buffer->size = 4 * (uint64_t)renderer->width * renderer->height;
}

fm_result fm_gpu_render_stats(fm_renderer *renderer) {
    const fm_gpu_render *own = renderer->gpu;
    const tally *t = &own->tallies[own->tally];
    FM_TRY(fm_gpu_wait(own->gpu, t->ticket));
    const uint32_t *words = fm_buffer_mapped(t->sums);
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
