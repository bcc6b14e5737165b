// SPDX-License-Identifier: MIT
#version 460
#include "memory.glsl"
#include "chunk.glsl"
#include "chunk_tile.glsl"

// Distances from scratch memory into the field. An invocation owns a voxel: 2 bytes in, an entry of the field out.

void main() {
    domain_box box;
    ivec3 at;
    if (!own_voxel(box, at) || !in_box(at - box.result_begin, box.result_size)) {
        return;
    }
    uint value = load_scratch(box, push.which, at);
    if (value > 0) {
        store_field(box.begin + at, value);
    }
}
