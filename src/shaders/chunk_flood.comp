// SPDX-License-Identifier: MIT
#version 460
#include "memory.glsl"
#include "chunk.glsl"
#include "chunk_tile.glsl"

// A step of jump flooding of distances, as published, or two at once. An invocation owns a voxel; it reads seven distances, or 49
// (2 bytes each; mostly from caches), and writes one. The first step reads the site bits, the last may write the field.

layout(constant_id = 7) const bool FIRST = false;
layout(constant_id = 8) const bool LAST = false;
layout(constant_id = 9) const uint INITIAL = UNKNOWN;  // distance of air at first
layout(constant_id = 10) const bool PAIR = false;      // the next, half as long step as well: few voxels wait for dispatches

uint load(domain_box box, ivec3 at) {
    if (!in_box(at, box.size)) {
        return PADDED ? 0 : UNKNOWN;
    }
    if (FIRST) {
        return is_solid(box.begin + at) ? 0 : INITIAL;
    }
    return load_scratch(box, push.which, at);
}

uint flooded(domain_box box, ivec3 at, uint step) {
    uint value = load(box, at);
    if (value == 0) {
        return 0;
    }
    uint least = UNKNOWN;
    [[unroll]] for (int axis = 0; axis < 3; axis++) {
        ivec3 way = ivec3(axis == 0, axis == 1, axis == 2) * int(step);
        least = min(least, min(load(box, at - way), load(box, at + way)));
    }
    return min(value, least + step);
}

uint flooded_beyond(domain_box box, ivec3 at, uint step) {
    return in_box(at, box.size) ? flooded(box, at, step) : PADDED ? 0 : UNKNOWN;
}

uint flooded_twice(domain_box box, ivec3 at) {
    uint value = flooded(box, at, push.step);
    if (value == 0) {
        return 0;
    }
    uint half_step = push.step / 2;
    uint least = UNKNOWN;
    for (int i = 0; i < 6; i++) {
        ivec3 way = ivec3(i / 2 == 0, i / 2 == 1, i / 2 == 2) * int(half_step);
        least = min(least, flooded_beyond(box, (i & 1) == 0 ? at - way : at + way, push.step));
    }
    return min(value, least + half_step);
}

void main() {
    domain_box box;
    ivec3 at;
    if (!own_voxel(box, at)) {
        return;
    }
    uint value = PAIR ? flooded_twice(box, at) : flooded(box, at, push.step);
    if (!LAST) {
        store_scratch(box, FIRST ? push.which : 1 - push.which, at, value);
    } else if (value > 0 && in_box(at - box.result_begin, box.result_size)) {
        store_field(box.begin + at, value);
    }
}
