// SPDX-License-Identifier: MIT
// The public queries.

#include "mesh/bvh.h"
#include "mesh/gpu_mesh.h"
#include "mesh/triangle.h"
#include "mesh/winding.h"

#include <float.h>

enum { GRAIN = 64 };  // queries that a thread takes at once

typedef struct query_job {
    const fm_mesh *mesh;
    const float (*positions)[3];
    const fm_mesh_ray *rays;
    float bound;  // of distances
    bool any;
    float accuracy;
    fm_closest *closest;
    fm_mesh_hit *hits;
    float *winding;
} query_job;

static fm_result check(const fm_mesh *mesh, const void *queries, const char *name, uint32_t count, const void *answers,
                       const char *answers_name) {
    const char *missing = !mesh ? "mesh" : count == 0 ? NULL : !queries ? name : !answers ? answers_name : NULL;
    return missing ? fm_fail(FM_ERROR_INVALID_ARGUMENT, "%s is NULL", missing) : FM_OK;
}

static void find_closest(void *user, uint64_t begin, uint64_t end, uint32_t worker) {
    (void)worker;
    const query_job *job = user;
    for (uint64_t i = begin; i < end; i++) {
        const float *position = job->positions[i];
        // Squares of small bounds underflow; what is found is measured again.
        fm_nearest nearest = {.distance2 = fmaxf(job->bound * job->bound, FLT_MIN), .triangle = FM_NO_TRIANGLE};
        fm_bvh_nearest(job->mesh, position, &nearest);
        fm_closest found = {.distance = INFINITY, .triangle = FM_NO_TRIANGLE};
        if (nearest.triangle != FM_NO_TRIANGLE) {
            const fm_point_on_triangle point = fm_triangle_point(job->mesh, nearest.triangle, position);
            const float distance = (float)sqrt(point.distance2);
            if (distance < job->bound) {
                found = (fm_closest){{nearest.point[0], nearest.point[1], nearest.point[2]}, distance, nearest.triangle};
            }
        }
        job->closest[i] = found;
    }
}

fm_result fm_mesh_closest(fm_mesh *mesh, const float (*positions)[3], uint32_t count, float bound, fm_closest *closest) {
    FM_TRY(check(mesh, positions, "positions", count, closest, "closest"));
    if (!(bound >= 0)) {
        return fm_fail(FM_ERROR_INVALID_ARGUMENT, "bound is %g: a distance, or 0 for no bound", (double)bound);
    }
    if (mesh->gpu) {
        return fm_gpu_mesh_closest(mesh, positions, count, bound, closest);
    }
    bound = bound == 0 ? INFINITY : bound;
    FM_TRY(fm_bvh_prepare(mesh));
    query_job job = {.mesh = mesh, .positions = positions, .bound = bound, .closest = closest};
    fm_pool_run(mesh->context->pool, count, GRAIN, find_closest, &job);
    return FM_OK;
}

static void find_hits(void *user, uint64_t begin, uint64_t end, uint32_t worker) {
    (void)worker;
    const query_job *job = user;
    for (uint64_t i = begin; i < end; i++) {
        job->hits[i] = fm_bvh_cast(job->mesh, &job->rays[i], job->any);
    }
}

fm_result fm_mesh_cast(fm_mesh *mesh, const fm_mesh_ray *rays, uint32_t count, bool any, fm_mesh_hit *hits) {
    FM_TRY(check(mesh, rays, "rays", count, hits, "hits"));
    if (mesh->gpu) {
        return fm_gpu_mesh_cast(mesh, rays, count, any, hits);
    }
    FM_TRY(fm_bvh_prepare(mesh));
    query_job job = {.mesh = mesh, .rays = rays, .any = any, .hits = hits};
    fm_pool_run(mesh->context->pool, count, GRAIN, find_hits, &job);
    return FM_OK;
}

static void find_winding(void *user, uint64_t begin, uint64_t end, uint32_t worker) {
    (void)worker;
    const query_job *job = user;
    for (uint64_t i = begin; i < end; i++) {
        job->winding[i] = fm_winding_at(job->mesh, job->positions[i], job->accuracy);
    }
}

fm_result fm_mesh_winding(fm_mesh *mesh, const float (*positions)[3], uint32_t count, float accuracy, float *winding) {
    FM_TRY(check(mesh, positions, "positions", count, winding, "winding"));
    if (!(accuracy >= 0)) {
        return fm_fail(FM_ERROR_INVALID_ARGUMENT, "accuracy is %g: a number of radii, or 0 for 2", (double)accuracy);
    }
    if (mesh->gpu) {
        return fm_gpu_mesh_winding(mesh, positions, count, accuracy, winding);
    }
    accuracy = accuracy == 0 ? 2 : accuracy;
    FM_TRY(fm_winding_prepare(mesh));
    query_job job = {.mesh = mesh, .positions = positions, .accuracy = accuracy, .winding = winding};
    fm_pool_run(mesh->context->pool, count, GRAIN, find_winding, &job);
    return FM_OK;
}
