// SPDX-License-Identifier: MIT
#include "fly.h"

#include <math.h>

static const float radians_a_pixel = 0.0025f;
static const float steepest = 1.55f;
static const float farthest = 524288;  // fm_camera takes no more

static float longest(fm_shape shape) {
    const uint32_t xy = shape.x > shape.y ? shape.x : shape.y;
    return (float)(xy > shape.z ? xy : shape.z);
}

static void look_at(fly *f, const float target[3]) {
    const float d[3] = {target[0] - f->position[0], target[1] - f->position[1], target[2] - f->position[2]};
    f->yaw = atan2f(d[1], d[0]);
    f->pitch = atan2f(d[2], hypotf(d[0], d[1]));
}

fly fly_start(fm_shape shape) {
    const float middle[3] = {0.5f * (float)shape.x, 0.5f * (float)shape.y, 0.4f * (float)shape.z};
    fly f = {{middle[0] - 0.55f * longest(shape), middle[1] - 0.75f * longest(shape), middle[2] + 0.5f * longest(shape)}, 0, 0};
    look_at(&f, middle);
    return f;
}

void fly_by(fly *f, const float look[2], const float move[3]) {
    f->yaw = remainderf(f->yaw - look[0] * radians_a_pixel, 6.2831853f);
    f->pitch = fmaxf(-steepest, fminf(steepest, f->pitch - look[1] * radians_a_pixel));
    const fm_camera camera = fly_camera(f);
    const float right[2] = {sinf(f->yaw), -cosf(f->yaw)};
    for (int axis = 0; axis < 3; axis++) {
        f->position[axis] += camera.forward[axis] * move[1];
        f->position[axis] += axis < 2 ? right[axis] * move[0] : move[2];
        f->position[axis] = fmaxf(-farthest, fminf(farthest, f->position[axis]));
    }
}

fm_camera fly_camera(const fly *f) {
    fm_camera camera = {.forward = {cosf(f->pitch) * cosf(f->yaw), cosf(f->pitch) * sinf(f->yaw), sinf(f->pitch)}, .up = {0, 0, 1}};
    for (int axis = 0; axis < 3; axis++) {
        camera.position[axis] = f->position[axis];
    }
    return camera;
}

fm_camera fly_path(fm_shape shape, double t) {
    const float angle = (float)(4 * 3.14159265358979 * t), wave = (float)(6 * 3.14159265358979 * t);
    const float middle[3] = {0.5f * (float)shape.x, 0.5f * (float)shape.y, 0.4f * (float)shape.z};
    const float radius = longest(shape) * (0.7f + 0.2f * cosf(wave));
    fly f = {{middle[0] + radius * cosf(angle), middle[1] + radius * sinf(angle),
              middle[2] + longest(shape) * (0.45f + 0.1f * sinf(wave))},
             0,
             0};
    look_at(&f, middle);
    return fly_camera(&f);
}
