// SPDX-License-Identifier: MIT
#ifndef FM_BASE_H
#define FM_BASE_H

// What every part of the library rests on: errors, messages, host memory, checked arithmetic and time.

#include "fathom/fathom.h"

#if defined(__GNUC__)
#define FM_PRINTF(string, first) __attribute__((format(printf, string, first)))
#else
#define FM_PRINTF(string, first)
#endif

// Sets the calling thread's error message and returns `result`, so that a check is one line: return fm_fail(...).
fm_result fm_fail(fm_result result, const char *format, ...) FM_PRINTF(2, 3);

// Puts `prefix` and ": " before the message of the error that was just reported.
fm_result fm_fail_prefix(fm_result result, const char *prefix);

#define FM_TRY(call)                                                                                                               \
    do {                                                                                                                           \
        fm_result fm_try_result = (call);                                                                                          \
        if (fm_try_result != FM_OK) {                                                                                              \
            return fm_try_result;                                                                                                  \
        }                                                                                                                          \
    } while (0)

// Where messages go; `fn` may be NULL.
typedef struct fm_log {
    fm_log_fn fn;
    void *user;
} fm_log;

void fm_log_write(const fm_log *log, fm_log_level level, const char *format, ...) FM_PRINTF(3, 4);

enum { FM_ALIGNMENT = 64 };  // of all host memory: a cache line and the widest SIMD register

// The C library's allocator behind the hook's interface.
extern const fm_allocator fm_default_allocator;

// Memory aligned to FM_ALIGNMENT, or NULL with the error set. `what` names the purpose for the message. Size 0 gives memory too.
void *fm_alloc(const fm_allocator *allocator, uint64_t size, const char *what);
void *fm_alloc_zero(const fm_allocator *allocator, uint64_t size, const char *what);
// `size` as it was asked for; NULL is fine.
void fm_free(const fm_allocator *allocator, void *memory, uint64_t size);

static inline bool fm_mul_overflows(uint64_t a, uint64_t b, uint64_t *product) {
    return __builtin_mul_overflow(a, b, product);
}

static inline bool fm_add_overflows(uint64_t a, uint64_t b, uint64_t *sum) {
    return __builtin_add_overflow(a, b, sum);
}

static inline uint64_t fm_div_up(uint64_t a, uint64_t b) {
    return (a + b - 1) / b;
}

static inline uint64_t fm_round_up(uint64_t a, uint64_t multiple) {
    return fm_div_up(a, multiple) * multiple;
}

static inline uint64_t fm_min_u64(uint64_t a, uint64_t b) {
    return a < b ? a : b;
}

static inline uint64_t fm_max_u64(uint64_t a, uint64_t b) {
    return a > b ? a : b;
}

// The greatest power of two that is not above `value`; 1 for 0.
static inline uint32_t fm_floor_power_of_two(uint64_t value) {
    uint32_t power = 1;
    while ((uint64_t)power * 2 <= value) {
        power *= 2;
    }
    return power;
}

// Monotonic clock in nanoseconds.
uint64_t fm_now_ns(void);

static inline uint64_t fm_voxels(fm_shape shape) {
    return (uint64_t)shape.x * shape.y * shape.z;
}

static inline bool fm_shape_equal(fm_shape a, fm_shape b) {
    return a.x == b.x && a.y == b.y && a.z == b.z;
}

#endif
