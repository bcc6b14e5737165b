// SPDX-License-Identifier: MIT
#version 460
#include "memory.glsl"
#include "column.glsl"

// The oracle: one invocation owns one voxel and tries every site of the grid in the order of their indices.

layout(local_size_x = 64) in;

void main() {
    uint tiles = (push.x + 63) / 64;
    uint64_t group = folded_group(gl_WorkGroupID, gl_NumWorkGroups);
    uint x = uint(group % tiles) * 64 + gl_LocalInvocationID.x;
    uint64_t row = group / tiles;
    if (row >= uint64_t(push.y) * push.z || x >= push.x) {
        return;
    }
    uvec3 at = uvec3(x, uint(row % push.y), uint(row / push.y));
    cost_t best = COST_NONE;
    uvec3 nearest = uvec3(0);
    for (uint z = 0; z < push.z; z++) {
        cost_t along_z = steps_cost(uint(abs(int(at.z) - int(z))), push.weight_z);
        for (uint y = 0; y < push.y; y++) {
            cost_t along_y = steps_cost(uint(abs(int(at.y) - int(y))), push.weight_y);
            uint64_t words = (uint64_t(z) * push.y + y) * push.row_words;
            for (uint w = 0; w < push.row_words; w++) {
                uint word = ref_u32(push.bits + (words + w) * 4).v;
                while (word != 0) {
                    uint site = w * 32 + uint(findLSB(word));
                    word &= word - 1;
                    cost_t along_x = steps_cost(uint(abs(int(at.x) - int(site))), push.weight_x);
                    cost_t value = add_cost(add_cost(along_x, along_y), along_z);
                    if (value < best) {
                        best = value;
                        nearest = uvec3(site, y, z);
                    }
                }
            }
        }
    }
    finish_voxel(at, row * push.x + x, best, nearest);
}
