// SPDX-License-Identifier: MIT
#ifndef FM_EXACT_H
#define FM_EXACT_H

// Signs of determinants of floats, without rounding: a bound on the error decides first, and expansions where it cannot.
// Coordinates must fit (fm_coordinate_fits). Source: Shewchuk 1997, "Adaptive precision floating-point arithmetic and fast robust
// geometric predicates".

#include "mesh/mesh.h"

// 1 where a, b, c turn left in the plane of the axes `x` and `y`, -1 right, 0 on a line.
int fm_orient2(const float a[3], const float b[3], const float c[3], int x, int y);

// The side of the plane through a, b, c that d lies on: 1 where they turn right seen from d, 0 on the plane.
int fm_orient3(const float a[3], const float b[3], const float c[3], const float d[3]);

// Whether the three points lie on one line, or are one.
bool fm_collinear(const float a[3], const float b[3], const float c[3]);

#endif
