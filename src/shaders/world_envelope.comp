// SPDX-License-Identifier: MIT
#version 460
#include "memory.glsl"
#include "shared.h"

// Squared Euclidean distances of a world along y or z: see envelope.glsl and world_grid.glsl. One invocation owns 16 rows of a
// column. A pass reads the bits and carries (y) or 4 bytes (z) a voxel and writes 4.

layout(local_size_x_id = 0, local_size_y_id = 1) in;
layout(constant_id = 5) const uint SOURCE = 0;
layout(constant_id = 6) const uint TARGET = 0;
layout(constant_id = 9) const bool ALONG_Z = false;
const uint ROWS = 16;
const uint LANES = gl_WorkGroupSize.x;
const uint SEGMENTS = gl_WorkGroupSize.y;

const uint METRIC = FM_GPU_L2;
const bool WEIGHTED = false;
const bool SITES = false;

#include "world_grid.glsl"

float row_weight() {
    return 1;
}

float column_weight() {
    return 1;
}

#include "cost.glsl"

cost_t load_cost(uint slice, uint n, uint x) {
    uint64_t row = row_of(slice, n);
    if (SOURCE == FM_SOURCE_BITS) {
        return row_cost(row_ways(push.bits, push.carries, row * push.row_words, x, false));
    }
    // The cap stands for no site as well; no distance is added to it.
    uint value = ref_u32(raw_at(row, x, 4)).v;
    return value >= push.cap ? COST_NONE : value;
}

void store_result(uint slice, uint n, uint x, cost_t value, uint nearest) {
    uint64_t row = row_of(slice, n);
    uint capped = min(value, push.cap);
    if (TARGET == FM_TARGET_RAW) {
        fm_address to = raw_at(row, x, 4);
        if (LISTED) {
            uint before = ref_u32(to).v;
            if (before == capped) {
                return;
            }
            note_change(n % ROWS, min(before, capped));
        }
        ref_u32(to).v = capped;
    } else if (capped != 0 && (!LISTED || may_have_changed(n, capped))) {
        ref_u32(push.distance + (row * push.x + x) * 4).v = capped;
    }
}

#include "envelope.glsl"

void do_tile(uint slice, uint x) {
    envelope_tile(slice, x);
}

void main() {
    run_tiles();
}
