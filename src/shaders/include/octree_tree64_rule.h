// SPDX-License-Identifier: MIT
#ifndef FM_OCTREE_TREE64_RULE_H
#define FM_OCTREE_TREE64_RULE_H

// TREE64: a node is three words. A bit of the first two says for each of 4^3 children (x + 4 y + 16 z, from the lowest on) whether
// anything is there. The third: of a node, where the first of its children that are there begins, and the others follow.
// FM_TREE64_LEAF: the children are solid, and values[index] is the number of the first of them; those of the others follow, but
// where FM_TREE64_SAME is set all have that one. A solid cell among nodes is a leaf with all bits set. FM_TREE64_SAME without
// FM_TREE64_LEAF: all children are leaves of one number. That stands once, in the word in front of the first of them, and they are
// two words each: most of a surface costs 8 bytes for 4^3 voxels.
//
// Top cells are of even levels; their words are where their nodes begin, 0 where nothing is there.
//
// A read is a node (12 or 8 bytes), a word of the top grid, or where a voxel's number is and the number.

#include "octree_walk_rule.h"

#define FM_TREE64_WORDS 3
#define FM_TREE64_LEAF 0x80000000u
#define FM_TREE64_SAME 0x40000000u
#define FM_TREE64_INDEX 0x3fffffffu

// How many children in front of child `at` are there.
FM_RULE fm_uint fm_tree64_before(fm_uint low, fm_uint high, fm_uint at) {
    const fm_uint below = (1u << (at & 31u)) - 1u;
    return at < 32u ? FM_ONES(low & below) : FM_ONES(low) + FM_ONES(high & below);
}

FM_RULE fm_octree_met fm_cast_tree64(fm_octree_head head, fm_v3 origin, fm_v3 way, fm_float first, fm_float last) {
    fm_octree_walk walk = fm_walk_begin(head, origin, way, first);
    fm_uint path[FM_WALK_LEVELS / 2 + 1];  // where nodes begin, by half their level
    fm_uint reads = 0u, low = 0u, high = 0u, base = 0u;
    int level = head.levels;  // of the node in `low`, `high`, `base`
    int joint = level + 1;
    bool fresh = true;  // these are not read yet
    bool thin = false;  // it has no third word
    fm_uint number_at = 0u;
    while (fm_walk_inside(walk) && walk.t <= last && reads < FM_WALK_READS) {
        bool there = true;
        if (joint > level) {
            level = FM_LEAST((joint + 1) / 2 * 2, head.levels);
            if (joint > head.levels) {
                path[level / 2] = FM_WORD(head.words, fm_walk_top(head, walk));
                there = path[level / 2] != 0u;
                reads++;
            }
            fresh = true;
            thin = false;
        }
        int skip = level;
        while (there) {
            if (fresh) {
                const fm_uint at = path[level / 2];
                low = FM_WORD(head.words, at);
                high = FM_WORD(head.words, at + 1u);
                base = thin ? FM_TREE64_LEAF | FM_TREE64_SAME : FM_WORD(head.words, at + 2u);
                reads++;
                fresh = false;
            }
            const fm_uint child = fm_walk_child(walk, level - 2, 2);
            const fm_uint word = child < 32u ? low : high;
            if (((word >> (child & 31u)) & 1u) == 0u) {
                // Of the 2^3 children around it all may be missing.
                skip = ((word >> (child & 10u)) & 0x00330033u) == 0u ? level - 1 : level - 2;
                break;
            }
            const fm_uint before = fm_tree64_before(low, high, child);
            const fm_uint first_one = base & FM_TREE64_INDEX;
            if ((base & FM_TREE64_LEAF) != 0u) {
                const fm_uint place = thin ? FM_WORD(head.words, number_at) : first_one;
                const fm_uint value = FM_WORD(head.values, place + ((base & FM_TREE64_SAME) != 0u ? 0u : before));
                return fm_walk_met(walk, way, value, reads + (thin ? 2u : 1u), level - 2);
            }
            if (level < 4) {
                return fm_walk_missed(reads);  // no file that was checked has such a node
            }
            level -= 2;
            thin = (base & FM_TREE64_SAME) != 0u;
            number_at = first_one - 1u;
            path[level / 2] = first_one + before * (thin ? 2u : FM_U(FM_TREE64_WORDS));
            fresh = true;
        }
        const fm_octree_walk next = fm_walk_leave(walk, skip);
        joint = fm_walk_common(walk, next);
        walk = next;
    }
    return fm_walk_missed(reads);
}

#endif
