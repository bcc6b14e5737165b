// SPDX-License-Identifier: MIT
#include "camera.h"

#include <math.h>

static const double PI = 3.14159265358979323846;

static void direction(double yaw, double pitch, double way[3]) {
    const double y = yaw * PI / 180, p = pitch * PI / 180;
    way[0] = cos(p) * cos(y);
    way[1] = cos(p) * sin(y);
    way[2] = sin(p);
}

fm_camera camera_look(const double position[3], double yaw, double pitch, double fov) {
    double way[3];
    direction(yaw, pitch, way);
    fm_camera camera = {.fov_y = (float)fov};
    for (int i = 0; i < 3; i++) {
        camera.position[i] = (float)position[i];
        camera.forward[i] = (float)way[i];
    }
    // What is up where the view is straight up or down.
    if (fabs(pitch) > 89.9) {
        double up[3];
        direction(yaw, 0, up);
        for (int i = 0; i < 3; i++) {
            camera.up[i] = (float)(pitch > 0 ? -up[i] : up[i]);
        }
    }
    return camera;
}

fm_camera camera_around(const double target[3], double distance, double yaw, double pitch, double fov) {
    double way[3], position[3];
    direction(yaw, pitch, way);
    for (int i = 0; i < 3; i++) {
        position[i] = target[i] - way[i] * distance;
    }
    return camera_look(position, yaw, pitch, fov);
}

static double along(const double a[3], const double b[3]) {
    return a[0] * b[0] + a[1] * b[1] + a[2] * b[2];
}

// The directions of a camera, and what one half of its picture's height and width is of the distance, with a little room.
typedef struct frame {
    double forward[3], up[3], right[3], tall, wide;
} frame;

static frame frame_of(double aspect, double yaw, double pitch, double fov) {
    const double room = 1.05;
    frame f = {.right = {sin(yaw * PI / 180), -cos(yaw * PI / 180), 0}};
    direction(yaw, pitch, f.forward);
    direction(yaw, pitch + 90, f.up);
    f.tall = tan((fov > 0 ? fov : 60) * PI / 360) / room;
    f.wide = f.tall * aspect;
    return f;
}

static void corner_of(const double low[3], const double high[3], int corner, const double from[3], double at[3]) {
    for (int i = 0; i < 3; i++) {
        at[i] = (corner >> i & 1 ? high[i] : low[i]) - from[i];
    }
}

double camera_distance(const double low[3], const double high[3], const double target[3], double aspect, double yaw, double pitch,
                       double fov) {
    const frame f = frame_of(aspect, yaw, pitch, fov);
    double distance = 0;
    for (int corner = 0; corner < 8; corner++) {
        double at[3];
        corner_of(low, high, corner, target, at);
        const double tall = fabs(along(at, f.up)) / f.tall, wide = fabs(along(at, f.right)) / f.wide;
        distance = fmax(distance, fmax(tall, wide) - along(at, f.forward));
    }
    return distance;
}

double camera_frame(const double low[3], const double high[3], double aspect, double yaw, double pitch, double fov,
                    double target[3]) {
    const frame f = frame_of(aspect, yaw, pitch, fov);
    const double origin[3] = {0.5 * (low[0] + high[0]), 0.5 * (low[1] + high[1]), 0.5 * (low[2] + high[2])};
    // How far the corners are beyond planes through `origin` with the slopes of the picture's sides.
    double above = -INFINITY, below = -INFINITY, right = -INFINITY, left = -INFINITY;
    for (int corner = 0; corner < 8; corner++) {
        double at[3];
        corner_of(low, high, corner, origin, at);
        const double ahead = along(at, f.forward), y = along(at, f.up), x = along(at, f.right);
        above = fmax(above, y - f.tall * ahead);
        below = fmax(below, -y - f.tall * ahead);
        right = fmax(right, x - f.wide * ahead);
        left = fmax(left, -x - f.wide * ahead);
    }
    for (int i = 0; i < 3; i++) {
        target[i] = origin[i] + 0.5 * (above - below) * f.up[i] + 0.5 * (right - left) * f.right[i];
    }
    return fmax((above + below) / f.tall, (right + left) / f.wide) / 2;
}

fm_camera camera_fit(fm_shape shape, double aspect, double yaw, double pitch, double fov) {
    const double low[3] = {-0.5, -0.5, -0.5}, high[3] = {shape.x - 0.5, shape.y - 0.5, shape.z - 0.5};
    const double middle[3] = {0.5 * shape.x - 0.5, 0.5 * shape.y - 0.5, 0.5 * shape.z - 0.5};
    return camera_around(middle, camera_distance(low, high, middle, aspect, yaw, pitch, fov), yaw, pitch, fov);
}

// Into the air above a place, at least `room` from all that is solid.
static fm_result rise(fm_world *world, double room, float position[3]) {
    fm_world_desc desc;
    fm_world_info(world, &desc);
    const float top = (float)desc.shape.z + (float)room;
    const float step = (float)fmax(room * 0.5, 1);
    for (; position[2] < top; position[2] += step) {
        fm_world_sample sample;
        const fm_result result = fm_world_query(world, (const float(*)[3])position, 1, &sample);
        if (result != FM_OK || (double)sample.distance >= room) {
            return result;
        }
    }
    return FM_OK;
}

fm_result camera_tour(fm_world *world, uint32_t i, uint32_t count, double aspect, fm_camera *camera) {
    fm_world_desc desc;
    fm_world_info(world, &desc);
    const fm_shape shape = desc.shape;
    const double part = (double)i / count;
    if (i % 2 == 0) {
        // Nearer than all of the world would need: pictures are of the world, not of the sky.
        const double yaw = 45 + 360 * part, pitch = -28 - 12 * sin(4 * PI * part);
        const double middle[3] = {0.5 * shape.x, 0.5 * shape.y, 0.4 * shape.z};
        const fm_camera whole = camera_fit(shape, aspect, yaw, pitch, 60);
        double far = 0;
        for (int k = 0; k < 3; k++) {
            far += ((double)whole.position[k] - middle[k]) * ((double)whole.position[k] - middle[k]);
        }
        *camera = camera_around(middle, 0.6 * sqrt(far), yaw, pitch, 60);
        return FM_OK;
    }
    const double turn = 2 * PI * part;
    const double position[3] = {shape.x * (0.5 + 0.4 * cos(turn)), shape.y * (0.5 + 0.4 * sin(turn)),
                                shape.z * (i % 4 == 1 ? 0.15 : 0.75)};
    // Along the circle, somewhat inwards.
    *camera = camera_look(position, 360 * part + 110, i % 4 == 1 ? -8 : -25, 60);
    return rise(world, 0.012 * shape.z + 1.5, camera->position);
}
