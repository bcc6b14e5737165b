// SPDX-License-Identifier: MIT
// Pictures of octrees on the CPU: the steps of shaders/octree_*.comp, a row of tiles after the other on the pool.

#include "render/octree_picture.h"
#include "shaders/include/octree_pixel_rule.h"

#include <string.h>

typedef struct job {
    const fm_octree_picture *picture;
    const fm_octree_scene *scene;
    fm_octree_room *room;
} job;

static void first_pixel(const job *j, int32_t x, int32_t y, float first) {
    const uint64_t at = (uint64_t)y * (uint64_t)j->scene->width + (uint64_t)x;
    const fm_octree_met met = fm_first_ray(j->scene, x, y, first);
    j->room->pixels[at] = fm_pixel_of(met);
    if (!j->picture->second) {
        j->room->picture[at] = fm_pixel_bytes(fm_first_light(j->scene, x, y, met, (int32_t)j->picture->desc.view));
    }
}

static void first_tiles(void *user, uint64_t begin, uint64_t end, uint32_t worker) {
    (void)worker;
    const job *j = user;
    const fm_octree_scene *scene = j->scene;
    const uint64_t across = fm_div_up((uint64_t)scene->width, FM_OCTREE_TILE);
    for (uint64_t row = begin; row < end; row++) {
        for (int32_t left = 0; left < scene->width; left += FM_OCTREE_TILE) {
            const int32_t top = (int32_t)row * FM_OCTREE_TILE;
            fm_octree_beam beam = {0};
            if (j->picture->beams) {
                beam = fm_tile_beam(scene, left / FM_OCTREE_TILE, (int32_t)row);
            }
            j->room->beams[row * across + (uint64_t)left / FM_OCTREE_TILE][1] = beam.reads;
            for (int i = 0; i < FM_OCTREE_TILE * FM_OCTREE_TILE; i++) {
                const int32_t x = left + i % FM_OCTREE_TILE, y = top + i / FM_OCTREE_TILE;
                if (x < scene->width && y < scene->height) {
                    first_pixel(j, x, y, beam.t);
                }
            }
        }
    }
}

static void second_rows(void *user, uint64_t begin, uint64_t end, uint32_t worker) {
    (void)worker;
    const job *j = user;
    const fm_octree_render_desc *desc = &j->picture->desc;
    for (uint64_t y = begin; y < end; y++) {
        for (int32_t x = 0; x < j->scene->width; x++) {
            const uint64_t at = y * (uint64_t)j->scene->width + (uint64_t)x;
            const fm_octree_second second = fm_second_light(j->scene, x, (int32_t)y, j->room->pixels[at], desc->shadow,
                                                            desc->reflection > 0, desc->refraction > 0);
            j->room->picture[at] = fm_pixel_bytes((fm_v3){second.color[0], second.color[1], second.color[2]});
            if (j->room->seconds) {
                j->room->seconds[at][0] = second.rays;
                j->room->seconds[at][1] = second.reads;
            }
        }
    }
}

static uint64_t room_bytes(const fm_octree_room *room) {
    const uint64_t pixel = sizeof *room->pixels + sizeof *room->picture + (room->seconds ? sizeof *room->seconds : 0);
    return room->count * pixel + room->tiles * sizeof *room->beams;
}

static void free_room(const fm_allocator *allocator, const fm_octree_room *room) {
    fm_free(allocator, room->pixels, room->count * sizeof *room->pixels);
    fm_free(allocator, room->seconds, room->count * sizeof *room->seconds);
    fm_free(allocator, room->beams, room->tiles * sizeof *room->beams);
    fm_free(allocator, room->picture, room->count * sizeof *room->picture);
}

// What is there stays until all that is new is there too.
static fm_result make_room(fm_octree_renderer *renderer, uint64_t count, uint64_t tiles, bool seconds) {
    const fm_octree_room *there = &renderer->room;
    if (there->count >= count && there->tiles >= tiles && (there->seconds || !seconds)) {
        return FM_OK;
    }
    const fm_allocator *allocator = &renderer->context->allocator;
    fm_octree_room made = {.count = count, .tiles = tiles};
    made.beams = fm_alloc(allocator, tiles * sizeof *made.beams, "the beams of a picture");
    made.pixels = fm_alloc(allocator, count * sizeof *made.pixels, "what a picture's rays met");
    made.seconds = seconds ? fm_alloc(allocator, count * sizeof *made.seconds, "the second rays of a picture") : NULL;
    made.picture = fm_alloc(allocator, count * sizeof *made.picture, "a picture");
    if (!made.beams || !made.pixels || (seconds && !made.seconds) || !made.picture) {
        free_room(allocator, &made);
        return FM_ERROR_OUT_OF_HOST_MEMORY;
    }
    fm_host_octree_picture_destroy(renderer);
    fm_meter_add(&renderer->context->host[FM_PURPOSE_PICTURES], room_bytes(&made));
    renderer->room = made;
    return FM_OK;
}

void fm_host_octree_picture_destroy(fm_octree_renderer *renderer) {
    fm_meter_remove(&renderer->context->host[FM_PURPOSE_PICTURES], room_bytes(&renderer->room));
    free_room(&renderer->context->allocator, &renderer->room);
    renderer->room = (fm_octree_room){0};
}

fm_result fm_host_octree_picture(fm_octree_renderer *renderer, fm_octree_picture *picture) {
    fm_context *context = renderer->context;
    const uint64_t height = picture->desc.height, pixels = picture->desc.width * height;
    const uint64_t rows = fm_div_up(height, FM_OCTREE_TILE);
    const uint64_t tiles = rows * fm_div_up(picture->desc.width, FM_OCTREE_TILE);
    FM_TRY(make_room(renderer, pixels, tiles, picture->desc.count && picture->second));
    const fm_octree_head head = fm_octree_host_head(picture->octree);
    picture->scene.head = (uint64_t)(uintptr_t)&head;
    job j = {.picture = picture, .scene = &picture->scene, .room = &renderer->room};
    fm_passes_begin(context);
    fm_pool_run(context->pool, rows, 1, first_tiles, &j);
    fm_passes_end(context, "primary", pixels * sizeof(fm_octree_pixel));
    if (picture->second) {
        fm_pool_run(context->pool, height, 1, second_rows, &j);
        fm_passes_end(context, "second", pixels * (sizeof(fm_octree_pixel) + 4));
    }
    return FM_OK;
}
