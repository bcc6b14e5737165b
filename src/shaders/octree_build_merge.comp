// SPDX-License-Identifier: MIT
#version 460
#include "octree_build.glsl"
#include "octree_merge.glsl"

// Listed nodes of level 3 or 4 become leaves, or internal. A group owns a node. Reads 16 bytes of each of its finest corners,
// until one says no, and 128 of each child; writes 128 bytes and its word.

shared uint children[8];
shared uint leaf_children;
shared uint node_bad;

void begin_node(uvec3 at) {
    uint own = gl_LocalInvocationIndex;
    if (own == 0) {
        merge_hint = FM_GPU_NONE;
        leaf_children = 0;
        node_bad = 0;
    }
    barrier();
    if (own < 8) {
        uint word = node_word(push.level - 1, 2 * at + child_bits(own));
        children[own] = word;
        if (word_leaf(word)) {
            atomicOr(leaf_children, 1u << own);
            atomicMin(merge_hint, leaf_corner(push.level - 1, word, 0).triangle);
        }
    }
    barrier();
    if (own < 8) {
        merge_corners[own] = corner_found((at + child_bits(own)) << push.level, merge_hint);
    }
    barrier();
}

bool children_agree(float edge) {
    uint own = gl_LocalInvocationIndex;
    uint around = own < 27 && merge_inner(own) ? merge_around(own) & leaf_children : 0;
    if (around == 0) {
        return true;
    }
    uint child = findLSB(around);
    uvec3 corner = merge_part(own) - child_bits(child);
    build_corner exact = leaf_corner(push.level - 1, children[child], corner.x + 2 * corner.y + 4 * corner.z);
    return merge_agrees(edge, 0.5 * vec3(merge_part(own)), exact);
}

void surface_stays(uvec3 at) {
    uint corners = (1u << push.level) + 1;
    float edge = float(1u << push.level);
    for (uint i = gl_LocalInvocationIndex; i < corners * corners * corners && node_bad == 0; i += 64) {
        uvec3 part = build_at(uvec3(corners), i);
        if (!merge_keeps(edge, vec3(part) / edge, corner_at((at << push.level) + part))) {
            atomicOr(node_bad, 1u);
        }
    }
}

void end_node(uvec3 at, uint place) {
    uint own = gl_LocalInvocationIndex;
    if (node_bad != 0) {
        if (own == 0) {
            ref_u32(node_address(push.level, at)).v = FM_BUILD_INTERNAL;
            ref_u32(item_address(push.level, at)).v = 1;
        }
    } else if (own < 8) {
        store_corner(PLAN.coarse[push.level - 2], uint64_t(place) * 8 + own, merge_corners[own]);
        if (word_leaf(children[own]) && push.level == 3) {
            fm_address brick = PLAN.bricks + uint64_t(children[own] & FM_BUILD_SLOT) * FM_BUILD_BRICK_BYTES;
            ref_u32(brick + 8).v = FM_BRICK_MERGED << 16;
        } else if (word_leaf(children[own])) {
            ref_u32(node_address(push.level - 1, 2 * at + child_bits(own))).v = 0;
        }
    }
}

void main() {
    fm_address list = PLAN.lists[push.level - 3];
    uint count = list_count(list);
    for (uint place = gl_WorkGroupID.x; place < count; place += gl_NumWorkGroups.x) {
        uint node = ref_u32(list + FM_LIST_HEADER_BYTES + uint64_t(place) * 4).v;
        uvec3 at = build_at(build_shape(push.level), node);
        begin_node(at);
        if (!children_agree(float(1u << push.level))) {
            atomicOr(node_bad, 1u);
        }
        barrier();
        surface_stays(at);
        barrier();
        end_node(at, place);
        barrier();
    }
}
