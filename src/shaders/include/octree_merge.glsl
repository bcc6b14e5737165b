// SPDX-License-Identifier: MIT
// Whether eight leaves may become one: what its own corners say of a place, against what is known there. Expects octree_build.glsl.

const float NEAR_SURFACE = 1.7320508;

shared build_corner merge_corners[8];  // of the node, in finest cells
shared uint merge_hint;

// The vector at a place from 0 to 1 in a node of `edge` cells, in finest cells.
vec3 merge_said(float edge, vec3 place) {
    vec3 v[8];
    for (uint i = 0; i < 8; i++) {
        v[i] = merge_corners[i].way / edge;
    }
    return fm_vcp_between(v, place) * edge;
}

bool merge_agrees(float edge, vec3 place, build_corner exact) {
    return corner_known(exact) && distance(merge_said(edge, place), exact.way) <= PLAN.threshold;
}

// Near the surface lengths must stay.
bool merge_keeps(float edge, vec3 place, build_corner exact) {
    float away = corner_distance(exact);
    return away > NEAR_SURFACE || abs(length(merge_said(edge, place)) - away) <= PLAN.threshold;
}

uvec3 merge_part(uint i) {
    return uvec3(i % 3, i / 3 % 3, i / 9);
}

// Of the node's 27 corners of children those that are not its own.
bool merge_inner(uint i) {
    return any(equal(merge_part(i), uvec3(1)));
}

// The children around one of them.
uint merge_around(uint i) {
    uint around = 0;
    for (uint child = 0; child < 8; child++) {
        around |= all(lessThanEqual(merge_part(i) - child_bits(child), uvec3(1))) ? 1u << child : 0;
    }
    return around;
}
