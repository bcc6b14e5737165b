// SPDX-License-Identifier: MIT
#version 460
#include "octree_build.glsl"
#include "gather.glsl"

// Nearest points at the corners of listed blocks. A group owns a block of 4^3 corners, an invocation a corner; they look for
// triangles together. Writes 16 bytes a corner and the block's slot; reads 4 bytes a block and what the search visits.

// The corner of an invocation: x fastest.
uvec3 own_corner(uint i) {
    return uvec3(i & 3u, i >> 2 & 3u, i >> 4);
}

void do_block(uint slot, uvec3 block) {
    uvec3 own = own_corner(gl_LocalInvocationIndex);
    // The subgroup's corners, if invocations are numbered along it; else the block's.
    uvec2 range = min(uvec2(gl_SubgroupID, gl_SubgroupID + 1) * gl_SubgroupSize - uvec2(0, 1), uvec2(63));
    uvec3 low = own_corner(range.x);
    uvec3 high = own_corner(range.y);
    bool along = subgroupAll(all(greaterThanEqual(own, low)) && all(lessThanEqual(own, high)));
    low = along ? low : uvec3(0);
    high = along ? high : uvec3(FM_BUILD_BLOCK - 1);
    vec3 first = vec3(block * FM_BUILD_BLOCK);
    vec3 middle = first + 0.5 * vec3(low + high);
    mesh_nearest n = gather_nearest(PLAN.mesh, first + vec3(own), PLAN.reach, middle, 0.5 * vec3(high - low));
    store_corner(PLAN.corners, uint64_t(slot) * FM_BUILD_CORNERS + gl_LocalInvocationIndex, corner_of(first + vec3(own), n));
}

void main() {
    uint count = list_count(PLAN.near);
    uvec3 shape = build_bricks() + 1;
    for (uint slot = gl_WorkGroupID.x; slot < count; slot += gl_NumWorkGroups.x) {
        uint block = ref_u32(PLAN.entries + uint64_t(slot) * 4).v;
        do_block(slot, build_at(shape, block));
        if (gl_LocalInvocationIndex == 0) {
            ref_u32(PLAN.slots + uint64_t(block) * 4).v = slot;
        }
    }
}
