// SPDX-License-Identifier: MIT
#version 460
#include "defer.glsl"

// One invocation owns a pixel: a ray from the camera through the mesh's tree or the field. Writes 32 bytes.

layout(constant_id = 0) const uint SURFACE = 0;

void main() {
    ivec2 at;
    if (own_pixel(at)) {
        ref_surface(FM_GET(surfaces) + pixel_index(at) * 32).v = fm_surface_pixel(FM_WITH, at.x, at.y, int(SURFACE));
    }
}
