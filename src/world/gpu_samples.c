// SPDX-License-Identifier: MIT
// fm_world_query on Vulkan: one dispatch. The buffers of positions and samples grow with the longest query and stay.

#include "world/gpu_world.h"

#include <string.h>

struct fm_gpu_samples {
    fm_allocator allocator;
    fm_buffer *positions, *samples;
    uint32_t capacity;
};

void fm_gpu_samples_destroy(struct fm_gpu_samples *own) {
    if (own) {
        fm_buffer_destroy(own->positions);
        fm_buffer_destroy(own->samples);
        fm_allocator allocator = own->allocator;
        fm_free(&allocator, own, sizeof *own);
    }
}

static fm_result make_room(fm_world *world, uint32_t count) {
    enum { FEWEST = 1024 };
    struct fm_gpu_samples *own = world->gpu->samples;
    if (own && own->capacity >= count) {
        return FM_OK;
    }
    // Every query waits: no work uses the old ones.
    fm_gpu_samples_destroy(own);
    world->gpu->samples = NULL;
    own = fm_alloc_zero(&world->context->allocator, sizeof *own, "a world's queries");
    if (!own) {
        return FM_ERROR_OUT_OF_HOST_MEMORY;
    }
    own->allocator = world->context->allocator;
    own->capacity = count > FEWEST ? count : FEWEST;
    fm_gpu *gpu = world->gpu->gpu;
    fm_result result = fm_buffer_create(gpu, FM_PURPOSE_UPLOAD, own->capacity * sizeof(float[3]), false, &own->positions);
    if (result == FM_OK) {
        result = fm_buffer_create(gpu, FM_PURPOSE_READBACK, own->capacity * sizeof(fm_world_sample), false, &own->samples);
    }
    if (result != FM_OK) {
        fm_gpu_samples_destroy(own);
        return result;
    }
    world->gpu->samples = own;
    return FM_OK;
}

fm_result fm_gpu_samples_query(fm_world *world, const float (*positions)[3], uint32_t count, fm_world_sample *samples) {
    enum { THREADS = 64 };
    FM_TRY(make_room(world, count));
    const struct fm_gpu_samples *own = world->gpu->samples;
    const fm_shape shape = world->desc.shape;
    const uint64_t bytes = count * (uint64_t)sizeof *samples;
    memcpy(fm_buffer_mapped(own->positions), positions, count * sizeof *positions);
    const uint32_t constants[] = {(uint32_t)world->desc.format};
    const fm_sample_push push = {.field = fm_buffer_address(world->gpu->field),
                                 .positions = fm_buffer_address(own->positions),
                                 .samples = fm_buffer_address(own->samples),
                                 .count = count,
                                 .x = shape.x,
                                 .y = shape.y,
                                 .z = shape.z};
    const fm_dispatch dispatch = {.kernel = FM_KERNEL_SAMPLE,
                                  .constants = constants,
                                  .constant_count = 1,
                                  .push = &push,
                                  .push_bytes = sizeof push,
                                  .groups = fm_div_up(count, THREADS)};
    fm_gpu *gpu = world->gpu->gpu;
    fm_slot *slot;
    FM_TRY(fm_commands_begin(gpu, &slot));
    FM_TRY(fm_commands_dispatch(gpu, slot, &dispatch));
    fm_commands_pass(gpu, slot, "query", count * sizeof *positions + bytes);
    FM_TRY(fm_commands_submit(gpu, slot, NULL));
    memcpy(samples, fm_buffer_mapped(own->samples), bytes);
    return FM_OK;
}
