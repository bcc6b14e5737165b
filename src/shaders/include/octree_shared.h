// SPDX-License-Identifier: MIT
#ifndef FM_OCTREE_SHARED_H
#define FM_OCTREE_SHARED_H

// What C and GLSL both know of octrees, by the rules of shared.h.

#include "shared.h"

// Kinds, codes and an attribute, as the public header numbers them (octree.c compares them).
#define FM_GPU_CLOSEST 0
#define FM_GPU_DISTANCE 1
#define FM_GPU_VOXELS 2
#define FM_GPU_CONTOURS 3
#define FM_GPU_DAG 4
#define FM_GPU_TREE64 5
#define FM_GPU_BRICKS 6
#define FM_GPU_SPHERICAL 0
#define FM_GPU_OCTAHEDRAL 1
#define FM_GPU_FLOATS 2
#define FM_GPU_SHORT 3
#define FM_GPU_PLAIN 0  // of fm_octree_attribute
#define FM_GPU_COLOR 2

// Nodes of CLOSEST, DISTANCE and VOXELS are 32-bit signed words. Below 2^30: an internal node, the index of the first of its eight
// children (x + 2 y + 4 z), which follow each other. From 2^30 on: an empty leaf, and the surface is at least (word - 2^30) /
// (2^30 - 1) * cutoff away from everywhere in it. Negative: a leaf, of number -(word + 1). Source: Demir and Westermann 2015,
// section 4.
#define FM_NODE_EMPTY 0x40000000

// Leaves of CLOSEST and DISTANCE: values stand in columns of four, those of the corners (y, z) = 00, 10, 01, 11 at one x. Leaf i
// has columns i (its lower x) and i + 1: so leaves of one level that are neighbours along x share a column, and what a leaf needs
// is one run of memory. A value is a word, three under FM_GPU_FLOATS, half of one under FM_GPU_SHORT; its attribute, if there are
// any, a word in the same place.
#define FM_COLUMN_VALUES 4

// BRICKS: the top grid's cells are bricks of 8^3 finest cells (`levels` is 3); its words are those of leaves above, and there are
// no others. Brick i has values [729 i, 729 (i + 1)): the signed distances of its 9^3 corners, floats in world units, x fastest;
// those beyond 3 + sqrt(3) cells are cut off there.
#define FM_BRICK_LEVEL 3
#define FM_BRICK_VALUES 729

// No vector of a leaf of level l is longer than this many of its cells (the band's 2 sqrt(3) and a block's diagonal): the unit of
// coded radii.
#define FM_OCTREE_REACH 7.0f

// An octree in memory that the device (or the processor) reads. The words of the other kinds are told in their own texts.
FM_PUSH_STRUCT(fm_octree_head) {
    fm_address words;       // the first are the top grid's, x fastest
    fm_address values;      // of leaves; VOXELS: a word a voxel
    fm_address attributes;  // 0: none
    fm_address extra;       // of the kind's own
    fm_int kind;
    fm_int code;
    fm_int top[3];
    fm_int levels;
    fm_float origin[3];
    fm_float cell;
    fm_float low[3], high[3];  // the box that rays enter, which the top grid holds
    fm_float cutoff;           // D of empty leaves
    fm_int mark;               // fm_octree_attribute
    fm_int sign;               // DISTANCE and BRICKS: 0 where distances have none, so that a surface is what is near
    fm_int stepped;            // 1: rays go sample by sample, as published. Set by who casts
};

// A part of a streamed octree's box: where its own octree's head is, 0 while it is not there, and how much of it shows.
FM_PUSH_STRUCT(fm_octree_part) {
    fm_address head;
    fm_float shown;  // 0 to 1
    fm_int unused;
};

// The parts of a streamed octree's box: cubes, x fastest. Where a ray is in a part that is there and within `distance` of the
// camera it goes through the part's own octree, elsewhere through the coarse one. What `shown` says is the share of a picture's
// pixels that do so: each ray sees one surface, so that depth, normal and what it reflects belong together, and a part that
// appears costs no second ray.
FM_PUSH_STRUCT(fm_octree_grid) {
    fm_address parts;  // fm_octree_part of each; 0: there are none
    fm_int count[3];
    fm_float origin[3];
    fm_float size;  // edge of a part
    fm_float distance;
};

// Voxels of a box of a world, side by side.
FM_PUSH_STRUCT(fm_octree_gather_push) {
    fm_address source;  // the box's first voxel
    fm_address target;
    fm_address row, slice;  // voxels of the world from one to the next
    fm_uint width, rows, slices;
};

// Rays of fm_octree_cast, as fm_mesh_ray and fm_octree_hit have them.
FM_PUSH_STRUCT(fm_octree_cast_push) {
    fm_address head;
    fm_address rays;
    fm_address hits;
    fm_uint count;
    fm_float epsilon;  // in world units
};

#ifdef __STDC__
_Static_assert(sizeof(fm_octree_head) == 112 && sizeof(fm_octree_part) == 16 && sizeof(fm_octree_grid) == 40,
               "as std430 lays them out");
#endif

#endif
