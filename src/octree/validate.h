// SPDX-License-Identifier: MIT
#ifndef FM_OCTREE_VALIDATE_H
#define FM_OCTREE_VALIDATE_H

// What each kind's octrees from files are asked, by fm_octree_validate: a function a kind, which looks at all that a ray could
// reach. Marks are as many bytes as fm_octree_marks says, all 0 and aligned to 4.

#include "octree/file.h"

// Nodes of the top grid, all of which there are.
fm_result fm_octree_check_top(const fm_octree *octree, uint64_t *nodes);

// validate_voxels.c
fm_result fm_octree_check_dag(const fm_octree *octree, uint8_t *marks);
fm_result fm_octree_check_tree64(const fm_octree *octree, uint8_t *marks);
// validate_contours.c
fm_result fm_octree_check_contours(const fm_octree *octree, uint8_t *marks);

#endif
