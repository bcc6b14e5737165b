// SPDX-License-Identifier: MIT
#version 460
#include "memory.glsl"
#include "octree_shared.h"

// One invocation owns a voxel of a box of a world. Moves 4 bytes in and 4 out.

layout(local_size_x = 64) in;

layout(push_constant) uniform push_block {
    fm_octree_gather_push push;
};

void main() {
    const uint64_t index = folded_group(gl_WorkGroupID, gl_NumWorkGroups) * 64 + gl_LocalInvocationIndex;
    const uint64_t slice = uint64_t(push.width) * push.rows;
    if (index >= slice * push.slices) {
        return;
    }
    const uint64_t z = index / slice, in_slice = index % slice;
    const uint64_t at = in_slice % push.width + in_slice / push.width * push.row + z * push.slice;
    ref_u32(push.target + index * 4).v = ref_u32(push.source + at * 4).v;
}
