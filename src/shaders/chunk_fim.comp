// SPDX-License-Identifier: MIT
#version 460
#include "memory.glsl"
#include "chunk.glsl"
#include "chunk_tile.glsl"

// The fast iterative method, an iteration a dispatch, decided on by the host. An invocation owns a voxel. Relaxation reads a
// distance a voxel and writes those that fall: 2 bytes each in scratch memory. It is done in place, so that a distance may travel
// farther than a voxel; what it ends at is the same.

layout(constant_id = 7) const bool START = false;  // solid 0, air unknown, from the bits

uint neighbour(domain_box box, ivec3 at) {
    if (in_box(at, box.size)) {
        return SCRATCH ? load_scratch(box, push.which, at) : load_field(box.begin + at);
    }
    if (LINKED && in_box(box.begin + at, world_size())) {
        return load_field(box.begin + at);
    }
    return PADDED ? 0 : UNKNOWN;
}

void main() {
    domain_box box;
    ivec3 at;
    if (!own_voxel(box, at)) {
        return;
    }
    if (START) {
        bool solid = is_solid(box.begin + at);
        if (SCRATCH) {
            store_scratch(box, push.which, at, solid ? 0 : UNKNOWN);
        } else if (!solid) {
            store_field(box.begin + at, UNKNOWN);
        }
        return;
    }
    uint value = neighbour(box, at);
    if (value <= 1) {
        return;
    }
    uint least = UNKNOWN;
    [[unroll]] for (int axis = 0; axis < 3; axis++) {
        ivec3 one = ivec3(axis == 0, axis == 1, axis == 2);
        least = min(least, min(neighbour(box, at - one), neighbour(box, at + one)));
    }
    if (least + 1 < value) {
        if (SCRATCH) {
            store_scratch(box, push.which, at, least + 1);
        } else {
            store_field(box.begin + at, least + 1);
        }
        ref_u32(push.counted).v = 1;
    }
}
