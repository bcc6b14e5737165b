// SPDX-License-Identifier: MIT
#ifndef FM_VOLUME_H
#define FM_VOLUME_H

#include "volume/context.h"

typedef struct fm_buffer fm_buffer;

struct fm_volume {
    fm_context *context;  // NULL for a host volume made without one
    fm_allocator allocator;
    fm_volume_desc desc;  // storage resolved, spacing filled in
    uint64_t bytes;
    void *data;         // host storage
    fm_buffer *buffer;  // device storage
    uint8_t *palette;   // 1,024 bytes, or NULL
};

// Checks a spacing by the rules of fm_volume_desc and fills in 1, 1, 1 for all 0.
fm_result fm_spacing_resolve(const double spacing[3], double resolved[3]);

static inline uint32_t fm_bits_row_words(fm_shape shape) {
    return (shape.x + 31) / 32;
}

#endif
