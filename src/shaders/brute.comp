// SPDX-License-Identifier: MIT
#version 460
#include "memory.glsl"
#include "column.glsl"

// The oracle: one invocation owns one voxel and tries the sites of `word_count` words of bits in the order of their indices.
// Between the dispatches the best cost (4 bytes) and its site (8 bytes, the bit's number) stay in memory: drivers end loops that
// run too long.

layout(local_size_x = 64) in;

// Sums of floats are compared axis by axis as separable passes round them: within a slice, of equal totals, the smaller sum over x
// and y wins over the lower index, and within a row the smaller cost along x.
const bool PARTIAL_SUMS = SITES && WEIGHTED && METRIC != FM_GPU_LINF;

struct candidate {
    cost_t total, plane, row;
    uvec3 site;
};

candidate candidate_at(uvec3 at, uvec3 site) {
    uvec3 apart = uvec3(abs(ivec3(at) - ivec3(site)));
    candidate found;
    found.row = steps_cost(apart.x, push.weight_x);
    found.plane = add_cost(found.row, steps_cost(apart.y, push.weight_y));
    found.total = add_cost(found.plane, steps_cost(apart.z, push.weight_z));
    found.site = site;
    return found;
}

bool is_better(candidate a, candidate b) {
    bool same_slice = PARTIAL_SUMS && a.total == b.total && a.site.z == b.site.z;
    bool same_row = same_slice && a.plane == b.plane && a.site.y == b.site.y;
    return a.total < b.total || (same_slice && a.plane < b.plane) || (same_row && a.row < b.row);
}

// From the number of a bit.
uvec3 site_of(uint64_t bit) {
    uint64_t row_bits = uint64_t(push.row_words) * 32;
    uint64_t row = bit / row_bits;
    return uvec3(uint(bit % row_bits), uint(row % push.y), uint(row / push.y));
}

void main() {
    uint tiles = (push.x + 63) / 64;
    uint64_t group = folded_group(gl_WorkGroupID, gl_NumWorkGroups);
    uint x = uint(group % tiles) * 64 + gl_LocalInvocationID.x;
    uint64_t row = group / tiles;
    if (row >= uint64_t(push.y) * push.z || x >= push.x) {
        return;
    }
    uvec3 at = uvec3(x, uint(row % push.y), uint(row / push.y));
    uint64_t element = row * push.x + x;
    candidate best = candidate(COST_NONE, COST_NONE, COST_NONE, uvec3(0));
    if (push.first_word != 0) {
        cost_t total = cost_from_bits(ref_u32(push.raw + element * 4).v);
        if (SITES && !is_none(total)) {
            best = candidate_at(at, site_of(ref_u64(push.sites_y + element * 8).v));
        }
        best.total = total;
    }
    uvec3 site = site_of(push.first_word * 32);
    for (uint i = 0; i < push.word_count; i++) {
        uint word = ref_u32(push.bits + (push.first_word + i) * 4).v;
        while (word != 0) {
            candidate found = candidate_at(at, uvec3(site.x + uint(findLSB(word)), site.yz));
            word &= word - 1;
            if (is_better(found, best)) {
                best = found;
            }
        }
        site.x += 32;
        if (site.x >= push.x) {
            site.x = 0;
            site.y++;
        }
        if (site.y == push.y) {
            site.y = 0;
            site.z++;
        }
    }
    if (push.first_word + push.word_count < uint64_t(push.y) * push.z * push.row_words) {
        ref_u32(push.raw + element * 4).v = cost_bits(best.total);
        if (SITES) {
            ref_u64(push.sites_y + element * 8).v =
                ((uint64_t(best.site.z) * push.y + best.site.y) * push.row_words) * 32 + best.site.x;
        }
        return;
    }
    finish_voxel(at, element, best.total, best.site);
}
