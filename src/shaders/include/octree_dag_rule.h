// SPDX-License-Identifier: MIT
#ifndef FM_OCTREE_DAG_RULE_H
#define FM_OCTREE_DAG_RULE_H

// DAG: identical parts of an octree are kept once. Source: Kaempe, Sintorn and Assarsson 2013, "High resolution sparse voxel DAGs".
//
// A node above FM_DAG_LEAF_LEVEL: a word whose low eight bits say which children (x + 2 y + 4 z) are there, then a word for each of
// them: where it begins, or FM_DAG_SOLID where all of it is solid. A node of FM_DAG_LEAF_LEVEL is two words, a bit for each of its
// 4^3 voxels (x + 4 y + 16 z), as later work has it: the two lowest levels of pointers would cost more than what sharing saves.
// Words of the top grid are as those of children, 0 where nothing is there. Voxels have no numbers: hits say 0.
//
// A read is a word of 4 bytes.

#include "octree_walk_rule.h"

#define FM_DAG_LEAF_LEVEL 2
#define FM_DAG_SOLID 0xffffffffu

FM_RULE fm_octree_met fm_cast_dag(fm_octree_head head, fm_v3 origin, fm_v3 way, fm_float first, fm_float last) {
    fm_octree_walk walk = fm_walk_begin(head, origin, way, first);
    fm_uint path[FM_WALK_LEVELS];   // nodes by their level
    fm_uint there[FM_WALK_LEVELS];  // and which children they have
    fm_uint reads = 0u, low = 0u, high = 0u;
    int joint = head.levels + 1;
    while (fm_walk_inside(walk) && walk.t <= last && reads < FM_WALK_READS) {
        int level = FM_LEAST(joint, head.levels);  // of the lowest node on the path that holds the cell
        fm_uint node = 1u;
        bool fresh = false;
        if (joint > head.levels) {
            node = FM_WORD(head.words, fm_walk_top(head, walk));
            fresh = true;
            reads++;
        } else if (level > FM_DAG_LEAF_LEVEL) {
            node = path[level];
        } else {
            level = FM_DAG_LEAF_LEVEL;
        }
        // Down while there are nodes; what ends it is the word of a cell of `level`.
        while (node != 0u && node != FM_DAG_SOLID && level > FM_DAG_LEAF_LEVEL) {
            if (fresh) {
                path[level] = node;
                there[level] = FM_WORD(head.words, node);
                reads++;
            }
            const fm_uint child = fm_walk_child(walk, level - 1, 1);
            const fm_uint mask = there[level];
            const bool full = ((mask >> child) & 1u) != 0u;
            const fm_uint before = FM_ONES(mask & ((1u << child) - 1u));
            node = full ? FM_WORD(head.words, node + 1u + before) : 0u;
            reads += full ? 1u : 0u;
            level--;
            fresh = true;
        }
        if (node != 0u && node != FM_DAG_SOLID) {
            if (fresh) {
                low = FM_WORD(head.words, node);
                high = FM_WORD(head.words, node + 1u);
                reads += 2u;
            }
            const fm_uint child = fm_walk_child(walk, 0, 2);
            const fm_uint bits = child < 32u ? low : high;
            if (((bits >> (child & 31u)) & 1u) != 0u) {
                return fm_walk_met(walk, way, 0u, reads, 0);
            }
            // Of the 2^3 voxels around it all may be missing.
            level = ((bits >> (child & 10u)) & 0x00330033u) == 0u ? 1 : 0;
        } else if (node == FM_DAG_SOLID) {
            return fm_walk_met(walk, way, 0u, reads, level);
        }
        const fm_octree_walk next = fm_walk_leave(walk, level);
        joint = fm_walk_common(walk, next);
        walk = next;
    }
    return fm_walk_missed(reads);
}

#endif
