// SPDX-License-Identifier: MIT
// What the kernels share that build octrees: the plan, places, nodes and leaves by their numbers, what is known of corners.

#include "memory.glsl"
#include "bvh.glsl"
#include "lists.glsl"
#include "octree_build_shared.h"
#include "vcp_rule.h"

layout(local_size_x = 64) in;

layout(push_constant) uniform push_block {
    fm_build_push push;
};

layout(buffer_reference, std430, buffer_reference_align = 8) readonly buffer ref_plan {
    fm_build_plan v;
};

#define PLAN ref_plan(push.plan).v

uvec3 build_cells() {
    return uvec3(PLAN.cells[0], PLAN.cells[1], PLAN.cells[2]);
}

// Bricks of the box; of corners there is one block more along each axis.
uvec3 build_bricks() {
    return (build_cells() + (FM_BUILD_BLOCK - 1)) / FM_BUILD_BLOCK;
}

// Nodes of a level along the axes.
uvec3 build_shape(uint level) {
    return uvec3(PLAN.top[0], PLAN.top[1], PLAN.top[2]) << (PLAN.levels - level);
}

uint build_number(uvec3 shape, uvec3 at) {
    return at.x + shape.x * (at.y + shape.y * at.z);
}

uvec3 build_at(uvec3 shape, uint number) {
    return uvec3(number % shape.x, number / shape.x % shape.y, number / shape.x / shape.y);
}

uvec3 child_bits(uint i) {
    return uvec3(i & 1u, i >> 1 & 1u, i >> 2);
}

uint child_number(uvec3 at) {
    return (at.x & 1u) | (at.y & 1u) << 1 | (at.z & 1u) << 2;
}

bool beyond_box(uint level, uvec3 at) {
    return any(greaterThanEqual(uvec3(at) << level, build_cells()));
}

// --- Corners ---

uint block_slot(uvec3 block) {
    return ref_u32(PLAN.slots + uint64_t(build_number(build_bricks() + 1, block)) * 4).v;
}

// What a corner knows.
struct build_corner {
    vec3 way;       // to the nearest place of the surface, in finest cells
    uint triangle;  // FM_GPU_NONE: it is not known
};

build_corner stored_corner(fm_address base, uint64_t i) {
    uvec4 v = ref_u32x4(base + i * FM_BUILD_CORNER_BYTES).v;
    return build_corner(uintBitsToFloat(v.xyz), v.w);
}

void store_corner(fm_address base, uint64_t i, build_corner corner) {
    ref_u32x4(base + i * FM_BUILD_CORNER_BYTES).v = uvec4(floatBitsToUint(corner.way), corner.triangle);
}

// Where the way could as well be along the triangle's normal, it is: of a corner on the surface rounding would be all that tells
// the direction.
vec3 straightened(vec3 p, mesh_nearest n) {
    vec3 a, b, c;
    mesh_corners(PLAN.mesh, n.triangle, a, b, c);
    vec3 normal = cross(b - a, c - a);
    vec3 far = max(max(abs(a - p), abs(b - p)), abs(c - p));
    vec3 along = normal * (dot(n.point, normal) / dot(normal, normal));
    return distance(along, n.point) <= 2e-6 * max(far.x, max(far.y, far.z)) ? along : n.point;
}

build_corner corner_of(vec3 p, mesh_nearest n) {
    return build_corner(n.triangle == FM_GPU_NONE ? vec3(0) : straightened(p, n), n.triangle);
}

bool corner_known(build_corner corner) {
    return corner.triangle != FM_GPU_NONE;
}

// Of the finest grid.
build_corner corner_at(uvec3 at) {
    uvec3 block = at / FM_BUILD_BLOCK;
    uint slot = any(greaterThan(block, build_bricks())) ? FM_GPU_NONE : block_slot(block);
    if (slot == FM_GPU_NONE) {
        return build_corner(vec3(0), FM_GPU_NONE);
    }
    uvec3 in_block = at % FM_BUILD_BLOCK;
    return stored_corner(PLAN.corners, uint64_t(slot) * FM_BUILD_CORNERS + build_number(uvec3(FM_BUILD_BLOCK), in_block));
}

// How far its surface is, as far as it is known.
float corner_distance(build_corner corner) {
    return corner_known(corner) ? length(corner.way) : MESH_INFINITY;
}

// The same of a corner that may be farther than what is kept; `hint` is a triangle that is likely to be near.
build_corner corner_found(uvec3 at, uint hint) {
    build_corner corner = corner_at(at);
    if (!corner_known(corner)) {
        corner = corner_of(vec3(at), bvh_nearest_below(PLAN.mesh, 0, vec3(at), MESH_INFINITY, hint));
    }
    return corner;
}

// The bound of what has no corner nearer than `nearest`: no place is farther from all corners of its finest cell than half the
// diagonal.
float bound_of(float nearest) {
    return max(min(nearest, PLAN.reach) - 0.8660255, 0.0);
}

// The bound of a brick whose block is not listed: no place of it is farther from the block's corners than the diagonal of a cell.
float unlisted_bound() {
    return PLAN.reach - 1.7320510;
}

// --- Nodes ---

fm_address node_address(uint level, uvec3 at) {
    return PLAN.nodes + (uint64_t(PLAN.first[level]) + build_number(build_shape(level), at)) * 4;
}

uvec4 load_brick(uint slot) {
    return ref_u32x4(PLAN.bricks + uint64_t(slot) * FM_BUILD_BRICK_BYTES).v;
}

uint brick_leaves(uvec4 brick) {
    return brick.z & 0xffu;
}

uint brick_internal(uvec4 brick) {
    return brick.z >> 8 & 0xffu;
}

uint brick_state(uvec4 brick) {
    return brick.z >> 16;
}

// The word of a node of level 2 or more.
uint node_word(uint level, uvec3 at) {
    if (beyond_box(level, at)) {
        return floatBitsToUint(MESH_INFINITY);
    }
    if (level > 2) {
        return ref_u32(node_address(level, at)).v;
    }
    uint slot = block_slot(at);
    if (slot == FM_GPU_NONE) {
        return floatBitsToUint(unlisted_bound());
    }
    uvec4 brick = load_brick(slot);
    uint state = brick_state(brick);
    return state == FM_BRICK_LEAF       ? FM_BUILD_LEAF | slot
           : state == FM_BRICK_INTERNAL ? FM_BUILD_INTERNAL
           : state == FM_BRICK_MERGED   ? 0
                                        : brick.w;
}

bool word_empty(uint word) {
    return word < FM_BUILD_LEAF;
}

bool word_leaf(uint word) {
    return word >= FM_BUILD_LEAF && word < FM_BUILD_INTERNAL;
}

// The corner `i` of a leaf of level 2 or more, in finest cells.
build_corner leaf_corner(uint level, uint word, uint i) {
    return stored_corner(PLAN.coarse[level - 2], uint64_t(word & FM_BUILD_SLOT) * 8 + i);
}

// Groups of children are numbered by tiles, nodes of the greatest level of leaves: a tile's own, those of its children, those of
// their children; nodes above come first.
fm_address item_address(uint level, uvec3 at) {
    const uint most = PLAN.leaf_most;
    uint64_t item;
    if (level > most) {
        item = PLAN.first[level] + build_number(build_shape(level), at);
    } else {
        uint below = most - level;
        uint own = below == 0 ? 0 : below == 1 ? 1 + child_number(at) : 9 + 8 * child_number(at >> 1) + child_number(at);
        item = PLAN.above + uint64_t(build_number(build_shape(most), at >> below)) * (most == 4 ? 73 : 9) + own;
    }
    return PLAN.items + item * 4;
}

// Where the children of an internal node of level 2 or more begin, in words.
uint children_of(uint level, uvec3 at) {
    return PLAN.top[0] * PLAN.top[1] * PLAN.top[2] + 8 * ref_u32(item_address(level, at)).v;
}

// --- Leaves ---

uint row_number(uint level, uvec3 at) {
    uint edge = FM_BUILD_CHUNK >> level;
    uvec3 chunk = at / edge;
    uvec3 shape = uvec3(PLAN.chunks[0], PLAN.chunks[1], PLAN.chunks[2]);
    uint first = level == 0 ? 0 : level == 1 ? 16384 : level == 2 ? 20480 : level == 3 ? 21504 : 21760;
    return build_number(shape, chunk) * FM_BUILD_ROWS + first + at.z % edge * edge + at.y % edge;
}

// The corners of a row of leaves that have columns.
uvec4 row_columns(uvec4 leaves) {
    return leaves | leaves << 1 | uvec4(0, leaves.xyz >> 31);
}

uint bits_of(uvec4 mask) {
    ivec4 counts = bitCount(mask);
    return uint(counts.x + counts.y + counts.z + counts.w);
}

// Those below bit i, at most 127.
uvec4 bits_below(uvec4 mask, uint i) {
    ivec4 left = ivec4(int(i)) - ivec4(0, 32, 64, 96);
    uvec4 below = mix(uvec4((uvec4(1) << uvec4(clamp(left, 0, 31))) - 1), uvec4(0xffffffffu), greaterThanEqual(left, ivec4(32)));
    return mask & mix(below, uvec4(0), lessThanEqual(left, ivec4(0)));
}

struct leaf_column {
    uint first;  // the leaf's lower column
    uint last;   // 1: no leaf behind it along x has its upper one too
};

leaf_column column_of(uint level, uvec3 at) {
    uint row = row_number(level, at);
    uint x = at.x % (FM_BUILD_CHUNK >> level);
    uvec4 leaves = ref_u32x4(PLAN.rows + uint64_t(row) * FM_BUILD_ROW_BYTES).v;
    uint first = ref_u32(PLAN.columns + uint64_t(row) * 4).v + bits_of(bits_below(row_columns(leaves), x));
    uint next = x + 1;
    bool follows = next < FM_BUILD_CHUNK && (leaves[next >> 5] >> (next & 31u) & 1u) != 0;
    return leaf_column(first, follows ? 0 : 1);
}
