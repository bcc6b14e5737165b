// SPDX-License-Identifier: MIT
#ifndef FM_EXACT_KERNELS_H
#define FM_EXACT_KERNELS_H

// The exact passes of worlds on the CPU, once an instruction set. Columns go in tiles of FM_EXACT_TILE voxels along x: a tile is
// number t + tiles * z for the pass along y, t + tiles * y for that along z.

#include "base/pool.h"
#include "world/world.h"

enum { FM_EXACT_TILE = 64 };

typedef struct fm_exact_job {
    fm_shape shape;
    fm_field_format format;
    const uint32_t *voxels;
    const uint32_t *bits;
    void *field;
    void *middle;  // distances after y: FM_EXACT_TILE of tile (t, y) and slice z are number (t + tiles * y) * Z + z
    uint32_t row_words, tiles;
    uint32_t reach_words;        // words of bits beside a tile in which sites can matter
    bool full;                   // every tile, whatever it held
    const uint32_t *list;        // tiles of this pass; NULL: all
    uint8_t *dirty_y, *dirty_z;  // a byte a tile
    const uint32_t *range;       // per t: the first and the last slice whose tile may have changed
    uint32_t limit;              // L2: distances above it become `beyond`, and so does it
    uint32_t beyond;
    const uint32_t *steps;  // L2: k * k
    uint8_t *workers;
    uint64_t worker_bytes;
} fm_exact_job;

typedef struct fm_exact_lanes {
    // Flags the tiles of a row whose distances along x have changed with its sites.
    void (*changed)(const fm_exact_job *job, const uint32_t *before, uint32_t y, uint32_t z);
    fm_pool_fn along_y, along_z;  // items: places in the list
} fm_exact_lanes;

typedef struct fm_exact_kernels {
    fm_exact_lanes l1_u8, l1_u16, l2;
    void (*encode)(const uint32_t *voxels, uint64_t words, uint32_t *bits);
} fm_exact_kernels;

extern const fm_exact_kernels fm_exact_kernels_portable;
#ifdef FM_X86_KERNELS
extern const fm_exact_kernels fm_exact_kernels_avx2;
extern const fm_exact_kernels fm_exact_kernels_avx512;
#endif

#endif
