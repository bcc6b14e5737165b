// SPDX-License-Identifier: MIT
// L1, for the lanes of lanes.h. Sums saturate at NONE. A border costs nothing: it is a site just outside each end of a row or
// column.

enum { W(LANES) = VECTOR_BYTES / sizeof(LANE) };

// Distances along a buffered row that is 0 at sites and NONE elsewhere, also in the FM_KERNEL_PAD elements around it. After the
// round of s every element knows the sites up to 2 s - 1 away; a row with no value above s needs no further one.
static inline void W(row)(LANE *row, ptrdiff_t count) {
    const ptrdiff_t lanes = W(LANES);
    const vector none = V(set)(NONE);
    for (ptrdiff_t s = 1; s <= count && s < NONE; s *= 2) {
        const vector step = V(set)((LANE)s);
        bool open = false;
        for (ptrdiff_t x = 0; x < count; x += lanes) {
            const vector left = x + lanes > s ? load(row + x - s) : none;
            const vector right = x + s < count + lanes ? load(row + x + s) : none;
            const vector least = V(min)(load(row + x), V(add)(V(min)(left, right), step));
            store(row + x, least);
            open |= V(any_less)(step, least);
        }
        if (!open) {
            break;
        }
    }
}

// out[i] = min(a[i], b[i] + 1)
static inline void W(sweep)(LANE *out, const LANE *a, const LANE *b, ptrdiff_t count) {
    const vector one = V(set)(1);
    for (ptrdiff_t x = 0; x < count; x += W(LANES)) {
        store(out + x, V(min)(load(a + x), V(add)(load(b + x), one)));
    }
}

// Fills the buffered row from the sites and makes them distances.
static inline void W(fill_row)(const fm_kernel_job *job, const uint32_t *words, LANE *row, size_t width) {
    const uint32_t size = job->plan->shape.x;
    const vector outside = V(set)(job->border ? 0 : NONE);
    for (ptrdiff_t x = -FM_KERNEL_PAD; x < 0; x += W(LANES)) {
        store(row + x, outside);
    }
    for (size_t x = 0; x < width; x += W(LANES)) {
        store(row + x, CLEAR_WHERE(words, (uint32_t)x));
    }
    for (size_t x = size; x < width + FM_KERNEL_PAD; x++) {
        row[x] = job->border ? 0 : NONE;
    }
    W(row)(row, size);
}

static void W(plane)(void *user, uint64_t begin, uint64_t end, uint32_t worker) {
    const fm_kernel_job *job = user;
    const fm_shape shape = job->plan->shape;
    const size_t row_words = fm_bits_row_words(shape);
    const size_t width = fm_round_up(shape.x, 64);
    const vector outside = V(set)(job->border ? 0 : NONE);
    uint32_t *words = (uint32_t *)(void *)(job->workers + worker * job->worker_bytes);
    LANE *row = (LANE *)(void *)(words + fm_round_up(row_words + 2, 16)) + FM_KERNEL_PAD;
    LANE *edge = row + width + FM_KERNEL_PAD;
    LANE *nothing = edge + width;
    LANE *slice = nothing + width;
    for (size_t x = 0; x < width; x += W(LANES)) {
        store(edge + x, outside);
        store(nothing + x, V(set)(NONE));
    }
    for (uint64_t z = begin; z < end; z++) {
        for (uint64_t y = 0; y < shape.y; y++) {
            LANE *to = slice + y * width;
            const LANE *last = y == 0 ? edge : to - width;
            const bool any = fm_fetch_words(job, z * shape.y + y, row_words, words);
            if (any || job->border) {
                W(fill_row)(job, words, row, width);
            }
            W(sweep)(to, any || job->border ? row : nothing, last, (ptrdiff_t)width);
        }
        for (uint64_t y = shape.y; y-- > 0;) {
            LANE *to = slice + y * width;
            W(sweep)(to, to, y + 1 == shape.y ? edge : to + width, (ptrdiff_t)width);
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
    // What is in place was read just now, so that it is in the cache.
    LANE *staged = job->middle == job->distance ? NULL : tile + run * shape.z;
    for (size_t i = 0; i < run; i += W(LANES)) {
        store(edge + i, outside);
    }
    for (uint64_t item = begin; item < end; item++) {
        const uint64_t start = item * run;
        const size_t count = (size_t)fm_min_u64(run, plane - start);
        const LANE *from = (const LANE *)job->middle + start;
        for (size_t z = 0; z < shape.z; z++) {
            LANE *to = tile + z * run;
            const LANE *last = z == 0 ? edge : to - run;
            const size_t whole = count - count % W(LANES);
            W(sweep)(to, from + z * plane, last, (ptrdiff_t)whole);
            for (size_t i = whole; i < count; i++) {
                const LANE here = from[z * plane + i];
                to[i] = last[i] < here ? (LANE)(last[i] + 1) : here;
            }
        }
        for (size_t z = shape.z; z-- > 0;) {
            LANE *to = tile + z * run;
            W(sweep)(to, to, z + 1 == shape.z ? edge : to + run, (ptrdiff_t)count);
            W(finish)(job, z * plane + start, count, to, staged);
        }
    }
    stream_fence();
}
