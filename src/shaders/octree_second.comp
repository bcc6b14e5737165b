// SPDX-License-Identifier: MIT
#version 460
#include "octree_picture.glsl"

// One invocation owns a pixel: the rays from the place that it shows, to the sun, reflected, and through the surface. Reads 16
// bytes and writes 4 of picture, and 8 where rays are counted.

layout(local_size_x = FM_OCTREE_TILE, local_size_y = FM_OCTREE_TILE) in;

layout(constant_id = 4) const uint SHADOW = 0;
layout(constant_id = 5) const uint MIRRORS = 0;
layout(constant_id = 6) const uint CLEAR = 0;

void main() {
    ivec2 at;
    uint64_t tile;
    if (!own_pixel(at, tile)) {
        return;
    }
    uint64_t index = pixel_index(at);
    uvec4 words = ref_u32x4(FM_PIC(pixels) + index * 16).v;
    fm_octree_pixel pixel;
    pixel.t = uintBitsToFloat(words.x);
    pixel.normal = words.y;
    pixel.mark = words.z;
    pixel.reads = words.w;
    fm_octree_second second = fm_second_light(FM_VIEW, at.x, at.y, pixel, SHADOW != 0, MIRRORS != 0, CLEAR != 0);
    ref_u32(FM_PIC(picture) + index * 4).v = fm_pixel_bytes(vec3(second.color[0], second.color[1], second.color[2]));
    if (FM_PIC(seconds) != 0) {
        ref_u32x2(FM_PIC(seconds) + index * 8).v = uvec2(second.rays, second.reads);
    }
}
