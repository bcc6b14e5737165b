// SPDX-License-Identifier: MIT
#include "words.h"

#include "fathom/render.h"

#include <stddef.h>
#include <time.h>

const char *const fm_backend_words[] = {[FM_BACKEND_AUTO] = "auto", [FM_BACKEND_CPU] = "cpu", [FM_BACKEND_VULKAN] = "vulkan", NULL};

const char *const fm_metric_words[] = {[FM_METRIC_L2] = "l2", [FM_METRIC_L1] = "l1", [FM_METRIC_LINF] = "linf", NULL};

const char *const fm_type_words[] = {
    [FM_TYPE_U8] = "u8",     [FM_TYPE_U16] = "u16", [FM_TYPE_U32] = "u32", [FM_TYPE_F32] = "f32",
    [FM_TYPE_BITS] = "bits", [FM_TYPE_I8] = "i8",   [FM_TYPE_I16] = "i16", [FM_TYPE_I32] = "i32",
    [FM_TYPE_U64] = "u64",   [FM_TYPE_I64] = "i64", [FM_TYPE_F64] = "f64", NULL,
};

const char *const fm_world_algorithm_words[] = {
    [FM_WORLD_EXACT] = "exact",
    [FM_WORLD_BRUTE_FORCE] = "brute-force",
    [FM_WORLD_FIM] = "fim",
    [FM_WORLD_JFA_PUBLISHED] = "jfa-published",
    [FM_WORLD_JFA] = "jfa",
    [FM_WORLD_JFA_1_PLUS] = "jfa-1+",
    [FM_WORLD_JFA_PLUS_2] = "jfa+2",
    [FM_WORLD_JFA_FIM] = "jfa-fim",
    [FM_WORLD_SELECTIVE] = "selective",
    [FM_WORLD_PUBLISHED_FINAL] = "published-final",
    NULL,
};

const char *const fm_world_border_words[] = {
    [FM_BORDER_PADDING] = "padding", [FM_BORDER_HALO] = "halo", [FM_BORDER_EXCHANGE] = "exchange", NULL};

const char *const fm_world_convergence_words[] = {[FM_CONVERGE_DEVICE] = "device", [FM_CONVERGE_HOST] = "host", NULL};

const char *const fm_field_format_words[] = {
    [FM_FIELD_PACKED] = "packed",
    [FM_FIELD_SPLIT_U8] = "split-u8",
    [FM_FIELD_SPLIT_U16] = "split-u16",
    [FM_FIELD_SQUARED_U32] = "squared",
    NULL,
};

const char *const fm_brush_words[] = {[FM_BRUSH_SPHERE] = "sphere", [FM_BRUSH_BOX] = "box", [FM_BRUSH_LINE] = "line", NULL};

const char *const fm_march_words[] = {[FM_MARCH_SKIP] = "skip", [FM_MARCH_BOX] = "box", [FM_MARCH_PLAIN] = "plain", NULL};

const char *const fm_view_words[] = {
    [FM_VIEW_COLOR] = "color",
    [FM_VIEW_STEPS] = "steps",
    [FM_VIEW_NORMAL] = "normal",
    [FM_VIEW_DISTANCE] = "distance",
    [FM_VIEW_SLICE] = "slice",
    [FM_VIEW_DIFFERENCE] = "difference",
    NULL,
};

const char *const fm_shadow_words[] = {[FM_SHADOW_NONE] = "none", [FM_SHADOW_HARD] = "hard", [FM_SHADOW_SOFT] = "soft", NULL};

double fm_now_ms(void) {
    struct timespec time;
    clock_gettime(CLOCK_MONOTONIC, &time);
    return (double)time.tv_sec * 1e3 + (double)time.tv_nsec * 1e-6;
}
