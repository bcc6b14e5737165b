// SPDX-License-Identifier: MIT
#version 460
#include "memory.glsl"
#include "mesh_shared.h"

// A step of jump flooding over 26 neighbours, from the voxels of a mesh to its coarse field. An invocation owns a texel: it reads
// 27 seeds of 4 bytes, most from caches (4 from memory), or in the first step 27 bits (1/8), and writes one, or in the last step
// its distance (4). Ties go to the texel's own seed, then to the neighbours in order, x fastest.

layout(constant_id = 0) const bool FIRST = false;
layout(constant_id = 1) const bool LAST = false;

layout(local_size_x = 32, local_size_y = 2, local_size_z = 2) in;

layout(push_constant) uniform Push {
    fm_flood_push push;
};

ivec3 shape() {
    return ivec3(push.shape[0], push.shape[1], push.shape[2]);
}

uint64_t texel(ivec3 at) {
    return (uint64_t(at.z) * push.shape[1] + at.y) * push.shape[0] + at.x;
}

uint load(ivec3 at) {
    if (any(lessThan(at, ivec3(0))) || any(greaterThanEqual(at, shape()))) {
        return FM_SEED_NONE;
    }
    if (FIRST) {
        const uint64_t word = (uint64_t(at.z) * push.shape[1] + at.y) * push.row_words + uint(at.x) / 32;
        const bool solid = (ref_u32(push.bits + word * 4).v >> (uint(at.x) & 31u) & 1u) != 0;
        return solid ? uint(at.x) | uint(at.y) << 10 | uint(at.z) << 20 : FM_SEED_NONE;
    }
    return ref_u32(push.source + texel(at) * 4).v;
}

const float FAR = 1.0 / 0.0;

float distance2(uint seed, ivec3 at) {
    return seed == FM_SEED_NONE ? FAR : fm_seed_distance2(seed, at.x, at.y, at.z, push.weight);
}

void main() {
    const ivec3 tiles = (shape() + ivec3(31, 1, 1)) / ivec3(32, 2, 2);
    const uint64_t group = folded_group(gl_WorkGroupID, gl_NumWorkGroups);
    const ivec3 tile = ivec3(int(group % tiles.x), int(group / tiles.x % tiles.y), int(group / tiles.x / tiles.y));
    const ivec3 at = tile * ivec3(32, 2, 2) + ivec3(gl_LocalInvocationID);
    if (any(greaterThanEqual(at, shape()))) {
        return;
    }
    uint seed = load(at);
    float nearest = distance2(seed, at);
    const int step = push.step;
    for (int z = -step; z <= step; z += step) {
        for (int y = -step; y <= step; y += step) {
            for (int x = -step; x <= step; x += step) {
                const uint other = load(at + ivec3(x, y, z));
                const float way = distance2(other, at);
                if (way < nearest) {
                    nearest = way;
                    seed = other;
                }
            }
        }
    }
    if (LAST) {
        precise float distance = sqrt(nearest) * push.unit - push.beta;
        ref_u32(push.target + texel(at) * 4).v = floatBitsToUint(distance);
    } else {
        ref_u32(push.target + texel(at) * 4).v = seed;
    }
}
