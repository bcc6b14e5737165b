// SPDX-License-Identifier: MIT
#ifndef FM_CONTEXT_H
#define FM_CONTEXT_H

// What a context holds. The backend is decided once, when it is made.

#include "base/base.h"
#include "base/pool.h"

typedef struct fm_gpu fm_gpu;

enum { FM_MAX_PASSES = 128 };

// What memory is kept for. On a device the purpose also decides where it lies. Volumes, scratch, fields and update state are
// device memory, mapped where the host reads it at full speed.
typedef enum fm_purpose {
    FM_PURPOSE_VOLUMES = 0,
    FM_PURPOSE_SCRATCH,
    FM_PURPOSE_VOXELS,    // of a world: device memory, mapped where the host reaches all of the device's memory
    FM_PURPOSE_FIELD,     // of a world
    FM_PURPOSE_UPDATE,    // of a world: what its updates keep
    FM_PURPOSE_STAGING,   // from here on of devices only, and always mapped
    FM_PURPOSE_UPLOAD,    // little that the host writes often: device memory where that can be mapped
    FM_PURPOSE_READBACK,  // little that kernels write for the host to read
    FM_PURPOSE_COUNT,
    FM_HOST_PURPOSES = FM_PURPOSE_STAGING  // number of those that host memory serves
} fm_purpose;

const char *fm_purpose_name(fm_purpose purpose);

// Bytes held now and at most.
typedef struct fm_meter {
    uint64_t bytes, peak;
} fm_meter;

void fm_meter_add(fm_meter *meter, uint64_t bytes);
void fm_meter_remove(fm_meter *meter, uint64_t bytes);

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

// Fills what `count` and `capacity` of the public listing calls ask for: returns how many may be copied.
uint32_t fm_listing(uint32_t *count, uint32_t available, bool wanted);

#endif
