// SPDX-License-Identifier: MIT
#ifndef FM_INTERSECT_H
#define FM_INTERSECT_H

// Whether triangles intersect, without rounding.

#include "mesh/mesh.h"

// Whether the two triangles have a point in common, borders included. A triangle whose corners lie on a line is the segment or the
// point that they span.
bool fm_triangles_intersect(const float *const a[3], const float *const b[3]);

#endif
