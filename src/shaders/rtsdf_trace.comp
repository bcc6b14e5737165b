// SPDX-License-Identifier: MIT
#version 460
#include "memory.glsl"
#include "bvh.glsl"

// A frame of the fine field: the mask, the rays, the accumulation. An invocation owns a texel: it reads eight coarse texels, most
// from caches (4/8 bytes from memory), and writes one float (4). Within the mask it also reads what the texel held (4) and casts
// its rays, whose nodes and triangles come from caches for the most part.

layout(local_size_x = 8, local_size_y = 4, local_size_z = 2) in;

layout(push_constant) uniform Push {
    fm_trace_push push;
};

float coarse(int x, int y, int z) {
    const uint64_t texel = (uint64_t(z) * push.shape[1] + y) * push.shape[0] + x;
    return uintBitsToFloat(ref_u32(push.coarse + texel * 4).v);
}

float coarse_row(fm_between x, int y, int z) {
    return fm_coarse_mix(coarse(x.first, y, z), coarse(x.second, y, z), x.weight);
}

float coarse_at(ivec3 at) {
    const fm_between x = fm_coarse_of(at.x, push.shape[0]);
    const fm_between y = fm_coarse_of(at.y, push.shape[1]);
    const fm_between z = fm_coarse_of(at.z, push.shape[2]);
    const float near = fm_coarse_mix(coarse_row(x, y.first, z.first), coarse_row(x, y.second, z.first), y.weight);
    const float far = fm_coarse_mix(coarse_row(x, y.first, z.second), coarse_row(x, y.second, z.second), y.weight);
    return fm_coarse_mix(near, far, z.weight);
}

fm_ray_hits shoot(ivec3 at) {
    precise vec3 origin;
    for (int i = 0; i < 3; i++) {
        origin[i] = push.origin[i] + float(at[i]) * push.spacing[i];
    }
    fm_ray_hits hits = fm_ray_hits(MESH_INFINITY, 0);
    for (uint ray = 0; ray < push.rays; ray++) {
        const fm_ray_way way = fm_ray_direction(at.x, at.y, at.z, push.frame, ray, push.seed);
        const mesh_hit hit = bvh_first(push.mesh, origin, vec3(way.x, way.y, way.z), 0.0, MESH_INFINITY);
        if (hit.triangle != FM_GPU_NONE) {
            hits.nearest = min(hits.nearest, hit.t);
            hits.behind += hit.back != 0 ? 1 : -1;
        }
    }
    return hits;
}

void main() {
    const ivec3 shape = 2 * ivec3(push.shape[0], push.shape[1], push.shape[2]);
    const ivec3 tiles = (shape + ivec3(7, 3, 1)) / ivec3(8, 4, 2);
    const int group = int(folded_group(gl_WorkGroupID, gl_NumWorkGroups));
    const ivec3 tile = ivec3(group % tiles.x, group / tiles.x % tiles.y, group / tiles.x / tiles.y);
    const ivec3 at = tile * ivec3(8, 4, 2) + ivec3(gl_LocalInvocationID);
    if (any(greaterThanEqual(at, shape))) {
        return;
    }
    const fm_address texel = push.fine + ((uint64_t(at.z) * shape.y + at.y) * shape.x + at.x) * 4;
    const float c = coarse_at(at);
    fm_ray_hits hits = fm_ray_hits(MESH_INFINITY, 0);
    float before = 0.0;
    if (c <= push.mask) {
        before = uintBitsToFloat(ref_u32(texel).v);
        hits = shoot(at);
    }
    const float f = fm_rtsdf_accumulate(c, before, push.first != 0, hits, push.mask, push.alpha, push.bias);
    ref_u32(texel).v = floatBitsToUint(f);
}
