// SPDX-License-Identifier: MIT
#version 460
#include "memory.glsl"
#include "mesh_shared.h"

// The triangles that mesh_near.comp listed. A group owns a triangle, or a part of one with many columns; an invocation owns columns
// of blocks along the axis that the triangle faces most, so that of a column only the blocks near the plane are tried. It reads 4
// bytes of list and 48 of the triangle, and accesses the word of each block that is near.

layout(constant_id = 0) const bool HUGE = false;

layout(local_size_x = 64) in;

layout(push_constant) uniform Push {
    fm_near_push push;
};

#include "near.glsl"

ivec3 axes_of(vec3 normal) {
    vec3 faces = abs(normal);
    return faces.x >= faces.y && faces.x >= faces.z ? ivec3(0, 1, 2) : faces.y >= faces.z ? ivec3(1, 2, 0) : ivec3(2, 0, 1);
}

// The blocks of a column whose middles the plane may be near to: more rather than fewer.
ivec2 depth_range(near_triangle n, ivec3 axes, vec2 column) {
    int d = axes.x;
    vec2 at = column + 0.5 - vec2(n.first[axes.y], n.first[axes.z]);
    float centre = n.first[d] - (n.normal[axes.y] * at.x + n.normal[axes.z] * at.y) / n.normal[d];
    float range = n.room / abs(n.normal[d]) * 1.0001 + 1.0;
    if (!(abs(n.normal[d]) > 0) || !(range < 1e6) || !(abs(centre) < 1e6)) {
        return ivec2(n.begin[d], n.end[d]);
    }
    return ivec2(clamp(vec2(floor(centre - range), ceil(centre + range)), vec2(n.begin[d]), vec2(n.end[d])));
}

void set_columns(near_triangle n, uint first, uint step) {
    ivec3 axes = axes_of(n.normal);
    uvec2 size = uvec2(n.end[axes.y] - n.begin[axes.y], n.end[axes.z] - n.begin[axes.z]);
    for (uint64_t i = first; i < uint64_t(size.x) * size.y; i += step) {
        ivec2 column = ivec2(n.begin[axes.y] + int(i % size.x), n.begin[axes.z] + int(i / size.x));
        ivec2 range = depth_range(n, axes, vec2(column));
        for (int along = range.x; along < range.y; along++) {
            ivec3 at;
            at[axes.x] = along;
            at[axes.y] = column.x;
            at[axes.z] = column.y;
            if (near_meets(n, at) && near_meets_edges(n, at)) {
                near_set(at.y, at.z, uint(at.x) / 32, 1u << (uint(at.x) & 31u));
            }
        }
    }
}

void main() {
    uint parts = HUGE ? FM_VOXELIZE_PARTS : 1;
    uint part = gl_WorkGroupID.x % parts;
    uint count = listed_triangles(push.lists, HUGE);
    for (uint i = gl_WorkGroupID.x / parts; i < count; i += gl_NumWorkGroups.x / parts) {
        near_triangle n;
        near_load(listed_triangle(push.lists, push.mesh.triangle_count, i, HUGE), n);
        near_plane(n);
        n.t = fm_voxel_axes(n.t);
        set_columns(n, part * gl_WorkGroupSize.x + gl_LocalInvocationIndex, parts * gl_WorkGroupSize.x);
    }
}
