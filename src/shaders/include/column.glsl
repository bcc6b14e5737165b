// SPDX-License-Identifier: MIT
// What the column kernels of the general cost share: reading a row's cost, writing the result of a voxel.
// Expects memory.glsl; declares `push` and the constants.

#include "shared.h"

layout(constant_id = 3) const uint METRIC = 0;
layout(constant_id = 4) const bool WEIGHTED = false;
layout(constant_id = 5) const uint SOURCE = 0;
layout(constant_id = 6) const uint TARGET = 0;
layout(constant_id = 7) const bool WIDE = false;
layout(constant_id = 8) const bool SITES = false;  // the nearest site is wanted, the lowest of equals
layout(constant_id = 9) const bool ALONG_Z = false;
layout(constant_id = 10) const bool SQUARED = false;
layout(constant_id = 11) const bool BORDER = false;
layout(constant_id = 12) const uint OUT_TYPE = 0;
layout(constant_id = 13) const uint INDEX_TYPE = 0;
layout(constant_id = 14) const bool BIG = false;  // exact raw distances may pass 2^24

layout(push_constant) uniform push_block {
    fm_column_push push;
};

#include "sites.glsl"
#include "grid.glsl"
#include "finish.glsl"
#include "cost.glsl"

cost_t load_cost(uint slice, uint n, uint x) {
    uint64_t row = row_of(slice, n);
    if (SOURCE == FM_SOURCE_BITS) {
        return row_cost(row_ways(push.bits, push.carries, row * push.row_words, x, WIDE));
    }
    return cost_from_bits(ref_u32(raw_at(row, x, 4)).v);
}

// Whether the way to a site is longer than the cap, or than the way out of the grid where that counts.
bool out_of_reach(uvec3 at, cost_t value) {
#ifndef COST_U32
    if (WEIGHTED) {
        uvec3 way = ways_out(at);
        cost_t least =
            min(min(steps_cost(way.x, push.weight_x), steps_cost(way.y, push.weight_y)), steps_cost(way.z, push.weight_z));
        return value > uintBitsToFloat(push.cap_raw) || (BORDER && least < value);
    }
#endif
    uint raw = exact_raw(value);
    return raw == FM_GPU_NONE || raw > push.cap_raw || (BORDER && raw_out(at) < raw);
}

void finish_voxel(uvec3 at, uint64_t element, cost_t value, uvec3 site) {
    if (push.distance != 0) {
#ifndef COST_U32
        if (WEIGHTED) {
            finish_weighted(at, element, value);
        } else {
            finish_exact(at, element, exact_raw(value));
        }
#else
        finish_exact(at, element, exact_raw(value));
#endif
    }
    if (SITES) {
        store_index(element, is_none(value) || out_of_reach(at, value), site);
    }
}

// Steps along an axis whose cost does not exceed `value`, `size` at most.
uint steps_within(cost_t value, float weight, uint size) {
#ifdef COST_U32
    return min(value, size);
#else
    uint steps = uint(min(WEIGHTED ? value / weight : value, float(size)));
    while (steps < size && steps_cost(steps + 1, weight) <= value) {
        steps++;
    }
    while (steps > 0 && steps_cost(steps, weight) > value) {
        steps--;
    }
    return steps;
#endif
}

// The first site of slice z within Linf distance `value` of a voxel. The passes know the lowest slice with one, but within it the
// site that is nearest in the plane, and a maximum hides that another one comes first.
uvec3 first_of_slice(uvec3 at, uint z, cost_t value) {
    uint reach_x = steps_within(value, push.weight_x, push.x);
    uint reach_y = steps_within(value, push.weight_y, push.y);
    uint begin = at.x - min(at.x, reach_x);
    uint last_y = min(at.y + reach_y, push.y - 1);
    for (uint y = at.y - min(at.y, reach_y); y <= last_y; y++) {
        uint right = row_ways(push.bits, push.carries, (uint64_t(z) * push.y + y) * push.row_words, begin, WIDE).y;
        if (right != FM_GPU_NONE && begin + right <= at.x + reach_x) {
            return uvec3(begin + right, y, z);
        }
    }
    return at;
}

// Writes what voxel n of column (slice, x) gets: its cost and, where sites are wanted, the row of its nearest site.
void store_result(uint slice, uint n, uint x, cost_t value, uint nearest) {
    uint64_t row = row_of(slice, n);
    if (TARGET == FM_TARGET_RAW) {
        ref_u32(raw_at(row, x, 4)).v = cost_bits(value);
        if (SITES) {
            ref_u32(site_y_at(row, x)).v = nearest;
        }
        return;
    }
    uvec3 site = uvec3(x, nearest, slice);
    if (SITES && !is_none(value)) {
        site.z = ALONG_Z ? nearest : slice;
        if (METRIC == FM_GPU_LINF) {
            site = first_of_slice(voxel_at(slice, n, x), site.z, value);
        } else {
            site.y = ALONG_Z ? ref_u32(site_y_at(row_of(slice, nearest), x)).v : nearest;
            uvec2 ways = row_ways(push.bits, push.carries, (uint64_t(site.z) * push.y + site.y) * push.row_words, x, WIDE);
            site.x = ways.x <= ways.y ? x - ways.x : x + ways.y;
        }
    }
    finish_voxel(voxel_at(slice, n, x), row * push.x + x, value, site);
}
