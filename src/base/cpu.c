// SPDX-License-Identifier: MIT
#include "base/cpu.h"

#include <stdio.h>
#include <stdlib.h>
#include <string.h>

static const char *const simd_names[FM_SIMD_COUNT] = {"portable", "avx2", "avx512"};

static fm_simd detect(void) {
#if defined(__x86_64__) && defined(__GNUC__)
    __builtin_cpu_init();
    // libgcc's and compiler-rt's tests include the operating system's support for the registers.
    if (__builtin_cpu_supports("avx512f") && __builtin_cpu_supports("avx512bw") && __builtin_cpu_supports("avx512vl") &&
        __builtin_cpu_supports("avx512dq")) {
        return FM_SIMD_AVX512;
    }
    if (__builtin_cpu_supports("avx2") && __builtin_cpu_supports("bmi2")) {
        return FM_SIMD_AVX2;
    }
#endif
    return FM_SIMD_PORTABLE;
}

fm_simd fm_simd_best(void) {
    fm_simd best = detect();
    const char *wanted = getenv("FATHOM_SIMD");
    for (fm_simd simd = FM_SIMD_PORTABLE; wanted && simd < best; simd++) {
        if (strcmp(wanted, simd_names[simd]) == 0) {
            return simd;
        }
    }
    return best;
}

const char *fm_simd_name(fm_simd simd) {
    return simd_names[simd];
}

uint32_t fm_simd_lanes(fm_simd simd) {
    return simd == FM_SIMD_AVX512 ? 16 : simd == FM_SIMD_AVX2 ? 8 : 4;
}

void fm_cpu_name(char *name, size_t size) {
    snprintf(name, size, "CPU");
    FILE *file = fopen("/proc/cpuinfo", "r");
    if (!file) {
        return;
    }
    char line[512];
    while (fgets(line, sizeof line, file)) {
        char *colon = strncmp(line, "model name", 10) == 0 ? strchr(line, ':') : NULL;
        if (colon) {
            colon[strcspn(colon, "\n")] = 0;
            snprintf(name, size, "%s", colon + 1 + strspn(colon + 1, " "));
            break;
        }
    }
    fclose(file);
}
