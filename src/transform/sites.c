// SPDX-License-Identifier: MIT
// From the caller's voxels to one bit a voxel. Every selection becomes one comparison in the element's own type, chosen so that it
// is exact: `value >= key` (threshold; nonzero, unsigned), `value < key || value > key` (nonzero, otherwise), `value == key`
// (label).

#include "transform/kernels.h"

#include <math.h>
#include <stdatomic.h>
#include <string.h>

typedef enum encode_test { TEST_NEVER = 0, TEST_APART, TEST_EQUALS, TEST_AT_LEAST } encode_test;

typedef struct encode_rule {
    encode_test test;
    union fm_value key;
} encode_rule;

typedef struct encode_job {
    fm_shape shape;
    fm_type type;
    encode_rule rule;
    const void *solid;
    uint32_t *words;
    bool nan_is_empty;
    const fm_kernels *kernels;
    atomic_uint_fast64_t first_nan;  // element index, UINT64_MAX for none
} encode_job;

// A range that is no label ends at the type's greatest value.
static encode_rule make_rule(const fm_plan *plan, fm_type type) {
    const fm_value_range range = fm_plan_selected(plan, type);
    encode_rule rule = {range.outside ? TEST_APART : TEST_AT_LEAST, range.least};
    if (range.nothing) {
        rule.test = TEST_NEVER;
    } else if (plan->select == FM_SELECT_LABEL) {
        rule.test = TEST_EQUALS;
    }
    return rule;
}

#define COMPARE(comparison)                                                                                                        \
    for (size_t i = 0; i < count; i++) {                                                                                           \
        out[i] = comparison;                                                                                                       \
    }                                                                                                                              \
    break

// One byte an element, 1 where it is solid.
#define DEFINE_TEST(name, type, field)                                                                                             \
    static void name(const encode_rule *rule, const void *solid, uint64_t at, size_t count, uint8_t *restrict out) {               \
        const type *restrict values = (const type *)solid + at;                                                                    \
        const type key = (type)rule->key.field;                                                                                    \
        switch (rule->test) {                                                                                                      \
        case TEST_APART:                                                                                                           \
            COMPARE(values[i]<key || values[i]> key);                                                                              \
        case TEST_EQUALS:                                                                                                          \
            COMPARE(values[i] == key);                                                                                             \
        case TEST_AT_LEAST:                                                                                                        \
            COMPARE(values[i] >= key);                                                                                             \
        default:                                                                                                                   \
            COMPARE(0);                                                                                                            \
        }                                                                                                                          \
    }

DEFINE_TEST(test_u8, uint8_t, u)
DEFINE_TEST(test_u16, uint16_t, u)
DEFINE_TEST(test_u32, uint32_t, u)
DEFINE_TEST(test_u64, uint64_t, u)
DEFINE_TEST(test_i8, int8_t, i)
DEFINE_TEST(test_i16, int16_t, i)
DEFINE_TEST(test_i32, int32_t, i)
DEFINE_TEST(test_i64, int64_t, i)
DEFINE_TEST(test_f32, float, f)
DEFINE_TEST(test_f64, double, f)

typedef void (*test_fn)(const encode_rule *rule, const void *solid, uint64_t at, size_t count, uint8_t *restrict out);

static const test_fn tests[] = {
    [FM_TYPE_U8] = test_u8,   [FM_TYPE_U16] = test_u16, [FM_TYPE_U32] = test_u32, [FM_TYPE_F32] = test_f32,
    [FM_TYPE_I8] = test_i8,   [FM_TYPE_I16] = test_i16, [FM_TYPE_I32] = test_i32, [FM_TYPE_U64] = test_u64,
    [FM_TYPE_I64] = test_i64, [FM_TYPE_F64] = test_f64,
};

static uint32_t word_bits(const encode_rule *rule, uint32_t bits, uint32_t count) {
    uint32_t valid = count == 32 ? UINT32_MAX : (1u << count) - 1;
    switch (rule->test) {
    case TEST_EQUALS:
        return (rule->key.u ? bits : ~bits) & valid;
    case TEST_AT_LEAST:
        return (rule->key.u ? bits : ~0u) & valid;
    default:
        return 0;
    }
}

static void encode_bits_row(const encode_job *job, uint64_t row, uint32_t *words) {
    const uint32_t row_words = fm_bits_row_words(job->shape);
    const uint32_t *bits = (const uint32_t *)job->solid + row * row_words;
    for (uint32_t i = 0; i < row_words; i++) {
        words[i] = word_bits(&job->rule, bits[i], (uint32_t)fm_min_u64(32, job->shape.x - 32 * (uint64_t)i));
    }
}

// Elements [at, at + count) as words, the last one filled up with zeros.
static void encode_run(const encode_job *job, uint64_t at, uint64_t count, uint32_t *words) {
    enum { BLOCK = 1024 };
    uint8_t solid[BLOCK];
    for (uint64_t done = 0; done < count; done += BLOCK) {
        size_t block = (size_t)fm_min_u64(BLOCK, count - done);
        tests[job->type](&job->rule, job->solid, at + done, block, solid);
        size_t whole = (size_t)fm_round_up(block, 32);
        memset(solid + block, 0, whole - block);
        job->kernels->differs_u8(solid, whole / 32, 0, words + done / 32);
    }
}

// The same for bytes, which need no step in between.
static uint64_t encode_whole_u8(const encode_job *job, uint64_t at, uint64_t count, uint32_t *words) {
    const uint8_t *values = (const uint8_t *)job->solid + at;
    const uint8_t key = (uint8_t)job->rule.key.u;
    const uint64_t whole = count / 32;
    switch (job->rule.test) {
    case TEST_EQUALS:
        job->kernels->equals_u8(values, whole, key, words);
        return whole;
    case TEST_AT_LEAST:
        job->kernels->at_least_u8(values, whole, key, words);
        return whole;
    default:
        return 0;
    }
}

static void note_nan(encode_job *job, uint64_t at) {
    uint64_t seen = atomic_load_explicit(&job->first_nan, memory_order_relaxed);
    while (at < seen && !atomic_compare_exchange_weak(&job->first_nan, &seen, at)) {
    }
}

static void scan_nan(encode_job *job, uint64_t begin, uint64_t end) {
    const float *floats = job->solid;
    const double *doubles = job->solid;
    for (uint64_t at = begin; at < end; at++) {
        if (job->type == FM_TYPE_F32 ? isnan(floats[at]) : isnan(doubles[at])) {
            note_nan(job, at);
            return;
        }
    }
}

static void encode_rows(void *user, uint64_t begin, uint64_t end, uint32_t worker) {
    encode_job *job = user;
    (void)worker;
    uint32_t row_words = fm_bits_row_words(job->shape);
    if (!job->nan_is_empty && (job->type == FM_TYPE_F32 || job->type == FM_TYPE_F64)) {
        scan_nan(job, begin * job->shape.x, end * job->shape.x);
    }
    // Rows that fill their words are one long row.
    const bool joined = job->shape.x % 32 == 0 && job->type != FM_TYPE_BITS;
    const uint64_t length = joined ? (end - begin) * job->shape.x : job->shape.x;
    for (uint64_t row = begin; row < end; row = joined ? end : row + 1) {
        uint32_t *words = job->words + row * row_words;
        const uint64_t at = row * job->shape.x;
        if (job->type == FM_TYPE_BITS) {
            encode_bits_row(job, row, words);
            continue;
        }
        uint64_t whole = job->type == FM_TYPE_U8 ? encode_whole_u8(job, at, length, words) : 0;
        encode_run(job, at + 32 * whole, length - 32 * whole, words + whole);
    }
}

fm_result fm_sites_encode(fm_context *context, const fm_plan *plan, fm_type type, const void *solid, bool nan_is_empty,
                          uint32_t *words) {
    encode_job job = {.shape = plan->shape,
                      .type = type,
                      .rule = make_rule(plan, type),
                      .solid = solid,
                      .words = words,
                      .nan_is_empty = nan_is_empty,
                      .kernels = fm_kernels_best()};
    atomic_init(&job.first_nan, UINT64_MAX);
    uint64_t rows = (uint64_t)plan->shape.y * plan->shape.z;
    uint64_t grain = fm_max_u64(1, (1 << 18) / plan->shape.x);
    fm_pool_run(context->pool, rows, grain, encode_rows, &job);
    uint64_t at = atomic_load(&job.first_nan);
    if (at != UINT64_MAX) {
        uint64_t row = at / plan->shape.x;
        return fm_fail(FM_ERROR_INVALID_ARGUMENT, "solid is NaN at voxel (%llu, %llu, %llu): every voxel must be a number",
                       (unsigned long long)(at % plan->shape.x), (unsigned long long)(row % plan->shape.y),
                       (unsigned long long)(row / plan->shape.y));
    }
    uint64_t bytes = 0;
    FM_TRY(fm_array_bytes(plan->shape, type, &bytes));
    fm_passes_end(context, "encode", bytes + fm_sites_bytes(plan->shape));
    return FM_OK;
}
