// SPDX-License-Identifier: MIT
#ifndef FM_RENDER_COMMON_H
#define FM_RENDER_COMMON_H

// A small world and pictures of it.

#include "fathom/render.h"
#include "vulkan_common.h"
#include "world_common.h"

#include <math.h>

typedef struct render_stage {
    fm_context *context;
    fm_world *world;
    fm_renderer *renderer;
    fm_shape shape;
    const uint32_t *voxels;
} render_stage;

static inline void render_close(render_stage *s) {
    fm_renderer_destroy(s->renderer);
    fm_world_destroy(s->world);
    *s = (render_stage){0};
}

static inline bool render_open(render_stage *s, fm_context *context, const fm_world_desc *desc, const uint32_t *voxels) {
    *s = (render_stage){.context = context, .shape = desc->shape, .voxels = voxels};
    const fm_box all = {{0, 0, 0}, {desc->shape.x, desc->shape.y, desc->shape.z}};
    return CHECK_OK(fm_world_create(context, desc, &s->world)) && CHECK_OK(fm_world_write(s->world, &all, voxels)) &&
           CHECK_OK(fm_world_update(s->world, NULL)) && CHECK_OK(fm_renderer_create(context, &s->renderer));
}

// Pixels in memory of the caller; NULL after a failure.
static inline uint8_t *render_picture(render_stage *s, const fm_render_desc *desc) {
    uint8_t *pixels = malloc(4 * (size_t)desc->width * desc->height);
    if (!CHECK(pixels != NULL) || !CHECK_OK(fm_render(s->renderer, s->world, desc, NULL)) ||
        !CHECK_OK(fm_renderer_read(s->renderer, pixels))) {
        free(pixels);
        return NULL;
    }
    return pixels;
}

static inline uint32_t render_voxel(const render_stage *s, int64_t x, int64_t y, int64_t z) {
    const bool in = x >= 0 && y >= 0 && z >= 0 && x < s->shape.x && y < s->shape.y && z < s->shape.z;
    return in ? s->voxels[x + s->shape.x * (y + (int64_t)s->shape.y * z)] : 0;
}

static inline double render_part(uint64_t *state) {
    return (double)(test_random(state) >> 11) * 0x1p-53;
}

#endif
