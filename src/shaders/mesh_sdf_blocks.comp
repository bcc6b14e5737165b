// SPDX-License-Identifier: MIT
#version 460
#include "memory.glsl"
#include "sdf.glsl"

// The upper levels of a field with winding numbers of an open mesh: blocks of EDGE^3 texels, by the exact distance of their centre.
// No triangle comes nearer to a block than that less its radius, which tells most blocks to lie beyond the band; those left are
// listed, with what helps the next level: the triangle that is nearest, and the node that holds everything near.
//
// With EDGE of 16 an invocation owns a block; of 4, a group owns a listed block of 16^3, an invocation one of its children. Moves
// 16 bytes a block and 4 for a listed one, and what the walk visits.

layout(local_size_x = 64) in;

const bool COARSE = EDGE == FM_SDF_COARSE;

// Whether the winding number of the ball around p, in which no surface is, stays on its side of 1/2. Its gradient there is that of
// the mesh's boundary alone (Biot and Savart): at most the sum of length / (4 pi distance^2).
bool keeps_side(vec3 p, float radius) {
    const uint SHORT_BOUNDARY = 8192;
    fm_joints j = ref_joints(push.joints).v;
    if (j.open_count > SHORT_BOUNDARY) {
        return false;
    }
    float change = 0;
    for (uint i = 0; i < j.open_count; i++) {
        uvec2 ends = ref_u32x2(j.open_edges + uint64_t(i) * 8).v;
        vec3 a = mesh_vertex(push.mesh, ends.x) - p;
        vec3 e = mesh_vertex(push.mesh, ends.y) - p - a;
        float t = clamp(-dot(a, e) / max(dot(e, e), 1e-37), 0.0, 1.0);
        float away = length(a + t * e) - radius;
        change += away > 0 ? length(e) / (FOUR_PI * away * away) : MESH_INFINITY;
    }
    float w = winding_at(push.mesh, push.moments, p, 4);
    return abs(w - 0.5) > change * radius * 1.01 + 0.02;
}

void do_block(uint64_t block, ivec3 first, uint root, uint hint) {
    ivec3 last = min(first + int(EDGE), field_size()) - 1;
    vec3 p = texel_place(0.5 * vec3(first + last));
    float radius = length(0.5 * vec3(last - first) * vec3(push.spacing[0], push.spacing[1], push.spacing[2]));
    mesh_nearest n = bvh_nearest_below(push.mesh, root, p, MESH_INFINITY, hint);
    block_state s;
    s.triangle = n.triangle;
    s.distance = sqrt(n.distance2);
    s.node = bvh_descend(push.mesh, root, p, (s.distance + 2 * radius) * 1.00001);
    s.flags = winding_inside(p) ? BLOCK_INSIDE : 0;
    bool far = s.distance - radius > band() * 1.00001 && keeps_side(p, radius);
    if (!far) {
        s.flags |= BLOCK_NEAR;
        list_append(push.scratch + (COARSE ? FM_SDF_LIST_COARSE : FM_SDF_LIST_MIDDLE), entries_of(COARSE), uint(block));
    }
    store_state(COARSE, block, s);
}

void main() {
    if (COARSE) {
        uint64_t block = folded_group(gl_WorkGroupID, gl_NumWorkGroups) * 64 + gl_LocalInvocationIndex;
        if (block < coarse_count()) {
            do_block(block, coarse_first(uint(block)), 0, FM_GPU_NONE);
        }
        return;
    }
    uint count = list_count(push.scratch + FM_SDF_LIST_COARSE);
    for (uint i = gl_WorkGroupID.x; i < count; i += gl_NumWorkGroups.x) {
        uint parent = ref_u32(entries_of(true) + uint64_t(i) * 4).v;
        block_state above = load_state(true, parent);
        ivec3 first = coarse_first(parent) + child_first(gl_LocalInvocationIndex, FM_SDF_MIDDLE);
        if (all(lessThan(first, field_size()))) {
            do_block(uint64_t(parent) * 64 + gl_LocalInvocationIndex, first, above.node, above.triangle);
        }
    }
}
