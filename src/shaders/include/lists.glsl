// SPDX-License-Identifier: MIT
// Work lists on the device: a header (shared.h) and entries elsewhere. Expects memory.glsl.

#include "shared.h"

// The group count stays within what every device can dispatch; groups take more than one entry then.
void list_append(fm_address header, fm_address entries, uint entry) {
    uint i = atomicAdd(ref_u32(header).v, 1u);
    if (i < FM_LIST_MAX_GROUPS) {
        atomicAdd(ref_u32(header + 4).v, 1u);
    }
    ref_u32(entries + uint64_t(i) * 4).v = entry;
}

uint list_count(fm_address header) {
    return ref_u32(header).v;
}

void list_clear(fm_address header) {
    ref_u32x4(header).v = uvec4(FM_LIST_EMPTY);
}
