// SPDX-License-Identifier: MIT
#version 460
#include "memory.glsl"
#include "sdf.glsl"
#include "sdf_near.glsl"

// The list of near blocks. An invocation owns a word of bits, 32 blocks of a row; a group takes its entries at once, so that
// neighbours are listed together. Reads 4 bytes a word, writes 4 a near block.

layout(local_size_x = 64) in;

shared uint taken;
shared uint first_of_group;

void main() {
    uvec3 grid = near_grid();
    uint words = near_words(grid.x);
    uint64_t own = folded_group(gl_WorkGroupID, gl_NumWorkGroups) * 64 + gl_LocalInvocationIndex;
    uint bits = own < uint64_t(words) * grid.y * grid.z ? ref_u32(near_row(grid, 0, 0) + own * 4).v : 0;
    if (gl_LocalInvocationIndex == 0) {
        taken = 0;
    }
    barrier();
    uint first = bits != 0 ? atomicAdd(taken, uint(bitCount(bits))) : 0;
    barrier();
    if (gl_LocalInvocationIndex == 0 && taken > 0) {
        fm_address header = push.scratch + FM_NEAR_LIST;
        first_of_group = atomicAdd(ref_u32(header).v, taken);
        atomicMax(ref_u32(header + 4).v, min(first_of_group + taken, FM_LIST_MAX_GROUPS));
    }
    barrier();
    fm_address entries = near_entries(grid) + uint64_t(first_of_group + first) * 4;
    uint block = uint(own / words * grid.x + own % words * 32);
    for (; bits != 0; bits &= bits - 1) {
        ref_u32(entries).v = block + findLSB(bits);
        entries += 4;
    }
}
