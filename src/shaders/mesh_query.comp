// SPDX-License-Identifier: MIT
#version 460
#include "memory.glsl"
#include "bvh.glsl"

// One invocation owns a query of a mesh's tree. Moves 12 bytes in and 20 out for a nearest point, 32 in and 20 out for a ray, and
// the nodes and records that it visits, most of them from a cache.

layout(local_size_x = 64) in;

layout(constant_id = 0) const uint QUERY = FM_QUERY_CLOSEST;

layout(push_constant) uniform push_block {
    fm_query_push push;
};

vec3 floats_at(fm_address at) {
    return uintBitsToFloat(uvec3(ref_u32(at).v, ref_u32(at + 4).v, ref_u32(at + 8).v));
}

void answer(uint64_t index, uvec4 first, uint last) {
    fm_address at = push.answers + index * 20;
    [[unroll]] for (uint i = 0; i < 4; i++) {
        ref_u32(at + i * 4).v = first[i];
    }
    ref_u32(at + 16).v = last;
}

void main() {
    uint64_t index = folded_group(gl_WorkGroupID, gl_NumWorkGroups) * 64 + gl_LocalInvocationIndex;
    if (index >= push.count) {
        return;
    }
    if (QUERY == FM_QUERY_CLOSEST) {
        vec3 p = floats_at(push.questions + index * 12);
        mesh_nearest n = bvh_nearest(push.mesh, p, push.bound * push.bound, FM_GPU_NONE);
        answer(index, floatBitsToUint(vec4(n.point, sqrt(n.distance2))), n.triangle);
    } else {
        uvec4 from = ref_u32x4(push.questions + index * 32).v;
        uvec4 to = ref_u32x4(push.questions + index * 32 + 16).v;
        mesh_hit h = bvh_cast(push.mesh, uintBitsToFloat(from.xyz), uintBitsToFloat(to.xyz), uintBitsToFloat(from.w),
                              uintBitsToFloat(to.w), QUERY == FM_QUERY_ANY);
        answer(index, uvec4(floatBitsToUint(h.t), h.triangle, floatBitsToUint(h.u), floatBitsToUint(h.v)), h.back);
    }
}
