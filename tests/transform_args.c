// SPDX-License-Identifier: MIT
// Small answers worked out by hand, every refusal of the transform calls, and allocations that fail.

#include "check.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

static const fm_algorithm algorithms[] = {FM_ALGORITHM_SEPARABLE, FM_ALGORITHM_BRUTE_FORCE};

static fm_result transform(fm_context *context, fm_transform_desc desc, fm_shape shape, const uint8_t *solid, fm_type type,
                           void *out, uint64_t *indices) {
    fm_array array = {(void *)(uintptr_t)solid, FM_TYPE_U8, shape};
    fm_array distance = {out, type, shape};
    fm_array index = {indices, FM_TYPE_U64, shape};
    return fm_transform_host(context, &desc, &array, out ? &distance : NULL, indices ? &index : NULL);
}

// 3 x 2 x 2 with sites at (0, 0, 0) and (2, 1, 1).
static void test_by_hand(fm_context *context) {
    static const uint8_t solid[12] = {1, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 1};
    static const uint32_t squares[12] = {0, 1, 2, 1, 2, 1, 1, 2, 1, 2, 1, 0};
    static const uint8_t l1[12] = {0, 1, 2, 1, 2, 1, 1, 2, 1, 2, 1, 0};
    static const uint8_t linf[12] = {0, 1, 1, 1, 1, 1, 1, 1, 1, 1, 1, 0};
    static const uint64_t l1_sites[12] = {0, 0, 0, 0, 0, 11, 0, 0, 11, 0, 11, 11};
    static const uint64_t l2_sites[12] = {0, 0, 11, 0, 0, 11, 0, 0, 11, 0, 11, 11};
    static const uint64_t linf_sites[12] = {0, 0, 11, 0, 0, 11, 0, 0, 11, 0, 0, 11};
    const fm_shape shape = {3, 2, 2};
    for (int i = 0; i < 2; i++) {
        uint32_t wide[12];
        uint8_t narrow[12];
        float floats[12];
        uint64_t sites[12];
        fm_transform_desc desc = {.metric = FM_METRIC_L2, .algorithm = algorithms[i], .squared = true};
        CHECK_OK(transform(context, desc, shape, solid, FM_TYPE_U32, wide, NULL));
        CHECK(memcmp(wide, squares, sizeof squares) == 0);
        desc.squared = false;
        CHECK_OK(transform(context, desc, shape, solid, FM_TYPE_F32, floats, sites));
        CHECK(floats[0] == 0 && floats[1] == 1 && floats[2] == 0x1.6a09e6p+0f);
        CHECK(memcmp(sites, l2_sites, sizeof sites) == 0);
        desc.metric = FM_METRIC_L1;
        CHECK_OK(transform(context, desc, shape, solid, FM_TYPE_U8, narrow, sites));
        CHECK(memcmp(narrow, l1, sizeof l1) == 0);
        CHECK(memcmp(sites, l1_sites, sizeof sites) == 0);
        desc.metric = FM_METRIC_LINF;
        CHECK_OK(transform(context, desc, shape, solid, FM_TYPE_U8, narrow, sites));
        CHECK(memcmp(narrow, linf, sizeof linf) == 0);
        CHECK(memcmp(sites, linf_sites, sizeof sites) == 0);
    }
}

// A row of seven: solid at 2, 3 and 4.
static void test_row_by_hand(fm_context *context) {
    static const uint8_t solid[7] = {0, 0, 1, 1, 1, 0, 0};
    static const int8_t inside_out[7] = {2, 1, -1, -1, -1, 1, 2};
    static const int8_t walled[7] = {1, 1, -1, -2, -1, 1, 1};
    static const float world[7] = {1.0f, 0.5f, 0, 0, 0, 0.5f, 1.0f};
    const fm_shape shape = {7, 1, 1};
    for (int i = 0; i < 2; i++) {
        int8_t bytes[7];
        float floats[7];
        uint64_t sites[7];
        // The empty outside lies one step above and below the row, hence the -1 in its middle.
        fm_transform_desc desc = {.metric = FM_METRIC_L1, .algorithm = algorithms[i], .is_signed = true};
        CHECK_OK(transform(context, desc, shape, solid, FM_TYPE_I8, bytes, NULL));
        CHECK(memcmp(bytes, inside_out, sizeof bytes) == 0);
        desc.outside = FM_OUTSIDE_SOLID;
        CHECK_OK(transform(context, desc, shape, solid, FM_TYPE_I8, bytes, sites));
        CHECK(memcmp(bytes, walled, sizeof bytes) == 0);
        CHECK(sites[0] == FM_NO_INDEX_64 && sites[1] == 2 && sites[3] == 3 && sites[6] == FM_NO_INDEX_64);
        desc = (fm_transform_desc){.algorithm = algorithms[i], .spacing = {0.5, 0.5, 0.5}};
        CHECK_OK(transform(context, desc, shape, solid, FM_TYPE_F32, floats, NULL));
        CHECK(memcmp(floats, world, sizeof floats) == 0);
        desc = (fm_transform_desc){.algorithm = algorithms[i], .spacing = {3, 1, 1}, .max_distance = 4};
        CHECK_OK(transform(context, desc, shape, solid, FM_TYPE_F32, floats, sites));
        CHECK(floats[0] == 4 && floats[1] == 3 && floats[2] == 0 && sites[0] == FM_NO_INDEX_64 && sites[1] == 2);
        static const uint8_t nothing[7] = {0};
        desc = (fm_transform_desc){.algorithm = algorithms[i]};
        CHECK_OK(transform(context, desc, shape, nothing, FM_TYPE_F32, floats, sites));
        CHECK(floats[3] == INFINITY && sites[3] == FM_NO_INDEX_64);
        desc.metric = FM_METRIC_LINF;
        CHECK_OK(transform(context, desc, shape, nothing, FM_TYPE_U8, bytes, NULL));
        CHECK((uint8_t)bytes[3] == UINT8_MAX);
        static const uint8_t full[7] = {1, 1, 1, 1, 1, 1, 1};
        desc = (fm_transform_desc){.algorithm = algorithms[i], .is_signed = true, .outside = FM_OUTSIDE_SOLID};
        CHECK_OK(transform(context, desc, shape, full, FM_TYPE_F32, floats, NULL));
        CHECK(floats[3] == -INFINITY);
        CHECK_OK(transform(context, desc, shape, full, FM_TYPE_I8, bytes, NULL));
        CHECK(bytes[3] == -INT8_MAX);
    }
}

// The limit binds where the result in floats, not the real number, is above it: 9 * 1e-3f is greater than 9e-3f.
static void test_limits(fm_context *context) {
    static const struct {
        fm_metric metric;
        double spacing[3];
        double limit;
        bool squared;
        uint32_t within;  // voxels along the row from the site
    } rows[] = {
        {FM_METRIC_L2, {0.1, 0.1, 0.1}, 0.3, false, 3},     {FM_METRIC_L1, {0.1, 0.1, 0.1}, 0.3, false, 3},
        {FM_METRIC_LINF, {0.1, 0.1, 0.1}, 0.7, false, 7},   {FM_METRIC_L2, {0.1, 0.1, 0.1}, 0.29999, false, 2},
        {FM_METRIC_L2, {0.1, 0.1, 0.1}, 0.6, true, 6},      {FM_METRIC_L2, {0.1, 0.2, 0.3}, 0.3, false, 3},
        {FM_METRIC_L1, {0.1, 0.2, 0.3}, 0.7, false, 7},     {FM_METRIC_L2, {0.1, 0.2, 0.3}, 0.29999, false, 2},
        {FM_METRIC_L2, {0.7, 0.7, 0.7}, 2.1, false, 3},     {FM_METRIC_L2, {0}, 3, false, 3},
        {FM_METRIC_L2, {1e-3, 1e-3, 1e-3}, 9e-3, false, 8}, {FM_METRIC_L2, {0}, 2.5, true, 2},
    };
    static const uint8_t solid[12] = {1};
    const fm_shape shape = {12, 1, 1};
    for (size_t i = 0; i < 2 * sizeof rows / sizeof rows[0]; i++) {
        const size_t row = i / 2;
        const fm_transform_desc desc = {.metric = rows[row].metric,
                                        .algorithm = algorithms[i % 2],
                                        .squared = rows[row].squared,
                                        .max_distance = rows[row].limit,
                                        .spacing = {rows[row].spacing[0], rows[row].spacing[1], rows[row].spacing[2]}};
        float out[12], alone[12];
        uint64_t sites[12];
        CHECK_OK(transform(context, desc, shape, solid, FM_TYPE_F32, out, sites));
        CHECK_OK(transform(context, desc, shape, solid, FM_TYPE_F32, alone, NULL));
        const float limit = (float)(desc.squared ? desc.max_distance * desc.max_distance : desc.max_distance);
        bool good = memcmp(out, alone, sizeof out) == 0;
        for (uint32_t x = 0; x < shape.x; x++) {
            const bool within = x <= rows[row].within;
            good = good && out[x] <= limit && (within || out[x] == limit) && sites[x] == (within ? 0 : FM_NO_INDEX_64);
        }
        if (!CHECK(good)) {
            fprintf(stderr, "    row %zu, algorithm %zu: %.9g %.9g %.9g\n", row, i % 2, (double)out[2], (double)out[3],
                    (double)limit);
        }
    }
}

// Squares beyond 32 bits: floats, and a refusal of integers.
static void test_long_row(fm_context *context) {
    const fm_shape shape = {70000, 1, 1};
    uint8_t *solid = calloc(shape.x, 1);
    float *out = malloc(shape.x * sizeof *out);
    if (CHECK(solid && out)) {
        solid[0] = 1;
        CHECK_OK(transform(context, (fm_transform_desc){0}, shape, solid, FM_TYPE_F32, out, NULL));
        float worst = 0;
        for (uint32_t x = 1; x < shape.x; x++) {
            worst = fmaxf(worst, fabsf(out[x] - (float)x) / (float)x);
        }
        CHECK(out[0] == 0 && worst <= 4 * 0x1p-24f);
        CHECK_FAILS(transform(context, (fm_transform_desc){.squared = true}, shape, solid, FM_TYPE_U32, out, NULL), FM_ERROR_RANGE);
    }
    free(solid);
    free(out);
}

// Exact comparison of values that a narrower type would confuse.
static void test_exact_thresholds(fm_context *context) {
    const fm_shape shape = {3, 1, 1};
    uint64_t big[3] = {(1ull << 53) - 1, 1ull << 53, (1ull << 53) + 1};
    float small[3] = {0.1f, nextafterf(0.1f, 0), nextafterf(0.1f, 1)};
    float out[3];
    fm_transform_desc desc = {.select = FM_SELECT_THRESHOLD, .threshold = 0x1p53};
    fm_array distance = {out, FM_TYPE_F32, shape};
    fm_array solid = {big, FM_TYPE_U64, shape};
    CHECK_OK(fm_transform_host(context, &desc, &solid, &distance, NULL));
    CHECK(out[0] == 1 && out[1] == 0 && out[2] == 0);
    solid.type = FM_TYPE_I64;
    desc = (fm_transform_desc){.select = FM_SELECT_LABEL, .label = (1ll << 53) + 1};
    CHECK_OK(fm_transform_host(context, &desc, &solid, &distance, NULL));
    CHECK(out[0] == 2 && out[1] == 1 && out[2] == 0);
    // 0.1f is above the double 0.1, the float below it is not.
    solid = (fm_array){small, FM_TYPE_F32, shape};
    desc = (fm_transform_desc){.select = FM_SELECT_THRESHOLD, .threshold = 0.1};
    CHECK_OK(fm_transform_host(context, &desc, &solid, &distance, NULL));
    CHECK(out[0] == 0 && out[1] == 1 && out[2] == 0);
    int8_t bytes[3] = {-128, 0, 127};
    solid = (fm_array){bytes, FM_TYPE_I8, shape};
    desc.threshold = -1e300;
    CHECK_OK(fm_transform_host(context, &desc, &solid, &distance, NULL));
    CHECK(out[0] == 0 && out[1] == 0 && out[2] == 0);
    desc.threshold = 127.5;
    CHECK_OK(fm_transform_host(context, &desc, &solid, &distance, NULL));
    CHECK(out[0] == INFINITY && out[2] == INFINITY);
}

static void test_nan(fm_context *context) {
    const fm_shape shape = {4, 3, 2};
    float voxels[24] = {0};
    float out[24];
    memset(out, 0x5a, sizeof out);
    voxels[4 * (1 + 3 * 1) + 2] = NAN;
    voxels[23] = NAN;
    fm_array solid = {voxels, FM_TYPE_F32, shape};
    fm_array distance = {out, FM_TYPE_F32, shape};
    CHECK_FAILS(fm_transform_host(context, NULL, &solid, &distance, NULL), FM_ERROR_INVALID_ARGUMENT);
    CHECK(strstr(fm_last_error(), "(2, 1, 1)") != NULL);
    CHECK(((uint8_t *)out)[0] == 0x5a && ((uint8_t *)out)[95] == 0x5a);
}

typedef struct refusal {
    const char *word;  // that the message must hold
    fm_transform_desc desc;
    fm_type solid, distance;
    fm_result wanted;
} refusal;

static const refusal refusals[] = {
    {"metric", {.metric = (fm_metric)7}, FM_TYPE_U8, FM_TYPE_F32, FM_ERROR_INVALID_ARGUMENT},
    {"algorithm", {.algorithm = (fm_algorithm)-1}, FM_TYPE_U8, FM_TYPE_F32, FM_ERROR_INVALID_ARGUMENT},
    {"select", {.select = (fm_select)3}, FM_TYPE_U8, FM_TYPE_F32, FM_ERROR_INVALID_ARGUMENT},
    {"outside", {.outside = (fm_outside)2}, FM_TYPE_U8, FM_TYPE_F32, FM_ERROR_INVALID_ARGUMENT},
    {"threshold", {.select = FM_SELECT_THRESHOLD, .threshold = NAN}, FM_TYPE_U8, FM_TYPE_F32, FM_ERROR_INVALID_ARGUMENT},
    {"select", {.select = FM_SELECT_LABEL}, FM_TYPE_F32, FM_TYPE_F32, FM_ERROR_INVALID_ARGUMENT},
    {"distance", {.is_signed = true}, FM_TYPE_U8, FM_TYPE_U8, FM_ERROR_INVALID_ARGUMENT},
    {"distance", {0}, FM_TYPE_U8, FM_TYPE_I16, FM_ERROR_INVALID_ARGUMENT},
    {"distance", {0}, FM_TYPE_U8, FM_TYPE_F64, FM_ERROR_INVALID_ARGUMENT},
    {"distance", {.squared = true}, FM_TYPE_U8, FM_TYPE_U16, FM_ERROR_INVALID_ARGUMENT},
    {"squared", {.squared = true, .metric = FM_METRIC_L1}, FM_TYPE_U8, FM_TYPE_U32, FM_ERROR_INVALID_ARGUMENT},
    {"spacing", {.spacing = {1, 0, 1}}, FM_TYPE_U8, FM_TYPE_F32, FM_ERROR_INVALID_ARGUMENT},
    {"spacing", {.spacing = {1, 1, NAN}}, FM_TYPE_U8, FM_TYPE_F32, FM_ERROR_INVALID_ARGUMENT},
    {"spacing", {.spacing = {1, 1, -1}}, FM_TYPE_U8, FM_TYPE_F32, FM_ERROR_INVALID_ARGUMENT},
    {"spacing", {.spacing = {2, 2, 2}}, FM_TYPE_U8, FM_TYPE_U16, FM_ERROR_INVALID_ARGUMENT},
    {"spacing", {.spacing = {1e30, 1, 1}}, FM_TYPE_U8, FM_TYPE_F32, FM_ERROR_RANGE},
    {"spacing", {.spacing = {1e-30, 1, 1}}, FM_TYPE_U8, FM_TYPE_F32, FM_ERROR_RANGE},
    {"max_distance", {.max_distance = -1}, FM_TYPE_U8, FM_TYPE_F32, FM_ERROR_INVALID_ARGUMENT},
    {"max_distance", {.max_distance = NAN}, FM_TYPE_U8, FM_TYPE_F32, FM_ERROR_INVALID_ARGUMENT},
    {"max_distance", {.max_distance = INFINITY}, FM_TYPE_U8, FM_TYPE_F32, FM_ERROR_INVALID_ARGUMENT},
    {"max_distance", {.max_distance = 1.5}, FM_TYPE_U8, FM_TYPE_U16, FM_ERROR_INVALID_ARGUMENT},
    {"saturate", {0}, FM_TYPE_U8, FM_TYPE_U8, FM_ERROR_RANGE},
    {"saturate", {.is_signed = true, .metric = FM_METRIC_L1}, FM_TYPE_U8, FM_TYPE_I8, FM_ERROR_RANGE},
    {"saturate", {.max_distance = 256}, FM_TYPE_U8, FM_TYPE_U8, FM_ERROR_RANGE},
};

static void test_refusals(fm_context *context) {
    const fm_shape shape = {300, 2, 1};
    static uint64_t solid[600], out[600], sites[600];
    memset(out, 0x5a, sizeof out);
    for (size_t i = 0; i < sizeof refusals / sizeof refusals[0]; i++) {
        const refusal *row = &refusals[i];
        fm_array array = {solid, row->solid, shape};
        fm_array distance = {out, row->distance, shape};
        if (!CHECK_FAILS(fm_transform_host(context, &row->desc, &array, &distance, NULL), row->wanted) ||
            !CHECK(strstr(fm_last_error(), row->word) != NULL)) {
            fprintf(stderr, "    row %zu, \"%s\": %s\n", i, row->word, fm_last_error());
        }
    }
    fm_array array = {solid, FM_TYPE_U8, shape};
    fm_array distance = {out, FM_TYPE_F32, shape};
    fm_array index = {sites, FM_TYPE_U32, shape};
    CHECK_FAILS(fm_transform_host(NULL, NULL, &array, &distance, NULL), FM_ERROR_INVALID_ARGUMENT);
    CHECK(strstr(fm_last_error(), "context") != NULL);
    CHECK_FAILS(fm_transform_host(context, NULL, NULL, &distance, NULL), FM_ERROR_INVALID_ARGUMENT);
    CHECK(strstr(fm_last_error(), "solid") != NULL);
    CHECK_FAILS(fm_transform_host(context, NULL, &array, NULL, NULL), FM_ERROR_INVALID_ARGUMENT);
    CHECK(strstr(fm_last_error(), "indices") != NULL);
    index.type = FM_TYPE_F32;
    CHECK_FAILS(fm_transform_host(context, NULL, &array, NULL, &index), FM_ERROR_INVALID_ARGUMENT);
    index.type = FM_TYPE_U32;
    index.data = (uint8_t *)out + 4;
    CHECK_FAILS(fm_transform_host(context, NULL, &array, &distance, &index), FM_ERROR_INVALID_ARGUMENT);
    CHECK(strstr(fm_last_error(), "overlaps") != NULL);
    index.data = (uint8_t *)sites + 1;
    CHECK_FAILS(fm_transform_host(context, NULL, &array, &distance, &index), FM_ERROR_INVALID_ARGUMENT);
    CHECK(strstr(fm_last_error(), "aligned") != NULL);
    distance.data = NULL;
    CHECK_FAILS(fm_transform_host(context, NULL, &array, &distance, NULL), FM_ERROR_INVALID_ARGUMENT);
    distance.data = out;
    distance.shape.y = 3;
    CHECK_FAILS(fm_transform_host(context, NULL, &array, &distance, NULL), FM_ERROR_INVALID_ARGUMENT);
    CHECK(strstr(fm_last_error(), "shape") != NULL);
    array.shape.z = 0;
    CHECK_FAILS(fm_transform_host(context, NULL, &array, &distance, NULL), FM_ERROR_INVALID_ARGUMENT);
    array.shape = distance.shape = (fm_shape){INT32_MAX, INT32_MAX, INT32_MAX};
    CHECK_FAILS(fm_transform_host(context, NULL, &array, &distance, NULL), FM_ERROR_RANGE);
    bool untouched = true;
    for (size_t i = 0; i < sizeof out; i++) {
        untouched = untouched && ((uint8_t *)out)[i] == 0x5a;
    }
    CHECK(untouched);
}

static void test_volume_refusals(fm_context *context) {
    fm_volume *solid = NULL, *distance = NULL, *other = NULL;
    fm_volume_desc desc = {.shape = {4, 4, 4}, .type = FM_TYPE_F32, .storage = FM_STORAGE_HOST};
    CHECK_OK(fm_volume_create(context, &desc, &solid));
    CHECK_OK(fm_volume_create(context, &desc, &distance));
    desc.shape.z = 5;
    CHECK_OK(fm_volume_create(context, &desc, &other));
    memset(fm_volume_data(solid), 0, 256);
    CHECK_FAILS(fm_transform(NULL, NULL, solid, distance, NULL, NULL), FM_ERROR_INVALID_ARGUMENT);
    CHECK_FAILS(fm_transform(context, NULL, NULL, distance, NULL, NULL), FM_ERROR_INVALID_ARGUMENT);
    CHECK_FAILS(fm_transform(context, NULL, solid, NULL, NULL, NULL), FM_ERROR_INVALID_ARGUMENT);
    CHECK_FAILS(fm_transform(context, NULL, solid, solid, NULL, NULL), FM_ERROR_INVALID_ARGUMENT);
    CHECK_FAILS(fm_transform(context, NULL, solid, other, NULL, NULL), FM_ERROR_INVALID_ARGUMENT);
    // A NaN is no site here.
    ((float *)fm_volume_data(solid))[7] = NAN;
    fm_ticket ticket = 1;
    CHECK_OK(fm_transform(context, NULL, solid, distance, NULL, &ticket));
    CHECK(ticket == 0 && ((float *)fm_volume_data(distance))[7] == INFINITY);
    fm_volume_destroy(solid);
    fm_volume_destroy(distance);
    fm_volume_destroy(other);
}

// An allocator that fails its n-th call and counts what is out.
typedef struct failing {
    int64_t left;  // calls until the failure; negative: none
    int64_t held;
} failing;

static void *failing_alloc(void *user, size_t size, size_t alignment) {
    failing *state = user;
    if (state->left-- == 0) {
        return NULL;
    }
    state->held++;
    void *memory = NULL;
    return posix_memalign(&memory, alignment, size) == 0 ? memory : NULL;
}

static void failing_free(void *user, void *memory, size_t size) {
    (void)size;
    ((failing *)user)->held--;
    free(memory);
}

static void test_failing_allocations(void) {
    const fm_shape shape = {33, 5, 4};
    static uint8_t solid[660];
    static float out[660];
    static uint64_t sites[660];
    solid[100] = 1;
    int failures = 0;
    for (int64_t n = 0; n < 40; n++) {
        failing state = {n, 0};
        const fm_allocator allocator = {failing_alloc, failing_free, &state};
        const fm_context_desc desc = {.backend = FM_BACKEND_CPU, .threads = 2, .allocator = &allocator};
        fm_context *context = NULL;
        fm_result result = fm_context_create(&desc, &context);
        for (int i = 0; result == FM_OK && i < 3; i++) {
            memset(out, 0x5a, sizeof out);
            memset(sites, 0x5a, sizeof sites);
            const fm_transform_desc wanted = {.metric = (fm_metric)i, .is_signed = true};
            result = transform(context, wanted, shape, solid, FM_TYPE_F32, out, i == 1 ? sites : NULL);
            bool untouched =
                ((uint8_t *)out)[0] == 0x5a && ((uint8_t *)out)[sizeof out - 1] == 0x5a && sites[0] == 0x5a5a5a5a5a5a5a5a;
            CHECK(result == FM_OK ? out[100] < 0 : untouched);
            if (result != FM_OK) {
                // The context stays usable.
                CHECK_OK(transform(context, wanted, shape, solid, FM_TYPE_F32, out, NULL));
            }
        }
        CHECK(result == FM_OK || result == FM_ERROR_OUT_OF_HOST_MEMORY);
        failures += result != FM_OK;
        fm_context_destroy(context);
        CHECK(state.held == 0);
    }
    // The context, its threads and its scratch memory at least.
    CHECK(failures >= 3 && failures < 40);
}

int main(void) {
    const fm_context_desc desc = {.backend = FM_BACKEND_CPU, .threads = 2};
    fm_context *context = NULL;
    if (CHECK_OK(fm_context_create(&desc, &context))) {
        test_by_hand(context);
        test_row_by_hand(context);
        test_limits(context);
        test_long_row(context);
        test_exact_thresholds(context);
        test_nan(context);
        test_refusals(context);
        test_volume_refusals(context);
        fm_context_destroy(context);
    }
    test_failing_allocations();
    return check_summary();
}
