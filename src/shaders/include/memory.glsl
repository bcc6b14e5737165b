// SPDX-License-Identifier: MIT
// Device memory by address. Offsets that can pass 4 GiB are 64 bits wide.

#extension GL_EXT_buffer_reference : require
#extension GL_EXT_buffer_reference2 : require
#extension GL_EXT_shader_explicit_arithmetic_types : require
#extension GL_EXT_shader_explicit_arithmetic_types_int64 : require
#extension GL_EXT_shader_16bit_storage : require
#extension GL_EXT_shader_8bit_storage : require
#extension GL_EXT_control_flow_attributes : require
#extension GL_GOOGLE_include_directive : require

layout(buffer_reference, std430, buffer_reference_align = 1) buffer ref_u8 {
    uint8_t v;
};
layout(buffer_reference, std430, buffer_reference_align = 2) buffer ref_u16 {
    uint16_t v;
};
layout(buffer_reference, std430, buffer_reference_align = 4) buffer ref_u32 {
    uint v;
};
layout(buffer_reference, std430, buffer_reference_align = 8) buffer ref_u32x2 {
    uvec2 v;
};
layout(buffer_reference, std430, buffer_reference_align = 8) buffer ref_u64 {
    uint64_t v;
};
layout(buffer_reference, std430, buffer_reference_align = 16) buffer ref_u32x4 {
    uvec4 v;
};

// Dispatches of more groups than an axis may have are folded into two.
uint64_t folded_group(uvec3 group, uvec3 groups) {
    return uint64_t(group.y) * groups.x + group.x;
}
