// SPDX-License-Identifier: MIT
#include "base/base.h"

#include <stdlib.h>
#include <string.h>

static void *default_alloc(void *user, size_t size, size_t alignment) {
    (void)user;
    void *memory = NULL;
    return posix_memalign(&memory, alignment, size) == 0 ? memory : NULL;
}

static void default_free(void *user, void *memory, size_t size) {
    (void)user;
    (void)size;
    free(memory);
}

const fm_allocator fm_default_allocator = {default_alloc, default_free, NULL};

// The hook never sees a size of 0, for which NULL would be a fair answer.
static size_t hook_size(uint64_t size) {
    return size ? (size_t)size : 1;
}

void *fm_alloc(const fm_allocator *allocator, uint64_t size, const char *what) {
    void *memory = NULL;
    if (size <= PTRDIFF_MAX) {
        memory = allocator->alloc(allocator->user, hook_size(size), FM_ALIGNMENT);
    }
    if (!memory) {
        fm_fail(FM_ERROR_OUT_OF_HOST_MEMORY, "out of memory: %llu bytes for %s", (unsigned long long)size, what);
    }
    return memory;
}

void *fm_alloc_zero(const fm_allocator *allocator, uint64_t size, const char *what) {
    void *memory = fm_alloc(allocator, size, what);
    if (memory) {
        memset(memory, 0, hook_size(size));
    }
    return memory;
}

void fm_free(const fm_allocator *allocator, void *memory, uint64_t size) {
    if (memory) {
        allocator->free(allocator->user, memory, hook_size(size));
    }
}
