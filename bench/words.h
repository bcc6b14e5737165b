// SPDX-License-Identifier: MIT
#ifndef FM_WORDS_H
#define FM_WORDS_H

// Words that options, tables and reports have in common, in the order of their enums, with NULL at the end; and a clock.

extern const char *const fm_backend_words[];            // "auto", "cpu", "vulkan"
extern const char *const fm_metric_words[];             // "l2", "l1", "linf"
extern const char *const fm_type_words[];               // "u8" ... "f64", "bits"
extern const char *const fm_world_algorithm_words[];    // "exact", "brute-force", "fim", ...
extern const char *const fm_world_border_words[];       // "padding", "halo", "exchange"
extern const char *const fm_world_convergence_words[];  // "device", "host"
extern const char *const fm_field_format_words[];       // "packed", "split-u8", "split-u16", "squared"
extern const char *const fm_brush_words[];              // "sphere", "box", "line"
extern const char *const fm_march_words[];              // "skip", "box", "plain"
extern const char *const fm_view_words[];               // "color", "steps", "normal", "distance", "slice", "difference"
extern const char *const fm_shadow_words[];             // "none", "hard", "soft"

// Of a clock that only goes forward.
double fm_now_ms(void);

#endif
