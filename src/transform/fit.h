// SPDX-License-Identifier: MIT
#ifndef FM_FIT_H
#define FM_FIT_H

// How the kernels that keep whole columns in registers and shared memory cut them, for a device: a work group is `lanes` columns
// (of a scan: four times as many) by `segments` invocations, each of which owns `rows` rows.

#include "volume/context.h"

enum {
    FM_SEGMENT_ROWS = 16,         // ROWS of parabola.comp and envelope.glsl
    FM_MAX_COLUMN_THREADS = 512,  // more leave too few registers
};

typedef struct fm_column_fit {
    uint32_t lanes, segments, rows;
} fm_column_fit;

// scan.comp, for columns of `longest` rows, `width` of them side by side. `half`: its form in 16-bit floats. An invocation takes
// `shared_bytes` of shared memory and at least `fewest_rows` rows. False: a column is too long.
bool fm_fit_scan(const fm_device_info *device, uint32_t longest, uint32_t width, bool half, uint32_t shared_bytes,
                 uint32_t fewest_rows, fm_column_fit *fit);

// Kernels of FM_SEGMENT_ROWS rows that keep `lane_words` 32-bit words for each lane of a segment, and `segment_words` beside them.
bool fm_fit_segments(const fm_device_info *device, uint32_t longest, uint32_t lane_words, uint32_t segment_words,
                     fm_column_fit *fit);

#endif
