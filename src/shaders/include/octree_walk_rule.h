// SPDX-License-Identifier: MIT
#ifndef FM_OCTREE_WALK_RULE_H
#define FM_OCTREE_WALK_RULE_H

// How rays go from cell to cell through the trees of voxels. A ray is mirrored so that it never goes down along an axis. Its place
// is the finest cell that it is in, in integers: a cell of level l is left through its far faces, the cell across the nearest of
// them is entered, and the other two coordinates are where the ray is then, held within the cell that was left. So every step goes
// forward whatever rounding does. Between two cells the path in the tree up to the highest bit in which their coordinates differ
// stays the same.

#include "octree_rule.h"

// A ray that has read so much has met nothing: no file keeps one going. Between two reads there are few steps, within one node.
#define FM_WALK_READS 131072u
#define FM_WALK_LEVELS 21  // levels that a path may have: the finest is 0, top cells are of 20 at most

#ifdef __STDC__
#define FM_HIGHEST(x) (31 - __builtin_clz(x))
#define FM_ONES(x) ((fm_uint)__builtin_popcount(x))
typedef union fm_walk_number {
    float real;
    uint32_t bits;
} fm_walk_number;
#define FM_BITS_OF(x) (((fm_walk_number){.real = (x)}).bits)
#define FM_REAL_OF(x) (((fm_walk_number){.bits = (x)}).real)
#else
#define FM_BITS_OF(x) floatBitsToUint(x)
#define FM_REAL_OF(x) uintBitsToFloat(x)
#define FM_HIGHEST(x) findMSB(x)
#define FM_ONES(x) uint(bitCount(x))
#endif

// Lengths in finest cells, times in units of the ray's way. Places are not mirrored: from the far end of a large top grid they
// would lose their last bits.
FM_PUSH_STRUCT(fm_octree_walk) {
    fm_float from[3], along[3], inverse[3];
    fm_int size[3];    // of the top grid; cells from there on are outside
    fm_int cell[3];    // mirrored
    fm_int turned[3];  // 1: this axis is mirrored
    fm_float t;        // when the cell was entered
    fm_int axis;       // across which face; 3: the ray begins in it
};

// Where a face at a mirrored coordinate is.
FM_RULE fm_float fm_walk_face(fm_octree_walk walk, int axis, fm_int at) {
    return FM_F(walk.turned[axis] != 0 ? walk.size[axis] - at : at);
}

// The mirrored coordinate, from `least` to `most`, that the ray has at its present time.
FM_RULE fm_int fm_walk_at(fm_octree_walk walk, int axis, fm_int least, fm_int most) {
    const bool turned = walk.turned[axis] != 0;
    const fm_int low = turned ? walk.size[axis] - 1 - most : least;
    const fm_int high = turned ? walk.size[axis] - 1 - least : most;
    const fm_float at = FM_FLOOR_OF(walk.from[axis] + walk.along[axis] * walk.t);
    const fm_int cell = FM_I(FM_MIN(FM_MAX(at, FM_F(low)), FM_F(high)));
    return turned ? walk.size[axis] - 1 - cell : cell;
}

FM_RULE fm_octree_walk fm_walk_begin(fm_octree_head head, fm_v3 origin, fm_v3 way, fm_float first) {
    fm_float from[3];
    fm_float along[3];
    from[0] = origin.x;
    from[1] = origin.y;
    from[2] = origin.z;
    along[0] = way.x;
    along[1] = way.y;
    along[2] = way.z;
    fm_octree_walk walk;
    walk.t = first;
    walk.axis = 3;
    for (int i = 0; i < 3; i++) {
        walk.from[i] = (from[i] - head.origin[i]) / head.cell;
        walk.along[i] = along[i] / head.cell;
        walk.size[i] = head.top[i] << head.levels;
        walk.turned[i] = along[i] < 0 ? 1 : 0;
        const fm_float speed = FM_MAX(FM_SIZE_OF(walk.along[i]), 1e-30f);
        walk.inverse[i] = 1.0f / (along[i] < 0 ? -speed : speed);
        const fm_float enter = (fm_walk_face(walk, i, 0) - walk.from[i]) * walk.inverse[i];
        walk.axis = enter > walk.t ? i : walk.axis;
        walk.t = FM_MAX(walk.t, enter);
    }
    for (int i = 0; i < 3; i++) {
        walk.cell[i] = fm_walk_at(walk, i, i == walk.axis ? 0 : -1, walk.size[i]);
    }
    return walk;
}

FM_RULE bool fm_walk_inside(fm_octree_walk walk) {
    return walk.cell[0] >= 0 && walk.cell[1] >= 0 && walk.cell[2] >= 0 && walk.cell[0] < walk.size[0] &&
           walk.cell[1] < walk.size[1] && walk.cell[2] < walk.size[2];
}

// The cell as it lies in memory.
FM_RULE fm_int fm_walk_cell(fm_octree_walk walk, int axis) {
    return walk.turned[axis] != 0 ? walk.size[axis] - 1 - walk.cell[axis] : walk.cell[axis];
}

// To the next cell behind the cell of this level.
FM_RULE fm_octree_walk fm_walk_leave(fm_octree_walk given, int level) {
    fm_octree_walk walk = given;
    fm_int end[3];
    fm_float leave[3];
    for (int i = 0; i < 3; i++) {
        end[i] = ((walk.cell[i] >> level) + 1) << level;
        leave[i] = (fm_walk_face(walk, i, end[i]) - walk.from[i]) * walk.inverse[i];
    }
    walk.axis = leave[0] <= leave[1] && leave[0] <= leave[2] ? 0 : leave[1] <= leave[2] ? 1 : 2;
    walk.t = FM_MAX(walk.t, FM_MIN(leave[0], FM_MIN(leave[1], leave[2])));
    for (int i = 0; i < 3; i++) {
        const fm_int inside = fm_walk_at(walk, i, walk.cell[i], end[i] - 1);
        walk.cell[i] = i == walk.axis ? end[i] : inside;
    }
    return walk;
}

// The lowest level at which the path to one cell is that to the other; above `levels` where not even the top cell is.
FM_RULE int fm_walk_common(fm_octree_walk a, fm_octree_walk b) {
    const fm_uint differ = FM_U((a.cell[0] ^ b.cell[0]) | (a.cell[1] ^ b.cell[1]) | (a.cell[2] ^ b.cell[2]));
    return differ == 0u ? 0 : FM_HIGHEST(differ) + 1;
}

FM_RULE fm_uint fm_walk_top(fm_octree_head head, fm_octree_walk walk) {
    const fm_int x = fm_walk_cell(walk, 0) >> head.levels;
    const fm_int y = fm_walk_cell(walk, 1) >> head.levels;
    const fm_int z = fm_walk_cell(walk, 2) >> head.levels;
    return FM_U(x + head.top[0] * (y + head.top[1] * z));
}

// Which of b^3 children of 2^level finest cells, b = 2^branch.
FM_RULE fm_uint fm_walk_child(fm_octree_walk walk, int level, int branch) {
    const fm_int most = (1 << branch) - 1;
    const fm_int x = (fm_walk_cell(walk, 0) >> level) & most;
    const fm_int y = (fm_walk_cell(walk, 1) >> level) & most;
    const fm_int z = (fm_walk_cell(walk, 2) >> level) & most;
    return FM_U(x | (y << branch) | (z << (2 * branch)));
}

FM_RULE fm_octree_met fm_walk_missed(fm_uint reads) {
    fm_octree_met met;
    met.t = FM_INFINITY_F;
    for (int i = 0; i < 3; i++) {
        met.normal[i] = 0;
    }
    met.mark = 0u;
    met.reads = reads;
    met.level = 0;
    return met;
}

// The face through which the cell was entered; where the ray begins inside, against the ray.
FM_RULE fm_octree_met fm_walk_met(fm_octree_walk walk, fm_v3 way, fm_uint number, fm_uint reads, int level) {
    fm_octree_met met;
    met.t = walk.t;
    for (int i = 0; i < 3; i++) {
        met.normal[i] = walk.axis == i ? (walk.turned[i] != 0 ? 1.0f : -1.0f) : 0.0f;
    }
    if (walk.axis > 2) {
        met.normal[0] = -way.x;
        met.normal[1] = -way.y;
        met.normal[2] = -way.z;
    }
    met.mark = number;
    met.reads = reads;
    met.level = level;
    return met;
}

#endif
