// SPDX-License-Identifier: MIT
#version 460
#include "memory.glsl"
#include "compose_rule.h"

// Texels of blocks of a scene's field: the least of what the local fields of the objects near the block say. A group owns a block,
// an invocation a texel. Writes 4 bytes a texel, reads 4 a block of a list, 96 an object and block, mostly from caches, and for
// each object that reaches a texel eight of its texels, which neighbours share.

layout(local_size_x = FM_COMPOSE_TEXELS) in;

layout(push_constant) uniform push_block {
    fm_compose_push push;
};

layout(buffer_reference, std430, buffer_reference_align = 8) readonly buffer ref_object {
    fm_compose_object v;
};

shared uint near[FM_COMPOSE_TEXELS];
shared uint near_count;

ref_object object_at(uint i) {
    return ref_object(push.objects + uint64_t(i) * 96);
}

bool reaches(uint i, ivec3 first) {
    const int begin[3] = object_at(i).v.begin;
    const int end[3] = object_at(i).v.end;
    return all(lessThan(ivec3(begin[0], begin[1], begin[2]), first + ivec3(FM_COMPOSE_X, FM_COMPOSE_Y, FM_COMPOSE_Z))) &&
           all(greaterThan(ivec3(end[0], end[1], end[2]), first));
}

float value_at(uint i, ivec3 at) {
    const fm_compose_object object = object_at(i).v;
    const fm_compose_cell cell = fm_compose_find(object, at.x, at.y, at.z);
    if (cell.inside == 0) {
        return push.band;
    }
    const uint64_t row = object.shape[0];
    const uint64_t slice = row * object.shape[1];
    const uint64_t texel = uint64_t(cell.first[2]) * slice + uint64_t(cell.first[1]) * row + cell.first[0];
    float corner[8];
    [[unroll]] for (uint c = 0; c < 8; c++) {
        corner[c] = uintBitsToFloat(ref_u32(object.field + (texel + (c & 1u) + (c >> 1 & 1u) * row + (c >> 2) * slice) * 4).v);
    }
    return fm_compose_between(corner, cell.weight);
}

void main() {
    const uint64_t group = folded_group(gl_WorkGroupID, gl_NumWorkGroups);
    if (group >= push.block_count) {
        return;
    }
    const ivec3 shape = ivec3(push.shape[0], push.shape[1], push.shape[2]);
    const ivec3 edge = ivec3(FM_COMPOSE_X, FM_COMPOSE_Y, FM_COMPOSE_Z);
    const uvec3 blocks = uvec3((shape + edge - 1) / edge);
    const uint block = push.blocks == 0 ? uint(group) : ref_u32(push.blocks + group * 4).v;
    const ivec3 first = ivec3(block % blocks.x, block / blocks.x % blocks.y, block / blocks.x / blocks.y) * edge;
    const int lane = int(gl_LocalInvocationIndex);
    const ivec3 at = first + ivec3(lane % FM_COMPOSE_X, lane / FM_COMPOSE_X % FM_COMPOSE_Y, lane / (FM_COMPOSE_X * FM_COMPOSE_Y));
    const bool within = all(lessThan(at, shape));
    float least = push.band;
    for (uint begin = 0; begin < push.object_count; begin += FM_COMPOSE_TEXELS) {
        if (lane == 0) {
            near_count = 0;
        }
        barrier();
        const uint mine = begin + lane;
        if (mine < push.object_count && reaches(mine, first)) {
            near[atomicAdd(near_count, 1u)] = mine;
        }
        barrier();
        for (uint i = 0; within && i < near_count; i++) {
            const float value = value_at(near[i], at);
            least = FM_LESSER(least, value);
        }
        barrier();
    }
    if (within) {
        const uint64_t texel = (uint64_t(at.z) * shape.y + at.y) * shape.x + at.x;
        ref_u32(push.field + texel * 4).v = floatBitsToUint(FM_GREATER(least, -push.band));
    }
}
