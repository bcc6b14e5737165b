// SPDX-License-Identifier: MIT
#version 460
#include "tree.glsl"
#include "climb.glsl"
#include "winding.glsl"

// The moments of all subtrees, for winding numbers; the tree is there. One invocation owns a triangle and climbs from it. Moves, a
// triangle: its record 48 bytes, keys 8, meeting 12, boxes 48, moments 128 written and half of them read: about 310 bytes.

void write_moments(uint node, uint side, moments m) {
    fm_address at = moments_at(push.moments, node, side);
    shared_f32x4(at).v = vec4(m.centre, m.radius);
    shared_f32x4(at + 16).v = vec4(m.vector, m.area);
    shared_f32x4(at + 32).v = vec4(m.even, m.odd.x);
    shared_f32x2(at + 48).v = m.odd.yz;
}

moments read_moments(uint node, uint side) {
    fm_address at = moments_at(push.moments, node, side);
    vec4 v0 = shared_f32x4(at).v;
    vec4 v1 = shared_f32x4(at + 16).v;
    vec4 v2 = shared_f32x4(at + 32).v;
    return moments(v0.xyz, v0.w, v1.xyz, v1.w, v2.xyz, vec3(v2.w, shared_f32x2(at + 48).v));
}

// The radius about the centre, from the child's box.
void measure(inout moments m, uint node, uint side) {
    bvh_node n = bvh_load(push.mesh, node);
    vec3 low = side == 0 ? n.low0 : n.low1;
    vec3 high = side == 0 ? n.high0 : n.high1;
    if (low.x > high.x) {
        m.radius = -1;
        return;
    }
    if (!(m.area > 0)) {
        m.centre = 0.5 * low + 0.5 * high;
    }
    m.radius = length(max(abs(low - m.centre), abs(high - m.centre)));
    float all = dot(abs(m.vector) + abs(m.even) + abs(m.odd), vec3(1)) + m.area + m.radius;
    if (isinf(all) || isnan(all)) {
        m.radius = MESH_INFINITY;
    }
}

// The moments of `m` about another centre.
moments about(moments m, vec3 centre) {
    vec3 d = m.centre - centre;
    m.even += d * m.vector;
    m.odd += 0.5 * (d.xxy * m.vector.yzz + d.yzz * m.vector.xxy);
    m.centre = centre;
    return m;
}

moments sum_of(moments a, moments b) {
    float area = a.area + b.area;
    float part = area > 0 ? b.area / area : 0;
    vec3 centre = part == 0 ? a.centre : part == 1 ? b.centre : (1 - part) * a.centre + part * b.centre;
    moments m = about(a, centre);
    moments n = about(b, centre);
    return moments(centre, 0, m.vector + n.vector, area, m.even + n.even, m.odd + n.odd);
}

void main() {
    uint64_t i = folded_group(gl_WorkGroupID, gl_NumWorkGroups) * FM_TREE_THREADS + gl_LocalInvocationIndex;
    uint count = push.mesh.triangle_count;
    moments m = moments(vec3(0), -1, vec3(0), 0, vec3(0), vec3(0));
    if (i == 0 && count < 2) {
        write_moments(0, 0, m);
        write_moments(0, 1, m);
    }
    if (i >= count) {
        return;
    }
    vec3 a, b, c;
    if (bvh_record(bvh_records(push.mesh), uint(i), a, b, c) != FM_GPU_NONE) {
        m.vector = 0.5 * cross(b - a, c - a);
        m.area = length(m.vector);
        m.centre = (a + b + c) / 3;
    }
    if (count == 1) {
        measure(m, 0, 0);
        write_moments(0, 0, m);
        return;
    }
    climber at = climber(uint(i), uint(i), 0, 0);
    bool climbing = true;
    while (climbing) {
        find_parent(at);
        measure(m, at.node, at.side);
        write_moments(at.node, at.side, m);
        climbing = meet(at);
        if (climbing) {
            moments other = read_moments(at.node, 1 - at.side);
            if (is_all(at)) {
                write_moments(0, at.side, m);
                write_moments(0, 1 - at.side, other);
                climbing = false;
            }
            m = at.side == 0 ? sum_of(m, other) : sum_of(other, m);
        }
    }
}
