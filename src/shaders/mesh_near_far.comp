// SPDX-License-Identifier: MIT
#version 460
#include "memory.glsl"
#include "sdf.glsl"
#include "sdf_near.glsl"
#include "packet.glsl"

// Exact distances of the texels of blocks that are not near. A group owns a block, an invocation a texel; those of a subgroup walk
// together, and none looks farther than the triangle that was flooded to the block. Writes 4 bytes a texel, and 4 for its triangle;
// reads 64 bytes a block and what the walk visits.

layout(local_size_x = 64) in;

void main() {
    uvec3 grid = near_grid();
    uint64_t own = folded_group(gl_WorkGroupID, gl_NumWorkGroups);
    uvec3 block = uvec3(own % grid.x, own / grid.x % grid.y, own / grid.x / grid.y);
    if (block.z >= grid.z || near_bit(near_row(grid, block.y, block.z), block.x)) {
        return;
    }
    ivec3 at = ivec3(block) * FM_SDF_MIDDLE + child_first(gl_LocalInvocationIndex, 1);
    bool wanted = all(lessThan(at, field_size()));
    vec3 p = texel_place(vec3(at));
    uint hint = near_flooded(grid, block);
    mesh_nearest n = packet_nearest(push.mesh, p, wanted ? near_reach() * near_reach() : -1, packet_middle(block), hint);
    if (wanted) {
        store_texel(at, n, SIGN == FM_SDF_CROSSINGS ? crossed_inside(at) : is_inside(p, n));
    }
}
