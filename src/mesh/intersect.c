// SPDX-License-Identifier: MIT
#include "mesh/intersect.h"

#include "mesh/exact.h"

// Two axes onto which what lies in a plane is projected.
typedef struct plane {
    int x, y;
} plane;

static bool within(const float a[3], const float b[3], const float p[3], int axis) {
    return a[axis] < b[axis] ? a[axis] <= p[axis] && p[axis] <= b[axis] : b[axis] <= p[axis] && p[axis] <= a[axis];
}

static int turn(plane on, const float a[3], const float b[3], const float c[3]) {
    return fm_orient2(a, b, c, on.x, on.y);
}

// Segments in a plane; both may be points.
static bool segments_meet(plane on, const float a[3], const float b[3], const float c[3], const float d[3]) {
    const int ac = turn(on, a, b, c), ad = turn(on, a, b, d), ca = turn(on, c, d, a), cb = turn(on, c, d, b);
    if (ac != ad && ca != cb) {
        return true;
    }
    return (ac == 0 && within(a, b, c, on.x) && within(a, b, c, on.y)) ||
           (ad == 0 && within(a, b, d, on.x) && within(a, b, d, on.y)) ||
           (ca == 0 && within(c, d, a, on.x) && within(c, d, a, on.y)) ||
           (cb == 0 && within(c, d, b, on.x) && within(c, d, b, on.y));
}

static bool point_inside(plane on, const float *const corners[3], const float p[3]) {
    bool left = false, right = false;
    for (int i = 0; i < 3; i++) {
        const int side = turn(on, corners[i], corners[(i + 1) % 3], p);
        left |= side > 0;
        right |= side < 0;
    }
    return !(left && right);
}

// A plane of projection that keeps the triangle's area; false when it has none.
static bool plane_of(const float *const corners[3], plane *on) {
    for (int axis = 0; axis < 3; axis++) {
        *on = (plane){axis, (axis + 1) % 3};
        if (turn(*on, corners[0], corners[1], corners[2]) != 0) {
            return true;
        }
    }
    return false;
}

// The triangle has an area. `from_side` and `to_side` tell on which side of its plane the ends of the segment lie.
static bool segment_meets(const float from[3], int from_side, const float to[3], int to_side, const float *const corners[3]) {
    if (from_side * to_side > 0) {
        return false;
    }
    if (from_side == 0 && to_side == 0) {
        plane on;
        plane_of(corners, &on);
        for (int i = 0; i < 3; i++) {
            if (segments_meet(on, from, to, corners[i], corners[(i + 1) % 3])) {
                return true;
            }
        }
        return point_inside(on, corners, from);
    }
    bool left = false, right = false;
    for (int i = 0; i < 3; i++) {
        const int side = fm_orient3(from, to, corners[i], corners[(i + 1) % 3]);
        left |= side > 0;
        right |= side < 0;
    }
    return !(left && right);
}

static void sides_of(const float *const plane_corners[3], const float *const points[3], int sides[3]) {
    for (int i = 0; i < 3; i++) {
        sides[i] = fm_orient3(plane_corners[0], plane_corners[1], plane_corners[2], points[i]);
    }
}

static bool one_side(const int sides[3]) {
    return (sides[0] > 0 && sides[1] > 0 && sides[2] > 0) || (sides[0] < 0 && sides[1] < 0 && sides[2] < 0);
}

static bool edges_meet(const float *const a[3], const int sides[3], const float *const b[3]) {
    for (int i = 0; i < 3; i++) {
        const int next = (i + 1) % 3;
        if (segment_meets(a[i], sides[i], a[next], sides[next], b)) {
            return true;
        }
    }
    return false;
}

// The two corners that are farthest apart, of corners on a line: along each axis they are in the same order, or the reverse.
static void ends_of(const float *const corners[3], const float *ends[2]) {
    ends[0] = ends[1] = corners[0];
    for (int axis = 0; axis < 3 && ends[0] == ends[1]; axis++) {
        for (int i = 1; i < 3; i++) {
            ends[0] = corners[i][axis] < ends[0][axis] ? corners[i] : ends[0];
            ends[1] = corners[i][axis] > ends[1][axis] ? corners[i] : ends[1];
        }
    }
}

// Both without area.
static bool lines_meet(const float *const a[3], const float *const b[3]) {
    const float *ends_a[2], *ends_b[2];
    plane on;
    ends_of(a, ends_a);
    ends_of(b, ends_b);
    if (fm_orient3(ends_a[0], ends_a[1], ends_b[0], ends_b[1]) != 0) {
        return false;
    }
    const float *const one[3] = {ends_a[0], ends_a[1], ends_b[0]}, *const other[3] = {ends_a[0], ends_a[1], ends_b[1]};
    const float *const third[3] = {ends_b[0], ends_b[1], ends_a[0]};
    if (plane_of(one, &on) || plane_of(other, &on) || plane_of(third, &on)) {
        return segments_meet(on, ends_a[0], ends_a[1], ends_b[0], ends_b[1]);
    }
    // On one line, where boxes that overlap are segments that do.
    for (int axis = 0; axis < 3; axis++) {
        if (fmaxf(ends_a[0][axis], ends_a[1][axis]) < fminf(ends_b[0][axis], ends_b[1][axis]) ||
            fmaxf(ends_b[0][axis], ends_b[1][axis]) < fminf(ends_a[0][axis], ends_a[1][axis])) {
            return false;
        }
    }
    return true;
}

static bool line_meets(const float *const line[3], const float *const triangle[3]) {
    const float *ends[2];
    ends_of(line, ends);
    return segment_meets(ends[0], fm_orient3(triangle[0], triangle[1], triangle[2], ends[0]), ends[1],
                         fm_orient3(triangle[0], triangle[1], triangle[2], ends[1]), triangle);
}

bool fm_triangles_intersect(const float *const a[3], const float *const b[3]) {
    int sides_a[3], sides_b[3];
    sides_of(b, a, sides_a);
    if (one_side(sides_a)) {
        return false;
    }
    sides_of(a, b, sides_b);
    if (one_side(sides_b)) {
        return false;
    }
    // All on the plane: of the same plane, or a plane there is none.
    const bool all_a = sides_a[0] == 0 && sides_a[1] == 0 && sides_a[2] == 0;
    const bool all_b = sides_b[0] == 0 && sides_b[1] == 0 && sides_b[2] == 0;
    if (all_a || all_b) {
        const bool line_a = fm_collinear(a[0], a[1], a[2]), line_b = fm_collinear(b[0], b[1], b[2]);
        if (line_a || line_b) {
            return line_a && line_b ? lines_meet(a, b) : line_a ? line_meets(a, b) : line_meets(b, a);
        }
    }
    return edges_meet(a, sides_a, b) || edges_meet(b, sides_b, a);
}
