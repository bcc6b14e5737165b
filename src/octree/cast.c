// SPDX-License-Identifier: MIT
// Rays through octrees.

#include "octree/octree.h"
#include "shaders/include/octree_cast_rule.h"

enum { GRAIN = 64 };  // rays that a thread takes at once

static const float DEFAULT_EPSILON = 0.1f;

typedef struct cast_job {
    fm_octree_head head;
    const fm_mesh_ray *rays;
    float epsilon;
    fm_octree_hit *hits;
} cast_job;

static fm_v3 vector(const float v[3]) {
    return (fm_v3){v[0], v[1], v[2]};
}

static void find_hits(void *user, uint64_t begin, uint64_t end, uint32_t worker) {
    (void)worker;
    const cast_job *job = user;
    for (uint64_t i = begin; i < end; i++) {
        const fm_mesh_ray *ray = &job->rays[i];
        const fm_octree_met met =
            fm_cast_ray(job->head, vector(ray->origin), vector(ray->direction), ray->first, ray->last, job->epsilon);
        job->hits[i] = (fm_octree_hit){met.t, {met.normal[0], met.normal[1], met.normal[2]}, met.mark, met.reads};
    }
}

fm_result fm_octree_cast(fm_octree *octree, const fm_mesh_ray *rays, uint32_t count, float epsilon, fm_octree_hit *hits) {
    const char *missing = !octree ? "octree" : count == 0 ? NULL : !rays ? "rays" : !hits ? "hits" : NULL;
    if (missing) {
        return fm_fail(FM_ERROR_INVALID_ARGUMENT, "%s is NULL", missing);
    }
    if (!isfinite(epsilon)) {
        return fm_fail(FM_ERROR_INVALID_ARGUMENT, "epsilon is %g: a finite number of cells, or 0 for %g", (double)epsilon,
                       (double)DEFAULT_EPSILON);
    }
    const float thin = octree->head.cell * (epsilon == 0 ? DEFAULT_EPSILON : fabsf(epsilon));
    if (octree->context->gpu) {
        return fm_gpu_octree_cast(octree, rays, count, thin, epsilon < 0, hits);
    }
    cast_job job = {.head = fm_octree_host_head(octree), .rays = rays, .epsilon = thin, .hits = hits};
    job.head.stepped = epsilon < 0;
    fm_pool_run(octree->context->pool, count, GRAIN, find_hits, &job);
    return FM_OK;
}
