// SPDX-License-Identifier: MIT
// The exact method on the CPU: what it keeps, the lists of dirty tiles, and the choice of kernels. Rows flag the tiles of columns
// whose distances along x have changed; the pass along y flags those whose distances after it have changed; the pass along z writes
// the field. Nothing depends on whether voxels were placed or deleted.

#include "base/cpu.h"
#include "transform/kernels.h"
#include "world/exact_kernels.h"
#include "world/host_world.h"

#include <string.h>

struct fm_host_exact {
    fm_exact_job job;
    fm_exact_lanes lanes;
    uint64_t bytes;  // of all that follows it in memory

    uint32_t *list;
    uint32_t *range;
};

static const fm_exact_kernels *kernels_best(void) {
#ifdef FM_X86_KERNELS
    switch (fm_simd_best()) {
    case FM_SIMD_AVX512:
        return &fm_exact_kernels_avx512;
    case FM_SIMD_AVX2:
        return &fm_exact_kernels_avx2;
    default:
        break;
    }
#endif
    return &fm_exact_kernels_portable;
}

// The parts of one block of memory, in order.
typedef struct exact_layout {
    uint64_t middle, workers, list, range, steps, dirty_y, dirty_z, end;
} exact_layout;

static uint64_t longest_column(fm_shape shape) {
    return fm_max_u64(shape.y, shape.z);
}

static uint64_t worker_bytes(fm_shape shape) {
    const uint64_t vector_bytes = 64;  // of the widest set
    const uint64_t tile = longest_column(shape) * FM_EXACT_TILE * sizeof(uint32_t);
    return tile + 4 * (longest_column(shape) + 2 * FM_WINDOW_BLOCK) * vector_bytes;
}

// Steps are looked up a block beyond the farthest row.
static uint64_t steps_count(fm_shape shape) {
    return longest_column(shape) + 2 * FM_WINDOW_BLOCK;
}

static uint64_t place(uint64_t *end, uint64_t bytes) {
    const uint64_t at = *end;
    *end += fm_round_up(bytes, FM_ALIGNMENT);
    return at;
}

static exact_layout lay_out(const fm_world *world) {
    const fm_shape shape = world->desc.shape;
    const uint64_t tiles = fm_div_up(shape.x, FM_EXACT_TILE);
    exact_layout layout = {0};
    layout.middle = place(&layout.end, tiles * FM_EXACT_TILE * shape.y * shape.z * fm_lane_width(world->desc.format));
    layout.workers = place(&layout.end, fm_pool_threads(world->context->pool) * worker_bytes(shape));
    layout.list = place(&layout.end, tiles * longest_column(shape) * sizeof(uint32_t));
    layout.range = place(&layout.end, 2 * tiles * sizeof(uint32_t));
    layout.steps = place(&layout.end, steps_count(shape) * sizeof(uint32_t));
    layout.dirty_y = place(&layout.end, tiles * shape.z);
    layout.dirty_z = place(&layout.end, tiles * shape.y);
    return layout;
}

uint64_t fm_host_exact_bytes(const fm_world *world) {
    return lay_out(world).end;
}

static void fill_steps(fm_shape shape, uint32_t *steps) {
    for (uint64_t k = 0; k < steps_count(shape); k++) {
        steps[k] = (uint32_t)fm_min_u64(k * k, FM_WIDE_NONE);
    }
}

// Sites farther away along x than a distance is kept do not matter.
static uint32_t reach_words(const fm_world *world) {
    const uint32_t all = fm_bits_row_words(world->desc.shape);
    const uint32_t steps = world->desc.format == FM_FIELD_SQUARED_U32 ? world->desc.max_distance : fm_world_cap(&world->desc);
    return steps == 0 ? all : (uint32_t)fm_min_u64(all, steps / 32 + 1);
}

fm_result fm_host_exact_create(fm_world *world, fm_host_world *host) {
    fm_context *context = world->context;
    const fm_shape shape = world->desc.shape;
    const exact_layout layout = lay_out(world);
    struct fm_host_exact *exact = fm_alloc_zero(&context->allocator, sizeof *exact, "a world's update");
    uint8_t *memory = exact ? fm_alloc(&context->allocator, layout.end, "what a world's updates keep") : NULL;
    if (!memory) {
        fm_free(&context->allocator, exact, sizeof *exact);
        return FM_ERROR_OUT_OF_HOST_MEMORY;
    }
    fm_meter_add(&context->host[FM_PURPOSE_UPDATE], layout.end);
    exact->bytes = layout.end;
    exact->list = (uint32_t *)(void *)(memory + layout.list);
    exact->range = (uint32_t *)(void *)(memory + layout.range);
    uint32_t *steps = (uint32_t *)(void *)(memory + layout.steps);
    fill_steps(shape, steps);
    const uint32_t cap = fm_world_cap(&world->desc);
    exact->job = (fm_exact_job){.shape = shape,
                                .format = world->desc.format,
                                .voxels = host->voxels,
                                .bits = host->bits,
                                .field = host->field,
                                .middle = memory + layout.middle,
                                .row_words = fm_bits_row_words(shape),
                                .tiles = (uint32_t)fm_div_up(shape.x, FM_EXACT_TILE),
                                .reach_words = reach_words(world),
                                .dirty_y = memory + layout.dirty_y,
                                .dirty_z = memory + layout.dirty_z,
                                .range = exact->range,
                                .limit = cap < FM_WIDE_NONE ? cap : FM_WIDE_NONE,
                                .beyond = cap,
                                .steps = steps,
                                .workers = memory + layout.workers,
                                .worker_bytes = worker_bytes(shape)};
    memset(exact->job.dirty_y, 0, (uint64_t)exact->job.tiles * shape.z);
    memset(exact->job.dirty_z, 0, (uint64_t)exact->job.tiles * shape.y);
    const fm_exact_kernels *kernels = kernels_best();
    exact->lanes = world->desc.format == FM_FIELD_SQUARED_U32 ? kernels->l2
                   : fm_lane_width(world->desc.format) == 1   ? kernels->l1_u8
                                                              : kernels->l1_u16;
    host->exact = exact;
    return FM_OK;
}

void fm_host_exact_destroy(fm_world *world, struct fm_host_exact *exact) {
    if (!exact) {
        return;
    }
    fm_meter_remove(&world->context->host[FM_PURPOSE_UPDATE], exact->bytes);
    fm_free(&world->context->allocator, exact->job.middle, exact->bytes);
    fm_free(&world->context->allocator, exact, sizeof *exact);
}

void fm_host_encode(const uint32_t *voxels, uint64_t words, uint32_t *bits) {
    kernels_best()->encode(voxels, words, bits);
}

void fm_host_exact_changed(fm_world *world, const uint32_t *before, uint32_t y, uint32_t z) {
    world->host->exact->lanes.changed(&world->host->exact->job, before, y, z);
}

// Lists the flagged tiles of `rows` rows of tiles and clears their flags. `range` (NULL: not wanted) gets the first and last row of
// each t.
static uint64_t list_dirty(struct fm_host_exact *exact, uint8_t *flags, uint32_t rows, uint32_t *range) {
    const uint32_t tiles = exact->job.tiles;
    uint64_t count = 0;
    for (uint32_t row = 0; row < rows; row++) {
        for (uint32_t t = 0; t < tiles; t++) {
            const uint32_t tile = row * tiles + t;
            if (!flags[tile]) {
                continue;
            }
            flags[tile] = 0;
            exact->list[count++] = tile;
            if (range) {
                range[2 * t] = row < range[2 * t] ? row : range[2 * t];
                range[2 * t + 1] = row;
            }
        }
    }
    return count;
}

void fm_host_exact_update(fm_world *world, bool full) {
    struct fm_host_exact *exact = world->host->exact;
    fm_exact_job *job = &exact->job;
    fm_pool *pool = world->context->pool;
    const uint64_t tile_bytes = FM_EXACT_TILE * fm_lane_width(job->format);
    for (uint32_t t = 0; t < job->tiles; t++) {
        exact->range[2 * t] = UINT32_MAX;
        exact->range[2 * t + 1] = 0;
    }
    const uint64_t dirty_y = list_dirty(exact, job->dirty_y, job->shape.z, exact->range);
    job->full = full;
    job->list = full ? NULL : exact->list;
    world->stats.tile_width = FM_EXACT_TILE;
    world->stats.tiles_y = full ? (uint64_t)job->tiles * job->shape.z : dirty_y;
    fm_pool_run(pool, world->stats.tiles_y, 1, exact->lanes.along_y, job);
    fm_passes_end(world->context, "y", world->stats.tiles_y * job->shape.y * (tile_bytes + FM_EXACT_TILE / 8));
    const uint64_t dirty_z = list_dirty(exact, job->dirty_z, job->shape.y, NULL);
    world->stats.tiles_z = full ? (uint64_t)job->tiles * job->shape.y : dirty_z;
    fm_pool_run(pool, world->stats.tiles_z, 1, exact->lanes.along_z, job);
    const uint64_t entries = FM_EXACT_TILE * (uint64_t)fm_field_width(job->format);
    fm_passes_end(world->context, "z", world->stats.tiles_z * job->shape.z * (tile_bytes + entries));
}
