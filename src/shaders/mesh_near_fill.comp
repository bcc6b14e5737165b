// SPDX-License-Identifier: MIT
#version 460
#include "memory.glsl"
#include "sdf.glsl"
#include "sdf_near.glsl"

// The texels of blocks that are not near: the band's width with a sign or, flooded, the distance of the triangle that reached the
// block. A group owns 32 x 16 x 2 texels, an invocation 4 x 4 that lie in one block. Writes 4 bytes a texel, and 4 for its
// triangle; reads the bits of the row's blocks and a texel of the nearest one or, flooded, 64 bytes a block.
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

void store(uvec3 at, uvec3 size, uvec4 value) {
    uint64_t element = (uint64_t(at.z) * size.y + at.y) * size.x + at.x;
    if (size.x % 4 == 0) {
        ref_u32x4(push.distance + element * 4).v = value;
        if (push.triangles != 0) {
            ref_u32x4(push.triangles + element * 4).v = uvec4(FM_GPU_NONE);
        }
        return;
    }
    [[dont_unroll]] for (uint i = 0; i < min(4u, size.x - at.x); i++) {
        ref_u32(push.distance + (element + i) * 4).v = value[i];
        if (push.triangles != 0) {
            ref_u32(push.triangles + (element + i) * 4).v = FM_GPU_NONE;
        }
    }
}

uvec4 far_distances(uvec3 grid, uvec3 at, uvec3 block) {
    if (FAR != FAR_FLOODED) {
        return uvec4(floatBitsToUint(band()));
    }
    uint triangle = near_flooded(grid, block);
    uvec4 value = uvec4(floatBitsToUint(MESH_INFINITY));
    [[dont_unroll]] for (uint i = 0; i < 4 && triangle != FM_GPU_NONE; i++) {
        value[i] = floatBitsToUint(sqrt(triangle_distance2(triangle, texel_place(vec3(at) + vec3(i, 0, 0)))));
    }
    return value;
}

void main() {
    uvec3 size = uvec3(field_size());
    uvec3 grid = near_grid();
    uvec3 tiles = (size + uvec3(31, 15, 1)) / uvec3(32, 16, 2);
    uint group = uint(folded_group(gl_WorkGroupID, gl_NumWorkGroups));  // divided in 64 bits it would take most of the time
    uvec3 tile = uvec3(group % tiles.x, group / tiles.x % tiles.y, group / tiles.x / tiles.y);
    uint lane = gl_LocalInvocationIndex;
    uvec3 at = tile * uvec3(32, 16, 2) + uvec3(lane & 7u, lane >> 3 & 3u, 0) * 4 + uvec3(0, 0, lane >> 5);
    uvec3 block = at / FM_SDF_MIDDLE;
    if (any(greaterThanEqual(at, size)) || near_bit(near_row(grid, block.y, block.z), block.x)) {
        return;
    }
    bool inside = SIGN == FM_SDF_PSEUDONORMAL && far_inside(grid, at, block);
    uint end = min(at.y + 4, size.y);
    for (; at.y < end; at.y++) {
        // Of the block, or of each texel.
        uint signs = SIGN == FM_SDF_CROSSINGS ? crossed_word(ivec3(at)) >> (at.x & 31u) : inside ? 15 : 0;
        store(at, size, far_distances(grid, at, block) | (uvec4(signs) >> uvec4(0, 1, 2, 3) & 1) << 31);
    }
}
