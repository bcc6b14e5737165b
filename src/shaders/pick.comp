// SPDX-License-Identifier: MIT
#version 460
#include "memory.glsl"
#include "march.glsl"

// One invocation follows the ray of one place in the picture and writes what it meets: 24 bytes.

layout(local_size_x = 1) in;

void main() {
    vec3 way = pixel_way(vec2(uintBitsToFloat(push.pixels), uintBitsToFloat(push.slice)));
    ray_t ray = make_ray(camera_place(), way);
    vec3 cell = cell_at(ray, entry_time(ray));
    uint reads = 0;
    bool solid = march_ray(ray, cell, MARCH, reads);
    float time;
    uint face = face_of(ray, cell, time);
    ivec3 voxel = unmirror(ray, cell);
    int sign = face < 3 && ray.mirrored[face] == 1 ? 1 : -1;
    ref_u32(push.picture).v = solid ? 1 : 0;
    ref_u32(push.picture + 4).v = uint(voxel.x);
    ref_u32(push.picture + 8).v = uint(voxel.y);
    ref_u32(push.picture + 12).v = uint(voxel.z);
    ref_u32(push.picture + 16).v = uint(face < 3 ? sign * int(face + 1) : 0);
    ref_u32(push.picture + 20).v = floatBitsToUint(time * sqrt(dot(way, way)));
}
