// SPDX-License-Identifier: MIT
// Pictures on the CPU: rows of tiles on the pool, as shaders/march_beam.comp and shaders/march.comp have them.

#include "render/host_shade.h"

#include <stdlib.h>
#include <string.h>

typedef struct found {
    bool solid;
    fm_vec3 cell;
    uint32_t reads;
    fm_light_reads light;
} found;

// A pixel to be: its place, and the end of its tile's beam.
typedef struct pixel {
    uint32_t x, y;
    float beam;
} pixel;

typedef struct render_job {
    fm_scenery scenery;
    uint32_t *pixels;
    fm_render_stats *stats;  // of each worker
} render_job;

static found find(const fm_grid *grid, const fm_ray *ray, fm_vec3 start, fm_march how) {
    found result = {.cell = start};
    result.solid = fm_march_ray(grid, ray, &result.cell, how, &result.reads);
    return result;
}

// When the ray meets the plane of the slice, below 0: never; and whether that is inside of the world.
static float slice_time(const fm_grid *grid, const fm_picture *picture, const float way[3], float at[3], bool *within) {
    const uint32_t axis = picture->desc.slice_axis;
    const float plane = (float)picture->desc.slice_index + 0.5f;
    const float *origin = picture->push.origin;
    const float time = way[axis] < 0 || way[axis] > 0 ? (plane - origin[axis]) / way[axis] : -1;
    *within = time >= 0;
    for (uint32_t i = 0; i < 3; i++) {
        at[i] = i == axis ? plane : origin[i] + way[i] * time;
        *within = *within && at[i] >= 0 && at[i] < (float)grid->axes[i];
    }
    return time;
}

static fm_vec3 grey(float value) {
    return (fm_vec3){{value, value, value}};
}

static float length_of(const float v[3]) {
    return sqrtf(v[0] * v[0] + v[1] * v[1] + v[2] * v[2]);
}

static fm_vec3 light_of_found(const fm_scenery *scenery, const fm_ray *ray, const float way[3], found *what) {
    const fm_picture *picture = scenery->picture;
    const fm_view view = picture->desc.view;
    if (!what->solid) {
        return view == FM_VIEW_COLOR || view == FM_VIEW_SLICE ? fm_sky_light(&picture->push, way) : grey(FM_NOTHING);
    }
    const fm_hit hit = fm_hit_of(ray, &what->cell);
    if (view == FM_VIEW_NORMAL) {
        fm_vec3 light;
        for (int i = 0; i < 3; i++) {
            const float v = FM_NORMAL_MIDDLE + FM_NORMAL_PART * (float)hit.normal.v[i];
            light.v[i] = v * v;
        }
        return light;
    }
    if (view == FM_VIEW_DISTANCE) {
        const float far = hit.time * length_of(way);
        return fm_light_of_map(scenery->map, 1 - far / (far + fm_most(ray->size)));
    }
    static const float weights[3] = {FM_GREY};
    const fm_vec3 light = fm_surface_light(scenery, &hit, &what->light);
    return view == FM_VIEW_DIFFERENCE ? grey(light.v[0] * weights[0] + light.v[1] * weights[1] + light.v[2] * weights[2]) : light;
}

static bool same_cell(const fm_vec3 *a, const fm_vec3 *b) {
    return memcmp(a, b, sizeof *a) == 0;
}

static fm_vec3 light_of_pixel(const fm_scenery *scenery, const pixel *at, found *what, bool *wrong) {
    const fm_picture *picture = scenery->picture;
    const fm_grid *grid = &scenery->grid;
    const fm_view view = picture->desc.view;
    float way[3], slice_at[3];
    fm_pixel_way(&picture->push, (float)at->x, (float)at->y, way);
    const fm_ray ray = fm_make_ray(grid, picture->push.origin, way);
    float time = fm_entry_time(&ray);
    bool cut = false;
    if (view == FM_VIEW_SLICE) {
        bool within;
        const float slice = slice_time(grid, picture, way, slice_at, &within);
        if (within) {
            return fm_slice_light(scenery, slice_at, FM_LINE_WIDTH * slice * length_of(picture->push.right));
        }
        cut = slice < 0;
        time = slice > time ? slice : time;
    }
    const fm_vec3 start = fm_cell_at(&ray, time);
    const fm_vec3 from = picture->beams ? fm_skip_ahead(&ray, start, time, at->beam) : start;
    *what = cut ? (found){.cell = start} : find(grid, &ray, from, picture->desc.march);
    if (view == FM_VIEW_STEPS) {
        return fm_light_of_map(scenery->map, log2f(1 + (float)what->reads) * FM_STEPS_SCALE);
    }
    if (view == FM_VIEW_DIFFERENCE) {
        const found right = find(grid, &ray, start, FM_MARCH_PLAIN);
        *wrong = right.solid != what->solid || (right.solid && !same_cell(&right.cell, &what->cell));
        what->solid = right.solid;
        what->cell = right.cell;
    }
    return *wrong ? (fm_vec3){{1, 0, 0}} : light_of_found(scenery, &ray, way, what);
}

static uint32_t with_crosshair(uint32_t color, uint32_t x, uint32_t y, const fm_render_desc *desc) {
    const uint32_t arm = desc->height / 60 > 4 ? desc->height / 60 : 4;
    const uint32_t half_width = desc->height / 720 > 1 ? desc->height / 720 : 1;
    const uint32_t off_x = (uint32_t)abs((int32_t)(2 * x + 1) - (int32_t)desc->width);
    const uint32_t off_y = (uint32_t)abs((int32_t)(2 * y + 1) - (int32_t)desc->height);
    const bool cross = (off_x <= 2 * half_width && off_y <= 2 * arm) || (off_y <= 2 * half_width && off_x <= 2 * arm);
    return cross ? color ^ 0x00ffffffu : color;
}

static void count_pixel(fm_render_stats *stats, const found *what, bool wrong) {
    stats->rays++;
    stats->hits += what->solid;
    stats->steps += what->reads;
    stats->sun_reads += what->light.sun;
    stats->occlusion_reads += what->light.open;
    stats->most_steps = fm_max_u64(stats->most_steps, what->reads);
    stats->wrong += wrong;
}

static void run_tile(const render_job *job, uint32_t tile_x, uint32_t tile_y, fm_render_stats *stats) {
    const fm_render_desc *desc = &job->scenery.picture->desc;
    const uint32_t x_end = (uint32_t)fm_min_u64((tile_x + 1) * FM_TILE, desc->width);
    const uint32_t y_end = (uint32_t)fm_min_u64((tile_y + 1) * FM_TILE, desc->height);
    pixel at = {.beam = 0};
    if (job->scenery.picture->beams) {
        uint32_t reads = 0;
        at.beam = fm_beam_end(&job->scenery.grid, &job->scenery.picture->push, tile_x, tile_y, &reads);
        stats->beam_reads += reads;
    }
    for (at.y = tile_y * FM_TILE; at.y < y_end; at.y++) {
        for (at.x = tile_x * FM_TILE; at.x < x_end; at.x++) {
            found what = {0};
            bool wrong = false;
            const uint32_t color = fm_pack_light(light_of_pixel(&job->scenery, &at, &what, &wrong));
            job->pixels[(uint64_t)at.y * desc->width + at.x] = desc->crosshair ? with_crosshair(color, at.x, at.y, desc) : color;
            count_pixel(stats, &what, wrong);
        }
    }
}

static void add_stats(fm_render_stats *sum, const fm_render_stats *stats) {
    sum->rays += stats->rays;
    sum->hits += stats->hits;
    sum->steps += stats->steps;
    sum->beam_reads += stats->beam_reads;
    sum->sun_reads += stats->sun_reads;
    sum->occlusion_reads += stats->occlusion_reads;
    sum->wrong += stats->wrong;
    sum->most_steps = fm_max_u64(sum->most_steps, stats->most_steps);
}

static void run_rows(void *user, uint64_t begin, uint64_t end, uint32_t worker) {
    render_job *job = user;
    const uint32_t tiles = (uint32_t)fm_div_up(job->scenery.picture->desc.width, FM_TILE);
    fm_render_stats stats = {0};
    for (uint64_t y = begin; y < end; y++) {
        for (uint32_t x = 0; x < tiles; x++) {
            run_tile(job, x, (uint32_t)y, &stats);
        }
    }
    add_stats(&job->stats[worker], &stats);
}

static fm_result make_room(fm_renderer *renderer, uint64_t bytes) {
    fm_context *context = renderer->context;
    if (renderer->pixel_bytes == bytes) {
        return FM_OK;
    }
    uint32_t *pixels = fm_alloc(&context->allocator, bytes, "a picture");
    if (!pixels) {
        return FM_ERROR_OUT_OF_HOST_MEMORY;
    }
    fm_free(&context->allocator, renderer->pixels, renderer->pixel_bytes);
    fm_meter_remove(&context->host[FM_PURPOSE_PICTURES], renderer->pixel_bytes);
    fm_meter_add(&context->host[FM_PURPOSE_PICTURES], bytes);
    renderer->pixels = pixels;
    renderer->pixel_bytes = bytes;
    return FM_OK;
}

fm_result fm_host_render(fm_renderer *renderer, const fm_world *world, const fm_picture *picture) {
    const fm_render_desc *desc = &picture->desc;
    const uint64_t bytes = 4 * (uint64_t)desc->width * desc->height;
    const fm_allocator *allocator = &renderer->context->allocator;
    const uint32_t workers = fm_pool_threads(renderer->context->pool);
    render_job job = {.scenery = {fm_grid_of(world), picture, renderer->map},
                      .stats = fm_alloc_zero(allocator, workers * sizeof *job.stats, "a picture's sums")};
    if (!job.stats) {
        return FM_ERROR_OUT_OF_HOST_MEMORY;
    }
    // The last that can fail: until here the newest picture is untouched.
    const fm_result result = make_room(renderer, bytes);
    if (result == FM_OK) {
        job.pixels = renderer->pixels;
        fm_passes_begin(renderer->context);
        fm_pool_run(renderer->context->pool, fm_div_up(desc->height, FM_TILE), 1, run_rows, &job);
        fm_passes_end(renderer->context, "march", bytes);
        if (desc->count) {
            renderer->stats = (fm_render_stats){0};
            for (uint32_t i = 0; i < workers; i++) {
                add_stats(&renderer->stats, &job.stats[i]);
            }
        }
    }
    fm_free(allocator, job.stats, workers * sizeof *job.stats);
    return result;
}

void fm_host_pick(const fm_world *world, const fm_picture *picture, const float way[3], fm_pick *pick) {
    const fm_grid grid = fm_grid_of(world);
    fm_passes_begin(world->context);
    const fm_ray ray = fm_make_ray(&grid, picture->push.origin, way);
    const found what = find(&grid, &ray, fm_cell_at(&ray, fm_entry_time(&ray)), picture->desc.march);
    *pick = (fm_pick){.hit = what.solid};
    if (what.solid) {
        const fm_hit hit = fm_hit_of(&ray, &what.cell);
        pick->distance = hit.time * length_of(way);
        for (int i = 0; i < 3; i++) {
            pick->voxel[i] = hit.voxel.v[i];
            pick->face += hit.normal.v[i] * (i + 1);
        }
    }
    fm_passes_end(world->context, "pick", sizeof(fm_gpu_pick));
}
