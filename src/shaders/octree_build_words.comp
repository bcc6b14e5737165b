// SPDX-License-Identifier: MIT
#version 460
#include "octree_build.glsl"
#include "octree_emit.glsl"

// Words of nodes of a level from 2 on, and the values of its leaves but for those of level 2. An invocation owns a node; where its
// parent is not internal it has no word. Reads 4 bytes of the parent, and of others 12 and, of leaves, 128; writes 4, and 32 a
// leaf. Empty nodes that no corner tells the distance of ask the tree for that of their middle.

float far_bound(uvec3 at, float bound) {
    if (bound < unlisted_bound() || isinf(bound)) {
        return bound;
    }
    float edge = float(1u << push.level);
    mesh_nearest n = bvh_nearest_below(PLAN.mesh, 0, (vec3(at) + 0.5) * edge, MESH_INFINITY, FM_GPU_NONE);
    return max(bound, sqrt(n.distance2) - 0.8660255 * edge);
}

void emit_leaf(uint word, leaf_column column) {
    for (uint i = 0; i < 4 + 4 * column.last; i++) {
        emit_value(push.level, column.first + (i >> 2), i & 3u, leaf_corner(push.level, word, value_corner(i >> 2, i & 3u)));
    }
}

void main() {
    uvec3 shape = build_shape(push.level);
    uint64_t own = folded_group(gl_WorkGroupID, gl_NumWorkGroups) * 64 + gl_LocalInvocationIndex;
    if (own >= uint64_t(shape.x) * shape.y * shape.z) {
        return;
    }
    uvec3 at = build_at(shape, uint(own));
    uint place = uint(own);
    if (push.level < PLAN.levels) {
        if (node_word(push.level + 1, at >> 1) != FM_BUILD_INTERNAL) {
            return;
        }
        place = children_of(push.level + 1, at >> 1) + child_number(at);
    }
    uint word = node_word(push.level, at);
    bool leaf = word_leaf(word);
    emit_count(FM_BUILD_EMPTY, word_empty(word));
    if (push.level <= 4) {
        emit_count(FM_BUILD_LEAVES + push.level, leaf);
    }
    if (leaf) {
        leaf_column column = column_of(push.level, at);
        emit_word(place, ~column.first);
        if (push.level > 2) {
            emit_leaf(word, column);
        }
    } else {
        emit_word(place, word_empty(word) ? empty_word(far_bound(at, uintBitsToFloat(word))) : children_of(push.level, at));
    }
}
