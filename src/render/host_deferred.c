// SPDX-License-Identifier: MIT
// Deferred pictures on the CPU: the steps of shaders/defer_*.comp, row by row on the pool.

#include "mesh/bvh.h"
#include "render/deferred.h"

#include <string.h>

// What a ray through the mesh meets.
typedef struct fm_mesh_met {
    float time;  // +infinity: nothing
    float normal[3];
} fm_mesh_met;

#define FM_LIGHT(at) (((const float *)(uintptr_t)scene->light)[at])
#define FM_PAST(at) (((const float *)(uintptr_t)scene->history)[at])

#include "shaders/include/defer_rule.h"

static const fm_mesh *mesh_of(const fm_defer_scene *scene) {
    return (const fm_mesh *)(uintptr_t)scene->mesh.nodes;
}

static fm_mesh_ray ray_of(fm_v3 origin, fm_v3 way, float first, float last) {
    return (fm_mesh_ray){{origin.x, origin.y, origin.z}, first, {way.x, way.y, way.z}, last};
}

static fm_mesh_met fm_mesh_first(const fm_defer_scene *scene, fm_v3 origin, fm_v3 way, float first, float last) {
    const fm_mesh *mesh = mesh_of(scene);
    const fm_mesh_ray ray = ray_of(origin, way, first, last);
    const fm_mesh_hit hit = fm_bvh_cast(mesh, &ray, false);
    fm_mesh_met met = {.time = hit.t};
    if (hit.triangle != FM_NO_TRIANGLE) {
        const float(*v)[3] = (const float(*)[3])mesh->vertices;
        const uint32_t *t = mesh->triangles[hit.triangle];
        const fm_v3 a = {v[t[0]][0], v[t[0]][1], v[t[0]][2]}, b = {v[t[1]][0], v[t[1]][1], v[t[1]][2]},
                    c = {v[t[2]][0], v[t[2]][1], v[t[2]][2]};
        const fm_v3 normal = fm_unit(fm_cross(fm_less(b, a), fm_less(c, a)));
        memcpy(met.normal, &normal, sizeof met.normal);
    }
    return met;
}

static bool fm_mesh_blocked(const fm_defer_scene *scene, fm_v3 origin, fm_v3 way, float first, float last) {
    const fm_mesh_ray ray = ray_of(origin, way, first, last);
    return fm_bvh_cast(mesh_of(scene), &ray, true).triangle != FM_NO_TRIANGLE;
}

#include "shaders/include/defer_pixel.h"

typedef struct job job;
typedef struct place place;

struct job {
    const fm_deferred_desc *desc;
    const fm_defer_scene *scene;
    fm_deferred_room *room;
    uint32_t cascade;
    bool down;  // the blur's direction
    float *next_history;
    void (*pixel)(const job *j, place p);  // of the pass
};

struct place {
    int32_t x, y;
    uint64_t at;  // its number in the picture
};

static void surface_pixel(const job *j, place p) {
    j->room->surfaces[p.at] = fm_surface_pixel(j->scene, p.x, p.y, (int32_t)j->desc->surface);
}

static void light_pixel(const job *j, place p) {
    const fm_lit lit =
        fm_light_pixel(j->scene, p.x, p.y, j->room->surfaces[p.at], (int32_t)j->desc->shadows, (int32_t)j->desc->view);
    memcpy(j->room->light + 4 * p.at, &lit, sizeof lit);
}

static void resolve_pixel(const job *j, place p) {
    const fm_v3 color = fm_resolved(j->scene, p.x, p.y, j->room->surfaces[p.at]);
    j->room->picture[p.at] = fm_pixel_bytes(color);
    memcpy(j->next_history + 4 * p.at, &color, sizeof color);
    j->next_history[4 * p.at + 3] = 0;
}

static void pixel_rows(void *user, uint64_t begin, uint64_t end, uint32_t worker) {
    (void)worker;
    const job *j = user;
    const int32_t width = j->scene->width;
    for (uint64_t y = begin; y < end; y++) {
        for (int32_t x = 0; x < width; x++) {
            j->pixel(j, (place){x, (int32_t)y, y * (uint64_t)width + (uint64_t)x});
        }
    }
}

static void map_rows(void *user, uint64_t begin, uint64_t end, uint32_t worker) {
    (void)worker;
    const job *j = user;
    const uint64_t edge = j->scene->map_edge;
    for (uint64_t row = begin; row < end; row++) {
        for (uint64_t x = 0; x < edge; x++) {
            const float depth = fm_map_depth(j->scene, (int32_t)(row / edge), (int32_t)x, (int32_t)(row % edge));
            const float up = fm_warp_up(depth), low = fm_warp_down(depth), moments[FM_MAP_FLOATS] = {up, up * up, low, low * low};
            memcpy(j->room->map + FM_MAP_FLOATS * (row * edge + x), moments, sizeof moments);
        }
    }
}

static int64_t within(int64_t at, int64_t size) {
    return at < 0 ? 0 : at >= size ? size - 1 : at;
}

static void blur_rows(void *user, uint64_t begin, uint64_t end, uint32_t worker) {
    (void)worker;
    const job *j = user;
    const int64_t edge = j->scene->map_edge;
    const float *from = j->down ? j->room->blurred : j->room->map;
    float *to = j->down ? j->room->map : j->room->blurred;
    for (uint64_t row = begin; row < end; row++) {
        const int64_t cascade = (int64_t)row / edge, y = (int64_t)row % edge;
        for (int64_t x = 0; x < edge; x++) {
            float sum[FM_MAP_FLOATS] = {0}, weights = 0;
            for (int32_t off = -FM_MAP_BLUR; off <= FM_MAP_BLUR; off++) {
                const int64_t px = j->down ? x : within(x + off, edge), py = j->down ? within(y + off, edge) : y;
                const float weight = fm_blur_weight(off);
                weights += weight;
                for (int m = 0; m < FM_MAP_FLOATS; m++) {
                    sum[m] += weight * from[FM_MAP_FLOATS * ((cascade * edge + py) * edge + px) + m];
                }
            }
            for (int m = 0; m < FM_MAP_FLOATS; m++) {
                to[FM_MAP_FLOATS * ((cascade * edge + y) * edge + x) + m] = sum[m] / weights;
            }
        }
    }
}

static void free_pixels(const fm_allocator *allocator, fm_deferred_room *room) {
    fm_free(allocator, room->surfaces, room->pixels * sizeof *room->surfaces);
    fm_free(allocator, room->light, room->pixels * 16);
    fm_free(allocator, room->history[0], room->pixels * 16);
    fm_free(allocator, room->history[1], room->pixels * 16);
    fm_free(allocator, room->picture, room->pixels * 4);
}

static void free_map(const fm_allocator *allocator, fm_deferred_room *room) {
    fm_free(allocator, room->map, room->texels * 4 * FM_MAP_FLOATS);
    fm_free(allocator, room->blurred, room->texels * 4 * FM_MAP_FLOATS);
}

void fm_host_deferred_destroy(fm_deferred *deferred) {
    const fm_allocator *allocator = &deferred->context->allocator;
    fm_meter_remove(&deferred->context->host[FM_PURPOSE_PICTURES],
                    deferred->room.pixels * 84 + deferred->room.texels * 8 * FM_MAP_FLOATS);
    free_pixels(allocator, &deferred->room);
    free_map(allocator, &deferred->room);
}

// What is there stays until all that is new is there too.
static fm_result make_pixels(fm_deferred *deferred, uint64_t pixels) {
    fm_deferred_room *room = &deferred->room;
    if (room->pixels >= pixels) {
        return FM_OK;
    }
    const fm_allocator *allocator = &deferred->context->allocator;
    fm_deferred_room made = {.pixels = pixels};
    made.surfaces = fm_alloc(allocator, pixels * sizeof *made.surfaces, "the surfaces of a picture");
    made.light = fm_alloc(allocator, pixels * 16, "the light of a picture");
    made.history[0] = fm_alloc(allocator, pixels * 16, "a picture to blend with");
    made.history[1] = fm_alloc(allocator, pixels * 16, "a picture to blend with");
    made.picture = fm_alloc(allocator, pixels * 4, "a picture");
    if (!made.surfaces || !made.light || !made.history[0] || !made.history[1] || !made.picture) {
        free_pixels(allocator, &made);
        return FM_ERROR_OUT_OF_HOST_MEMORY;
    }
    fm_meter *meter = &deferred->context->host[FM_PURPOSE_PICTURES];
    fm_meter_remove(meter, room->pixels * 84);
    fm_meter_add(meter, pixels * 84);
    free_pixels(allocator, room);
    made.map = room->map;
    made.blurred = room->blurred;
    made.texels = room->texels;
    *room = made;
    return FM_OK;
}

static fm_result make_map(fm_deferred *deferred, uint64_t texels) {
    fm_deferred_room *room = &deferred->room;
    if (room->texels >= texels) {
        return FM_OK;
    }
    const fm_allocator *allocator = &deferred->context->allocator;
    const uint64_t bytes = texels * 4 * FM_MAP_FLOATS;
    float *map = fm_alloc(allocator, bytes, "a shadow map"), *blurred = fm_alloc(allocator, bytes, "a shadow map");
    if (!map || !blurred) {
        fm_free(allocator, map, bytes);
        fm_free(allocator, blurred, bytes);
        return FM_ERROR_OUT_OF_HOST_MEMORY;
    }
    fm_meter *meter = &deferred->context->host[FM_PURPOSE_PICTURES];
    fm_meter_remove(meter, room->texels * 8 * FM_MAP_FLOATS);
    fm_meter_add(meter, texels * 8 * FM_MAP_FLOATS);
    free_map(allocator, room);
    room->map = map;
    room->blurred = blurred;
    room->texels = texels;
    return FM_OK;
}

static void make_shadow_map(fm_context *context, job *j) {
    const uint64_t rows = (uint64_t)FM_CASCADES * j->scene->map_edge;
    fm_pool_run(context->pool, rows, 4, map_rows, j);
    fm_pool_run(context->pool, rows, 16, blur_rows, j);
    j->down = true;
    fm_pool_run(context->pool, rows, 16, blur_rows, j);
    fm_passes_end(context, "map", rows * j->scene->map_edge * 4 * FM_MAP_FLOATS * 5);
}

fm_result fm_host_deferred(fm_deferred *deferred, fm_deferred_picture *picture) {
    fm_context *context = deferred->context;
    fm_defer_scene *scene = &picture->scene;
    const uint64_t pixels = (uint64_t)picture->desc.width * picture->desc.height;
    const bool maps = picture->desc.shadows == FM_SHADOWS_MAP;
    if (picture->desc.mesh) {
        FM_TRY(fm_bvh_prepare(picture->desc.mesh));
    }
    FM_TRY(make_pixels(deferred, pixels));
    FM_TRY(make_map(deferred, maps ? (uint64_t)FM_CASCADES * scene->map_edge * scene->map_edge : 0));
    fm_deferred_room *room = &deferred->room;
    scene->mesh.nodes = (uint64_t)(uintptr_t)picture->desc.mesh;
    scene->light = (uint64_t)(uintptr_t)room->light;
    scene->history = (uint64_t)(uintptr_t)room->history[deferred->history];
    scene->map = (uint64_t)(uintptr_t)room->map;
    job j = {.desc = &picture->desc, .scene = scene, .room = room, .next_history = room->history[deferred->history ^ 1]};
    fm_passes_begin(context);
    if (maps) {
        make_shadow_map(context, &j);
    }
    j.pixel = surface_pixel;
    fm_pool_run(context->pool, picture->desc.height, 1, pixel_rows, &j);
    fm_passes_end(context, "surface", pixels * sizeof(fm_defer_surface));
    j.pixel = light_pixel;
    fm_pool_run(context->pool, picture->desc.height, 1, pixel_rows, &j);
    fm_passes_end(context, "light", pixels * (sizeof(fm_defer_surface) + 16));
    j.pixel = resolve_pixel;
    fm_pool_run(context->pool, picture->desc.height, 8, pixel_rows, &j);
    fm_passes_end(context, "resolve", pixels * (sizeof(fm_defer_surface) + 36));
    return FM_OK;
}
