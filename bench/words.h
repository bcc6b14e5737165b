// SPDX-License-Identifier: MIT
#ifndef FM_WORDS_H
#define FM_WORDS_H

// Words that options, tables and reports have in common, in the order of their enums, with NULL at the end; and a clock.

extern const char *const fm_backend_words[];  // "auto", "cpu", "vulkan"
extern const char *const fm_metric_words[];   // "l2", "l1", "linf"
extern const char *const fm_type_words[];     // "u8" ... "f64", "bits"

// Of a clock that only goes forward.
double fm_now_ms(void);

#endif
