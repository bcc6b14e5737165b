// SPDX-License-Identifier: MIT
#ifndef FM_TEST_RANDOM_H
#define FM_TEST_RANDOM_H

#include <stdint.h>

// Numbers that follow from `seed` alone. SplitMix64: G. Steele, D. Lea and C. Flood, "Fast splittable pseudorandom number
// generators", 2014.
static inline uint64_t test_random(uint64_t *seed) {
    *seed += 0x9e3779b97f4a7c15u;
    uint64_t value = (*seed ^ (*seed >> 30)) * 0xbf58476d1ce4e5b9u;
    value = (value ^ (value >> 27)) * 0x94d049bb133111ebu;
    return value ^ (value >> 31);
}

// A number from `low` to `high`, both included.
static inline int32_t test_between(uint64_t *seed, int32_t low, int32_t high) {
    return low + (int32_t)(test_random(seed) % (uint64_t)((int64_t)high - low + 1));
}

#endif
