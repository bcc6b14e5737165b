// SPDX-License-Identifier: MIT
// The tree walked by the invocations of a subgroup together, for places near each other: nodes and triangles are loaded once for
// all, and nothing diverges but the look at triangles that only some want. Expects sdf.glsl and groups of 64
// invocations, all of which come here, whatever the size of a subgroup.

#extension GL_KHR_shader_subgroup_basic : require
#extension GL_KHR_shader_subgroup_vote : require

const uint PACKET_THREADS = 64;
const uint PACKETS = 16;               // that walk at a time: all of a group's unless subgroups are smaller than 4
const float PACKET_MARGIN = 1 - 1e-6;  // so that boxes as near as the best so far are entered whatever rounding does to either

// For each packet the nodes that wait, and how far from the packet's middle they are. All invocations of a packet write the same.
shared uvec2 packet_waiting[PACKETS][BVH_STACK];

// The middle of the packet's texels of a block, if invocations are numbered along subgroups. It decides the order alone.
vec3 packet_middle(uvec3 block) {
    uvec2 range = min(uvec2(gl_SubgroupID, gl_SubgroupID + 1) * gl_SubgroupSize - uvec2(0, 1), uvec2(PACKET_THREADS - 1));
    return texel_place(vec3(block * FM_SDF_MIDDLE) + 0.5 * vec3(child_first(range.x, 1) + child_first(range.y, 1)));
}

// As bvh_nearest_below, from the root. An invocation whose bound2 is negative looks for nothing. `middle` is the packet's.
mesh_nearest packet_walk(fm_mesh_refs m, vec3 p, float bound2, vec3 middle, uint hint) {
    mesh_nearest best = mesh_nearest(vec3(0), bound2, FM_GPU_NONE, FM_GPU_FACE);
    if (hint != FM_GPU_NONE) {
        vec3 a, b, c;
        mesh_corners(m, hint, a, b, c);
        bvh_try(p, a, b, c, hint, best);
    }
    const uint packet = gl_SubgroupID % PACKETS;
    const float aside = distance(p, middle) * 1.000001;
    fm_address records = bvh_records(m);
    uint depth = 0;
    uint node = subgroupAny(bound2 >= 0) ? 0 : FM_GPU_NONE;
    while (node != FM_GPU_NONE || depth > 0) {
        if (node == FM_GPU_NONE) {
            depth--;
            uvec2 next = packet_waiting[packet][depth];
            bool wanted = best.distance2 >= 0 && uintBitsToFloat(next.y) * PACKET_MARGIN <= sqrt(max(best.distance2, 0)) + aside;
            node = subgroupAny(wanted) ? next.x : FM_GPU_NONE;
            continue;
        }
        bvh_node n = bvh_load(m, node);
        bool in0 = subgroupAny(bvh_box_distance2(n.low0, n.high0, p) * PACKET_MARGIN <= best.distance2);
        bool in1 = subgroupAny(bvh_box_distance2(n.low1, n.high1, p) * PACKET_MARGIN <= best.distance2);
        float away0 = bvh_box_distance2(n.low0, n.high0, middle);
        float away1 = bvh_box_distance2(n.low1, n.high1, middle);
        bvh_step s = bvh_choose(n, in0 ? away0 : MESH_INFINITY, in1 ? away1 : MESH_INFINITY, MESH_INFINITY);
        for (uint i = s.record; i < s.record_end; i++) {
            vec3 a, b, c;
            uint triangle = bvh_record(records, i, a, b, c);
            float box2 = bvh_box_distance2(min(min(a, b), c), max(max(a, b), c), p);
            if (triangle != FM_GPU_NONE && box2 * PACKET_MARGIN <= best.distance2) {
                bvh_try(p, a, b, c, triangle, best);
            }
        }
        if (s.later != FM_GPU_NONE) {
            packet_waiting[packet][depth] = uvec2(s.later, floatBitsToUint(sqrt(s.later_key)));
            depth++;
        }
        node = s.next;
    }
    best.distance2 = best.triangle == FM_GPU_NONE ? MESH_INFINITY : best.distance2;
    return best;
}

// Ends with a barrier of the group.
mesh_nearest packet_nearest(fm_mesh_refs m, vec3 p, float bound2, vec3 middle, uint hint) {
    mesh_nearest best;
    for (uint round = 0; round * PACKETS < gl_NumSubgroups; round++) {
        if (gl_SubgroupID / PACKETS == round) {
            best = packet_walk(m, p, bound2, middle, hint);
        }
        barrier();
    }
    return best;
}
