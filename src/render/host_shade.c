// SPDX-License-Identifier: MIT
// What a pixel shows: as shaders/include/shade.glsl.

#include "render/host_shade.h"

#include "world/brush.h"

static float mix(float a, float b, float part) {
    return a + (b - a) * part;
}

static fm_vec3 mix_light(fm_vec3 a, fm_vec3 b, float part) {
    return (fm_vec3){{mix(a.v[0], b.v[0], part), mix(a.v[1], b.v[1], part), mix(a.v[2], b.v[2], part)}};
}

static float clamp(float value, float low, float high) {
    return value > low ? (value < high ? value : high) : low;
}

static float dot(const float a[3], const float b[3]) {
    return a[0] * b[0] + a[1] * b[1] + a[2] * b[2];
}

uint32_t fm_pack_light(fm_vec3 light) {
    uint32_t pixel = 0xff000000u;
    for (int i = 0; i < 3; i++) {
        pixel |= (uint32_t)(sqrtf(clamp(light.v[i], 0, 1)) * 255 + 0.5f) << (8 * i);
    }
    return pixel;
}

fm_vec3 fm_light_of_map(const uint32_t map[256], float part) {
    const uint32_t color = map[(uint32_t)(clamp(part, 0, 1) * 255 + 0.5f)];
    fm_vec3 light;
    for (int i = 0; i < 3; i++) {
        const float v = (float)(color >> (8 * i) & 0xff) * (1.0f / 255);
        light.v[i] = v * v;
    }
    return light;
}

fm_vec3 fm_sky_light(const fm_march_push *push, const float way[3]) {
    static const fm_vec3 zenith = {{FM_ZENITH}}, horizon = {{FM_HORIZON}}, below = {{FM_BELOW}};
    static const float sun[3] = {FM_GLOW};
    const float scale = 1 / sqrtf(dot(way, way));
    const float height = way[2] * scale;
    const float rise = 1 - (height > 0 ? height : 0);
    fm_vec3 light = mix_light(zenith, horizon, rise * rise * rise);
    light = mix_light(light, below, clamp(-FM_DUSK * height, 0, 1));
    const float near = fmaxf(dot(way, push->sun) * scale, 0);
    float glow = near * near;
    for (int i = 0; i < 4; i++) {
        glow *= glow;
    }
    for (int i = 0; i < 3; i++) {
        light.v[i] += sun[i] * (FM_GLOW_PART * glow + clamp((near - FM_SUN_EDGE) * FM_SUN_SHARP, 0, 1));
    }
    return light;
}

// RGB332 to light, of the voxel's colour.
static fm_vec3 albedo_of(const fm_grid *grid, const fm_cell *voxel) {
    const fm_host_world *host = grid->world->host;
    const uint64_t element = fm_element_at(grid, voxel);
    const uint32_t color = host->colors ? host->colors[element] : ((const uint32_t *)host->field)[element] & 0xff;
    fm_vec3 light = {{(float)(color >> 5 & 7) / 7, (float)(color >> 2 & 7) / 7, (float)(color & 3) / 3}};
    for (int i = 0; i < 3; i++) {
        const float v = FM_DARKEST + (1 - FM_DARKEST) * light.v[i];
        light.v[i] = v * v;
    }
    return light;
}

// What a ray to the sun passes by at a time: the room to the nearest surface, and how fast that grows.
typedef struct passing {
    float time, room, slope;
} passing;

static passing pass_by(const fm_scenery *scenery, const fm_hit *hit, float time) {
    const float *way = scenery->picture->push.sun;
    fm_cell first;
    float part[3], v[8];
    for (int i = 0; i < 3; i++) {
        const float from = hit->at.v[i] + way[i] * time - 0.5f;
        const float whole = floorf(from);
        first.v[i] = (int32_t)whole;
        part[i] = from - whole;
    }
    for (int i = 0; i < 8; i++) {
        const fm_cell at = {{first.v[0] + (i & 1), first.v[1] + (i >> 1 & 1), first.v[2] + (i >> 2)}};
        v[i] = fm_length_around(&scenery->grid, at);
    }
    const float low = mix(mix(v[0], v[1], part[0]), mix(v[2], v[3], part[0]), part[1]);
    const float high = mix(mix(v[4], v[5], part[0]), mix(v[6], v[7], part[0]), part[1]);
    const float along_x = mix(mix(v[1] - v[0], v[3] - v[2], part[1]), mix(v[5] - v[4], v[7] - v[6], part[1]), part[2]);
    const float along_y = mix(mix(v[2] - v[0], v[3] - v[1], part[0]), mix(v[6] - v[4], v[7] - v[5], part[0]), part[2]);
    return (passing){time, mix(low, high, part[2]) - 0.5f, along_x * way[0] + along_y * way[1] + (high - low) * way[2]};
}

static float lit_part(float room, float time) {
    return fmaxf(room, 0) * FM_PENUMBRA / time;
}

static float penumbra(const fm_scenery *scenery, const fm_hit *hit, const fm_ray *ray, fm_vec3 cell, float time, uint32_t *reads) {
    float open = 1;
    passing before = {0, 0, 0};
    while (fm_inside(ray, &cell)) {
        const fm_cell at = fm_unmirror(ray, &cell);
        const float steps = (float)fm_steps_at(&scenery->grid, &at);
        (*reads)++;
        passing now = {0, 0, 0};
        if ((steps - FM_PENUMBRA_DOUBT) * FM_PENUMBRA < open * time) {
            now = pass_by(scenery, hit, time);
            *reads += 8;
            open = fminf(open, lit_part(now.room, time));
            if (before.slope < 0 && now.slope > 0) {
                // Nearest between the two, where the lines that both are on meet.
                const float meet =
                    (before.room - now.room - before.slope * before.time + now.slope * time) / (now.slope - before.slope);
                const float between = clamp(meet, before.time, time);
                open = fminf(open, lit_part(before.room + before.slope * (between - before.time), between));
            }
        }
        before = now;
        time = fm_go_ahead(ray, &cell, steps, FM_MARCH_SKIP);
    }
    return open;
}

static float sunlight(const fm_scenery *scenery, const fm_hit *hit, uint32_t *reads) {
    const fm_grid *grid = &scenery->grid;
    const bool soft = scenery->picture->desc.shadow == FM_SHADOW_SOFT;
    const fm_ray ray = fm_make_ray(grid, hit->at.v, scenery->picture->push.sun);
    fm_vec3 cell;
    for (int i = 0; i < 3; i++) {
        const float k = (float)(hit->voxel.v[i] + hit->normal.v[i]);
        cell.v[i] = ray.mirrored[i] ? ray.size.v[i] - 1 - k : k;
    }
    fm_vec3 doubt = cell;
    float time = 0, doubt_time = 0;
    while (fm_inside(&ray, &cell)) {
        const fm_cell at = fm_unmirror(&ray, &cell);
        const float steps = (float)fm_steps_at(grid, &at);
        (*reads)++;
        if (steps <= 0) {
            return 0;
        }
        if (soft && doubt_time <= 0 && time > FM_PENUMBRA_FROM && (steps - FM_PENUMBRA_DOUBT) * FM_PENUMBRA < time) {
            doubt = cell;
            doubt_time = time;
        }
        time = fm_go_ahead(&ray, &cell, steps, FM_MARCH_SKIP);
    }
    // The way is free. Only now is it worth a closer look.
    const float open = doubt_time > 0 ? penumbra(scenery, hit, &ray, doubt, doubt_time, reads) : 1;
    return open * open * (3 - 2 * open);
}

// The field between the centres of four voxels across `axis`; `first` has the slice.
static float length_between(const fm_grid *grid, fm_cell first, const float at[3], int axis) {
    const int u = axis == 0 ? 1 : 0, v = axis == 2 ? 1 : 2;
    first.v[u] = (int32_t)floorf(at[u] - 0.5f);
    first.v[v] = (int32_t)floorf(at[v] - 0.5f);
    const float part_u = at[u] - 0.5f - (float)first.v[u], part_v = at[v] - 0.5f - (float)first.v[v];
    float row[2];
    for (int i = 0; i < 2; i++) {
        fm_cell next = first;
        next.v[u]++;
        row[i] = mix(fm_length_around(grid, first), fm_length_around(grid, next), part_u);
        first.v[v]++;
    }
    return mix(row[0], row[1], part_v);
}

static float openness(const fm_grid *grid, const fm_hit *hit, uint32_t *reads) {
    static const int places[FM_OPEN_COUNT] = {FM_OPEN_PLACES};
    static const float weights[FM_OPEN_COUNT] = {FM_OPEN_WEIGHTS};
    const int axis = hit->normal.v[0] ? 0 : hit->normal.v[1] ? 1 : 2;
    float closed = 0;
    for (int i = 0; i < FM_OPEN_COUNT; i++) {
        fm_cell at = hit->voxel;
        at.v[axis] += hit->normal.v[axis] * places[i];
        const float length = length_between(grid, at, hit->at.v, axis);
        closed += weights[i] * fmaxf(1 - length / (float)places[i], 0);
    }
    *reads += 4 * FM_OPEN_COUNT;
    return 1 - FM_OPEN_PART * closed;
}

static bool covers(const fm_gpu_brush *brush, fm_cell at) {
    return fm_brush_covers(brush, at.v[0], at.v[1], at.v[2]);
}

static fm_vec3 tint(const fm_gpu_brush *brush, fm_vec3 light, const fm_hit *hit) {
    if (!covers(brush, hit->voxel)) {
        return light;
    }
    bool edge = false;
    for (int i = 0; i < 3; i++) {
        fm_cell before = hit->voxel, behind = hit->voxel;
        before.v[i] -= hit->normal.v[i] == 0;
        behind.v[i] += hit->normal.v[i] == 0;
        edge = edge || !covers(brush, before) || !covers(brush, behind);
    }
    return mix_light(light, (fm_vec3){{FM_TINT}}, edge ? FM_TINT_EDGE : FM_TINT_PART);
}

fm_vec3 fm_surface_light(const fm_scenery *scenery, const fm_hit *hit, fm_light_reads *reads) {
    static const float sun_light[3] = {FM_SUN_LIGHT}, sky_light[3] = {FM_AMBIENT_LIGHT};
    const fm_picture *picture = scenery->picture;
    const float normal[3] = {(float)hit->normal.v[0], (float)hit->normal.v[1], (float)hit->normal.v[2]};
    float sun = fmaxf(dot(normal, picture->push.sun), 0);
    if (picture->desc.shadow != FM_SHADOW_NONE && sun > 0) {
        sun *= sunlight(scenery, hit, &reads->sun);
    }
    float ambient = FM_AMBIENT + FM_AMBIENT_UP * normal[2] - FM_AMBIENT_SIDE * fabsf(normal[0]);
    if (picture->desc.ambient_occlusion && (normal[0] != 0 || normal[1] != 0 || normal[2] != 0)) {
        ambient *= openness(&scenery->grid, hit, &reads->open);
    }
    fm_vec3 light = albedo_of(&scenery->grid, &hit->voxel);
    for (int i = 0; i < 3; i++) {
        light.v[i] *= sun_light[i] * sun + sky_light[i] * ambient;
    }
    return picture->preview ? tint(&picture->brush, light, hit) : light;
}

fm_vec3 fm_slice_light(const fm_scenery *scenery, const float at[3], float width) {
    const fm_grid *grid = &scenery->grid;
    fm_cell voxel;
    for (int i = 0; i < 3; i++) {
        const int32_t last = (int32_t)grid->axes[i] - 1;
        voxel.v[i] = (int32_t)at[i] < last ? (int32_t)at[i] : last;
    }
    if (fm_length_at(grid, &voxel) <= 0) {
        fm_vec3 light = albedo_of(grid, &voxel);
        return (fm_vec3){{light.v[0] * FM_SLICE_SOLID, light.v[1] * FM_SLICE_SOLID, light.v[2] * FM_SLICE_SOLID}};
    }
    const float value = length_between(grid, voxel, at, (int)scenery->picture->desc.slice_axis);
    const float off = fabsf(value - FM_LINE_EVERY * floorf(value * (1 / FM_LINE_EVERY) + 0.5f));
    const float line = clamp(1.5f - off / fmaxf(width, FM_LINE_LEAST), 0, 1);
    const fm_vec3 light = fm_light_of_map(scenery->map, value / (value + FM_SLICE_HALF));
    return mix_light(light, (fm_vec3){{FM_LINE_LIGHT, FM_LINE_LIGHT, FM_LINE_LIGHT}}, FM_LINE_PART * line);
}

fm_hit fm_hit_of(const fm_ray *ray, const fm_vec3 *cell) {
    fm_hit hit = {.voxel = fm_unmirror(ray, cell)};
    const int face = fm_face_of(ray, cell, &hit.time);
    for (int i = 0; i < 3; i++) {
        float at = clamp(ray->origin.v[i] + ray->way.v[i] * hit.time, cell->v[i], cell->v[i] + 1);
        if (i == face) {
            hit.normal.v[i] = ray->mirrored[i] ? 1 : -1;
            at = cell->v[i];
        }
        hit.at.v[i] = ray->mirrored[i] ? ray->size.v[i] - at : at;
    }
    return hit;
}
