// SPDX-License-Identifier: MIT
#version 460
#include "memory.glsl"
#include "chunk.glsl"

// Brute force. An invocation owns a voxel of a domain's result and tries all words of the domain's site bits, a nearest bit a
// word; a group brings them into shared memory, those without a site left out. Bits are read once a group, 1/8 byte a voxel of the
// domain. Where a dispatch does not try all words, the least distances so far (2 bytes a voxel) wait in scratch memory.

layout(constant_id = 5) const bool FIRST = false;  // nothing has been tried
layout(constant_id = 6) const bool LAST = false;

const uint TILE = 256;

struct site_word {
    uint bits;
    int x;    // of the lowest bit, within the domain
    uint yz;  // y in the low 16 bits
};

shared site_word tile[TILE];
shared uint tile_count;

// Words of a row of the domain, and the first of the world's row.
uint words_of(domain_box box, out uint first) {
    first = uint(box.begin.x) >> 5;
    return (uint(box.begin.x + box.size.x - 1) >> 5) - first + 1;
}

void load_tile(domain_box box, uint begin, uint end) {
    uint first;
    uint words = words_of(box, first);
    for (uint i = begin + gl_LocalInvocationID.x; i < end; i += THREADS) {
        uint row = i / words;
        uint word = first + i % words;
        uvec2 yz = uvec2(row % uint(box.size.y), row / uint(box.size.y));
        uint64_t world_row = uint64_t(uint(box.begin.z) + yz.y) * push.y + uint(box.begin.y) + yz.x;
        int x = int(word * 32) - box.begin.x;
        uint bits = ref_u32(push.bits + (world_row * push.row_words + word) * 4).v;
        bits &= x < 0 ? 0xffffffffu << uint(-x) : 0xffffffffu;
        bits &= x + 32 > box.size.x ? 0xffffffffu >> uint(x + 32 - box.size.x) : 0xffffffffu;
        if (bits != 0) {
            tile[atomicAdd(tile_count, 1)] = site_word(bits, x, yz.x | yz.y << 16);
        }
    }
}

uint distance_to(site_word site, ivec3 at) {
    int p = at.x - site.x;
    uint below = p < 0 ? 0 : p > 31 ? site.bits : site.bits & 0xffffffffu >> uint(31 - p);
    uint above = p < 0 ? site.bits : p > 31 ? 0 : site.bits & 0xffffffffu << uint(p);
    uint left = below != 0 ? uint(p - findMSB(below)) : UNKNOWN;
    uint right = above != 0 ? uint(findLSB(above) - p) : UNKNOWN;
    uint across = uint(abs(at.y - int(site.yz & 0xffffu)) + abs(at.z - int(site.yz >> 16)));
    return min(left, right) + across;
}

void main() {
    domain_box box;
    uint index, group;
    if (!own_domain(box, index, group)) {
        return;
    }
    uint number = group * THREADS + gl_LocalInvocationID.x;
    uvec3 size = uvec3(box.result_size);
    uint row = number / size.x;
    ivec3 within = ivec3(number % size.x, row % size.y, row / size.y);
    bool inside = within.z < box.result_size.z;
    ivec3 at = box.result_begin + within;
    fm_address kept = box.scratch + uint64_t(number) * 2;
    uint best = FIRST || !inside ? UNKNOWN : uint(ref_u16(kept).v);
    uint unused;
    uint words = words_of(box, unused) * uint(box.size.y) * uint(box.size.z);
    uint end = min(words, push.first + push.step);
    for (uint begin = push.first; begin < end; begin += TILE) {
        barrier();
        if (gl_LocalInvocationID.x == 0) {
            tile_count = 0;
        }
        barrier();
        load_tile(box, begin, min(begin + TILE, end));
        barrier();
        for (uint i = 0; i < tile_count; i++) {
            best = min(best, distance_to(tile[i], at));
        }
    }
    if (!inside) {
        return;
    }
    if (!LAST) {
        ref_u16(kept).v = uint16_t(best);
    } else if (!is_solid(box.begin + at)) {
        store_field(box.begin + at, PADDED ? min(best, way_out(at, box.size)) : best);
    }
}
