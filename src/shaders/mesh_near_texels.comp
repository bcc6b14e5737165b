// SPDX-License-Identifier: MIT
#version 460
#include "memory.glsl"
#include "sdf.glsl"
#include "sdf_near.glsl"
#ifdef UNBOUNDED
#include "packet.glsl"
#else
#include "gather.glsl"
#endif

// The texels of near blocks: exact distances with their sign. A group owns a block, an invocation a texel; they look for triangles
// together. Writes 4 bytes a texel, and 4 for its triangle; reads 4 bytes a block, what the walk visits and what signs take.
//
// A texel that finds nothing within its reach, which is at least a step to the next one, is on the side of the texel beside it, for
// no surface is between the two. A block where none finds anything is near no more. Where distances are flooded (FLOODED), texels
// beyond the band take the distance of the triangle that the texel nearest to them in the block found; where all are exact
// (UNBOUNDED), the walk has no bound, and is another one.

layout(local_size_x = 64) in;

#ifdef FLOODED
shared uint triangles[64];  // that the texels found
#endif
shared uint masks[4];  // of the 64 texels: those that found something, two words, and those of them that are inside

uint64_t mask_of(uint i) {
    return uint64_t(masks[i]) | uint64_t(masks[i + 1]) << 32;
}

// Carries sides one texel further, to those that `step` less or more in number are, where `from` has them.
void carry(inout uint64_t known, inout uint64_t inside, uint64_t up, uint64_t down, uint step) {
    uint64_t fresh = known << step & up & ~known;
    inside |= inside << step & fresh;
    known |= fresh;
    fresh = known >> step & down & ~known;
    inside |= inside >> step & fresh;
    known |= fresh;
}

// The side of every texel, from those that are known.
uint64_t spread(uint64_t known, uint64_t inside) {
    const uint64_t ALL = ~uint64_t(0);
    const uint64_t NOT_FIRST_X = 0xeeeeeeeeeeeeeeeeul;
    const uint64_t NOT_FIRST_Y = 0xfff0fff0fff0fff0ul;
    const uint64_t NOT_LAST_X = 0x7777777777777777ul;
    const uint64_t NOT_LAST_Y = 0x0fff0fff0fff0ffful;
    [[dont_unroll]] for (uint i = 0; i < 64 && known != ALL; i++) {
        carry(known, inside, NOT_FIRST_X, NOT_LAST_X, 1);
        carry(known, inside, NOT_FIRST_Y, NOT_LAST_Y, 4);
        carry(known, inside, ALL, ALL, 16);
    }
    return inside;
}

void set_mask(uint i) {
    atomicOr(masks[i + gl_LocalInvocationIndex / 32], 1u << (gl_LocalInvocationIndex & 31u));
}

#ifdef FLOODED
// Which of the texels in a mask is nearest to this one.
uint nearest_of(uint64_t texels) {
    uvec2 bits = uvec2(texels, texels >> 32);
    ivec3 own = child_first(gl_LocalInvocationIndex, 1);
    uint nearest = 0;
    int least = 1000;
    while ((bits.x | bits.y) != 0) {
        uint i = bits.x != 0 ? findLSB(bits.x) : 32 + findLSB(bits.y);
        bits = bits.x != 0 ? uvec2(bits.x & (bits.x - 1), bits.y) : uvec2(0, bits.y & (bits.y - 1));
        ivec3 way = child_first(i, 1) - own;
        int away2 = way.x * way.x + way.y * way.y + way.z * way.z;
        nearest = away2 < least ? i : nearest;
        least = min(least, away2);
    }
    return nearest;
}
#endif

#if defined FLOODED || defined UNBOUNDED
// The triangle nearest to the block's middle texel floods, or where that found none the one of another texel.
void choose(uvec3 grid, uvec3 block, uint64_t known, vec3 p, inout mesh_nearest n) {
    const uint MIDDLE = 42;
    uint low = uint(known);
    uint first = low != 0 ? findLSB(low) : 32 + findLSB(uint(known >> 32));
    if (gl_LocalInvocationIndex == ((known >> MIDDLE & 1) != 0 ? MIDDLE : first)) {
        near_store_cell(grid, block, near_cell(p + n.point, n.triangle));
    }
#ifdef FLOODED
    triangles[gl_LocalInvocationIndex] = n.triangle;
    barrier();
    if (n.triangle == FM_GPU_NONE) {
        n.distance2 = triangle_distance2(triangles[nearest_of(known)], p);
    }
#endif
}
#endif

// What is nearest to the texel, within the reach.
mesh_nearest look(uvec3 block, vec3 p) {
#ifdef UNBOUNDED
    return packet_nearest(push.mesh, p, near_reach() * near_reach(), packet_middle(block), FM_GPU_NONE);
#else
    // The subgroup's texels, if invocations are numbered along it; else the block's.
    uvec2 range = min(uvec2(gl_SubgroupID, gl_SubgroupID + 1) * gl_SubgroupSize - uvec2(0, 1), uvec2(63));
    ivec3 low = child_first(range.x, 1);
    ivec3 high = child_first(range.y, 1);
    ivec3 own = child_first(gl_LocalInvocationIndex, 1);
    bool along = subgroupAll(all(greaterThanEqual(own, low)) && all(lessThanEqual(own, high)));
    low = along ? low : ivec3(0);
    high = along ? high : ivec3(FM_SDF_MIDDLE - 1);
    vec3 middle = texel_place(vec3(block) * FM_SDF_MIDDLE + 0.5 * vec3(low + high));
    vec3 half_size = 0.5 * vec3(high - low) * vec3(push.spacing[0], push.spacing[1], push.spacing[2]);
    return gather_nearest(push.mesh, p, near_reach(), middle, half_size);
#endif
}

// Texels beyond the grid's end are looked at too: sides may come by way of them.
void do_block(uvec3 grid, uvec3 block) {
    ivec3 at = ivec3(block) * FM_SDF_MIDDLE + child_first(gl_LocalInvocationIndex, 1);
    vec3 p = texel_place(vec3(at));
    if (gl_LocalInvocationIndex < 4) {
        masks[gl_LocalInvocationIndex] = 0;
    }
    mesh_nearest n = look(block, p);
    if (n.triangle != FM_GPU_NONE) {
        set_mask(0);
        if (SIGN == FM_SDF_PSEUDONORMAL && is_inside(p, n)) {
            set_mask(2);
        }
    }
    barrier();
    uint64_t known = mask_of(0);
    if (known == 0) {
        if (gl_LocalInvocationIndex == 0) {
            atomicAnd(ref_u32(near_row(grid, block.y, block.z) + (block.x >> 5) * 4).v, ~(1u << (block.x & 31u)));
        }
        return;
    }
#if defined FLOODED || defined UNBOUNDED
    choose(grid, block, known, p, n);
#endif
    bool inside = SIGN == FM_SDF_CROSSINGS ? crossed_inside(at)
                                           : (spread(known, mask_of(2)) >> gl_LocalInvocationIndex & 1) != 0;
    if (all(lessThan(at, field_size()))) {
        store_texel(at, n, SIGN != FM_SDF_UNSIGNED && inside);
    }
}

void main() {
    uvec3 grid = near_grid();
    uint count = list_count(push.scratch + FM_NEAR_LIST);
    for (uint i = gl_WorkGroupID.x; i < count; i += gl_NumWorkGroups.x) {
        uint block = ref_u32(near_entries(grid) + uint64_t(i) * 4).v;
        do_block(grid, uvec3(block % grid.x, block / grid.x % grid.y, block / grid.x / grid.y));
        barrier();
    }
}
