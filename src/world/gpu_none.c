// SPDX-License-Identifier: MIT
// Worlds on the device of a build without Vulkan: calls that need one cannot be reached, for no fm_gpu exists.

#include "world/gpu_world.h"

static fm_result unsupported(void) {
    return fm_fail(FM_ERROR_UNSUPPORTED, "this build of Fathom has no Vulkan backend (FATHOM_VULKAN=OFF)");
}

fm_result fm_gpu_world_create(fm_world *world) {
    (void)world;
    return unsupported();
}

void fm_gpu_world_destroy(fm_world *world) {
    (void)world;
}

fm_result fm_gpu_world_prepare(fm_world *world) {
    (void)world;
    return unsupported();
}

fm_result fm_gpu_world_update(fm_world *world, const fm_world_job *job) {
    (void)world, (void)job;
    return unsupported();
}

fm_result fm_gpu_world_stats(fm_world *world) {
    (void)world;
    return unsupported();
}

fm_result fm_gpu_samples_query(fm_world *world, const float (*positions)[3], uint32_t count, fm_world_sample *samples) {
    (void)world, (void)positions, (void)count, (void)samples;
    return unsupported();
}
