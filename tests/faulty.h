// SPDX-License-Identifier: MIT
#ifndef FM_FAULTY_H
#define FM_FAULTY_H

// Memory that runs out at the n-th request.

#include "io_common.h"

#include <stdatomic.h>

typedef struct faulty {
    atomic_long live;   // allocations not yet freed
    atomic_long bytes;  // of them
    long left;          // requests that succeed; below 0: all do
} faulty;

static inline void *faulty_alloc(void *user, size_t size, size_t alignment) {
    faulty *f = user;
    void *memory = NULL;
    if (f->left == 0 || posix_memalign(&memory, alignment, size) != 0) {
        return NULL;
    }
    f->left -= f->left > 0;
    f->live++;
    f->bytes += (long)size;
    return memory;
}

static inline void faulty_free(void *user, void *memory, size_t size) {
    faulty *f = user;
    f->live--;
    f->bytes -= (long)size;
    free(memory);
}

typedef fm_result (*attempt_fn)(fm_context *context, void *user);

// Runs `attempt` with the first, the second, ... request failing until it succeeds.
static inline void exhaust(const char *what, attempt_fn attempt, void *user, int files) {
    faulty f = {.left = -1};
    const fm_allocator allocator = {faulty_alloc, faulty_free, &f};
    const fm_context_desc desc = {.backend = FM_BACKEND_CPU, .threads = 1, .allocator = &allocator};
    fm_context *context = NULL;
    if (!CHECK_OK(fm_context_create(&desc, &context))) {
        return;
    }
    long live = f.live, bytes = f.bytes;
    fm_result result = FM_ERROR_OUT_OF_HOST_MEMORY;
    int n = 0;
    for (; result != FM_OK && n < 200; n++) {
        f.left = n;
        result = attempt(context, user);
        f.left = -1;
        bool good = CHECK(f.live == live && f.bytes == bytes);
        if (result != FM_OK) {
            good = CHECK(result == FM_ERROR_OUT_OF_HOST_MEMORY) && good;
            good = CHECK(strstr(fm_last_error(), "out of memory") != NULL) && good;
            good = CHECK(files < 0 || io_file_count() == files) && good;
        }
        if (!good) {
            fprintf(stderr, "    %s, request %d failing: %s\n", what, n, fm_last_error());
        }
    }
    CHECK(result == FM_OK);
    CHECK(n > 2);
    fm_context_destroy(context);
}

#endif
