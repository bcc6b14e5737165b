// SPDX-License-Identifier: MIT
#ifndef FM_VULKAN_COMMON_H
#define FM_VULKAN_COMMON_H

#include "check.h"

#include <stdlib.h>
#include <string.h>

// How a test ends that found no driver or no validation layer: a failure where continuous integration promises both, a skip
// elsewhere.
static inline int vulkan_missing(void) {
    const char *ci = getenv("CI");
    if (ci && strcmp(ci, "true") == 0) {
        fprintf(stderr, "failed: CI is true, yet there is nothing to test on: %s\n", fm_last_error());
        return 1;
    }
    return check_skip(fm_last_error());
}

// What the command line of a Vulkan test says.
typedef struct vulkan_options {
    const char *device;
    bool no_validation;
} vulkan_options;

static inline bool vulkan_parse(int count, char **arguments, vulkan_options *options) {
    *options = (vulkan_options){0};
    for (int i = 1; i < count; i++) {
        if (strcmp(arguments[i], "--no-validation") == 0) {
            options->no_validation = true;
        } else if (strcmp(arguments[i], "--device") == 0 && i + 1 < count) {
            options->device = arguments[++i];
        } else if (strcmp(arguments[i], "--backend") == 0 && i + 1 < count && strcmp(arguments[i + 1], "vulkan") == 0) {
            i++;
        } else {
            fprintf(stderr, "usage: %s [--backend vulkan] [--device NAME] [--no-validation]\n", arguments[0]);
            return false;
        }
    }
    return true;
}

static inline void vulkan_log(void *user, fm_log_level level, const char *message) {
    (void)user;
    if (level >= FM_LOG_WARNING) {
        fprintf(stderr, "log: %s\n", message);
    }
}

static inline fm_result vulkan_open(const vulkan_options *options, const fm_allocator *allocator, fm_context **context) {
    const fm_context_desc desc = {.backend = FM_BACKEND_VULKAN,
                                  .device = options->device,
                                  .threads = 1,
                                  .validation = !options->no_validation,
                                  .allocator = allocator,
                                  .log = vulkan_log};
    return fm_context_create(&desc, context);
}

// The context of a test that runs on either backend: on Vulkan where its command line says anything. False: the test ends with
// `*status`.
static inline bool vulkan_or_cpu(int count, char **arguments, fm_context **context, int *status) {
    vulkan_options options;
    if (!vulkan_parse(count, arguments, &options)) {
        *status = 2;
        return false;
    }
    const fm_context_desc desc = {.backend = FM_BACKEND_CPU, .threads = 2};
    if (count > 1 && vulkan_open(&options, NULL, context) != FM_OK) {
        *status = vulkan_missing();
        return false;
    }
    if (count == 1 && !CHECK_OK(fm_context_create(&desc, context))) {
        *status = check_summary();
        return false;
    }
    return true;
}

static inline void vulkan_close(fm_context *context) {
    CHECK(!context || fm_context_validation_messages(context) == 0);
    fm_context_destroy(context);
}

static inline fm_volume *vulkan_volume(fm_context *context, fm_shape shape, fm_type type) {
    const fm_volume_desc desc = {.shape = shape, .type = type};
    fm_volume *volume = NULL;
    CHECK_OK(fm_volume_create(context, &desc, &volume));
    return volume;
}

// A volume of bytes that is empty but for one voxel.
static inline fm_volume *vulkan_one_voxel(fm_context *context, fm_shape shape, uint64_t voxel) {
    const uint64_t voxels = (uint64_t)shape.x * shape.y * shape.z;
    uint8_t *solid = calloc(voxels, 1);
    fm_volume *volume = vulkan_volume(context, shape, FM_TYPE_U8);
    if (CHECK(solid != NULL) && volume) {
        solid[voxel] = 1;
        CHECK_OK(fm_volume_upload(volume, solid));
    }
    free(solid);
    return volume;
}

// Number of voxels at which 32-bit L1 distances to one voxel are wrong.
static inline uint64_t vulkan_wrong_l1(const uint32_t *distance, fm_shape shape, uint64_t voxel) {
    uint64_t wrong = 0;
    const int64_t at[3] = {(int64_t)(voxel % shape.x), (int64_t)(voxel / shape.x % shape.y), (int64_t)(voxel / shape.x / shape.y)};
    for (int64_t z = 0, i = 0; z < shape.z; z++) {
        for (int64_t y = 0; y < shape.y; y++) {
            for (int64_t x = 0; x < shape.x; x++, i++) {
                wrong += distance[i] != (uint64_t)(llabs(x - at[0]) + llabs(y - at[1]) + llabs(z - at[2]));
            }
        }
    }
    return wrong;
}

#endif
