// SPDX-License-Identifier: MIT
// Squared Euclidean distances in 32-bit lanes. Part of exact_template.h.

#define LANE uint32_t
#define NONE FM_WIDE_NONE
#define W(name) l2_##name
#define V(name) name##_u32
#include "transform/columns_template.h"

// The columns of a tile that lie in a vector, and what summarises them.
typedef struct l2_buffers {
    uint32_t *tile;
    uint32_t *field, *block, *before, *after;
} l2_buffers;

static l2_buffers l2_buffers_of(const fm_exact_job *job, uint32_t worker) {
    const uint64_t rows = fm_max_u64(job->shape.y, job->shape.z);
    const uint64_t column = (rows + 2 * FM_WINDOW_BLOCK) * l2_LANES;
    l2_buffers buffers;
    buffers.tile = worker_memory(job, worker);
    buffers.field = buffers.tile + rows * TILE + FM_WINDOW_BLOCK * l2_LANES;
    buffers.block = buffers.field + column;
    buffers.before = buffers.block + column;
    buffers.after = buffers.before + column;
    return buffers;
}

// The tile's columns, in place.
static void l2_search(const fm_exact_job *job, const l2_buffers *buffers, uint32_t count) {
    for (uint32_t x = 0; x < TILE; x += l2_LANES) {
        bool open = false;
        for (uint64_t n = 0; n < count; n++) {
            const vector here = load(buffers->tile + n * TILE + x);
            store(buffers->field + n * l2_LANES, here);
            open |= any_less_u32(set_u32(1), here);
        }
        if (open) {
            l2_summarise(count, buffers->field, buffers->block, buffers->before, buffers->after);
            l2_columns(job->steps, count, buffers->field, buffers->block, buffers->before, buffers->after, buffers->tile + x, TILE,
                       false);
        }
    }
}

// No distance need be kept that is above the limit: the sums that it enters are above it too.
static void l2_along_y(void *user, uint64_t begin, uint64_t end, uint32_t worker) {
    const fm_exact_job *job = user;
    const uint64_t depth = job->shape.z;
    const l2_buffers buffers = l2_buffers_of(job, worker);
    l1_u16_padded padded;
    uint16_t along_x[TILE];
    l1_u16_pad(&padded);
    for (uint64_t item = begin; item < end; item++) {
        const uint64_t tile = item_tile(job, item);
        const uint32_t t = (uint32_t)(tile % job->tiles);
        const uint64_t z = tile / job->tiles;
        for (uint64_t y = 0; y < job->shape.y; y++) {
            l1_u16_distances_x(sites_of(job, row_bits(job, y, z), t), &padded, along_x);
            for (uint32_t i = 0; i < TILE; i++) {
                const uint32_t steps = along_x[i];
                buffers.tile[y * TILE + i] = steps == UINT16_MAX ? job->limit : least_of(steps * steps, job->limit);
            }
        }
        l2_search(job, &buffers, job->shape.y);
        for (uint64_t y = 0; y < job->shape.y; y++) {
            uint32_t *middle = (uint32_t *)job->middle + ((t + job->tiles * y) * depth + z) * TILE;
            const uint32_t *row = buffers.tile + y * TILE;
            if (job->full || memcmp(middle, row, TILE * sizeof *row) != 0) {
                memcpy(middle, row, TILE * sizeof *row);
                set_flag(&job->dirty_z[t + job->tiles * y]);
            }
        }
    }
}

static void l2_along_z(void *user, uint64_t begin, uint64_t end, uint32_t worker) {
    const fm_exact_job *job = user;
    const uint64_t depth = job->shape.z;
    const l2_buffers buffers = l2_buffers_of(job, worker);
    for (uint64_t item = begin; item < end; item++) {
        const uint64_t tile = item_tile(job, item);
        const uint32_t t = (uint32_t)(tile % job->tiles);
        const uint64_t y = tile / job->tiles;
        memcpy(buffers.tile, (const uint32_t *)job->middle + tile * depth * TILE, depth * TILE * sizeof(uint32_t));
        l2_search(job, &buffers, job->shape.z);
        for (uint64_t z = 0; z < depth; z++) {
            uint32_t *row = buffers.tile + z * TILE;
            uint32_t *to = (uint32_t *)job->field + (uint64_t)t * TILE + job->shape.x * (y + job->shape.y * z);
            const size_t bytes = tile_width(job, t) * sizeof *row;
            for (uint32_t i = 0; i < TILE; i++) {
                row[i] = row[i] < job->limit ? row[i] : job->beyond;
            }
            if (job->full || memcmp(to, row, bytes) != 0) {
                memcpy(to, row, bytes);
            }
        }
    }
}
#undef LANE
#undef NONE
#undef W
#undef V
