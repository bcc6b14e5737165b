// SPDX-License-Identifier: MIT
// Separable transforms on the CPU: one exact pass an axis.

#include "transform/separable.h"
#include "transform/finish.h"

#include <string.h>

enum {
    LANES = 16,
    NEAR = 16,  // rows
    FANOUT_BITS = 3,
    FANOUT = 1 << FANOUT_BITS,
    MAX_LEVELS = 32 / FANOUT_BITS + 2,
};

typedef struct pass_job {
    const fm_plan *plan;
    const fm_sites *sites;
    bool invert;  // the inner side of a signed field: empty voxels are the sites
    bool border;
    void *raw;         // raw distances within each plane
    uint64_t *source;  // element index within the plane of the site; NULL where nobody asks for it
    uint8_t *workers;  // scratch of each worker
    uint64_t worker_bytes;
    void *distance;
    void *index;
} pass_job;

// A worker's buffers: one row of the grid, and columns of LANES lanes.
typedef struct pass_scratch {
    uint32_t *row;
    void *field;
    void *minima;  // the levels of the pyramid above `field`
    void *best;
    uint32_t *from;
    uint64_t *moved;
} pass_scratch;

static uint64_t column_rows(const fm_plan *plan) {
    return fm_max_u64(plan->shape.y, plan->shape.z);
}

static uint64_t row_bytes(const fm_plan *plan) {
    return fm_round_up((uint64_t)plan->shape.x * 4, FM_ALIGNMENT);
}

static uint64_t minima_rows(const fm_plan *plan) {
    return column_rows(plan) / (FANOUT - 1) + MAX_LEVELS;
}

// Linf finds its indices without.
static bool keeps_sources(const fm_plan *plan) {
    return plan->want_index && plan->metric != FM_METRIC_LINF;
}

static uint64_t worker_bytes(const fm_plan *plan) {
    const uint64_t sources = keeps_sources(plan) ? column_rows(plan) * 8 : 0;
    return row_bytes(plan) + LANES * (column_rows(plan) * (4 + 4 + 4) + minima_rows(plan) * 4 + sources);
}

static pass_scratch worker_scratch(const pass_job *job, uint32_t worker) {
    const uint64_t column_bytes = column_rows(job->plan) * LANES * 4;
    uint8_t *memory = job->workers + worker * job->worker_bytes;
    pass_scratch scratch;
    scratch.row = (uint32_t *)(void *)memory;
    memory += row_bytes(job->plan);
    scratch.field = memory;
    memory += column_bytes;
    scratch.best = memory;
    memory += column_bytes;
    scratch.from = (uint32_t *)(void *)memory;
    memory += column_bytes;
    scratch.minima = memory;
    memory += minima_rows(job->plan) * LANES * 4;
    scratch.moved = (uint64_t *)(void *)memory;
    return scratch;
}

static uint64_t source_bytes(const fm_plan *plan) {
    return keeps_sources(plan) ? fm_voxels(plan->shape) * 8 : 0;
}

#define RAW uint32_t
#define RAW_NONE FM_RAW_NONE
#define NAME(name) exact_##name
#define STEP(plan, metric, axis, steps) ((void)(plan), (void)(axis), fm_raw_step(metric, steps))
#define WAY_OUT fm_way_out
#define CAP(plan) ((plan)->cap_raw)
#define FINISH fm_finish_exact
#define REACH(plan, axis, total) (total)
#include "transform/pyramid_template.h"
#undef RAW
#undef RAW_NONE
#undef NAME
#undef STEP
#undef WAY_OUT
#undef CAP
#undef FINISH
#undef REACH

#define RAW float
#define RAW_NONE INFINITY
#define NAME(name) weighted_##name
#define STEP(plan, metric, axis, steps) fm_weighted_step(metric, (plan)->weight[axis], steps)
#define WAY_OUT fm_way_out_weighted
#define CAP(plan) ((plan)->cap_raw_weighted)
#define FINISH fm_finish_weighted
#define REACH(plan, axis, total) fm_linf_reach((plan)->weight[axis], (axis) == 0 ? (plan)->shape.x : (plan)->shape.y, total)
#include "transform/pyramid_template.h"

static void run_planes(void *user, uint64_t begin, uint64_t end, uint32_t worker) {
    const pass_job *job = user;
    pass_scratch scratch = worker_scratch(job, worker);
    for (uint64_t z = begin; z < end; z++) {
        (job->plan->weighted ? weighted_plane : exact_plane)(job, z, &scratch);
    }
}

static void run_depths(void *user, uint64_t begin, uint64_t end, uint32_t worker) {
    const pass_job *job = user;
    pass_scratch scratch = worker_scratch(job, worker);
    for (uint64_t tile = begin; tile < end; tile++) {
        (job->plan->weighted ? weighted_depth : exact_depth)(job, tile, &scratch);
    }
}

static uint64_t fields_bytes(const fm_plan *plan) {
    return fm_round_up(fm_voxels(plan->shape) * 4 + source_bytes(plan), FM_ALIGNMENT);
}

static uint64_t pyramid_scratch_bytes(const fm_context *context, const fm_plan *plan) {
    return fields_bytes(plan) + fm_pool_threads(context->pool) * worker_bytes(plan);
}

static void run_side(fm_context *context, pass_job *job) {
    const fm_plan *plan = job->plan;
    const fm_shape shape = plan->shape;
    const uint64_t between = fm_voxels(shape) * 4 + (job->source ? source_bytes(plan) : 0);
    const uint64_t distances = job->distance ? fm_voxels(shape) * fm_type_size(plan->distance_type) : 0;
    const uint64_t indices = job->index ? fm_voxels(shape) * fm_type_size(plan->index_type) : 0;
    fm_pool_run(context->pool, shape.z, 1, run_planes, job);
    fm_passes_end(context, job->invert ? "x+y inside" : "x+y", fm_sites_bytes(shape) + between);
    uint64_t tiles = fm_div_up((uint64_t)shape.x * shape.y, LANES);
    fm_pool_run(context->pool, tiles, 16, run_depths, job);
    fm_passes_end(context, job->invert ? "z inside" : "z", between + distances + indices);
}

static void run_pyramid(fm_context *context, const fm_plan *plan, const fm_sites *sites, void *memory, void *distance,
                        void *index) {
    pass_job job = {.plan = plan, .sites = sites, .border = plan->border, .distance = distance, .index = index};
    job.source = keeps_sources(plan) ? memory : NULL;
    job.raw = (uint8_t *)memory + source_bytes(plan);
    job.workers = (uint8_t *)memory + fields_bytes(plan);
    job.worker_bytes = worker_bytes(plan);
    run_side(context, &job);
    if (plan->is_signed && distance) {
        job.invert = true;
        job.border = !plan->border;
        job.index = NULL;
        job.source = NULL;
        run_side(context, &job);
    }
}

fm_result fm_cpu_scratch_bytes(const fm_context *context, const fm_plan *plan, uint64_t *bytes) {
    // What is below 2^56 voxels cannot overflow in the sums that follow.
    if (fm_voxels(plan->shape) >> 56) {
        return fm_fail(FM_ERROR_RANGE, "shape is %u x %u x %u: the scratch memory is more than 63 bits count", plan->shape.x,
                       plan->shape.y, plan->shape.z);
    }
    *bytes = plan->brute_force      ? 0
             : fm_kernels_fit(plan) ? fm_kernels_scratch_bytes(context, plan)
                                    : pyramid_scratch_bytes(context, plan);
    return FM_OK;
}

void fm_cpu_transform(fm_context *context, const fm_plan *plan, const fm_sites *sites, void *memory, void *distance, void *index) {
    if (plan->brute_force) {
        fm_brute_transform(context, plan, sites, distance, index);
    } else if (fm_kernels_fit(plan)) {
        fm_kernels_transform(context, plan, sites, memory, distance);
    } else {
        run_pyramid(context, plan, sites, memory, distance, index);
    }
}
