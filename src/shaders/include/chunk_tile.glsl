// SPDX-License-Identifier: MIT
// Kernels of which an invocation owns a voxel of a domain, a group a tile of them. Expects chunk.glsl.

layout(constant_id = 5) const uint TILE_X = 32;  // their product is THREADS
layout(constant_id = 6) const uint TILE_Y = 4;

// The domain of this invocation's voxel and its place within; false where there is none.
bool own_voxel(out domain_box box, out ivec3 at) {
    uint index, group;
    if (!own_domain(box, index, group)) {
        return false;
    }
    uint lane = gl_LocalInvocationID.x;
    uvec3 within = uvec3(lane % TILE_X, lane / TILE_X % TILE_Y, lane / (TILE_X * TILE_Y));
    at = tile_of(group) * ivec3(TILE_X, TILE_Y, THREADS / (TILE_X * TILE_Y)) + ivec3(within);
    return in_box(at, box.size);
}
