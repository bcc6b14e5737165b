// SPDX-License-Identifier: MIT
#ifndef FM_DEFER_RULE_H
#define FM_DEFER_RULE_H

// Surfaces and shadows from a field, lights and shadow maps: one text for C and GLSL. Where the two differ stands first: the
// picture's constants (FM_GET), a texel of the field and a moment of the shadow map.

#include "cubic_rule.h"
#include "defer_shared.h"
#include "light_rule.h"

#ifdef __STDC__
#define FM_SCENE const fm_defer_scene *scene
#define FM_WITH scene
#define FM_GET(member) (scene->member)
#define FM_TEXEL(at) (((const float *)(uintptr_t)scene->field)[at])
#define FM_MOMENT(at) (((const float *)(uintptr_t)scene->map)[at])
#else
#define FM_SCENE uint unused
#define FM_WITH 0u
#define FM_GET(member) (ref_scene(push.scene).v.member)
#define FM_TEXEL(at) (ref_f32(ref_scene(push.scene).v.field + (at)*4).v)
#define FM_MOMENT(at) (ref_f32(ref_scene(push.scene).v.map + (at)*4).v)
#endif

#define FM_V3_FROM(member) fm_v3_of(FM_GET(member)[0], FM_GET(member)[1], FM_GET(member)[2])

// ---------------------------------------------------------------------------------------------------------------------------
// The field
// ---------------------------------------------------------------------------------------------------------------------------

FM_RULE fm_float fm_texel(FM_SCENE, fm_int x, fm_int y, fm_int z) {
    fm_int cx = FM_LEAST(FM_MOST(x, 0), FM_GET(shape)[0] - 1);
    fm_int cy = FM_LEAST(FM_MOST(y, 0), FM_GET(shape)[1] - 1);
    fm_int cz = FM_LEAST(FM_MOST(z, 0), FM_GET(shape)[2] - 1);
    // Of an empty mesh it is infinite, which cannot be interpolated.
    fm_float value = FM_TEXEL(FM_LONG(cx) + FM_LONG(FM_GET(shape)[0]) * (FM_LONG(cy) + FM_LONG(FM_GET(shape)[1]) * FM_LONG(cz)));
    return FM_MIN(FM_MAX(value, -1e30f), 1e30f) - FM_GET(level);
}

// A world position in texels.
FM_RULE fm_v3 fm_to_texels(FM_SCENE, fm_v3 at) {
    return fm_v3_of((at.x - FM_GET(field_origin)[0]) * FM_GET(field_scale)[0],
                    (at.y - FM_GET(field_origin)[1]) * FM_GET(field_scale)[1],
                    (at.z - FM_GET(field_origin)[2]) * FM_GET(field_scale)[2]);
}

FM_RULE fm_cell fm_cell_of(FM_SCENE, fm_v3 texel) {
    fm_cell cell;
    fm_float at[3];
    at[0] = texel.x;
    at[1] = texel.y;
    at[2] = texel.z;
    for (fm_int i = 0; i < 3; i++) {
        fm_int last = FM_MOST(FM_GET(shape)[i] - 2, 0);
        fm_float place = FM_MIN(FM_MAX(at[i], 0.0f), FM_F(FM_GET(shape)[i] - 1));
        cell.base[i] = FM_LEAST(FM_I(place), last);
        cell.part[i] = place - FM_F(cell.base[i]);
    }
    for (fm_int i = 0; i < 8; i++) {
        cell.v[i] = fm_texel(FM_WITH, cell.base[0] + (i & 1), cell.base[1] + (i >> 1 & 1), cell.base[2] + (i >> 2));
    }
    return cell;
}

FM_RULE fm_float fm_field_at(FM_SCENE, fm_v3 at) {
    return fm_cell_value(fm_cell_of(FM_WITH, fm_to_texels(FM_WITH, at)));
}

// When a ray is in the box of the texels: the first and the last time, the first above the last where it never is.
FM_PUSH_STRUCT(fm_span) {
    fm_float first, last;
};

FM_RULE fm_span fm_box_span(FM_SCENE, fm_v3 origin, fm_v3 way, fm_float first, fm_float last) {
    fm_v3 o = fm_to_texels(FM_WITH, origin);
    fm_float from[3], along[3];
    from[0] = o.x;
    from[1] = o.y;
    from[2] = o.z;
    along[0] = way.x * FM_GET(field_scale)[0];
    along[1] = way.y * FM_GET(field_scale)[1];
    along[2] = way.z * FM_GET(field_scale)[2];
    fm_span span;
    span.first = first;
    span.last = last;
    for (fm_int i = 0; i < 3; i++) {
        fm_float high = FM_F(FM_GET(shape)[i] - 1);
        if (along[i] != 0) {
            fm_float a = (0 - from[i]) / along[i], b = (high - from[i]) / along[i];
            span.first = FM_MAX(span.first, FM_MIN(a, b));
            span.last = FM_MIN(span.last, FM_MAX(a, b));
        } else if (from[i] < 0 || from[i] > high) {
            span.last = -1;
        }
    }
    return span;
}

FM_PUSH_STRUCT(fm_found) {
    fm_float time;  // +infinity: nothing
    fm_uint reads;  // of cells
};

// Where the ray first meets the surface of the field; `way` of length 1. A ray that begins inside has met it. No surface is nearer
// to a corner of a cell than its value says, so none is nearer to any place in the cell than that less the cell's diagonal.
FM_RULE fm_found fm_field_surface(FM_SCENE, fm_v3 origin, fm_v3 way) {
    fm_span span = fm_box_span(FM_WITH, origin, way, 0.0f, 1e30f);
    fm_v3 along = fm_v3_of(way.x * FM_GET(field_scale)[0], way.y * FM_GET(field_scale)[1], way.z * FM_GET(field_scale)[2]);
    fm_float nudge = 1e-3f * FM_GET(voxel), time = span.first;
    fm_found found;
    found.time = FM_INFINITY_F;
    found.reads = 0u;
    // A ray crosses a boundary between cells once.
    fm_uint most_reads = FM_U(FM_GET(shape)[0]) + FM_U(FM_GET(shape)[1]) + FM_U(FM_GET(shape)[2]) + 16u;
    while (time <= span.last && found.reads < most_reads) {
        fm_cell cell = fm_cell_of(FM_WITH, fm_to_texels(FM_WITH, fm_add(origin, fm_times(way, time))));
        found.reads++;
        fm_float least = cell.v[0], most = FM_SIZE_OF(cell.v[0]);
        for (fm_int i = 1; i < 8; i++) {
            least = FM_MIN(least, cell.v[i]);
            most = FM_MAX(most, FM_SIZE_OF(cell.v[i]));
        }
        fm_float stay = fm_cell_way(cell, along);
        if (least <= 0) {
            fm_float at = fm_cubic_first(fm_cell_cubic(cell, along), stay);
            if (at >= 0) {
                found.time = time + at;
                return found;
            }
        }
        time += FM_MAX(stay + nudge, most - FM_GET(diagonal));
    }
    return found;
}

FM_RULE fm_v3 fm_texel_gradient(FM_SCENE, fm_int x, fm_int y, fm_int z) {
    return fm_v3_of((fm_texel(FM_WITH, x + 1, y, z) - fm_texel(FM_WITH, x - 1, y, z)) * FM_GET(field_scale)[0],
                    (fm_texel(FM_WITH, x, y + 1, z) - fm_texel(FM_WITH, x, y - 1, z)) * FM_GET(field_scale)[1],
                    (fm_texel(FM_WITH, x, y, z + 1) - fm_texel(FM_WITH, x, y, z - 1)) * FM_GET(field_scale)[2]);
}

// Of length 1. Gradients of texels by central differences, interpolated, so that they go on across cells.
FM_RULE fm_v3 fm_field_normal(FM_SCENE, fm_v3 at) {
    fm_cell cell = fm_cell_of(FM_WITH, fm_to_texels(FM_WITH, at));
    fm_v3 sum = fm_v3_of(0, 0, 0);
    for (fm_int i = 0; i < 8; i++) {
        fm_int x = i & 1, y = i >> 1 & 1, z = i >> 2;
        fm_float weight = (x == 1 ? cell.part[0] : 1 - cell.part[0]) * (y == 1 ? cell.part[1] : 1 - cell.part[1]) *
                          (z == 1 ? cell.part[2] : 1 - cell.part[2]);
        sum = fm_add(sum, fm_times(fm_texel_gradient(FM_WITH, cell.base[0] + x, cell.base[1] + y, cell.base[2] + z), weight));
    }
    return fm_unit(sum);
}

// ---------------------------------------------------------------------------------------------------------------------------
// Lights
// ---------------------------------------------------------------------------------------------------------------------------

// A light from a place: the unit way to its middle, how far that is, and its radius as seen from there at distance 1.
FM_PUSH_STRUCT(fm_lit_from) {
    fm_float way[3];
    fm_float far;
    fm_float spread;
};

FM_RULE fm_lit_from fm_light_from(fm_defer_light light, fm_v3 at) {
    fm_lit_from from;
    fm_v3 way = fm_v3_of(light.way[0], light.way[1], light.way[2]);
    from.far = 1e30f;
    from.spread = light.size;
    if (light.kind == FM_GPU_LIGHT_AREA) {
        way = fm_less(way, at);
        from.far = FM_MAX(FM_SQRT(fm_dot(way, way)), 1e-20f);
        way = fm_times(way, 1 / from.far);
        from.spread = light.size / from.far;
    }
    from.way[0] = way.x;
    from.way[1] = way.y;
    from.way[2] = way.z;
    return from;
}

// The way to place `index` of `count` on the light's disc, not of length 1: its end is `far` away in units of it. The places lie on
// a spiral, each for an equal part of the disc (Vogel 1979).
FM_RULE fm_v3 fm_way_to_place(fm_lit_from from, fm_uint index, fm_uint count, fm_float turn) {
    fm_v3 way = fm_v3_of(from.way[0], from.way[1], from.way[2]);
    fm_v3 one = fm_beside(way), two = fm_cross(way, one);
    fm_float radius = from.spread * FM_SQRT((FM_F(index) + 0.5f) / FM_F(count));
    fm_float angle = 2.39996323f * FM_F(index) + 6.28318531f * turn;
    return fm_add(way, fm_add(fm_times(one, radius * FM_COS(angle)), fm_times(two, radius * FM_SIN(angle))));
}

// How much of a disc of radius 1 is seen past a straight edge that lies `edge` from its middle, -1: nothing, 1: all.
FM_RULE fm_float fm_disc_share(fm_float edge) {
    fm_float e = FM_MIN(FM_MAX(edge, -1.0f), 1.0f);
    return FM_MIN(FM_MAX(0.5f + (e * FM_SQRT(FM_MAX(1 - e * e, 0.0f)) + FM_ARCSIN(e)) * 0.318309886f, 0.0f), 1.0f);
}

FM_PUSH_STRUCT(fm_share) {
    fm_float share;
    fm_uint reads;
};

// The nearest that a ray has come to a surface between two samples of distance `before` and `now`: y[0] it has come to, y[1] before
// the newer sample (Aaltonen 2018, "GPU-based clay simulation and ray-tracing tech in Claybook").
FM_PUSH_STRUCT(fm_nearest_pass) {
    fm_float distance, back;
};

FM_RULE fm_nearest_pass fm_pass_between(fm_float before, fm_float now) {
    fm_nearest_pass nearest;
    nearest.back = now * now / (2 * before);
    nearest.distance = FM_SQRT(FM_MAX(now * now - nearest.back * nearest.back, 0.0f));
    return nearest;
}

// FM_SHADOWS_RTSDF. `start`: the part of a step that the first one is.
FM_RULE fm_share fm_published_share(FM_SCENE, fm_v3 at, fm_v3 normal, fm_lit_from light, fm_float start) {
    fm_v3 way = fm_v3_of(light.way[0], light.way[1], light.way[2]);
    fm_float closest = FM_GET(voxel);  // what counts as a hit, and how far from the surface the march begins
    fm_v3 origin = fm_add(at, fm_times(normal, 2 * closest));
    fm_span span = fm_box_span(FM_WITH, origin, way, 0.0f, light.far);
    fm_float time = span.first + closest + start * FM_GET(max_step), before = 1e20f;
    fm_share result;
    result.share = 1;
    result.reads = 0u;
    while (time < span.last && result.reads < FM_GET(max_steps)) {
        fm_float now = fm_field_at(FM_WITH, fm_add(origin, fm_times(way, time)));
        result.reads++;
        if (now < closest) {
            result.share = 0;
            return result;
        }
        fm_nearest_pass pass_by = fm_pass_between(before, now);
        fm_float where = light.spread * FM_MAX(time - pass_by.back, 0.0f);
        result.share = where > 0 ? FM_MIN(result.share, pass_by.distance / where) : result.share;
        before = now;
        time += FM_MIN(now, FM_GET(max_step));
    }
    return result;
}

// FM_SHADOWS_FIELD, for the cone of `spread` around `way`. Outside of the cone the field says how far the ray may go before it can
// cut the cone again; where it does, samples lie as close as the cone is wide. Where the ray is outside, the edge of what it passes
// lies where distance and cone are in the least proportion (the cone that just touches it); where it is inside, at its deepest.
FM_RULE fm_share fm_cone_share(FM_SCENE, fm_v3 at, fm_v3 normal, fm_v3 way, fm_float far, fm_float spread) {
    fm_float voxel = FM_GET(voxel);
    fm_v3 origin = fm_add(at, fm_times(normal, FM_CONE_LIFT * voxel));
    fm_span span = fm_box_span(FM_WITH, origin, way, 0.0f, far);
    fm_float time = span.first + voxel, least = 1, deepest = 0, deepest_edge = 0;
    fm_share result;
    result.reads = 0u;
    while (time < span.last && result.reads < FM_SOFT_READS) {
        fm_float distance = fm_field_at(FM_WITH, fm_add(origin, fm_times(way, time)));
        fm_float radius = FM_MAX(spread * time, 1e-3f * voxel);
        result.reads++;
        if (distance < deepest) {
            deepest = distance;
            deepest_edge = distance / radius;
        } else if (deepest < 0) {
            least = FM_MIN(least, deepest_edge);
            deepest = distance < 0 ? deepest : 0.0f;
        }
        least = FM_MIN(least, FM_MAX(distance, 0.0f) / radius);
        if (least <= -1) {
            break;
        }
        fm_float free = distance < 0 ? -0.5f * distance : (distance - radius) / (1 + spread);
        time += FM_MAX(free, FM_MAX(0.5f * voxel, 0.25f * radius));
    }
    result.share = fm_disc_share(FM_MIN(least, deepest < 0 ? deepest_edge : 1.0f));
    return result;
}

// ---------------------------------------------------------------------------------------------------------------------------
// Shadow maps
// ---------------------------------------------------------------------------------------------------------------------------

FM_RULE fm_float fm_warp_up(fm_float depth) {
    return FM_EXP(FM_WARP_UP * (2 * depth - 1));
}

FM_RULE fm_float fm_warp_down(fm_float depth) {
    return -FM_EXP(-FM_WARP_DOWN * (2 * depth - 1));
}

// The most of the light that depths of this mean and mean square let through to `value` (Chebyshev), with what bleeds cut off.
FM_RULE fm_float fm_chebyshev(fm_float mean, fm_float square, fm_float value, fm_float scale) {
    fm_float least = FM_LEAST_VARIANCE * scale * value;
    fm_float variance = FM_MAX(square - mean * mean, least * least), above = value - mean;
    fm_float share = variance / (variance + above * above);
    return value <= mean ? 1.0f : FM_MIN(FM_MAX((share - FM_BLEEDING) / (1 - FM_BLEEDING), 0.0f), 1.0f);
}

FM_RULE fm_float fm_map_moment(FM_SCENE, fm_int cascade, fm_float x, fm_float y, fm_int moment) {
    fm_int edge = FM_I(FM_GET(map_edge));
    fm_float px = FM_MIN(FM_MAX(x, 0.0f), FM_F(edge - 1)), py = FM_MIN(FM_MAX(y, 0.0f), FM_F(edge - 1));
    fm_int bx = FM_LEAST(FM_I(px), FM_MOST(edge - 2, 0)), by = FM_LEAST(FM_I(py), FM_MOST(edge - 2, 0));
    fm_int nx = FM_LEAST(bx + 1, edge - 1), ny = FM_LEAST(by + 1, edge - 1);
    uint64_t first = FM_LONG(cascade) * FM_LONG(edge) * FM_LONG(edge), width = FM_LONG(edge);
    uint64_t m = FM_LONG(moment);
    fm_float above = fm_lerp(FM_MOMENT((first + FM_LONG(by) * width + FM_LONG(bx)) * FM_MAP_FLOATS + m),
                             FM_MOMENT((first + FM_LONG(by) * width + FM_LONG(nx)) * FM_MAP_FLOATS + m), px - FM_F(bx));
    fm_float below = fm_lerp(FM_MOMENT((first + FM_LONG(ny) * width + FM_LONG(bx)) * FM_MAP_FLOATS + m),
                             FM_MOMENT((first + FM_LONG(ny) * width + FM_LONG(nx)) * FM_MAP_FLOATS + m), px - FM_F(bx));
    return fm_lerp(above, below, py - FM_F(by));
}

// FM_SHADOWS_MAP: by the first cascade that holds the place with all that is blurred into it.
FM_RULE fm_float fm_map_share(FM_SCENE, fm_v3 at) {
    fm_float edge = FM_F(FM_GET(map_edge));
    for (fm_int i = 0; i < FM_CASCADES; i++) {
        fm_defer_cascade box = FM_GET(cascades)[i];
        fm_v3 right = fm_v3_of(box.right[0], box.right[1], box.right[2]), down = fm_v3_of(box.down[0], box.down[1], box.down[2]);
        fm_v3 from = fm_less(at, fm_v3_of(box.corner[0], box.corner[1], box.corner[2]));
        fm_float x = fm_dot(from, right) / fm_dot(right, right), y = fm_dot(from, down) / fm_dot(down, down);
        fm_v3 way = fm_v3_of(FM_GET(lights)[0].way[0], FM_GET(lights)[0].way[1], FM_GET(lights)[0].way[2]);
        fm_float depth = -fm_dot(from, way) / box.depth - 2e-3f;
        fm_float margin = FM_F(FM_MAP_BLUR) + 1;
        if (i == FM_CASCADES - 1 || (x >= margin && y >= margin && x <= edge - 1 - margin && y <= edge - 1 - margin)) {
            if (x < 0 || y < 0 || x > edge - 1 || y > edge - 1) {
                return 1;
            }
            fm_float up =
                fm_chebyshev(fm_map_moment(FM_WITH, i, x, y, 0), fm_map_moment(FM_WITH, i, x, y, 1), fm_warp_up(depth), FM_WARP_UP);
            fm_float low = fm_chebyshev(fm_map_moment(FM_WITH, i, x, y, 2), fm_map_moment(FM_WITH, i, x, y, 3), fm_warp_down(depth),
                                        FM_WARP_DOWN);
            return FM_MIN(up, low);
        }
    }
    return 1;
}

// ---------------------------------------------------------------------------------------------------------------------------
// Light and colour
// ---------------------------------------------------------------------------------------------------------------------------

FM_RULE fm_v3 fm_clay_ambient(fm_v3 normal) {
    return fm_tint(fm_ambient_light(normal), fm_v3_of(FM_CLAY));
}

// Clay in a light of which `part` = share times the cosine arrives.
FM_RULE fm_v3 fm_clay_lit(fm_defer_light light, fm_float part) {
    fm_v3 clay = fm_v3_of(FM_CLAY);
    return fm_v3_of(clay.x * light.color[0] * part, clay.y * light.color[1] * part, clay.z * light.color[2] * part);
}

#endif
