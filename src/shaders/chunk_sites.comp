// SPDX-License-Identifier: MIT
#version 460
#include "memory.glsl"
#include "chunk.glsl"
#include "chunk_tile.glsl"

// A step of jump flooding of nearest sites over 26 neighbours. An invocation owns a voxel; it reads 27 sites (4 bytes each; mostly
// from caches) and writes one. The first step reads the site bits, the last writes the field.

layout(constant_id = 7) const bool FIRST = false;
layout(constant_id = 8) const bool LAST = false;

const uint NO_SITE = 0xffffffffu;

uint load(domain_box box, ivec3 at) {
    if (!in_box(at, box.size)) {
        return NO_SITE;
    }
    if (FIRST) {
        return is_solid(box.begin + at) ? uint(at.x) | uint(at.y) << 10 | uint(at.z) << 20 : NO_SITE;
    }
    return ref_u32(scratch_at(box, push.which, at, 4)).v;
}

uint distance_to(uint site, ivec3 at) {
    if (site == NO_SITE) {
        return UNKNOWN;
    }
    ivec3 way = abs(at - ivec3(site & 1023u, site >> 10 & 1023u, site >> 20));
    return uint(way.x + way.y + way.z);
}

void main() {
    domain_box box;
    ivec3 at;
    if (!own_voxel(box, at)) {
        return;
    }
    // The voxel's own site comes first, then those of the neighbours with x fastest; of equally near ones the first stays.
    uint site = load(box, at);
    uint nearest = distance_to(site, at);
    int step = int(push.step);
    for (int z = -step; z <= step && nearest > 0; z += step) {
        for (int y = -step; y <= step; y += step) {
            for (int x = -step; x <= step; x += step) {
                uint other = load(box, at + ivec3(x, y, z));
                uint way = distance_to(other, at);
                if (way < nearest) {
                    nearest = way;
                    site = other;
                }
            }
        }
    }
    if (!LAST) {
        ref_u32(scratch_at(box, FIRST ? push.which : 1 - push.which, at, 4)).v = site;
    } else if (nearest > 0 && in_box(at - box.result_begin, box.result_size)) {
        store_field(box.begin + at, PADDED ? min(nearest, way_out(at, box.size)) : nearest);
    }
}
