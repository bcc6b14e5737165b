// SPDX-License-Identifier: MIT
#include "noise.h"

#include <assert.h>
#include <string.h>

// Weights run from 0 to 256.
static uint32_t blend(uint32_t a, uint32_t b, uint32_t weight) {
    return (a * (256 - weight) + b * weight) >> 8;
}

// 3 t^2 - 2 t^3 of the place within a cell.
static uint32_t smooth_weight(uint32_t position, uint32_t shift) {
    uint32_t t = ((position & ((1u << shift) - 1)) << 8) >> shift;
    return (t * t * (768 - 2 * t)) >> 16;
}

static void add_octave(uint64_t seed, uint32_t shift, uint32_t height, uint32_t x0, uint32_t y, uint32_t z, uint32_t count,
                       uint32_t *out) {
    enum { LATTICE = FM_NOISE_BLOCK / 4 + 2 };
    uint32_t lattice[LATTICE];
    const uint32_t cell_x = x0 >> shift, cell_y = y >> shift, cell_z = z >> shift;
    const uint32_t cells = ((x0 + count - 1) >> shift) - cell_x + 2;
    const uint32_t weight_y = smooth_weight(y, shift), weight_z = smooth_weight(z, shift);
    const uint64_t rows[4] = {fm_hash_row(seed, cell_y, cell_z), fm_hash_row(seed, cell_y + 1, cell_z),
                              fm_hash_row(seed, cell_y, cell_z + 1), fm_hash_row(seed, cell_y + 1, cell_z + 1)};
    assert(cells <= LATTICE);
    for (uint32_t i = 0; i < cells; i++) {
        uint32_t corner[4];
        for (int k = 0; k < 4; k++) {
            corner[k] = (uint32_t)(fm_hash_x(rows[k], cell_x + i) >> 48);
        }
        lattice[i] = blend(blend(corner[0], corner[1], weight_y), blend(corner[2], corner[3], weight_y), weight_z);
    }
    for (uint32_t i = 0; i < count; i++) {
        const uint32_t *pair = lattice + (((x0 + i) >> shift) - cell_x);
        out[i] += blend(pair[0], pair[1], smooth_weight(x0 + i, shift)) * height >> 16;
    }
}

void fm_noise_row(const fm_noise *noise, uint32_t x0, uint32_t y, uint32_t z, uint32_t count, uint32_t *out) {
    assert(count <= FM_NOISE_BLOCK && noise->shift < 24 && noise->shift > noise->octaves);
    memset(out, 0, count * sizeof *out);
    // Heights 1/2, 1/4, ... of the range, divided by what they add up to.
    const uint32_t total = (1u << noise->octaves) - 1;
    for (uint32_t k = 0; k < noise->octaves; k++) {
        uint32_t height = (FM_NOISE_RANGE - 1) * (1u << (noise->octaves - 1 - k)) / total;
        add_octave(fm_mix(noise->seed + k), noise->shift - k, height, x0, y, z, count, out);
    }
}
