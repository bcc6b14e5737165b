// SPDX-License-Identifier: MIT
// Runs the kernels of the best instruction set: which of them a plan can have, their scratch memory and the order of the passes.

#include "transform/kernels.h"
#include "transform/separable.h"

#include <string.h>

enum {
    STEPS_SLACK = 128,     // entries of the step tables beyond the longest axis: a block and a vector
    L2_CACHE = 512 << 10,  // bytes of a worker's tile of columns
    NARROWEST = 16,        // rows below it are mostly padding
};

const fm_kernels *fm_kernels_best(void) {
#ifdef FM_X86_KERNELS
    switch (fm_simd_best()) {
    case FM_SIMD_AVX512:
        return &fm_kernels_avx512;
    case FM_SIMD_AVX2:
        return &fm_kernels_avx2;
    default:
        break;
    }
#endif
    return &fm_kernels_portable;
}

static uint32_t limit_of(const fm_plan *plan) {
    return plan->cap_raw < plan->greatest ? plan->cap_raw : plan->greatest;
}

// Bytes of an element that hold an L1 field: a value that saturates there must be beyond the limit or saturate in the result too.
static uint32_t l1_bytes(const fm_plan *plan) {
    const size_t size = fm_type_size(plan->distance_type);
    if (limit_of(plan) < UINT8_MAX || size == 1) {
        return 1;
    }
    return limit_of(plan) < UINT16_MAX || size == 2 ? 2 : 0;
}

bool fm_kernels_fit(const fm_plan *plan) {
    if (plan->want_index || plan->weighted) {
        return false;
    }
    if (plan->metric == FM_METRIC_L1) {
        return l1_bytes(plan) != 0;
    }
    return plan->shape.z < UINT16_MAX && plan->greatest < FM_WIDE_NONE && plan->shape.x >= NARROWEST;
}

// The L1 field between the passes lies in the caller's array where it fits there.
static bool l1_in_place(const fm_plan *plan) {
    return !plan->is_signed && fm_type_size(plan->distance_type) == l1_bytes(plan);
}

static uint32_t power_of_two_at_most(uint64_t n) {
    return n ? 1u << (63 - __builtin_clzll(n)) : 1;
}

// Columns whose tile fits in the cache, within `least` and `most`.
static uint32_t tile_columns(const fm_plan *plan, uint32_t bytes, uint32_t least, uint32_t most) {
    uint64_t columns = power_of_two_at_most(L2_CACHE / ((uint64_t)plan->shape.z * bytes));
    return (uint32_t)(columns < least ? least : columns > most ? most : columns);
}

static uint32_t l1_depth_run(const fm_plan *plan) {
    return tile_columns(plan, l1_bytes(plan), 64, 4096);
}

static uint32_t z_depth_words(const fm_plan *plan) {
    return tile_columns(plan, 2, 32, 2048) / 32;
}

static uint64_t padded_width(const fm_plan *plan) {
    return fm_round_up(plan->shape.x, 64);
}

static uint64_t l1_worker_bytes(const fm_plan *plan) {
    const uint64_t lane = l1_bytes(plan);
    const uint64_t words = fm_round_up(fm_bits_row_words(plan->shape) + 2, 16) * 4;
    const uint64_t plane = words + (2 * FM_KERNEL_PAD + padded_width(plan) * (3 + plan->shape.y)) * lane;
    const uint64_t depth = (uint64_t)l1_depth_run(plan) * ((1 + plan->shape.z) * lane + sizeof(uint32_t));
    return fm_round_up(fm_max_u64(plane, depth), FM_ALIGNMENT);
}

static uint64_t l1_middle_bytes(const fm_plan *plan) {
    return l1_in_place(plan) ? 0 : fm_round_up(fm_voxels(plan->shape) * l1_bytes(plan), FM_ALIGNMENT);
}

static uint64_t window_middle_bytes(const fm_plan *plan) {
    return (uint64_t)fm_bits_row_words(plan->shape) * 32 * plan->shape.y * plan->shape.z * 2;
}

static uint64_t window_worker_bytes(const fm_plan *plan) {
    const uint64_t width = (uint64_t)fm_bits_row_words(plan->shape) * 32;
    const uint64_t vector_bytes = 64;  // of the widest set
    const uint64_t columns = 4 * (plan->shape.y + 2ull * FM_WINDOW_BLOCK) * vector_bytes;
    const uint64_t rows = 4 * (width + 2ull * FM_KERNEL_PAD) * 4;
    const uint64_t slice = ((width + FM_KERNEL_PAD) * plan->shape.y + width) * 4;
    const uint64_t run = (uint64_t)z_depth_words(plan) * 32;
    const uint64_t depth = run * (1 + plan->shape.z) * 2 + run / 8;
    return fm_round_up(fm_max_u64(columns + rows + slice, depth), FM_ALIGNMENT);
}

static uint64_t steps_count(const fm_plan *plan) {
    return fm_round_up(fm_max_u64(plan->shape.x, fm_max_u64(plan->shape.y, plan->shape.z)) + STEPS_SLACK, 16);
}

uint64_t fm_kernels_scratch_bytes(const fm_context *context, const fm_plan *plan) {
    const uint64_t threads = fm_pool_threads(context->pool);
    if (plan->metric == FM_METRIC_L1) {
        return l1_middle_bytes(plan) + threads * l1_worker_bytes(plan);
    }
    const uint64_t small = 3 * steps_count(plan) + threads * FM_WIDTHS_STRIDE;
    return small * sizeof(uint32_t) + window_middle_bytes(plan) + threads * window_worker_bytes(plan);
}

static void fill_steps(const fm_plan *plan, const fm_kernel_job *job) {
    const uint64_t count = steps_count(plan);
    for (uint64_t k = 0; k < count; k++) {
        const uint64_t cost = plan->metric == FM_METRIC_L2 ? k * k : k;
        job->steps_u15[k] = (uint32_t)fm_min_u64(cost, INT16_MAX) * 0x10001u;
        job->steps_u16[k] = (uint32_t)fm_min_u64(cost, UINT16_MAX) * 0x10001u;
        job->steps_u32[k] = (uint32_t)fm_min_u64(cost, FM_WIDE_NONE);
    }
}

static void run_l1(fm_context *context, const fm_kernels *kernels, fm_kernel_job *job) {
    const fm_plan *plan = job->plan;
    const bool narrow = l1_bytes(plan) == 1;
    const uint64_t plane = (uint64_t)plan->shape.x * plan->shape.y;
    const uint64_t written = fm_voxels(plan->shape) * l1_bytes(plan);
    fm_pool_run(context->pool, plan->shape.z, 1, narrow ? kernels->l1_plane_u8 : kernels->l1_plane_u16, job);
    fm_passes_end(context, job->invert ? "x+y inside" : "x+y", fm_voxels(plan->shape) / 8 + written);
    fm_pool_run(context->pool, fm_div_up(plane, job->depth_run), 1, narrow ? kernels->l1_depth_u8 : kernels->l1_depth_u16, job);
    fm_passes_end(context, job->invert ? "z inside" : "z", written + fm_voxels(plan->shape) * fm_type_size(plan->distance_type));
}

static void run_squares(fm_context *context, const fm_kernels *kernels, fm_kernel_job *job) {
    const fm_plan *plan = job->plan;
    const uint64_t plane_words = (uint64_t)fm_bits_row_words(plan->shape) * plan->shape.y;
    const uint64_t written = window_middle_bytes(plan);
    fm_pool_run(context->pool, fm_div_up(plane_words, job->depth_words), 1, kernels->z_distances, job);
    fm_passes_end(context, job->invert ? "z inside" : "z", fm_voxels(plan->shape) / 8 + written);
    fm_pool_run(context->pool, plan->shape.z, 1, plan->metric == FM_METRIC_L2 ? kernels->l2_plane : kernels->linf_plane, job);
    fm_passes_end(context, job->invert ? "y+x inside" : "y+x",
                  written + fm_voxels(plan->shape) * fm_type_size(plan->distance_type));
}

void fm_kernels_transform(fm_context *context, const fm_plan *plan, const fm_sites *sites, void *memory, void *distance) {
    const fm_kernels *kernels = fm_kernels_best();
    const bool l1 = plan->metric == FM_METRIC_L1;
    fm_kernel_job job = {
        .plan = plan, .words = sites->words, .border = plan->border, .limit = limit_of(plan), .distance = distance};
    uint8_t *next = memory;
    if (l1) {
        job.middle = l1_in_place(plan) ? distance : next;
        next += l1_middle_bytes(plan);
        job.depth_run = l1_depth_run(plan);
        job.worker_bytes = l1_worker_bytes(plan);
    } else {
        job.middle = next;
        next += window_middle_bytes(plan);
        job.steps_u15 = (uint32_t *)(void *)next;
        job.steps_u16 = job.steps_u15 + steps_count(plan);
        job.steps_u32 = job.steps_u16 + steps_count(plan);
        job.widths = job.steps_u32 + steps_count(plan);
        fill_steps(plan, &job);
        const uint64_t widths = (uint64_t)fm_pool_threads(context->pool) * FM_WIDTHS_STRIDE;
        memset(job.widths, 0, widths * sizeof(uint32_t));
        next = (uint8_t *)(job.widths + widths);
        job.depth_words = z_depth_words(plan);
        job.worker_bytes = window_worker_bytes(plan);
    }
    job.workers = next;
    (l1 ? run_l1 : run_squares)(context, kernels, &job);
    if (plan->is_signed) {
        job.invert = true;
        job.border = !plan->border;
        (l1 ? run_l1 : run_squares)(context, kernels, &job);
    }
}
