// SPDX-License-Identifier: MIT
// The tree walked by the invocations of a subgroup together, for places near each other: nodes and triangles are loaded once for
// all, and nothing diverges but the look at triangles that only some want. Expects memory.glsl, bvh.glsl and groups of 64
// invocations, all of which come here, whatever the size of a subgroup.

#extension GL_KHR_shader_subgroup_basic : require
#extension GL_KHR_shader_subgroup_vote : require

const uint PACKET_THREADS = 64;
const uint PACKETS = 16;               // that walk at a time: all of a group's unless subgroups are smaller than 4
const float PACKET_MARGIN = 1 - 1e-6;  // so that boxes as near as the best so far are entered whatever rounding does to either

// For each packet the nodes that wait, and how far from the packet's middle they are. All invocations of a packet write the same.
shared uvec2 packet_waiting[PACKETS][BVH_STACK];

// Where in the group the packet's first and last invocation are, if invocations are numbered along subgroups. A packet's middle may
// be taken from this: what it is decides the time alone.
uvec2 packet_range() {
    return min(uvec2(gl_SubgroupID, gl_SubgroupID + 1) * gl_SubgroupSize - uvec2(0, 1), uvec2(PACKET_THREADS - 1));
}

// As bvh_nearest_below, from the root. An invocation whose bound2 is negative looks for nothing. `middle` is the packet's.
mesh_nearest packet_walk(fm_mesh_refs m, vec3 p, float bound2, vec3 middle) {
    mesh_nearest best = mesh_nearest(vec3(0), bound2, FM_GPU_NONE, FM_GPU_FACE);
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
mesh_nearest packet_nearest(fm_mesh_refs m, vec3 p, float bound2, vec3 middle) {
    mesh_nearest best;
    for (uint round = 0; round * PACKETS < gl_NumSubgroups; round++) {
        if (gl_SubgroupID / PACKETS == round) {
            best = packet_walk(m, p, bound2, middle);
        }
        barrier();
    }
    return best;
}
