// SPDX-License-Identifier: MIT
#version 460
#include "memory.glsl"
#include "bvh.glsl"
#include "winding.glsl"

// Winding numbers at positions: one invocation owns a position and walks the tree; or, EVERY, a group owns it, sums every triangle
// and reads all records. 12 bytes in, 4 out.

layout(local_size_x = 64) in;

layout(constant_id = 0) const bool EVERY = false;

layout(push_constant) uniform push_block {
    fm_query_push push;
};

shared float sums[64];

vec3 position_at(uint64_t index) {
    fm_address at = push.questions + index * 12;
    return uintBitsToFloat(uvec3(ref_u32(at).v, ref_u32(at + 4).v, ref_u32(at + 8).v));
}

float every_triangle(vec3 p) {
    uint own = gl_LocalInvocationIndex;
    float sum = 0;
    if (!any(isnan(p)) && !any(isinf(p))) {
        for (uint i = own; i < push.mesh.triangle_count; i += 64) {
            sum += winding_of_run(bvh_records(push.mesh), i, 1, p);
        }
    }
    sums[own] = sum;
    barrier();
    for (uint half_size = 32; half_size > 0; half_size /= 2) {
        if (own < half_size) {
            sums[own] += sums[own + half_size];
        }
        barrier();
    }
    return sums[0] / FOUR_PI;
}

void main() {
    uint64_t group = folded_group(gl_WorkGroupID, gl_NumWorkGroups);
    uint64_t index = EVERY ? group : group * 64 + gl_LocalInvocationIndex;
    if (index >= push.count) {
        return;
    }
    vec3 p = position_at(index);
    float winding = EVERY ? every_triangle(p) : winding_at(push.mesh, push.moments, p, push.bound);
    if (!EVERY || gl_LocalInvocationIndex == 0) {
        ref_u32(push.answers + index * 4).v = floatBitsToUint(winding);
    }
}
