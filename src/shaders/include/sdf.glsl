// SPDX-License-Identifier: MIT
// What the kernels of a mesh's field share: where texels lie, what is known of blocks, on which side of the surface a point is.
// Expects memory.glsl.

#include "bvh.glsl"
#include "winding.glsl"
#include "sign.glsl"
#include "lists.glsl"

layout(constant_id = 0) const uint SIGN = FM_SDF_UNSIGNED;
layout(constant_id = 1) const uint FAR = 0;          // fm_far
// Of blocks the edge; of near fields which of the two arrays has the flooded cells.
layout(constant_id = 2) const uint EDGE = FM_SDF_COARSE;

const uint FAR_BAND = 0;
const uint FAR_FLOODED = 1;

layout(push_constant) uniform push_block {
    fm_sdf_push push;
};

ivec3 field_size() {
    return ivec3(push.size_xy & 0xffffu, push.size_xy >> 16, push.size_z);
}

uvec3 coarse_blocks() {
    return (uvec3(field_size()) + (FM_SDF_COARSE - 1)) / FM_SDF_COARSE;
}

float band() {
    return uintBitsToFloat(ref_u32(push.scratch + FM_SDF_BAND).v);
}

// The place of a texel, or with halves of a point between texels; good to a unit in the last place.
vec3 texel_place(vec3 index) {
    vec3 p;
    [[unroll]] for (uint i = 0; i < 3; i++) {
        p[i] = fma(index[i], push.spacing[i], push.origin[i]) + fma(index[i], push.spacing_rest[i], push.origin_rest[i]);
    }
    return p;
}

// A block: the triangle nearest to its centre, a node below which all lies that is nearest to any of its texels, the distance of
// the centre, and whether its texels are to be looked into, and if not, whether they are inside.
struct block_state {
    uint triangle;
    uint node;
    float distance;
    uint flags;
};

const uint BLOCK_NEAR = 1;
const uint BLOCK_INSIDE = 2;

uint64_t coarse_count() {
    uvec3 blocks = coarse_blocks();
    return uint64_t(blocks.x) * blocks.y * blocks.z;
}

// Coarse ones have numbers 0, 1, ...; the middle ones of coarse block c are 64 c + 0 ... 63.
fm_address state_at(bool coarse, uint64_t block) {
    return push.scratch + FM_SDF_HEADER_BYTES + (coarse ? block : coarse_count() + block) * 16;
}

fm_address entries_of(bool coarse) {
    return push.scratch + FM_SDF_HEADER_BYTES + coarse_count() * (65 * 16) + (coarse ? 0 : coarse_count() * 4);
}

block_state load_state(bool coarse, uint64_t block) {
    uvec4 v = ref_u32x4(state_at(coarse, block)).v;
    return block_state(v.x, v.y, uintBitsToFloat(v.z), v.w);
}

void store_state(bool coarse, uint64_t block, block_state s) {
    ref_u32x4(state_at(coarse, block)).v = uvec4(s.triangle, s.node, floatBitsToUint(s.distance), s.flags);
}

ivec3 coarse_first(uint block) {
    uvec3 blocks = coarse_blocks();
    return ivec3(block % blocks.x, block / blocks.x % blocks.y, block / (blocks.x * blocks.y)) * FM_SDF_COARSE;
}

// The i-th of the 64 children of a block whose children have edge `edge`.
ivec3 child_first(uint i, int edge) {
    return ivec3(i & 3u, i >> 2 & 3u, i >> 4) * edge;
}

// Closer looks, the nearer the number is to 1/2.
bool winding_inside(vec3 p) {
    float w = winding_at(push.mesh, push.moments, p, 2);
    if (abs(w - 0.5) < 0.1) {
        w = winding_at(push.mesh, push.moments, p, 8);
        if (abs(w - 0.5) < 0.004) {
            w = winding_at(push.mesh, push.moments, p, 40);
        }
    }
    return w > 0.5;
}

float triangle_distance2(uint triangle, vec3 p) {
    vec3 a, b, c;
    mesh_corners(push.mesh, triangle, a, b, c);
    return origin_nearest(a - p, b - p, c - p).distance2;
}

// Bits of the 32 texels of a row among which `at` is, counted by crossings.
uint crossed_word(ivec3 at) {
    ivec3 size = field_size();
    uint64_t row = uint64_t(at.z) * size.y + at.y;
    return ref_u32(push.moments + (row * ((uint(size.x) + 31) / 32) + uint(at.x) / 32) * 4).v;
}

bool crossed_inside(ivec3 at) {
    return all(lessThan(at, field_size())) && (crossed_word(at) >> (uint(at.x) & 31u) & 1) != 0;
}

// Of a texel of the grid, whether near the surface or not: its distance with the sign and, within the band, its triangle.
void store_texel(ivec3 at, mesh_nearest n, bool inside) {
    ivec3 size = field_size();
    float value = sqrt(n.distance2);
    bool within = value <= band();
    value = FAR == FAR_BAND ? min(value, band()) : value;
    uint64_t element = (uint64_t(at.z) * size.y + at.y) * size.x + at.x;
    ref_u32(push.distance + element * 4).v = floatBitsToUint(inside ? -value : value);
    if (push.triangles != 0) {
        ref_u32(push.triangles + element * 4).v = within ? n.triangle : FM_GPU_NONE;
    }
}

// n was found at p, its point is an offset.
bool is_inside(vec3 p, mesh_nearest n) {
    if (SIGN == FM_SDF_PSEUDONORMAL) {
        return n.triangle != FM_GPU_NONE &&
               dot(n.point, pseudonormal(push.mesh, ref_joints(push.joints).v, n.triangle, n.feature)) > 0;
    }
    return SIGN == FM_SDF_WINDING && winding_inside(p);
}
