// SPDX-License-Identifier: MIT
#ifndef FM_OCTREE_PIXEL_RULE_H
#define FM_OCTREE_PIXEL_RULE_H

// The steps of an octree's picture for one pixel or tile: one text for C and GLSL. Where the two differ stands first: the picture's
// constants (FM_PIC), parts of a streamed octree and heads.

#include "light_rule.h"
#include "octree_beam_rule.h"
#include "octree_picture_shared.h"

#ifdef __STDC__
#define FM_VIEWED const fm_octree_scene *scene
#define FM_VIEW scene
#define FM_PIC(member) (scene->member)
#define FM_PART(at) (((const fm_octree_part *)(uintptr_t)scene->grid.parts)[at])
#define FM_STREAMED (scene->grid.parts != 0)
static inline fm_octree_head fm_scene_head(const fm_octree_scene *scene, fm_address at) {
    fm_octree_head head = *(const fm_octree_head *)(uintptr_t)at;
    head.stepped = scene->stepped;
    return head;
}
#else
#define FM_VIEWED uint unused
#define FM_VIEW 0u
#define FM_PIC(member) (ref_scene(push.scene).v.member)
#define FM_PART(at) (ref_part(ref_scene(push.scene).v.grid.parts + (at)*16).v)
#define FM_STREAMED (STREAMED != 0u)
#define fm_scene_head(view, at) octree_head(at)
#endif

#define FM_PIC_V3(member) fm_v3_of(FM_PIC(member)[0], FM_PIC(member)[1], FM_PIC(member)[2])

FM_RULE fm_v3 fm_octree_pixel_way(FM_VIEWED, fm_float x, fm_float y) {
    return fm_unit(fm_add(fm_add(FM_PIC_V3(corner), fm_times(FM_PIC_V3(right), x)), fm_times(FM_PIC_V3(down), y)));
}

// ---------------------------------------------------------------------------------------------------------------------------
// Rays through the scene
// ---------------------------------------------------------------------------------------------------------------------------

#define FM_PART_LEGS 256  // parts that a ray goes through at most

// Until when a ray stays in an octree: that of a part, or the coarse one.
FM_PUSH_STRUCT(fm_octree_leg) {
    fm_address head;
    fm_float last;
};

FM_RULE fm_int fm_part_axis(fm_float at, fm_int count) {
    return FM_I(FM_MIN(FM_MAX(at, 0.0f), FM_F(count) - 0.5f));
}

FM_RULE fm_octree_leg fm_part_at(FM_VIEWED, fm_v3 origin, fm_v3 way, fm_float t, fm_float chance) {
    fm_float scale = 1 / FM_PIC(grid).size;
    fm_v3 at = fm_add(origin, fm_times(way, t));
    fm_v3 place = fm_times(fm_less(at, FM_PIC_V3(grid.origin)), scale);
    fm_int x = fm_part_axis(place.x, FM_PIC(grid).count[0]), y = fm_part_axis(place.y, FM_PIC(grid).count[1]),
           z = fm_part_axis(place.z, FM_PIC(grid).count[2]);
    fm_octree_part part =
        FM_PART(FM_LONG(x) + FM_LONG(FM_PIC(grid).count[0]) * (FM_LONG(y) + FM_LONG(FM_PIC(grid).count[1]) * FM_LONG(z)));
    fm_octree_ray ray;
    ray.way = way;
    ray.inverse = fm_v3_of(fm_octree_inverse(way.x), fm_octree_inverse(way.y), fm_octree_inverse(way.z));
    fm_float stay = fm_octree_stay(ray, place, fm_v3_of(FM_F(x), FM_F(y), FM_F(z)), 1.0f);
    // The border of what is near enough is as soft as the appearing of a part.
    fm_float near = FM_PIC(grid).distance * (1 - 0.2f * chance);
    bool shows = part.shown > chance && fm_octree_length(fm_less(at, FM_PIC_V3(origin))) < near;
    fm_octree_leg leg;
    leg.head = shows ? part.head : FM_LONG(0);
    leg.last = t + (stay + 1e-4f) / scale;
    return leg;
}

// What a ray meets first. `chance`, 0 to 1 and below 1, decides for the ray between parts that have not wholly appeared and the
// coarse octree.
FM_RULE fm_octree_met fm_scene_cast(FM_VIEWED, fm_v3 origin, fm_v3 way, fm_float first, fm_float last, fm_float chance) {
    fm_octree_head head = fm_scene_head(FM_VIEW, FM_PIC(head));
    fm_octree_met met = fm_octree_nothing();
    fm_octree_span span;
    span.first = first;
    span.last = last;
    if (FM_STREAMED) {
        span = fm_octree_clip(head, origin, way, first, last);
    }
    fm_float t = span.first;
    fm_uint reads = 0u;
    for (int i = 0; i < (FM_STREAMED ? FM_PART_LEGS : 1) && t <= span.last && !(met.t < FM_INFINITY_F); i++) {
        fm_octree_leg leg;
        leg.head = FM_LONG(0);
        leg.last = span.last;
        if (FM_STREAMED) {
            leg = fm_part_at(FM_VIEW, origin, way, t, chance);
            fm_octree_leg next = leg;
            // Neighbours that are not there are one way through the coarse octree.
            for (int k = 0; k < FM_PART_LEGS && leg.head == FM_LONG(0) && next.head == FM_LONG(0) && leg.last < span.last; k++) {
                next = fm_part_at(FM_VIEW, origin, way, leg.last, chance);
                leg.last = next.head == FM_LONG(0) ? next.last : leg.last;
            }
            if (leg.head != FM_LONG(0)) {
                head = fm_scene_head(FM_VIEW, leg.head);
            } else {
                head = fm_scene_head(FM_VIEW, FM_PIC(head));
            }
        }
        met = fm_cast_octree(head, origin, way, t, FM_MIN(leg.last, span.last), FM_PIC(epsilon) * head.cell);
        reads += met.reads;
        t = leg.last;
    }
    met.reads = reads;
    return met;
}

FM_RULE fm_float fm_pixel_chance(FM_VIEWED, fm_int x, fm_int y) {
    return fm_chance(FM_U(y) * FM_U(FM_PIC(width)) + FM_U(x), 77u);
}

// ---------------------------------------------------------------------------------------------------------------------------
// The first ray
// ---------------------------------------------------------------------------------------------------------------------------

FM_RULE fm_octree_beam fm_tile_beam(FM_VIEWED, fm_int tile_x, fm_int tile_y) {
    fm_octree_head head = fm_scene_head(FM_VIEW, FM_PIC(head));
    fm_float half_side = 0.5f * (FM_OCTREE_TILE - 1), x = FM_F(tile_x * FM_OCTREE_TILE), y = FM_F(tile_y * FM_OCTREE_TILE);
    fm_v3 way = fm_octree_pixel_way(FM_VIEW, x + half_side, y + half_side);
    fm_float spread = 0;
    for (int i = 0; i < 4; i++) {
        fm_v3 corner = fm_octree_pixel_way(FM_VIEW, x + FM_F(i & 1) * 2 * half_side, y + FM_F(i >> 1) * 2 * half_side);
        spread = FM_MAX(spread, fm_octree_length(fm_less(corner, way)));
    }
    return fm_octree_beam_of(head, FM_PIC_V3(origin), way, spread * 1.001f + 1e-6f, FM_PIC(epsilon) + 0.05f);
}

FM_RULE fm_octree_met fm_first_ray(FM_VIEWED, fm_int x, fm_int y, fm_float first) {
    return fm_scene_cast(FM_VIEW, FM_PIC_V3(origin), fm_octree_pixel_way(FM_VIEW, FM_F(x), FM_F(y)), first, 1e30f,
                         fm_pixel_chance(FM_VIEW, x, y));
}

// A direction in 32 bits, on an unfolded octahedron: within 5e-5.
FM_RULE fm_uint fm_pack_way(fm_v3 way) {
    fm_float sum = FM_SIZE_OF(way.x) + FM_SIZE_OF(way.y) + FM_SIZE_OF(way.z), u = way.x / sum, v = way.y / sum;
    if (way.z < 0) {
        fm_float folded = (1 - FM_SIZE_OF(v)) * fm_vcp_sign(u);
        v = (1 - FM_SIZE_OF(u)) * fm_vcp_sign(v);
        u = folded;
    }
    return FM_U((u + 1) * 32767 + 0.5f) | FM_U((v + 1) * 32767 + 0.5f) << 16;
}

FM_RULE fm_v3 fm_unpack_way(fm_uint bits) {
    fm_float u = FM_F(bits & 0xffffu) * (1.0f / 32767) - 1, v = FM_F(bits >> 16) * (1.0f / 32767) - 1;
    fm_float z = 1 - FM_SIZE_OF(u) - FM_SIZE_OF(v), fold = FM_MAX(-z, 0.0f);
    return fm_unit(fm_v3_of(u - fm_vcp_sign(u) * fold, v - fm_vcp_sign(v) * fold, z));
}

FM_RULE fm_octree_pixel fm_pixel_of(fm_octree_met met) {
    fm_octree_pixel pixel;
    pixel.t = met.t;
    pixel.normal = 0u;
    if (met.t < FM_INFINITY_F) {
        pixel.normal = fm_pack_way(fm_v3_of(met.normal[0], met.normal[1], met.normal[2]));
    }
    pixel.mark = met.mark;
    pixel.reads = met.reads << 5 | FM_U(met.level);
    return pixel;
}

// ---------------------------------------------------------------------------------------------------------------------------
// Light
// ---------------------------------------------------------------------------------------------------------------------------

// The surface's own colour, or clay.
FM_RULE fm_v3 fm_octree_color(fm_octree_head head, fm_uint mark) {
    if (head.mark == FM_GPU_COLOR) {
        return fm_v3_of(fm_light_of(mark & 255u), fm_light_of(mark >> 8 & 255u), fm_light_of(mark >> 16 & 255u));
    }
    if (head.mark == FM_GPU_PLAIN && (head.kind == FM_GPU_VOXELS || head.kind == FM_GPU_CONTOURS || head.kind == FM_GPU_TREE64)) {
        // RGB332, as of worlds.
        return fm_v3_of(fm_light_of((mark >> 5 & 7u) * 255u / 7u), fm_light_of((mark >> 2 & 7u) * 255u / 7u),
                        fm_light_of((mark & 3u) * 85u));
    }
    return fm_v3_of(FM_CLAY);
}

FM_RULE fm_v3 fm_surface_light(FM_VIEWED, fm_v3 color, fm_v3 normal, fm_float share) {
    fm_float sun = FM_MAX(fm_dot(normal, FM_PIC_V3(sun)), 0.0f) * share;
    return fm_tint(fm_add(fm_ambient_light(normal), fm_v3_of(sun, sun, sun)), color);
}

// What is seen along a ray.
FM_RULE fm_v3 fm_seen_light(FM_VIEWED, fm_octree_met met, fm_v3 way) {
    if (!(met.t < FM_INFINITY_F)) {
        return fm_open_sky(way);
    }
    return fm_surface_light(FM_VIEW, fm_octree_color(fm_scene_head(FM_VIEW, FM_PIC(head)), met.mark),
                            fm_v3_of(met.normal[0], met.normal[1], met.normal[2]), 1.0f);
}

// The picture without second rays.
FM_RULE fm_v3 fm_first_light(FM_VIEWED, fm_int x, fm_int y, fm_octree_met met, fm_int view) {
    if (view == FM_GPU_OCTREE_SHADED) {
        return fm_seen_light(FM_VIEW, met, fm_octree_pixel_way(FM_VIEW, FM_F(x), FM_F(y)));
    }
    if (view == FM_GPU_OCTREE_READS) {
        return fm_heat(FM_F(met.reads) * (1.0f / FM_OCTREE_HOT_READS));
    }
    if (!(met.t < FM_INFINITY_F)) {
        return fm_v3_of(0.01f, 0.01f, 0.01f);
    }
    fm_v3 normal = fm_v3_of(met.normal[0], met.normal[1], met.normal[2]);
    if (view == FM_GPU_OCTREE_NORMALS) {
        return fm_normal_light(normal);
    }
    // Coarser levels are warmer, and the shape can still be made out.
    fm_octree_head head = fm_scene_head(FM_VIEW, FM_PIC(head));
    return fm_times(fm_heat((FM_F(met.level) + 0.5f) / (FM_F(head.levels) + 1)), 0.55f + 0.45f * normal.z);
}

// ---------------------------------------------------------------------------------------------------------------------------
// Second rays
// ---------------------------------------------------------------------------------------------------------------------------

FM_RULE fm_v3 fm_reflected(fm_v3 way, fm_v3 normal) {
    return fm_less(way, fm_times(normal, 2 * fm_dot(way, normal)));
}

// Behind an interface where the refractive index falls or rises by `ratio`, of before to behind; no way at all: total reflection.
FM_RULE fm_v3 fm_refracted(fm_v3 way, fm_v3 normal, fm_float ratio) {
    fm_float along = -fm_dot(way, normal), rest = 1 - ratio * ratio * (1 - along * along);
    if (rest < 0) {
        return fm_v3_of(0, 0, 0);
    }
    return fm_unit(fm_add(fm_times(way, ratio), fm_times(normal, ratio * along - FM_SQRT(rest))));
}

// The part of unpolarised light that an interface reflects (Fresnel).
FM_RULE fm_float fm_reflectance(fm_v3 way, fm_v3 normal, fm_float ratio) {
    fm_float in_cos = FM_MIN(-fm_dot(way, normal), 1.0f), rest = 1 - ratio * ratio * (1 - in_cos * in_cos);
    if (rest <= 0) {
        return 1;
    }
    fm_float out_cos = FM_SQRT(rest);
    fm_float across = (ratio * in_cos - out_cos) / (ratio * in_cos + out_cos);
    fm_float level = (in_cos - ratio * out_cos) / (in_cos + ratio * out_cos);
    return 0.5f * (across * across + level * level);
}

#define FM_STAGE_SUN 0
#define FM_STAGE_REFLECTED 1
#define FM_STAGE_INSIDE 2
#define FM_STAGE_OUT 3
#define FM_STAGE_DONE 4

FM_PUSH_STRUCT(fm_octree_second) {
    fm_float color[3];
    fm_uint rays, reads;
};

FM_RULE fm_octree_second fm_second_of(fm_v3 color, fm_uint rays, fm_uint reads) {
    fm_octree_second second;
    second.color[0] = color.x;
    second.color[1] = color.y;
    second.color[2] = color.z;
    second.rays = rays;
    second.reads = reads;
    return second;
}

// A pixel's light with its second rays. They go one after the other through the same call, so that a kernel holds one cast.
FM_RULE fm_octree_second fm_second_light(FM_VIEWED, fm_int x, fm_int y, fm_octree_pixel pixel, bool shadow, bool mirrors,
                                         bool clear) {
    fm_octree_head head = fm_scene_head(FM_VIEW, FM_PIC(head));
    fm_v3 way = fm_octree_pixel_way(FM_VIEW, FM_F(x), FM_F(y));
    if (!(pixel.t < FM_INFINITY_F)) {
        return fm_second_of(fm_open_sky(way), 0u, 0u);
    }
    fm_float lift = FM_PIC(lift) * head.cell, share = 1, reflected = FM_PIC(reflection), through = 0, ratio = 1;
    fm_float chance = fm_pixel_chance(FM_VIEW, x, y);
    fm_v3 normal = fm_unpack_way(pixel.normal), at = fm_add(FM_PIC_V3(origin), fm_times(way, pixel.t)), from = at, along = way;
    fm_v3 reflection = fm_v3_of(0, 0, 0), beyond = reflection, turned = reflection;
    if (clear) {
        ratio = 1 / FM_PIC(refraction);
        reflected = fm_reflectance(way, normal, ratio);
        through = 1 - reflected;
    }
    fm_uint rays = 0u, reads = 0u;
    fm_int stage = FM_STAGE_SUN;
    for (int i = 0; i < FM_OCTREE_SECOND_RAYS && stage != FM_STAGE_DONE; i++) {
        if (stage == FM_STAGE_SUN) {
            along = FM_PIC_V3(sun);
            from = fm_add(at, fm_times(normal, lift));
            stage = shadow && !clear && fm_dot(normal, along) > 0 ? FM_STAGE_SUN : FM_STAGE_REFLECTED;
        }
        if (stage == FM_STAGE_REFLECTED) {
            along = fm_reflected(way, normal);
            from = fm_add(at, fm_times(normal, lift));
            stage = mirrors || clear ? FM_STAGE_REFLECTED : FM_STAGE_DONE;
        }
        if (stage == FM_STAGE_DONE) {
            break;
        }
        fm_octree_met met = fm_scene_cast(FM_VIEW, from, along, 0.0f, 1e30f, chance);
        rays++;
        reads += met.reads;
        bool there = met.t < FM_INFINITY_F;
        fm_v3 facing = fm_v3_of(met.normal[0], met.normal[1], met.normal[2]);
        if (stage == FM_STAGE_SUN) {
            share = there ? 0.0f : 1.0f;
            stage = FM_STAGE_REFLECTED;
        } else if (stage == FM_STAGE_REFLECTED) {
            reflection = fm_seen_light(FM_VIEW, met, along);
            stage = clear ? FM_STAGE_INSIDE : FM_STAGE_DONE;
            from = fm_less(at, fm_times(normal, lift));
            along = fm_refracted(way, normal, ratio);
        } else if (stage == FM_STAGE_INSIDE && there) {
            // Out again, or on inside where nothing gets out.
            fm_v3 end = fm_add(from, fm_times(along, met.t));
            turned = fm_refracted(along, facing, 1 / ratio);
            bool out_of = fm_dot(turned, turned) > 0;
            through *= out_of ? 1 - fm_reflectance(along, facing, 1 / ratio) : 1.0f;
            from = fm_add(end, fm_times(facing, out_of ? -lift : lift));
            along = out_of ? turned : fm_reflected(along, facing);
            stage = out_of ? FM_STAGE_OUT : FM_STAGE_INSIDE;
            beyond = fm_open_sky(along);
        } else {
            beyond = fm_seen_light(FM_VIEW, met, along);
            stage = FM_STAGE_DONE;
        }
    }
    fm_v3 own = fm_surface_light(FM_VIEW, fm_octree_color(head, pixel.mark), normal, share);
    fm_v3 light = clear ? fm_add(fm_times(reflection, reflected), fm_times(beyond, through)) : fm_blend(own, reflection, reflected);
    return fm_second_of(light, rays, reads);
}

#endif
