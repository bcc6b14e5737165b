// SPDX-License-Identifier: MIT
#ifndef FM_OCTREE_VOXELS_RULE_H
#define FM_OCTREE_VOXELS_RULE_H

// Rays through VOXELS (octree_shared.h tells what a word is). A read is a word of 4 bytes.

#include "octree_walk_rule.h"

FM_RULE fm_octree_met fm_cast_voxels(fm_octree_head head, fm_v3 origin, fm_v3 way, fm_float first, fm_float last) {
    fm_octree_walk walk = fm_walk_begin(head, origin, way, first);
    fm_uint children[FM_WALK_LEVELS];  // of the nodes on the path, by level
    fm_uint reads = 0u;
    int joint = head.levels + 1;
    while (fm_walk_inside(walk) && walk.t <= last && reads < FM_WALK_READS) {
        int level = FM_LEAST(joint, head.levels + 1) - 1;
        fm_uint word = level == head.levels ? FM_WORD(head.words, fm_walk_top(head, walk))
                                            : FM_WORD(head.words, children[level + 1] + fm_walk_child(walk, level, 1));
        reads++;
        while (word < FM_U(FM_NODE_EMPTY) && level > 0) {
            children[level] = word;
            level--;
            word = FM_WORD(head.words, word + fm_walk_child(walk, level, 1));
            reads++;
        }
        if (word >= 0x80000000u) {
            return fm_walk_met(walk, way, FM_WORD(head.values, ~word), reads + 1u, level);
        }
        const fm_octree_walk next = fm_walk_leave(walk, level);
        joint = fm_walk_common(walk, next);
        walk = next;
    }
    return fm_walk_missed(reads);
}

#endif
