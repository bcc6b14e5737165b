// SPDX-License-Identifier: MIT
#ifndef FM_KERNELS_H
#define FM_KERNELS_H

// The passes that exist once an instruction set. Each runs on the thread pool: items of `begin` to `end`, buffers by `worker`.

#include "base/cpu.h"
#include "base/pool.h"
#include "transform/plan.h"

typedef struct fm_kernel_job {
    const fm_plan *plan;
    const uint32_t *words;  // sites
    bool invert;            // the inner side of a signed field: empty voxels are the sites, results go to solid voxels
    bool border;            // what lies outside the grid is a site
    uint32_t limit;         // raw distances above it have no site, or are capped
    void *middle;           // what one pass leaves to the next
    // L2, Linf: what k steps cost, saturated to the lanes, and twice in each word where these have 15 or 16 bits.
    uint32_t *steps_u15, *steps_u16, *steps_u32;
    uint32_t *widths;  // of each worker: what held its last slice, 0 for 15 bits to 2 for 32; FM_WIDTHS_STRIDE apart
    void *distance;
    uint8_t *workers;
    uint64_t worker_bytes;
    uint32_t depth_words;  // L2, Linf: columns of one item of the z pass, in words of the sites
    uint32_t depth_run;    // L1: elements of one item of the z pass
} fm_kernel_job;

typedef struct fm_kernels {
    // L1: items are slices, then runs of `depth_run` elements of a slice. `middle` has 8 or 16 bits an element.
    fm_pool_fn l1_plane_u8, l1_depth_u8, l1_plane_u16, l1_depth_u16;
    // L2 and Linf: items are runs of `depth_words` words of a slice of the sites, then slices. `middle` holds the distances along
    // z, 16 bits an element, rows padded to whole words.
    fm_pool_fn z_distances, l2_plane, linf_plane;
    // Words of u8 voxels that are not `key`, equal it, or are at least it; 32 voxels a word.
    void (*differs_u8)(const uint8_t *values, uint64_t words, uint8_t key, uint32_t *out);
    void (*equals_u8)(const uint8_t *values, uint64_t words, uint8_t key, uint32_t *out);
    void (*at_least_u8)(const uint8_t *values, uint64_t words, uint8_t key, uint32_t *out);
} fm_kernels;

extern const fm_kernels fm_kernels_portable;
#ifdef FM_X86_KERNELS
extern const fm_kernels fm_kernels_avx2;
extern const fm_kernels fm_kernels_avx512;
#endif

const fm_kernels *fm_kernels_best(void);

enum { FM_WIDTHS_STRIDE = 16 };  // a cache line
enum { FM_KERNEL_PAD = 128 };    // elements around a buffered row
enum { FM_WINDOW_BLOCK = 8 };    // steps that are skipped or taken together
static const uint32_t FM_WIDE_NONE = INT32_MAX;

#endif
