// SPDX-License-Identifier: MIT
// How rays cross a world: as src/render/host_march.h, step for step. Expects memory.glsl.
//
// A ray is mirrored so that it rises along every axis: an axis along which it falls counts its cells from the other end. Cell k is
// entered along an axis at the time (k - origin) * inverse and left at (k + 1 - origin) * inverse, always computed from the whole
// number. All crossings of a ray, ordered by time and then by axis, are its path: a cell is on it where it is entered before it is
// left, whoever asks. So a march may go ahead to any cell of the path, as long as every cell on the way is air, and all marches
// find the same voxel and face.

#include "render_shared.h"

layout(constant_id = 0) const uint FORMAT = FM_GPU_PACKED;
layout(constant_id = 1) const uint MARCH = FM_GPU_MARCH_SKIP;
layout(constant_id = 2) const bool LARGE = false;  // elements need 64 bits

// A kernel that marches for other ends than a picture names its own constants, with the members that are read here.
#ifndef MARCH_PUSH
#define MARCH_PUSH fm_march_push
#endif
layout(push_constant) uniform push_block {
    MARCH_PUSH push;
};

const float WHOLE = 8388608.0;  // added to a float, leaves whole numbers, and its low bits are the number
const uint WHOLE_BITS = 0x4b000000u;

struct ray_t {
    vec3 origin;   // mirrored; voxels are the unit cubes from their position on
    vec3 way;      // >= 0
    vec3 inverse;  // 1 / way; 10^30 for an axis along which the ray does not go
    vec3 size;     // of the world
    uvec3 stride;  // elements, modulo 2^32
    uint base;
    uvec3 mirrored;  // 1 or 0
    float per_step;  // time that goes by for each unit of the Manhattan distance
    float bias;      // - 1 - the sum of the origin
};

uvec3 world_axes() {
    return uvec3(push.size_xy & 0xffffu, push.size_xy >> 16, push.size_z);
}

ray_t make_ray(vec3 origin, vec3 direction) {
    uvec3 axes = world_axes();
    uvec3 stride = uvec3(1, axes.x, axes.x * axes.y);
    ray_t ray;
    bvec3 falls = lessThan(direction, vec3(0));
    ray.size = vec3(axes);
    ray.mirrored = mix(uvec3(0), uvec3(1), falls);
    precise vec3 mirror = ray.size - origin;
    ray.origin = mix(origin, mirror, falls);
    ray.way = abs(direction);
    precise vec3 inverse = 1.0 / max(ray.way, vec3(1e-30));
    ray.inverse = inverse;
    ray.stride = mix(stride, 0u - stride, falls);
    uvec3 last = mix(uvec3(0), stride * (axes - 1u), falls);
    // Cells come with WHOLE_BITS (element_of).
    ray.base = last.x + last.y + last.z - WHOLE_BITS * (ray.stride.x + ray.stride.y + ray.stride.z);
    ray.per_step = 1.0 / (ray.way.x + ray.way.y + ray.way.z);
    ray.bias = -1.0 - (ray.origin.x + ray.origin.y + ray.origin.z);
    return ray;
}

ivec3 unmirror(ray_t ray, vec3 cell) {
    ivec3 k = ivec3(cell);
    return mix(k, ivec3(world_axes()) - 1 - k, equal(ray.mirrored, uvec3(1)));
}

vec3 unmirror_point(ray_t ray, vec3 at) {
    return mix(at, ray.size - at, equal(ray.mirrored, uvec3(1)));
}

float most(vec3 v) {
    return max(max(v.x, v.y), v.z);
}

float least(vec3 v) {
    return min(min(v.x, v.y), v.z);
}

vec3 enter_times(ray_t ray, vec3 cell) {
    precise vec3 times = (cell - ray.origin) * ray.inverse;
    return times;
}

vec3 leave_times(ray_t ray, vec3 cell) {
    precise vec3 times = ((cell + 1.0) - ray.origin) * ray.inverse;
    return times;
}

uint64_t element_at(ivec3 at) {
    if (!LARGE) {
        return (uint(at.z) * (push.size_xy >> 16) + uint(at.y)) * (push.size_xy & 0xffffu) + uint(at.x);
    }
    return (uint64_t(at.z) * (push.size_xy >> 16) + uint(at.y)) * (push.size_xy & 0xffffu) + uint(at.x);
}

uint load_entry(uint64_t element) {
    switch (FORMAT) {
    case FM_GPU_SPLIT_U8:
        return ref_u8(push.field + element).v;
    case FM_GPU_SPLIT_U16:
        return ref_u16(push.field + element * 2).v;
    default:
        return ref_u32(push.field + element * 4).v;
    }
}

// Manhattan steps that the field vouches for: all voxels nearer than that are air. A Manhattan distance is never below the
// Euclidean one; the root may come out too great by its rounding.
uint steps_of(uint entry) {
    if (FORMAT == FM_GPU_PACKED) {
        return entry >> 24;
    }
    return FORMAT == FM_GPU_SQUARED_U32 ? uint(ceil(sqrt(float(entry)) * 0.999999)) : entry;
}

// The distance as a length, of a voxel inside the world.
float length_at(ivec3 at) {
    uint entry = load_entry(element_at(at));
    return FORMAT == FM_GPU_SQUARED_U32 ? sqrt(float(entry)) : float(steps_of(entry));
}

uint64_t element_of(ray_t ray, vec3 cell) {
    if (LARGE) {
        return element_at(unmirror(ray, cell));
    }
    uvec3 bits = floatBitsToUint(cell + WHOLE);
    return bits.x * ray.stride.x + bits.y * ray.stride.y + bits.z * ray.stride.z + ray.base;
}

bool is_solid(ivec3 at) {
    uint64_t row = uint64_t(at.z) * (push.size_xy >> 16) + uint(at.y);
    uint row_words = ((push.size_xy & 0xffffu) + 31u) / 32u;
    return (ref_u32(push.bits + (row * row_words + (uint(at.x) >> 5)) * 4).v >> (uint(at.x) & 31u) & 1u) != 0;
}

// Crosses the next boundary; ties go to x, then y.
vec3 cross_next(vec3 cell, vec3 leave) {
    bool x = leave.x <= leave.y && leave.x <= leave.z;
    bool y = !x && leave.y <= leave.z;
    return vec3(x ? cell.x + 1.0 : cell.x, y ? cell.y + 1.0 : cell.y, x || y ? cell.z : cell.z + 1.0);
}

// The cell after the furthest one of the path that `steps` Manhattan steps, or the box that they hold, allow for sure. Sets the
// time at which it is entered.
vec3 go_ahead(ray_t ray, vec3 cell, float steps, uint how, out float time) {
    float sum = cell.x + cell.y + cell.z;
    vec3 ahead;
    bool within = true;
    if (how == FM_GPU_MARCH_BOX) {
        vec3 last = cell + floor((steps - 1.0) * (1.0 / 3.0) + 0.1);
        vec3 at = ray.origin + ray.way * least(leave_times(ray, last));
        precise vec3 whole = (at + (WHOLE - 0.5)) - WHOLE;
        ahead = clamp(whole, cell, last);
    } else {
        // On the plane where the coordinates' sum is that of the cell and steps - 1: no cell of the path up to there is further.
        vec3 at = ray.origin + ray.way * ((sum + steps + ray.bias) * ray.per_step);
        precise vec3 whole = (at + (WHOLE - 0.5)) - WHOLE;
        ahead = max(whole, cell);
        within = ahead.x + ahead.y + ahead.z < sum + steps;
    }
    vec3 leave = leave_times(ray, ahead);
    time = least(leave);
    if (!(within && most(enter_times(ray, ahead)) < time)) {
        // Rounded to a cell beside the path.
        ahead = cell;
        leave = leave_times(ray, cell);
        time = least(leave);
    }
    return cross_next(ahead, leave);
}

bool inside(ray_t ray, vec3 cell) {
    return cell.x < ray.size.x && cell.y < ray.size.y && cell.z < ray.size.z;
}

// The time at which the ray enters the world, at least 0.
float entry_time(ray_t ray) {
    return max(most(enter_times(ray, vec3(0))), 0.0);
}

vec3 cell_at(ray_t ray, float time) {
    precise vec3 at = ray.origin + ray.way * time;
    return max(floor(at), vec3(0));
}

// Goes on from `cell`: true at the first solid voxel, where `cell` stays; false where the ray leaves the world. Adds the number of
// reads to `reads`.
bool march_ray(ray_t ray, inout vec3 cell, uint how, inout uint reads) {
    while (inside(ray, cell)) {
        reads++;
        if (how == FM_GPU_MARCH_PLAIN) {
            if (is_solid(unmirror(ray, cell))) {
                return true;
            }
            cell = cross_next(cell, leave_times(ray, cell));
        } else {
            uint steps = steps_of(load_entry(element_of(ray, cell)));
            if (steps == 0) {
                return true;
            }
            float time;
            cell = go_ahead(ray, cell, float(steps), how, time);
        }
    }
    return false;
}

// The face by which a cell is entered: 0, 1, 2 for x, y, z, or 3 where the ray begins in it; and when.
uint face_of(ray_t ray, vec3 cell, out float time) {
    vec3 enter = enter_times(ray, cell);
    time = max(most(enter), 0.0);
    if (time <= 0) {
        return 3;
    }
    return enter.z >= enter.x && enter.z >= enter.y ? 2 : enter.y >= enter.x ? 1 : 0;
}

// Distance of any cell, inside the world or not: outside of it the way to it is added.
float length_around(ivec3 at) {
    ivec3 nearest = clamp(at, ivec3(0), ivec3(world_axes()) - 1);
    ivec3 gap = abs(at - nearest);
    return length_at(nearest) + float(gap.x + gap.y + gap.z);
}

vec3 camera_place() {
    return vec3(push.origin[0], push.origin[1], push.origin[2]);
}
