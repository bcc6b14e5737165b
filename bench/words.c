// SPDX-License-Identifier: MIT
#include "words.h"

#include "fathom/fathom.h"

#include <stddef.h>
#include <time.h>

const char *const fm_backend_words[] = {[FM_BACKEND_AUTO] = "auto", [FM_BACKEND_CPU] = "cpu", [FM_BACKEND_VULKAN] = "vulkan", NULL};

const char *const fm_metric_words[] = {[FM_METRIC_L2] = "l2", [FM_METRIC_L1] = "l1", [FM_METRIC_LINF] = "linf", NULL};

const char *const fm_type_words[] = {
    [FM_TYPE_U8] = "u8",     [FM_TYPE_U16] = "u16", [FM_TYPE_U32] = "u32", [FM_TYPE_F32] = "f32",
    [FM_TYPE_BITS] = "bits", [FM_TYPE_I8] = "i8",   [FM_TYPE_I16] = "i16", [FM_TYPE_I32] = "i32",
    [FM_TYPE_U64] = "u64",   [FM_TYPE_I64] = "i64", [FM_TYPE_F64] = "f64", NULL,
};

double fm_now_ms(void) {
    struct timespec time;
    clock_gettime(CLOCK_MONOTONIC, &time);
    return (double)time.tv_sec * 1e3 + (double)time.tv_nsec * 1e-6;
}
