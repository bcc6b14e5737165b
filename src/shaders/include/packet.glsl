// SPDX-License-Identifier: MIT
// The tree walked by the invocations of a subgroup together, for places near each other: nodes and triangles are loaded once for
// all, and nothing diverges. Of the triangles that are worth a closer look few invocations want the same; so what they want is
// queued, a place and a triangle an entry, and once there are enough each invocation takes an entry, whosever it is. Expects
// sdf.glsl and groups of 64 invocations, all of which come here, whatever the size of a subgroup.

#extension GL_KHR_shader_subgroup_basic : require
#extension GL_KHR_shader_subgroup_vote : require
#extension GL_KHR_shader_subgroup_ballot : require

const uint PACKET_THREADS = 64;
const uint PACKETS = 16;               // that walk at a time: all of a group's unless subgroups are smaller than 4
const float PACKET_MARGIN = 1 - 1e-6;  // so that boxes as near as the best so far are entered whatever rounding does to either

// For each packet the nodes that wait, and how far from the packet's middle they are. All invocations of a packet write the same.
shared uvec2 packet_waiting[PACKETS][BVH_STACK];
// Twice as many entries for each packet as it has invocations: whose place, and which record.
shared uvec2 packet_queue[2 * PACKET_THREADS];
// Of each invocation: where it is, the least squared distance so far, as bits, and the least number of the triangles that have it.
shared vec3 packet_place[PACKET_THREADS];
shared uint packet_least[PACKET_THREADS];
shared uint packet_best[PACKET_THREADS];

// The middle of the packet's texels of a block, if invocations are numbered along subgroups. It decides the order alone.
vec3 packet_middle(uvec3 block) {
    uvec2 range = min(uvec2(gl_SubgroupID, gl_SubgroupID + 1) * gl_SubgroupSize - uvec2(0, 1), uvec2(PACKET_THREADS - 1));
    return texel_place(vec3(block * FM_SDF_MIDDLE) + 0.5 * vec3(child_first(range.x, 1) + child_first(range.y, 1)));
}

uint packet_batch() {
    return min(gl_SubgroupSize, PACKET_THREADS);
}

fm_address packet_records;  // of the mesh that is walked

// An invocation an entry, from `first` on. What is nearest and of the lowest number does not depend on the order of entries.
void packet_try(uint first, uint end) {
    subgroupBarrier();
    uint at = first + gl_SubgroupInvocationID;
    bool taken = at < end;
    uvec2 entry = taken ? packet_queue[at] : uvec2(gl_LocalInvocationIndex, 0);
    vec3 a, b, c;
    uint triangle = FM_GPU_NONE;
    uint distance2 = 0xffffffffu;
    uint before = packet_least[entry.x];
    if (taken) {
        triangle = bvh_record(packet_records, entry.y, a, b, c);
        vec3 p = packet_place[entry.x];
        distance2 = floatBitsToUint(origin_nearest(a - p, b - p, c - p).distance2);
    }
    subgroupBarrier();
    if (distance2 < before) {
        atomicMin(packet_least[entry.x], distance2);
    }
    subgroupBarrier();
    bool least = taken && distance2 == packet_least[entry.x];
    if (least && distance2 < before) {
        packet_best[entry.x] = FM_GPU_NONE;
    }
    subgroupBarrier();
    if (least) {
        atomicMin(packet_best[entry.x], triangle);
    }
    subgroupBarrier();
}

// The least squared distance of the invocation's place, or below 0 if it looks for nothing.
float packet_limit(bool wanted) {
    return wanted ? uintBitsToFloat(packet_least[gl_LocalInvocationIndex]) : -1;
}

// Queues the records of a leaf or two that come near enough; returns how many entries are left.
uint packet_leaf(bvh_step s, vec3 p, bool wanted, uint queue, uint queued, inout float limit) {
    for (uint i = s.record; i < s.record_end; i++) {
        vec3 a, b, c;
        uint triangle = bvh_record(packet_records, i, a, b, c);
        float box2 = bvh_box_distance2(min(min(a, b), c), max(max(a, b), c), p);
        bool near = triangle != FM_GPU_NONE && box2 * PACKET_MARGIN <= limit;
        uvec4 who = subgroupBallot(near);
        if (near) {
            packet_queue[queue + queued + subgroupBallotExclusiveBitCount(who)] = uvec2(gl_LocalInvocationIndex, i);
        }
        queued += subgroupBallotBitCount(who);
        if (queued >= packet_batch()) {
            queued -= packet_batch();
            packet_try(queue + queued, queue + queued + packet_batch());
            limit = packet_limit(wanted);
        }
    }
    return queued;
}

// Leaves what is nearest in shared memory.
void packet_walk(fm_mesh_refs m, vec3 p, bool wanted, vec3 middle) {
    const uint packet = gl_SubgroupID % PACKETS;
    const uint queue = packet * 2 * packet_batch();
    const float aside = distance(p, middle) * 1.000001;
    float limit = packet_limit(wanted);
    uint queued = 0;
    uint depth = 0;
    uint node = subgroupAny(wanted) ? 0 : FM_GPU_NONE;
    while (node != FM_GPU_NONE || depth > 0) {
        if (node == FM_GPU_NONE) {
            depth--;
            uvec2 next = packet_waiting[packet][depth];
            bool near = wanted && uintBitsToFloat(next.y) * PACKET_MARGIN <= sqrt(max(limit, 0)) + aside;
            node = subgroupAny(near) ? next.x : FM_GPU_NONE;
            continue;
        }
        bvh_node n = bvh_load(m, node);
        bool in0 = subgroupAny(bvh_box_distance2(n.low0, n.high0, p) * PACKET_MARGIN <= limit);
        bool in1 = subgroupAny(bvh_box_distance2(n.low1, n.high1, p) * PACKET_MARGIN <= limit);
        float away0 = in0 ? 0 : MESH_INFINITY;
        float away1 = in1 ? 0 : MESH_INFINITY;
        if (in0 && in1) {
            away0 = bvh_box_distance2(n.low0, n.high0, middle);
            away1 = bvh_box_distance2(n.low1, n.high1, middle);
        }
        bvh_step s = bvh_choose(n, away0, away1, MESH_INFINITY);
        queued = packet_leaf(s, p, wanted, queue, queued, limit);
        if (s.later != FM_GPU_NONE) {
            packet_waiting[packet][depth] = uvec2(s.later, floatBitsToUint(sqrt(s.later_key)));
            depth++;
        }
        node = s.next;
    }
    packet_try(queue, queue + queued);
}

// As bvh_nearest_below, from the root; an invocation whose bound2 is negative looks for nothing. `middle` is the packet's. Barriers
// of the group are within.
mesh_nearest packet_nearest(fm_mesh_refs m, vec3 p, float bound2, vec3 middle, uint hint) {
    mesh_nearest best = mesh_nearest(vec3(0), max(bound2, 0), FM_GPU_NONE, FM_GPU_FACE);
    vec3 a, b, c;
    if (hint != FM_GPU_NONE) {
        mesh_corners(m, hint, a, b, c);
        bvh_try(p, a, b, c, hint, best);
    }
    packet_records = bvh_records(m);
    packet_place[gl_LocalInvocationIndex] = p;
    packet_least[gl_LocalInvocationIndex] = floatBitsToUint(best.distance2);
    packet_best[gl_LocalInvocationIndex] = best.triangle;
    barrier();
    for (uint round = 0; round * PACKETS < gl_NumSubgroups; round++) {
        if (gl_SubgroupID / PACKETS == round) {
            packet_walk(m, p, bound2 >= 0, middle);
        }
        barrier();
    }
    uint triangle = packet_best[gl_LocalInvocationIndex];
    best = mesh_nearest(vec3(0), MESH_INFINITY, FM_GPU_NONE, FM_GPU_FACE);
    if (triangle != FM_GPU_NONE) {
        mesh_corners(m, triangle, a, b, c);
        bvh_try(p, a, b, c, triangle, best);
    }
    return best;
}
