// SPDX-License-Identifier: MIT
#ifndef FM_OCTREE_PICTURE_SHARED_H
#define FM_OCTREE_PICTURE_SHARED_H

// What C and GLSL both know of pictures of octrees, by the rules of shared.h.

#include "octree_shared.h"

// The numbers of fm_octree_picture_view (octree_picture.c compares them).
#define FM_GPU_OCTREE_SHADED 0
#define FM_GPU_OCTREE_NORMALS 1
#define FM_GPU_OCTREE_READS 2
#define FM_GPU_OCTREE_LEVELS 3

#define FM_OCTREE_TILE 8         // pixels along the edge of a tile, which has a beam of its own
#define FM_OCTREE_BEAM_STEPS 32  // at most
// Room that a beam leaves to its rays, for short steps are no better for a tile than for each: finest cells, at most this part of
// the box's diagonal.
#define FM_OCTREE_BEAM_ROOM 24.0f
#define FM_OCTREE_BEAM_PART (1.0f / 64)
#define FM_OCTREE_HOT_READS 64  // what the heat map shows brightest

// Rays of a pixel besides the first: to the sun, reflected, inside, out again.
#define FM_OCTREE_SECOND_RAYS 6

// A picture, in memory that the host writes for each. The ray of pixel (x, y) goes along corner + x right + y down.
FM_PUSH_STRUCT(fm_octree_scene) {
    fm_octree_grid grid;  // of a streamed octree's parts
    fm_address head;      // the octree's, or the coarse one's
    fm_address pixels;    // fm_octree_pixel of each
    fm_address seconds;   // two words of each pixel: second rays, their reads. 0: not wanted
    fm_address beams;     // two words of each tile: until when its rays meet nothing, reads. 0: there are none
    fm_address picture;
    fm_float origin[3];
    fm_float corner[3];
    fm_float right[3];
    fm_float down[3];
    fm_float sun[3];  // towards it, of length 1
    fm_int width, height;
    fm_float epsilon;  // finest cells
    fm_float lift;     // how far above the surface second rays begin, in finest cells
    fm_float reflection;
    fm_float refraction;
    fm_int stepped;
};

// What a pixel's ray met.
FM_PUSH_STRUCT(fm_octree_pixel) {
    fm_float t;  // +infinity: nothing
    fm_uint normal;
    fm_uint mark;
    fm_uint reads;  // 32 reads + level
};

FM_PUSH_STRUCT(fm_octree_picture_push) {
    fm_address scene;
};

#ifdef __STDC__
_Static_assert(sizeof(fm_octree_scene) == 168 && sizeof(fm_octree_pixel) == 16, "as std430 lays them out");
#endif

#endif
