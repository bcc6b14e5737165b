// SPDX-License-Identifier: MIT
#ifndef FM_SCENES_NOISE_H
#define FM_SCENES_NOISE_H

// Integer hashing and value noise. No floating point: the bits are the same everywhere.

#include <stdint.h>

// A bijection of 64-bit integers whose output bits each depend on all input bits: the finaliser of SplitMix64 (Steele, Lea and
// Flood 2014).
static inline uint64_t fm_mix(uint64_t value) {
    value = (value ^ (value >> 30)) * 0xbf58476d1ce4e5b9u;
    value = (value ^ (value >> 27)) * 0x94d049bb133111ebu;
    return value ^ (value >> 31);
}

// Random bits of the row (y, z) of a field; fm_hash_x takes them on to one element of the row.
static inline uint64_t fm_hash_row(uint64_t seed, uint32_t y, uint32_t z) {
    return fm_mix(fm_mix(seed + 0x9e3779b97f4a7c15u) + ((uint64_t)z << 32 | y));
}

static inline uint64_t fm_hash_x(uint64_t row, uint32_t x) {
    return fm_mix(row + x * 0x9e3779b97f4a7c15u);
}

enum {
    FM_NOISE_BLOCK = 256,  // most voxels of a row that one call makes
    FM_NOISE_RANGE = 65536
};

typedef struct fm_noise {
    uint64_t seed;
    uint32_t shift;    // the coarsest lattice has cells of 2^shift voxels; at least `octaves` + 1
    uint32_t octaves;  // each has half the cell and half the height of the one before
} fm_noise;

// Fractal value noise of the voxels x0 to x0 + count - 1 of the row (y, z); count is at most FM_NOISE_BLOCK. Values are below
// FM_NOISE_RANGE, the mean is half of it. Neighbours are joined by a smooth cubic.
void fm_noise_row(const fm_noise *noise, uint32_t x0, uint32_t y, uint32_t z, uint32_t count, uint32_t *out);

#endif
