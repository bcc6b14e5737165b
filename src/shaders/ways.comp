// SPDX-License-Identifier: MIT
#version 460
#include "memory.glsl"
#include "shared.h"

// The way along x from every voxel to the nearest site of its row, 16 bits each (65,535: none), in the order in which halve.comp
// reads them: tiles of 32 adjacent x, in them slices, in these rows.
//
// One invocation owns eight voxels of one word in each of ROWS rows. The pass reads 1/4 byte a voxel and writes 2.

layout(local_size_x = 256) in;

layout(push_constant) uniform push_block {
    fm_column_push push;
};

#include "sites.glsl"

const uint ROWS = 4;
const uint APART = 64;  // rows from one of an invocation's to the next
const uint GROUP_ROWS = APART * ROWS;

// The ways of eight voxels of a word, from bit `shift` on.
uvec4 ways_of(uint word, uvec2 carry, uint shift) {
    const uint far = 0x10000u;
    uint below = word & ~(0xffffffffu << shift);
    uint above = word >> shift >> 8;
    uint left = below != 0 ? shift - uint(findMSB(below)) : min(carry.x, far) + shift;
    uint right = above != 0 ? uint(findLSB(above)) + 1 : min(carry.y, far) + 24 - shift;
    word >>= shift;
    uint steps[8];
    [[unroll]] for (uint k = 0; k < 8; k++) {
        left = (word >> k & 1u) != 0 ? 0 : left;
        steps[k] = left;
        left += 1;
    }
    [[unroll]] for (uint j = 0; j < 8; j++) {
        uint k = 7 - j;
        right = (word >> k & 1u) != 0 ? 0 : right;
        steps[k] = min(min(steps[k], right), 0xffffu);
        right += 1;
    }
    uvec4 packed;
    [[unroll]] for (uint k = 0; k < 4; k++) {
        packed[k] = steps[2 * k] | steps[2 * k + 1] << 16;
    }
    return packed;
}

void main() {
    uint chunks = (push.y + GROUP_ROWS - 1) / GROUP_ROWS;
    uint group = uint(folded_group(gl_WorkGroupID, gl_NumWorkGroups));
    // Groups that share a piece of the bits follow on one another.
    uint tiles = (push.x_end - push.x_begin + 31) / 32;
    uint rows = group / tiles;
    uint tile = group - rows * tiles;
    uint z = rows / chunks;
    if (z >= push.z) {
        return;
    }
    uint y = (rows - z * chunks) * GROUP_ROWS + (gl_LocalInvocationIndex >> 2);
    uint quarter = gl_LocalInvocationIndex & 3u;
    uint64_t first = uint64_t(z) * push.y * push.row_words + (push.x_begin >> 5) + tile;
    uint word[ROWS];
    uvec2 carry[ROWS];
    [[unroll]] for (uint i = 0; i < ROWS; i++) {
        uint64_t at = first + min(y + APART * i, push.y - 1) * push.row_words;
        word[i] = ref_u32(push.bits + at * 4).v;
        carry[i] = load_carries(push.carries, at, false);
    }
    fm_address to = push.sites_y + ((uint64_t(tile) * push.z + z) * push.y + y) * 64 + quarter * 16;
    [[unroll]] for (uint i = 0; i < ROWS; i++) {
        if (y + APART * i < push.y) {
            ref_u32x4(to + uint64_t(i * APART * 64)).v = ways_of(word[i], carry[i], quarter * 8);
        }
    }
}
