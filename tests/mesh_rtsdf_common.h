// SPDX-License-Identifier: MIT
#ifndef FM_MESH_RTSDF_COMMON_H
#define FM_MESH_RTSDF_COMMON_H

// RTSDF under test: on the processor, and on Vulkan where there is a driver.

#include "fathom/sdf.h"
#include "meshes.h"
#include "vulkan_common.h"

#include <math.h>

static inline fm_mesh *rtsdf_mesh(fm_context *context, const scene_mesh *shape) {
    const fm_mesh_desc desc = scene_mesh_describe(shape);
    fm_mesh *mesh = NULL;
    CHECK_OK(fm_mesh_create(context, &desc, &mesh));
    return mesh;
}

static inline uint64_t rtsdf_texels(const fm_volume *volume) {
    fm_volume_desc desc;
    fm_volume_info(volume, &desc);
    return (uint64_t)desc.shape.x * desc.shape.y * desc.shape.z;
}

// The coarse or the fine field; memory from malloc.
static inline float *rtsdf_field(fm_rtsdf *rtsdf, bool fine) {
    fm_volume *volume = NULL;
    fm_rtsdf_fields(rtsdf, fine ? NULL : &volume, fine ? &volume : NULL);
    float *values = malloc(rtsdf_texels(volume) * sizeof *values);
    CHECK_OK(fm_volume_download(volume, values));
    return values;
}

// The place of a texel.
static inline void rtsdf_place(fm_rtsdf *rtsdf, bool fine, uint64_t texel, double place[3]) {
    fm_volume *volume = NULL;
    fm_volume_desc desc;
    fm_rtsdf_fields(rtsdf, fine ? NULL : &volume, fine ? &volume : NULL);
    fm_volume_info(volume, &desc);
    const uint64_t at[3] = {texel % desc.shape.x, texel / desc.shape.x % desc.shape.y, texel / desc.shape.x / desc.shape.y};
    for (int i = 0; i < 3; i++) {
        place[i] = desc.origin[i] + (double)at[i] * desc.spacing[i];
    }
}

typedef void (*rtsdf_test)(fm_context *context);

// Runs the test on each backend that there is.
static inline int rtsdf_main(int count, char **arguments, rtsdf_test test) {
    vulkan_options options;
    if (!vulkan_parse(count, arguments, &options)) {
        return 2;
    }
    const fm_context_desc on_host = {.backend = FM_BACKEND_CPU, .threads = 2};
    fm_context *context = NULL;
    if (CHECK_OK(fm_context_create(&on_host, &context))) {
        test(context);
        fm_context_destroy(context);
    }
    if (vulkan_open(&options, NULL, &context) == FM_OK) {
        test(context);
        vulkan_close(context);
    } else {
        printf("not on Vulkan: %s\n", fm_last_error());
    }
    return check_summary();
}

#endif
