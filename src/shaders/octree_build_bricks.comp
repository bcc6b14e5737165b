// SPDX-License-Identifier: MIT
#version 460
#include "octree_build.glsl"
#include "octree_merge.glsl"

// Which finest cells are leaves, which of them become leaves of level 1, and whether these become one of level 2. A group owns a
// brick of 4^3 cells, an invocation a cell. Reads 16 bytes of each of 5^3 corners; writes 16 bytes a brick, 4 of its number of
// groups, and 128 where it may be a leaf.

shared build_corner corners[125];
shared uint brick_nearest;
shared uint cell_leaves[2];
shared uint small_filled;  // nodes of level 1 that hold leaves, and those of them that are no leaves
shared uint small_bad;
shared uint whole_bad;

uint corner_number(uvec3 at) {
    return at.x + 5 * (at.y + 5 * at.z);
}

void load_corners(uvec3 brick) {
    for (uint i = gl_LocalInvocationIndex; i < 125; i += 64) {
        build_corner corner = corner_at(brick * FM_BUILD_BLOCK + uvec3(i % 5, i / 5 % 5, i / 25));
        corners[i] = corner;
        atomicMin(brick_nearest, floatBitsToUint(corner_distance(corner)));
        atomicMin(merge_hint, corner.triangle);
    }
}

uint cell_bit(uvec3 cell) {
    uint i = cell.x + 4 * (cell.y + 4 * cell.z);
    return cell_leaves[i >> 5] >> (i & 31u) & 1u;
}

void set_cell(uvec3 brick) {
    uint own = gl_LocalInvocationIndex;
    uvec3 cell = uvec3(own & 3u, own >> 2 & 3u, own >> 4);
    float nearest = MESH_INFINITY;
    for (uint i = 0; i < 8; i++) {
        nearest = min(nearest, corner_distance(corners[corner_number(cell + child_bits(i))]));
    }
    if (nearest <= PLAN.band && !beyond_box(0, brick * FM_BUILD_BLOCK + cell)) {
        atomicOr(cell_leaves[own >> 5], 1u << (own & 31u));
        atomicOr(small_filled, 1u << child_number(cell >> 1));
    }
}

// A node of level 1 has eight invocations.
void set_small() {
    uint node = gl_LocalInvocationIndex >> 3;
    uvec3 first = 2 * child_bits(node);
    uint leaves = 0;
    for (uint i = 0; i < 8; i++) {
        leaves |= cell_bit(first + child_bits(i)) << i;
    }
    bool bad = PLAN.threshold < 0;
    vec3 v[8];
    for (uint i = 0; i < 8; i++) {
        build_corner corner = corners[corner_number(first + 2 * child_bits(i))];
        bad = bad || !corner_known(corner);
        v[i] = 0.5 * corner.way;
    }
    for (uint i = gl_LocalInvocationIndex & 7u; i < 27 && leaves != 0 && !bad; i += 8) {
        if (merge_inner(i) && (merge_around(i) & leaves) != 0) {
            build_corner exact = corners[corner_number(first + merge_part(i))];
            vec3 said = 2 * fm_vcp_between(v, 0.5 * vec3(merge_part(i)));
            bad = !(corner_known(exact) && distance(said, exact.way) <= PLAN.threshold);
        }
    }
    if (leaves != 0 && bad) {
        atomicOr(small_bad, 1u << node);
    }
}

// The node's own corners; those that are not known yet may be far.
void find_corners(uvec3 brick, uint slot) {
    uint own = gl_LocalInvocationIndex;
    if (own < 8) {
        build_corner corner = corners[corner_number(4 * child_bits(own))];
        if (!corner_known(corner)) {
            corner = corner_found(FM_BUILD_BLOCK * (brick + child_bits(own)), merge_hint);
        }
        merge_corners[own] = corner;
        store_corner(PLAN.coarse[0], uint64_t(slot) * 8 + own, corner);
    }
}

void try_whole() {
    bool bad = false;
    uint own = gl_LocalInvocationIndex;
    if (own < 27 && merge_inner(own) && (merge_around(own) & small_filled) != 0) {
        bad = !merge_agrees(4, 0.5 * vec3(merge_part(own)), corners[corner_number(2 * merge_part(own))]);
    }
    for (uint i = own; i < 125 && !bad; i += 64) {
        bad = !merge_keeps(4, 0.25 * vec3(i % 5, i / 5 % 5, i / 25), corners[i]);
    }
    if (bad) {
        atomicOr(whole_bad, 1u);
    }
}

// The bits of level 0 of all cells in a set of nodes of level 1.
uint cells_in(uint nodes, uint half_word) {
    uint mask = 0;
    for (uint node = 4 * half_word; node < 4 * half_word + 4; node++) {
        uvec3 at = child_bits(node);
        mask |= (nodes >> node & 1u) * (0x00330033u << (2 * at.x + 8 * at.y));
    }
    return mask;
}

void store_brick(uvec3 brick, uint slot, bool whole) {
    uint internal = whole ? 0 : small_bad;
    uint leaves = whole ? 0 : small_filled & ~small_bad;
    uint state = small_filled == 0 ? FM_BRICK_EMPTY : whole ? FM_BRICK_LEAF : FM_BRICK_INTERNAL;
    float bound = bound_of(uintBitsToFloat(brick_nearest));
    ref_u32x4(PLAN.bricks + uint64_t(slot) * FM_BUILD_BRICK_BYTES).v =
        uvec4(cell_leaves[0] & cells_in(internal, 0), cell_leaves[1] & cells_in(internal, 1),
              leaves | internal << 8 | state << 16, floatBitsToUint(bound));
    if (all(lessThan(brick, build_bricks()))) {
        ref_u32(item_address(2, brick)).v = state == FM_BRICK_INTERNAL ? 1 + bitCount(internal) : 0;
    }
}

void do_brick(uvec3 brick, uint slot) {
    if (gl_LocalInvocationIndex == 0) {
        brick_nearest = floatBitsToUint(MESH_INFINITY);
        merge_hint = FM_GPU_NONE;
        cell_leaves[0] = 0;
        cell_leaves[1] = 0;
        small_filled = 0;
        small_bad = 0;
        whole_bad = 0;
    }
    barrier();
    load_corners(brick);
    barrier();
    set_cell(brick);
    barrier();
    set_small();
    barrier();
    bool candidate = small_filled != 0 && small_bad == 0;
    if (candidate) {
        find_corners(brick, slot);
    }
    barrier();
    if (candidate) {
        try_whole();
    }
    barrier();
    if (gl_LocalInvocationIndex == 0) {
        store_brick(brick, slot, candidate && whole_bad == 0);
    }
    barrier();
}

void main() {
    uint count = list_count(PLAN.near);
    for (uint slot = gl_WorkGroupID.x; slot < count; slot += gl_NumWorkGroups.x) {
        do_brick(build_at(build_bricks() + 1, ref_u32(PLAN.entries + uint64_t(slot) * 4).v), slot);
    }
}
