// SPDX-License-Identifier: MIT
#version 460
#include "memory.glsl"
#include "mesh_shared.h"

// Counts of crossings to voxels inside. Some invocations own a row, each 32 voxels of it at a time, from the far end on: it sums
// their counts, the sums of all behind it come from shared memory, and voxels of a positive count are set. Reads 4 bytes a voxel
// (twice, the second time from the cache), reads and writes a voxel's bit, or writes its byte where it is inside.

layout(constant_id = 0) const uint ROW_THREADS = 1;  // invocations that own a row
layout(constant_id = 1) const bool BITS = false;

layout(local_size_x = 64) in;

layout(push_constant) uniform Push {
    fm_voxel_fill_push push;
};

shared int sums[64];

int count_at(uint64_t row, uint x) {
    return int(ref_u32(push.counts + (row * push.x + x) * 4).v);
}

// The sum of `own` over this invocation and those of its row behind it.
int sum_behind(uint lane, int own) {
    const uint at = gl_LocalInvocationIndex;
    sums[at] = own;
    barrier();
    for (uint step = 1; step < ROW_THREADS; step *= 2) {
        const int other = lane + step < ROW_THREADS ? sums[at + step] : 0;
        barrier();
        sums[at] += other;
        barrier();
    }
    return sums[at];
}

void store(uint64_t row, uint x, uint inside) {
    const uint64_t target = push.z_begin * uint64_t(push.y) + row;
    if (BITS) {
        const fm_address word = push.voxels + (target * push.row_words + x / 32) * 4;
        ref_u32(word).v |= inside;
        return;
    }
    while (inside != 0) {
        const int bit = findLSB(inside);
        inside &= inside - 1;
        ref_u8(push.voxels + target * push.x + x + bit).v = uint8_t(1);
    }
}

void main() {
    const uint64_t rows = uint64_t(push.y) * push.slices;
    const uint64_t group = folded_group(gl_WorkGroupID, gl_NumWorkGroups);
    const uint64_t row = group * (64 / ROW_THREADS) + gl_LocalInvocationIndex / ROW_THREADS;
    const uint lane = gl_LocalInvocationIndex % ROW_THREADS;
    const uint rounds = (push.row_words + ROW_THREADS - 1) / ROW_THREADS;
    int behind = 0;  // of all rounds so far
    for (uint round = rounds; round-- > 0;) {
        const uint x = (round * ROW_THREADS + lane) * 32;
        const uint end = row < rows ? min(push.x, x + 32) : 0;
        int own = 0;
        for (uint i = x; i < end; i++) {
            own += count_at(row, i);
        }
        const int all = sum_behind(lane, own);
        int count = behind + all - own;
        uint inside = 0;
        for (uint i = max(end, x); i-- > x;) {
            count += count_at(row, i);
            inside |= count > 0 ? 1u << (i - x) : 0u;
        }
        if (inside != 0) {
            store(row, x, inside);
        }
        behind += sums[gl_LocalInvocationIndex - lane];
        barrier();
    }
}
