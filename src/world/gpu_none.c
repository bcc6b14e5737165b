// SPDX-License-Identifier: MIT
#include "world/world.h"

#include "world/gpu_world.h"

fm_result fm_gpu_samples_query(fm_world *world, const float (*positions)[3], uint32_t count, fm_world_sample *samples) {
    (void)world, (void)positions, (void)count, (void)samples;
    return fm_fail(FM_ERROR_UNSUPPORTED, "this build of Fathom has no Vulkan backend (FATHOM_VULKAN=OFF)");
}
