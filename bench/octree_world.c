// SPDX-License-Identifier: MIT
// Octrees of voxels: of worlds that are edited, beside the worlds' own fields, and of a shell that no memory holds as a whole.

#include "noise.h"
#include "octree.h"
#include "tables.h"
#include "words.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

enum { CHECKED = 400 };

// ---------------------------------------------------------------------------------------------------------------------------
// The check: from voxel to voxel along sampled rays
// ---------------------------------------------------------------------------------------------------------------------------

// How far the ray goes to the first solid voxel within a grid of `size`^3; +infinity where there is none.
static double march(bench_octree_solid solid, const void *user, uint32_t size, const fm_mesh_ray *ray) {
    double first = 0, last = INFINITY, t[3], step[3];
    int64_t at[3], way[3];
    for (int k = 0; k < 3; k++) {
        const double o = (double)ray->origin[k] + 0.5, d = (double)ray->direction[k];
        const double a = (0 - o) / d, b = (size - o) / d;
        first = fmax(first, fmin(a, b));
        last = fmin(last, fmax(a, b));
    }
    for (int k = 0; k < 3; k++) {
        const double o = (double)ray->origin[k] + 0.5, d = (double)ray->direction[k];
        at[k] = (int64_t)fmin(fmax(floor(o + first * d), 0), size - 1.0);
        way[k] = d > 0 ? 1 : -1;
        step[k] = fabs(1 / d);
        t[k] = ((double)(at[k] + (d > 0)) - o) / d;
    }
    double now = first;
    while (first <= last) {
        if (solid(user, at)) {
            return now;
        }
        const int k = t[0] < t[1] ? (t[0] < t[2] ? 0 : 2) : t[1] < t[2] ? 1 : 2;
        now = t[k];
        at[k] += way[k];
        t[k] += step[k];
        if (at[k] < 0 || at[k] >= size) {
            return INFINITY;
        }
    }
    return INFINITY;
}

void bench_octree_check_voxels(bench_octree_solid solid, const void *user, uint32_t size, const fm_camera *camera,
                               const bench_octree_plan *plan, const fm_octree_hit *hits, bench_octree_result *result) {
    const uint64_t count = (uint64_t)plan->width * plan->height;
    fm_mesh_ray *rays = malloc(count * sizeof *rays);
    if (!rays) {
        bench_octree_failed(result, "out of memory: free some");
        return;
    }
    bench_octree_rays(camera, plan->width, plan->height, rays, NULL);
    result->samples = fmin(plan->samples, CHECKED);
    result->wrong = 0;
    for (uint32_t i = 0; i < (uint32_t)result->samples; i++) {
        const uint64_t at = fm_mix(i) % count;
        const double t = march(solid, user, size, &rays[at]);
        result->wrong += isfinite(t) != isfinite(hits[at].t) || (isfinite(t) && fabs(t - (double)hits[at].t) > 0.02 + 1e-5 * t);
    }
    free(rays);
    // Rays along a voxel's edge may go either way.
    if (result->wrong > 0.02 * result->samples) {
        bench_octree_failed(result, "more than 2 % of the sampled pixels show another voxel than the first one on their way");
    }
}

// ---------------------------------------------------------------------------------------------------------------------------
// Worlds
// ---------------------------------------------------------------------------------------------------------------------------

typedef struct world_job {
    fm_context *context;
    fm_world *world;
    uint32_t size;
    uint32_t *voxels;  // for the check
    fm_octree *octree;
    fm_octree_desc desc;
} world_job;

static bool open_world(bench_session *session, const char *scene, uint32_t size, world_job *job) {
    const fm_scene_desc scene_desc = {.shape = {size, size, size}, .seed = 1};
    const fm_world_desc desc = {.shape = scene_desc.shape};
    const fm_volume_desc grid = {.shape = scene_desc.shape, .type = FM_TYPE_U8};
    fm_volume *volume = NULL;
    job->context = bench_session_context(session, FM_BACKEND_AUTO);
    job->size = size;
    job->voxels = malloc((uint64_t)size * size * size * sizeof *job->voxels);
    bool good = job->context && job->voxels && fm_volume_create(NULL, &grid, &volume) == FM_OK;
    if (good) {
        fm_scene_fill_threads(fm_scene_find(scene), &scene_desc, 0, size, 0, fm_volume_data(volume));
        good = fm_volume_set_palette(volume, fm_scene_palette()) == FM_OK &&
               fm_world_create(job->context, &desc, &job->world) == FM_OK && fm_world_load(job->world, volume) == FM_OK &&
               fm_world_update(job->world, NULL) == FM_OK;
    }
    fm_volume_destroy(volume);
    return good;
}

static void close_world(world_job *job) {
    fm_octree_destroy(job->octree);
    fm_world_destroy(job->world);
    free(job->voxels);
}

static bool fetch_voxels(world_job *job) {
    const fm_box all = {.end = {job->size, job->size, job->size}};
    return fm_world_read(job->world, &all, job->voxels) == FM_OK;
}

static bool is_solid(const void *user, const int64_t at[3]) {
    const world_job *job = user;
    return job->voxels[at[0] + (int64_t)job->size * (at[1] + (int64_t)job->size * at[2])] != 0;
}

static fm_camera camera_of(uint32_t size, const bench_octree_plan *plan) {
    const double middle = size / 2.0 - 0.5;
    return bench_octree_camera((const double[3]){middle, middle, middle}, 0.6 * size, (double)plan->width / plan->height, false);
}

static bool build_once(void *user, double *milliseconds) {
    world_job *job = user;
    fm_octree_destroy(job->octree);
    job->octree = NULL;
    const double start = fm_now_ms();
    const bool good = fm_octree_build_world(job->world, &job->desc, &job->octree) == FM_OK;
    *milliseconds = fm_now_ms() - start;
    return good;
}

// Pictures of an octree of voxels, checked.
static bool look(bench_session *session, fm_octree *octree, bench_octree_solid solid, const void *user, uint32_t size,
                 const bench_octree_plan *plan, bench_octree_result *result) {
    const fm_camera camera = camera_of(size, plan);
    fm_octree_hit *hits = malloc((uint64_t)plan->width * plan->height * sizeof *hits);
    const bool good = hits ? bench_octree_frames(session, octree, &camera, 0, plan, hits, result)
                           : bench_octree_failed(result, "out of memory: free some");
    if (good) {
        bench_octree_check_voxels(solid, user, size, &camera, plan, hits, result);
    }
    free(hits);
    return good && !result->failure[0];
}

// ---------------------------------------------------------------------------------------------------------------------------
// The field
// ---------------------------------------------------------------------------------------------------------------------------

typedef struct field_job {
    world_job *world;
    fm_renderer *renderer;
    fm_render_desc desc;
} field_job;

static bool field_picture(void *user, double *milliseconds) {
    const field_job *job = user;
    const bool good = fm_render(job->renderer, job->world->world, &job->desc, NULL) == FM_OK;
    *milliseconds = bench_octree_passes(job->world->context, NULL);
    return good;
}

// Whether the picture is that of a march from voxel to voxel.
static bool check_field(field_job *job, fm_render_stats *stats, bench_octree_result *result) {
    double unused;
    job->desc.count = true;
    job->desc.shadow = FM_SHADOW_NONE;
    if (!field_picture(job, &unused) || fm_renderer_stats(job->renderer, stats) != FM_OK) {
        return false;
    }
    fm_render_stats wrong;
    job->desc.view = FM_VIEW_DIFFERENCE;
    if (!field_picture(job, &unused) || fm_renderer_stats(job->renderer, &wrong) != FM_OK) {
        return false;
    }
    result->samples = (double)wrong.rays;
    result->wrong = (double)wrong.wrong;
    return true;
}

static bool look_at_field(bench_session *session, world_job *world, const bench_octree_plan *plan, bench_octree_result *result) {
    field_job job = {.world = world,
                     .desc = {.camera = camera_of(world->size, plan), .width = plan->width, .height = plan->height}};
    fm_render_stats stats;
    bool good = fm_renderer_create(world->context, &job.renderer) == FM_OK &&
                bench_octree_time(field_picture, &job, plan->frames, plan->seconds, plan->warm_up_ms, &result->primary);
    bench_stats both = {0};
    job.desc.shadow = FM_SHADOW_HARD;
    good = good && bench_octree_time(field_picture, &job, plan->frames, plan->seconds, plan->warm_up_ms / 4, &both) &&
           check_field(&job, &stats, result);
    fm_renderer_destroy(job.renderer);
    if (!good) {
        return bench_octree_failed(result, NULL);
    }
    const double rays = (double)stats.rays, voxels = pow(world->size, 3);
    result->width = plan->width;
    result->height = plan->height;
    result->primary_rays = rays * 1e3 / result->primary.median;
    // One pass does both: what shadows add.
    result->second_rays =
        both.median > result->primary.median ? (double)stats.hits * 1e3 / (both.median - result->primary.median) : NAN;
    result->reads = (double)(stats.steps + stats.beam_reads) / rays;
    result->most_reads = (double)stats.most_steps;
    result->copy = bench_session_bandwidth(session, FM_BACKEND_AUTO);
    result->touched = result->primary_rays * result->reads * 32;
    fm_memory memory[BENCH_MAX_MEMORY];
    uint32_t count = BENCH_MAX_MEMORY;
    if (fm_context_memory(world->context, &count, memory) == FM_OK) {
        result->bytes = (double)bench_memory_bytes(memory, count, "field", fm_context_backend(world->context) == FM_BACKEND_VULKAN);
    }
    result->voxels = voxels;
    result->bytes_a_voxel = result->bytes / voxels;
    snprintf(result->note, sizeof result->note, "a word for each voxel of the grid, solid or not");
    return result->wrong == 0 || bench_octree_failed(result, "the picture by the field is not that of its voxels");
}

bool bench_octree_world(bench_session *session, const char *scene, const bench_octree_way *way, const bench_octree_plan *plan,
                        uint32_t size, bench_octree_result *result) {
    world_job job = {.desc = {.kind = way->kind, .threshold = way->threshold}};
    result->size = size;
    bool good = open_world(session, scene, size, &job) || bench_octree_failed(result, NULL);
    if (good && way->field) {
        good = look_at_field(session, &job, plan, result);
    } else if (good) {
        good = bench_octree_time(build_once, &job, plan->frames, plan->seconds, 0, &result->build) && fetch_voxels(&job);
        if (!good) {
            bench_octree_failed(result, NULL);
        } else {
            bench_octree_tell_memory(job.octree, result);
            good = look(session, job.octree, is_solid, &job, size, plan, result);
        }
    }
    close_world(&job);
    return good;
}

// ---------------------------------------------------------------------------------------------------------------------------
// Edits
// ---------------------------------------------------------------------------------------------------------------------------

// A ball at the surface of a random column, dug or built.
static bool brush_at(world_job *job, uint32_t i, uint32_t radius, fm_brush *brush) {
    const uint64_t random = fm_mix(fm_mix(radius) + i);
    const int64_t x = (int64_t)(random % job->size), y = (int64_t)((random >> 24) % job->size);
    const fm_box column = {{x, y, 0}, {x + 1, y + 1, job->size}};
    uint32_t z = job->size;
    // The copy's room is only wanted again after the last edit.
    if (fm_world_read(job->world, &column, job->voxels) != FM_OK) {
        return false;
    }
    while (z > 1 && job->voxels[z - 1] == 0) {
        z--;
    }
    *brush = (fm_brush){.voxel = random >> 63 ? 1 + (uint32_t)(random >> 55 & 0x7f) : 0,
                        .from = {(int32_t)x, (int32_t)y, (int32_t)z - 1},
                        .radius = radius};
    return true;
}

static bool edit_once(world_job *job, uint32_t i, uint32_t radius, double *octree_ms, double *field_ms) {
    fm_brush brush;
    if (!brush_at(job, i, radius, &brush) || fm_world_edit(job->world, &brush, 1) != FM_OK) {
        return false;
    }
    fm_box box;
    for (int k = 0; k < 3; k++) {
        box.begin[k] = brush.from[k] - (int64_t)radius;
        box.end[k] = brush.from[k] + (int64_t)radius + 1;
    }
    const double start = fm_now_ms();
    if (fm_world_update(job->world, NULL) != FM_OK) {
        return false;
    }
    const double updated = fm_now_ms();
    *field_ms = updated - start;
    const bool good = !job->octree || fm_octree_update_world(job->octree, job->world, &box, 1) == FM_OK;
    *octree_ms = fm_now_ms() - updated;
    return good;
}

bool bench_octree_update(bench_session *session, const char *scene, const bench_octree_way *way, const bench_octree_plan *plan,
                         uint32_t size, uint32_t radius, bench_octree_result *result) {
    static double octree_ms[BENCH_STATS_MAX], field_ms[BENCH_STATS_MAX];
    world_job job = {.desc = {.kind = way->kind, .threshold = way->threshold}};
    double unused;
    result->size = size;
    result->radius = radius;
    bool good = open_world(session, scene, size, &job) && (way->field || build_once(&job, &unused));
    const double begin = fm_now_ms();
    uint32_t count = 0;
    while (good && count < plan->edits && (count == 0 || fm_now_ms() - begin < plan->seconds * 1e3)) {
        good = edit_once(&job, count, radius, &octree_ms[count], &field_ms[count]);
        count++;
    }
    good = (good && fetch_voxels(&job)) || bench_octree_failed(result, NULL);
    if (good) {
        result->update = bench_stats_of(way->field ? field_ms : octree_ms, count);
    }
    if (good && job.octree) {
        bench_octree_plan few = *plan;
        few.frames = 1;
        few.warm_up_ms = 0;
        bench_octree_tell_memory(job.octree, result);
        good = look(session, job.octree, is_solid, &job, size, &few, result);
    }
    close_world(&job);
    return good;
}

// ---------------------------------------------------------------------------------------------------------------------------
// The shell
// ---------------------------------------------------------------------------------------------------------------------------

// Voxels whose centre is within half a voxel of a ball's surface, all in whole numbers: no two sizes differ by rounding.
typedef struct shell {
    int64_t size;
} shell;

static int64_t square_from(const shell *s, int64_t at) {
    const int64_t twice = 2 * at + 1 - s->size;
    return twice * twice;
}

static bool shell_solid(const void *user, const int64_t at[3]) {
    const shell *s = user;
    const int64_t d2 = square_from(s, at[0]) + square_from(s, at[1]) + square_from(s, at[2]), radius = s->size / 2;
    return d2 >= (radius - 1) * (radius - 1) && d2 < (radius + 1) * (radius + 1);
}

static fm_result shell_read(void *user, const fm_box *box, uint32_t *voxels) {
    int64_t at[3];
    for (at[2] = box->begin[2]; at[2] < box->end[2]; at[2]++) {
        for (at[1] = box->begin[1]; at[1] < box->end[1]; at[1]++) {
            for (at[0] = box->begin[0]; at[0] < box->end[0]; at[0]++) {
                *voxels++ = shell_solid(user, at) ? 1 : 0;
            }
        }
    }
    return FM_OK;
}

static bool shell_air(void *user, const fm_box *box) {
    const shell *s = user;
    int64_t least = 0, most = 0;
    for (int k = 0; k < 3; k++) {
        const int64_t a = square_from(s, box->begin[k]), b = square_from(s, box->end[k] - 1);
        const bool across = 2 * box->begin[k] + 1 < s->size && 2 * box->end[k] - 1 > s->size;
        least += across ? 0 : (a < b ? a : b);
        most += a > b ? a : b;
    }
    const int64_t radius = s->size / 2;
    return most < (radius - 1) * (radius - 1) || least >= (radius + 1) * (radius + 1);
}

typedef struct shell_job {
    fm_context *context;
    fm_voxel_source source;
    fm_octree_desc desc;
    fm_octree *octree;
} shell_job;

static bool build_shell(void *user, double *milliseconds) {
    shell_job *job = user;
    fm_octree_destroy(job->octree);
    job->octree = NULL;
    const double start = fm_now_ms();
    const bool good = fm_octree_build_voxels(job->context, &job->source, &job->desc, &job->octree) == FM_OK;
    *milliseconds = fm_now_ms() - start;
    return good;
}

bool bench_octree_scale(bench_session *session, const bench_octree_way *way, const bench_octree_plan *plan, uint32_t size,
                        bench_octree_result *result) {
    shell what = {size};
    shell_job job = {.context = bench_session_context(session, FM_BACKEND_AUTO),
                     .source = {&what, {size, size, size}, shell_read, shell_air, true},
                     .desc = {.kind = way->kind, .threshold = way->threshold}};
    result->size = size;
    snprintf(result->model, sizeof result->model, "shell");
    bool good = bench_octree_time(build_shell, &job, 1, plan->seconds, 0, &result->build) || bench_octree_failed(result, NULL);
    if (good) {
        bench_octree_tell_memory(job.octree, result);
        good = look(session, job.octree, shell_solid, &what, size, plan, result);
    }
    fm_octree_destroy(job.octree);
    return good;
}
