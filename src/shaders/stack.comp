// SPDX-License-Identifier: MIT
#version 460
#include "memory.glsl"
#include "column.glsl"

// Squared Euclidean distances along a column: out(n) = min over m of in(m) + (n - m)^2, in whole numbers.
//
// One invocation owns one column; adjacent invocations own adjacent x. Going forth it builds the lower envelope of the parabolas of
// its rows (Felzenszwalb and Huttenlocher 2012, with products in place of divisions), going back it reads the envelope off. The
// top three parabolas are in registers, the rest of the stack in scratch memory, one 32-bit number each: the row in the low
// PACK_BITS bits, in(m) above. A run of solid voxels is two entries. A pass reads each raw distance (or the bits) and writes each
// result once, and writes and reads back at most one number of the stack a voxel: 16 bytes at most. It needs as many columns as
// the device has invocations in flight; parabola.comp serves fewer.

layout(local_size_x = 64) in;
layout(constant_id = 2) const uint PACK_BITS = 10;

const uint BATCH = 8;
const uint RUN = 0xffffffffu >> PACK_BITS;  // in place of in(m) = 0 where run is 1

struct parabola_t {
    int m;
    int h;     // in(m) + m^2
    uint run;  // 1: all rows down to the entry below are solid
};

fm_address stack;
uint64_t stack_step;

parabola_t stacked(uint at) {
    uint packed = ref_u32(stack + at * stack_step).v;
    uint g = packed >> PACK_BITS;
    parabola_t p;
    p.m = int(packed & ((1u << PACK_BITS) - 1u));
    p.run = g == RUN ? 1u : 0u;
    p.h = (g == RUN ? 0 : int(g)) + p.m * p.m;
    return p;
}

void stack_up(uint at, parabola_t p) {
    uint g = p.run != 0 ? RUN : uint(p.h - p.m * p.m);
    ref_u32(stack + at * stack_step).v = g << PACK_BITS | uint(p.m);
}

// Whether b, between a and c, is nowhere below both.
bool hidden(parabola_t a, parabola_t b, parabola_t c) {
    return int64_t(b.h - a.h) * int64_t(c.m - b.m) >= int64_t(c.h - b.h) * int64_t(b.m - a.m);
}

int cost_less_square(parabola_t p, int n) {
    return p.h - 2 * n * p.m;
}

void main() {
    uint slice, x;
    if (!tile_of(gl_WorkGroupID, gl_NumWorkGroups, gl_WorkGroupSize.x, x, slice)) {
        return;
    }
    x += gl_LocalInvocationIndex;
    if (x >= push.x_end) {
        return;
    }
    uint length = column_rows();
    uint64_t first = row_of(slice, 0);
    uint64_t row_step = row_of(slice, 1) - first;
    uint width = push.x_end - push.x_begin;
    stack = push.sites_y + (uint64_t(slice) * length * width + (x - push.x_begin)) * 4;
    stack_step = uint64_t(width) * 4;

    parabola_t top, second, third;
    top.m = second.m = third.m = 0;
    top.h = second.h = third.h = 0;
    top.run = second.run = third.run = 0;
    uint depth = 0;
    fm_address from = raw_at(first, x, 4);
    uint64_t from_step = row_step * push.pitch * 4;
    for (uint n0 = 0; n0 < length; n0 += BATCH) {
        uint g[BATCH];
        [[unroll]] for (uint i = 0; i < BATCH; i++) {
            uint n = min(n0 + i, length - 1);
            if (SOURCE == FM_SOURCE_BITS) {
                uvec2 ways = row_ways(push.bits, push.carries, (first + n * row_step) * push.row_words, x, WIDE);
                uint way = min(ways.x, ways.y);
                g[i] = way == FM_GPU_NONE ? FM_GPU_NONE : way * way;
            } else {
                g[i] = ref_u32(from + n * from_step).v;
            }
        }
        [[unroll]] for (uint i = 0; i < BATCH; i++) {
            int n = int(n0 + i);
            if (n < int(length) && g[i] != FM_GPU_NONE) {
                parabola_t p;
                p.m = n;
                p.h = int(g[i]) + n * n;
                p.run = 0;
                bool follows = g[i] == 0 && depth > 0 && top.m == n - 1 && top.h == top.m * top.m;
                if (follows && top.run != 0) {
                    top.m = p.m;
                    top.h = p.h;
                } else {
                    p.run = follows ? 1u : 0u;
                    while (!follows && depth >= 2 && hidden(second, top, p)) {
                        top = second;
                        second = third;
                        depth--;
                        if (depth >= 3) {
                            third = stacked(depth - 3);
                        }
                    }
                    if (depth > 0) {
                        stack_up(depth - 1, top);
                    }
                    depth++;
                    third = second;
                    second = top;
                    top = p;
                }
            }
        }
    }
    for (uint i = length; i-- > 0;) {
        int n = int(i);
        int value = cost_less_square(top, n);
        while (depth >= 2 && (top.run != 0 ? n <= second.m : cost_less_square(second, n) <= value)) {
            value = cost_less_square(second, n);
            top = second;
            second = third;
            depth--;
            if (depth >= 3) {
                third = stacked(depth - 3);
            }
        }
        uint result = depth == 0 ? FM_GPU_NONE : top.run != 0 && n <= top.m ? 0 : uint(value + n * n);
        if (TARGET == FM_TARGET_RAW) {
            ref_u32(from + i * from_step).v = result;
        } else {
            uint64_t row = first + i * row_step;
            finish_exact(voxel_at(slice, i, x), row * push.x + x, result);
        }
    }
}
