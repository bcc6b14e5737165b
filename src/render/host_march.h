// SPDX-License-Identifier: MIT
#ifndef FM_HOST_MARCH_H
#define FM_HOST_MARCH_H

// How rays cross a world: as shaders/include/march.glsl, where it is explained, step for step.

#include "render/render.h"
#include "world/host_world.h"

#include <math.h>

typedef struct fm_vec3 {
    float v[3];
} fm_vec3;

typedef struct fm_cell {
    int32_t v[3];
} fm_cell;

typedef struct fm_ray {
    fm_vec3 origin, way, inverse, size;
    bool mirrored[3];
    float per_step, bias;
} fm_ray;

// A world as rays read it.
typedef struct fm_grid {
    const fm_world *world;
    const uint32_t *bits;
    uint32_t axes[3];
    uint32_t row_words;
    fm_field_format format;
} fm_grid;

static inline fm_grid fm_grid_of(const fm_world *world) {
    const fm_shape shape = world->desc.shape;
    return (fm_grid){world, world->host->bits, {shape.x, shape.y, shape.z}, fm_bits_row_words(shape), world->desc.format};
}

static inline fm_ray fm_make_ray(const fm_grid *grid, const float origin[3], const float direction[3]) {
    fm_ray ray;
    for (int i = 0; i < 3; i++) {
        ray.size.v[i] = (float)grid->axes[i];
        ray.mirrored[i] = direction[i] < 0;
        ray.origin.v[i] = ray.mirrored[i] ? ray.size.v[i] - origin[i] : origin[i];
        ray.way.v[i] = fabsf(direction[i]);
        ray.inverse.v[i] = 1.0f / (ray.way.v[i] > 1e-30f ? ray.way.v[i] : 1e-30f);
    }
    ray.per_step = 1.0f / (ray.way.v[0] + ray.way.v[1] + ray.way.v[2]);
    ray.bias = -1.0f - (ray.origin.v[0] + ray.origin.v[1] + ray.origin.v[2]);
    return ray;
}

static inline fm_cell fm_unmirror(const fm_ray *ray, const fm_vec3 *cell) {
    fm_cell at;
    for (int i = 0; i < 3; i++) {
        at.v[i] = (int32_t)(ray->mirrored[i] ? ray->size.v[i] - 1 - cell->v[i] : cell->v[i]);
    }
    return at;
}

static inline float fm_most(fm_vec3 t) {
    const float m = t.v[0] > t.v[1] ? t.v[0] : t.v[1];
    return m > t.v[2] ? m : t.v[2];
}

static inline float fm_least(fm_vec3 t) {
    const float m = t.v[0] < t.v[1] ? t.v[0] : t.v[1];
    return m < t.v[2] ? m : t.v[2];
}

static inline fm_vec3 fm_enter_times(const fm_ray *ray, const fm_vec3 *cell) {
    fm_vec3 times;
    for (int i = 0; i < 3; i++) {
        times.v[i] = (cell->v[i] - ray->origin.v[i]) * ray->inverse.v[i];
    }
    return times;
}

static inline fm_vec3 fm_leave_times(const fm_ray *ray, const fm_vec3 *cell) {
    fm_vec3 times;
    for (int i = 0; i < 3; i++) {
        times.v[i] = ((cell->v[i] + 1.0f) - ray->origin.v[i]) * ray->inverse.v[i];
    }
    return times;
}

static inline uint64_t fm_element_at(const fm_grid *grid, const fm_cell *at) {
    return ((uint64_t)(uint32_t)at->v[2] * grid->axes[1] + (uint32_t)at->v[1]) * grid->axes[0] + (uint32_t)at->v[0];
}

static inline uint32_t fm_steps_at(const fm_grid *grid, const fm_cell *at) {
    const uint32_t distance = fm_host_distance(grid->world, fm_element_at(grid, at));
    return grid->format == FM_FIELD_SQUARED_U32 ? (uint32_t)ceilf(sqrtf((float)distance) * 0.999999f) : distance;
}

static inline float fm_length_at(const fm_grid *grid, const fm_cell *at) {
    const float distance = (float)fm_host_distance(grid->world, fm_element_at(grid, at));
    return grid->format == FM_FIELD_SQUARED_U32 ? sqrtf(distance) : distance;
}

// Distance of any cell: outside of the world the way to it is added.
static inline float fm_length_around(const fm_grid *grid, fm_cell at) {
    float gap = 0;
    for (int i = 0; i < 3; i++) {
        const int32_t last = (int32_t)grid->axes[i] - 1;
        const int32_t nearest = at.v[i] < 0 ? 0 : at.v[i] > last ? last : at.v[i];
        gap += fabsf((float)(at.v[i] - nearest));
        at.v[i] = nearest;
    }
    return fm_length_at(grid, &at) + gap;
}

static inline bool fm_is_solid(const fm_grid *grid, const fm_cell *at) {
    const uint64_t row = (uint64_t)(uint32_t)at->v[2] * grid->axes[1] + (uint32_t)at->v[1];
    return grid->bits[row * grid->row_words + ((uint32_t)at->v[0] >> 5)] >> (at->v[0] & 31) & 1;
}

static inline void fm_cross_next(fm_vec3 *cell, fm_vec3 leave) {
    const bool x = leave.v[0] <= leave.v[1] && leave.v[0] <= leave.v[2];
    const bool y = !x && leave.v[1] <= leave.v[2];
    cell->v[x ? 0 : y ? 1 : 2] += 1.0f;
}

// Rounded down, but for whole numbers, which may lose 1: the march asks whether the cell is on the path. Below 0: below 1.
static inline float fm_whole(float at) {
    const float moved = at + 8388607.5f;
    return moved - 8388608.0f;
}

static inline fm_vec3 fm_ahead_in_box(const fm_ray *ray, const fm_vec3 *cell, float steps) {
    const float reach = floorf((steps - 1.0f) * (1.0f / 3.0f) + 0.1f);
    const fm_vec3 last = {{cell->v[0] + reach, cell->v[1] + reach, cell->v[2] + reach}};
    const float time = fm_least(fm_leave_times(ray, &last));
    fm_vec3 ahead;
    for (int i = 0; i < 3; i++) {
        const float whole = fm_whole(ray->origin.v[i] + ray->way.v[i] * time);
        ahead.v[i] = whole < cell->v[i] ? cell->v[i] : whole > last.v[i] ? last.v[i] : whole;
    }
    return ahead;
}

static inline fm_vec3 fm_ahead_by_steps(const fm_ray *ray, const fm_vec3 *cell, float sum, float steps) {
    const float time = (sum + steps + ray->bias) * ray->per_step;
    fm_vec3 ahead;
    for (int i = 0; i < 3; i++) {
        const float whole = fm_whole(ray->origin.v[i] + ray->way.v[i] * time);
        ahead.v[i] = whole > cell->v[i] ? whole : cell->v[i];
    }
    return ahead;
}

static inline float fm_go_ahead(const fm_ray *ray, fm_vec3 *cell, float steps, fm_march how) {
    const float sum = cell->v[0] + cell->v[1] + cell->v[2];
    fm_vec3 ahead = how == FM_MARCH_BOX ? fm_ahead_in_box(ray, cell, steps) : fm_ahead_by_steps(ray, cell, sum, steps);
    const bool within = how == FM_MARCH_BOX || ahead.v[0] + ahead.v[1] + ahead.v[2] < sum + steps;
    fm_vec3 leave = fm_leave_times(ray, &ahead);
    if (!(within && fm_most(fm_enter_times(ray, &ahead)) < fm_least(leave))) {
        ahead = *cell;
        leave = fm_leave_times(ray, cell);
    }
    fm_cross_next(&ahead, leave);
    *cell = ahead;
    return fm_least(leave);
}

static inline bool fm_inside(const fm_ray *ray, const fm_vec3 *cell) {
    return cell->v[0] < ray->size.v[0] && cell->v[1] < ray->size.v[1] && cell->v[2] < ray->size.v[2];
}

static inline float fm_entry_time(const fm_ray *ray) {
    const float time = fm_most(fm_enter_times(ray, &(fm_vec3){{0, 0, 0}}));
    return time > 0 ? time : 0;
}

static inline fm_vec3 fm_cell_at(const fm_ray *ray, float time) {
    fm_vec3 cell;
    for (int i = 0; i < 3; i++) {
        const float whole = floorf(ray->origin.v[i] + ray->way.v[i] * time);
        cell.v[i] = whole > 0 ? whole : 0;
    }
    return cell;
}

static inline bool fm_march_ray(const fm_grid *grid, const fm_ray *ray, fm_vec3 *cell, fm_march how, uint32_t *reads) {
    while (fm_inside(ray, cell)) {
        (*reads)++;
        const fm_cell at = fm_unmirror(ray, cell);
        if (how == FM_MARCH_PLAIN) {
            if (fm_is_solid(grid, &at)) {
                return true;
            }
            fm_cross_next(cell, fm_leave_times(ray, cell));
        } else {
            const uint32_t steps = fm_steps_at(grid, &at);
            if (steps == 0) {
                return true;
            }
            fm_go_ahead(ray, cell, (float)steps, how);
        }
    }
    return false;
}

static inline int fm_face_of(const fm_ray *ray, const fm_vec3 *cell, float *time) {
    const fm_vec3 enter = fm_enter_times(ray, cell);
    *time = fm_most(enter) > 0 ? fm_most(enter) : 0;
    if (*time <= 0) {
        return 3;
    }
    return enter.v[2] >= enter.v[0] && enter.v[2] >= enter.v[1] ? 2 : enter.v[1] >= enter.v[0] ? 1 : 0;
}

static inline float fm_manhattan(const float v[3]) {
    return fabsf(v[0]) + fabsf(v[1]) + fabsf(v[2]);
}

// Manhattan steps that the field vouches for around any place: outside of the world the way to it is added.
static inline float fm_steps_around(const fm_grid *grid, const float at[3]) {
    fm_cell nearest;
    float gap = 0;
    for (int i = 0; i < 3; i++) {
        const float whole = floorf(at[i]), last = (float)(grid->axes[i] - 1);
        const float inside = whole < 0 ? 0 : whole > last ? last : whole;
        nearest.v[i] = (int32_t)inside;
        gap += fabsf(whole - inside);
    }
    return (float)fm_steps_at(grid, &nearest) + gap;
}

// march_beam.comp: the time up to which all rays of a tile meet nothing but air.
static inline float fm_beam_end(const fm_grid *grid, const fm_march_push *push, uint32_t tile_x, uint32_t tile_y, uint32_t *reads) {
    const float half = 0.5f * (FM_TILE - 1);
    float way[3], sums[3], differences[3], from_middle[3], size[3];
    fm_pixel_way(push, (float)(tile_x * FM_TILE) + half, (float)(tile_y * FM_TILE) + half, way);
    for (int i = 0; i < 3; i++) {
        size[i] = (float)grid->axes[i];
        sums[i] = push->right[i] + push->down[i];
        differences[i] = push->right[i] - push->down[i];
        from_middle[i] = push->origin[i] - 0.5f * size[i];
    }
    const float spread = half * fmaxf(fm_manhattan(sums), fm_manhattan(differences)) * 1.001f + 1e-6f;
    const float speed = fm_manhattan(way);
    const float far = (fm_manhattan(from_middle) + fm_manhattan(size)) / speed;
    float time = 0;
    for (int i = 0; i < FM_BEAM_READS && time < far; i++) {
        const float at[3] = {push->origin[0] + way[0] * time, push->origin[1] + way[1] * time, push->origin[2] + way[2] * time};
        (*reads)++;
        const float room = fm_steps_around(grid, at) - FM_BEAM_APART - spread * time;
        if (room < FM_BEAM_ROOM) {
            break;
        }
        time += room / (spread + speed);
    }
    return fminf(time, far);
}

// Where the tile's beam ends, unless rounding puts that beside the path.
static inline fm_vec3 fm_skip_ahead(const fm_ray *ray, fm_vec3 start, float time, float beam) {
    if (beam > time) {
        const fm_vec3 ahead = fm_cell_at(ray, beam);
        if (fm_most(fm_enter_times(ray, &ahead)) < fm_least(fm_leave_times(ray, &ahead))) {
            return ahead;
        }
    }
    return start;
}

#endif
