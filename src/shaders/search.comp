// SPDX-License-Identifier: MIT
#version 460
#include "memory.glsl"
#include "column.glsl"

// As envelope.comp for columns too long for shared memory: one invocation owns one voxel and looks outward along its column until
// no row farther away can win. Reads and writes different memory. Time grows with the distance.

layout(local_size_x = 64) in;

// Rows a turn: software drivers end an invocation's loops silently after 65,535 turns.
const uint UNROLLED = 16;

void main() {
    uint rows = column_rows();
    uint tiles = (push.x_end - push.x_begin + 63) / 64;
    uint64_t group = folded_group(gl_WorkGroupID, gl_NumWorkGroups);
    uint x = push.x_begin + uint(group % tiles) * 64 + gl_LocalInvocationID.x;
    uint n = uint(group / tiles % rows);
    uint64_t slice_wide = group / tiles / rows;
    if (slice_wide >= column_slices() || x >= push.x_end) {
        return;
    }
    uint slice = uint(slice_wide);
    cost_t best = load_cost(slice, n, x);
    uint at = n;
    uint farthest = max(n, rows - 1 - n);
    bool open = true;
    for (uint begin = 1; open && begin <= farthest; begin += UNROLLED) {
        [[unroll]] for (uint i = 0; i < UNROLLED; i++) {
            uint away = begin + i;
            cost_t bound = steps_cost(away, column_weight());
            open = open && away <= farthest && !(SITES ? bound > best : bound >= best);
            if (open && away <= n) {
                cost_t value = cost(load_cost(slice, n - away, x), int(away));
                if (value < best || (SITES && value == best)) {
                    best = value;
                    at = n - away;
                }
            }
            if (open && n + away < rows) {
                cost_t value = cost(load_cost(slice, n + away, x), int(away));
                if (value < best) {
                    best = value;
                    at = n + away;
                }
            }
        }
    }
    store_result(slice, n, x, best, at);
}
