// SPDX-License-Identifier: MIT
#version 460
#include "memory.glsl"
#include "mesh_shared.h"

// Blocks of 4^3 texels near a mesh. An invocation owns a triangle: it reads 12 bytes of indices and 36 of corners, which neighbours
// share (12 bytes a vertex from memory), and sets the bits of the blocks that it is near to when there are few to try, those of a
// row by one access of its word. Larger triangles are listed for mesh_near_large.comp, 4 bytes each.

layout(local_size_x = 64) in;

layout(push_constant) uniform Push {
    fm_near_push push;
};

#include "near.glsl"

void set_row(near_triangle n, int y, int z) {
    uint word = uint(n.begin.x) / 32;
    uint bits = 0;
    for (int x = n.begin.x; x < n.end.x; x++) {
        if (uint(x) / 32 != word) {
            near_set(y, z, word, bits);
            word++;
            bits = 0;
        }
        bits |= near_meets(n, ivec3(x, y, z)) ? 1u << (uint(x) & 31u) : 0;
    }
    near_set(y, z, word, bits);
}

void main() {
    uint64_t own = folded_group(gl_WorkGroupID, gl_NumWorkGroups) * gl_WorkGroupSize.x + gl_LocalInvocationIndex;
    near_triangle n;
    if (own >= push.mesh.triangle_count || !near_load(uint(own), n)) {
        return;
    }
    ivec3 size = n.end - n.begin;
    uint64_t columns = max(uint64_t(size.x) * size.y, max(uint64_t(size.x) * size.z, uint64_t(size.y) * size.z));
    if (columns > FM_NEAR_SMALL || uint64_t(size.x) * size.y * size.z > FM_NEAR_SMALL) {
        list_triangle(push.lists, push.mesh.triangle_count, uint(own), columns > FM_NEAR_GROUP_COLUMNS);
        return;
    }
    near_plane(n);
    for (int i = 0; i < size.y * size.z; i++) {
        set_row(n, n.begin.y + i % size.y, n.begin.z + i / size.y);
    }
}
