// SPDX-License-Identifier: MIT
#version 460
#include "memory.glsl"
#include "sdf.glsl"
#include "sdf_near.glsl"

// Which rows and slices of blocks have near ones. An invocation owns a row: it reads 4 bytes for 32 blocks, and sets up to two
// bits.

layout(local_size_x = 64) in;

void set_bit(fm_address bits, uint i) {
    fm_address at = bits + (i >> 5) * 4;
    uint bit = 1u << (i & 31u);
    if ((ref_u32(at).v & bit) == 0) {
        atomicOr(ref_u32(at).v, bit);
    }
}

void main() {
    uvec3 grid = near_grid();
    uint64_t own = folded_group(gl_WorkGroupID, gl_NumWorkGroups) * 64 + gl_LocalInvocationIndex;
    if (own >= uint64_t(grid.y) * grid.z) {
        return;
    }
    uint y = uint(own % grid.y);
    uint z = uint(own / grid.y);
    if (near_from(near_row(grid, y, z), 0, grid.x) >= 0) {
        set_bit(near_slice(grid, z), y);
        set_bit(near_slices(grid), z);
    }
}
