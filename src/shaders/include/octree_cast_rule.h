// SPDX-License-Identifier: MIT
#ifndef FM_OCTREE_CAST_RULE_H
#define FM_OCTREE_CAST_RULE_H

// A ray through an octree of any kind: one text for C and GLSL. A kernel sets `kind`, `code` and `stepped` of the head to
// constants, so that it is compiled for one kind.

#include "octree_closest_rule.h"
#include "octree_contours_rule.h"
#include "octree_dag_rule.h"
#include "octree_distance_rule.h"
#include "octree_tree64_rule.h"
#include "octree_voxels_rule.h"

// `way` of length 1; `epsilon` in world units.
FM_RULE fm_octree_met fm_cast_octree(fm_octree_head head, fm_v3 origin, fm_v3 way, fm_float first, fm_float last,
                                     fm_float epsilon) {
    if (head.kind == FM_GPU_CLOSEST) {
        return fm_cast_closest(head, origin, way, first, last, epsilon);
    }
    if (head.kind == FM_GPU_DISTANCE || head.kind == FM_GPU_BRICKS) {
        return fm_cast_distance(head, origin, way, first, last, epsilon);
    }
    if (head.kind == FM_GPU_VOXELS) {
        return fm_cast_voxels(head, origin, way, first, last);
    }
    if (head.kind == FM_GPU_CONTOURS) {
        return fm_cast_contours(head, origin, way, first, last);
    }
    if (head.kind == FM_GPU_DAG) {
        return fm_cast_dag(head, origin, way, first, last);
    }
    if (head.kind == FM_GPU_TREE64) {
        return fm_cast_tree64(head, origin, way, first, last);
    }
    return fm_octree_nothing();
}

FM_RULE bool fm_octree_is_place(fm_v3 at) {
    return FM_SIZE_OF(at.x) < 1e18f && FM_SIZE_OF(at.y) < 1e18f && FM_SIZE_OF(at.z) < 1e18f;
}

#define FM_CAST_SHORTEST 1e-37f  // that ways may be along their longest axis: its inverse is a number that all devices have

// `way` of any length, in which `first`, `last` and the answer's t count. What is no ray meets nothing.
FM_RULE fm_octree_met fm_cast_ray(fm_octree_head head, fm_v3 origin, fm_v3 way, fm_float first, fm_float last, fm_float epsilon) {
    // The squares of what is short vanish.
    fm_float most = FM_MAX(FM_MAX(FM_SIZE_OF(way.x), FM_SIZE_OF(way.y)), FM_SIZE_OF(way.z));
    if (!(fm_octree_is_place(origin) && fm_octree_is_place(way) && most >= FM_CAST_SHORTEST && first <= last)) {
        return fm_octree_nothing();
    }
    fm_v3 scaled = fm_times(way, 1 / most);
    fm_float rest = fm_octree_length(scaled), length = most * rest;
    fm_octree_met met = fm_cast_octree(head, origin, fm_times(scaled, 1 / rest), first * length, last * length, epsilon);
    met.t = met.t / length;
    return met;
}

#endif
