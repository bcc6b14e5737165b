// SPDX-License-Identifier: MIT
#ifndef FM_CONTEXT_H
#define FM_CONTEXT_H

// What a context holds. The backend is decided once, when it is made.

#include "base/base.h"
#include "base/meter.h"
#include "base/pool.h"

typedef struct fm_gpu fm_gpu;

struct fm_context {
    fm_allocator allocator;
    fm_log log;
    fm_backend backend;
    fm_device_info device;
    fm_pool *pool;
    fm_gpu *gpu;  // NULL on the CPU backend
    fm_meter host[FM_HOST_PURPOSES];

    void *scratch;  // grows, never shrinks but by fm_context_trim
    uint64_t scratch_bytes;

    // Passes of the newest operation of the CPU backend; the Vulkan backend keeps its own timers.
    fm_pass passes[FM_MAX_PASSES];
    uint32_t pass_count;
    uint64_t pass_start;
};

// Host scratch memory of at least `bytes`, kept by the context; contents undefined. The next call may move it.
fm_result fm_context_scratch(fm_context *context, uint64_t bytes, void **memory);

// Timing of the CPU backend's passes: begin an operation, then end each pass with its name and the bytes that it must move.
void fm_passes_begin(fm_context *context);
void fm_passes_end(fm_context *context, const char *name, uint64_t bytes);

#endif
