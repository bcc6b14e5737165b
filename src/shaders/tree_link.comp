// SPDX-License-Identifier: MIT
#version 460
#include "tree.glsl"

#include "climb.glsl"

// From sorted keys to nodes with their boxes, and so the refit too, for which the keys are kept. One invocation owns a triangle: it
// writes its record, then climbs.
//
// Moves, a triangle: keys 8 bytes, number 4, indices 12, corners (12 a vertex if each comes from memory once), record 48, node 64
// written and half of it read, meeting 4 cleared and 8 exchanged. About 190 bytes.

struct subtree {
    vec3 low, high;
    uint child, count;
};

void write_record(uint place, uint number, vec3 a, vec3 b, vec3 c) {
    fm_address at = bvh_records(push.mesh) + uint64_t(place) * FM_RECORD_BYTES;
    ref_u32x4(at).v = floatBitsToUint(vec4(a, b.x));
    ref_u32x4(at + 16).v = floatBitsToUint(vec4(b.yz, c.xy));
    ref_u32x4(at + 32).v = uvec4(floatBitsToUint(c.z), number, 0, 0);
}

fm_address node_at(uint node) {
    return push.mesh.nodes + uint64_t(node) * FM_NODE_BYTES;
}

void write_child(uint node, uint side, subtree s) {
    fm_address box = node_at(node) + side * 24;
    shared_f32x2(box).v = s.low.xy;
    shared_f32x2(box + 8).v = vec2(s.low.z, s.high.x);
    shared_f32x2(box + 16).v = s.high.yz;
    shared_u32(node_at(node) + 48 + side * 4).v = s.child;
    shared_u32(node_at(node) + 56 + side * 4).v = s.count;
}

subtree read_child(uint node, uint side) {
    fm_address box = node_at(node) + side * 24;
    vec2 v0 = shared_f32x2(box).v;
    vec2 v1 = shared_f32x2(box + 8).v;
    vec2 v2 = shared_f32x2(box + 16).v;
    return subtree(vec3(v0, v1.x), vec3(v1.y, v2), shared_u32(node_at(node) + 48 + side * 4).v,
                   shared_u32(node_at(node) + 56 + side * 4).v);
}

const subtree NOTHING = subtree(vec3(MESH_INFINITY), vec3(-MESH_INFINITY), 0, 0);

void climb(uint place, subtree s) {
    climber c = climber(place, place, 0, 0);
    bool climbing = true;
    while (climbing) {
        find_parent(c);
        write_child(c.node, c.side, s);
        climbing = meet(c);
        if (climbing) {
            subtree other = read_child(c.node, 1 - c.side);
            if (is_all(c)) {
                write_child(0, c.side, s);
                write_child(0, 1 - c.side, other);
                climbing = false;
            }
            uint total = c.last - c.first + 1;
            s = subtree(min(s.low, other.low), max(s.high, other.high), total <= FM_LEAF_TRIANGLES ? c.first : c.node, total);
        }
    }
}

void add_triangle(uint place) {
    uint number = word_at(push.numbers, place);
    vec3 a, b, c;
    mesh_corners(push.mesh, number, a, b, c);
    bool fits = mesh_triangle_fits(a, b, c);
    write_record(place, fits ? number : FM_GPU_NONE, a, b, c);
    subtree s = NOTHING;
    s.child = place;
    s.count = 1;
    if (fits) {
        s.low = min(min(a, b), c);
        s.high = max(max(a, b), c);
    }
    if (push.mesh.triangle_count == 1) {
        write_child(0, 0, s);
    } else {
        climb(place, s);
    }
}

void main() {
    uint64_t i = folded_group(gl_WorkGroupID, gl_NumWorkGroups) * FM_TREE_THREADS + gl_LocalInvocationIndex;
    uint count = push.mesh.triangle_count;
    if (i == 0 && count < 2) {
        write_child(0, 0, NOTHING);
        write_child(0, 1, NOTHING);
    }
    if (i < count) {
        add_triangle(uint(i));
    }
}
