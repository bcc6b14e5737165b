// SPDX-License-Identifier: MIT
#version 460
#include "memory.glsl"
#include "mesh_shared.h"

// A step of jump flooding over blocks: each takes, of the points that it and its 26 neighbours at a distance know, the one nearest
// to its middle. An invocation owns a block. Reads 16 bytes for each of 27 blocks, most of them from the cache, and writes 16.
// Source: Rong and Tan 2006, "Jump flooding in GPU with applications to Voronoi diagram and distance transform".

layout(local_size_x = 64) in;

layout(push_constant) uniform push_block {
    fm_near_flood_push push;
};

uvec4 load(ivec3 at) {
    uint64_t number = (uint64_t(at.z) * push.shape[1] + at.y) * push.shape[0] + at.x;
    return ref_u32x4(push.source + number * FM_NEAR_CELL_BYTES).v;
}

void keep(uvec4 cell, vec3 p, inout uvec4 best, inout float best2) {
    vec3 away = uintBitsToFloat(cell.xyz) - p;
    float distance2 = dot(away, away);
    if (cell.w != FM_GPU_NONE && (distance2 < best2 || (distance2 == best2 && cell.w < best.w))) {
        best = cell;
        best2 = distance2;
    }
}

void main() {
    ivec3 shape = ivec3(push.shape[0], push.shape[1], push.shape[2]);
    uint64_t own = folded_group(gl_WorkGroupID, gl_NumWorkGroups) * 64 + gl_LocalInvocationIndex;
    if (own >= uint64_t(shape.x) * shape.y * shape.z) {
        return;
    }
    int cell = int(own);
    ivec3 at = ivec3(cell % shape.x, cell / shape.x % shape.y, cell / shape.x / shape.y);
    vec3 p = vec3(push.origin[0], push.origin[1], push.origin[2]) +
             vec3(at) * vec3(push.spacing[0], push.spacing[1], push.spacing[2]);
    uvec4 best = uvec4(0, 0, 0, FM_GPU_NONE);
    float best2 = 3e38;
    ivec3 low = max(at - push.step, at % push.step);
    [[dont_unroll]] for (int z = low.z; z <= min(at.z + push.step, shape.z - 1); z += push.step) {
        [[dont_unroll]] for (int y = low.y; y <= min(at.y + push.step, shape.y - 1); y += push.step) {
            [[unroll]] for (int i = -1; i <= 1; i++) {
                int x = at.x + i * push.step;
                if (x >= 0 && x < shape.x) {
                    keep(load(ivec3(x, y, z)), p, best, best2);
                }
            }
        }
    }
    ref_u32x4(push.target + own * FM_NEAR_CELL_BYTES).v = best;
}
