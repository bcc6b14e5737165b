// SPDX-License-Identifier: MIT
#version 460
#include "memory.glsl"
#include "octree_build_shared.h"

// From words to the sums of the words before them, in three dispatches: the sums of tiles of 2048 words, those of the tiles before,
// the words'. A group owns a tile, in the second dispatch all of them. Reads 8 bytes a word, writes 4.

layout(constant_id = 0) const uint PHASE = 0;

layout(local_size_x = FM_BUILD_SCAN_THREADS) in;

layout(push_constant) uniform push_block {
    fm_scan_push push;
};

#define GROUP_SCAN_THREADS FM_BUILD_SCAN_THREADS
#include "group_scan.glsl"

shared uint tile_total;

uint count_at(uint64_t i) {
    return i < push.count ? ref_u32(push.counts + i * 4).v : 0;
}

void scan_tiles() {
    uint tiles = (push.count + (FM_BUILD_SCAN_TILE - 1)) / FM_BUILD_SCAN_TILE;
    uint before = 0;
    for (uint first = 0; first < tiles; first += FM_BUILD_SCAN_THREADS) {
        uint i = first + gl_LocalInvocationIndex;
        uint value = i < tiles ? ref_u32(push.sums + uint64_t(i) * 4).v : 0;
        uint sum = group_scan(value);
        if (i < tiles) {
            ref_u32(push.sums + uint64_t(i) * 4).v = before + sum;
        }
        if (gl_LocalInvocationIndex == FM_BUILD_SCAN_THREADS - 1) {
            tile_total = sum + value;
        }
        barrier();
        before += tile_total;
        barrier();
    }
    if (gl_LocalInvocationIndex == 0) {
        ref_u32(push.total).v = before;
    }
}

void scan_words(uint64_t tile) {
    uint64_t first = tile * FM_BUILD_SCAN_TILE + gl_LocalInvocationIndex * FM_BUILD_SCAN_EACH;
    uint sum = 0;
    for (uint i = 0; i < FM_BUILD_SCAN_EACH; i++) {
        sum += count_at(first + i);
    }
    uint before = group_scan(sum);
    if (PHASE == 0) {
        if (gl_LocalInvocationIndex == FM_BUILD_SCAN_THREADS - 1) {
            ref_u32(push.sums + tile * 4).v = before + sum;
        }
        return;
    }
    before += ref_u32(push.sums + tile * 4).v;
    for (uint i = 0; i < FM_BUILD_SCAN_EACH && first + i < push.count; i++) {
        uint value = count_at(first + i);
        ref_u32(push.counts + (first + i) * 4).v = before;
        before += value;
    }
}

void main() {
    uint64_t tile = folded_group(gl_WorkGroupID, gl_NumWorkGroups);
    if (PHASE == 1) {
        scan_tiles();
    } else if (tile * FM_BUILD_SCAN_TILE < push.count) {
        scan_words(tile);
    }
}
