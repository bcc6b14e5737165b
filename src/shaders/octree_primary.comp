// SPDX-License-Identifier: MIT
#version 460
#include "octree_picture.glsl"

// One invocation owns a pixel: a ray from the camera, from where its tile's beam ends on. Writes 16 bytes of what it met, and where
// no second rays follow 4 bytes of picture.

layout(local_size_x = FM_OCTREE_TILE, local_size_y = FM_OCTREE_TILE) in;

layout(constant_id = 4) const uint VIEW = FM_GPU_OCTREE_SHADED;
layout(constant_id = 5) const uint BEAMS = 0;
layout(constant_id = 6) const uint SECOND = 0;

void main() {
    ivec2 at;
    uint64_t tile;
    if (!own_pixel(at, tile)) {
        return;
    }
    float first = BEAMS != 0 ? uintBitsToFloat(ref_u32(FM_PIC(beams) + tile * 8).v) : 0.0;
    fm_octree_met met = fm_first_ray(FM_VIEW, at.x, at.y, first);
    fm_octree_pixel pixel = fm_pixel_of(met);
    ref_u32x4(FM_PIC(pixels) + pixel_index(at) * 16).v = uvec4(floatBitsToUint(pixel.t), pixel.normal, pixel.mark, pixel.reads);
    if (SECOND == 0) {
        ref_u32(FM_PIC(picture) + pixel_index(at) * 4).v = fm_pixel_bytes(fm_first_light(FM_VIEW, at.x, at.y, met, int(VIEW)));
    }
}
