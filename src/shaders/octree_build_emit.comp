// SPDX-License-Identifier: MIT
#version 460
#include "octree_build.glsl"
#include "octree_emit.glsl"

// Words of nodes of levels 0 and 1, and the values of leaves of levels 0 to 2. A group owns a brick, an invocation a cell. Reads 16
// bytes of each of 5^3 corners, 20 of the row of each leaf; writes 4 bytes a node, 16 to 32 a leaf.

shared build_corner corners[125];

uint corner_number(uvec3 at) {
    return at.x + 5 * (at.y + 5 * at.z);
}

// Of a node at a place in the brick, of `edge` cells.
float nearest_of(uvec3 first, uint edge) {
    float nearest = MESH_INFINITY;
    uint side = edge + 1;
    for (uint i = 0; i < side * side * side; i++) {
        nearest = min(nearest, corner_distance(corners[corner_number(first + build_at(uvec3(side), i))]));
    }
    return nearest;
}

uint empty_node(uint level, uvec3 brick, uvec3 in_brick) {
    uvec3 at = (brick << (2 - level)) + in_brick;
    return empty_word(beyond_box(level, at) ? MESH_INFINITY : bound_of(nearest_of(in_brick << level, 1u << level)));
}

uint rank_of(uint mask, uint i) {
    return bitCount(mask & ((1u << i) - 1));
}

void emit_whole(uvec3 brick, uint slot) {
    uint own = gl_LocalInvocationIndex;
    leaf_column column = column_of(2, brick);
    if (own < 4 + 4 * column.last) {
        emit_value(2, column.first + (own >> 2), own & 3u,
                   stored_corner(PLAN.coarse[0], uint64_t(slot) * 8 + value_corner(own >> 2, own & 3u)));
    }
}

// An invocation owns a value of a node of level 1.
void emit_small(uvec3 brick, uvec4 found, uint base) {
    uint node = gl_LocalInvocationIndex >> 3;
    uint i = gl_LocalInvocationIndex & 7u;
    uvec3 in_brick = child_bits(node);
    bool leaf = (brick_leaves(found) >> node & 1u) != 0;
    bool internal = (brick_internal(found) >> node & 1u) != 0;
    emit_count(FM_BUILD_LEAVES + 1, i == 0 && leaf);
    emit_count(FM_BUILD_EMPTY, i == 0 && !leaf && !internal);
    leaf_column column = leaf_column(0, 0);
    if (leaf) {
        column = column_of(1, 2 * brick + in_brick);
        if (i < 4 + 4 * column.last) {
            uvec3 corner = child_bits(value_corner(i >> 2, i & 3u));
            emit_value(1, column.first + (i >> 2), i & 3u, corners[corner_number(2 * (in_brick + corner))]);
        }
    }
    if (i == 0) {
        emit_word(base + node, leaf       ? ~column.first
                               : internal ? base + 8 * (1 + rank_of(brick_internal(found), node))
                                          : empty_node(1, brick, in_brick));
    }
}

void emit_cells(uvec3 brick, uvec4 found, uint base) {
    uint own = gl_LocalInvocationIndex;
    uvec3 in_brick = uvec3(own & 3u, own >> 2 & 3u, own >> 4);
    uint parent = child_number(in_brick >> 1);
    bool there = (brick_internal(found) >> parent & 1u) != 0;
    bool leaf = (found[own >> 5] >> (own & 31u) & 1u) != 0;
    emit_count(FM_BUILD_LEAVES, there && leaf);
    emit_count(FM_BUILD_EMPTY, there && !leaf);
    if (!there) {
        return;
    }
    uint place = base + 8 * (1 + rank_of(brick_internal(found), parent)) + child_number(in_brick);
    if (!leaf) {
        emit_word(place, empty_node(0, brick, in_brick));
        return;
    }
    leaf_column column = column_of(0, FM_BUILD_BLOCK * brick + in_brick);
    emit_word(place, ~column.first);
    for (uint i = 0; i < 4 + 4 * column.last; i++) {
        uvec3 corner = in_brick + child_bits(value_corner(i >> 2, i & 3u));
        emit_value(0, column.first + (i >> 2), i & 3u, corners[corner_number(corner)]);
    }
}

void emit_brick(uvec3 brick, uint slot) {
    uvec4 found = load_brick(slot);
    uint state = brick_state(found);
    if (state == FM_BRICK_LEAF) {
        emit_whole(brick, slot);
    } else if (state == FM_BRICK_INTERNAL) {
        for (uint i = gl_LocalInvocationIndex; i < 125; i += 64) {
            corners[i] = corner_at(brick * FM_BUILD_BLOCK + build_at(uvec3(5), i));
        }
        barrier();
        uint base = children_of(2, brick);
        emit_small(brick, found, base);
        emit_cells(brick, found, base);
        barrier();
    }
}

void main() {
    uint count = list_count(PLAN.near);
    for (uint slot = gl_WorkGroupID.x; slot < count; slot += gl_NumWorkGroups.x) {
        emit_brick(build_at(build_bricks() + 1, ref_u32(PLAN.entries + uint64_t(slot) * 4).v), slot);
    }
}
