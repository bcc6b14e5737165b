// SPDX-License-Identifier: MIT
#version 460
#include "defer.glsl"

// One invocation owns a texel of a cascade: a ray along the light through the mesh's tree. Writes 16 bytes.

void main() {
    int edge = int(FM_GET(map_edge));
    ivec3 at = tile_place(edge, edge);
    if (at.x < edge && at.y < edge && at.z < FM_CASCADES) {
        float depth = fm_map_depth(FM_WITH, at.z, at.x, at.y);
        float up = fm_warp_up(depth), low = fm_warp_down(depth);
        uint64_t texel = (uint64_t(at.z) * uint64_t(edge) + uint64_t(at.y)) * uint64_t(edge) + uint64_t(at.x);
        ref_f32x4(FM_GET(map) + texel * 16).v = vec4(up, up * up, low, low * low);
    }
}
