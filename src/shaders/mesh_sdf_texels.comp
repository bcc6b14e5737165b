// SPDX-License-Identifier: MIT
#version 460
#include "memory.glsl"
#include "sdf.glsl"

// The texels of listed blocks of 4^3: exact distances with their sign. A group owns a block, an invocation a texel. Writes 4 bytes
// a texel, and 4 for its triangle; reads 16 bytes a block and what the walk visits.

layout(local_size_x = 64) in;

void do_texel(ivec3 at, block_state block) {
    vec3 p = texel_place(vec3(at));
    float limit = FAR == FAR_BAND ? band() * 1.00001 : MESH_INFINITY;
    store_texel(at, bvh_nearest_below(push.mesh, block.node, p, limit * limit, block.triangle), winding_inside(p));
}

void main() {
    uint count = list_count(push.scratch + FM_SDF_LIST_MIDDLE);
    for (uint i = gl_WorkGroupID.x; i < count; i += gl_NumWorkGroups.x) {
        uint block = ref_u32(entries_of(false) + uint64_t(i) * 4).v;
        ivec3 first = coarse_first(block / 64) + child_first(block % 64, FM_SDF_MIDDLE);
        ivec3 at = first + child_first(gl_LocalInvocationIndex, 1);
        if (all(lessThan(at, field_size()))) {
            do_texel(at, load_state(false, block));
        }
    }
}
