// SPDX-License-Identifier: MIT
// What a camera is in numbers: from where it is and looks to the rays of pixels.

#include "render/render.h"

#include <math.h>
#include <string.h>

bool fm_all_finite(const float v[3]) {
    return isfinite(v[0]) && isfinite(v[1]) && isfinite(v[2]);
}

static bool all_zero(const float v[3]) {
    return v[0] == 0 && v[1] == 0 && v[2] == 0;
}

fm_result fm_camera_check(const fm_camera *camera) {
    return fm_camera_check_within(camera, FM_CAMERA_FARTHEST);
}

fm_result fm_camera_check_within(const fm_camera *camera, float farthest) {
    for (int i = 0; i < 3; i++) {
        if (!(fabsf(camera->position[i]) <= farthest)) {
            return fm_fail(FM_ERROR_INVALID_ARGUMENT, "camera.position has %c = %g: -%g to %g is accepted", "xyz"[i],
                           (double)camera -> position[i], (double)farthest, (double)farthest);
        }
    }
    if (!fm_all_finite(camera->forward) || all_zero(camera->forward)) {
        return fm_fail(FM_ERROR_INVALID_ARGUMENT, "camera.forward is %g, %g, %g: finite numbers, not all 0, are wanted",
                       (double)camera->forward[0], (double)camera->forward[1], (double)camera->forward[2]);
    }
    if (!fm_all_finite(camera->up)) {
        return fm_fail(FM_ERROR_INVALID_ARGUMENT, "camera.up is %g, %g, %g: finite numbers are wanted", (double)camera->up[0],
                       (double)camera->up[1], (double)camera->up[2]);
    }
    if (!(camera->fov_y >= 0 && camera->fov_y < 180)) {
        return fm_fail(FM_ERROR_INVALID_ARGUMENT, "camera.fov_y is %g: above 0 and below 180 degrees, or 0 for 60, is accepted",
                       (double)camera->fov_y);
    }
    return FM_OK;
}

void fm_cross_product(const double a[3], const double b[3], double out[3]) {
    for (int i = 0; i < 3; i++) {
        out[i] = a[(i + 1) % 3] * b[(i + 2) % 3] - a[(i + 2) % 3] * b[(i + 1) % 3];
    }
}

// Scales to length 1; false for a vector of no length.
static bool normalize(double v[3]) {
    const double most = fmax(fabs(v[0]), fmax(fabs(v[1]), fabs(v[2])));
    if (!(most > 0)) {
        return false;
    }
    double sum = 0;
    for (int i = 0; i < 3; i++) {
        v[i] /= most;
        sum += v[i] * v[i];
    }
    for (int i = 0; i < 3; i++) {
        v[i] /= sqrt(sum);
    }
    return true;
}

static void widen(const float from[3], double to[3]) {
    for (int i = 0; i < 3; i++) {
        to[i] = (double)from[i];
    }
}

void fm_camera_rays(const fm_render_desc *desc, fm_march_push *push) {
    double forward[3], up[3], right[3], down[3];
    widen(desc->camera.forward, forward);
    normalize(forward);
    widen(desc->camera.up, up);
    if (!normalize(up)) {
        memcpy(up, (const double[3]){0, 0, 1}, sizeof up);
    }
    fm_cross_product(forward, up, right);
    if (right[0] * right[0] + right[1] * right[1] + right[2] * right[2] < 1e-12) {
        // Straight up or down: +y stays at the top of the picture, or, where that is the view, +x.
        const double other[3] = {fabs(forward[1]) > 0.9, fabs(forward[1]) <= 0.9, 0};
        fm_cross_product(forward, other, right);
    }
    normalize(right);
    fm_cross_product(forward, right, down);
    const double fov = desc->camera.fov_y > 0 ? (double)desc->camera.fov_y : 60;
    const double pixel = 2 * tan(fov * (3.14159265358979323846 / 360)) / desc->height;
    for (int i = 0; i < 3; i++) {
        // Voxels are centred on whole numbers for the caller and begin there for the march.
        push->origin[i] = desc->camera.position[i] + 0.5f;
        push->right[i] = (float)(right[i] * pixel);
        push->down[i] = (float)(down[i] * pixel);
        push->corner[i] =
            (float)(forward[i] + right[i] * pixel * (0.5 - 0.5 * desc->width) + down[i] * pixel * (0.5 - 0.5 * desc->height));
    }
}

void fm_sun_way(const float sun[3], float way[3]) {
    double toward[3];
    widen(sun, toward);
    if (!normalize(toward)) {
        memcpy(toward, (const double[3]){0.48, -0.56, 0.6757}, sizeof toward);
        normalize(toward);
    }
    for (int i = 0; i < 3; i++) {
        way[i] = (float)toward[i];
    }
}
