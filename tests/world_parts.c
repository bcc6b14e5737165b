// SPDX-License-Identifier: MIT
// Brushes against their definition, voxel by voxel: random ones in small worlds, and positions and radii at the limits.

#include "world/brush.h"
#include "world_common.h"

#include <math.h>
#include <string.h>

// The distance to a segment in floating point: a capsule is what lies within the radius.
static double segment_distance(const fm_brush *brush, const int32_t at[3]) {
    double along = 0, length2 = 0, sum = 0;
    for (int i = 0; i < 3; i++) {
        const double d = (double)brush->to[i] - brush->from[i];
        along += ((double)at[i] - brush->from[i]) * d;
        length2 += d * d;
    }
    const double t = length2 > 0 ? fmin(fmax(along / length2, 0), 1) : 0;
    for (int i = 0; i < 3; i++) {
        const double place = brush->from[i] + t * ((double)brush->to[i] - brush->from[i]);
        sum += (at[i] - place) * (at[i] - place);
    }
    return sqrt(sum);
}

static bool check_voxel(const fm_brush *brush, const fm_gpu_brush *prepared, bool reaches, const int32_t at[3]) {
    const bool wanted = world_covers(brush, at);
    const bool has = reaches && fm_brush_covers(prepared, at[0], at[1], at[2]);
    int32_t begin = 0, end = 0;
    const bool row = reaches && fm_brush_rows(prepared, at[1], at[1] + 1, at[2], &begin, &end);
    const bool in_row = row && at[0] >= begin && at[0] < end;
    bool good = CHECK(has == wanted) && CHECK(!wanted || in_row);
    if (brush->kind != FM_BRUSH_LINE) {
        good = CHECK(in_row == wanted) && good;
    } else {
        const double away = segment_distance(brush, at) - brush->radius;
        good = CHECK(fabs(away) < 1e-4 || wanted == (away < 0)) && good;
    }
    if (!good) {
        fprintf(stderr, "    kind %d, %d %d %d to %d %d %d, radius %u, voxel %d %d %d: %d, wanted %d, row %d to %d\n",
                (int)brush->kind, brush->from[0], brush->from[1], brush->from[2], brush->to[0], brush->to[1], brush->to[2],
                brush->radius, at[0], at[1], at[2], has, wanted, begin, end);
    }
    return good;
}

// A bundle of rows must hold what each of its rows holds.
static bool check_bundles(const fm_gpu_brush *prepared, fm_shape shape) {
    bool good = true;
    for (int32_t z = 0; z < (int32_t)shape.z; z++) {
        for (int32_t y = 0; y < (int32_t)shape.y; y += FM_BUNDLE_ROWS) {
            int32_t begin = 0, end = 0, row_begin, row_end;
            const bool any = fm_brush_rows(prepared, y, y + FM_BUNDLE_ROWS, z, &begin, &end);
            good = CHECK(!any || (begin >= 0 && begin < end && end <= (int32_t)shape.x)) && good;
            for (int32_t row = y; row < y + FM_BUNDLE_ROWS; row++) {
                if (fm_brush_rows(prepared, row, row + 1, z, &row_begin, &row_end)) {
                    good = CHECK(any && row_begin >= begin && row_end <= end) && good;
                }
            }
        }
    }
    return good;
}

static bool check_brush(const fm_brush *brush, fm_shape shape) {
    fm_gpu_brush prepared;
    bool reaches = false;
    if (!CHECK_OK(fm_brush_prepare(brush, shape, &prepared, &reaches))) {
        return false;
    }
    bool good = !reaches || check_bundles(&prepared, shape);
    for (int32_t z = 0; z < (int32_t)shape.z && good; z++) {
        for (int32_t y = 0; y < (int32_t)shape.y; y++) {
            for (int32_t x = 0; x < (int32_t)shape.x; x++) {
                good = check_voxel(brush, &prepared, reaches, (const int32_t[3]){x, y, z}) && good;
            }
        }
    }
    return good;
}

static void test_random_brushes(void) {
    const fm_shape shape = {13, 11, 9};
    uint64_t seed = 5;
    for (int i = 0; i < 3000; i++) {
        const int32_t outside = i % 3 ? 8 : 40;
        fm_brush brush = {.kind = (fm_brush_kind)(i % 3), .radius = (uint32_t)test_between(&seed, 0, i % 5 ? 6 : 60)};
        for (int axis = 0; axis < 3; axis++) {
            brush.from[axis] = test_between(&seed, -outside, 12 + outside);
            brush.to[axis] = i % 7 ? test_between(&seed, -outside, 12 + outside) : brush.from[axis];
        }
        if (!check_brush(&brush, shape)) {
            return;
        }
    }
}

static void test_limits(void) {
    const fm_shape small = {7, 5, 6};
    static const int32_t far[] = {-(1 << 30), -(1 << 29), -1, 0, 3, 1 << 29, 1 << 30};
    static const uint32_t radii[] = {0, 1, 1u << 29, (1u << 30) - 1, 1u << 30, UINT32_MAX};
    enum { FAR = sizeof far / sizeof far[0], RADII = sizeof radii / sizeof radii[0] };
    for (int i = 0; i < FAR * FAR * RADII; i++) {
        const uint32_t radius = radii[i / (FAR * FAR)];
        const fm_brush sphere = {.kind = FM_BRUSH_SPHERE, .radius = radius, .from = {far[i % FAR], far[i / FAR % FAR], 2}};
        const fm_brush box = {.kind = FM_BRUSH_BOX,
                              .radius = radius,
                              .from = {far[i % FAR], 1, 2},
                              .to = {far[i / FAR % FAR], far[(i + 3) % FAR], 4}};
        check_brush(&sphere, small);
        check_brush(&box, small);
    }
}

// Lines as long as they may be, in the largest worlds, at sampled voxels.
static void test_long_lines(void) {
    static const uint32_t radii[] = {0, 1, 5, 8192, 40000, UINT32_MAX};
    const fm_shape shape = {16384, 16384, 16384};
    uint64_t seed = 9;
    for (int i = 0; i < 4000; i++) {
        fm_brush brush = {.kind = FM_BRUSH_LINE, .radius = radii[i % 6]};
        for (int axis = 0; axis < 3; axis++) {
            brush.from[axis] = i % 2 ? test_between(&seed, -8192, 24575) : (test_between(&seed, 0, 1) ? -8192 : 24575);
            brush.to[axis] = i % 2 ? test_between(&seed, -8192, 24575) : (test_between(&seed, 0, 1) ? -8192 : 24575);
        }
        fm_gpu_brush prepared;
        bool reaches;
        if (!CHECK_OK(fm_brush_prepare(&brush, shape, &prepared, &reaches))) {
            return;
        }
        for (int k = 0; k < 20; k++) {
            // Half of them near the line.
            const double t = test_between(&seed, 0, 1000) / 1000.0;
            int32_t at[3];
            for (int axis = 0; axis < 3; axis++) {
                const double place = brush.from[axis] + t * ((double)brush.to[axis] - brush.from[axis]);
                const int32_t near = (int32_t)lround(place) + test_between(&seed, -6, 6);
                at[axis] = k % 2 ? test_between(&seed, 0, 16383) : near < 0 ? 0 : near > 16383 ? 16383 : near;
            }
            check_voxel(&brush, &prepared, reaches, at);
        }
    }
}

static void test_refusals(void) {
    const fm_shape shape = {10, 20, 30};
    fm_gpu_brush prepared;
    bool reaches;
    fm_brush brush = {.kind = (fm_brush_kind)3};
    CHECK_FAILS(fm_brush_prepare(&brush, shape, &prepared, &reaches), FM_ERROR_INVALID_ARGUMENT);
    brush = (fm_brush){.from = {0, (1 << 30) + 1, 0}};
    CHECK_FAILS(fm_brush_prepare(&brush, shape, &prepared, &reaches), FM_ERROR_INVALID_ARGUMENT);
    CHECK(strstr(fm_last_error(), "y = 1073741825") != NULL);
    brush = (fm_brush){.kind = FM_BRUSH_BOX, .to = {0, 0, INT32_MIN}};
    CHECK_FAILS(fm_brush_prepare(&brush, shape, &prepared, &reaches), FM_ERROR_INVALID_ARGUMENT);
    // A sphere has one position.
    brush.kind = FM_BRUSH_SPHERE;
    CHECK_OK(fm_brush_prepare(&brush, shape, &prepared, &reaches));
    brush = (fm_brush){.kind = FM_BRUSH_LINE, .to = {-8192, 19 + 8192, 0}};
    CHECK_OK(fm_brush_prepare(&brush, shape, &prepared, &reaches));
    brush.to[1]++;
    CHECK_FAILS(fm_brush_prepare(&brush, shape, &prepared, &reaches), FM_ERROR_INVALID_ARGUMENT);
    CHECK(strstr(fm_last_error(), "to has y = 8212") != NULL);
    brush = (fm_brush){.radius = 5, .from = {-6, 0, 0}};
    CHECK_OK(fm_brush_prepare(&brush, shape, &prepared, &reaches));
    CHECK(!reaches);
    brush.from[0] = -5;
    CHECK_OK(fm_brush_prepare(&brush, shape, &prepared, &reaches));
    CHECK(reaches);
}

int main(void) {
    test_random_brushes();
    test_limits();
    test_long_lines();
    test_refusals();
    return check_summary();
}
