// SPDX-License-Identifier: MIT
// Picture errors against values of the authors' flip-evaluator 1.7 (FLIP) and plain arithmetic.

#include "check.h"
#include "image_error.h"

#include <math.h>
#include <stdlib.h>

enum { WIDTH = 64, HEIGHT = 48 };

static float at_reference(int x, int y, int channel) {
    return channel == 0 ? (float)x / WIDTH : channel == 1 ? (float)y / HEIGHT : (float)((x / 8 + y / 8) % 2);
}

// Red is weaker, a rectangle's green is constant, blue is moved by a pixel.
static float at_test(int x, int y, int channel) {
    if (channel == 0) {
        return at_reference(x, y, 0) * 0.9f;
    }
    if (channel == 1 && x >= WIDTH / 4 && x < WIDTH / 2 && y >= HEIGHT / 4 && y < HEIGHT / 2) {
        return 0.25f;
    }
    return at_reference(channel == 2 ? (x + WIDTH - 1) % WIDTH : x, y, channel);
}

static image paint(float (*at)(int x, int y, int channel), float *rgb) {
    for (int i = 0; i < WIDTH * HEIGHT * 3; i++) {
        rgb[i] = at(i / 3 % WIDTH, i / 3 / WIDTH, i % 3);
    }
    return (image){rgb, WIDTH, HEIGHT};
}

int main(void) {
    static float a[WIDTH * HEIGHT * 3], b[WIDTH * HEIGHT * 3], map[WIDTH * HEIGHT];
    const image reference = paint(at_reference, a), test = paint(at_test, b);
    CHECK(fabs(image_flip(&test, &reference, 0, map) - 0.26490369) < 1e-4);
    CHECK(fabs(image_rmse(&test, &reference) - 0.20768523) < 1e-6);
    // scikit-image mirrors at the edges.
    CHECK(fabs(image_ssim(&test, &reference) - 0.7349049) < 5e-3);
    CHECK(image_flip(&reference, &reference, 0, NULL) == 0);
    CHECK(image_rmse(&reference, &reference) == 0);
    CHECK(fabs(image_ssim(&reference, &reference) - 1) < 1e-6);
    return check_summary();
}
