// SPDX-License-Identifier: MIT
#version 460
#include "defer.glsl"

// One invocation owns a texel of a cascade: reads the 15 beside it along a row, or with DOWN along a column, of 16 bytes each, most
// of them from the cache; writes 16 bytes.

layout(constant_id = 0) const bool DOWN = false;

void main() {
    int edge = int(FM_GET(map_edge));
    ivec3 at = tile_place(edge, edge);
    if (at.x >= edge || at.y >= edge || at.z >= FM_CASCADES) {
        return;
    }
    fm_address from = DOWN ? FM_GET(blurred) : FM_GET(map), to = DOWN ? FM_GET(map) : FM_GET(blurred);
    uint64_t first = uint64_t(at.z) * uint64_t(edge) * uint64_t(edge);
    vec4 sum = vec4(0);
    float weights = 0;
    for (int off = -FM_MAP_BLUR; off <= FM_MAP_BLUR; off++) {
        ivec2 beside = clamp(at.xy + (DOWN ? ivec2(0, off) : ivec2(off, 0)), ivec2(0), ivec2(edge - 1));
        float weight = fm_blur_weight(off);
        weights += weight;
        sum += weight * ref_f32x4(from + (first + uint64_t(beside.y) * uint64_t(edge) + uint64_t(beside.x)) * 16).v;
    }
    ref_f32x4(to + (first + uint64_t(at.y) * uint64_t(edge) + uint64_t(at.x)) * 16).v = sum / weights;
}
