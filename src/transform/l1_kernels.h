// SPDX-License-Identifier: MIT
// L1, once for 8-bit and once for 16-bit lanes: define LANE (type), NONE, W(name), V(name), CLEAR_WHERE(words, first). Sums
// saturate at NONE. A border costs nothing: it is a site just outside each end of a row or column.

enum { W(LANES) = VECTOR_BYTES / sizeof(LANE) };

// Distances along a buffered row that is 0 at sites and NONE elsewhere, also in the FM_KERNEL_PAD elements around it. After the
// round of s every element knows the sites up to 2 s - 1 away.
static inline void W(row)(LANE *row, ptrdiff_t count) {
    const ptrdiff_t lanes = W(LANES);
    const vector none = V(set)(NONE);
    for (ptrdiff_t s = 1; s < count && s < NONE; s *= 2) {
        const vector step = V(set)((LANE)s);
        for (ptrdiff_t x = 0; x < count; x += lanes) {
            const vector left = x + lanes > s ? load(row + x - s) : none;
            const vector right = x + s < count + lanes ? load(row + x + s) : none;
            store(row + x, V(min)(load(row + x), V(add)(V(min)(left, right), step)));
        }
    }
}

// dst[i] = min(dst[i], neighbour[i] + 1)
static inline void W(sweep)(LANE *dst, const LANE *neighbour, ptrdiff_t count) {
    const vector one = V(set)(1);
    for (ptrdiff_t x = 0; x < count; x += W(LANES)) {
        store(dst + x, V(min)(load(dst + x), V(add)(load(neighbour + x), one)));
    }
}

static void W(plane)(void *user, uint64_t begin, uint64_t end, uint32_t worker) {
    const fm_kernel_job *job = user;
    const fm_shape shape = job->plan->shape;
    const ptrdiff_t lanes = W(LANES);
    const size_t row_words = fm_bits_row_words(shape);
    const size_t width = fm_round_up(shape.x, 64);
    const vector outside = V(set)(job->border ? 0 : NONE);
    uint32_t *words = (uint32_t *)(void *)(job->workers + worker * job->worker_bytes);
    LANE *row = (LANE *)(void *)(words + fm_round_up(row_words + 2, 16)) + FM_KERNEL_PAD;
    LANE *edge = row + width + FM_KERNEL_PAD;
    LANE *slice = edge + width;
    for (size_t x = 0; x < width; x += (size_t)lanes) {
        store(edge + x, outside);
    }
    for (uint64_t z = begin; z < end; z++) {
        for (uint64_t y = 0; y < shape.y; y++) {
            fm_fetch_words(job, z * shape.y + y, row_words, words);
            for (ptrdiff_t x = -FM_KERNEL_PAD; x < 0; x += lanes) {
                store(row + x, outside);
            }
            for (size_t x = 0; x < width; x += (size_t)lanes) {
                store(row + x, CLEAR_WHERE(words, (uint32_t)x));
            }
            for (size_t x = shape.x; x < width + FM_KERNEL_PAD; x++) {
                row[x] = job->border ? 0 : NONE;
            }
            W(row)(row, shape.x);
            LANE *to = slice + y * width;
            memcpy(to, row, width * sizeof(LANE));
            W(sweep)(to, y == 0 ? edge : to - width, (ptrdiff_t)width);
        }
        for (uint64_t y = shape.y; y-- > 0;) {
            LANE *to = slice + y * width;
            W(sweep)(to, y + 1 == shape.y ? edge : to + width, (ptrdiff_t)width);
            fm_copy_out((LANE *)job->middle + (z * shape.y + y) * shape.x, to, shape.x * sizeof(LANE));
        }
    }
    stream_fence();
}

static void W(depth)(void *user, uint64_t begin, uint64_t end, uint32_t worker) {
    const fm_kernel_job *job = user;
    const fm_shape shape = job->plan->shape;
    const uint64_t plane = (uint64_t)shape.x * shape.y;
    const size_t run = job->depth_run;
    const vector outside = V(set)(job->border ? 0 : NONE);
    LANE *edge = (LANE *)(void *)(job->workers + worker * job->worker_bytes);
    LANE *tile = edge + run;
    for (size_t i = 0; i < run; i += W(LANES)) {
        store(edge + i, outside);
    }
    for (uint64_t item = begin; item < end; item++) {
        const uint64_t start = item * run;
        const size_t count = (size_t)fm_min_u64(run, plane - start);
        const LANE *from = (const LANE *)job->middle + start;
        for (size_t z = 0; z < shape.z; z++) {
            LANE *to = tile + z * run;
            memcpy(to, from + z * plane, count * sizeof(LANE));
            W(sweep)(to, z == 0 ? edge : to - run, (ptrdiff_t)count);
        }
        for (size_t z = shape.z; z-- > 0;) {
            LANE *to = tile + z * run;
            W(sweep)(to, z + 1 == shape.z ? edge : to + run, (ptrdiff_t)count);
            W(finish)(job, z * plane + start, count, to);
        }
    }
}
