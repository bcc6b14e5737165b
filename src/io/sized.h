// SPDX-License-Identifier: MIT
#ifndef FM_SIZED_H
#define FM_SIZED_H

// Memory for C libraries whose free hook does not tell the size.

#include "base/base.h"

#include <stddef.h>

// Memory from the fm_allocator at `allocator`, preceded by its size; NULL when there is none.
void *fm_sized_alloc(const void *allocator, size_t size);
void fm_sized_free(const void *allocator, void *memory);

// zlib's hooks.
void *fm_zlib_alloc(void *allocator, unsigned items, unsigned size);
void fm_zlib_free(void *allocator, void *memory);

#endif
