// SPDX-License-Identifier: MIT
// Kinds at equal memory, time or error; what sharing saves, and what 32-bit vectors cost.

#include "octree.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

enum { LEAST_SIZE = 16, MOST_TRIES = 9 };

static const double near_enough = 0.03;

static double measure_of(const bench_octree_result *result, bench_octree_match match) {
    return match == BENCH_MATCH_MEMORY    ? result->bytes
           : match == BENCH_MATCH_TIME    ? result->primary.median
           : match == BENCH_MATCH_SURFACE ? result->surface_relative
                                          : result->flip;
}

typedef struct search {
    bench_session *session;
    bench_octree_model *model;
    const bench_octree_way *way;
    const bench_octree_plan *plan;
    bench_octree_match match;
} search;

static bool try_size(const search *s, uint32_t size, bench_octree_result *result) {
    fm_octree *octree = NULL;
    bool good = bench_octree_build(s->model, s->way, s->plan, size, 1, &octree, result);
    if (good && s->match != BENCH_MATCH_MEMORY) {
        good = bench_octree_look(s->session, s->model, 0, octree, s->way->epsilon, s->plan, NULL, result);
    }
    fm_octree_destroy(octree);
    return good;
}

// Of memory the nearest is taken, of time the largest size that takes no longer, of errors the smallest that is no worse; the
// nearest where there is none.
static bool better(bench_octree_match match, double ratio, uint32_t size, double best_ratio, uint32_t best) {
    const bool fits = ratio <= 1 + near_enough, best_fits = best_ratio <= 1 + near_enough;
    if (best == 0 || match == BENCH_MATCH_MEMORY || (!fits && !best_fits)) {
        return best == 0 || fabs(log(ratio)) < fabs(log(best_ratio));
    }
    return fits != best_fits ? fits : match == BENCH_MATCH_TIME ? size > best : size < best;
}

// Memory and time grow with the size, errors fall. Where the ends of an interval are known its middle is tried next; before that
// the size is guessed, of memory from how it grows with the size's square.
bool bench_octree_matched(bench_session *session, bench_octree_model *model, const bench_octree_way *way, bench_octree_match match,
                          const bench_octree_result *to, const bench_octree_plan *plan, uint32_t most, bench_octree_result *result,
                          uint32_t *size) {
    const search s = {session, model, way, plan, match};
    const double wanted = measure_of(to, match);
    const bool falls = match == BENCH_MATCH_SURFACE || match == BENCH_MATCH_IMAGE;
    uint32_t low = LEAST_SIZE, high = most, at = (uint32_t)fmin(fmax(to->size, low), high), best = 0;
    double best_ratio = 0;
    for (int i = 0; i < MOST_TRIES && low <= high; i++) {
        bench_octree_result tried = *result;
        if (!try_size(&s, at, &tried)) {
            *result = tried;
            return false;
        }
        const double ratio = measure_of(&tried, match) / wanted;
        if (better(match, ratio, at, best_ratio, best)) {
            best_ratio = ratio;
            best = at;
        }
        if (fabs(log(ratio)) < near_enough) {
            break;
        }
        const bool grow = (ratio > 1) == falls, open = grow ? high == most : low == LEAST_SIZE;
        low = grow ? at + 1 : low;
        high = grow ? high : at - 1;
        const double guess = match == BENCH_MATCH_MEMORY ? at / sqrt(ratio)
                             : open                      ? at * (grow ? 2.0 : 0.5)
                                                         : sqrt((double)low * high);
        at = (uint32_t)fmin(fmax(guess, low), high);
    }
    *size = best;
    result->match = bench_octree_match_words[match];
    snprintf(result->note, sizeof result->note, "%s %.4g of what is wanted%s", bench_octree_match_words[match], best_ratio,
             best == most ? "; the largest size tried" : "");
    return true;
}

bool bench_octree_share(bench_octree_model *model, const bench_octree_way *way, const bench_octree_plan *plan, uint32_t size,
                        bench_octree_result *result) {
    bench_octree_plan shared = *plan;
    fm_octree *octree = NULL;
    shared.share = true;
    const bool good = bench_octree_build(model, way, &shared, size, 1, &octree, result);
    fm_octree_destroy(octree);
    return good;
}

// ---------------------------------------------------------------------------------------------------------------------------
// Codes
// ---------------------------------------------------------------------------------------------------------------------------

static int compare(const void *a, const void *b) {
    const double x = *(const double *)a, y = *(const double *)b;
    return (x > y) - (x < y);
}

// What the hits of a coded octree are off those of the same one with floats, along the surface's normal.
static double hits_apart(const fm_octree_hit *coded, const fm_octree_hit *exact, const fm_mesh_ray *rays, uint64_t count,
                         double cell, double *off, bench_octree_result *result) {
    uint64_t both = 0, one = 0;
    for (uint64_t i = 0; i < count; i++) {
        const bool a = isfinite(coded[i].t), b = isfinite(exact[i].t);
        one += a != b;
        if (a && b) {
            double along = 0;
            for (int k = 0; k < 3; k++) {
                along += (double)exact[i].normal[k] * (double)rays[i].direction[k];
            }
            off[both++] = fabs(((double)coded[i].t - (double)exact[i].t) * along) / cell;
        }
    }
    result->silhouette = (double)one / (double)count;
    qsort(off, both, sizeof *off, compare);
    return both ? off[(99 * both + 99) / 100 - 1] : NAN;
}

bool bench_octree_code(bench_session *session, bench_octree_model *model, fm_octree_code code, const bench_octree_plan *plan,
                       uint32_t size, bench_octree_result *result) {
    const uint64_t count = (uint64_t)plan->width * plan->height;
    const bench_octree_way *way = bench_octree_way_at(0);
    fm_octree_hit *hits[2] = {malloc(count * sizeof **hits), malloc(count * sizeof **hits)};
    fm_mesh_ray *rays = malloc(count * sizeof *rays);
    double *off = malloc(count * sizeof *off);
    const bench_octree_view *view = bench_octree_view_of(model, 0);
    bool good = (hits[0] && hits[1] && rays && off && view) || bench_octree_failed(result, NULL);
    double cell = 0;
    // The coded one last: its times and bytes are what is told.
    for (int i = 0; i < 2 && good; i++) {
        bench_octree_plan coded = *plan;
        fm_octree *octree = NULL;
        coded.code = i ? code : FM_OCTREE_FLOATS;
        good = bench_octree_build(model, way, &coded, size, 1, &octree, result) &&
               bench_octree_frames(session, octree, &view->camera, 0, plan, hits[i], result);
        if (good) {
            fm_octree_info info;
            fm_octree_describe(octree, &info);
            cell = info.cell;
        }
        fm_octree_destroy(octree);
    }
    if (good) {
        bench_octree_rays(&view->camera, plan->width, plan->height, rays, NULL);
        result->view = bench_octree_view_words[0];
        result->code_surface = hits_apart(hits[1], hits[0], rays, count, cell, off, result);
    }
    free(off);
    free(rays);
    free(hits[0]);
    free(hits[1]);
    return good;
}
