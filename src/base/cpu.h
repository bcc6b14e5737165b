// SPDX-License-Identifier: MIT
#ifndef FM_CPU_H
#define FM_CPU_H

// What the processor can do. Kernels exist once an instruction set and are chosen at run time.

#include "base/base.h"

typedef enum fm_simd { FM_SIMD_PORTABLE = 0, FM_SIMD_AVX2, FM_SIMD_AVX512, FM_SIMD_COUNT } fm_simd;

// The best set of this processor and operating system, or the one named by the environment variable FATHOM_SIMD ("portable",
// "avx2", "avx512") when it is no better than that. Thread-safe.
fm_simd fm_simd_best(void);
const char *fm_simd_name(fm_simd simd);
uint32_t fm_simd_lanes(fm_simd simd);  // of 32 bits

// Name of the processor as the system tells it.
void fm_cpu_name(char *name, size_t size);

#endif
