// SPDX-License-Identifier: MIT
// A world's field, whose entries are what its format says. Expects memory.glsl, shared.h and the constant FORMAT.

uint field_entry(fm_address field, uint64_t element) {
    switch (FORMAT) {
    case FM_GPU_SPLIT_U8:
        return ref_u8(field + element).v;
    case FM_GPU_SPLIT_U16:
        return ref_u16(field + element * 2).v;
    default:
        return ref_u32(field + element * 4).v;
    }
}

uint entry_distance(uint entry) {
    return FORMAT == FM_GPU_PACKED ? entry >> 24 : entry;
}
