// SPDX-License-Identifier: MIT
// The table of cases: shapes by patterns, and metrics by sides, limits, spacings and types.

#include "cases.h"

#include <math.h>
#include <string.h>

// Besides 1 to 9 along each axis and as a cube: primes, flat and thin grids, both sides of word and vector widths, and lengths
// whose distances leave 8 and 16 bits, squared or not.
static const fm_shape shapes[] = {
    {31, 7, 5},  {37, 13, 3}, {67, 11, 2}, {7, 31, 5},  {5, 7, 31},  {1, 17, 9},   {17, 1, 9},   {33, 9, 1},  {1, 1, 40},
    {1, 40, 1},  {70, 1, 1},  {15, 3, 3},  {16, 3, 3},  {17, 3, 4},  {31, 2, 5},   {32, 4, 3},   {33, 5, 2},  {63, 3, 2},
    {64, 3, 3},  {65, 2, 3},  {96, 2, 2},  {127, 2, 1}, {128, 1, 3}, {129, 3, 1},  {20, 12, 8},  {8, 20, 12}, {300, 2, 2},
    {2, 300, 2}, {2, 2, 300}, {17, 1, 70}, {17, 70, 1}, {520, 2, 1}, {16, 300, 1}, {16, 1, 300}, {18, 6, 20}, {40, 18, 3},
};
enum { SHAPES = sizeof shapes / sizeof shapes[0], SMALL = 9, SMALL_SHAPES = 4 * SMALL };

static fm_shape shape_at(uint32_t i) {
    if (i >= SMALL_SHAPES) {
        return shapes[i - SMALL_SHAPES];
    }
    uint32_t n = i % SMALL + 1;
    switch (i / SMALL) {
    case 0:
        return (fm_shape){n, 3, 4};
    case 1:
        return (fm_shape){4, n, 3};
    case 2:
        return (fm_shape){3, 4, n};
    default:
        return (fm_shape){n, n, n};
    }
}

typedef enum pattern {
    EMPTY = 0,
    FULL,
    ONE_VOXEL,
    ALL_BUT_ONE,
    CORNERS,
    CHECKER,
    PLANE,
    BALL,
    DIAGONAL,
    COLUMNS,
    RANDOM_HALF,
    RANDOM_TENTH,
    RANDOM_HUNDREDTH,
    RANDOM_THOUSANDTH,
    RANDOM_NINE_TENTHS,
    PATTERNS
} pattern;

static const char *const pattern_names[PATTERNS] = {
    "empty",
    "full",
    "one voxel",
    "all but one",
    "corners",
    "checker",
    "plane",
    "ball",
    "diagonal",
    "columns",
    "random half",
    "random tenth",
    "random hundredth",
    "random thousandth",
    "random nine tenths",
};

const char *test_pattern_name(uint32_t i) {
    return pattern_names[i];
}

uint32_t test_grid_count(void) {
    return (SMALL_SHAPES + SHAPES) * PATTERNS;
}

test_grid test_grid_at(uint32_t i) {
    return (test_grid){shape_at(i / PATTERNS), i % PATTERNS, i};
}

static bool in_ball(fm_shape shape, uint32_t x, uint32_t y, uint32_t z) {
    int64_t dx = 2 * (int64_t)x + 1 - shape.x;
    int64_t dy = 2 * (int64_t)y + 1 - shape.y;
    int64_t dz = 2 * (int64_t)z + 1 - shape.z;
    int64_t square = dx * dx + dy * dy + dz * dz;
    return square <= 49 && square >= 9;
}

void test_grid_fill(const test_grid *grid, uint8_t *solid) {
    const fm_shape shape = grid->shape;
    const uint64_t voxels = (uint64_t)shape.x * shape.y * shape.z;
    static const uint64_t per_mille[PATTERNS] = {
        [RANDOM_HALF] = 500, [RANDOM_TENTH] = 100, [RANDOM_HUNDREDTH] = 10, [RANDOM_THOUSANDTH] = 1, [RANDOM_NINE_TENTHS] = 900};
    uint64_t seed = grid->seed;
    const uint64_t chosen = test_random(&seed) % voxels;
    for (uint64_t i = 0; i < voxels; i++) {
        const uint32_t x = (uint32_t)(i % shape.x);
        const uint32_t y = (uint32_t)(i / shape.x % shape.y);
        const uint32_t z = (uint32_t)(i / shape.x / shape.y);
        switch (grid->pattern) {
        case EMPTY:
        case FULL:
            solid[i] = grid->pattern == FULL;
            break;
        case ONE_VOXEL:
        case ALL_BUT_ONE:
            solid[i] = (i == chosen) == (grid->pattern == ONE_VOXEL);
            break;
        case CORNERS:
            solid[i] = (x == 0 || x == shape.x - 1) && (y == 0 || y == shape.y - 1) && (z == 0 || z == shape.z - 1);
            break;
        case CHECKER:
            solid[i] = (x + y + z) % 2;
            break;
        case PLANE:
            solid[i] = x == shape.x / 3 || z == shape.z / 2;
            break;
        case BALL:
            solid[i] = in_ball(shape, x, y, z);
            break;
        case DIAGONAL:
            solid[i] = x == y && y == z;
            break;
        case COLUMNS:
            solid[i] = x % 4 == 1 && y % 3 == 0;
            break;
        default:
            solid[i] = test_random(&seed) % 1000 < per_mille[grid->pattern];
            break;
        }
    }
}

typedef struct result_row {
    fm_type type;
    bool is_signed, squared, saturate;
} result_row;

static const result_row results[] = {
    {FM_TYPE_U8, false, false, true},   {FM_TYPE_U16, false, false, false}, {FM_TYPE_U32, false, false, false},
    {FM_TYPE_F32, false, false, false}, {FM_TYPE_U32, false, true, false},  {FM_TYPE_F32, false, true, false},
    {FM_TYPE_I8, true, false, true},    {FM_TYPE_I16, true, false, false},  {FM_TYPE_I32, true, false, false},
    {FM_TYPE_F32, true, false, false},  {FM_TYPE_I32, true, true, false},   {FM_TYPE_F32, true, true, false},
};
static const double spacings[][3] = {{0, 0, 0}, {0.5, 0.5, 0.5}, {1, 1, 2.5}, {0.3, 0.7, 1.1}};
static const double limits[] = {0, 3, 2.5, 260};

enum {
    RESULTS = sizeof results / sizeof results[0],
    SPACINGS = sizeof spacings / sizeof spacings[0],
    LIMITS = sizeof limits / sizeof limits[0],
    INDICES = 3,  // none, 32 bits, 64 bits
    METRICS = 3,
    SIDES = 2,
    VARIANTS = RESULTS * SPACINGS * LIMITS * INDICES * METRICS * SIDES,
};

static bool variant_make(uint32_t i, test_variant *variant) {
    const result_row result = results[i % RESULTS];
    i /= RESULTS;
    const uint32_t metric = i % METRICS;
    i /= METRICS;
    const uint32_t index = i % INDICES;
    i /= INDICES;
    const uint32_t outside = i % SIDES;
    i /= SIDES;
    const uint32_t limit = i % LIMITS;
    const uint32_t spacing = i / LIMITS;
    const bool whole = result.type != FM_TYPE_F32;
    if ((result.squared && metric != FM_METRIC_L2) || (whole && (spacing != 0 || limits[limit] != floor(limits[limit])))) {
        return false;
    }
    *variant = (test_variant){
        .desc = {.metric = (fm_metric)metric,
                 .outside = (fm_outside)outside,
                 .is_signed = result.is_signed,
                 .squared = result.squared,
                 .saturate = result.saturate,
                 .max_distance = limits[limit]},
        .want_distance = true,
        .want_index = index != 0,
        .distance = result.type,
        .index = index == 2 ? FM_TYPE_U64 : FM_TYPE_U32,
    };
    memcpy(variant->desc.spacing, spacings[spacing], sizeof spacings[spacing]);
    // Index alone, in the place of a type that the next row repeats.
    if (variant->want_index && result.type == FM_TYPE_U32 && !result.squared) {
        variant->want_distance = false;
    }
    return true;
}

uint32_t test_variant_count(void) {
    uint32_t count = 0;
    test_variant variant;
    for (uint32_t i = 0; i < VARIANTS; i++) {
        count += variant_make(i, &variant);
    }
    return count;
}

test_variant test_variant_at(uint32_t wanted) {
    test_variant variant = {0};
    for (uint32_t i = 0, seen = 0; i < VARIANTS; i++) {
        if (variant_make(i, &variant) && seen++ == wanted) {
            break;
        }
    }
    return variant;
}

static const test_encoding encodings[] = {
    {FM_TYPE_U8, FM_SELECT_NONZERO, 0, 0, true},       {FM_TYPE_BITS, FM_SELECT_NONZERO, 0, 0, true},
    {FM_TYPE_U16, FM_SELECT_NONZERO, 0, 0, true},      {FM_TYPE_U32, FM_SELECT_NONZERO, 0, 0, true},
    {FM_TYPE_F32, FM_SELECT_NONZERO, 0, 0, true},      {FM_TYPE_U8, FM_SELECT_THRESHOLD, 2.5, 0, true},
    {FM_TYPE_U16, FM_SELECT_THRESHOLD, 2.5, 0, true},  {FM_TYPE_U32, FM_SELECT_THRESHOLD, 3, 0, true},
    {FM_TYPE_F32, FM_SELECT_THRESHOLD, 2.5, 0, true},  {FM_TYPE_BITS, FM_SELECT_THRESHOLD, 0.5, 0, true},
    {FM_TYPE_U8, FM_SELECT_LABEL, 0, 5, true},         {FM_TYPE_U16, FM_SELECT_LABEL, 0, 5, true},
    {FM_TYPE_U32, FM_SELECT_LABEL, 0, 5, true},        {FM_TYPE_BITS, FM_SELECT_LABEL, 0, 0, true},
    {FM_TYPE_I8, FM_SELECT_NONZERO, 0, 0, false},      {FM_TYPE_I8, FM_SELECT_THRESHOLD, 2.5, 0, false},
    {FM_TYPE_I8, FM_SELECT_LABEL, 0, 5, false},        {FM_TYPE_I16, FM_SELECT_NONZERO, 0, 0, false},
    {FM_TYPE_I16, FM_SELECT_LABEL, 0, 5, false},       {FM_TYPE_I32, FM_SELECT_THRESHOLD, 2.5, 0, false},
    {FM_TYPE_I32, FM_SELECT_LABEL, 0, 5, false},       {FM_TYPE_U64, FM_SELECT_NONZERO, 0, 0, false},
    {FM_TYPE_U64, FM_SELECT_THRESHOLD, 3, 0, false},   {FM_TYPE_I64, FM_SELECT_LABEL, 0, 5, false},
    {FM_TYPE_I64, FM_SELECT_THRESHOLD, 3, 0, false},   {FM_TYPE_F64, FM_SELECT_NONZERO, 0, 0, false},
    {FM_TYPE_F64, FM_SELECT_THRESHOLD, 2.5, 0, false},
};

uint32_t test_encoding_count(void) {
    return sizeof encodings / sizeof encodings[0];
}

test_encoding test_encoding_at(uint32_t i) {
    return encodings[i];
}

// A value for a voxel: several of each kind, so that a comparison in the wrong type shows.
static int value_of(const test_encoding *encoding, bool solid, uint64_t random) {
    const bool negative = encoding->type >= FM_TYPE_I8 && encoding->type != FM_TYPE_U64;
    switch (encoding->select) {
    case FM_SELECT_NONZERO:
        return !solid ? 0 : negative && random % 2 ? -1 : 1 + (int)(random % 127);
    case FM_SELECT_THRESHOLD:
        return solid ? 3 + (int)(random % 120) : negative && random % 2 ? -7 : (int)(random % 3);
    default:
        return solid ? 5 : (int)(random % 5);
    }
}

static void encode_bits(const test_encoding *encoding, fm_shape shape, const uint8_t *solid, uint32_t *out) {
    const uint64_t rows = (uint64_t)shape.y * shape.z;
    const uint32_t words = (shape.x + 31) / 32;
    const bool flip = encoding->select == FM_SELECT_LABEL;
    for (uint64_t row = 0; row < rows; row++) {
        for (uint32_t x = 0; x < words * 32; x++) {
            // What lies past the row end is ignored, so it is set now and then.
            const bool bit = x < shape.x ? (solid[row * shape.x + x] != 0) != flip : (x + row) % 3 == 0;
            uint32_t *word = &out[row * words + x / 32];
            *word = (x % 32 == 0 ? 0 : *word) | (uint32_t)bit << (x % 32);
        }
    }
}

void test_encode(const test_encoding *encoding, fm_shape shape, const uint8_t *solid, void *out) {
    if (encoding->type == FM_TYPE_BITS) {
        encode_bits(encoding, shape, solid, out);
        return;
    }
    const uint64_t voxels = (uint64_t)shape.x * shape.y * shape.z;
    uint64_t seed = voxels;
    for (uint64_t i = 0; i < voxels; i++) {
        const int value = value_of(encoding, solid[i], test_random(&seed));
        switch (encoding->type) {
        case FM_TYPE_U8:
        case FM_TYPE_I8:
            ((uint8_t *)out)[i] = (uint8_t)value;
            break;
        case FM_TYPE_U16:
        case FM_TYPE_I16:
            ((uint16_t *)out)[i] = (uint16_t)value;
            break;
        case FM_TYPE_U32:
        case FM_TYPE_I32:
            ((uint32_t *)out)[i] = (uint32_t)value;
            break;
        case FM_TYPE_F32:
            ((float *)out)[i] = (float)value;
            break;
        case FM_TYPE_F64:
            ((double *)out)[i] = value;
            break;
        default:
            ((uint64_t *)out)[i] = (uint64_t)(int64_t)value;
            break;
        }
    }
}
