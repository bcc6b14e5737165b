// SPDX-License-Identifier: MIT
// The oracle: every site against every voxel, in the order of the element index. Quadratic time.

#include "transform/finish.h"

typedef struct brute_job {
    const fm_plan *plan;
    const fm_sites *sites;
    void *distance;
    void *index;
} brute_job;

// The nearest site so far. Of equal totals the first in element order stays, with one proviso: sums of floats are compared axis by
// axis as separable passes round them, so that within one slice (one row) the smaller partial sum wins over the lower index.
// Maxima round nothing.
typedef struct nearest_site {
    uint32_t raw;
    float total, plane, row;  // weighted: sums over x, y, z; over x, y; over x
    uint32_t y, z;
    uint64_t index;
} nearest_site;

static const nearest_site nowhere = {FM_RAW_NONE, INFINITY, INFINITY, INFINITY, 0, 0, UINT64_MAX};

static uint32_t apart(uint32_t a, uint32_t b) {
    return a < b ? b - a : a - b;
}

static uint32_t combine(fm_metric metric, uint32_t a, uint32_t b) {
    return metric == FM_METRIC_LINF ? (a < b ? b : a) : a + b;
}

static float combine_weighted(fm_metric metric, float a, float b) {
    return metric == FM_METRIC_LINF ? fmaxf(a, b) : a + b;
}

static void try_exact(const fm_plan *plan, nearest_site *best, const uint32_t steps[3], uint64_t index) {
    uint32_t raw = 0;
    for (int i = 0; i < 3; i++) {
        raw = combine(plan->metric, raw, fm_raw_step(plan->metric, steps[i]));
    }
    if (raw < best->raw) {
        best->raw = raw;
        best->index = index;
    }
}

static void try_weighted(const fm_plan *plan, nearest_site *best, const uint32_t steps[3], uint32_t y, uint32_t z, uint64_t index) {
    float row = fm_weighted_step(plan->metric, plan->weight[0], steps[0]);
    float plane = combine_weighted(plan->metric, row, fm_weighted_step(plan->metric, plan->weight[1], steps[1]));
    float total = combine_weighted(plan->metric, plane, fm_weighted_step(plan->metric, plan->weight[2], steps[2]));
    bool same_slice = plan->metric != FM_METRIC_LINF && total == best->total && z == best->z;
    bool same_row = same_slice && plane == best->plane && y == best->y;
    if (total < best->total || (same_slice && plane < best->plane) || (same_row && row < best->row)) {
        *best = (nearest_site){0, total, plane, row, y, z, index};
    }
}

// `invert`: the empty voxels are the sites.
static nearest_site search(const brute_job *job, bool invert, uint32_t x, uint32_t y, uint32_t z) {
    const fm_shape shape = job->plan->shape;
    nearest_site best = nowhere;
    for (uint32_t site_z = 0; site_z < shape.z; site_z++) {
        for (uint32_t site_y = 0; site_y < shape.y; site_y++) {
            uint64_t row = (uint64_t)site_z * shape.y + site_y;
            for (uint32_t site_x = 0; site_x < shape.x; site_x++) {
                if (fm_site(job->sites, row, site_x) == invert) {
                    continue;
                }
                const uint32_t steps[3] = {apart(x, site_x), apart(y, site_y), apart(z, site_z)};
                uint64_t index = row * shape.x + site_x;
                if (job->plan->weighted) {
                    try_weighted(job->plan, &best, steps, site_y, site_z, index);
                } else {
                    try_exact(job->plan, &best, steps, index);
                }
            }
        }
    }
    return best;
}

// Applies the border and finishes; drops the index where the site is not the answer.
static double finish(const fm_plan *plan, bool border, nearest_site *best, uint32_t x, uint32_t y, uint32_t z) {
    if (plan->weighted) {
        float way = border ? fm_way_out_weighted(plan, x, y, z) : INFINITY;
        bool dropped = way < best->total || best->total > plan->cap_raw_weighted;
        best->index = dropped ? UINT64_MAX : best->index;
        return fm_finish_weighted(plan, fminf(way, best->total));
    }
    uint32_t way = border ? fm_way_out(plan, x, y, z) : FM_RAW_NONE;
    bool dropped = way < best->raw || best->raw > plan->cap_raw;
    best->index = dropped ? UINT64_MAX : best->index;
    return fm_finish_exact(plan, way < best->raw ? way : best->raw);
}

static void brute_rows(void *user, uint64_t begin, uint64_t end, uint32_t worker) {
    const brute_job *job = user;
    const fm_plan *plan = job->plan;
    (void)worker;
    for (uint64_t row = begin; row < end; row++) {
        uint32_t y = (uint32_t)(row % plan->shape.y);
        uint32_t z = (uint32_t)(row / plan->shape.y);
        for (uint32_t x = 0; x < plan->shape.x; x++) {
            uint64_t at = row * plan->shape.x + x;
            nearest_site best = search(job, false, x, y, z);
            double value = finish(plan, plan->border, &best, x, y, z);
            if (job->index) {
                fm_store_index(plan, job->index, at, best.index);
            }
            if (!job->distance) {
                continue;
            }
            if (plan->is_signed && fm_site(job->sites, row, x)) {
                nearest_site way_out = search(job, true, x, y, z);
                value = -finish(plan, !plan->border, &way_out, x, y, z);
            }
            fm_store_distance(plan, job->distance, at, value);
        }
    }
}

void fm_brute_transform(fm_context *context, const fm_plan *plan, const fm_sites *sites, void *distance, void *index) {
    brute_job job = {plan, sites, distance, index};
    fm_pool_run(context->pool, (uint64_t)plan->shape.y * plan->shape.z, 1, brute_rows, &job);
    const uint64_t distances = distance ? fm_voxels(plan->shape) * fm_type_size(plan->distance_type) : 0;
    const uint64_t indices = index ? fm_voxels(plan->shape) * fm_type_size(plan->index_type) : 0;
    fm_passes_end(context, "brute force", fm_sites_bytes(plan->shape) + distances + indices);
}
