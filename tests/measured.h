// SPDX-License-Identifier: MIT
#ifndef FM_MEASURED_H
#define FM_MEASURED_H

// Memory that is measured where it is taken, beside what a context counts.

#include "base/base.h"
#include "volume/context.h"

#include <stdlib.h>

typedef struct measured {
    size_t now, most;
    const fm_context *context;  // NULL: not yet
    size_t own;                 // what the context takes of itself
    size_t uncounted;           // most that the context has not counted
} measured;

static inline void *measured_alloc(void *user, size_t size, size_t alignment) {
    measured *m = user;
    void *memory = NULL;
    size_t counted = m->own;
    for (int purpose = 0; m->context && purpose < FM_HOST_PURPOSES; purpose++) {
        counted += m->context->host[purpose].bytes;
    }
    // What was taken before this has been counted by now.
    m->uncounted = m->context && m->now > counted + m->uncounted ? m->now - counted : m->uncounted;
    m->now += size;
    m->most = m->now > m->most ? m->now : m->most;
    return posix_memalign(&memory, alignment, size) == 0 ? memory : NULL;
}

static inline void measured_free(void *user, void *memory, size_t size) {
    ((measured *)user)->now -= size;
    free(memory);
}

// A context of the processor whose memory it is. `allocator` must outlive it.
static inline fm_result measured_context(measured *m, fm_allocator *allocator, fm_context **context) {
    *m = (measured){0};
    *allocator = (fm_allocator){measured_alloc, measured_free, m};
    const fm_context_desc desc = {.backend = FM_BACKEND_CPU, .threads = 1, .allocator = allocator};
    const fm_result result = fm_context_create(&desc, context);
    m->own = m->most = m->now;
    m->context = result == FM_OK ? *context : NULL;
    return result;
}

#endif
