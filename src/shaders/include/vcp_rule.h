// SPDX-License-Identifier: MIT
#ifndef FM_VCP_RULE_H
#define FM_VCP_RULE_H

// Vectors to closest points: how 32 bits keep one, and what lies between the eight of a cell. One text for C and GLSL.

#include "octree_shared.h"
#include "rule.h"

#ifdef __STDC__
#define FM_ARCTAN2(y, x) atan2f(y, x)
#else
#define FM_ARCTAN2(y, x) atan(y, x)
#endif

// The radius comes first, from bit 0 on, by its root. SPHERICAL: 13 bits of radius, 9 of the angle from -pi / 2 to pi / 2, 10 of
// the angle from 0 to 2 pi. Source: Demir and Westermann 2015, section 4.1. OCTAHEDRAL, ours: 10 bits of radius and 11 for each of
// two places on an unfolded octahedron, of which 2047 are used, so that the axes' directions and those halfway between two of them
// are exact. Lengths need fewer bits than directions, for a length that is wrong by a part of itself is no worse than a direction
// wrong by that angle. A vector without length is exact in all. SHORT, ours, for thin octrees, whose vectors are short: 16 bits, 6
// of the radius up to FM_VCP_SHORT of the unit, in equal steps, for where a cell has one sheet all distances count alike, and 5 for
// each place.
#define FM_VCP_HALF_PI 1.57079633f
#define FM_VCP_TWO_PI 6.28318531f
#define FM_VCP_SHORT 0.3f

FM_RULE fm_float fm_vcp_sign(fm_float x) {
    return x < 0 ? -1.0f : 1.0f;
}

FM_RULE fm_uint fm_vcp_radius_bits(fm_float length, fm_float unit, fm_float most) {
    return FM_U(FM_SQRT(FM_MIN(length / unit, 1.0f)) * most + 0.5f);
}

// Places run from 0 to 2 `steps`.
FM_RULE fm_v3 fm_vcp_octahedral(fm_uint a, fm_uint b, fm_int steps) {
    const fm_float u = FM_F(FM_I(a) - steps) * (1.0f / FM_F(steps));
    const fm_float v = FM_F(FM_I(b) - steps) * (1.0f / FM_F(steps));
    const fm_float z = 1 - FM_SIZE_OF(u) - FM_SIZE_OF(v);
    const fm_float fold = FM_MAX(-z, 0.0f);
    return fm_unit(fm_v3_of(u - fm_vcp_sign(u) * fold, v - fm_vcp_sign(v) * fold, z));
}

// The best of the four places around the direction's; the second one from bit `bits` on.
FM_RULE fm_uint fm_vcp_octahedral_bits(fm_v3 way, fm_int steps, fm_int bits) {
    const fm_float sum = FM_SIZE_OF(way.x) + FM_SIZE_OF(way.y) + FM_SIZE_OF(way.z), most = FM_F(steps);
    fm_float u = way.x / sum;
    fm_float v = way.y / sum;
    if (way.z < 0) {
        const fm_float folded = (1 - FM_SIZE_OF(v)) * fm_vcp_sign(u);
        v = (1 - FM_SIZE_OF(u)) * fm_vcp_sign(v);
        u = folded;
    }
    const fm_uint a = FM_U(FM_MIN(FM_MAX(u * most + most, 0.0f), 2 * most - 1));
    const fm_uint b = FM_U(FM_MIN(FM_MAX(v * most + most, 0.0f), 2 * most - 1));
    fm_float best = -2;
    fm_uint found = 0;
    for (fm_uint i = 0; i < 4; i++) {
        const fm_float near = fm_dot(fm_vcp_octahedral(a + (i & 1), b + (i >> 1), steps), way);
        if (near > best) {
            best = near;
            found = (a + (i & 1)) | (b + (i >> 1)) << bits;
        }
    }
    return found;
}

// A vector as bits; `unit` is the greatest length that can be kept, FM_OCTREE_REACH edges of the leaf's cell.
FM_RULE fm_uint fm_vcp_encode(fm_v3 v, fm_int code, fm_float unit) {
    const fm_float length = FM_SQRT(fm_dot(v, v));
    if (!(length > 0)) {
        return 0;
    }
    const fm_v3 way = fm_times(v, 1 / length);
    if (code == FM_GPU_OCTAHEDRAL) {
        return fm_vcp_radius_bits(length, unit, 1023) | fm_vcp_octahedral_bits(way, 1023, 11) << 10;
    }
    if (code == FM_GPU_SHORT) {
        return FM_U(FM_MIN(length / (unit * FM_VCP_SHORT), 1.0f) * 63 + 0.5f) | fm_vcp_octahedral_bits(way, 15, 5) << 6;
    }
    const fm_float theta = FM_ARCSIN(FM_MIN(FM_MAX(way.z, -1.0f), 1.0f)) / FM_VCP_HALF_PI;
    const fm_float turn = FM_ARCTAN2(way.y, way.x) / FM_VCP_TWO_PI;
    const fm_uint a = FM_U((theta * 0.5f + 0.5f) * 511 + 0.5f);
    const fm_uint b = FM_U((turn < 0 ? turn + 1 : turn) * 1023 + 0.5f);
    return fm_vcp_radius_bits(length, unit, 8191) | a << 13 | b << 22;
}

// The length of a kept vector.
FM_RULE fm_float fm_vcp_radius(fm_uint word, fm_int code, fm_float unit) {
    if (code == FM_GPU_SHORT) {
        // What is nearer than half a step has a direction, too.
        return word == 0 ? 0.0f : FM_MAX(FM_F(word & 63u), 0.01f) * (unit * (FM_VCP_SHORT / 63));
    }
    const fm_float root = code == FM_GPU_OCTAHEDRAL ? FM_F(word & 1023u) * (1.0f / 1023.0f) : FM_F(word & 8191u) * (1.0f / 8191.0f);
    return root * root * unit;
}

// Its direction, of length 1.
FM_RULE fm_v3 fm_vcp_direction(fm_uint word, fm_int code) {
    if (code == FM_GPU_OCTAHEDRAL) {
        return fm_vcp_octahedral(word >> 10 & 2047u, word >> 21, 1023);
    }
    if (code == FM_GPU_SHORT) {
        return fm_vcp_octahedral(word >> 6 & 31u, word >> 11 & 31u, 15);
    }
    const fm_float theta = FM_F(word >> 13 & 511u) * (2 * FM_VCP_HALF_PI / 511) - FM_VCP_HALF_PI;
    const fm_float phi = FM_F(word >> 22) * (FM_VCP_TWO_PI / 1023);
    const fm_float around = FM_COS(theta);
    return fm_v3_of(around * FM_COS(phi), around * FM_SIN(phi), FM_SIN(theta));
}

FM_RULE fm_v3 fm_vcp_decode(fm_uint word, fm_int code, fm_float unit) {
    return fm_times(fm_vcp_direction(word, code), fm_vcp_radius(word, code, unit));
}

// Between the vectors of a cell's eight corners (x + 2 y + 4 z), in edges of the cell, at a place in it from 0 to 1: the longer of
// two interpolations. One is trilinear, and cancels opposite vectors to nothing. The other takes each vector for a plane and the
// shortest way to one of them, and continues surfaces beyond their ends. A vector without length has no plane; where none has one,
// the trilinear is all. Source: Demir and Westermann 2015, section 2.2.
FM_RULE fm_v3 fm_vcp_between(const fm_v3 v[8], fm_v3 at) {
    fm_v3 line = fm_v3_of(0, 0, 0);
    fm_v3 plane = line;
    fm_float shortest = FM_INFINITY_F;
    for (fm_int i = 0; i < 8; i++) {
        const fm_v3 corner = fm_v3_of(FM_F(i & 1), FM_F(i >> 1 & 1), FM_F(i >> 2));
        const fm_v3 off = fm_less(at, corner);
        const fm_float weight = (1 - FM_SIZE_OF(off.x)) * (1 - FM_SIZE_OF(off.y)) * (1 - FM_SIZE_OF(off.z));
        line = fm_add(line, fm_times(v[i], weight));
        const fm_float length2 = fm_dot(v[i], v[i]);
        if (length2 > 0) {
            const fm_float along = 1 - fm_dot(v[i], off) / length2;
            if (along * along * length2 < shortest) {
                shortest = along * along * length2;
                plane = fm_times(v[i], along);
            }
        }
    }
    return shortest < FM_INFINITY_F && shortest > fm_dot(line, line) ? plane : line;
}

#endif
