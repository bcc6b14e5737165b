// SPDX-License-Identifier: MIT
// What a pixel shows: as src/render/host_shade.c. Light adds up in squares of what is stored. Expects march.glsl.

layout(constant_id = 4) const uint VIEW = FM_GPU_VIEW_COLOR;
layout(constant_id = 5) const uint SHADOW = FM_GPU_SHADOW_NONE;
layout(constant_id = 7) const bool OCCLUSION = false;
layout(constant_id = 8) const bool PREVIEW = false;

#include "brush.glsl"

// What a ray meets.
struct hit_t {
    ivec3 voxel;
    ivec3 normal;  // 0: the ray begins in the voxel
    vec3 at;
    float time;
};

// Field reads of this pixel's light; nothing reads them where sums are not wanted.
uint sun_reads = 0;
uint open_reads = 0;

vec3 sun_way() {
    return vec3(push.sun[0], push.sun[1], push.sun[2]);
}

uint load_color(ivec3 voxel) {
    uint64_t element = element_at(voxel);
    return FORMAT == FM_GPU_PACKED ? ref_u32(push.field + element * 4).v & 0xffu : uint(ref_u8(push.colors + element).v);
}

// RGB332 to light.
vec3 light_of(uint color) {
    vec3 v = vec3(color >> 5 & 7u, color >> 2 & 7u, color & 3u) * vec3(1.0 / 7.0, 1.0 / 7.0, 1.0 / 3.0);
    v = FM_DARKEST + (1.0 - FM_DARKEST) * v;
    return v * v;
}

uint load_map(uint i) {
    return ref_u32(push.extra + FM_EXTRA_MAP + min(i, 255u) * 4).v;
}

vec3 light_of_map(float part) {
    uint color = load_map(uint(clamp(part, 0.0, 1.0) * 255.0 + 0.5));
    vec3 v = vec3(color & 0xffu, color >> 8 & 0xffu, color >> 16 & 0xffu) * (1.0 / 255.0);
    return v * v;
}

vec3 sky(vec3 way) {
    vec3 toward = way * inversesqrt(dot(way, way));
    float height = toward.z;
    float rise = 1.0 - max(height, 0.0);
    vec3 light = mix(vec3(FM_ZENITH), vec3(FM_HORIZON), rise * rise * rise);
    light = mix(light, vec3(FM_BELOW), clamp(-FM_DUSK * height, 0.0, 1.0));
    float near = max(dot(toward, sun_way()), 0.0);
    float glow = near * near;
    glow *= glow;
    glow *= glow;
    glow *= glow;
    glow *= glow;
    return light + vec3(FM_GLOW) * (FM_GLOW_PART * glow + clamp((near - FM_SUN_EDGE) * FM_SUN_SHARP, 0.0, 1.0));
}

// What a ray to the sun passes by at a time: the room to the nearest surface, by the field between the centres of eight voxels, and
// how fast that grows.
struct passing_t {
    float time, room, slope;
};

passing_t pass_by(vec3 at, float time) {
    vec3 way = sun_way();
    vec3 from = at + way * time - 0.5;
    vec3 whole = floor(from);
    vec3 part = from - whole;
    float v[8];
    [[unroll]] for (int i = 0; i < 8; i++) {
        v[i] = length_around(ivec3(whole) + ivec3(i & 1, i >> 1 & 1, i >> 2));
    }
    float low = mix(mix(v[0], v[1], part.x), mix(v[2], v[3], part.x), part.y);
    float high = mix(mix(v[4], v[5], part.x), mix(v[6], v[7], part.x), part.y);
    float along_x = mix(mix(v[1] - v[0], v[3] - v[2], part.y), mix(v[5] - v[4], v[7] - v[6], part.y), part.z);
    float along_y = mix(mix(v[2] - v[0], v[3] - v[1], part.x), mix(v[6] - v[4], v[7] - v[5], part.x), part.z);
    return passing_t(time, mix(low, high, part.z) - 0.5, dot(vec3(along_x, along_y, high - low), way));
}

float lit_part(float room, float time) {
    return max(room, 0.0) * FM_PENUMBRA / time;
}

// How much of the sun a ray sees that meets nothing, from `cell` on: the least of room / time on the way. The march's own steps are
// whole numbers, and too far apart to find the least among them: that would show on walls as facets.
float penumbra(vec3 at, ray_t ray, vec3 cell, float time) {
    float open = 1.0;
    passing_t before = passing_t(0, 0, 0);
    while (inside(ray, cell)) {
        float steps = float(steps_of(load_entry(element_of(ray, cell))));
        sun_reads++;
        passing_t now = passing_t(0, 0, 0);
        if ((steps - FM_PENUMBRA_DOUBT) * FM_PENUMBRA < open * time) {
            now = pass_by(at, time);
            sun_reads += 8;
            open = min(open, lit_part(now.room, time));
            if (before.slope < 0 && now.slope > 0) {
                // Nearest between the two, where the lines that both are on meet.
                float meet = (before.room - now.room - before.slope * before.time + now.slope * time) / (now.slope - before.slope);
                float between = clamp(meet, before.time, time);
                open = min(open, lit_part(before.room + before.slope * (between - before.time), between));
            }
        }
        before = now;
        cell = go_ahead(ray, cell, steps, FM_GPU_MARCH_SKIP, time);
    }
    return open;
}

// 1 in full sunlight, 0 in the shadow. `cell` is the air before the face.
float sunlight(vec3 at, ivec3 cell) {
    ray_t ray = make_ray(at, sun_way());
    vec3 k = mix(vec3(cell), ray.size - 1.0 - vec3(cell), equal(ray.mirrored, uvec3(1)));
    float time = 0.0;
    vec3 doubt = k;
    float doubt_time = 0.0;
    while (inside(ray, k)) {
        float steps = float(steps_of(load_entry(element_of(ray, k))));
        sun_reads++;
        if (steps <= 0) {
            return 0.0;
        }
        if (SHADOW == FM_GPU_SHADOW_SOFT && doubt_time <= 0 && time > FM_PENUMBRA_FROM &&
            (steps - FM_PENUMBRA_DOUBT) * FM_PENUMBRA < time) {
            doubt = k;
            doubt_time = time;
        }
        k = go_ahead(ray, k, steps, FM_GPU_MARCH_SKIP, time);
    }
    // The way is free. Only now is it worth a closer look.
    float open = doubt_time > 0 ? penumbra(at, ray, doubt, doubt_time) : 1.0;
    return open * open * (3.0 - 2.0 * open);
}

// The field between the centres of four voxels across `axis`; `voxel` says where along it.
float length_between(ivec3 voxel, vec3 at, uint axis) {
    vec3 from = at - 0.5;
    vec3 whole = floor(from);
    vec3 part = from - whole;
    ivec3 first = mix(ivec3(whole), voxel, equal(uvec3(axis), uvec3(0, 1, 2)));
    ivec3 along_u = axis == 0 ? ivec3(0, 1, 0) : ivec3(1, 0, 0);
    ivec3 along_v = axis == 2 ? ivec3(0, 1, 0) : ivec3(0, 0, 1);
    float part_u = axis == 0 ? part.y : part.x;
    float near = mix(length_around(first), length_around(first + along_u), part_u);
    float far = mix(length_around(first + along_v), length_around(first + along_u + along_v), part_u);
    return mix(near, far, axis == 2 ? part.y : part.z);
}

// How open the space before a face is, from the field at three places along the normal, each between four voxels.
float openness(hit_t hit) {
    const int places[FM_OPEN_COUNT] = {FM_OPEN_PLACES};
    const float weights[FM_OPEN_COUNT] = {FM_OPEN_WEIGHTS};
    uint axis = hit.normal.x != 0 ? 0 : hit.normal.y != 0 ? 1 : 2;
    float closed = 0.0;
    [[unroll]] for (int i = 0; i < FM_OPEN_COUNT; i++) {
        float value = length_between(hit.voxel + hit.normal * places[i], hit.at, axis);
        closed += weights[i] * max(1.0 - value / float(places[i]), 0.0);
    }
    open_reads += 4 * FM_OPEN_COUNT;
    return 1.0 - FM_OPEN_PART * closed;
}

// A voxel that the brush covers is tinted, more so where one beside it in the face's plane is not covered.
vec3 tint(vec3 light, hit_t hit) {
    ref_brush brush = ref_brush(push.extra + FM_EXTRA_BRUSH);
    if (!brush_covers(brush, hit.voxel)) {
        return light;
    }
    bool edge = false;
    [[unroll]] for (int i = 0; i < 3; i++) {
        ivec3 beside = ivec3(0);
        beside[i] = 1 - abs(hit.normal[i]);
        edge = edge || !brush_covers(brush, hit.voxel + beside) || !brush_covers(brush, hit.voxel - beside);
    }
    return mix(light, vec3(FM_TINT), edge ? FM_TINT_EDGE : FM_TINT_PART);
}

vec3 surface(hit_t hit) {
    vec3 normal = vec3(hit.normal);
    vec3 albedo = light_of(load_color(hit.voxel));
    float faces = dot(normal, sun_way());
    float sun = max(faces, 0.0);
    if (SHADOW != FM_GPU_SHADOW_NONE && sun > 0) {
        sun *= sunlight(hit.at, hit.voxel + hit.normal);
    }
    float ambient = FM_AMBIENT + FM_AMBIENT_UP * normal.z - FM_AMBIENT_SIDE * abs(normal.x);
    if (OCCLUSION && hit.normal != ivec3(0)) {
        ambient *= openness(hit);
    }
    vec3 light = albedo * (vec3(FM_SUN_LIGHT) * sun + vec3(FM_AMBIENT_LIGHT) * ambient);
    return PREVIEW ? tint(light, hit) : light;
}

vec3 faces_by_direction(ivec3 normal) {
    vec3 v = FM_NORMAL_MIDDLE + FM_NORMAL_PART * vec3(normal);
    return v * v;
}

uint pack_light(vec3 light) {
    uvec3 v = uvec3(sqrt(clamp(light, 0.0, 1.0)) * 255.0 + 0.5);
    return v.x | v.y << 8 | v.z << 16 | 0xff000000u;
}
