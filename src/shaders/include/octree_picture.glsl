// SPDX-License-Identifier: MIT
// What the kernels of an octree's picture share: its constants, and which pixel an invocation owns. Work groups are tiles of 8 x 8.

#include "octree.glsl"
#include "octree_picture_shared.h"

layout(constant_id = 3) const uint STREAMED = 0;

layout(buffer_reference, std430, buffer_reference_align = 8) buffer ref_scene {
    fm_octree_scene v;
};
layout(buffer_reference, std430, buffer_reference_align = 16) buffer ref_part {
    fm_octree_part v;
};

layout(push_constant, std430) uniform push_block {
    fm_octree_picture_push push;
};

#include "octree_pixel_rule.h"

ivec2 tile_counts() {
    return (ivec2(FM_PIC(width), FM_PIC(height)) + (FM_OCTREE_TILE - 1)) / FM_OCTREE_TILE;
}

// Whether this invocation of a tile has a pixel.
bool own_pixel(out ivec2 at, out uint64_t tile) {
    ivec2 tiles = tile_counts();
    tile = folded_group(gl_WorkGroupID, gl_NumWorkGroups);
    uint64_t row = tile / uint64_t(tiles.x);
    at = ivec2(int(tile % uint64_t(tiles.x)), int(row)) * FM_OCTREE_TILE + ivec2(gl_LocalInvocationID.xy);
    return row < uint64_t(tiles.y) && at.x < FM_PIC(width) && at.y < FM_PIC(height);
}

uint64_t pixel_index(ivec2 at) {
    return uint64_t(at.y) * uint64_t(FM_PIC(width)) + uint64_t(at.x);
}
