// SPDX-License-Identifier: MIT
#ifndef FM_APP_FLY_H
#define FM_APP_FLY_H

// A camera that flies freely, and the path of the benchmark.

#include "fathom/render.h"

typedef struct fly {
    float position[3];
    float yaw, pitch;  // radians; yaw 0 looks along +x, a positive pitch up
} fly;

// Before the world's lower side, looking at its middle.
fly fly_start(fm_shape shape);
// `look` in pixels, `move` is right, forwards and up in voxels.
void fly_by(fly *f, const float look[2], const float move[3]);
fm_camera fly_camera(const fly *f);

// `t` from 0 to 1: twice around the world, rising and sinking, always looking at its middle.
fm_camera fly_path(fm_shape shape, double t);

#endif
