// SPDX-License-Identifier: MIT
// Builds, pictures, and how far pictures are from the truth.

#include "image_error.h"
#include "noise.h"
#include "octree.h"
#include "words.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

enum { MAX_PASSES = 64, SECTOR = 32 };

// Hits farther than this many finest cells from the triangles are wrong: the band in which leaves have values, or two voxels.
static const double most_off = 3.5, most_wrong = 0.01;

const char *const bench_octree_mode_words[] = {"picture", "memory", "error", "update", "scale", "share", "code", NULL};
const char *const bench_octree_match_words[] = {"memory", "time", "surface", "image", NULL};

static const bench_octree_way ways[] = {
    {.name = "closest", .kind = FM_OCTREE_CLOSEST},
    {.name = "closest-sampled", .kind = FM_OCTREE_CLOSEST, .epsilon = -0.1f},
    {.name = "closest-near", .kind = FM_OCTREE_CLOSEST, .band = 1},
    {.name = "closest-thin", .kind = FM_OCTREE_CLOSEST, .code = FM_OCTREE_SHORT, .threshold = 0.15f, .band = 0.1f},
    {.name = "distance", .kind = FM_OCTREE_DISTANCE},
    {.name = "distance-sampled", .kind = FM_OCTREE_DISTANCE, .epsilon = -0.1f},
    {.name = "voxels", .kind = FM_OCTREE_VOXELS, .worlds = true},
    {.name = "svo", .kind = FM_OCTREE_CONTOURS, .worlds = true},
    {.name = "svo-cubes", .kind = FM_OCTREE_CONTOURS, .threshold = -1},
    {.name = "dag", .kind = FM_OCTREE_DAG, .worlds = true},
    {.name = "tree64", .kind = FM_OCTREE_TREE64, .worlds = true},
    {.name = "bricks", .kind = FM_OCTREE_BRICKS},
    {.name = "field", .field = true, .worlds = true}};
const char *const bench_octree_way_words[] = {
    "closest", "closest-sampled", "closest-near", "closest-thin", "distance", "distance-sampled", "voxels", "svo", "svo-cubes",
    "dag",     "tree64",          "bricks",       "field",        NULL};
_Static_assert(sizeof bench_octree_way_words / sizeof bench_octree_way_words[0] == sizeof ways / sizeof ways[0] + 1,
               "words of all ways");

const bench_octree_way *bench_octree_way_at(uint32_t i) {
    return i < sizeof ways / sizeof ways[0] ? &ways[i] : NULL;
}

bool bench_octree_failed(bench_octree_result *result, const char *message) {
    snprintf(result->failure, sizeof result->failure, "%s", message ? message : fm_last_error());
    return false;
}

// ---------------------------------------------------------------------------------------------------------------------------
// Times
// ---------------------------------------------------------------------------------------------------------------------------

double bench_octree_passes(fm_context *context, const char *but) {
    fm_pass passes[MAX_PASSES];
    uint32_t count = MAX_PASSES;
    double sum = 0;
    if (fm_context_passes(context, &count, passes) == FM_OK) {
        for (uint32_t i = 0; i < count; i++) {
            sum += but && strcmp(passes[i].name, but) == 0 ? 0 : passes[i].milliseconds;
        }
    }
    return sum;
}

bool bench_octree_time(bench_octree_once once, void *user, uint32_t runs, double seconds, double warm_up_ms, bench_stats *stats) {
    double values[BENCH_STATS_MAX], unused;
    const double warm = fm_now_ms();
    bool good = true;
    while (good && fm_now_ms() - warm < warm_up_ms) {
        good = once(user, &unused);
    }
    const double begin = fm_now_ms();
    uint32_t count = 0;
    while (good && count < runs && (count == 0 || fm_now_ms() - begin < seconds * 1e3)) {
        good = once(user, &values[count++]);
    }
    if (good) {
        *stats = bench_stats_of(values, count);
    }
    return good;
}

typedef struct build_job {
    fm_mesh *mesh;
    fm_octree_desc desc;
    fm_octree *octree;
} build_job;

// Positions are given anew, so that the mesh's tree is part of the build.
static bool build_once(void *user, double *milliseconds) {
    build_job *job = user;
    const float(*vertices)[3];
    fm_octree_destroy(job->octree);
    job->octree = NULL;
    fm_mesh_arrays(job->mesh, &vertices, NULL, NULL, NULL);
    const double start = fm_now_ms();
    const bool good = fm_mesh_deform(job->mesh, vertices, FM_TREE_REBUILD) == FM_OK &&
                      fm_octree_build_mesh(job->mesh, &job->desc, &job->octree) == FM_OK;
    *milliseconds = fm_now_ms() - start;
    return good;
}

void bench_octree_tell_memory(const fm_octree *octree, bench_octree_result *result) {
    fm_octree_info info;
    fm_octree_describe(octree, &info);
    result->build_gpu_ms = info.gpu_ms;
    result->node_bytes = (double)info.node_bytes;
    result->leaf_bytes = (double)info.leaf_bytes;
    result->attribute_bytes = (double)info.attribute_bytes;
    result->bytes = result->node_bytes + result->leaf_bytes + result->attribute_bytes;
    result->unshared_bytes = (double)info.unshared_bytes;
    result->share_ratio = result->unshared_bytes / result->bytes;
    result->leaves = result->voxels = 0;
    for (int level = 0; level < 24; level++) {
        result->leaves += (double)info.leaves[level];
        result->voxels += ldexp((double)info.leaves[level], 3 * level);
    }
    result->bytes_a_leaf = result->bytes / result->leaves;
    result->bytes_a_voxel = result->bytes / result->voxels;
    result->code_vector = info.kind == FM_OCTREE_CLOSEST ? info.code_error : NAN;
}

bool bench_octree_build(bench_octree_model *model, const bench_octree_way *way, const bench_octree_plan *plan, uint32_t size,
                        uint32_t runs, fm_octree **octree, bench_octree_result *result) {
    const bool vectors = way->kind == FM_OCTREE_CLOSEST || way->kind == FM_OCTREE_DISTANCE;
    build_job job = {.mesh = model->mesh, .desc = {.kind = way->kind, .size = size, .threshold = way->threshold}};
    memcpy(job.desc.low, model->low, sizeof model->low);
    memcpy(job.desc.high, model->high, sizeof model->high);
    if (vectors) {
        job.desc.method = plan->method;
        job.desc.threshold = way->threshold > 0 ? way->threshold : plan->threshold;
        job.desc.band = way->band > 0 ? way->band : plan->band;
        job.desc.share = plan->share;
        job.desc.code = way->kind != FM_OCTREE_CLOSEST ? FM_OCTREE_SPHERICAL : way->code ? way->code : plan->code;
    }
    result->size = size;
    result->triangles = model->triangles;
    if (!bench_octree_time(build_once, &job, runs, plan->seconds, 0, &result->build)) {
        fm_octree_destroy(job.octree);
        return bench_octree_failed(result, NULL);
    }
    bench_octree_tell_memory(job.octree, result);
    *octree = job.octree;
    return true;
}

typedef struct picture_job {
    fm_context *context;
    fm_octree_renderer *renderer;
    fm_octree_render_desc desc;
    bool seconds;  // the time is that of secondary rays, else of all before them
} picture_job;

static bool picture_once(void *user, double *milliseconds) {
    const picture_job *job = user;
    if (fm_octree_render(job->renderer, &job->desc, NULL) != FM_OK) {
        return false;
    }
    const double all = bench_octree_passes(job->context, NULL), first = bench_octree_passes(job->context, "second");
    *milliseconds = job->seconds ? all - first : first;
    return true;
}

// Counting costs a little, so it is a picture of its own.
static bool count_reads(picture_job *job, fm_octree_hit *hits, fm_octree_render_stats *stats) {
    double unused;
    job->desc.count = true;
    return picture_once(job, &unused) && fm_octree_renderer_stats(job->renderer, stats) == FM_OK &&
           fm_octree_renderer_hits(job->renderer, hits) == FM_OK;
}

static double a_second(double count, const bench_stats *time) {
    return time->count && time->median > 0 ? count * 1e3 / time->median : NAN;
}

bool bench_octree_frames(bench_session *session, fm_octree *octree, const fm_camera *camera, float epsilon,
                         const bench_octree_plan *plan, fm_octree_hit *hits, bench_octree_result *result) {
    fm_octree_render_stats stats;
    picture_job job = {
        .context = bench_session_context(session, FM_BACKEND_AUTO),
        .desc = {.camera = *camera, .width = plan->width, .height = plan->height, .octree = octree, .epsilon = epsilon}};
    double unused;
    const double start = fm_now_ms();
    bool good = fm_octree_renderer_create(job.context, &job.renderer) == FM_OK && picture_once(&job, &unused);
    result->first_ms = fm_now_ms() - start;
    good = good && bench_octree_time(picture_once, &job, plan->frames, plan->seconds, plan->warm_up_ms, &result->primary);
    job.desc.shadow = job.seconds = true;
    good = good && bench_octree_time(picture_once, &job, plan->frames, plan->seconds, plan->warm_up_ms / 4, &result->second) &&
           count_reads(&job, hits, &stats);
    fm_octree_renderer_destroy(job.renderer);
    if (!good) {
        return bench_octree_failed(result, NULL);
    }
    const double rays = (double)stats.rays;
    result->width = plan->width;
    result->height = plan->height;
    result->reads = (double)(stats.reads + stats.beam_reads) / rays;
    result->most_reads = (double)stats.most_reads;
    result->second_reads = stats.second_rays ? (double)stats.second_reads / (double)stats.second_rays : NAN;
    result->primary_rays = a_second(rays, &result->primary);
    result->second_rays = stats.second_rays ? a_second((double)stats.second_rays, &result->second) : NAN;
    result->touched = result->primary_rays * result->reads * SECTOR;
    result->copy = bench_session_bandwidth(session, FM_BACKEND_AUTO);
    return true;
}

// ---------------------------------------------------------------------------------------------------------------------------
// Errors
// ---------------------------------------------------------------------------------------------------------------------------

static int compare(const void *a, const void *b) {
    const double x = *(const double *)a, y = *(const double *)b;
    return (x > y) - (x < y);
}

static void mean_and_p99(double *values, uint64_t count, double *mean, double *p99) {
    *mean = *p99 = NAN;
    if (count > 0) {
        double sum = 0;
        for (uint64_t i = 0; i < count; i++) {
            sum += values[i];
        }
        qsort(values, count, sizeof *values, compare);
        *mean = sum / (double)count;
        *p99 = values[(99 * count + 99) / 100 - 1];
    }
}

typedef struct looked {
    const bench_octree_model *model;
    const bench_octree_view *view;
    const bench_octree_seen *seen;
    const fm_mesh_ray *rays;
    uint64_t count;
    double step, cell;
} looked;

static bool compare_depths(const looked *l, bench_octree_result *result) {
    double *off = malloc(l->count * sizeof *off);
    if (!off) {
        return false;
    }
    uint64_t both = 0, one = 0;
    for (uint64_t i = 0; i < l->count; i++) {
        const bool a = isfinite(l->seen[i].t), b = isfinite(l->view->truth[i].t);
        one += a != b;
        if (a && b) {
            off[both++] = fabs((double)l->seen[i].t - (double)l->view->truth[i].t) / l->cell;
        }
    }
    result->silhouette = (double)one / (double)l->count;
    mean_and_p99(off, both, &result->depth_mean, &result->depth_p99);
    free(off);
    return true;
}

// Whether all around a pixel, two cells away, the triangles are hit as near: then no octree of that cell may miss them, or see
// what is behind them.
static bool amidst(const looked *l, uint64_t at) {
    const int64_t width = l->model->width, height = l->model->height, x = (int64_t)at % width, y = (int64_t)at / width;
    const double t = (double)l->view->truth[at].t;
    if (!isfinite(t)) {
        return false;
    }
    const int64_t reach = 1 + (int64_t)ceil(2 * l->cell / (t * l->step));
    for (int i = 0; i < 9; i++) {
        const int64_t there_x = x + (i % 3 - 1) * reach, there_y = y + (i / 3 - 1) * reach;
        if (there_x < 0 || there_y < 0 || there_x >= width || there_y >= height ||
            !(fabs((double)l->view->truth[there_y * width + there_x].t - t) < 8 * l->cell)) {
            return false;
        }
    }
    return true;
}

static bool sample_surface(const looked *l, uint32_t samples, bench_octree_result *result) {
    float(*places)[3] = malloc((samples + 1) * sizeof *places);
    fm_closest *closest = malloc((samples + 1) * sizeof *closest);
    double *off = malloc((samples + 1) * sizeof *off);
    uint32_t found = 0;
    bool good = places && closest && off;
    result->samples = samples;
    result->wrong = 0;
    for (uint32_t i = 0; i < samples && good; i++) {
        const uint64_t at = fm_mix(i) % l->count;
        if (amidst(l, at) && !((double)l->seen[at].t < (double)l->view->truth[at].t + 8 * l->cell)) {
            result->wrong++;
            continue;
        }
        if (!isfinite(l->seen[at].t)) {
            continue;
        }
        for (int k = 0; k < 3; k++) {
            places[found][k] = (float)((double)l->rays[at].origin[k] + (double)l->seen[at].t * (double)l->rays[at].direction[k]);
        }
        found++;
    }
    good = good && fm_mesh_closest(l->model->mesh, (const float(*)[3])places, found, 0, closest) == FM_OK;
    for (uint32_t i = 0; i < found && good; i++) {
        off[i] = (l->model->distance ? l->model->distance(places[i]) : (double)closest[i].distance) / l->cell;
        result->wrong += !(off[i] <= most_off);
    }
    if (good) {
        mean_and_p99(off, found, &result->surface_mean, &result->surface_p99);
        result->surface_relative = result->surface_p99 * l->cell / l->model->longest;
    }
    free(off);
    free(closest);
    free(places);
    return good;
}

static bool compare_pictures(const looked *l, uint8_t *pixels, bench_octree_result *result) {
    float *picture = malloc(3 * l->count * sizeof *picture);
    if (!picture) {
        return false;
    }
    bench_octree_shade(&l->view->camera, l->seen, l->rays, l->count, picture);
    const image test = {picture, l->model->width, l->model->height};
    const image reference = {l->view->picture, l->model->width, l->model->height};
    result->rmse = image_rmse(&test, &reference);
    result->flip = image_flip(&test, &reference, 0, NULL);
    if (pixels) {
        bench_octree_bytes(picture, 3 * l->count, pixels);
    }
    free(picture);
    return result->rmse >= 0 && result->flip >= 0;
}

bool bench_octree_look(bench_session *session, bench_octree_model *model, uint32_t view, fm_octree *octree, float epsilon,
                       const bench_octree_plan *plan, uint8_t *pixels, bench_octree_result *result) {
    looked l = {.model = model, .view = bench_octree_view_of(model, view), .count = (uint64_t)plan->width * plan->height};
    if (!l.view) {
        return bench_octree_failed(result, NULL);
    }
    fm_octree_info info;
    fm_octree_describe(octree, &info);
    l.cell = info.cell;
    result->view = bench_octree_view_words[view];
    fm_octree_hit *hits = malloc(l.count * sizeof *hits);
    bench_octree_seen *seen = malloc(l.count * sizeof *seen);
    fm_mesh_ray *rays = malloc(l.count * sizeof *rays);
    bool good = hits && seen && rays;
    if (!good) {
        bench_octree_failed(result, "out of memory: free some");
    } else if ((good = bench_octree_frames(session, octree, &l.view->camera, epsilon, plan, hits, result))) {
        bench_octree_rays(&l.view->camera, plan->width, plan->height, rays, &l.step);
        for (uint64_t i = 0; i < l.count; i++) {
            seen[i] = (bench_octree_seen){hits[i].t, {hits[i].normal[0], hits[i].normal[1], hits[i].normal[2]}};
        }
        l.seen = seen;
        l.rays = rays;
        good = compare_depths(&l, result) && sample_surface(&l, plan->samples, result) && compare_pictures(&l, pixels, result);
        if (!good) {
            bench_octree_failed(result, NULL);
        } else if (result->wrong > most_wrong * result->samples) {
            good = bench_octree_failed(result, "more than 1 % of the sampled pixels are far from the triangles or miss them");
        }
    }
    free(rays);
    free(seen);
    free(hits);
    return good;
}
