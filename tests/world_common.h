// SPDX-License-Identifier: MIT
#ifndef FM_WORLD_COMMON_H
#define FM_WORLD_COMMON_H

// A world beside a model of it that is kept in the plainest way, and random edits of both.

#include "check.h"
#include "fathom/world.h"
#include "random.h"

#include <stdlib.h>
#include <string.h>

__extension__ typedef __int128 world_wide;

static inline world_wide world_square(world_wide a) {
    return a * a;
}

// Whether a brush covers a voxel, by its public definition, in integers that cannot overflow.
static inline bool world_covers(const fm_brush *brush, const int32_t at[3]) {
    const world_wide radius = brush->radius > 1u << 30 ? 1u << 30 : brush->radius;
    world_wide from2 = 0, to2 = 0, along = 0, length2 = 0;
    bool between = true;
    for (int i = 0; i < 3; i++) {
        const int32_t a = brush->from[i], b = brush->to[i];
        between = between && at[i] >= (a < b ? a : b) && at[i] <= (a < b ? b : a);
        from2 += world_square((world_wide)at[i] - a);
        to2 += world_square((world_wide)at[i] - b);
        along += ((world_wide)at[i] - a) * ((world_wide)b - a);
        length2 += world_square((world_wide)b - a);
    }
    if (brush->kind == FM_BRUSH_BOX) {
        return between;
    }
    if (brush->kind == FM_BRUSH_SPHERE || along <= 0 || along >= length2) {
        return (brush->kind == FM_BRUSH_SPHERE || along <= 0 ? from2 : to2) <= world_square(radius);
    }
    return from2 * length2 - world_square(along) <= world_square(radius) * length2;
}

// Where the brush's voxels can be: its box, cut to the world.
static inline void world_brush_box(const fm_brush *brush, fm_shape shape, int32_t begin[3], int32_t end[3]) {
    const int64_t size[3] = {shape.x, shape.y, shape.z};
    const int64_t reach = brush->kind == FM_BRUSH_BOX ? 0 : brush->radius;
    for (int i = 0; i < 3; i++) {
        const int32_t from = brush->from[i], to = brush->kind == FM_BRUSH_SPHERE ? from : brush->to[i];
        const int64_t low = (from < to ? from : to) - reach, high = (from < to ? to : from) + reach + 1;
        begin[i] = (int32_t)(low < 0 ? 0 : low < size[i] ? low : size[i]);
        end[i] = (int32_t)(high < 0 ? 0 : high < size[i] ? high : size[i]);
    }
}

// Carries out an edit in an array of voxels.
static inline void world_brush_edit(const fm_brush *brush, fm_shape shape, uint32_t *voxels) {
    int32_t at[3], begin[3], end[3];
    world_brush_box(brush, shape, begin, end);
    for (at[2] = begin[2]; at[2] < end[2]; at[2]++) {
        for (at[1] = begin[1]; at[1] < end[1]; at[1]++) {
            uint32_t *row = voxels + ((uint64_t)at[2] * shape.y + (uint64_t)at[1]) * shape.x;
            for (at[0] = begin[0]; at[0] < end[0]; at[0]++) {
                row[at[0]] = world_covers(brush, at) ? brush->voxel : row[at[0]];
            }
        }
    }
}

// The world and its model.
typedef struct world_pair {
    fm_context *context;
    fm_context *reference;  // CPU: computes what the field should be
    fm_world *world;
    fm_world_desc desc;
    uint32_t *voxels;
} world_pair;

static inline uint64_t world_voxels(const world_pair *pair) {
    return (uint64_t)pair->desc.shape.x * pair->desc.shape.y * pair->desc.shape.z;
}

static inline bool world_pair_make(world_pair *pair, fm_context *context, fm_context *reference, const fm_world_desc *desc) {
    *pair = (world_pair){.context = context, .reference = reference, .desc = *desc};
    if (!CHECK_OK(fm_world_create(context, desc, &pair->world))) {
        return false;
    }
    pair->voxels = calloc(world_voxels(pair), sizeof *pair->voxels);
    return CHECK(pair->voxels != NULL);
}

static inline void world_pair_free(world_pair *pair) {
    fm_world_destroy(pair->world);
    free(pair->voxels);
}

static inline void world_both_edit(world_pair *pair, const fm_brush *brushes, uint32_t count) {
    CHECK_OK(fm_world_edit(pair->world, brushes, count));
    for (uint32_t i = 0; i < count; i++) {
        world_brush_edit(&brushes[i], pair->desc.shape, pair->voxels);
    }
}

// A brush somewhere in or around the world, placing or deleting.
static inline fm_brush world_random_brush(uint64_t *state, fm_shape shape, uint32_t max_radius) {
    const int32_t size[3] = {(int32_t)shape.x, (int32_t)shape.y, (int32_t)shape.z};
    fm_brush brush = {.kind = (fm_brush_kind)test_between(state, 0, 2)};
    brush.voxel = test_between(state, 0, 1) ? (uint32_t)test_random(state) | 1 : 0;
    // Solid voxels of colour 0 are solid.
    brush.voxel = brush.voxel && test_between(state, 0, 9) == 0 ? 0x100 : brush.voxel;
    for (int i = 0; i < 3; i++) {
        int32_t margin = test_between(state, 0, 7) == 0 ? (int32_t)max_radius + 3 : 0;
        brush.from[i] = test_between(state, -margin, size[i] - 1 + margin);
        brush.to[i] = test_between(state, -margin, size[i] - 1 + margin);
        if (brush.kind == FM_BRUSH_BOX || test_between(state, 0, 2)) {
            brush.to[i] = brush.from[i] + test_between(state, -(int32_t)max_radius, (int32_t)max_radius);
        }
    }
    brush.radius = (uint32_t)test_between(state, 0, (int32_t)max_radius);
    return brush;
}

// The distances that the field should hold; memory of the caller.
static inline fm_array world_expected(const world_pair *pair) {
    const fm_shape shape = pair->desc.shape;
    uint8_t *solid = malloc(world_voxels(pair));
    uint32_t *distance = malloc(world_voxels(pair) * sizeof *distance);
    for (uint64_t i = 0; i < world_voxels(pair); i++) {
        solid[i] = pair->voxels[i] != 0;
    }
    const fm_array in = {solid, FM_TYPE_U8, shape};
    const fm_array out = {distance, FM_TYPE_U32, shape};
    bool squared = pair->desc.format == FM_FIELD_SQUARED_U32;
    const fm_transform_desc desc = {
        .metric = squared ? FM_METRIC_L2 : FM_METRIC_L1, .squared = squared, .max_distance = pair->desc.max_distance};
    CHECK_OK(fm_transform_host(pair->reference, &desc, &in, &out, NULL));
    free(solid);
    uint32_t greatest = pair->desc.format == FM_FIELD_SPLIT_U16 ? UINT16_MAX : squared ? UINT32_MAX : UINT8_MAX;
    for (uint64_t i = 0; i < world_voxels(pair); i++) {
        distance[i] = distance[i] > greatest ? greatest : distance[i];
    }
    return out;
}

// Compares voxels, colours and distances with the model's; true when all are equal.
static inline bool world_compare(world_pair *pair) {
    const fm_shape shape = pair->desc.shape;
    const uint64_t voxels = world_voxels(pair);
    fm_array expected = world_expected(pair);
    const uint32_t *wanted = expected.data;
    uint32_t *distance = malloc(voxels * sizeof *distance);
    uint32_t *values = malloc(voxels * sizeof *values);
    uint8_t *colors = malloc(voxels);
    const fm_array distance_array = {distance, FM_TYPE_U32, shape};
    const fm_array color_array = {colors, FM_TYPE_U8, shape};
    const fm_box all = {{0, 0, 0}, {shape.x, shape.y, shape.z}};
    bool good = CHECK_OK(fm_world_read_field(pair->world, NULL, &distance_array, &color_array)) &&
                CHECK_OK(fm_world_read(pair->world, &all, values));
    uint64_t wrong = 0;
    for (uint64_t i = 0; good && i < voxels; i++) {
        bool same = distance[i] == wanted[i] && values[i] == pair->voxels[i] && colors[i] == (pair->voxels[i] & 0xff);
        if (!same && wrong++ == 0) {
            fprintf(stderr, "voxel %u,%u,%u: distance %u where %u is right; value %x where %x is right; colour %x\n",
                    (unsigned)(i % shape.x), (unsigned)(i / shape.x % shape.y), (unsigned)(i / shape.x / shape.y), distance[i],
                    wanted[i], values[i], pair->voxels[i], colors[i]);
        }
    }
    good = good && CHECK(wrong == 0);
    if (wrong) {
        fprintf(stderr, "    %llu of %llu voxels are wrong\n", (unsigned long long)wrong, (unsigned long long)voxels);
    }
    free(expected.data);
    free(distance);
    free(values);
    free(colors);
    return good;
}

#endif
