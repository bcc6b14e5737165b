// SPDX-License-Identifier: MIT
// Pictures on the CPU: rows of pixels on the pool, as shaders/march.comp has them, without its beams.

#include "render/host_shade.h"

#include <stdlib.h>
#include <string.h>

typedef struct found {
    bool solid;
    fm_vec3 cell;
    uint32_t reads;
} found;

typedef struct render_job {
    fm_scenery scenery;
    uint32_t *pixels;
    fm_render_stats *stats;  // of each worker; NULL: not wanted
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

static fm_vec3 light_of_found(const fm_scenery *scenery, const fm_ray *ray, const float way[3], const found *what) {
    const fm_picture *picture = scenery->picture;
    const fm_view view = picture->desc.view;
    if (!what->solid) {
        return view == FM_VIEW_COLOR || view == FM_VIEW_SLICE ? fm_sky_light(&picture->push, way) : grey(0.01f);
    }
    const fm_hit hit = fm_hit_of(ray, &what->cell);
    if (view == FM_VIEW_NORMAL) {
        fm_vec3 light;
        for (int i = 0; i < 3; i++) {
            const float v = 0.5f + 0.45f * (float)hit.normal.v[i];
            light.v[i] = v * v;
        }
        return light;
    }
    if (view == FM_VIEW_DISTANCE) {
        const float far = hit.time * length_of(way);
        return fm_light_of_map(scenery->map, 1 - far / (far + fm_most(ray->size)));
    }
    const fm_vec3 light = fm_surface_light(scenery, &hit);
    return view == FM_VIEW_DIFFERENCE ? grey(0.5f * (light.v[0] * 0.3f + light.v[1] * 0.6f + light.v[2] * 0.1f)) : light;
}

static bool same_cell(const fm_vec3 *a, const fm_vec3 *b) {
    return memcmp(a, b, sizeof *a) == 0;
}

static fm_vec3 light_of_pixel(const fm_scenery *scenery, float x, float y, found *what, bool *wrong) {
    const fm_picture *picture = scenery->picture;
    const fm_grid *grid = &scenery->grid;
    const fm_view view = picture->desc.view;
    float way[3], slice_at[3];
    fm_pixel_way(&picture->push, x, y, way);
    const fm_ray ray = fm_make_ray(grid, picture->push.origin, way);
    float time = fm_entry_time(&ray);
    bool cut = false;
    if (view == FM_VIEW_SLICE) {
        bool within;
        const float slice = slice_time(grid, picture, way, slice_at, &within);
        if (within) {
            return fm_slice_light(scenery, slice_at, 0.6f * slice * length_of(picture->push.right));
        }
        cut = slice < 0;
        time = slice > time ? slice : time;
    }
    const fm_vec3 start = fm_cell_at(&ray, time);
    *what = cut ? (found){.cell = start} : find(grid, &ray, start, picture->desc.march);
    if (view == FM_VIEW_STEPS) {
        return fm_light_of_map(scenery->map, log2f(1 + (float)what->reads) * 0.125f);
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
    stats->most_steps = fm_max_u64(stats->most_steps, what->reads);
    stats->wrong += wrong;
}

static void run_rows(void *user, uint64_t begin, uint64_t end, uint32_t worker) {
    render_job *job = user;
    const fm_render_desc *desc = &job->scenery.picture->desc;
    for (uint64_t y = begin; y < end; y++) {
        for (uint32_t x = 0; x < desc->width; x++) {
            found what = {0};
            bool wrong = false;
            const fm_vec3 light = light_of_pixel(&job->scenery, (float)x, (float)y, &what, &wrong);
            const uint32_t color = fm_pack_light(light);
            job->pixels[y * desc->width + x] = desc->crosshair ? with_crosshair(color, x, (uint32_t)y, desc) : color;
            if (job->stats) {
                count_pixel(&job->stats[worker], &what, wrong);
            }
        }
    }
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

static fm_render_stats sum_of(const fm_render_stats *stats, uint32_t count) {
    fm_render_stats sum = {0};
    for (uint32_t i = 0; i < count; i++) {
        sum.rays += stats[i].rays;
        sum.hits += stats[i].hits;
        sum.steps += stats[i].steps;
        sum.wrong += stats[i].wrong;
        sum.most_steps = fm_max_u64(sum.most_steps, stats[i].most_steps);
    }
    return sum;
}

fm_result fm_host_render(fm_renderer *renderer, const fm_world *world, const fm_picture *picture) {
    const fm_render_desc *desc = &picture->desc;
    const uint64_t bytes = 4 * (uint64_t)desc->width * desc->height;
    const fm_allocator *allocator = &renderer->context->allocator;
    const uint32_t workers = fm_pool_threads(renderer->context->pool);
    render_job job = {.scenery = {fm_grid_of(world), picture, renderer->map}};
    if (desc->count) {
        job.stats = fm_alloc_zero(allocator, workers * sizeof *job.stats, "a picture's sums");
        if (!job.stats) {
            return FM_ERROR_OUT_OF_HOST_MEMORY;
        }
    }
    // The last that can fail: until here the newest picture is untouched.
    const fm_result result = make_room(renderer, bytes);
    if (result == FM_OK) {
        job.pixels = renderer->pixels;
        fm_passes_begin(renderer->context);
        fm_pool_run(renderer->context->pool, desc->height, 4, run_rows, &job);
        fm_passes_end(renderer->context, "march", bytes);
        if (job.stats) {
            renderer->stats = sum_of(job.stats, workers);
        }
    }
    fm_free(allocator, job.stats, workers * sizeof *job.stats);
    return result;
}

void fm_host_pick(const fm_world *world, const fm_picture *picture, float x, float y, fm_pick *pick) {
    const fm_grid grid = fm_grid_of(world);
    float way[3];
    fm_pixel_way(&picture->push, x, y, way);
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
}
