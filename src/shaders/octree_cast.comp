// SPDX-License-Identifier: MIT
#version 460
#include "octree.glsl"

// One invocation owns a ray. Moves 32 bytes in and 24 out, and the nodes and leaves that the ray goes through, many of them from a
// cache.

layout(local_size_x = 64) in;

layout(push_constant) uniform push_block {
    fm_octree_cast_push push;
};

void main() {
    uint64_t index = folded_group(gl_WorkGroupID, gl_NumWorkGroups) * 64 + gl_LocalInvocationIndex;
    if (index >= push.count) {
        return;
    }
    vec4 from = uintBitsToFloat(ref_u32x4(push.rays + index * 32).v);
    vec4 to = uintBitsToFloat(ref_u32x4(push.rays + index * 32 + 16).v);
    fm_octree_met met = fm_cast_ray(octree_head(push.head), from.xyz, to.xyz, from.w, to.w, push.epsilon);
    fm_address at = push.hits + index * 24;
    ref_u32(at).v = floatBitsToUint(met.t);
    for (uint i = 0; i < 3; i++) {
        ref_u32(at + 4 + i * 4).v = floatBitsToUint(met.normal[i]);
    }
    ref_u32(at + 16).v = met.mark;
    ref_u32(at + 20).v = met.reads;
}
