// SPDX-License-Identifier: MIT
#version 460
#include "octree_picture.glsl"

// One invocation owns a tile of 8 x 8 pixels: until when none of its rays meets anything. It reads nodes and at most one leaf a
// step, one after the other, and writes 8 bytes, an eighth of a byte a pixel.

layout(local_size_x = 32) in;

void main() {
    ivec2 tiles = tile_counts();
    uint64_t tile = folded_group(gl_WorkGroupID, gl_NumWorkGroups) * 32 + gl_LocalInvocationIndex;
    if (tile < uint64_t(tiles.x) * uint64_t(tiles.y)) {
        fm_octree_beam beam = fm_tile_beam(FM_VIEW, int(tile % uint64_t(tiles.x)), int(tile / uint64_t(tiles.x)));
        ref_u32x2(FM_PIC(beams) + tile * 8).v = uvec2(floatBitsToUint(beam.t), beam.reads);
    }
}
