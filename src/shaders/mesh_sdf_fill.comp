// SPDX-License-Identifier: MIT
#version 460
#include "memory.glsl"
#include "sdf.glsl"

// The texels of blocks that were not listed: the band's width with the block's sign or, flooded, the distance of the triangle that
// is nearest to the block's centre. A group owns 256 texels of a row, an invocation 4 of them, which lie in one block of 4^3.
// Writes 4 bytes a texel, and 4 for its triangle; reads 16 bytes for a block of 16^3 or 4^3 and row.

layout(local_size_x = 64) in;

float far_distance(ivec3 at, block_state s) {
    if (FAR != FAR_FLOODED) {
        return band();
    }
    if (s.triangle == FM_GPU_NONE) {
        return MESH_INFINITY;
    }
    return sqrt(triangle_distance2(s.triangle, texel_place(vec3(at))));
}

void main() {
    ivec3 size = field_size();
    uint pieces = (uint(size.x) + 255) / 256;
    uint64_t group = folded_group(gl_WorkGroupID, gl_NumWorkGroups);
    uint row = uint(group / pieces);
    ivec3 at = ivec3(uint(group % pieces) * 256 + gl_LocalInvocationIndex * 4, row % uint(size.y), row / uint(size.y));
    if (at.x >= size.x || at.z >= size.z) {
        return;
    }
    uvec3 block = uvec3(at) / FM_SDF_COARSE;
    uvec3 blocks = coarse_blocks();
    uint64_t number = (uint64_t(block.z) * blocks.y + block.y) * blocks.x + block.x;
    block_state s = load_state(true, number);
    if ((s.flags & BLOCK_NEAR) != 0) {
        uvec3 child = uvec3(at) % FM_SDF_COARSE / FM_SDF_MIDDLE;
        s = load_state(false, number * 64 + child.z * 16 + child.y * 4 + child.x);
    }
    if ((s.flags & BLOCK_NEAR) != 0) {
        return;
    }
    uint64_t element = (uint64_t(at.z) * size.y + at.y) * size.x + at.x;
    uvec4 value;
    [[dont_unroll]] for (uint i = 0; i < 4; i++) {
        float away = far_distance(at + ivec3(i, 0, 0), s);
        value[i] = floatBitsToUint((s.flags & BLOCK_INSIDE) != 0 ? -away : away);
    }
    if (size.x % 4 == 0) {
        ref_u32x4(push.distance + element * 4).v = value;
        if (push.triangles != 0) {
            ref_u32x4(push.triangles + element * 4).v = uvec4(FM_GPU_NONE);
        }
        return;
    }
    [[dont_unroll]] for (uint i = 0; i < min(4u, uint(size.x - at.x)); i++) {
        ref_u32(push.distance + (element + i) * 4).v = value[i];
        if (push.triangles != 0) {
            ref_u32(push.triangles + (element + i) * 4).v = FM_GPU_NONE;
        }
    }
}
