// SPDX-License-Identifier: MIT
#version 460
#include "memory.glsl"
#include "mesh_shared.h"

// A step of jump flooding over 26 neighbours, from the voxels of a mesh to its coarse field. An invocation owns a texel: it reads
// 27 seeds of 4 bytes, most from caches (4 from memory), or in the first step 27 bits (1/8), and writes one, or in the last step
// its distance (4). Ties go to the texel's own seed, then to the neighbours in order, x fastest.

layout(constant_id = 0) const bool FIRST = false;
layout(constant_id = 1) const bool LAST = false;
layout(constant_id = 2) const bool CUBES = false;  // all weights are 1

layout(local_size_x = 32, local_size_y = 2, local_size_z = 2) in;

layout(push_constant) uniform Push {
    fm_flood_push push;
};

ivec3 shape() {
    return ivec3(push.shape[0], push.shape[1], push.shape[2]);
}

uint64_t row_of(int y, int z) {
    return uint64_t(z) * push.shape[1] + y;
}

uint load(uint64_t row, int x, int y, int z) {
    if (FIRST) {
        const bool solid = (ref_u32(push.bits + (row * push.row_words + uint(x) / 32) * 4).v >> (uint(x) & 31u) & 1u) != 0;
        return solid ? uint(x) | uint(y) << 10 | uint(z) << 20 : FM_SEED_NONE;
    }
    return ref_u32(push.source + (row * push.shape[0] + x) * 4).v;
}

const float FAR = 1.0 / 0.0;

// Of cubes in integers, which are faster here and equal: floats hold such sums exactly.
float distance2(uint seed, ivec3 at) {
    if (seed == FM_SEED_NONE) {
        return FAR;
    }
    if (CUBES) {
        const ivec3 way = at - ivec3(seed & 1023u, seed >> 10 & 1023u, seed >> 20);
        return float(way.x * way.x + way.y * way.y + way.z * way.z);
    }
    return fm_seed_distance2(seed, at.x, at.y, at.z, push.weight);
}

void main() {
    const ivec3 tiles = (shape() + ivec3(31, 1, 1)) / ivec3(32, 2, 2);
    const int group = int(folded_group(gl_WorkGroupID, gl_NumWorkGroups));
    const ivec3 tile = ivec3(group % tiles.x, group / tiles.x % tiles.y, group / tiles.x / tiles.y);
    const ivec3 at = tile * ivec3(32, 2, 2) + ivec3(gl_LocalInvocationID);
    if (any(greaterThanEqual(at, shape()))) {
        return;
    }
    const uint64_t own = row_of(at.y, at.z);
    uint seed = load(own, at.x, at.y, at.z);
    float nearest = distance2(seed, at);
    const int step = push.step;
    for (int z = at.z - step; z <= at.z + step; z += step) {
        for (int y = at.y - step; y <= at.y + step; y += step) {
            if (uint(y) >= uint(push.shape[1]) || uint(z) >= uint(push.shape[2])) {
                continue;
            }
            const uint64_t row = row_of(y, z);
            for (int x = at.x - step; x <= at.x + step; x += step) {
                const uint other = uint(x) < uint(push.shape[0]) ? load(row, x, y, z) : FM_SEED_NONE;
                const float way = distance2(other, at);
                if (way < nearest) {
                    nearest = way;
                    seed = other;
                }
            }
        }
    }
    const fm_address target = push.target + (own * push.shape[0] + at.x) * 4;
    if (LAST) {
        precise float distance = sqrt(nearest) * push.unit - push.beta;
        ref_u32(target).v = floatBitsToUint(distance);
    } else {
        ref_u32(target).v = seed;
    }
}
