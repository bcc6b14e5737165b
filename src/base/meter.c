// SPDX-License-Identifier: MIT
#include "base/meter.h"

const char *fm_purpose_name(fm_purpose purpose) {
    static const char *const names[FM_PURPOSE_COUNT] = {"volumes", "scratch", "voxels",  "field",  "update state", "pictures",
                                                        "meshes",  "octrees", "staging", "upload", "readback"};
    return names[purpose];
}

void fm_meter_add(fm_meter *meter, uint64_t bytes) {
    const uint64_t now = __atomic_add_fetch(&meter->bytes, bytes, __ATOMIC_RELAXED);
    uint64_t peak = __atomic_load_n(&meter->peak, __ATOMIC_RELAXED);
    while (peak < now && !__atomic_compare_exchange_n(&meter->peak, &peak, now, true, __ATOMIC_RELAXED, __ATOMIC_RELAXED)) {
    }
}

void fm_meter_remove(fm_meter *meter, uint64_t bytes) {
    __atomic_sub_fetch(&meter->bytes, bytes, __ATOMIC_RELAXED);
}

uint32_t fm_listing(uint32_t *count, uint32_t available, bool wanted) {
    uint32_t copied = wanted ? (uint32_t)fm_min_u64(*count, available) : 0;
    *count = wanted ? copied : available;
    return copied;
}
