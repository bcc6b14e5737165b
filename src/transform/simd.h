// SPDX-License-Identifier: MIT
#ifndef FM_SIMD_H
#define FM_SIMD_H

// Vectors of unsigned integers for the instruction set that the file is compiled for. `any_less(a, b)`: whether a < b in any lane.
// 16-bit and 8-bit sums saturate; 32-bit ones must not overflow. `clear_where(words, first)`: all ones in the lanes whose bit is 0,
// from bit `first` on, a multiple of the lanes. `equals_32`, `at_least_32`: 32 comparisons as bits.

#include "transform/plan.h"

#include <stdbool.h>
#include <stddef.h>
#include <stdint.h>
#include <string.h>

#if defined(__AVX512BW__) && defined(__AVX512VL__)
#include <immintrin.h>
#define FM_LEVEL(name) name##_avx512
enum { VECTOR_BYTES = 64 };
typedef __m512i vector;
static inline vector load(const void *p) {
    return _mm512_loadu_si512(p);
}
static inline void store(void *p, vector a) {
    _mm512_storeu_si512(p, a);
}
static inline void stream(void *p, vector a) {
    _mm512_stream_si512(p, a);
}
static inline vector set_u8(uint8_t a) {
    return _mm512_set1_epi8((char)a);
}
static inline vector set_u16(uint16_t a) {
    return _mm512_set1_epi16((short)a);
}
static inline vector set_u32(uint32_t a) {
    return _mm512_set1_epi32((int)a);
}
static inline vector add_u8(vector a, vector b) {
    return _mm512_adds_epu8(a, b);
}
static inline vector add_u16(vector a, vector b) {
    return _mm512_adds_epu16(a, b);
}
static inline vector add_u15(vector a, vector b) {
    return _mm512_add_epi16(a, b);
}
static inline vector add_u32(vector a, vector b) {
    return _mm512_add_epi32(a, b);
}
static inline vector min_u8(vector a, vector b) {
    return _mm512_min_epu8(a, b);
}
static inline vector min_u16(vector a, vector b) {
    return _mm512_min_epu16(a, b);
}
static inline vector min_u32(vector a, vector b) {
    return _mm512_min_epu32(a, b);
}
static inline vector max_u16(vector a, vector b) {
    return _mm512_max_epu16(a, b);
}
static inline vector max_u32(vector a, vector b) {
    return _mm512_max_epu32(a, b);
}
static inline bool any_less_u8(vector a, vector b) {
    return _mm512_cmplt_epu8_mask(a, b) != 0;
}
static inline bool any_less_u16(vector a, vector b) {
    return _mm512_cmplt_epu16_mask(a, b) != 0;
}
static inline bool any_less_u32(vector a, vector b) {
    return _mm512_cmplt_epu32_mask(a, b) != 0;
}
static inline vector clear_where_u8(const uint32_t *words, uint32_t first) {
    uint64_t bits;
    memcpy(&bits, words + first / 32, sizeof bits);
    return _mm512_mask_set1_epi8(_mm512_setzero_si512(), ~bits, -1);
}
static inline vector clear_where_u16(const uint32_t *words, uint32_t first) {
    return _mm512_mask_set1_epi16(_mm512_setzero_si512(), (__mmask32)~words[first / 32], -1);
}
static inline uint32_t equals_32(const uint8_t *values, uint8_t key) {
    return _mm256_cmpeq_epi8_mask(_mm256_loadu_si256((const void *)values), _mm256_set1_epi8((char)key));
}
static inline uint32_t at_least_32(const uint8_t *values, uint8_t key) {
    return _mm256_cmpge_epu8_mask(_mm256_loadu_si256((const void *)values), _mm256_set1_epi8((char)key));
}
static inline void stream_fence(void) {
    _mm_sfence();
}

#elif defined(__AVX2__)
#include <immintrin.h>
#define FM_LEVEL(name) name##_avx2
enum { VECTOR_BYTES = 32 };
typedef __m256i vector;
static inline vector load(const void *p) {
    return _mm256_loadu_si256(p);
}
static inline void store(void *p, vector a) {
    _mm256_storeu_si256(p, a);
}
static inline void stream(void *p, vector a) {
    _mm256_stream_si256(p, a);
}
static inline vector set_u8(uint8_t a) {
    return _mm256_set1_epi8((char)a);
}
static inline vector set_u16(uint16_t a) {
    return _mm256_set1_epi16((short)a);
}
static inline vector set_u32(uint32_t a) {
    return _mm256_set1_epi32((int)a);
}
static inline vector add_u8(vector a, vector b) {
    return _mm256_adds_epu8(a, b);
}
static inline vector add_u16(vector a, vector b) {
    return _mm256_adds_epu16(a, b);
}
static inline vector add_u15(vector a, vector b) {
    return _mm256_add_epi16(a, b);
}
static inline vector add_u32(vector a, vector b) {
    return _mm256_add_epi32(a, b);
}
static inline vector min_u8(vector a, vector b) {
    return _mm256_min_epu8(a, b);
}
static inline vector min_u16(vector a, vector b) {
    return _mm256_min_epu16(a, b);
}
static inline vector min_u32(vector a, vector b) {
    return _mm256_min_epu32(a, b);
}
static inline vector max_u16(vector a, vector b) {
    return _mm256_max_epu16(a, b);
}
static inline vector max_u32(vector a, vector b) {
    return _mm256_max_epu32(a, b);
}
static inline bool any_less_u8(vector a, vector b) {
    vector excess = _mm256_subs_epu8(b, a);
    return !_mm256_testz_si256(excess, excess);
}
static inline bool any_less_u16(vector a, vector b) {
    vector excess = _mm256_subs_epu16(b, a);
    return !_mm256_testz_si256(excess, excess);
}
static inline bool any_less_u32(vector a, vector b) {
    vector kept = _mm256_cmpeq_epi32(_mm256_max_epu32(a, b), a);
    return _mm256_movemask_epi8(kept) != -1;
}
static inline vector clear_where_u8(const uint32_t *words, uint32_t first) {
    const vector bytes =
        _mm256_setr_epi8(0, 0, 0, 0, 0, 0, 0, 0, 1, 1, 1, 1, 1, 1, 1, 1, 2, 2, 2, 2, 2, 2, 2, 2, 3, 3, 3, 3, 3, 3, 3, 3);
    const vector bit = _mm256_set1_epi64x((long long)0x8040201008040201);
    vector spread = _mm256_shuffle_epi8(_mm256_set1_epi32((int)words[first / 32]), bytes);
    return _mm256_cmpeq_epi8(_mm256_and_si256(spread, bit), _mm256_setzero_si256());
}
static inline vector clear_where_u16(const uint32_t *words, uint32_t first) {
    const vector bit = _mm256_setr_epi16(1, 2, 4, 8, 16, 32, 64, 128, 256, 512, 1024, 2048, 4096, 8192, 16384, (short)32768);
    vector spread = _mm256_set1_epi16((short)(words[first / 32] >> (first % 32)));
    return _mm256_cmpeq_epi16(_mm256_and_si256(spread, bit), _mm256_setzero_si256());
}
static inline uint32_t equals_32(const uint8_t *values, uint8_t key) {
    return (uint32_t)_mm256_movemask_epi8(_mm256_cmpeq_epi8(load(values), set_u8(key)));
}
static inline uint32_t at_least_32(const uint8_t *values, uint8_t key) {
    vector value = load(values);
    return (uint32_t)_mm256_movemask_epi8(_mm256_cmpeq_epi8(_mm256_max_epu8(value, set_u8(key)), value));
}
static inline void stream_fence(void) {
    _mm_sfence();
}

#else
// Plain loops over 16 bytes, which compilers turn into what vectors the machine has.
#define FM_LEVEL(name) name##_portable
enum { VECTOR_BYTES = 16 };
typedef struct vector {
    union {
        uint8_t u8[16];
        uint16_t u16[8];
        uint32_t u32[4];
    } lane;
} vector;
static inline vector load(const void *p) {
    vector a;
    memcpy(&a, p, sizeof a);
    return a;
}
static inline void store(void *p, vector a) {
    memcpy(p, &a, sizeof a);
}
static inline void stream(void *p, vector a) {
    store(p, a);
}
#define FM_LANES(type, expression)                                                                                                 \
    for (size_t i = 0; i < VECTOR_BYTES / sizeof(type); i++) {                                                                     \
        expression;                                                                                                                \
    }
#define FM_DEFINE_LANES(kind, type, wrap)                                                                                          \
    static inline vector set_##kind(type a) {                                                                                      \
        vector r;                                                                                                                  \
        FM_LANES(type, r.lane.kind[i] = a)                                                                                         \
        return r;                                                                                                                  \
    }                                                                                                                              \
    static inline vector add_##kind(vector a, vector b) {                                                                          \
        vector r;                                                                                                                  \
        FM_LANES(type, type sum = (type)(a.lane.kind[i] + b.lane.kind[i]); r.lane.kind[i] = sum < a.lane.kind[i] ? (type)-1 : sum) \
        return r;                                                                                                                  \
    }                                                                                                                              \
    static inline vector min_##kind(vector a, vector b) {                                                                          \
        vector r;                                                                                                                  \
        FM_LANES(type, r.lane.kind[i] = a.lane.kind[i] < b.lane.kind[i] ? a.lane.kind[i] : b.lane.kind[i])                         \
        return r;                                                                                                                  \
    }                                                                                                                              \
    static inline vector max_##kind(vector a, vector b) {                                                                          \
        vector r;                                                                                                                  \
        FM_LANES(type, r.lane.kind[i] = a.lane.kind[i] < b.lane.kind[i] ? b.lane.kind[i] : a.lane.kind[i])                         \
        return r;                                                                                                                  \
    }                                                                                                                              \
    static inline bool any_less_##kind(vector a, vector b) {                                                                       \
        type less = 0;                                                                                                             \
        FM_LANES(type, less = (type)(less | (a.lane.kind[i] < b.lane.kind[i])))                                                    \
        return less != 0;                                                                                                          \
    }
FM_DEFINE_LANES(u8, uint8_t, )
FM_DEFINE_LANES(u16, uint16_t, )
FM_DEFINE_LANES(u32, uint32_t, )
static inline vector clear_where_u8(const uint32_t *words, uint32_t first) {
    uint32_t bits = words[first / 32] >> (first % 32);
    vector r;
    FM_LANES(uint8_t, r.lane.u8[i] = (bits >> i & 1) ? 0 : UINT8_MAX)
    return r;
}
static inline vector clear_where_u16(const uint32_t *words, uint32_t first) {
    uint32_t bits = words[first / 32] >> (first % 32);
    vector r;
    FM_LANES(uint16_t, r.lane.u16[i] = (bits >> i & 1) ? 0 : UINT16_MAX)
    return r;
}
#define FM_DEFINE_COMPARISON(name, comparison)                                                                                     \
    static inline uint32_t name(const uint8_t *values, uint8_t key) {                                                              \
        uint32_t word = 0;                                                                                                         \
        for (int i = 0; i < 32; i++) {                                                                                             \
            word |= (uint32_t)(values[i] comparison key) << i;                                                                     \
        }                                                                                                                          \
        return word;                                                                                                               \
    }
FM_DEFINE_COMPARISON(equals_32, ==)
FM_DEFINE_COMPARISON(at_least_32, >=)
static inline void stream_fence(void) {
}
static inline vector add_u15(vector a, vector b) {
    vector r;
    FM_LANES(uint16_t, r.lane.u16[i] = (uint16_t)(a.lane.u16[i] + b.lane.u16[i]))
    return r;
}
#endif

// 15-bit lanes: 16 bits whose sums do not overflow.
static inline vector set_u15(uint16_t a) {
    return set_u16(a);
}
static inline vector min_u15(vector a, vector b) {
    return min_u16(a, b);
}
static inline vector max_u15(vector a, vector b) {
    return max_u16(a, b);
}
static inline bool any_less_u15(vector a, vector b) {
    return any_less_u16(a, b);
}

#endif
