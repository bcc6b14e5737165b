// SPDX-License-Identifier: MIT
#version 460
#include "memory.glsl"
#include "mesh_shared.h"

// The triangles that voxelize.comp listed. A group owns a triangle, or a part of one whose columns would keep a group busy; an
// invocation owns columns of voxels along the axis that the triangle faces most, so that of a column only the few voxels near
// the plane are tried. It reads 4 bytes of list and 48 of the triangle, and accesses each voxel that is set once. SOLID: columns
// are rows, of which the crossing is counted.

layout(constant_id = 3) const bool HUGE = false;

layout(local_size_x = 64) in;

layout(push_constant) uniform Push {
    fm_voxelize_push push;
};

#include "triangle_lists.glsl"
#include "voxelize.glsl"

ivec3 axes_of(int along) {
    return ivec3(along, along == 2 ? 0 : along + 1, along == 0 ? 2 : along - 1);
}

ivec3 voxel_at(ivec3 axes, int along, ivec2 column) {
    ivec3 at;
    at[axes.x] = along;
    at[axes.y] = column.x;
    at[axes.z] = column.y;
    return at;
}

// The voxels of a column that the plane may touch: more rather than fewer, for each is tried by the rule.
ivec2 depth_range(ivec3 axes, ivec2 column, vec3 corner, vec3 normal, vec3 extent, float slack, ivec3 begin, ivec3 end) {
    const int d = axes.x;
    const vec2 at = vec2(column) + 0.5 - vec2(corner[axes.y], corner[axes.z]);
    const float steep = abs(normal[d]);
    const float off = normal[axes.y] * at.x + normal[axes.z] * at.y;
    const float room = dot(abs(normal), extent) + 2.0 * slack;
    const float middle = corner[d] - off / normal[d];
    const float half_range = room / steep * 1.0001 + 2.0;
    if (!(steep > 0.0) || !(half_range < 1e6) || !(abs(middle) < 1e9)) {
        return ivec2(begin[d], end[d]);
    }
    const float low = clamp(floor(middle - half_range), float(begin[d]), float(end[d]));
    const float high = clamp(ceil(middle + half_range), float(begin[d]), float(end[d]));
    return ivec2(low, high);
}

void set_columns(fm_voxel_triangle t, uint first, uint step) {
    const vec3 normal = vec3(t.normal[0], t.normal[1], t.normal[2]);
    const vec3 corner = vec3(t.corner[0], t.corner[1], t.corner[2]);
    const vec3 extent = 0.5 + vec3(t.delta[0], t.delta[1], t.delta[2]);
    const ivec3 begin = ivec3(t.begin[0], t.begin[1], t.begin[2]);
    const ivec3 end = ivec3(t.end[0], t.end[1], t.end[2]);
    const vec3 faces = abs(normal);
    const ivec3 axes = axes_of(faces.x >= faces.y && faces.x >= faces.z ? 0 : faces.y >= faces.z ? 1 : 2);
    const uvec2 size = uvec2(end[axes.y] - begin[axes.y], end[axes.z] - begin[axes.z]);
    for (uint64_t i = first; i < uint64_t(size.x) * size.y; i += step) {
        const ivec2 column = ivec2(begin[axes.y] + int(i % size.x), begin[axes.z] + int(i / size.x));
        const ivec2 range = depth_range(axes, column, corner, normal, extent, t.plane, begin, end);
        for (int along = range.x; along < range.y; along++) {
            const ivec3 at = voxel_at(axes, along, column);
            if (fm_voxel_sets(t, THIN, at.x, at.y, at.z)) {
                voxel_set(at.x, at.y, at.z);
            }
        }
    }
}

void cross_rows(fm_voxel_triangle t, uint first, uint step) {
    const voxel_columns rows = voxel_rows(t);
    for (uint64_t i = first; i < voxel_count(rows); i += step) {
        voxel_cross(t, rows.begin.x + int(i % rows.size.x), rows.begin.y + int(i / rows.size.x));
    }
}

void main() {
    const uint parts = HUGE ? FM_VOXELIZE_PARTS : 1;
    const uint part = gl_WorkGroupID.x % parts;
    const uint count = listed_triangles(push.lists, HUGE);
    for (uint i = gl_WorkGroupID.x / parts; i < count; i += gl_NumWorkGroups.x / parts) {
        const uint triangle = listed_triangle(push.lists, push.mesh.triangle_count, i, HUGE);
        fm_voxel_triangle t;
        voxel_load(triangle, t);
        t = fm_voxel_axes(t);
        const uint first = part * gl_WorkGroupSize.x + gl_LocalInvocationIndex;
        if (SOLID) {
            cross_rows(t, first, parts * gl_WorkGroupSize.x);
        } else {
            set_columns(t, first, parts * gl_WorkGroupSize.x);
        }
    }
}
