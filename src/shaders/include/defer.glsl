// SPDX-License-Identifier: MIT
// What the kernels of a deferred picture share: its constants, rays through the mesh, and which pixel an invocation owns. Work
// groups are tiles of 8 x 8.

#include "memory.glsl"
#include "bvh.glsl"
#include "defer_shared.h"

layout(local_size_x = 8, local_size_y = 8) in;

layout(buffer_reference, std430, buffer_reference_align = 8) buffer ref_scene {
    fm_defer_scene v;
};
layout(buffer_reference, std430, buffer_reference_align = 4) buffer ref_f32 {
    float v;
};
layout(buffer_reference, std430, buffer_reference_align = 16) buffer ref_f32x4 {
    vec4 v;
};
layout(buffer_reference, std430, buffer_reference_align = 16) buffer ref_surface {
    fm_defer_surface v;
};

layout(push_constant, std430) uniform push_block {
    fm_defer_push push;
};

#define FM_LIGHT(at) (ref_f32(ref_scene(push.scene).v.light + (at) * 4).v)
#define FM_PAST(at) (ref_f32(ref_scene(push.scene).v.history + (at) * 4).v)

#include "defer_rule.h"

struct fm_mesh_met {
    float time;  // +infinity: nothing
    float normal[3];
};

fm_mesh_met fm_mesh_first(FM_SCENE, vec3 origin, vec3 way, float first, float last) {
    mesh_hit hit = bvh_first(FM_GET(mesh), origin, way, first, last);
    vec3 normal = vec3(0);
    if (hit.triangle != FM_GPU_NONE) {
        vec3 a, b, c;
        mesh_corners(FM_GET(mesh), hit.triangle, a, b, c);
        normal = fm_unit(fm_cross(b - a, c - a));
    }
    fm_mesh_met met;
    met.time = hit.t;
    met.normal[0] = normal.x;
    met.normal[1] = normal.y;
    met.normal[2] = normal.z;
    return met;
}

bool fm_mesh_blocked(FM_SCENE, vec3 origin, vec3 way, float first, float last) {
    return bvh_any(FM_GET(mesh), origin, way, first, last);
}

#include "defer_pixel.h"

// The place of this invocation in a grid of tiles that is `width` wide; the third number counts whole grids of that height.
ivec3 tile_place(int width, int height) {
    int group = int(folded_group(gl_WorkGroupID, gl_NumWorkGroups));
    int across = (width + 7) / 8, down = (height + 7) / 8;
    int row = group / across;
    return ivec3(group % across * 8 + int(gl_LocalInvocationID.x), row % down * 8 + int(gl_LocalInvocationID.y), row / down);
}

// Whether this invocation has a pixel.
bool own_pixel(out ivec2 at) {
    ivec3 place = tile_place(FM_GET(width), FM_GET(height));
    at = place.xy;
    return at.x < FM_GET(width) && at.y < FM_GET(height) && place.z == 0;
}

uint64_t pixel_index(ivec2 at) {
    return uint64_t(at.y) * uint64_t(FM_GET(width)) + uint64_t(at.x);
}
