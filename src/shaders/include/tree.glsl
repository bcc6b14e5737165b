// SPDX-License-Identifier: MIT
// What the kernels share that build a tree.

#include "memory.glsl"
#include "bvh.glsl"

layout(local_size_x = FM_TREE_THREADS) in;

layout(push_constant) uniform push_block {
    fm_tree_push push;
};

// Numbers that order as the floats do.
uint ordered_of(float x) {
    uint bits = floatBitsToUint(x);
    return (bits >> 31) != 0 ? ~bits : bits | 0x80000000u;
}

float ordered_float(uint bits) {
    return uintBitsToFloat((bits >> 31) != 0 ? bits & 0x7fffffffu : ~bits);
}

uint word_at(fm_address base, uint i) {
    return ref_u32(base + uint64_t(i) * 4).v;
}

void set_word(fm_address base, uint i, uint value) {
    ref_u32(base + uint64_t(i) * 4).v = value;
}

#define GROUP_SCAN_THREADS FM_TREE_THREADS
#include "group_scan.glsl"
