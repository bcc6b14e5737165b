// SPDX-License-Identifier: MIT
#ifndef FM_OCTREE_WANTS_H
#define FM_OCTREE_WANTS_H

// Which parts of a streamed octree a camera sees, and how much it would be without them.

#include "fathom/render.h"
#include "octree/octree.h"

typedef struct fm_octree_wants {
    fm_octree_head head;  // of the coarse octree, in host memory
    fm_octree_grid grid;  // `parts` is not looked at
} fm_octree_wants;

enum { FM_WANT_WIDTH = 24, FM_WANT_HEIGHT = 16, FM_WANT_RAYS = FM_WANT_WIDTH * FM_WANT_HEIGHT, FM_WANT_TURNS = 16 };

// Adds up, in `scores` of each part, 1 / (way to it so far + a coarse cell) over the rays of a small picture: 0 for a part that no
// ray passes before it meets the surface, or only beyond the grid's distance. `turn`, below FM_WANT_TURNS, says where in its pixel
// each ray goes: all turns together see what a picture of four times as many pixels along each side sees.
// Source: Demir and Westermann 2015, section 4.4, which counts each step of a ray; here a ray counts once in a part.
void fm_octree_want(fm_pool *pool, const fm_octree_wants *wants, const fm_camera *camera, uint32_t turn, float *scores);

#endif
