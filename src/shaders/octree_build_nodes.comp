// SPDX-License-Identifier: MIT
#version 460
#include "octree_build.glsl"

// Nodes of a level from 3 on, from those of the level below. An invocation owns a node: it is empty, internal, or listed to be
// tried as a leaf. Reads 32 bytes a node, writes 8.

void main() {
    uvec3 shape = build_shape(push.level);
    uint64_t own = folded_group(gl_WorkGroupID, gl_NumWorkGroups) * 64 + gl_LocalInvocationIndex;
    if (own >= uint64_t(shape.x) * shape.y * shape.z) {
        return;
    }
    uvec3 at = build_at(shape, uint(own));
    float bound = MESH_INFINITY;
    bool internal = push.level > PLAN.leaf_most || PLAN.threshold < 0;
    bool empty = true;
    for (uint i = 0; i < 8; i++) {
        uint word = node_word(push.level - 1, 2 * at + child_bits(i));
        bound = word_empty(word) ? min(bound, uintBitsToFloat(word)) : bound;
        empty = empty && word_empty(word);
        internal = internal || word == FM_BUILD_INTERNAL;
    }
    uint word = empty ? floatBitsToUint(bound) : FM_BUILD_INTERNAL;
    if (!empty && !internal) {
        fm_address list = PLAN.lists[push.level - 3];
        uint place = atomicAdd(ref_u32(list).v, 1u);
        atomicMax(ref_u32(list + 4).v, min(place + 1, FM_LIST_MAX_GROUPS));
        ref_u32(list + FM_LIST_HEADER_BYTES + uint64_t(place) * 4).v = uint(own);
        word = FM_BUILD_LEAF | place;
    }
    ref_u32(node_address(push.level, at)).v = word;
    ref_u32(item_address(push.level, at)).v = word == FM_BUILD_INTERNAL ? 1 : 0;
}
