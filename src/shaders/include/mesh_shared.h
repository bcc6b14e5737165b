// SPDX-License-Identifier: MIT
#ifndef FM_MESH_SHARED_H
#define FM_MESH_SHARED_H

// What C and GLSL both know of meshes, by the rules of shared.h.

#include "rtsdf_rule.h"
#include "shared.h"
#include "voxel_rule.h"

// Where a mesh lies: vertices of three floats, triangles of three indices, its tree. The tree is an array of nodes, one for each
// triangle but at least one, and behind them a record for each triangle in the order of the leaves. bvh.glsl says what is in both.
FM_PUSH_STRUCT(fm_mesh_refs) {
    fm_address vertices;
    fm_address triangles;
    fm_address nodes;
    fm_uint triangle_count;
    fm_uint vertex_count;
};

#define FM_NODE_BYTES 64
#define FM_RECORD_BYTES 48
#define FM_LEAF_TRIANGLES 4  // a subtree of no more is a leaf

// Features of a triangle, as fm_feature numbers them.
#define FM_GPU_FACE 0
#define FM_GPU_EDGE_0 1    // and two more
#define FM_GPU_CORNER_0 4  // and two more

// Work lists of voxelisation: two counts of triangles, the groups of an indirect dispatch for each, then a triangle an entry.
#define FM_VOXELIZE_LARGE 0  // a group each
#define FM_VOXELIZE_HUGE 4   // FM_VOXELIZE_PARTS groups each; from the list's back
#define FM_VOXELIZE_LARGE_GROUPS 8
#define FM_VOXELIZE_HUGE_GROUPS 20
#define FM_VOXELIZE_ENTRIES 32
#define FM_VOXELIZE_PARTS 64u
#define FM_VOXELIZE_SMALL 64u            // voxels or rows that an invocation tries by itself
#define FM_VOXELIZE_GROUP_COLUMNS 4096u  // that a group does by itself

// Triangles to voxels.
FM_PUSH_STRUCT(fm_voxelize_push) {
    fm_mesh_refs mesh;
    fm_address voxels;  // or counts of crossings: 32 bits for each voxel of the slices in question
    fm_address lists;
    fm_voxel_grid grid;
    fm_uint row_words;
    fm_uint z_begin, z_end;  // the slices whose crossings are counted
};

// Counts of crossings to voxels inside, for `slices` slices from z_begin on.
FM_PUSH_STRUCT(fm_voxel_fill_push) {
    fm_address counts;
    fm_address voxels;
    fm_uint x, y;
    fm_uint z_begin, slices;
    fm_uint row_words;
};

// A step of jump flooding.
FM_PUSH_STRUCT(fm_flood_push) {
    fm_address bits;    // voxels, for the first step
    fm_address source;  // seeds, for the others
    fm_address target;  // seeds; of the last step distances
    fm_int shape[3];
    fm_uint row_words;
    fm_int step;
    fm_float weight[3];  // fm_seed_distance2
    fm_float unit;       // smallest edge of a voxel, in world units
    fm_float beta;       // likewise
};

// Rays from the texels of the fine field. Lengths are in world units.
FM_PUSH_STRUCT(fm_trace_push) {
    fm_mesh_refs mesh;
    fm_address coarse;
    fm_address fine;
    fm_int shape[3];  // of the coarse field
    fm_float origin[3];
    fm_float spacing[3];  // of the fine one
    fm_float mask, alpha, bias;
    fm_uint frame, seed, rays;
    fm_uint first;  // 1: the fine field holds nothing yet
};

// What mesh_query.comp answers.
#define FM_QUERY_CLOSEST 0
#define FM_QUERY_FIRST 1
#define FM_QUERY_ANY 2

#define FM_MOMENT_BYTES 64  // of a child; a node has two

// Questions and answers as the public structs have them: fm_closest, fm_mesh_ray, fm_mesh_hit; winding numbers are floats.
FM_PUSH_STRUCT(fm_query_push) {
    fm_mesh_refs mesh;
    fm_address moments;
    fm_address questions;
    fm_address answers;
    fm_uint count;
    fm_float bound;  // of the closest; of winding numbers the accuracy
};

#ifdef __STDC__
_Static_assert(sizeof(fm_voxelize_push) <= 128 && sizeof(fm_trace_push) <= 128, "push constants are 128 bytes on every device");
#endif

// Building the tree. Keys are sorted by a radix of 8 bits in tiles; consecutive tiles make a run, which one group does.
#define FM_TREE_THREADS 256
#define FM_SORT_TILE 1024
#define FM_SORT_MOST_RUNS 2048
#define FM_SORT_DIGITS 256
#define FM_KEY_BITS 32
#define FM_KEY_UNFIT 0xffffffffu  // of a triangle that does not fit; others are below 2^30

FM_PUSH_STRUCT(fm_tree_push) {
    fm_mesh_refs mesh;
    fm_address box;                  // of the triangles' centres: low x, y, z, high x, y, z as numbers that order as the floats do
    fm_address keys, numbers;        // of the triangles, in order once they are sorted
    fm_address keys_to, numbers_to;  // where a pass of the sort puts them
    fm_address counts;               // of keys: for each digit its runs; then the digits' sums
    fm_address meetings;             // a word a node, FM_GPU_NONE at first: the far end of the child that came first
    fm_address moments;              // two a node
    fm_uint shift;                   // of the digit
    fm_uint runs, run_tiles;
};

// Normals of features. Where the parts of the buffer `joints` lie: words of a triangle's three edges (the triangle across, or
// FM_GPU_NONE) and of its three corners (the number of their position); for each position where the list of its triangles starts,
// and the lists; four floats a position, its normal; and the edges across which nothing is joined, two vertices each.
FM_PUSH_STRUCT(fm_joints) {
    fm_address across;
    fm_address places;
    fm_address starts;
    fm_address lists;
    fm_address normals;
    fm_address open_edges;
    fm_uint position_count;
    fm_uint open_count;
};

FM_PUSH_STRUCT(fm_normals_push) {
    fm_mesh_refs mesh;
    fm_address joints;  // an fm_joints
};

// Fields. A coarse block has 16^3 texels, a middle one 4^3: 64 of them to a coarse one.
#define FM_SDF_COARSE 16
#define FM_SDF_MIDDLE 4
#define FM_SDF_UNSIGNED 0
#define FM_SDF_PSEUDONORMAL 1
#define FM_SDF_WINDING 2
#define FM_SDF_CROSSINGS 3  // bits of the texels inside stand where the push has `moments`

// What precedes the blocks in scratch memory: two lists, of coarse and of middle blocks to be looked into, and the band's width.
#define FM_SDF_LIST_COARSE 0
#define FM_SDF_LIST_MIDDLE 16
#define FM_SDF_BAND 32
#define FM_SDF_HEADER_BYTES 64

// Texel i of an axis lies at origin + i spacing, each a sum of two floats.
FM_PUSH_STRUCT(fm_sdf_push) {
    fm_mesh_refs mesh;
    fm_address distance;
    fm_address triangles;  // 0: not wanted
    fm_address scratch;
    fm_address moments;
    fm_address joints;  // an fm_joints
    fm_uint size_xy;    // x | y << 16
    fm_uint size_z;
    fm_float origin[3], origin_rest[3];
    fm_float spacing[3], spacing_rest[3];
};

// Near fields, whose far texels need no distance of their own: the middle blocks near the surface. Beside the band's width what
// precedes them is their list, how far texels near the surface look, and the side of a grid that no surface is near, 1 inside. Then
// follow, each from a multiple of 16 on: a bit for each block, whole words a row; a bit for each row that has one, whole words a
// slice; a bit for each slice that has one; the list's entries; and where distances are flooded, twice a cell for each block.
#define FM_NEAR_LIST 0
#define FM_NEAR_REACH 36
#define FM_NEAR_SIDE 60              // last, so that it is cleared with the bits
#define FM_NEAR_SMALL 64u            // blocks that an invocation tries by itself
#define FM_NEAR_GROUP_COLUMNS 1024u  // that a group does by itself

FM_PUSH_STRUCT(fm_near_push) {
    fm_mesh_refs mesh;
    fm_address bits;
    fm_address lists;    // as voxelisation has them
    fm_voxel_grid grid;  // of blocks
    fm_float reach[3];   // in its units
    fm_uint row_words;
};

#define FM_NEAR_CELL_BYTES 16  // a point of the surface and its triangle, FM_GPU_NONE where none is known

// A step of flooding the blocks with points near to them.
FM_PUSH_STRUCT(fm_near_flood_push) {
    fm_address source, target;  // cells
    fm_int shape[3];
    fm_int step;
    fm_float origin[3];  // middle of block 0
    fm_float spacing[3];
};

// Scenes. Up to FM_SCENE_RUN consecutive vertices of an object that has moved, and the object's place among those given.
#define FM_SCENE_RUN 256

FM_PUSH_STRUCT(fm_gpu_run) {
    fm_uint first, count;
    fm_uint place;
    fm_uint unused;
};

FM_PUSH_STRUCT(fm_scene_push) {
    fm_address rest;      // the vertices in their objects' frames
    fm_address vertices;  // in the scene's
    fm_address runs;
    fm_address places;  // twelve floats each
    fm_uint run_count;
};

#ifdef __STDC__
_Static_assert(sizeof(fm_near_push) <= 128, "push constants are 128 bytes on every device");
_Static_assert(sizeof(fm_sdf_push) <= 128, "push constants are 128 bytes on every device");
_Static_assert(sizeof(fm_joints) == 56, "as std430 lays it out");
_Static_assert(sizeof(fm_query_push) <= 128, "push constants are 128 bytes on every device");
_Static_assert(sizeof(fm_tree_push) <= 128, "push constants are 128 bytes on every device");
#endif

#endif
