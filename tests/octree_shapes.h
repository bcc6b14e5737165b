// SPDX-License-Identifier: MIT
#ifndef FM_OCTREE_SHAPES_H
#define FM_OCTREE_SHAPES_H

// Small octrees of shapes whose closest points are known, made without the library's builders, and what rays truly meet.

#include "octree/octree.h"
#include "random.h"
#include "shaders/include/vcp_rule.h"
#include "vulkan_common.h"

#include <math.h>

// The vector from a place to the closest point; below 0 in `*sign` where the place is inside.
typedef void (*shape_fn)(const double p[3], double v[3], double *sign);

typedef struct shape {
    const char *name;
    shape_fn closest;
    bool closed;
} shape;

static inline double shape_length(const double v[3]) {
    return sqrt(v[0] * v[0] + v[1] * v[1] + v[2] * v[2]);
}

static inline void shape_sphere(const double p[3], double v[3], double *sign) {
    const double length = shape_length(p), scale = (0.62 - length) / fmax(length, 1e-12);
    for (int i = 0; i < 3; i++) {
        v[i] = (length > 0 ? p[i] : i == 0 ? 1e-12 : 0) * scale;
    }
    *sign = length < 0.62 ? -1 : 1;
}

static inline void shape_torus(const double p[3], double v[3], double *sign) {
    const double around = fmax(hypot(p[0], p[1]), 1e-12);
    const double middle[3] = {p[0] / around * 0.5, p[1] / around * 0.5, 0};
    const double off[3] = {p[0] - middle[0], p[1] - middle[1], p[2]};
    const double length = fmax(shape_length(off), 1e-12);
    for (int i = 0; i < 3; i++) {
        v[i] = off[i] * (0.21 - length) / length;
    }
    *sign = length < 0.21 ? -1 : 1;
}

// Its faces lie on boundaries between cells.
static inline void shape_box(const double p[3], double v[3], double *sign) {
    double outside = 0, near = INFINITY;
    int axis = 0;
    for (int i = 0; i < 3; i++) {
        const double over = fabs(p[i]) - 0.5;
        v[i] = over > 0 ? (p[i] > 0 ? -over : over) : 0;
        outside = fmax(outside, over);
        if (-over < near) {
            near = -over;
            axis = i;
        }
    }
    *sign = outside > 0 ? 1 : -1;
    if (outside <= 0) {
        v[axis] = p[axis] > 0 ? near : -near;
    }
}

// Two parallel squares, 2.6 cells of 1 / 32 apart, with edges: open.
static inline void shape_sheets(const double p[3], double v[3], double *sign) {
    for (int i = 0; i < 2; i++) {
        v[i] = fabs(p[i]) > 0.6 ? copysign(0.6, p[i]) - p[i] : 0;
    }
    v[2] = (p[2] > 0 ? 0.04 : -0.04) - p[2];
    *sign = 1;
}

// A capsule askew, 1.3 cells of 1 / 32 in radius.
static inline void shape_rod(const double p[3], double v[3], double *sign) {
    static const double from[3] = {-0.6, -0.5, -0.4}, way[3] = {1.1, 1.05, 0.9};
    double along = 0, square = 0;
    for (int i = 0; i < 3; i++) {
        along += (p[i] - from[i]) * way[i];
        square += way[i] * way[i];
    }
    along = fmin(fmax(along / square, 0), 1);
    double off[3];
    for (int i = 0; i < 3; i++) {
        off[i] = p[i] - from[i] - along * way[i];
    }
    const double length = fmax(shape_length(off), 1e-12);
    for (int i = 0; i < 3; i++) {
        v[i] = off[i] * (0.04 - length) / length;
    }
    *sign = length < 0.04 ? -1 : 1;
}

static const shape shapes[] = {{"sphere", shape_sphere, true},
                               {"torus", shape_torus, true},
                               {"box", shape_box, true},
                               {"sheets", shape_sheets, false},
                               {"rod", shape_rod, true}};
enum { SHAPES = sizeof shapes / sizeof *shapes };

static inline double shape_distance(const shape *s, const double p[3]) {
    double v[3], sign;
    s->closest(p, v, &sign);
    return shape_length(v);
}

// ---------------------------------------------------------------------------------------------------------------------------
// Octrees
// ---------------------------------------------------------------------------------------------------------------------------

typedef struct shape_build {
    fm_octree *octree;
    const shape *shape;
    uint32_t next_leaf;
    // Leaves of level 1 where the finer vectors are this near to what its own give, in cells; below 0: nowhere.
    double merge;
    bool good;
} shape_build;

static inline void shape_place(const shape_build *b, const uint32_t cell[3], double step, int corner, double p[3]) {
    for (int i = 0; i < 3; i++) {
        p[i] = b->octree->info.origin[i] + b->octree->info.cell * (cell[i] + step * (corner >> i & 1));
    }
}

static inline uint32_t shape_float_bits(float value) {
    uint32_t bits;
    memcpy(&bits, &value, sizeof bits);
    return bits;
}

static inline int32_t shape_leaf(shape_build *b, const uint32_t cell[3], uint32_t level) {
    fm_octree *o = b->octree;
    const uint32_t leaf = b->next_leaf;
    b->next_leaf += 2;
    if (!fm_octree_reserve(o, &o->values, 8) ||
        (o->desc.attribute != FM_OCTREE_PLAIN && !fm_octree_reserve(o, &o->attributes, 8))) {
        b->good = false;
        return -1;
    }
    const float unit = FM_OCTREE_REACH * (float)o->info.cell * (float)(1u << level);
    for (int i = 0; i < 8; i++) {
        double p[3], v[3], sign;
        shape_place(b, cell, (double)(1u << level), i, p);
        b->shape->closest(p, v, &sign);
        const fm_v3 vector = {(float)v[0], (float)v[1], (float)v[2]};
        const uint64_t at = leaf * 4 + (uint64_t)(4 * (i & 1) + (i >> 1));
        uint32_t *word = (uint32_t *)o->values.data + at;
        if (o->info.kind == FM_OCTREE_DISTANCE) {
            *word = shape_float_bits((float)(shape_length(v) * (o->info.sign == FM_SIGN_NONE ? 1 : sign)));
        } else if (o->info.code == FM_OCTREE_FLOATS) {
            memcpy((float *)o->values.data + 3 * at, &vector, sizeof vector);
        } else {
            *word = fm_vcp_encode(vector, (int32_t)o->info.code, unit);
        }
        if (o->desc.attribute != FM_OCTREE_PLAIN) {
            ((uint32_t *)o->attributes.data)[at] = p[0] + v[0] > 0 ? 0xff0000ffu : 0xffff0000u;
        }
    }
    o->values.count += 8;
    o->attributes.count += o->desc.attribute != FM_OCTREE_PLAIN ? 8 : 0;
    o->info.leaves[level]++;
    return -(int32_t)(leaf + 1);
}

static inline bool shape_mergeable(const shape_build *b, const uint32_t cell[3]) {
    double corners[8][3], sign;
    for (int i = 0; i < 8; i++) {
        double p[3];
        shape_place(b, cell, 2, i, p);
        b->shape->closest(p, corners[i], &sign);
    }
    for (int i = 0; i < 27; i++) {
        const int at[3] = {i % 3, i / 3 % 3, i / 9};
        const uint32_t fine[3] = {cell[0] + (uint32_t)at[0], cell[1] + (uint32_t)at[1], cell[2] + (uint32_t)at[2]};
        double p[3], v[3], off[3];
        shape_place(b, fine, 0, 0, p);
        b->shape->closest(p, v, &sign);
        for (int k = 0; k < 3; k++) {
            off[k] = v[k];
            for (int c = 0; c < 8; c++) {
                const double x = (c & 1) ? at[0] : 2 - at[0], y = (c >> 1 & 1) ? at[1] : 2 - at[1], z = c >> 2 ? at[2] : 2 - at[2];
                off[k] -= corners[c][k] * x * y * z / 8;
            }
        }
        if (shape_length(off) > b->merge * b->octree->info.cell) {
            return false;
        }
    }
    return true;
}

static inline int32_t shape_node(shape_build *b, const uint32_t cell[3], uint32_t level) {
    fm_octree *o = b->octree;
    const double cells = (double)(1u << level), unit = o->info.cell, half = 0.5 * sqrt(3) * cells * unit;
    double middle[3];
    for (int i = 0; i < 3; i++) {
        middle[i] = o->info.origin[i] + unit * (cell[i] + 0.5 * cells);
    }
    const double least = shape_distance(b->shape, middle) - half;
    if (least > 2 * sqrt(3) * unit) {
        o->info.empty++;
        return (int32_t)fm_octree_empty_word(least, (double)o->head.cutoff);
    }
    if (level == 0 || (level == 1 && shape_mergeable(b, cell))) {
        return shape_leaf(b, cell, level);
    }
    const uint64_t first = o->words.count;
    if (!fm_octree_reserve(o, &o->words, 8)) {
        b->good = false;
        return FM_NODE_EMPTY;
    }
    o->words.count += 8;
    o->info.internal++;
    for (uint32_t i = 0; i < 8; i++) {
        const uint32_t half_cells = 1u << (level - 1);
        const uint32_t child[3] = {cell[0] + (i & 1) * half_cells, cell[1] + (i >> 1 & 1) * half_cells,
                                   cell[2] + (i >> 2) * half_cells};
        const int32_t word = shape_node(b, child, level - 1);
        ((int32_t *)o->words.data)[first + i] = word;
    }
    return (int32_t)first;
}

// Of the box from -1 to 1.
static inline fm_octree *shape_octree(fm_context *context, const shape *s, const fm_octree_desc *desc, double merge) {
    static const double low[3] = {-1, -1, -1}, high[3] = {1, 1, 1};
    fm_octree_desc filled;
    shape_build b = {.shape = s, .merge = merge, .good = true};
    if (!CHECK_OK(fm_octree_check_desc(desc, &filled)) || !CHECK_OK(fm_octree_new(context, &filled, low, high, &b.octree))) {
        return NULL;
    }
    const fm_octree_info *info = &b.octree->info;
    const uint64_t top = (uint64_t)info->top[0] * info->top[1] * info->top[2];
    if (!CHECK(fm_octree_reserve(b.octree, &b.octree->words, top))) {
        fm_octree_destroy(b.octree);
        return NULL;
    }
    b.octree->words.count = top;
    for (uint64_t i = 0; i < top; i++) {
        const uint32_t cell[3] = {(uint32_t)(i % info->top[0]) << info->levels,
                                  (uint32_t)(i / info->top[0] % info->top[1]) << info->levels,
                                  (uint32_t)(i / info->top[0] / info->top[1]) << info->levels};
        const int32_t word = shape_node(&b, cell, info->levels);
        ((int32_t *)b.octree->words.data)[i] = word;
    }
    CHECK(b.good);
    fm_octree_counted(b.octree);
    return b.octree;
}

// ---------------------------------------------------------------------------------------------------------------------------
// Rays
// ---------------------------------------------------------------------------------------------------------------------------

// What a ray meets by the shape's true distances, and how near it comes to the surface where it meets nothing.
typedef struct shape_truth {
    double t, nearest;
} shape_truth;

static inline shape_truth shape_trace(const shape *s, const fm_mesh_ray *ray) {
    shape_truth truth = {INFINITY, INFINITY};
    double way[3], t = (double)ray->first;
    for (int i = 0; i < 3; i++) {
        way[i] = (double)ray->direction[i];
    }
    const double length = shape_length(way);
    for (int step = 0; step < 100000 && t <= (double)ray->last; step++) {
        double p[3];
        for (int i = 0; i < 3; i++) {
            p[i] = (double)ray->origin[i] + way[i] * t;
        }
        const double distance = shape_distance(s, p);
        truth.nearest = fmin(truth.nearest, distance);
        if (distance < 1e-7) {
            truth.t = t;
            break;
        }
        t += distance / length;
        if (t * length > 20) {
            break;
        }
    }
    return truth;
}

static inline float shape_random(uint64_t *state, float low, float high) {
    return low + (high - low) * (float)(test_random(state) >> 40) / (float)(1 << 24);
}

#endif
