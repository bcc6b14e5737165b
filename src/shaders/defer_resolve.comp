// SPDX-License-Identifier: MIT
#version 460
#include "defer.glsl"

// One invocation owns a pixel: reads its 32 bytes of surface and 16 of light, to blend also the light around it and 64 bytes of the
// picture before; writes 20 bytes.

void main() {
    ivec2 at;
    if (own_pixel(at)) {
        fm_defer_surface surface = ref_surface(FM_GET(surfaces) + pixel_index(at) * 32).v;
        vec3 color = fm_resolved(FM_WITH, at.x, at.y, surface);
        ref_u32(FM_GET(picture) + pixel_index(at) * 4).v = fm_pixel_bytes(color);
        ref_f32x4(FM_GET(next_history) + pixel_index(at) * 16).v = vec4(color, 0);
    }
}
