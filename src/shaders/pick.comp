// SPDX-License-Identifier: MIT
#version 460
#define MARCH_PUSH fm_pick_push
#include "memory.glsl"
#include "march.glsl"

// One invocation follows one ray and writes what it meets: 24 bytes.

layout(local_size_x = 1) in;

layout(buffer_reference, std430, buffer_reference_align = 4) writeonly buffer ref_pick {
    fm_gpu_pick v;
};

void main() {
    vec3 way = vec3(push.way[0], push.way[1], push.way[2]);
    ray_t ray = make_ray(camera_place(), way);
    vec3 cell = cell_at(ray, entry_time(ray));
    uint reads = 0;
    bool solid = march_ray(ray, cell, MARCH, reads);
    float time;
    uint face = face_of(ray, cell, time);
    ivec3 voxel = unmirror(ray, cell);
    int sign = face < 3 && ray.mirrored[face] == 1 ? 1 : -1;
    ref_pick found = ref_pick(push.found);
    found.v.hit = solid ? 1 : 0;
    found.v.voxel[0] = voxel.x;
    found.v.voxel[1] = voxel.y;
    found.v.voxel[2] = voxel.z;
    found.v.face = face < 3 ? sign * int(face + 1) : 0;
    found.v.distance = time * sqrt(dot(way, way));
}
