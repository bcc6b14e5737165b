// SPDX-License-Identifier: MIT
#version 460
#include "memory.glsl"
#include "mesh_shared.h"

// Triangles to voxels. An invocation owns a triangle: it reads 12 bytes of indices and 36 of corners, which neighbours share (12
// bytes a vertex from memory), and sets the voxels itself when there are few to try, each by one access of its word or byte. Larger
// triangles are listed for voxelize_large.comp, 4 bytes each. SOLID: the rows that it crosses, 4 bytes read and written a crossing.

layout(local_size_x = 64) in;

layout(push_constant) uniform Push {
    fm_voxelize_push push;
};

#include "triangle_lists.glsl"
#include "voxelize.glsl"

// The most columns that the triangle's box has, seen along an axis.
uint64_t most_columns(ivec3 size) {
    return max(uint64_t(size.x) * size.y, max(uint64_t(size.x) * size.z, uint64_t(size.y) * size.z));
}

void main() {
    const uint64_t own = folded_group(gl_WorkGroupID, gl_NumWorkGroups) * gl_WorkGroupSize.x + gl_LocalInvocationIndex;
    fm_voxel_triangle t;
    if (own >= push.mesh.triangle_count || !voxel_load(uint(own), t)) {
        return;
    }
    if (SOLID) {
        const voxel_columns rows = voxel_rows(t);
        const uint64_t count = voxel_count(rows);
        if (count > FM_VOXELIZE_SMALL) {
            list_triangle(push.lists, push.mesh.triangle_count, uint(own), count > FM_VOXELIZE_GROUP_COLUMNS);
            return;
        }
        t = fm_voxel_axes(t);
        for (int i = 0; i < int(count); i++) {
            voxel_cross(t, rows.begin.x + i % rows.size.x, rows.begin.y + i / rows.size.x);
        }
        return;
    }
    const ivec3 begin = ivec3(t.begin[0], t.begin[1], t.begin[2]);
    const ivec3 size = ivec3(t.end[0], t.end[1], t.end[2]) - begin;
    const uint64_t columns = most_columns(size);
    if (size.x == 0 || size.y == 0 || size.z == 0) {
        return;
    }
    if (columns > FM_VOXELIZE_SMALL || uint64_t(size.x) * size.y * size.z > FM_VOXELIZE_SMALL) {
        list_triangle(push.lists, push.mesh.triangle_count, uint(own), columns > FM_VOXELIZE_GROUP_COLUMNS);
        return;
    }
    t = fm_voxel_axes(t);
    for (int i = 0; i < size.x * size.y * size.z; i++) {
        const ivec3 at = begin + ivec3(i % size.x, i / size.x % size.y, i / size.x / size.y);
        if (fm_voxel_sets(t, THIN, at.x, at.y, at.z)) {
            voxel_set(at.x, at.y, at.z);
        }
    }
}
