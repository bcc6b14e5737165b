// SPDX-License-Identifier: MIT
#version 460
#include "memory.glsl"
#include "shared.h"

// One invocation owns one sample: the trilinear interpolation of the 8 distances around a position, and its gradient. A sample
// moves 12 bytes in and 16 out, and touches 8 voxels of the field.

layout(local_size_x = 64) in;

layout(constant_id = 0) const uint FORMAT = 0;  // fm_field_format

layout(push_constant) uniform push_block {
    fm_sample_push push;
};

#include "field.glsl"

float distance_at(uvec3 at) {
    uint64_t element = at.x + push.x * (at.y + push.y * uint64_t(at.z));
    float value = float(entry_distance(field_entry(push.field, element)));
    return FORMAT == FM_GPU_SQUARED_U32 ? sqrt(value) : value;
}

// The voxel before a position along an axis of `size` voxels, and how far the position is from it towards the next one.
void place(float position, uint size, out uint first, out float part) {
    float clamped = position > 0 ? min(position, float(size - 1)) : 0;
    first = min(uint(clamped), size > 1 ? size - 2 : 0);
    part = clamped - float(first);
}

float lerp(float a, float b, float part) {
    return a + (b - a) * part;
}

void main() {
    uint64_t index = folded_group(gl_WorkGroupID, gl_NumWorkGroups) * 64 + gl_LocalInvocationIndex;
    if (index >= push.count) {
        return;
    }
    uvec3 size = uvec3(push.x, push.y, push.z);
    uvec3 first;
    vec3 part;
    [[unroll]] for (uint axis = 0; axis < 3; axis++) {
        place(uintBitsToFloat(ref_u32(push.positions + index * 12 + axis * 4).v), size[axis], first[axis], part[axis]);
    }
    uvec3 next = min(first + 1u, size - 1u);
    // Along x: the distance and its slope in each of the four rows around.
    vec2 along_x[4];
    [[unroll]] for (uint row = 0; row < 4; row++) {
        uint y = (row & 1u) == 0 ? first.y : next.y;
        uint z = row < 2 ? first.z : next.z;
        float a = distance_at(uvec3(first.x, y, z));
        float b = distance_at(uvec3(next.x, y, z));
        along_x[row] = vec2(lerp(a, b, part.x), b - a);
    }
    vec2 near_z = vec2(lerp(along_x[0].x, along_x[1].x, part.y), lerp(along_x[0].y, along_x[1].y, part.y));
    vec2 far_z = vec2(lerp(along_x[2].x, along_x[3].x, part.y), lerp(along_x[2].y, along_x[3].y, part.y));
    float slope_y = lerp(along_x[1].x - along_x[0].x, along_x[3].x - along_x[2].x, part.z);
    vec4 result = vec4(lerp(near_z.x, far_z.x, part.z), lerp(near_z.y, far_z.y, part.z), slope_y, far_z.x - near_z.x);
    ref_u32x4(push.samples + index * 16).v = floatBitsToUint(result);
}
