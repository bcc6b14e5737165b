// SPDX-License-Identifier: MIT
// Compiled once an instruction set; simd.h says which one this is.

#include "world/exact_kernels.h"

#include "transform/kernels.h"
#include "transform/simd.h"

enum { TILE = FM_EXACT_TILE };

static inline uint32_t least_of(uint32_t a, uint32_t b) {
    return a < b ? a : b;
}

// The sites of a tile's row, and the steps from its first voxel to the nearest site before it and from its last one to the nearest
// behind it; UINT32_MAX where there is none that matters.
typedef struct row_sites {
    uint64_t sites;
    uint32_t left, right;
} row_sites;

static inline row_sites sites_of(const fm_exact_job *job, const uint32_t *row, uint32_t t) {
    const uint32_t word = 2 * t;
    row_sites found = {row[word], UINT32_MAX, UINT32_MAX};
    found.sites |= word + 1 < job->row_words ? (uint64_t)row[word + 1] << 32 : 0;
    const uint32_t before = least_of(job->reach_words, word);
    for (uint32_t i = 1; i <= before; i++) {
        if (row[word - i] != 0) {
            found.left = 32 * (i - 1) + 1 + (uint32_t)__builtin_clz(row[word - i]);
            break;
        }
    }
    const uint32_t behind = least_of(job->reach_words, job->row_words > word + 2 ? job->row_words - word - 2 : 0);
    for (uint32_t i = 1; i <= behind; i++) {
        if (row[word + 1 + i] != 0) {
            found.right = 32 * (i - 1) + 1 + (uint32_t)__builtin_ctz(row[word + 1 + i]);
            break;
        }
    }
    return found;
}

static inline const uint32_t *row_bits(const fm_exact_job *job, uint64_t y, uint64_t z) {
    return job->bits + (z * job->shape.y + y) * job->row_words;
}

static inline uint32_t tile_width(const fm_exact_job *job, uint32_t t) {
    return least_of(TILE, job->shape.x - t * TILE);
}

static inline uint64_t item_tile(const fm_exact_job *job, uint64_t item) {
    return job->list ? job->list[item] : item;
}

// Tasks beside this one may set the same flag.
static inline void set_flag(uint8_t *flag) {
    __atomic_store_n(flag, 1, __ATOMIC_RELAXED);
}

static inline void *worker_memory(const fm_exact_job *job, uint32_t worker) {
    return job->workers + worker * job->worker_bytes;
}

// Past the cache where alignment allows: nobody reads soon what is new everywhere.
static inline void write_past(void *to, const void *from, size_t bytes) {
    if (bytes % VECTOR_BYTES != 0 || (uintptr_t)to % VECTOR_BYTES != 0) {
        memcpy(to, from, bytes);
        return;
    }
    for (size_t i = 0; i < bytes; i += VECTOR_BYTES) {
        stream((uint8_t *)to + i, load((const uint8_t *)from + i));
    }
}

#define LANE_TEMPLATE "world/exact_l1_template.h"
#include "transform/lanes.h"

#include "world/exact_l2.h"

static void encode(const uint32_t *voxels, uint64_t words, uint32_t *bits) {
    static const uint32_t place[32] = {1u << 0,  1u << 1,  1u << 2,  1u << 3,  1u << 4,  1u << 5,  1u << 6,  1u << 7,
                                       1u << 8,  1u << 9,  1u << 10, 1u << 11, 1u << 12, 1u << 13, 1u << 14, 1u << 15,
                                       1u << 16, 1u << 17, 1u << 18, 1u << 19, 1u << 20, 1u << 21, 1u << 22, 1u << 23,
                                       1u << 24, 1u << 25, 1u << 26, 1u << 27, 1u << 28, 1u << 29, 1u << 30, 1u << 31};
    for (uint64_t i = 0; i < words; i++) {
        uint32_t word = 0;
        for (uint32_t k = 0; k < 32; k++) {
            word |= voxels[32 * i + k] ? place[k] : 0;
        }
        bits[i] = word;
    }
}

const fm_exact_kernels FM_LEVEL(fm_exact_kernels) = {
    .l1_u8 = {l1_u8_changed, l1_u8_along_y, l1_u8_along_z},
    .l1_u16 = {l1_u16_changed, l1_u16_along_y, l1_u16_along_z},
    .l2 = {l1_u16_changed, l2_along_y, l2_along_z},
    .encode = encode,
};
