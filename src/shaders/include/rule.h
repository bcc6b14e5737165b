// SPDX-License-Identifier: MIT
#ifndef FM_RULE_H
#define FM_RULE_H

// What C and GLSL call by different names, so that a text can be both: functions, numbers, vectors, chance.

#include "shared.h"

#ifdef __STDC__
#include <math.h>
#include <stdbool.h>
#define FM_RULE static inline
#define FM_PRECISE
typedef struct fm_v3 {
    float x, y, z;
} fm_v3;
#define FM_F(x) ((float)(x))
#define FM_I(x) ((int)(x))
#define FM_U(x) ((uint32_t)(x))
#define FM_LONG(x) ((uint64_t)(x))
#define FM_MIN(a, b) fminf(a, b)
#define FM_MAX(a, b) fmaxf(a, b)
#define FM_LEAST(a, b) ((a) < (b) ? (a) : (b))
#define FM_MOST(a, b) ((a) > (b) ? (a) : (b))
#define FM_SQRT(x) sqrtf(x)
#define FM_FLOOR_OF(x) floorf(x)
#define FM_SIZE_OF(x) fabsf(x)
#define FM_EXP(x) expf(x)
#define FM_COS(x) cosf(x)
#define FM_SIN(x) sinf(x)
#define FM_ARCSIN(x) asinf(x)
#define FM_INFINITY_F INFINITY
static inline fm_v3 fm_v3_of(float x, float y, float z) {
    return (fm_v3){x, y, z};
}
static inline fm_v3 fm_add(fm_v3 a, fm_v3 b) {
    return (fm_v3){a.x + b.x, a.y + b.y, a.z + b.z};
}
static inline fm_v3 fm_less(fm_v3 a, fm_v3 b) {
    return (fm_v3){a.x - b.x, a.y - b.y, a.z - b.z};
}
static inline fm_v3 fm_times(fm_v3 a, float s) {
    return (fm_v3){a.x * s, a.y * s, a.z * s};
}
static inline float fm_dot(fm_v3 a, fm_v3 b) {
    return a.x * b.x + a.y * b.y + a.z * b.z;
}
#else
#define FM_RULE
#define FM_PRECISE precise
#define fm_v3 vec3
#define FM_F(x) float(x)
#define FM_I(x) int(x)
#define FM_U(x) uint(x)
#define FM_LONG(x) uint64_t(x)
#define FM_MIN(a, b) min(a, b)
#define FM_MAX(a, b) max(a, b)
#define FM_LEAST(a, b) min(a, b)
#define FM_MOST(a, b) max(a, b)
#define FM_SQRT(x) sqrt(x)
#define FM_FLOOR_OF(x) floor(x)
#define FM_SIZE_OF(x) abs(x)
#define FM_EXP(x) exp(x)
#define FM_COS(x) cos(x)
#define FM_SIN(x) sin(x)
#define FM_ARCSIN(x) asin(x)
#define FM_INFINITY_F (1.0 / 0.0)
#define fm_v3_of vec3
#define fm_add(a, b) ((a) + (b))
#define fm_less(a, b) ((a) - (b))
#define fm_times(a, s) ((a) * (s))
#define fm_dot(a, b) dot(a, b)
#endif

// As the comparison has it, with NaN as with two zeros: alike in both languages.
#define FM_LESSER(a, b) ((b) < (a) ? (b) : (a))
#define FM_GREATER(a, b) ((b) > (a) ? (b) : (a))

FM_RULE fm_v3 fm_unit(fm_v3 a) {
    fm_float length2 = fm_dot(a, a);
    return length2 > 0 ? fm_times(a, 1 / FM_SQRT(length2)) : a;
}

FM_RULE fm_v3 fm_cross(fm_v3 a, fm_v3 b) {
    return fm_v3_of(a.y * b.z - a.z * b.y, a.z * b.x - a.x * b.z, a.x * b.y - a.y * b.x);
}

// Two directions at right angles to a unit vector and to each other; the second is the first's cross product with it.
FM_RULE fm_v3 fm_beside(fm_v3 way) {
    fm_v3 other = FM_SIZE_OF(way.x) < 0.6f ? fm_v3_of(1, 0, 0) : fm_v3_of(0, 1, 0);
    return fm_unit(fm_cross(way, other));
}

// A number from 0 to 1, below 1. Source: Jarzynski and Olano 2020, "Hash functions for GPU rendering" (PCG).
FM_RULE fm_uint fm_scramble(fm_uint value) {
    fm_uint state = value * 747796405u + 2891336453u;
    fm_uint word = ((state >> ((state >> 28) + 4u)) ^ state) * 277803737u;
    return (word >> 22) ^ word;
}

FM_RULE fm_float fm_chance(fm_uint a, fm_uint b) {
    return FM_F(fm_scramble(fm_scramble(a) ^ b) >> 8) * (1.0f / 16777216.0f);
}

#endif
