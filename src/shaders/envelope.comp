// SPDX-License-Identifier: MIT
#version 460
#include "memory.glsl"
#include "column.glsl"

// The transform's columns by their lower envelope: see envelope.glsl. A pass moves 4 bytes either way a voxel.

layout(local_size_x_id = 0, local_size_y_id = 1) in;

const uint ROWS = 16;
const uint LANES = gl_WorkGroupSize.x;
const uint SEGMENTS = gl_WorkGroupSize.y;

#include "envelope.glsl"

void main() {
    uint slice, x;
    if (tile_of(gl_WorkGroupID, gl_NumWorkGroups, LANES, x, slice)) {
        envelope_tile(slice, x);
    }
}
