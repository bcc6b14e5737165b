// SPDX-License-Identifier: MIT
// What the kernels of the chunked methods share: domains, site bits, distances in the field or in scratch memory.
// Expects memory.glsl; declares `push` and the first constants.

#include "shared.h"

layout(local_size_x_id = 0) in;
layout(constant_id = 1) const uint FORMAT = FM_GPU_PACKED;
layout(constant_id = 2) const bool SCRATCH = false;  // distances lie in the domains' scratch memory, else in the field
layout(constant_id = 3) const bool PADDED = false;   // beyond a domain all is solid
layout(constant_id = 4) const bool LINKED = false;   // beyond a domain the field is right

#include "field.glsl"

const uint THREADS = gl_WorkGroupSize.x;

layout(push_constant) uniform push_block {
    fm_chunk_push push;
};

layout(buffer_reference, std430, buffer_reference_align = 8) buffer ref_domain {
    fm_gpu_domain v;
};

const uint UNKNOWN = 0xffffu;  // distance where no site is known

struct domain_box {
    ivec3 begin, size;                // inside the world
    ivec3 result_begin, result_size;  // inside the domain
    fm_address scratch;
};

domain_box load_domain(uint i) {
    // Member by member: a driver was seen to crash on the load of a whole structure with arrays.
    ref_domain entry = ref_domain(push.domains + uint64_t(i) * 32);
    uvec3 axes = uvec3(entry.v.domain[0], entry.v.domain[1], entry.v.domain[2]);
    uvec3 result = uvec3(entry.v.result[0], entry.v.result[1], entry.v.result[2]);
    domain_box box;
    box.begin = ivec3(axes & 0xffffu);
    box.size = ivec3(axes >> 16);
    box.result_begin = ivec3(result & 0xffffu) - box.begin;
    box.result_size = ivec3(result >> 16);
    box.scratch = entry.v.scratch;
    return box;
}

bool in_box(ivec3 at, ivec3 size) {
    return all(greaterThanEqual(at, ivec3(0))) && all(lessThan(at, size));
}

ivec3 world_size() {
    return ivec3(push.x, push.y, push.z);
}

bool is_solid(ivec3 at) {
    uint64_t row = uint64_t(at.z) * push.y + uint(at.y);
    uint word = ref_u32(push.bits + (row * push.row_words + (uint(at.x) >> 5)) * 4).v;
    return (word >> (uint(at.x) & 31u) & 1u) != 0;
}

uint64_t element_of(ivec3 at) {
    return (uint64_t(at.z) * push.y + uint(at.y)) * push.x + uint(at.x);
}

uint load_field(ivec3 at) {
    return entry_distance(field_entry(push.field, element_of(at)));
}

// Of a voxel of air.
void store_field(ivec3 at, uint distance) {
    uint64_t element = element_of(at);
    distance = min(distance, push.cap);
    if (FORMAT == FM_GPU_SPLIT_U8) {
        ref_u8(push.field + element).v = uint8_t(distance);
    } else if (FORMAT == FM_GPU_SPLIT_U16) {
        ref_u16(push.field + element * 2).v = uint16_t(distance);
    } else {
        ref_u32(push.field + element * 4).v = distance << 24;
    }
}

// Of a voxel of one of the domain's arrays, whose elements are `width` bytes wide.
fm_address scratch_at(domain_box box, uint which, ivec3 at, uint width) {
    uint64_t voxels = uint64_t(box.size.x) * uint(box.size.y) * uint(box.size.z);
    uint64_t array = (voxels * width + 15) & ~uint64_t(15);
    uint64_t element = (uint64_t(at.z) * uint(box.size.y) + uint(at.y)) * uint(box.size.x) + uint(at.x);
    return box.scratch + which * array + element * width;
}

uint load_scratch(domain_box box, uint which, ivec3 at) {
    return ref_u16(scratch_at(box, which, at, 2)).v;
}

void store_scratch(domain_box box, uint which, ivec3 at, uint distance) {
    ref_u16(scratch_at(box, which, at, 2)).v = uint16_t(distance);
}

// Which domain this group works on, and its number within it; false for groups past the last.
bool own_domain(out domain_box box, out uint index, out uint group) {
    uint number = uint(folded_group(gl_WorkGroupID, gl_NumWorkGroups));
    index = number / push.groups;
    group = number % push.groups;
    if (index >= push.count) {
        return false;
    }
    box = load_domain(index);
    return true;
}

// A group's place in its domain: the number of the tile along each axis.
ivec3 tile_of(uint group) {
    uint row = group / push.groups_x;
    return ivec3(group % push.groups_x, row % push.groups_y, row / push.groups_y);
}

// Steps out of the domain.
uint way_out(ivec3 at, ivec3 size) {
    ivec3 ways = min(at + 1, size - at);
    return uint(min(ways.x, min(ways.y, ways.z)));
}
