// SPDX-License-Identifier: MIT
#version 460
#include "memory.glsl"
#include "sdf.glsl"
#include "sdf_near.glsl"

// On which side a grid lies that no surface is near: one invocation asks for its first texel. Otherwise it reads 4 bytes for 128
// texels along an axis.

layout(local_size_x = 1) in;

void main() {
    uvec3 grid = near_grid();
    if (near_from(near_slices(grid), 0, grid.z) >= 0) {
        return;
    }
    vec3 p = texel_place(vec3(0));
    mesh_nearest n = bvh_nearest_below(push.mesh, 0, p, MESH_INFINITY, FM_GPU_NONE);
    ref_u32(push.scratch + FM_NEAR_SIDE).v = is_inside(p, n) ? 1 : 0;
}
