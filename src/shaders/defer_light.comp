// SPDX-License-Identifier: MIT
#version 460
#include "defer.glsl"

// One invocation owns a pixel: reads its 32 bytes of surface, then what its shadows need of the field, the mesh or the shadow map.
// Writes 16 bytes.

layout(constant_id = 0) const uint SHADOWS = 0;
layout(constant_id = 1) const uint VIEW = 0;

void main() {
    ivec2 at;
    if (own_pixel(at)) {
        fm_defer_surface surface = ref_surface(FM_GET(surfaces) + pixel_index(at) * 32).v;
        fm_lit lit = fm_light_pixel(FM_WITH, at.x, at.y, surface, int(SHADOWS), int(VIEW));
        ref_f32x4(FM_GET(light) + pixel_index(at) * 16).v = vec4(lit.color[0], lit.color[1], lit.color[2], lit.share);
    }
}
