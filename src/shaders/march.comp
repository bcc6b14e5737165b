// SPDX-License-Identifier: MIT
#version 460
#include "memory.glsl"
#include "march.glsl"
#include "picture.glsl"
#include "shade.glsl"

// One invocation owns a pixel, a work group a tile of 8 x 8. It reads the field where its ray goes, for shadows where the ray to
// the sun goes, and 12 voxels for the occlusion; the colour of one voxel; and writes 4 bytes.

layout(local_size_x = FM_TILE, local_size_y = FM_TILE) in;

layout(constant_id = 6) const bool BEAM = false;  // march_beam.comp says where a tile's rays may begin
layout(constant_id = 9) const bool CROSSHAIR = false;

struct found_t {
    uint solid;  // 1: the ray meets a solid voxel
    vec3 cell;
    uint reads;
};

found_t find(ray_t ray, vec3 start, uint how) {
    found_t found;
    found.cell = start;
    found.reads = 0;
    found.solid = march_ray(ray, found.cell, how, found.reads) ? 1 : 0;
    return found;
}

hit_t hit_of(ray_t ray, vec3 cell) {
    hit_t hit;
    bvec3 on_face = equal(uvec3(0, 1, 2), uvec3(face_of(ray, cell, hit.time)));
    hit.voxel = unmirror(ray, cell);
    hit.normal = mix(ivec3(0), ivec3(ray.mirrored) * 2 - 1, on_face);
    hit.at = unmirror_point(ray, mix(clamp(ray.origin + ray.way * hit.time, cell, cell + 1.0), cell, on_face));
    return hit;
}

// Where the tile's beam ends, unless rounding puts that beside the path.
vec3 skip_ahead(ray_t ray, vec3 start, float time, float beam) {
    if (beam > time) {
        vec3 ahead = cell_at(ray, beam);
        if (most(enter_times(ray, ahead)) < least(leave_times(ray, ahead))) {
            return ahead;
        }
    }
    return start;
}

// The time at which a ray meets the plane of the slice, inside of the world or not, and where; below 0: never.
float slice_time(vec3 origin, vec3 way, out vec3 at) {
    uint axis = push.slice & 3u;
    float plane = float(push.slice >> 2) + 0.5;
    float toward = way[axis];
    float time = toward != 0 ? (plane - origin[axis]) / toward : -1.0;
    at = origin + way * time;
    at[axis] = plane;
    return time;
}

// The field on the slice with a line wherever it passes a multiple of 8; solid voxels as they are.
vec3 slice_light(vec3 at, float width) {
    uint axis = push.slice & 3u;
    ivec3 voxel = min(ivec3(at), ivec3(world_axes()) - 1);
    if (length_at(voxel) == 0) {
        return light_of(load_color(voxel)) * FM_SLICE_SOLID;
    }
    float value = length_between(voxel, at, axis);
    float off = abs(value - FM_LINE_EVERY * floor(value * (1.0 / FM_LINE_EVERY) + 0.5));
    float line = clamp(1.5 - off / max(width, FM_LINE_LEAST), 0.0, 1.0);
    return mix(light_of_map(value / (value + FM_SLICE_HALF)), vec3(FM_LINE_LIGHT), FM_LINE_PART * line);
}

void count_pixel(found_t found, bool wrong) {
    add_sum(FM_SUM_RAYS, 1);
    add_sum(FM_SUM_HITS, found.solid);
    add_sum(FM_SUM_STEPS, found.reads);
    add_sum(FM_SUM_SUN, sun_reads);
    add_sum(FM_SUM_OPEN, open_reads);
    add_sum(FM_SUM_WRONG, wrong ? 1 : 0);
    atomicMax(sums[FM_STATS_MOST], found.reads);
}

// A cross in the middle that shows on every ground.
uint with_crosshair(uint color, uvec2 pixel, uvec2 pixels) {
    uint arm = max(pixels.y / 60, 4u), half_width = max(pixels.y / 720, 1u);
    uvec2 off = uvec2(abs(ivec2(pixel * 2u + 1u) - ivec2(pixels)));  // in half pixels
    bool cross = (off.x <= 2 * half_width && off.y <= 2 * arm) || (off.y <= 2 * half_width && off.x <= 2 * arm);
    return cross ? color ^ 0x00ffffffu : color;
}

vec3 light_of_pixel(ray_t ray, vec3 way, found_t found, float slice, vec3 slice_at, bool wrong) {
    if (VIEW == FM_GPU_VIEW_STEPS) {
        return light_of_map(log2(1.0 + float(found.reads)) * FM_STEPS_SCALE);
    }
    if (VIEW == FM_GPU_VIEW_SLICE && slice >= 0) {
        vec3 right = vec3(push.right[0], push.right[1], push.right[2]);
        return slice_light(slice_at, FM_LINE_WIDTH * slice * sqrt(dot(right, right)));
    }
    if (found.solid == 0) {
        vec3 light = VIEW == FM_GPU_VIEW_COLOR || VIEW == FM_GPU_VIEW_SLICE ? sky(way) : vec3(FM_NOTHING);
        return wrong ? vec3(1, 0, 0) : light;
    }
    hit_t hit = hit_of(ray, found.cell);
    switch (VIEW) {
    case FM_GPU_VIEW_NORMAL:
        return faces_by_direction(hit.normal);
    case FM_GPU_VIEW_DISTANCE: {
        float far = hit.time * sqrt(dot(way, way));
        return light_of_map(1.0 - far / (far + most(ray.size)));
    }
    case FM_GPU_VIEW_DIFFERENCE: {
        vec3 light = surface(hit);
        return wrong ? vec3(1, 0, 0) : vec3(dot(light, vec3(FM_GREY)));
    }
    default:
        return surface(hit);
    }
}

void main() {
    begin_sums();
    uvec2 pixels = uvec2(push.pixels & 0xffffu, push.pixels >> 16);
    uint tiles = (pixels.x + (FM_TILE - 1)) / FM_TILE;
    uint tile = uint(folded_group(gl_WorkGroupID, gl_NumWorkGroups));
    uvec2 pixel = uvec2(tile % tiles, tile / tiles) * FM_TILE + gl_LocalInvocationID.xy;
    found_t found;
    found.solid = 0;
    found.reads = 0;
    bool wrong = false;
    if (pixel.x < pixels.x && pixel.y < pixels.y) {
        vec3 way = pixel_way(vec2(pixel));
        ray_t ray = make_ray(camera_place(), way);
        float time = entry_time(ray);
        vec3 slice_at = vec3(0);
        float slice = -1.0;
        bool cut = false;
        if (VIEW == FM_GPU_VIEW_SLICE) {
            slice = slice_time(camera_place(), way, slice_at);
            cut = slice < 0;
            time = max(time, slice);
            bool within = all(greaterThanEqual(slice_at, vec3(0))) && all(lessThan(slice_at, ray.size));
            slice = within ? slice : -1.0;
        }
        vec3 start = cell_at(ray, time);
        vec3 from = BEAM ? skip_ahead(ray, start, time, uintBitsToFloat(ref_u32(push.beam + tile * 4).v)) : start;
        found.cell = start;
        if (!cut && slice < 0) {
            found = find(ray, from, MARCH);
        }
        if (VIEW == FM_GPU_VIEW_DIFFERENCE) {
            found_t right = find(ray, start, FM_GPU_MARCH_PLAIN);
            wrong = right.solid != found.solid || (found.solid == 1 && right.cell != found.cell);
            found.solid = right.solid;
            found.cell = right.cell;
        }
        uint color = pack_light(light_of_pixel(ray, way, found, slice, slice_at, wrong));
        ref_u32(push.picture + (uint64_t(pixel.y) * pixels.x + pixel.x) * 4).v =
            CROSSHAIR ? with_crosshair(color, pixel, pixels) : color;
        if (COUNT) {
            count_pixel(found, wrong);
        }
    }
    end_sums();
}
