// SPDX-License-Identifier: MIT
#version 460
#include "memory.glsl"
#include "mesh_shared.h"

// Moves the vertices of objects. A group owns a run of an object's vertices, an invocation a vertex. Reads 12 bytes and writes 12 a
// vertex, beside 64 bytes a run. Each operation is rounded as on the CPU.

layout(local_size_x = FM_SCENE_RUN) in;

layout(push_constant) uniform push_block {
    fm_scene_push push;
};

float float_at(fm_address at) {
    return uintBitsToFloat(ref_u32(at).v);
}

void main() {
    uint64_t group = folded_group(gl_WorkGroupID, gl_NumWorkGroups);
    if (group >= push.run_count) {
        return;
    }
    uvec4 run = ref_u32x4(push.runs + group * 16).v;  // an fm_gpu_run
    if (gl_LocalInvocationIndex >= run.y) {
        return;
    }
    fm_address from = push.rest + (uint64_t(run.x) + gl_LocalInvocationIndex) * 12;
    fm_address to = push.vertices + (uint64_t(run.x) + gl_LocalInvocationIndex) * 12;
    vec3 p = vec3(float_at(from), float_at(from + 4), float_at(from + 8));
    fm_address place = push.places + uint64_t(run.z) * 48;
    // What unrolls a loop may lose that its operations are precise.
    [[dont_unroll]] for (uint row = 0; row < 3; row++) {
        vec4 m = uintBitsToFloat(ref_u32x4(place + row * 16).v);
        precise float moved = m.x * p.x + m.y * p.y + m.z * p.z + m.w;
        ref_u32(to + row * 4).v = floatBitsToUint(moved);
    }
}
