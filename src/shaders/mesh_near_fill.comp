// SPDX-License-Identifier: MIT
#version 460
#include "memory.glsl"
#include "sdf.glsl"
#include "sdf_near.glsl"

// The texels of blocks that are not near: the band's width with a sign. A group owns 256 texels of a row, an invocation 4 of them,
// which lie in one block. Writes 4 bytes a texel, and 4 for its triangle; reads the bits of the row's blocks and a texel of the
// nearest one.
//
// No surface is between texels beside each other of far blocks, nor between such a texel and the one beside it in a near block. So
// a row has the side that the nearest near block has where it faces it, a row of far blocks that of the next row with near ones, a
// slice of far blocks likewise.

layout(local_size_x = 64) in;

bool texel_inside(uint x, uint y, uint z) {
    ivec3 size = field_size();
    uint64_t element = (uint64_t(z) * size.y + y) * size.x + x;
    return int(ref_u32(push.distance + element * 4).v) < 0;
}

// Along an axis: the nearer end of the set bit before i, or if there is none behind i; -1 if there is neither.
int facing(fm_address bits, uint i, uint count) {
    int before = near_before(bits, i);
    if (before >= 0) {
        return before * FM_SDF_MIDDLE + FM_SDF_MIDDLE - 1;
    }
    int behind = near_from(bits, i, count);
    return behind < 0 ? -1 : behind * FM_SDF_MIDDLE;
}

bool far_inside(uvec3 grid, uvec3 at, uvec3 block) {
    int x = facing(near_row(grid, block.y, block.z), block.x, grid.x);
    if (x >= 0) {
        return texel_inside(x, at.y, at.z);
    }
    int y = facing(near_slice(grid, block.z), block.y, grid.y);
    int z = int(at.z);
    if (y < 0) {
        z = facing(near_slices(grid), block.z, grid.z);
        if (z < 0) {
            return ref_u32(push.scratch + FM_NEAR_SIDE).v != 0;
        }
        y = near_from(near_slice(grid, uint(z) / FM_SDF_MIDDLE), 0, grid.y) * FM_SDF_MIDDLE;
    }
    x = near_from(near_row(grid, uint(y) / FM_SDF_MIDDLE, uint(z) / FM_SDF_MIDDLE), 0, grid.x) * FM_SDF_MIDDLE;
    return texel_inside(x, y, z);
}

// Of 4 texels from `at` on.
uint inside_bits(uvec3 grid, uvec3 at, uvec3 block) {
    if (SIGN == FM_SDF_CROSSINGS) {
        return crossed_word(ivec3(at)) >> (at.x & 31u);
    }
    return SIGN == FM_SDF_PSEUDONORMAL && far_inside(grid, at, block) ? 15 : 0;
}

void main() {
    uvec3 size = uvec3(field_size());
    uvec3 grid = near_grid();
    uint pieces = (size.x + 255) / 256;
    uint64_t group = folded_group(gl_WorkGroupID, gl_NumWorkGroups);
    uint row = uint(group / pieces);
    uvec3 at = uvec3(uint(group % pieces) * 256 + gl_LocalInvocationIndex * 4, row % size.y, row / size.y);
    uvec3 block = at / FM_SDF_MIDDLE;
    if (at.x >= size.x || at.z >= size.z || near_bit(near_row(grid, block.y, block.z), block.x)) {
        return;
    }
    uint64_t element = (uint64_t(at.z) * size.y + at.y) * size.x + at.x;
    uint inside = inside_bits(grid, at, block);
    uvec4 value;
    [[unroll]] for (uint i = 0; i < 4; i++) {
        value[i] = floatBitsToUint(band()) | (inside >> i & 1) << 31;
    }
    if (size.x % 4 == 0) {
        ref_u32x4(push.distance + element * 4).v = value;
        if (push.triangles != 0) {
            ref_u32x4(push.triangles + element * 4).v = uvec4(FM_GPU_NONE);
        }
        return;
    }
    [[unroll]] for (uint i = 0; i < 4; i++) {
        if (at.x + i < size.x) {
            ref_u32(push.distance + (element + i) * 4).v = value[i];
            if (push.triangles != 0) {
                ref_u32(push.triangles + (element + i) * 4).v = FM_GPU_NONE;
            }
        }
    }
}
