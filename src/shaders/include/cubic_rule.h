// SPDX-License-Identifier: MIT
#ifndef FM_CUBIC_RULE_H
#define FM_CUBIC_RULE_H

// What a trilinear field is along a ray through one of its cells: one text for C and GLSL.

#include "rule.h"

// The corners of a cell of samples that holds a place, corner x + 2 y + 4 z, and where in the cell the place is.
FM_PUSH_STRUCT(fm_cell) {
    fm_float v[8];
    fm_int base[3];
    fm_float part[3];
};

FM_RULE fm_float fm_lerp(fm_float a, fm_float b, fm_float t) {
    return a + (b - a) * t;
}

FM_RULE fm_float fm_cell_value(fm_cell c) {
    fm_float low = fm_lerp(fm_lerp(c.v[0], c.v[1], c.part[0]), fm_lerp(c.v[2], c.v[3], c.part[0]), c.part[1]);
    fm_float high = fm_lerp(fm_lerp(c.v[4], c.v[5], c.part[0]), fm_lerp(c.v[6], c.v[7], c.part[0]), c.part[1]);
    return fm_lerp(low, high, c.part[2]);
}

// The field along a ray through a cell: c[0] + c[1] s + c[2] s^2 + c[3] s^3, from `cell.part` on by `along` a unit of s.
FM_PUSH_STRUCT(fm_cubic) {
    fm_float c[4];
};

FM_RULE fm_cubic fm_cell_cubic(fm_cell cell, fm_v3 along) {
    fm_float k0 = cell.v[0], kx = cell.v[1] - cell.v[0], ky = cell.v[2] - cell.v[0], kz = cell.v[4] - cell.v[0];
    fm_float kxy = cell.v[3] - cell.v[2] - kx, kxz = cell.v[5] - cell.v[4] - kx, kyz = cell.v[6] - cell.v[4] - ky;
    fm_float kxyz = cell.v[7] - cell.v[6] - cell.v[5] + cell.v[4] - kxy;
    fm_float ax = cell.part[0], ay = cell.part[1], az = cell.part[2], bx = along.x, by = along.y, bz = along.z;
    fm_cubic r;
    r.c[0] = k0 + kx * ax + ky * ay + kz * az + kxy * ax * ay + kxz * ax * az + kyz * ay * az + kxyz * ax * ay * az;
    r.c[1] = kx * bx + ky * by + kz * bz + kxy * (ax * by + bx * ay) + kxz * (ax * bz + bx * az) + kyz * (ay * bz + by * az) +
             kxyz * (ax * ay * bz + ax * by * az + bx * ay * az);
    r.c[2] = kxy * bx * by + kxz * bx * bz + kyz * by * bz + kxyz * (ax * by * bz + bx * ay * bz + bx * by * az);
    r.c[3] = kxyz * bx * by * bz;
    return r;
}

FM_RULE fm_float fm_cubic_at(fm_cubic f, fm_float s) {
    return ((f.c[3] * s + f.c[2]) * s + f.c[1]) * s + f.c[0];
}

// The place between low and high, at which f has other signs, where it is 0: false position with its ends halved (Illinois).
FM_RULE fm_float fm_cubic_zero(fm_cubic f, fm_float low, fm_float high) {
    fm_float a = low, b = high, fa = fm_cubic_at(f, a), fb = fm_cubic_at(f, b);
    for (fm_int i = 0; i < 12 && b - a > 1e-6f * high; i++) {
        fm_float s = FM_MIN(FM_MAX((a * fb - b * fa) / (fb - fa), a), b);
        fm_float fs = fm_cubic_at(f, s);
        if (fs > 0) {
            a = s;
            fa = fs;
            fb *= 0.5f;
        } else {
            b = s;
            fb = fs;
            fa *= 0.5f;
        }
    }
    return b;
}

// The first s in 0 ... last at which f falls to 0 or is no more; below 0: none. Between its extrema f is monotone, so that three
// pieces are looked at. Source: Marmitt et al. 2004, "Fast and accurate ray-voxel intersection techniques for iso-surface ray
// tracing".
FM_RULE fm_float fm_cubic_first(fm_cubic f, fm_float last) {
    if (f.c[0] <= 0) {
        return 0;
    }
    fm_float ends[4];
    ends[0] = 0;
    ends[1] = last;
    ends[2] = last;
    ends[3] = last;
    fm_float a = 3 * f.c[3], b = f.c[2], c = f.c[1], inner = b * b - a * c;
    if (inner > 0) {
        fm_float q = -(b + (b < 0 ? -FM_SQRT(inner) : FM_SQRT(inner)));
        fm_float one = a != 0 ? q / a : last, two = q != 0 ? c / q : last;
        ends[1] = FM_MIN(FM_MAX(FM_MIN(one, two), 0.0f), last);
        ends[2] = FM_MIN(FM_MAX(FM_MAX(one, two), 0.0f), last);
    }
    for (fm_int i = 0; i < 3; i++) {
        if (ends[i + 1] > ends[i] && fm_cubic_at(f, ends[i + 1]) <= 0) {
            return fm_cubic_zero(f, ends[i], ends[i + 1]);
        }
    }
    return -1;
}

// How long a ray stays in a cell.
FM_RULE fm_float fm_cell_way(fm_cell cell, fm_v3 along) {
    fm_float b[3];
    b[0] = along.x;
    b[1] = along.y;
    b[2] = along.z;
    fm_float out_at = FM_INFINITY_F;
    for (fm_int i = 0; i < 3; i++) {
        if (b[i] != 0) {
            out_at = FM_MIN(out_at, FM_MAX(((b[i] > 0 ? 1.0f : 0.0f) - cell.part[i]) / b[i], 0.0f));
        }
    }
    return out_at;
}

#endif
