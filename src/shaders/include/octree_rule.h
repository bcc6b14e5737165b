// SPDX-License-Identifier: MIT
#ifndef FM_OCTREE_RULE_H
#define FM_OCTREE_RULE_H

// How octrees are read and rays go into them: one text for C and GLSL. A head is passed by value; in GLSL it holds device
// addresses.

#include "octree_shared.h"
#include "rule.h"

#ifdef __STDC__
#define FM_WORD(address, at) (((const uint32_t *)(uintptr_t)(address))[at])
#define FM_REAL(address, at) (((const float *)(uintptr_t)(address))[at])
#else
#define FM_WORD(address, at) (ref_u32((address) + FM_LONG(at) * 4ul).v)
#define FM_REAL(address, at) uintBitsToFloat(ref_u32((address) + FM_LONG(at) * 4ul).v)
#endif

// What a ray met.
FM_PUSH_STRUCT(fm_octree_met) {
    fm_float t;          // +infinity: nothing
    fm_float normal[3];  // of length 1, towards the ray's origin
    fm_uint mark;        // the attribute (a reserved word in GLSL); of voxels their number
    fm_uint reads;
    fm_int level;  // of the leaf
};

FM_RULE fm_octree_met fm_octree_nothing(void) {
    fm_octree_met met;
    met.t = FM_INFINITY_F;
    met.normal[0] = 0;
    met.normal[1] = 0;
    met.normal[2] = 0;
    met.mark = 0u;
    met.reads = 0u;
    met.level = 0;
    return met;
}

// Where a ray enters and leaves the octree's box; it misses where the first is above the second.
FM_PUSH_STRUCT(fm_octree_span) {
    fm_float first, last;
};

FM_RULE fm_octree_span fm_octree_clip(fm_octree_head head, fm_v3 origin, fm_v3 way, fm_float first, fm_float last) {
    fm_float from[3], along[3];
    from[0] = origin.x;
    from[1] = origin.y;
    from[2] = origin.z;
    along[0] = way.x;
    along[1] = way.y;
    along[2] = way.z;
    fm_octree_span span;
    span.first = first;
    span.last = last;
    for (int axis = 0; axis < 3; axis++) {
        if (along[axis] == 0) {
            if (from[axis] < head.low[axis] || from[axis] > head.high[axis]) {
                span.last = -FM_INFINITY_F;
            }
            continue;
        }
        const fm_float a = (head.low[axis] - from[axis]) / along[axis];
        const fm_float b = (head.high[axis] - from[axis]) / along[axis];
        span.first = FM_MAX(span.first, FM_MIN(a, b));
        span.last = FM_MIN(span.last, FM_MAX(a, b));
    }
    return span;
}

#endif
