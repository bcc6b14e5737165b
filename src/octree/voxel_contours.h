// SPDX-License-Identifier: MIT
#ifndef FM_VOXEL_CONTOURS_H
#define FM_VOXEL_CONTOURS_H

// Contours of cells: see shaders/include/octree_contours_rule.h. A contour is the thinnest pair of parallel planes, of several
// directions, between which all is that it has to hold.

#include "mesh/grid.h"

enum { FM_HULL_POINTS = 32, FM_PLANES = 14, FM_NO_LINK = -1 };

// Pairs of planes, one a direction. The first has the mean normal; without one it and the diagonals are left out, for they would be
// guesses where there are normals.
typedef struct fm_planes {
    int32_t way[FM_PLANES][3];  // as contours have it: the longest is 31
    double low[FM_PLANES], high[FM_PLANES];
    uint32_t first, count;
} fm_planes;

// `normal` has any length; 0: there is none.
void fm_planes_begin(fm_planes *planes, const double normal[3]);
// Points of the cell, which is the cube from -1 to 1.
void fm_planes_hold(fm_planes *planes, const double (*points)[3], uint32_t count);
// 0 where each leaves more than `most` of the cell's extent along it. All but the first count as
// leaving `lead` more.
uint32_t fm_planes_contour(const fm_planes *planes, double most, double lead);

// Adds a normal, so that those of sheets that face each other do not cancel out.
void fm_contour_add_normal(const double added[3], double normal[3]);
// Points whose hull a cell's contour leaves of the cube from -1 to 1; all of it for contour 0.
uint32_t fm_contour_hull(uint32_t contour, double points[FM_HULL_POINTS][3]);

// A triangle that touches a voxel, and the next one that does.
typedef struct fm_voxel_link {
    uint32_t triangle;
    int32_t next;  // FM_NO_LINK: no other
} fm_voxel_link;

// The contour around the parts of triangles that are in the cell around a texel of a grid; 0: none that leaves less than all of it.
uint32_t fm_contour_fit(const fm_mesh *mesh, const fm_grid *grid, const uint32_t cell[3], const fm_voxel_link *links,
                        int32_t first);

#endif
