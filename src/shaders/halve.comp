// SPDX-License-Identifier: MIT
#version 460
#include "memory.glsl"
#include "column.glsl"

// Squared Euclidean distances along a column: out(n) = min over m of in(m) + (n - m)^2, in whole numbers.
//
// One invocation owns ROWS rows of one column, a group 32 adjacent columns, whole. What it reads (the ways of ways.comp, or the raw
// distances of the pass along y) lies in tiles of 32 columns, read from memory once and then from the cache: a driver may give a
// multiprocessor's groups less shared memory than it has, too little for enough columns. A pass reads 2 or 4 bytes a voxel and
// writes 4.
//
// The row of the nearest site never decreases along a column (Aggarwal et al. 1987). An invocation finds that of its first row by a
// search over all sites, in which the least of each block of BLOCK rows tells which blocks to look into. The sites of its rows then
// lie between its own and the next invocation's. The one of the row halfway is sought there, and so on, and what is left for every
// TRIED rows is tried against all of them at once, in registers.
//
// A key is a site's cost above ROW_BITS bits of its row, so that the least key names the site too, the first of equals. Sites tried
// in excess do no harm.

layout(local_size_x = 32, local_size_y_id = 1) in;
layout(constant_id = 0) const uint ROWS = 32;  // or 64
layout(constant_id = 2) const uint ROW_BITS = 9;
layout(constant_id = 15) const bool PLAIN = false;  // results of four bytes, no cap, no scale, nothing solid outside

const uint BLOCK = 16;
const uint TRIED = 8;  // as many as PIECE: they are written together
const uint BATCH = 4;
const uint LANES = 32;
const uint SEGMENTS = gl_WorkGroupSize.y;
const uint BLOCKS = SEGMENTS * (ROWS / BLOCK);
const uint ROW_MASK = (1u << ROW_BITS) - 1u;
const uint LAST = SEGMENTS * ROWS - 1;
// The raw distance of rows without a site: with the square of the longest way added it still fits in a key.
const uint NONE = (ROW_BITS < 9 ? 1u << 23 : 1u << (32 - ROW_BITS)) - 1 - LAST * LAST;
// Bytes from a row of a column to the next. Raw distances lie in pieces of 32 x, one z and PIECE y: then both passes touch memory
// in long runs.
const uint PIECE = 8;
const uint STEP = SOURCE == FM_SOURCE_BITS ? LANES * 2 : LANES * 4 * PIECE;

shared uint block_least[BLOCKS * LANES];
shared uint first_site[SEGMENTS * LANES];

uint lane;
fm_address column;

uint fetch(fm_address at) {
    return SOURCE == FM_SOURCE_BITS ? uint(ref_u16(at).v) : ref_u32(at).v;
}

fm_address place(uint n) {
    return column + n * STEP;
}

uint raw_of(uint fetched) {
    return min(SOURCE == FM_SOURCE_BITS ? fetched * fetched : fetched, NONE);
}

fm_address raw_place(uint tile, uint y, uint z) {
    uint pieces = (push.y + PIECE - 1) / PIECE;
    return push.raw + ((uint64_t(tile) * pieces + y / PIECE) * push.z + z) * (LANES * 4 * PIECE) + (y % PIECE * LANES + lane) * 4;
}

uint squared(int d) {
    return uint(d * d) << ROW_BITS;
}

// The least key of the sites from row `low` to `high` for row n.
uint least_key(uint n, uint low, uint high) {
    uint best = 0xffffffffu;
    // The last batch ends with the range and starts before `low` where that is shorter: columns have BATCH rows at least.
    uint last = uint(max(int(high) - int(BATCH - 1), 0));
    for (uint next = low; next <= high; next += BATCH) {
        uint m = min(next, last);
        fm_address at = place(m);
        uint fetched[BATCH];
        [[unroll]] for (uint i = 0; i < BATCH; i++) {
            fetched[i] = fetch(at + uint64_t(i * STEP));
        }
        int d = int(n) - int(m);
        [[unroll]] for (uint i = 0; i < BATCH; i++) {
            int e = d - int(i);
            best = min(best, (raw_of(fetched[i]) + uint(e * e)) << ROW_BITS | (m + i));
        }
    }
    return best;
}

// The nearest site of row n, the first of a block: first the blocks' least rows alone, for a good bound, then every block that can
// beat it.
uint search(uint n, uint best, uint length) {
    uint own = n / BLOCK;
    int edge = 0;  // of the blocks that are next: rows from n
    for (uint away = 0; away < BLOCKS && squared(edge) < best; away++) {
        [[unroll]] for (uint side = 0; side < 2; side++) {
            uint block = side == 0 ? own + away : own - 1 - away;
            if (block < BLOCKS) {
                uint key = block_least[block * LANES + lane];
                best = min(best, key + squared(int(n) - int(key & ROW_MASK)));
            }
        }
        edge += int(BLOCK);
    }
    edge = 0;
    for (uint away = 0; away < BLOCKS && squared(edge) < best; away++) {
        [[unroll]] for (uint side = 0; side < 2; side++) {
            uint block = side == 0 ? own + away : own - 1 - away;
            if (block < BLOCKS) {
                uint key = block_least[block * LANES + lane] & ~ROW_MASK;
                uint nearest = block * BLOCK + (side == 0 ? 0 : BLOCK - 1);
                if (key + squared(edge + int(side)) + nearest < best) {
                    best = min(best, least_key(n, block * BLOCK, min(block * BLOCK + BLOCK, length) - 1));
                }
            }
        }
        edge += int(BLOCK);
    }
    return best;
}

uint plain_bits(uint raw) {
    if (raw >= NONE) {
        return push.none_bits;
    }
    if (OUT_TYPE == FM_GPU_F32) {
        return floatBitsToUint(SQUARED ? float(raw) : root_exact(raw));
    }
    return SQUARED ? raw : root_floor(raw);
}

void store(uint slice, uint n, uint x, uint count, int best[TRIED]) {
    if (TARGET == FM_TARGET_RAW) {
        fm_address to = raw_place((x - push.x_begin) / LANES, n, slice);
        [[unroll]] for (uint i = 0; i < TRIED; i++) {
            if (i < count) {
                uint raw = uint(best[i]) + i * i;
                ref_u32(to + uint64_t(i * LANES * 4)).v = raw >= NONE ? FM_GPU_NONE : raw;
            }
        }
        return;
    }
    uint64_t row = row_of(slice, n);
    uint64_t row_step = row_of(slice, 1) - row_of(slice, 0);
    if (PLAIN) {
        fm_address to = push.distance + (row * push.x + x) * 4;
        uint64_t step = row_step * push.x * 4;
        [[unroll]] for (uint i = 0; i < TRIED; i++) {
            if (i < count) {
                ref_u32(to + i * step).v = plain_bits(uint(best[i]) + i * i);
            }
        }
        return;
    }
    [[unroll]] for (uint i = 0; i < TRIED; i++) {
        if (i < count) {
            uint raw = uint(best[i]) + i * i;
            finish_exact(voxel_at(slice, n + i, x), (row + i * row_step) * push.x + x, raw < NONE ? raw : FM_GPU_NONE);
        }
    }
}

// Tries the sites from row `low` to `high` against TRIED rows from n on: with d the way to row n the cost less i^2 is linear in i.
void try_sites(uint slice, uint n, uint x, uint length, uint low, uint high) {
    int best[TRIED];
    [[unroll]] for (uint i = 0; i < TRIED; i++) {
        best[i] = int(NONE);
    }
    int d = int(n) - int(low);
    fm_address at = place(low);
    uint next = fetch(at);
    int end = d - int(high - low);
    while (d >= end) {
        uint raw = raw_of(next);
        at += STEP;
        next = fetch(at);
        int base = int(raw) + d * d;
        int slope = 2 * d;
        [[unroll]] for (uint i = 0; i < TRIED; i++) {
            best[i] = min(best[i], base + int(i) * slope);
        }
        d -= 1;
    }
    store(slice, n, x, n < length ? min(length - n, TRIED) : 0, best);
}

void try_16(uint slice, uint n, uint x, uint length, uint low, uint high) {
    uint middle = least_key(n + TRIED, low, high) & ROW_MASK;
    try_sites(slice, n, x, length, low, middle);
    try_sites(slice, n + TRIED, x, length, middle, high);
}

void try_32(uint slice, uint n, uint x, uint length, uint low, uint high) {
    uint middle = least_key(n + 16, low, high) & ROW_MASK;
    [[dont_unroll]] for (uint h = 0; h < 2; h++) {
        try_16(slice, n + 16 * h, x, length, h == 0 ? low : middle, h == 0 ? middle : high);
    }
}

void main() {
    lane = gl_LocalInvocationID.x;
    uint segment = gl_LocalInvocationID.y;
    uint slice, x;
    uint tiles = (push.x_end - push.x_begin + LANES - 1) / LANES;
    uint group = uint(folded_group(gl_WorkGroupID, gl_NumWorkGroups));
    slice = group / tiles;
    x = push.x_begin + (group - slice * tiles) * LANES;
    if (slice >= column_slices()) {
        return;
    }
    uint length = column_rows();
    uint n0 = segment * ROWS;
    uint tile = (x - push.x_begin) / LANES;
    uint64_t ways_row = (uint64_t(tile) * push.z + slice) * push.y;
    column = SOURCE == FM_SOURCE_BITS ? push.sites_y + (ways_row * LANES + lane) * 2 : raw_place(tile, slice, 0);
    uint own_key = 0;
    [[unroll]] for (uint b = 0; b < ROWS; b += BLOCK) {
        uint own[BLOCK];
        [[unroll]] for (uint i = 0; i < BLOCK; i++) {
            // Loads hang on no condition, so that they can be under way together; what lies past the end is replaced.
            own[i] = fetch(place(min(n0 + b + i, length - 1)));
        }
        uint least = 0xffffffffu;
        [[unroll]] for (uint i = 0; i < BLOCK; i++) {
            uint n = n0 + b + i;
            uint key = (n < length ? raw_of(own[i]) : NONE) << ROW_BITS | n;
            own_key = b + i == 0 ? key : own_key;
            least = min(least, key);
        }
        block_least[(n0 + b) / BLOCK * LANES + lane] = least;
    }
    barrier();
    uint low = 0;
    if (segment > 0) {
        low = (own_key >> ROW_BITS == 0 ? own_key : search(n0, own_key, length)) & ROW_MASK;
    }
    first_site[segment * LANES + lane] = low;
    barrier();
    x += lane;
    if (x >= push.x_end) {
        return;
    }
    uint high = segment + 1 < SEGMENTS ? first_site[(segment + 1) * LANES + lane] : length - 1;
    if (ROWS == 32) {
        try_32(slice, n0, x, length, low, high);
        return;
    }
    uint middle = least_key(n0 + 32, low, high) & ROW_MASK;
    [[dont_unroll]] for (uint h = 0; h < 2; h++) {
        try_32(slice, n0 + 32 * h, x, length, h == 0 ? low : middle, h == 0 ? middle : high);
    }
}
