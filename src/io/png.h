// SPDX-License-Identifier: MIT
#ifndef FM_PNG_H
#define FM_PNG_H

#include "base/base.h"
#include "fathom/io.h"

enum { FM_PNG_MAX_EDGE = 1 << 20 };

// A picture whose rows are made as they are needed.
typedef struct fm_picture {
    uint32_t width, height, channels;
    const uint8_t *(*row)(void *user, uint32_t y);  // valid until the next call
    void *user;
} fm_picture;

// `shared` NULL: the file appears at the end of the call.
fm_result fm_picture_write(const fm_allocator *allocator, const char *path, const fm_picture *picture, fm_file_batch *shared);

#endif
