// SPDX-License-Identifier: MIT
#version 460
#include "memory.glsl"
#include "sdf.glsl"
#include "sdf_near.glsl"

// What near blocks do not tell. An invocation owns a block of 16^3 texels, and has mostly nothing to do but to read 4 bytes for 128
// texels along an axis.
//
// Where no surface is near the grid, the first invocation asks on which side a texel lies. Where triangles are flooded, one outside
// the grid, which marks no block, may be the nearest: if all lie outside, every invocation asks for the triangle nearest to its
// first block of 4^3, and if some do, those at the grid's faces.

layout(local_size_x = 64) in;

bool mesh_sticks_out() {
    bvh_node root = bvh_load(push.mesh, 0);
    return any(lessThan(min(root.low0, root.low1), texel_place(vec3(0)))) ||
           any(greaterThan(max(root.high0, root.high1), texel_place(vec3(field_size() - 1))));
}

void main() {
    uvec3 grid = near_grid();
    uint64_t own = folded_group(gl_WorkGroupID, gl_NumWorkGroups) * 64 + gl_LocalInvocationIndex;
    if (own >= coarse_count()) {
        return;
    }
    bool none = near_from(near_slices(grid), 0, grid.z) < 0;
    uvec3 coarse = uvec3(coarse_first(uint(own))) / FM_SDF_COARSE;
    bvec3 last = equal(coarse, coarse_blocks() - 1);
    bool at_face = FAR != FAR_BAND && (any(last) || any(equal(coarse, uvec3(0))));
    if (!none && !(at_face && mesh_sticks_out())) {
        return;
    }
    // At a far face the block that touches it.
    uvec3 block = mix(coarse * (FM_SDF_COARSE / FM_SDF_MIDDLE), grid - 1, last);
    if (near_bit(near_row(grid, block.y, block.z), block.x)) {
        return;
    }
    vec3 p = texel_place(vec3(block * FM_SDF_MIDDLE));
    mesh_nearest n = bvh_nearest_below(push.mesh, 0, p, MESH_INFINITY, FM_GPU_NONE);
    if (own == 0) {
        ref_u32(push.scratch + FM_NEAR_SIDE).v = is_inside(p, n) ? 1 : 0;
    }
    if (FAR != FAR_BAND) {
        near_store_cell(grid, block, near_cell(p + n.point, n.triangle));
    }
}
