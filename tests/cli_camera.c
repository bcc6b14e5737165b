// SPDX-License-Identifier: MIT
// Cameras that commands place by themselves: all of a box is in the picture, and little beside it.

#include "../cli/camera.h"

#include "check.h"
#include "random.h"

#include <math.h>

static double dot(const double a[3], const double b[3]) {
    return a[0] * b[0] + a[1] * b[1] + a[2] * b[2];
}

// How far the box's corners are from the middle of the picture, as parts of the way to its sides: to each the farthest.
static void extent(const fm_camera *camera, const double low[3], const double high[3], double aspect, double sides[4]) {
    double forward[3], right[3], up[3];
    for (int i = 0; i < 3; i++) {
        forward[i] = (double)camera->forward[i];
        sides[i] = -INFINITY;
    }
    sides[3] = -INFINITY;
    const double flat = hypot(forward[0], forward[1]);
    right[0] = forward[1] / flat;
    right[1] = -forward[0] / flat;
    right[2] = 0;
    for (int i = 0; i < 3; i++) {
        const int j = (i + 1) % 3, k = (i + 2) % 3;
        up[i] = right[j] * forward[k] - right[k] * forward[j];
    }
    const double slope = tan((double)camera->fov_y * 3.14159265358979 / 360);
    for (int corner = 0; corner < 8; corner++) {
        double at[3];
        for (int i = 0; i < 3; i++) {
            at[i] = (corner >> i & 1 ? high[i] : low[i]) - (double)camera->position[i];
        }
        const double ahead = dot(at, forward), y = dot(at, up) / (slope * ahead), x = dot(at, right) / (slope * aspect * ahead);
        CHECK(ahead > 0);
        sides[0] = fmax(sides[0], x);
        sides[1] = fmax(sides[1], -x);
        sides[2] = fmax(sides[2], y);
        sides[3] = fmax(sides[3], -y);
    }
}

static void check_box(const double low[3], const double high[3], double aspect, double yaw, double pitch) {
    double sides[4], target[3];
    const double distance = camera_frame(low, high, aspect, yaw, pitch, 60, target);
    fm_camera camera = camera_around(target, distance, yaw, pitch, 60);
    extent(&camera, low, high, aspect, sides);
    const double wide = fmax(sides[0], sides[1]), tall = fmax(sides[2], sides[3]);
    CHECK(wide <= 0.953 && tall <= 0.953 && fmax(wide, tall) >= 0.951);
    // What touches one side touches the one across.
    CHECK(wide < tall || fabs(sides[0] - sides[1]) < 1e-3);
    CHECK(tall < wide || fabs(sides[2] - sides[3]) < 1e-3);
    const double middle[3] = {0.5 * (low[0] + high[0]), 0.5 * (low[1] + high[1]), 0.5 * (low[2] + high[2])};
    const double farther = camera_distance(low, high, middle, aspect, yaw, pitch, 60);
    camera = camera_around(middle, farther, yaw, pitch, 60);
    extent(&camera, low, high, aspect, sides);
    const double most = fmax(fmax(sides[0], sides[1]), fmax(sides[2], sides[3]));
    CHECK(most <= 0.953 && most >= 0.951);
}

static double unit(uint64_t *seed) {
    return test_between(seed, 0, 1 << 20) / (double)(1 << 20);
}

int main(void) {
    uint64_t seed = 11;
    for (int i = 0; i < 2000; i++) {
        double low[3], high[3];
        for (int k = 0; k < 3; k++) {
            low[k] = 20 * unit(&seed) - 10;
            high[k] = low[k] + pow(10, 3 * unit(&seed) - 1);
        }
        const double aspect = 0.4 + 2 * unit(&seed), yaw = 360 * unit(&seed);
        check_box(low, high, aspect, yaw, 160 * unit(&seed) - 80);
    }
    return check_summary();
}
