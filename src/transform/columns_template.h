// SPDX-License-Identifier: MIT
// The search along a column of vectors that window_template.h explains, for the same definitions but STEPS.

enum { W(LANES) = VECTOR_BYTES / sizeof(LANE) };

static FM_INLINE vector W(reach)(vector field, vector step, bool linf) {
    return linf ? V(max)(field, step) : V(add)(field, step);
}

// One column of vectors, `stride` elements from row to row; FM_WINDOW_BLOCK rows of NONE lie before and after `field`.
static FM_INLINE void W(columns)(const uint32_t *steps, uint32_t count, const LANE *field, const LANE *block, const LANE *before,
                                 const LANE *after, LANE *out, size_t out_stride, bool linf) {
    const ptrdiff_t lanes = W(LANES);
    for (ptrdiff_t row = 0; row < (ptrdiff_t)count; row++) {
        vector best = load(field + row * lanes);
        const bool open = V(any_less)(set_u32(steps[1]), best);
        bool up = open && row > 0;
        bool down = open && row + 1 < (ptrdiff_t)count;
        for (ptrdiff_t k = 1; up || down; k += FM_WINDOW_BLOCK) {
            const vector nearest = set_u32(steps[k]);
            if (up) {
                if (V(any_less)(W(reach)(load(block + (row - k - FM_WINDOW_BLOCK + 1) * lanes), nearest, linf), best)) {
                    for (ptrdiff_t i = 0; i < FM_WINDOW_BLOCK; i++) {
                        best = V(min)(best, W(reach)(load(field + (row - k - i) * lanes), set_u32(steps[k + i]), linf));
                    }
                    up = row >= k + FM_WINDOW_BLOCK;
                } else {
                    up = row >= k + FM_WINDOW_BLOCK && V(any_less)(W(reach)(load(before + (row - k) * lanes), nearest, linf), best);
                }
            }
            if (down) {
                if (V(any_less)(W(reach)(load(block + (row + k) * lanes), nearest, linf), best)) {
                    for (ptrdiff_t i = 0; i < FM_WINDOW_BLOCK; i++) {
                        best = V(min)(best, W(reach)(load(field + (row + k + i) * lanes), set_u32(steps[k + i]), linf));
                    }
                    down = row + k + FM_WINDOW_BLOCK < (ptrdiff_t)count;
                } else {
                    down = row + k + FM_WINDOW_BLOCK < (ptrdiff_t)count &&
                           V(any_less)(W(reach)(load(after + (row + k) * lanes), nearest, linf), best);
                }
            }
        }
        store(out + (size_t)row * out_stride, best);
    }
}

// The cheapest of FM_WINDOW_BLOCK rows from each row on, and of all rows up to and from each row.
static inline void W(summarise)(uint32_t count, LANE *field, LANE *block, LANE *before, LANE *after) {
    const ptrdiff_t lanes = W(LANES);
    const vector none = V(set)(NONE);
    for (ptrdiff_t i = 1; i <= FM_WINDOW_BLOCK; i++) {
        store(field - i * lanes, none);
        store(field + ((ptrdiff_t)count - 1 + i) * lanes, none);
    }
    vector least = none;
    for (ptrdiff_t row = 0; row < (ptrdiff_t)count; row++) {
        least = V(min)(least, load(field + row * lanes));
        store(before + row * lanes, least);
    }
    least = none;
    vector next[FM_WINDOW_BLOCK];
    for (int i = 0; i < FM_WINDOW_BLOCK; i++) {
        next[i] = none;
    }
    for (ptrdiff_t row = (ptrdiff_t)count - 1; row > -FM_WINDOW_BLOCK; row--) {
        const vector here = load(field + row * lanes);
        // next[i] is the cheapest of i + 1 rows from the row below on, for i = 0, 1, 3.
        const vector two = V(min)(here, next[0]);
        const vector four = V(min)(two, next[2]);
        store(block + row * lanes, V(min)(four, next[6]));
        next[6] = next[5];
        next[5] = next[4];
        next[4] = next[3];
        next[3] = four;
        next[2] = next[1];
        next[1] = two;
        next[0] = here;
        if (row >= 0) {
            least = V(min)(least, here);
            store(after + row * lanes, least);
        }
    }
}
