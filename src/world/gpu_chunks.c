// SPDX-License-Identifier: MIT
#include "world/gpu_world.h"

fm_result fm_gpu_chunks_update(fm_world *world, const fm_world_job *job, fm_slot **slot) {
    (void)world, (void)job, (void)slot;
    return fm_fail(FM_ERROR_UNSUPPORTED, "chunked methods are not on Vulkan yet");
}

void fm_gpu_chunks_stats(fm_world *world, fm_world_stats *stats) {
    (void)world, (void)stats;
}

void fm_gpu_chunks_destroy(fm_world *world) {
    (void)world;
}
