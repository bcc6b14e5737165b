// SPDX-License-Identifier: MIT
#ifndef FM_CLI_CAMERA_H
#define FM_CLI_CAMERA_H

// Cameras as people place them: a position and two angles in degrees. Yaw 0 looks along +x, 90 along +y; pitch 90 looks straight
// up.

#include "fathom/render.h"

fm_camera camera_look(const double position[3], double yaw, double pitch, double fov);
// Looks at `target` from `distance` away.
fm_camera camera_around(const double target[3], double distance, double yaw, double pitch, double fov);
// How far from `target` all of a box is in the picture, whose width is `aspect` times its height, with a little room beside it.
double camera_distance(const double low[3], const double high[3], const double target[3], double aspect, double yaw, double pitch,
                       double fov);
// The same of the target for which the box is in the middle of the picture and as large as can be.
double camera_frame(const double low[3], const double high[3], double aspect, double yaw, double pitch, double fov,
                    double target[3]);
// Looks at the middle of a world from where all of it is in the picture, whose width is `aspect` times its height.
fm_camera camera_fit(fm_shape shape, double aspect, double yaw, double pitch, double fov);

// Camera `i` of `count` of a path that is the same everywhere: every other one on an orbit around the world, the others within it,
// low over the ground and in the air.
fm_result camera_tour(fm_world *world, uint32_t i, uint32_t count, double aspect, fm_camera *camera);

#endif
