// SPDX-License-Identifier: MIT
// From the caller's voxels to one bit a voxel. Every selection becomes one comparison in the element's own type, chosen so that it
// is exact: `value != key` (nonzero), `value >= key` (threshold) or `value == key` (label), or a constant.

#include "transform/kernels.h"

#include <math.h>
#include <stdatomic.h>
#include <string.h>

typedef enum encode_test { TEST_NEVER = 0, TEST_ALWAYS, TEST_DIFFERS, TEST_APART, TEST_EQUALS, TEST_AT_LEAST } encode_test;

// The key in each family of types; floats hold a float's or a double's key.
typedef struct encode_rule {
    encode_test test;
    uint64_t key_unsigned;
    int64_t key_signed;
    double key_float;
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

static void integer_limits(fm_type type, int64_t *least, uint64_t *most) {
    switch (type) {
    case FM_TYPE_I8:
        *least = INT8_MIN;
        *most = INT8_MAX;
        break;
    case FM_TYPE_I16:
        *least = INT16_MIN;
        *most = INT16_MAX;
        break;
    case FM_TYPE_I32:
        *least = INT32_MIN;
        *most = INT32_MAX;
        break;
    case FM_TYPE_I64:
        *least = INT64_MIN;
        *most = INT64_MAX;
        break;
    default:
        *least = 0;
        *most = type == FM_TYPE_BITS ? 1 : fm_type_greatest(type);
        break;
    }
}

// An integer is at least `threshold` when it is at least the next integer up.
static encode_rule integer_threshold(double threshold, int64_t least, uint64_t most) {
    double up = ceil(threshold);
    if (up <= (double)least) {
        return (encode_rule){.test = TEST_ALWAYS};
    }
    // (double)most rounds up to 2^63 or 2^64 for the 64-bit types, which no value reaches.
    bool wide = most >= INT64_MAX;
    if (wide ? up >= (double)most : up > (double)most) {
        return (encode_rule){.test = TEST_NEVER};
    }
    encode_rule rule = {.test = TEST_AT_LEAST};
    rule.key_unsigned = up > 0 ? (uint64_t)up : 0;
    rule.key_signed = up < 0x1p63 ? (int64_t)up : INT64_MAX;
    return rule;
}

static encode_rule make_rule(const fm_plan *plan, fm_type type) {
    if (plan->select == FM_SELECT_NONZERO) {
        // NaN differs from 0 but is no solid voxel.
        return (encode_rule){.test = type == FM_TYPE_F32 || type == FM_TYPE_F64 ? TEST_APART : TEST_DIFFERS};
    }
    if (type == FM_TYPE_F32 || type == FM_TYPE_F64) {
        encode_rule rule = {.test = TEST_AT_LEAST, .key_float = plan->threshold};
        // The smallest float that is at least the threshold.
        float key = (float)plan->threshold;
        if (type == FM_TYPE_F32 && (double)key < plan->threshold) {
            key = nextafterf(key, INFINITY);
        }
        if (type == FM_TYPE_F32) {
            rule.key_float = key;
        }
        return rule;
    }
    int64_t least;
    uint64_t most;
    integer_limits(type, &least, &most);
    if (plan->select == FM_SELECT_THRESHOLD) {
        return integer_threshold(plan->threshold, least, most);
    }
    if (plan->label < least || (plan->label > 0 && (uint64_t)plan->label > most)) {
        return (encode_rule){.test = TEST_NEVER};
    }
    return (encode_rule){.test = TEST_EQUALS, .key_unsigned = (uint64_t)plan->label, .key_signed = plan->label};
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
        const type key = (type)rule->field;                                                                                        \
        switch (rule->test) {                                                                                                      \
        case TEST_DIFFERS:                                                                                                         \
            COMPARE(values[i] != key);                                                                                             \
        case TEST_APART:                                                                                                           \
            COMPARE(values[i]<key || values[i]> key);                                                                              \
        case TEST_EQUALS:                                                                                                          \
            COMPARE(values[i] == key);                                                                                             \
        case TEST_AT_LEAST:                                                                                                        \
            COMPARE(values[i] >= key);                                                                                             \
        default:                                                                                                                   \
            COMPARE(rule->test == TEST_ALWAYS);                                                                                    \
        }                                                                                                                          \
    }

DEFINE_TEST(test_u8, uint8_t, key_unsigned)
DEFINE_TEST(test_u16, uint16_t, key_unsigned)
DEFINE_TEST(test_u32, uint32_t, key_unsigned)
DEFINE_TEST(test_u64, uint64_t, key_unsigned)
DEFINE_TEST(test_i8, int8_t, key_signed)
DEFINE_TEST(test_i16, int16_t, key_signed)
DEFINE_TEST(test_i32, int32_t, key_signed)
DEFINE_TEST(test_i64, int64_t, key_signed)
DEFINE_TEST(test_f32, float, key_float)
DEFINE_TEST(test_f64, double, key_float)

typedef void (*test_fn)(const encode_rule *rule, const void *solid, uint64_t at, size_t count, uint8_t *restrict out);

static const test_fn tests[] = {
    [FM_TYPE_U8] = test_u8,   [FM_TYPE_U16] = test_u16, [FM_TYPE_U32] = test_u32, [FM_TYPE_F32] = test_f32,
    [FM_TYPE_I8] = test_i8,   [FM_TYPE_I16] = test_i16, [FM_TYPE_I32] = test_i32, [FM_TYPE_U64] = test_u64,
    [FM_TYPE_I64] = test_i64, [FM_TYPE_F64] = test_f64,
};

static uint32_t word_bits(const encode_rule *rule, uint32_t bits, uint32_t count) {
    uint32_t valid = count == 32 ? UINT32_MAX : (1u << count) - 1;
    switch (rule->test) {
    case TEST_DIFFERS:
        return bits & valid;
    case TEST_EQUALS:
        return (rule->key_unsigned ? bits : ~bits) & valid;
    case TEST_AT_LEAST:
        return (rule->key_unsigned ? bits : ~0u) & valid;
    case TEST_ALWAYS:
        return valid;
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
    const uint8_t key = (uint8_t)job->rule.key_unsigned;
    const uint64_t whole = count / 32;
    switch (job->rule.test) {
    case TEST_DIFFERS:
        job->kernels->differs_u8(values, whole, key, words);
        return whole;
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
