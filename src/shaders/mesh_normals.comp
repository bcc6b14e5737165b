// SPDX-License-Identifier: MIT
#version 460
#include "memory.glsl"
#include "mesh.glsl"
#include "sign.glsl"

// The angle-weighted normals of positions. One invocation owns a position and takes its triangles in the order of their numbers, so
// that sums round alike at every run. Reads for each of the three corners of a triangle 4 bytes of the list, 12 of its positions,
// its indices and corners from a cache; writes 16 bytes a position.

layout(local_size_x = 64) in;

layout(push_constant) uniform push_block {
    fm_normals_push push;
};

void main() {
    uint64_t index = folded_group(gl_WorkGroupID, gl_NumWorkGroups) * 64 + gl_LocalInvocationIndex;
    fm_joints j = ref_joints(push.joints).v;
    if (index >= j.position_count) {
        return;
    }
    uint begin = joint_word(j.starts, index);
    uint end = joint_word(j.starts, index + 1);
    vec3 sum = vec3(0);
    for (uint i = begin; i < end; i++) {
        uint triangle = joint_word(j.lists, i);
        [[dont_unroll]] for (uint k = 0; k < 3; k++) {
            if (joint_word(j.places, uint64_t(triangle) * 3 + k) == uint(index)) {
                sum += corner_share(push.mesh, j, triangle, k);
            }
        }
    }
    ref_u32x4(j.normals + index * 16).v = floatBitsToUint(vec4(sum, 0));
}
