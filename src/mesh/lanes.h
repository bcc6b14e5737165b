// SPDX-License-Identifier: MIT
#ifndef FM_LANES_H
#define FM_LANES_H

// Eight floats at a time, with the same bits for every instruction set. A mask has all bits of a lane set, or none.

#include <math.h>
#include <stdint.h>

#if defined(__AVX__)
#include <immintrin.h>
#endif

enum { LANES = 8 };

typedef float lanes __attribute__((vector_size(LANES * sizeof(float))));
typedef int32_t lane_mask __attribute__((vector_size(LANES * sizeof(int32_t))));

// Inlined always: vectors that wide have no calling convention without AVX.
#define LANE_OP static inline __attribute__((always_inline))

LANE_OP lanes lanes_all(float a) {
    return (lanes){a, a, a, a, a, a, a, a};
}

// b where the mask is set, else a.
LANE_OP lanes lanes_select(lane_mask mask, lanes a, lanes b) {
    return (lanes)((mask & (lane_mask)b) | (~mask & (lane_mask)a));
}

LANE_OP lanes lanes_abs(lanes a) {
    return (lanes)((lane_mask)a & INT32_MAX);
}

#if defined(__AVX__)
LANE_OP lanes lanes_min(lanes a, lanes b) {
    return (lanes)_mm256_min_ps((__m256)a, (__m256)b);
}

LANE_OP lanes lanes_max(lanes a, lanes b) {
    return (lanes)_mm256_max_ps((__m256)a, (__m256)b);
}

LANE_OP lanes lanes_sqrt(lanes a) {
    return (lanes)_mm256_sqrt_ps((__m256)a);
}

// A bit for each lane.
LANE_OP uint32_t lanes_bits(lane_mask mask) {
    return (uint32_t)_mm256_movemask_ps((__m256)mask);
}
#else
LANE_OP lanes lanes_min(lanes a, lanes b) {
    return lanes_select(a < b, b, a);
}

LANE_OP lanes lanes_max(lanes a, lanes b) {
    return lanes_select(a > b, b, a);
}

LANE_OP lanes lanes_sqrt(lanes a) {
    for (int i = 0; i < LANES; i++) {
        a[i] = sqrtf(a[i]);
    }
    return a;
}

// A bit for each lane.
LANE_OP uint32_t lanes_bits(lane_mask mask) {
    uint32_t bits = 0;
    for (int i = 0; i < LANES; i++) {
        bits |= (uint32_t)(mask[i] & 1) << i;
    }
    return bits;
}
#endif

#endif
