// SPDX-License-Identifier: MIT
#ifndef FM_LIGHT_RULE_H
#define FM_LIGHT_RULE_H

// Light, colours and what views show instead, for pictures of surfaces: one text for C and GLSL.

#include "rule.h"

#define FM_CLAY 0.72f, 0.66f, 0.60f
#define FM_AMBIENT_ABOVE 0.22f, 0.26f, 0.32f
#define FM_AMBIENT_BELOW 0.10f, 0.09f, 0.08f
#define FM_SKY_ABOVE 0.28f, 0.42f, 0.66f
#define FM_SKY_LEVEL 0.80f, 0.84f, 0.88f

#ifdef __STDC__
#define FM_POWER(x, y) powf(x, y)
#else
#define FM_POWER(x, y) pow(x, y)
#endif

FM_RULE fm_v3 fm_blend(fm_v3 a, fm_v3 b, fm_float part) {
    return fm_add(fm_times(a, 1 - part), fm_times(b, part));
}

FM_RULE fm_v3 fm_open_sky(fm_v3 way) {
    fm_float up = FM_MAX(fm_unit(way).z, 0.0f);
    return fm_blend(fm_v3_of(FM_SKY_LEVEL), fm_v3_of(FM_SKY_ABOVE), FM_SQRT(up));
}

FM_RULE fm_v3 fm_tint(fm_v3 light, fm_v3 color) {
    return fm_v3_of(light.x * color.x, light.y * color.y, light.z * color.z);
}

FM_RULE fm_v3 fm_ambient_light(fm_v3 normal) {
    return fm_blend(fm_v3_of(FM_AMBIENT_BELOW), fm_v3_of(FM_AMBIENT_ABOVE), 0.5f + 0.5f * normal.z);
}

FM_RULE fm_v3 fm_heat(fm_float value) {
    fm_float v = FM_MIN(FM_MAX(value, 0.0f), 1.0f);
    fm_v3 cold = fm_v3_of(0.02f, 0.03f, 0.15f), warm = fm_v3_of(0.80f, 0.25f, 0.10f), hot = fm_v3_of(1.0f, 0.95f, 0.55f);
    return v < 0.5f ? fm_blend(cold, warm, 2 * v) : fm_blend(warm, hot, 2 * v - 1);
}

// A normal as a colour.
FM_RULE fm_v3 fm_normal_light(fm_v3 normal) {
    fm_v3 half_way = fm_add(fm_times(normal, 0.45f), fm_v3_of(0.5f, 0.5f, 0.5f));
    return fm_v3_of(half_way.x * half_way.x, half_way.y * half_way.y, half_way.z * half_way.z);
}

FM_RULE fm_float fm_shown(fm_float light) {
    fm_float v = FM_MIN(FM_MAX(light, 0.0f), 1.0f);
    return v <= 0.0031308f ? 12.92f * v : 1.055f * FM_POWER(v, 1 / 2.4f) - 0.055f;
}

// The light of a byte of colour.
FM_RULE fm_float fm_light_of(fm_uint byte) {
    fm_float v = FM_F(byte) * (1.0f / 255);
    return v <= 0.04045f ? v / 12.92f : FM_POWER((v + 0.055f) / 1.055f, 2.4f);
}

FM_RULE fm_uint fm_pixel_bytes(fm_v3 light) {
    return FM_U(fm_shown(light.x) * 255 + 0.5f) | FM_U(fm_shown(light.y) * 255 + 0.5f) << 8 |
           FM_U(fm_shown(light.z) * 255 + 0.5f) << 16 | 0xff000000u;
}

#endif
