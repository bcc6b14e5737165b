// SPDX-License-Identifier: MIT
#ifndef FM_RTSDF_RULE_H
#define FM_RTSDF_RULE_H

// The arithmetic of RTSDF, one text for C and GLSL: both shoot the same rays and accumulate alike. Source: Tan et al. 2022.

#include "voxel_rule.h"

// A texel's seed: 10 bits an axis.
#define FM_SEED_MOST 1024
#define FM_SEED_NONE 0xffffffffu

// The squared distance from a texel to a seed, in units of the smallest edge of a voxel: whole numbers, and so exact, where voxels
// are cubes. `weight`: squared edges in that unit.
FM_RULE float fm_seed_distance2(fm_uint seed, int x, int y, int z, const float weight[3]) {
    FM_PRECISE float dx = FM_F(x - FM_I(seed & 1023u));
    FM_PRECISE float dy = FM_F(y - FM_I(seed >> 10 & 1023u));
    FM_PRECISE float dz = FM_F(z - FM_I(seed >> 20));
    FM_PRECISE float sum = ((dx * dx) * weight[0] + (dy * dy) * weight[1]) + (dz * dz) * weight[2];
    return sum;
}

// Four numbers from four: a counter-based generator. Source: Jarzynski and Olano 2020, "Hash functions for GPU rendering", pcg4d.
FM_PUSH_STRUCT(fm_random4) {
    fm_uint x, y, z, w;
};

FM_RULE fm_random4 fm_random(fm_random4 key) {
    fm_random4 v = key;
    v.x = v.x * 1664525u + 1013904223u;
    v.y = v.y * 1664525u + 1013904223u;
    v.z = v.z * 1664525u + 1013904223u;
    v.w = v.w * 1664525u + 1013904223u;
    v.x += v.y * v.w;
    v.y += v.z * v.x;
    v.z += v.x * v.y;
    v.w += v.y * v.z;
    v.x ^= v.x >> 16;
    v.y ^= v.y >> 16;
    v.z ^= v.z >> 16;
    v.w ^= v.w >> 16;
    v.x += v.y * v.w;
    v.y += v.z * v.x;
    v.z += v.x * v.y;
    v.w += v.y * v.z;
    return v;
}

FM_PUSH_STRUCT(fm_ray_way) {
    fm_float x, y, z;
};

// From -1 to 1, in steps of 2^-23.
FM_RULE float fm_random_float(fm_uint bits) {
    return (FM_F(FM_I(bits >> 8)) + 0.5f) * 1.1920928955078125e-7f - 1.0f;
}

// A direction, uniform on the sphere: of a texel (below 2^16 an axis), a frame, a ray (below 64) of it and a seed. From points of a
// square until one lies in the circle; of 16 tries one in 2^35 finds none. Source: Marsaglia 1972, "Choosing a point from the
// surface of a sphere".
FM_RULE fm_ray_way fm_ray_direction(int x, int y, int z, fm_uint frame, fm_uint ray, fm_uint seed) {
    fm_ray_way way;
    way.x = 0.0f;
    way.y = 0.0f;
    way.z = 1.0f;
    for (fm_uint attempt = 0u; attempt < 8u; attempt++) {
        fm_random4 key;
        key.x = FM_U(x) | FM_U(y) << 16;
        key.y = FM_U(z) | ray << 16 | attempt << 24;
        key.z = frame;
        key.w = seed;
        const fm_random4 bits = fm_random(key);
        FM_PRECISE float a = fm_random_float(bits.x);
        FM_PRECISE float b = fm_random_float(bits.y);
        FM_PRECISE float square = a * a + b * b;
        if (!(square < 1.0f)) {
            a = fm_random_float(bits.z);
            b = fm_random_float(bits.w);
            square = a * a + b * b;
        }
        if (square < 1.0f) {
            FM_PRECISE float wide = 2.0f * FM_SQRT(1.0f - square);
            way.x = a * wide;
            way.y = b * wide;
            way.z = 1.0f - 2.0f * square;
            break;
        }
    }
    return way;
}

// The two coarse texels between which a fine one lies along an axis of n coarse ones, and the second one's weight.
FM_PUSH_STRUCT(fm_between) {
    fm_int first, second;
    fm_float weight;
};

FM_RULE fm_between fm_coarse_of(int fine, int n) {
    fm_between between;
    const int low = fine / 2 - (fine % 2 == 0 ? 1 : 0);
    between.first = low < 0 ? 0 : low;
    between.second = low + 1 < n ? low + 1 : n - 1;
    between.weight = fine % 2 == 0 ? 0.75f : 0.25f;
    return between;
}

FM_RULE float fm_coarse_mix(float a, float b, float weight) {
    FM_PRECISE float mixed = a * (1.0f - weight) + b * weight;
    return mixed;
}

// The hits of a texel's rays: the nearest one, and how many from behind more than from the front.
FM_PUSH_STRUCT(fm_ray_hits) {
    fm_float nearest;
    fm_int behind;
};

// Above this a distance stands for infinity: there was no seed.
#define FM_RTSDF_FAR 3e38f

// Equation 1 and the bias. `before` is what the texel held; `first`: there was no frame before.
FM_RULE float fm_rtsdf_accumulate(float coarse, float before, bool first, fm_ray_hits hits, float mask, float alpha, float bias) {
    if (!(coarse <= mask) || coarse > FM_RTSDF_FAR) {
        FM_PRECISE float far = coarse - bias;
        return far;
    }
    FM_PRECISE float kept = first || before > FM_RTSDF_FAR ? coarse : before + bias;
    FM_PRECISE float decayed = alpha * kept + (1.0f - alpha) * coarse;
    const float shot = hits.behind > 0 ? -hits.nearest : hits.nearest;
    FM_PRECISE float field = FM_LESSER(decayed, shot) - bias;
    return field;
}

#endif
