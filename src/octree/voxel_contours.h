// SPDX-License-Identifier: MIT
#ifndef FM_VOXEL_CONTOURS_H
#define FM_VOXEL_CONTOURS_H

// Contours of cells: see shaders/include/octree_contours_rule.h.

#include <stdint.h>

enum { FM_HULL_POINTS = 32 };

// Points whose hull a cell's contour leaves of the cube from -1 to 1; all of it for contour 0.
uint32_t fm_contour_hull(uint32_t contour, double points[FM_HULL_POINTS][3]);
// The contour along `normal`, of any length above 0, that holds all points of a cell; 0 where it leaves more than `most` of the
// cell's extent along it. `extent` (NULL allowed): how much it leaves.
uint32_t fm_contour_of(const double normal[3], const double (*points)[3], uint32_t count, double most, double *extent);

#endif
