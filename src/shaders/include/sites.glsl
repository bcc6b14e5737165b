// SPDX-License-Identifier: MIT
// Rows of site bits and their carries. The carries of word w are the steps from its first voxel to the nearest site in the words
// before it and from its last voxel to the nearest site in the words behind it: two 16-bit numbers, or two of 32 bits when WIDE.

#include "shared.h"

uvec2 load_carries(fm_address carries, uint64_t word, bool wide) {
    if (wide) {
        return ref_u32x2(carries + word * 8).v;
    }
    uint packed = ref_u32(carries + word * 4).v;
    uint left = packed & 0xffffu;
    uint right = packed >> 16;
    return uvec2(left == 0xffffu ? FM_GPU_NONE : left, right == 0xffffu ? FM_GPU_NONE : right);
}

void store_carries(fm_address carries, uint64_t word, uvec2 value, bool wide) {
    if (wide) {
        ref_u32x2(carries + word * 8).v = value;
    } else {
        ref_u32(carries + word * 4).v = min(value.x, 0xffffu) | min(value.y, 0xffffu) << 16;
    }
}

// Steps to the nearest site to the left (the voxel itself included) and to the right; FM_GPU_NONE where there is none.
uvec2 row_ways(fm_address bits, fm_address carries, uint64_t row_word, uint x, bool wide) {
    uint64_t at = row_word + (x >> 5);
    uint shift = x & 31u;
    uint word = ref_u32(bits + at * 4).v;
    uvec2 carry = load_carries(carries, at, wide);
    uint below = word & (0xffffffffu >> (31u - shift));
    uint above = word >> shift;
    uint left = below != 0 ? shift - uint(findMSB(below)) : carry.x == FM_GPU_NONE ? FM_GPU_NONE : carry.x + shift;
    uint right = above != 0 ? uint(findLSB(above)) : carry.y == FM_GPU_NONE ? FM_GPU_NONE : carry.y + 31u - shift;
    return uvec2(left, right);
}
