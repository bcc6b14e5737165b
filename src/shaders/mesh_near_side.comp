// SPDX-License-Identifier: MIT
#version 460
#include "memory.glsl"
#include "sdf.glsl"
#include "sdf_near.glsl"

// What is known of a grid that no surface is near. Its first invocation asks on which side the first texel lies; where distances are
// flooded, an invocation owns a block of 16^3 texels, and asks for its first block of 4^3 where the nearest triangle is. Of any other
// grid an invocation reads 4 bytes for 128 texels along an axis.

layout(local_size_x = 64) in;

void main() {
    uvec3 grid = near_grid();
    uint64_t own = folded_group(gl_WorkGroupID, gl_NumWorkGroups) * 64 + gl_LocalInvocationIndex;
    if (own >= coarse_count() || near_from(near_slices(grid), 0, grid.z) >= 0) {
        return;
    }
    ivec3 first = coarse_first(uint(own));
    vec3 p = texel_place(vec3(first));
    mesh_nearest n = bvh_nearest_below(push.mesh, 0, p, MESH_INFINITY, FM_GPU_NONE);
    if (own == 0) {
        ref_u32(push.scratch + FM_NEAR_SIDE).v = is_inside(p, n) ? 1 : 0;
    }
    if (FAR == FAR_FLOODED) {
        near_store_cell(grid, uvec3(first) / FM_SDF_MIDDLE, near_cell(p + n.point, n.triangle));
    }
}
