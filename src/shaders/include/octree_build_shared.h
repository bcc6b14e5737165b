// SPDX-License-Identifier: MIT
#ifndef FM_OCTREE_BUILD_SHARED_H
#define FM_OCTREE_BUILD_SHARED_H

// What C and GLSL both know of octrees of vectors that the device builds.
//
// Nodes of level 2 are bricks of 4^3 finest cells. Brick b has corners 4 b ... 4 b + 4, of which block b of corners keeps the first
// four along each axis. Blocks near the surface are listed; a block's place in the list is its slot, and a brick's likewise. Nodes
// of greater levels have a word each, dense: bits of a float, the bound of an empty node; or the mark of a leaf and its slot, or
// that of an internal node.

#include "mesh_shared.h"
#include "octree_shared.h"

#define FM_BUILD_BLOCK 4
#define FM_BUILD_CORNERS 64                                // of a block
#define FM_BUILD_CORNER_BYTES 16                           // a vector in finest cells, a triangle or FM_GPU_NONE
#define FM_BUILD_COARSE_BYTES (8 * FM_BUILD_CORNER_BYTES)  // corners of a leaf of level 2 or more

// A node's word.
#define FM_BUILD_LEAF 0x80000000u
#define FM_BUILD_INTERNAL 0xc0000000u
#define FM_BUILD_SLOT 0x3fffffffu

// A brick: two words of its finest leaves; then the leaves of level 1, 8 bits, the internal nodes of level 1, 8 bits, and its
// state; then the bound of an empty one.
#define FM_BUILD_BRICK_BYTES 16
#define FM_BRICK_EMPTY 0
#define FM_BRICK_LEAF 1
#define FM_BRICK_INTERNAL 2
#define FM_BRICK_MERGED 3

// Rows of nodes along x in chunks of 128^3 cells: of levels 0 to 4, by z and y. A row has a mask of its leaves, 128 bits, and the
// number of the first of its columns.
#define FM_BUILD_CHUNK 128
#define FM_BUILD_ROWS 21824  // 128^2 + 64^2 + 32^2 + 16^2 + 8^2
#define FM_BUILD_ROW_BYTES 16

// Sums over many words.
#define FM_BUILD_SCAN_THREADS 256
#define FM_BUILD_SCAN_EACH 8
#define FM_BUILD_SCAN_TILE 2048

// What is counted, words: groups of children, columns, empty leaves, leaves of levels 0 to 4, errors of stored vectors.
#define FM_BUILD_GROUPS 0
#define FM_BUILD_COLUMNS 1
#define FM_BUILD_EMPTY 2
#define FM_BUILD_LEAVES 3
#define FM_BUILD_ERRORS 8
#define FM_BUILD_BINS 4096
#define FM_BUILD_ERROR_STEP 2e-5f
#define FM_BUILD_TOTALS (FM_BUILD_ERRORS + FM_BUILD_BINS)

FM_PUSH_STRUCT(fm_build_plan) {
    fm_mesh_refs mesh;     // in finest cells from the box's origin
    fm_address near;       // header of the list of blocks
    fm_address entries;    // blocks by slot
    fm_address slots;      // of each block, or FM_GPU_NONE
    fm_address corners;    // FM_BUILD_CORNERS a slot
    fm_address bricks;     // by slot
    fm_address coarse[3];  // corners of leaves of level 2, by slot, and of levels 3 and 4, by their place in the list
    fm_address lists[2];   // of nodes of levels 3 and 4 that may become leaves: a header, and from 16 bytes on their numbers
    fm_address nodes;      // words of levels 3 and up
    fm_address items;      // groups of children, of each node of levels 2 and up; once summed, of those before it
    fm_address rows;
    fm_address columns;
    fm_address totals;
    fm_address words;
    fm_address values;
    fm_address attributes;  // 0: none
    fm_uint cells[3];
    fm_uint top[3];
    fm_uint chunks[3];
    fm_uint levels;
    fm_uint leaf_most;
    fm_uint first[24];  // of each level in `nodes`
    fm_uint above;      // nodes above level leaf_most
    fm_uint sampled;    // one in so many vectors is looked at for its error, a power of two
    fm_uint share;
    fm_float cell;  // in world units
    fm_float band;
    fm_float reach;  // corners farther than this, in finest cells, are not known
    fm_float threshold;
    fm_float cutoff;  // of empty leaves
    fm_float slack;   // of bounds: what rounding does to places, in finest cells
};

FM_PUSH_STRUCT(fm_build_push) {
    fm_address plan;
    fm_uint level;
};

FM_PUSH_STRUCT(fm_scan_push) {
    fm_address counts;
    fm_address sums;   // of tiles
    fm_address total;  // a word
    fm_uint count;
};

#ifdef __STDC__
_Static_assert(sizeof(fm_build_plan) == 352, "as std430 lays it out");
#endif

#endif
