// SPDX-License-Identifier: MIT
// L2 and Linf within a slice whose distances along z are known, once for each kind of lane (15, 16, 32 bits): define LANE (type),
// NONE, W(name) (this width's function), V(name) (this width's vector operation), STEPS(job).
//
// A voxel's answer is the least of field[k away] "plus" what k steps cost. Steps are taken in blocks of FM_WINDOW_BLOCK, outwards,
// each direction until neither the cheapest element further out nor the steps alone can win. A block whose cheapest element cannot
// win is skipped. All lanes of a vector go together, so every lane sees at least the steps that it needs.

#include "transform/columns_template.h"

// A row of a slice, FM_KERNEL_PAD elements of NONE around it.
static FM_INLINE void W(row)(const uint32_t *steps, uint32_t count, const LANE *field, LANE *block, LANE *out, bool linf) {
    const ptrdiff_t lanes = W(LANES);
    bool open = false;
    for (ptrdiff_t x = 0; x < (ptrdiff_t)count; x += lanes) {
        open |= V(any_less)(set_u32(steps[1]), load(field + x));
    }
    if (!open) {
        memcpy(out, field, count * sizeof(LANE));
        return;
    }
    // A search reaches back by less than a vector and a block.
    for (ptrdiff_t x = -lanes * (1 + (FM_WINDOW_BLOCK + lanes - 1) / lanes); x < (ptrdiff_t)count + lanes; x += lanes) {
        vector least = V(min)(load(field + x), load(field + x + 1));
        least = V(min)(least, V(min)(load(field + x + 2), load(field + x + 3)));
        least = V(min)(least, V(min)(load(field + x + 4), load(field + x + 5)));
        store(block + x, V(min)(least, V(min)(load(field + x + 6), load(field + x + 7))));
    }
    for (ptrdiff_t x = 0; x < (ptrdiff_t)count; x += lanes) {
        vector best = load(field + x);
        bool left = true;
        bool right = true;
        for (ptrdiff_t k = 1; left || right; k += FM_WINDOW_BLOCK) {
            const vector nearest = set_u32(steps[k]);
            if (!V(any_less)(nearest, best)) {
                break;
            }
            if (left) {
                if (V(any_less)(W(reach)(load(block + x - k - FM_WINDOW_BLOCK + 1), nearest, linf), best)) {
                    for (ptrdiff_t i = 0; i < FM_WINDOW_BLOCK; i++) {
                        best = V(min)(best, W(reach)(load(field + x - k - i), set_u32(steps[k + i]), linf));
                    }
                }
                left = x + lanes > k + FM_WINDOW_BLOCK;
            }
            if (right) {
                if (V(any_less)(W(reach)(load(block + x + k), nearest, linf), best)) {
                    for (ptrdiff_t i = 0; i < FM_WINDOW_BLOCK; i++) {
                        best = V(min)(best, W(reach)(load(field + x + k + i), set_u32(steps[k + i]), linf));
                    }
                }
                right = x + k + FM_WINDOW_BLOCK < (ptrdiff_t)count;
            }
        }
        store(out + x, best);
    }
}

// Buffers of one worker.
typedef struct W(buffers) {
    LANE *field, *block, *before, *after;  // a column of vectors
    LANE *slice;                           // rows with FM_KERNEL_PAD elements of NONE behind each, and before the first
    LANE *row_block, *row_out;
    LANE *way_x;
    uint32_t *staged;
} W(buffers);

static W(buffers) W(buffers_of)(const fm_kernel_job *job, uint32_t worker) {
    const fm_shape shape = job->plan->shape;
    const size_t width = (size_t)fm_bits_row_words(shape) * 32;
    const size_t column = ((size_t)shape.y + 2 * FM_WINDOW_BLOCK) * W(LANES);
    const size_t padded = width + 2 * FM_KERNEL_PAD;
    W(buffers) buffers;
    LANE *memory = (LANE *)(void *)(job->workers + worker * job->worker_bytes);
    buffers.field = memory + FM_WINDOW_BLOCK * W(LANES);
    buffers.block = buffers.field + column;
    buffers.before = buffers.block + column;
    buffers.after = buffers.before + column;
    memory += 4 * column;
    buffers.row_block = memory + FM_KERNEL_PAD;
    buffers.row_out = buffers.row_block + padded;
    buffers.way_x = buffers.row_out + padded;
    buffers.slice = buffers.way_x + padded;
    buffers.staged = (uint32_t *)(void *)(buffers.slice + (width + FM_KERNEL_PAD) * shape.y);
    return buffers;
}

// Applies the border to a finished row; returns whether a lane is NONE.
static FM_INLINE bool W(close_row)(const fm_kernel_job *job, const W(buffers) * buffers, uint64_t row, bool linf) {
    const fm_shape shape = job->plan->shape;
    const uint32_t steps =
        fm_steps_least(fm_steps_out((uint32_t)(row % shape.y), shape.y), fm_steps_out((uint32_t)(row / shape.y), shape.z));
    const uint64_t way = linf ? steps : (uint64_t)steps * steps;
    const LANE most = job->border && way < NONE ? (LANE)way : NONE;
    LANE worst = 0;
    for (uint32_t x = 0; x < shape.x; x++) {
        LANE raw = buffers->row_out[x];
        if (job->border) {
            raw = buffers->way_x[x] < raw ? buffers->way_x[x] : raw;
            raw = most < raw ? most : raw;
            buffers->row_out[x] = raw;
        }
        worst = raw > worst ? raw : worst;
    }
    return worst == NONE;
}

// One slice; false when the lanes did not hold it. 32 bits always do.
static FM_INLINE bool W(plane)(const fm_kernel_job *job, uint32_t z, uint32_t worker, bool linf) {
    const fm_shape shape = job->plan->shape;
    const size_t width = (size_t)fm_bits_row_words(shape) * 32;
    const size_t stride = width + FM_KERNEL_PAD;
    const uint32_t *steps = STEPS(job);
    const W(buffers) buffers = W(buffers_of)(job, worker);
    const uint16_t *along_z = (const uint16_t *)job->middle + z * width * shape.y;
    for (size_t y = 0; y < shape.y; y++) {
        LANE *row = buffers.slice + y * stride;
        const uint16_t *from = along_z + y * width;
        for (size_t x = 0; x < width; x++) {
            row[x] = W(first)(from[x], linf);
        }
        for (size_t x = shape.x; x < stride; x++) {
            row[x] = NONE;
        }
    }
    for (size_t i = 1; i <= FM_KERNEL_PAD; i++) {
        *(buffers.slice - i) = NONE;
    }
    for (size_t x = 0; x < width; x += W(LANES)) {
        bool open = false;
        for (size_t y = 0; y < shape.y; y++) {
            const vector here = load(buffers.slice + y * stride + x);
            store(buffers.field + y * W(LANES), here);
            open |= V(any_less)(set_u32(steps[1]), here);
        }
        if (open) {
            W(summarise)(shape.y, buffers.field, buffers.block, buffers.before, buffers.after);
            W(columns)
            (steps, shape.y, buffers.field, buffers.block, buffers.before, buffers.after, buffers.slice + x, stride, linf);
        }
    }
    for (uint32_t x = 0; job->border && x < shape.x; x++) {
        const uint64_t out = fm_steps_out(x, shape.x);
        const uint64_t way = linf ? out : out * out;
        buffers.way_x[x] = way < NONE ? (LANE)way : NONE;
    }
    for (uint32_t y = 0; y < shape.y; y++) {
        W(row)(steps, shape.x, buffers.slice + y * stride, buffers.row_block, buffers.row_out, linf);
        const uint64_t row = (uint64_t)z * shape.y + y;
        bool overflow = W(close_row)(job, &buffers, row, linf);
        if (overflow && NONE <= job->limit && sizeof(LANE) == 2) {
            return false;
        }
        W(finish)(job, row * shape.x, shape.x, buffers.row_out, buffers.staged);
    }
    return true;
}
