// SPDX-License-Identifier: MIT
#ifndef FM_TEST_CASES_H
#define FM_TEST_CASES_H

// The table that drives every transform against the oracle: grids, and what may be asked of them. Deterministic.

#include "fathom/fathom.h"
#include "random.h"

typedef struct test_grid {
    fm_shape shape;
    uint32_t pattern;
    uint64_t seed;
} test_grid;

uint32_t test_grid_count(void);
test_grid test_grid_at(uint32_t i);
const char *test_pattern_name(uint32_t pattern);

// One byte a voxel, 1 where it is solid.
void test_grid_fill(const test_grid *grid, uint8_t *solid);

typedef struct test_variant {
    fm_transform_desc desc;  // metric, sides, limits, spacing; the selection is that of an encoding
    bool want_distance, want_index;
    fm_type distance, index;
} test_variant;

uint32_t test_variant_count(void);
test_variant test_variant_at(uint32_t i);

// How voxels are told from empty space: an element type and a selection that yields the grid's sites.
typedef struct test_encoding {
    fm_type type;
    fm_select select;
    double threshold;
    int64_t label;
    bool on_device;  // fm_transform takes the type in device memory
} test_encoding;

uint32_t test_encoding_count(void);
test_encoding test_encoding_at(uint32_t i);

// Writes fm_array_bytes bytes of the encoding's type.
void test_encode(const test_encoding *encoding, fm_shape shape, const uint8_t *solid, void *out);

#endif
