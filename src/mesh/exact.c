// SPDX-License-Identifier: MIT
#include "mesh/exact.h"

#include <float.h>

static const double EPSILON = DBL_EPSILON / 2;

// An expansion: a sum of doubles that do not overlap, the least first, without zeros. Its last member has the sign of the sum.
enum { MOST_MEMBERS = 48 };

typedef struct expansion {
    int count;
    double members[MOST_MEMBERS];
} expansion;

static double two_sum(double a, double b, double *rest) {
    const double sum = a + b, b_seen = sum - a;
    *rest = (a - (sum - b_seen)) + (b - b_seen);
    return sum;
}

static double two_product(double a, double b, double *rest) {
    const double product = a * b;
    *rest = fma(a, b, -product);
    return product;
}

static void add(expansion *e, double value) {
    int kept = 0;
    for (int i = 0; i < e->count; i++) {
        double rest;
        value = two_sum(value, e->members[i], &rest);
        if (rest != 0) {
            e->members[kept++] = rest;
        }
    }
    if (value != 0) {
        e->members[kept++] = value;
    }
    e->count = kept;
}

static void add_product(expansion *e, double a, double b) {
    double rest;
    const double product = two_product(a, b, &rest);
    add(e, rest);
    add(e, product);
}

static int sign_of(double value) {
    return (value > 0) - (value < 0);
}

static int sign(const expansion *e) {
    return e->count > 0 ? sign_of(e->members[e->count - 1]) : 0;
}

// Products of two floats are doubles: the determinant is a sum of six.
int fm_orient2(const float a[3], const float b[3], const float c[3], int x, int y) {
    const double left = ((double)a[x] - c[x]) * ((double)b[y] - c[y]), right = ((double)a[y] - c[y]) * ((double)b[x] - c[x]);
    const double found = left - right, bound = 4 * EPSILON * (fabs(left) + fabs(right));
    if (fabs(found) > bound) {
        return sign_of(found);
    }
    expansion sum;
    sum.count = 0;
    add(&sum, (double)a[x] * b[y]);
    add(&sum, -((double)a[y] * b[x]));
    add(&sum, (double)b[x] * c[y]);
    add(&sum, -((double)b[y] * c[x]));
    add(&sum, (double)c[x] * a[y]);
    add(&sum, -((double)c[y] * a[x]));
    return sign(&sum);
}

bool fm_collinear(const float a[3], const float b[3], const float c[3]) {
    return fm_orient2(a, b, c, 0, 1) == 0 && fm_orient2(a, b, c, 1, 2) == 0 && fm_orient2(a, b, c, 2, 0) == 0;
}

static bool difference_is_exact(double a, double b) {
    double rest;
    two_sum(a, -b, &rest);
    return rest == 0;
}

// The determinant of p, q, r times a sign, as 12 doubles: each product of three floats is two.
static void add_determinant(expansion *sum, const float p[3], const float q[3], const float r[3], double factor) {
    for (int i = 0; i < 3; i++) {
        const int j = (i + 1) % 3, k = (i + 2) % 3;
        add_product(sum, factor * p[i], (double)q[j] * r[k]);
        add_product(sum, -factor * p[i], (double)q[k] * r[j]);
    }
}

static int orient3_exact(const float a[3], const float b[3], const float c[3], const float d[3]) {
    expansion sum;
    sum.count = 0;
    add_determinant(&sum, a, b, c, 1);
    add_determinant(&sum, b, c, d, -1);
    add_determinant(&sum, c, d, a, 1);
    add_determinant(&sum, d, a, b, -1);
    return sign(&sum);
}

// The same from differences that are exact: each minor is four doubles at most, each times a difference eight.
static int orient3_differences(double rows[3][3]) {
    expansion sum;
    sum.count = 0;
    for (int i = 0; i < 3; i++) {
        const int j = (i + 1) % 3, k = (i + 2) % 3;
        expansion minor;
        minor.count = 0;
        add_product(&minor, rows[1][j], rows[2][k]);
        add_product(&minor, -rows[1][k], rows[2][j]);
        for (int n = 0; n < minor.count; n++) {
            add_product(&sum, rows[0][i], minor.members[n]);
        }
    }
    return sign(&sum);
}

int fm_orient3(const float a[3], const float b[3], const float c[3], const float d[3]) {
    const float *const points[3] = {a, b, c};
    double rows[3][3], found = 0, size = 0;
    for (int i = 0; i < 3; i++) {
        for (int axis = 0; axis < 3; axis++) {
            rows[i][axis] = (double)points[i][axis] - d[axis];
        }
    }
    for (int i = 0; i < 3; i++) {
        const int j = (i + 1) % 3, k = (i + 2) % 3;
        const double left = rows[1][j] * rows[2][k], right = rows[1][k] * rows[2][j];
        found += rows[0][i] * (left - right);
        size += fabs(rows[0][i]) * (fabs(left) + fabs(right));
    }
    if (fabs(found) > 8 * EPSILON * size) {
        return sign_of(found);
    }
    for (int i = 0; i < 3; i++) {
        for (int axis = 0; axis < 3; axis++) {
            if (!difference_is_exact(points[i][axis], d[axis])) {
                return orient3_exact(a, b, c, d);
            }
        }
    }
    return orient3_differences(rows);
}
