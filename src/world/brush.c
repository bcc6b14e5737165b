// SPDX-License-Identifier: MIT
// Which voxels an edit covers. All in integers: with axes of 2^14 voxels and a line's ends at most 2^13 outside, no product leaves
// 63 bits; a sphere's coordinates and radius of 2^30 give squares below 2^62.

#include "world/brush.h"

#include <math.h>

enum { LINE_OUTSIDE = 8192 };

static const char axis_names[] = "xyz";

static void shape_axes(fm_shape shape, int64_t axes[3]) {
    axes[0] = shape.x;
    axes[1] = shape.y;
    axes[2] = shape.z;
}

static fm_result check_place(const fm_brush *brush, const char *name, const int32_t place[3], const int64_t axes[3]) {
    for (int i = 0; i < 3; i++) {
        const int64_t low = brush->kind == FM_BRUSH_LINE ? -LINE_OUTSIDE : -FM_MAX_RADIUS;
        const int64_t high = brush->kind == FM_BRUSH_LINE ? axes[i] - 1 + LINE_OUTSIDE : FM_MAX_RADIUS;
        if (place[i] < low || place[i] > high) {
            return fm_fail(FM_ERROR_INVALID_ARGUMENT, "%s has %c = %d: %lld to %lld is accepted%s", name, axis_names[i], place[i],
                           (long long)low, (long long)high, brush->kind == FM_BRUSH_LINE ? " of a line in this world" : "");
        }
    }
    return FM_OK;
}

static int64_t square(int64_t a) {
    return a * a;
}

// The greatest squared distance of a voxel of the world to a place.
static uint64_t farthest(const int32_t place[3], const int64_t axes[3]) {
    uint64_t sum = 0;
    for (int i = 0; i < 3; i++) {
        const int64_t last = square(axes[i] - 1 - place[i]);
        const int64_t first = square(place[i]);
        sum += (uint64_t)(first > last ? first : last);
    }
    return sum;
}

fm_result fm_brush_prepare(const fm_brush *brush, fm_shape shape, fm_gpu_brush *prepared, bool *reaches) {
    if ((unsigned)brush->kind > FM_BRUSH_LINE) {
        return fm_fail(FM_ERROR_INVALID_ARGUMENT, "kind is %d: not an fm_brush_kind", (int)brush->kind);
    }
    int64_t axes[3];
    shape_axes(shape, axes);
    const int32_t *to = brush->kind == FM_BRUSH_SPHERE ? brush->from : brush->to;
    FM_TRY(check_place(brush, "from", brush->from, axes));
    FM_TRY(check_place(brush, "to", to, axes));
    const int64_t radius = brush->kind == FM_BRUSH_BOX ? 0 : (int64_t)fm_min_u64(brush->radius, FM_MAX_RADIUS);
    fm_gpu_brush made = {.radius2 = (uint64_t)square(radius), .kind = (uint32_t)brush->kind, .voxel = brush->voxel};
    *reaches = true;
    bool dot = true;
    for (int i = 0; i < 3; i++) {
        const int64_t least = (brush->from[i] < to[i] ? brush->from[i] : to[i]) - radius;
        const int64_t most = (brush->from[i] < to[i] ? to[i] : brush->from[i]) + radius;
        *reaches = *reaches && least < axes[i] && most >= 0;
        made.from[i] = brush->from[i];
        made.to[i] = to[i];
        made.begin[i] = (int32_t)(least < 0 ? 0 : least < axes[i] ? least : axes[i]);
        made.end[i] = (int32_t)(most < -1 ? -1 : most < axes[i] ? most : axes[i] - 1);
        dot = dot && brush->from[i] == to[i];
    }
    if (brush->kind == FM_BRUSH_LINE) {
        // A longer radius reaches no other voxel, and its product with the length might overflow.
        made.radius2 = fm_min_u64(made.radius2, farthest(made.from, axes));
        made.kind = dot ? FM_BRUSH_SPHERE : FM_BRUSH_LINE;
    }
    *prepared = made;
    return FM_OK;
}

// The root, rounded down.
static int64_t root(uint64_t value) {
    int64_t guess = (int64_t)sqrt((double)value);
    while ((uint64_t)square(guess) > value) {
        guess--;
    }
    while ((uint64_t)square(guess + 1) <= value) {
        guess++;
    }
    return guess;
}

static int64_t distance_to_range(int64_t at, int64_t begin, int64_t end) {
    return at < begin ? begin - at : at >= end ? at - (end - 1) : 0;
}

typedef struct x_range {
    int64_t first, last;
} x_range;

// Empty where the sphere does not reach the rows.
static x_range sphere_range(const fm_gpu_brush *brush, int32_t y_begin, int32_t y_end, int32_t z) {
    const uint64_t away =
        (uint64_t)square(distance_to_range(brush->from[1], y_begin, y_end)) + (uint64_t)square((int64_t)z - brush->from[2]);
    if (away > brush->radius2) {
        return (x_range){0, -1};
    }
    const int64_t half = root(brush->radius2 - away);
    return (x_range){brush->from[0] - half, brush->from[0] + half};
}

// Narrows t, the part of the segment, to where from + t * (to - from) lies in low ... high.
static void clip_segment(double t[2], double from, double to, double low, double high) {
    const double d = to - from;
    if (d == 0) {
        t[1] = from < low || from > high ? -1 : t[1];
        return;
    }
    const double a = (low - from) / d;
    const double b = (high - from) / d;
    t[0] = fmax(t[0], fmin(a, b));
    t[1] = fmin(t[1], fmax(a, b));
}

// Only points of the segment within the radius of the rows can cover a voxel there. A voxel's width covers what doubles round.
static x_range line_range(const fm_gpu_brush *brush, int32_t y_begin, int32_t y_end, int32_t z) {
    const double radius = sqrt((double)brush->radius2) + 1;
    double t[2] = {0, 1};
    clip_segment(t, brush->from[1], brush->to[1], y_begin - radius, y_end - 1 + radius);
    clip_segment(t, brush->from[2], brush->to[2], z - radius, z + radius);
    if (t[0] > t[1]) {
        return (x_range){0, -1};
    }
    const double d = (double)brush->to[0] - brush->from[0];
    const double a = brush->from[0] + t[0] * d;
    const double b = brush->from[0] + t[1] * d;
    return (x_range){(int64_t)floor(fmin(a, b) - radius), (int64_t)ceil(fmax(a, b) + radius)};
}

bool fm_brush_rows(const fm_gpu_brush *brush, int32_t y_begin, int32_t y_end, int32_t z, int32_t *x_begin, int32_t *x_end) {
    y_begin = y_begin > brush->begin[1] ? y_begin : brush->begin[1];
    y_end = y_end <= brush->end[1] ? y_end : brush->end[1] + 1;
    if (y_begin >= y_end || z < brush->begin[2] || z > brush->end[2]) {
        return false;
    }
    x_range range = {brush->begin[0], brush->end[0]};
    if (brush->kind != FM_BRUSH_BOX) {
        const x_range own = (brush->kind == FM_BRUSH_SPHERE ? sphere_range : line_range)(brush, y_begin, y_end, z);
        range.first = own.first > range.first ? own.first : range.first;
        range.last = own.last < range.last ? own.last : range.last;
    }
    if (range.first > range.last) {
        return false;
    }
    *x_begin = (int32_t)range.first;
    *x_end = (int32_t)range.last + 1;
    return true;
}

bool fm_brush_covers(const fm_gpu_brush *brush, int32_t x, int32_t y, int32_t z) {
    const int32_t at[3] = {x, y, z};
    int64_t from2 = 0, to2 = 0, along = 0, length2 = 0;
    for (int i = 0; i < 3; i++) {
        if (at[i] < brush->begin[i] || at[i] > brush->end[i]) {
            return false;
        }
        const int64_t way = (int64_t)at[i] - brush->from[i];
        const int64_t d = (int64_t)brush->to[i] - brush->from[i];
        if (brush->kind == FM_BRUSH_LINE) {
            along += way * d;
            length2 += d * d;
            to2 += square((int64_t)at[i] - brush->to[i]);
        }
        from2 += brush->kind == FM_BRUSH_BOX ? 0 : way * way;
    }
    const int64_t radius2 = (int64_t)brush->radius2;
    if (brush->kind != FM_BRUSH_LINE || along <= 0) {
        return from2 <= radius2;
    }
    if (along >= length2) {
        return to2 <= radius2;
    }
    return from2 * length2 - along * along <= radius2 * length2;
}
