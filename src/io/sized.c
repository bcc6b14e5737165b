// SPDX-License-Identifier: MIT
#include "io/sized.h"

void *fm_sized_alloc(const void *allocator, size_t size) {
    if (size > PTRDIFF_MAX - FM_ALIGNMENT) {
        return NULL;
    }
    size_t total = size + FM_ALIGNMENT;
    size_t *memory = fm_alloc(allocator, total, "a codec");
    if (!memory) {
        return NULL;
    }
    *memory = total;
    return (char *)memory + FM_ALIGNMENT;
}

void fm_sized_free(const void *allocator, void *memory) {
    if (memory) {
        size_t *start = (size_t *)(void *)((char *)memory - FM_ALIGNMENT);
        fm_free(allocator, start, *start);
    }
}

void *fm_zlib_alloc(void *allocator, unsigned items, unsigned size) {
    return fm_sized_alloc(allocator, (size_t)items * size);
}

void fm_zlib_free(void *allocator, void *memory) {
    fm_sized_free(allocator, memory);
}
