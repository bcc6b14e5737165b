// SPDX-License-Identifier: MIT
#ifndef FM_METER_H
#define FM_METER_H

// What is counted while the library works: memory by purpose, and passes.

#include "base/base.h"

enum { FM_MAX_PASSES = 128 };

// What memory is kept for. On a device the purpose also decides where it lies. Volumes, scratch, fields and update state are
// device memory, mapped where the host reads it at full speed.
typedef enum fm_purpose {
    FM_PURPOSE_VOLUMES = 0,
    FM_PURPOSE_SCRATCH,
    FM_PURPOSE_VOXELS,  // of a world: device memory, mapped where the host reaches all of the device's memory
    FM_PURPOSE_FIELD,   // of a world
    FM_PURPOSE_UPDATE,  // of a world: what its updates keep
    FM_PURPOSE_PICTURES,
    FM_PURPOSE_MESHES,
    FM_PURPOSE_OCTREES,
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

// Threads of one context may count at once.
void fm_meter_add(fm_meter *meter, uint64_t bytes);
void fm_meter_remove(fm_meter *meter, uint64_t bytes);

// Fills what `count` and `capacity` of the public listing calls ask for: returns how many may be copied.
uint32_t fm_listing(uint32_t *count, uint32_t available, bool wanted);

#endif
