// SPDX-License-Identifier: MIT
#version 460
#include "memory.glsl"
#include "chunk.glsl"
#include "chunk_tile.glsl"

// A step of jump flooding of distances, as published. An invocation owns a voxel; it reads seven distances (2 bytes each; mostly
// from caches) and writes one. The first step reads the site bits, the last may write the field.

layout(constant_id = 7) const bool FIRST = false;
layout(constant_id = 8) const bool LAST = false;
layout(constant_id = 9) const uint INITIAL = UNKNOWN;  // distance of air at first

uint load(domain_box box, ivec3 at) {
    if (!in_box(at, box.size)) {
        return PADDED ? 0 : UNKNOWN;
    }
    if (FIRST) {
        return is_solid(box.begin + at) ? 0 : INITIAL;
    }
    return load_scratch(box, push.which, at);
}

void main() {
    domain_box box;
    ivec3 at;
    if (!own_voxel(box, at)) {
        return;
    }
    uint value = load(box, at);
    if (value > 0) {
        int step = int(push.step);
        uint least = UNKNOWN;
        [[unroll]] for (int axis = 0; axis < 3; axis++) {
            ivec3 way = ivec3(axis == 0, axis == 1, axis == 2) * step;
            least = min(least, min(load(box, at - way), load(box, at + way)));
        }
        value = min(value, least + push.step);
    }
    if (!LAST) {
        store_scratch(box, FIRST ? push.which : 1 - push.which, at, value);
    } else if (value > 0 && in_box(at - box.result_begin, box.result_size)) {
        store_field(box.begin + at, value);
    }
}
