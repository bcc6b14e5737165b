// SPDX-License-Identifier: MIT
#ifndef FM_DEFER_PIXEL_H
#define FM_DEFER_PIXEL_H

// The steps of a deferred picture for one pixel or one texel of a shadow map: one text for C and GLSL over defer_rule.h. Rays
// through the mesh (fm_mesh_first, fm_mesh_blocked) and the memory of pictures come from who includes this.

#include "defer_rule.h"

// Along pixel (x, y), which need not be whole.
FM_RULE fm_v3 fm_place_ray(FM_SCENE, fm_float x, fm_float y) {
    return fm_add(fm_add(FM_V3_FROM(corner), fm_times(FM_V3_FROM(right), x)), fm_times(FM_V3_FROM(down), y));
}

FM_RULE fm_v3 fm_pixel_ray(FM_SCENE, fm_int x, fm_int y) {
    return fm_place_ray(FM_WITH, FM_F(x), FM_F(y));
}

FM_RULE fm_defer_surface fm_surface_pixel(FM_SCENE, fm_int x, fm_int y, fm_int kind) {
    fm_v3 origin = FM_V3_FROM(origin), way = fm_unit(fm_pixel_ray(FM_WITH, x, y)), normal = fm_times(way, -1.0f);
    fm_defer_surface s;
    s.depth = FM_INFINITY_F;
    s.steps = 0u;
    if (kind == FM_GPU_SURFACE_MESH) {
        fm_mesh_met met = fm_mesh_first(FM_WITH, origin, way, 0.0f, 1e30f);
        s.depth = met.time;
        normal = fm_v3_of(met.normal[0], met.normal[1], met.normal[2]);
        // Seen from behind it is the other side that shows.
        normal = fm_dot(normal, way) > 0 ? fm_times(normal, -1.0f) : normal;
    } else {
        fm_found found = fm_field_surface(FM_WITH, origin, way);
        s.depth = found.time;
        s.steps = found.reads;
        if (found.time < FM_INFINITY_F) {
            normal = fm_field_normal(FM_WITH, fm_add(origin, fm_times(way, found.time)));
        }
    }
    fm_v3 at = s.depth < FM_INFINITY_F ? fm_add(origin, fm_times(way, s.depth)) : origin;
    s.at[0] = at.x;
    s.at[1] = at.y;
    s.at[2] = at.z;
    s.normal[0] = normal.x;
    s.normal[1] = normal.y;
    s.normal[2] = normal.z;
    return s;
}

FM_RULE fm_float fm_ray_share(FM_SCENE, fm_v3 origin, fm_v3 way, fm_float far) {
    // A light's own place is no obstacle.
    return fm_mesh_blocked(FM_WITH, origin, way, 0.0f, FM_MIN(far, 1e30f) * 0.9999f) ? 0.0f : 1.0f;
}

FM_RULE fm_share fm_shadow_share(FM_SCENE, fm_v3 at, fm_v3 normal, fm_lit_from light, fm_int shadows, fm_uint seed) {
    fm_v3 way = fm_v3_of(light.way[0], light.way[1], light.way[2]), lifted = fm_add(at, fm_times(normal, FM_GET(lift)));
    fm_float turn = fm_chance(seed, FM_GET(frame));
    fm_share result;
    result.share = 1;
    result.reads = 0u;
    if (shadows == FM_GPU_SHADOWS_RAY) {
        result.share = fm_ray_share(FM_WITH, lifted, way, light.far);
    } else if (shadows == FM_GPU_SHADOWS_DISTRIBUTED) {
        fm_float seen = 0;
        for (fm_uint i = 0u; i < FM_GET(samples); i++) {
            seen += fm_ray_share(FM_WITH, lifted, fm_way_to_place(light, i, FM_GET(samples), turn), light.far);
        }
        result.share = seen / FM_F(FM_GET(samples));
    } else if (shadows == FM_GPU_SHADOWS_RTSDF) {
        result = fm_published_share(FM_WITH, at, normal, light, FM_GET(jitter) != 0u ? turn : 0.0f);
    } else if (shadows == FM_GPU_SHADOWS_FIELD) {
        fm_float sum = 0;
        // The parts are discs of an n-th of the light's area, placed so that the mean square from the light's middle is the
        // light's.
        fm_float spread = light.spread / FM_SQRT(FM_F(FM_GET(samples)));
        fm_lit_from middles = light;
        middles.spread = light.spread * FM_SQRT(1 - 1 / FM_F(FM_GET(samples)));
        for (fm_uint i = 0u; i < FM_GET(samples); i++) {
            fm_v3 to = FM_GET(samples) == 1u ? way : fm_unit(fm_way_to_place(middles, i, FM_GET(samples), turn));
            fm_share one = fm_cone_share(FM_WITH, at, normal, to, light.far, spread);
            sum += one.share;
            result.reads += one.reads;
        }
        result.share = sum / FM_F(FM_GET(samples));
    } else if (shadows == FM_GPU_SHADOWS_MAP) {
        result.share = fm_map_share(FM_WITH, lifted);
    }
    return result;
}

FM_PUSH_STRUCT(fm_lit) {
    fm_float color[3];
    fm_float share;  // of the first light; below 0: no surface
};

FM_RULE fm_lit fm_lit_of(fm_v3 color, fm_float share) {
    fm_lit lit;
    lit.color[0] = color.x;
    lit.color[1] = color.y;
    lit.color[2] = color.z;
    lit.share = share;
    return lit;
}

FM_RULE fm_lit fm_light_pixel(FM_SCENE, fm_int x, fm_int y, fm_defer_surface s, fm_int shadows, fm_int view) {
    if (!(s.depth < FM_INFINITY_F)) {
        fm_v3 sky = view == FM_GPU_DEFERRED_SHADED ? fm_open_sky(fm_pixel_ray(FM_WITH, x, y)) : fm_v3_of(0.01f, 0.01f, 0.01f);
        return fm_lit_of(view == FM_GPU_DEFERRED_STEPS ? fm_heat(FM_F(s.steps) * (1.0f / 96)) : sky, -1.0f);
    }
    fm_v3 at = fm_v3_of(s.at[0], s.at[1], s.at[2]), normal = fm_v3_of(s.normal[0], s.normal[1], s.normal[2]);
    fm_v3 color = fm_clay_ambient(normal);
    fm_float first = 0;
    fm_uint reads = s.steps, seed = FM_GET(light_count) * (FM_U(y) * FM_U(FM_GET(width)) + FM_U(x));
    for (fm_uint i = 0u; i < FM_GET(light_count); i++) {
        fm_lit_from light = fm_light_from(FM_GET(lights)[i], at);
        fm_float cosine = fm_dot(normal, fm_v3_of(light.way[0], light.way[1], light.way[2]));
        if (cosine > 0) {
            fm_share share = fm_shadow_share(FM_WITH, at, normal, light, shadows, seed + i);
            first = i == 0u ? share.share : first;
            reads += i == 0u ? share.reads : 0u;
            color = fm_add(color, fm_clay_lit(FM_GET(lights)[i], share.share * cosine));
        }
    }
    if (view == FM_GPU_DEFERRED_NORMAL) {
        color = fm_normal_light(normal);
    } else if (view == FM_GPU_DEFERRED_STEPS) {
        color = fm_heat(FM_F(reads) * (1.0f / 96));
    } else if (view == FM_GPU_DEFERRED_SHARE) {
        color = fm_v3_of(first, first, first);
    }
    return fm_lit_of(color, first);
}

// ---------------------------------------------------------------------------------------------------------------------------
// Blending with the picture before
// ---------------------------------------------------------------------------------------------------------------------------

FM_PUSH_STRUCT(fm_past) {
    fm_float color[3];
    fm_uint there;  // 0: the place was out of sight
};

FM_RULE fm_v3 fm_light_at(FM_SCENE, fm_int x, fm_int y) {
    fm_int cx = FM_LEAST(FM_MOST(x, 0), FM_GET(width) - 1), cy = FM_LEAST(FM_MOST(y, 0), FM_GET(height) - 1);
    uint64_t at = 4 * (FM_LONG(cy) * FM_LONG(FM_GET(width)) + FM_LONG(cx));
    return fm_v3_of(FM_LIGHT(at), FM_LIGHT(at + 1), FM_LIGHT(at + 2));
}

// What the picture before showed `way` from the camera now: between the four pixels around.
FM_RULE fm_past fm_past_of(FM_SCENE, fm_v3 way) {
    fm_past past;
    past.there = 0u;
    fm_v3 from = fm_less(fm_add(way, FM_V3_FROM(origin)), FM_V3_FROM(old_origin));
    fm_float along = fm_dot(from, FM_V3_FROM(old_forward));
    fm_float x = FM_GET(old_middle)[0] + fm_dot(from, FM_V3_FROM(old_right)) / along;
    fm_float y = FM_GET(old_middle)[1] + fm_dot(from, FM_V3_FROM(old_down)) / along;
    if (!(along > 0 && x >= 0 && y >= 0 && x <= FM_F(FM_GET(width) - 1) && y <= FM_F(FM_GET(height) - 1))) {
        return past;
    }
    fm_int bx = FM_LEAST(FM_I(x), FM_MOST(FM_GET(width) - 2, 0)), by = FM_LEAST(FM_I(y), FM_MOST(FM_GET(height) - 2, 0));
    fm_v3 sum = fm_v3_of(0, 0, 0);
    for (fm_int i = 0; i < 4; i++) {
        fm_int px = FM_LEAST(bx + (i & 1), FM_GET(width) - 1), py = FM_LEAST(by + (i >> 1), FM_GET(height) - 1);
        fm_float wx = (i & 1) == 1 ? x - FM_F(bx) : 1 - x + FM_F(bx), wy = (i >> 1) == 1 ? y - FM_F(by) : 1 - y + FM_F(by);
        uint64_t place = 4 * (FM_LONG(py) * FM_LONG(FM_GET(width)) + FM_LONG(px));
        sum = fm_add(sum, fm_times(fm_v3_of(FM_PAST(place), FM_PAST(place + 1), FM_PAST(place + 2)), wx * wy));
    }
    past.there = 1u;
    past.color[0] = sum.x;
    past.color[1] = sum.y;
    past.color[2] = sum.z;
    return past;
}

// The picture's colour at a pixel, linear. What was before is kept within the colours around the pixel now, so that it fades where
// light has changed. Source: Karis 2014, "High-quality temporal supersampling".
FM_RULE fm_v3 fm_resolved(FM_SCENE, fm_int x, fm_int y, fm_defer_surface s) {
    fm_v3 now = fm_light_at(FM_WITH, x, y);
    if (FM_GET(blend) == 0u) {
        return now;
    }
    // The pixel's middle, not the place in it that this picture looks at, is what stays where it is; the sky is far away.
    fm_v3 way = fm_unit(fm_place_ray(FM_WITH, FM_F(x) - FM_GET(shift)[0], FM_F(y) - FM_GET(shift)[1]));
    fm_past past = fm_past_of(FM_WITH, fm_times(way, FM_MIN(s.depth, 1e12f)));
    if (past.there == 0u) {
        return now;
    }
    fm_v3 low = now, high = now;
    for (fm_int i = 0; i < 9; i++) {
        fm_v3 beside = fm_light_at(FM_WITH, x + i % 3 - 1, y + i / 3 - 1);
        low = fm_v3_of(FM_MIN(low.x, beside.x), FM_MIN(low.y, beside.y), FM_MIN(low.z, beside.z));
        high = fm_v3_of(FM_MAX(high.x, beside.x), FM_MAX(high.y, beside.y), FM_MAX(high.z, beside.z));
    }
    fm_v3 kept = fm_v3_of(FM_MIN(FM_MAX(past.color[0], low.x), high.x), FM_MIN(FM_MAX(past.color[1], low.y), high.y),
                          FM_MIN(FM_MAX(past.color[2], low.z), high.z));
    return fm_blend(now, kept, FM_HISTORY_PART);
}

// ---------------------------------------------------------------------------------------------------------------------------
// Shadow maps
// ---------------------------------------------------------------------------------------------------------------------------

// How deep a texel's ray goes, as a part of the box.
FM_RULE fm_float fm_map_depth(FM_SCENE, fm_int cascade, fm_int x, fm_int y) {
    fm_defer_cascade box = FM_GET(cascades)[cascade];
    fm_v3 origin = fm_add(fm_add(fm_v3_of(box.corner[0], box.corner[1], box.corner[2]),
                                 fm_times(fm_v3_of(box.right[0], box.right[1], box.right[2]), FM_F(x))),
                          fm_times(fm_v3_of(box.down[0], box.down[1], box.down[2]), FM_F(y)));
    fm_v3 way = fm_v3_of(-FM_GET(lights)[0].way[0], -FM_GET(lights)[0].way[1], -FM_GET(lights)[0].way[2]);
    return FM_MIN(fm_mesh_first(FM_WITH, origin, way, 0.0f, box.depth).time / box.depth, 1.0f);
}

// Weight of a texel `off` away in the blur: a Gaussian of a third of its reach.
FM_RULE fm_float fm_blur_weight(fm_int off) {
    fm_float part = 3 * FM_F(off) / (FM_F(FM_MAP_BLUR) + 1);
    return FM_EXP(-0.5f * part * part);
}

#endif
