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

typedef struct render_options {
    vulkan_options vulkan;
    uint32_t size;  // edge of the world that is tested, or 0: small ones of the test's own
} render_options;

// Takes "--size N" out of the arguments; false when it is not what it should be.
static inline bool render_parse(int *count, char **arguments, render_options *options) {
    *options = (render_options){.size = 0};
    int kept = 1;
    bool good = true;
    for (int i = 1; i < *count; i++) {
        if (strcmp(arguments[i], "--size") != 0) {
            arguments[kept++] = arguments[i];
            continue;
        }
        options->size = i + 1 < *count ? (uint32_t)strtoul(arguments[++i], NULL, 10) : 0;
        good = options->size >= 16 && options->size <= 16384;
    }
    *count = kept;
    if (!good) {
        fprintf(stderr, "usage: %s [--size 16...16384] ...\n", arguments[0]);
    }
    return good && vulkan_parse(kept, arguments, &options->vulkan);
}

// Runs a test on the backend that the command line names; `cpu` is the same context without one.
static inline int render_main(int count, char **arguments,
                              void (*test)(fm_context *context, fm_context *cpu, const render_options *options)) {
    render_options options;
    if (!render_parse(&count, arguments, &options)) {
        return 1;
    }
    fm_context *cpu, *context;
    if (!CHECK_OK(fm_context_create(&(fm_context_desc){.backend = FM_BACKEND_CPU}, &cpu))) {
        return check_summary();
    }
    context = cpu;
    if (count > 1 && vulkan_open(&options.vulkan, NULL, &context) != FM_OK) {
        fm_context_destroy(cpu);
        return vulkan_missing();
    }
    test(context, cpu, &options);
    if (context != cpu) {
        vulkan_close(context);
    }
    fm_context_destroy(cpu);
    return check_summary();
}

static inline double render_part(uint64_t *state) {
    return (double)(test_random(state) >> 11) * 0x1p-53;
}

#endif
