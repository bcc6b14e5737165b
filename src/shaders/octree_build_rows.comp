// SPDX-License-Identifier: MIT
#version 460
#include "octree_build.glsl"

// Which nodes of a row of a chunk are leaves, and how many columns they have. An invocation owns a row; it passes over tiles that
// are empty. Reads 4 bytes a tile, and 20 of each brick; writes 20 bytes a row.

void set_leaf(inout uvec4 leaves, uint x, uint bits) {
    leaves[x >> 5] |= bits << (x & 31u);
}

// The leaves of a brick in a row of nodes of level 0, 1 or 2.
void brick_row(uint level, uvec3 brick, uvec3 at, uint x, inout uvec4 leaves) {
    uint slot = beyond_box(2, brick) ? FM_GPU_NONE : block_slot(brick);
    if (slot == FM_GPU_NONE) {
        return;
    }
    uvec4 found = load_brick(slot);
    if (level == 2) {
        set_leaf(leaves, x, brick_state(found) == FM_BRICK_LEAF ? 1 : 0);
    } else if (level == 1) {
        set_leaf(leaves, x, brick_leaves(found) >> (2 * (at.y & 1u) + 4 * (at.z & 1u)) & 3u);
    } else {
        uint word = (at.z & 2u) == 0 ? found.x : found.y;
        set_leaf(leaves, x, word >> (4 * (at.y & 3u) + 16 * (at.z & 1u)) & 15u);
    }
}

// `at`: the row's first node in the tile, `x` its place in the row.
void tile_row(uint level, uvec3 tile, uvec3 at, uint x, inout uvec4 leaves) {
    const uint most = PLAN.leaf_most;
    uint word = node_word(most, tile);
    if (level == most || word != FM_BUILD_INTERNAL) {
        set_leaf(leaves, x, level == most && word_leaf(word) ? 1 : 0);
        return;
    }
    const uint wide = max(level, 2u);
    for (uint i = 0; i < 1u << (most - wide); i++) {
        uvec3 part = uvec3((tile.x << (most - wide)) + i, (at.yz << level) >> wide);
        uint first = x + (i << (wide - level));
        if (level <= 2) {
            brick_row(level, part, at, first, leaves);
        } else {
            set_leaf(leaves, first, word_leaf(node_word(level, part)) ? 1 : 0);
        }
    }
}

void main() {
    uint64_t own = folded_group(gl_WorkGroupID, gl_NumWorkGroups) * 64 + gl_LocalInvocationIndex;
    uvec3 shape = uvec3(PLAN.chunks[0], PLAN.chunks[1], PLAN.chunks[2]);
    if (own >= uint64_t(shape.x) * shape.y * shape.z * FM_BUILD_ROWS) {
        return;
    }
    uint local = uint(own % FM_BUILD_ROWS);
    uvec3 chunk = build_at(shape, uint(own / FM_BUILD_ROWS));
    uint level = local < 16384 ? 0 : local < 20480 ? 1 : local < 21504 ? 2 : local < 21760 ? 3 : 4;
    local -= level == 0 ? 0 : level == 1 ? 16384 : level == 2 ? 20480 : level == 3 ? 21504 : 21760;
    const uint most = PLAN.leaf_most;
    uint edge = FM_BUILD_CHUNK >> level;
    uvec3 at = chunk * edge + uvec3(0, local % edge, local / edge);
    uvec4 leaves = uvec4(0);
    for (uint x = 0; x < edge && level <= most; x += 1u << (most - level)) {
        uvec3 tile = uvec3(at.x + x, at.yz) >> (most - level);
        if (!beyond_box(most, tile)) {
            tile_row(level, tile, at, x, leaves);
        }
    }
    ref_u32x4(PLAN.rows + own * FM_BUILD_ROW_BYTES).v = leaves;
    ref_u32(PLAN.columns + own * 4).v = bits_of(row_columns(leaves)) + (leaves.w >> 31);
}
