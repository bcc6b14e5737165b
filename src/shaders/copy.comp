// SPDX-License-Identifier: MIT
#version 460
#include "memory.glsl"
#include "shared.h"

// One invocation owns four pieces of 16 bytes, a work group's width apart. A pass moves two bytes a byte. Drivers may give buffer
// copies to an engine that is slower than the memory; this runs where the kernels run.

layout(local_size_x = 256) in;

layout(push_constant) uniform push_block {
    fm_copy_push push;
};

void main() {
    uint64_t first = folded_group(gl_WorkGroupID, gl_NumWorkGroups) * 1024 + gl_LocalInvocationIndex;
    uvec4 v[4];
    [[unroll]] for (uint i = 0; i < 4; i++) {
        v[i] = ref_u32x4(push.source + min(first + i * 256, push.pieces - 1) * 16).v;
    }
    [[unroll]] for (uint i = 0; i < 4; i++) {
        if (first + i * 256 < push.pieces) {
            ref_u32x4(push.target + (first + i * 256) * 16).v = v[i];
        }
    }
}
