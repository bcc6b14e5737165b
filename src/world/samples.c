// SPDX-License-Identifier: MIT
// Distance and gradient at positions. shaders/sample.comp does the same in the same order.

#include "world/gpu_world.h"
#include "world/host_world.h"

#include <math.h>

typedef struct query_job {
    const fm_world *world;
    const float (*positions)[3];
    fm_world_sample *samples;
} query_job;

// What is known along x in one row: the distance and its slope.
typedef struct slope {
    float distance, slope;
} slope;

static float distance_at(const fm_world *world, uint32_t x, uint32_t y, uint32_t z) {
    const fm_shape shape = world->desc.shape;
    const float value = (float)fm_host_distance(world, x + shape.x * (y + shape.y * (uint64_t)z));
    return world->desc.format == FM_FIELD_SQUARED_U32 ? sqrtf(value) : value;
}

static float lerp(float a, float b, float part) {
    return a + (b - a) * part;
}

static fm_world_sample sample_at(const fm_world *world, const float position[3]) {
    const uint32_t size[3] = {world->desc.shape.x, world->desc.shape.y, world->desc.shape.z};
    uint32_t first[3], next[3];
    float part[3];
    for (int i = 0; i < 3; i++) {
        // Not a number counts as 0.
        const float last = (float)(size[i] - 1);
        const float clamped = position[i] > 0 ? (position[i] < last ? position[i] : last) : 0;
        const uint32_t before_last = size[i] > 1 ? size[i] - 2 : 0;
        first[i] = (uint32_t)clamped < before_last ? (uint32_t)clamped : before_last;
        next[i] = first[i] + 1 < size[i] ? first[i] + 1 : first[i];
        part[i] = clamped - (float)first[i];
    }
    slope along_x[4];
    for (uint32_t row = 0; row < 4; row++) {
        const uint32_t y = row & 1 ? next[1] : first[1];
        const uint32_t z = row < 2 ? first[2] : next[2];
        const float a = distance_at(world, first[0], y, z);
        const float b = distance_at(world, next[0], y, z);
        along_x[row] = (slope){lerp(a, b, part[0]), b - a};
    }
    slope along_y[2];
    for (int z = 0; z < 2; z++) {
        const slope *rows = &along_x[2 * z];
        along_y[z] = (slope){lerp(rows[0].distance, rows[1].distance, part[1]), lerp(rows[0].slope, rows[1].slope, part[1])};
    }
    const float slope_y = lerp(along_x[1].distance - along_x[0].distance, along_x[3].distance - along_x[2].distance, part[2]);
    return (fm_world_sample){
        lerp(along_y[0].distance, along_y[1].distance, part[2]),
        {lerp(along_y[0].slope, along_y[1].slope, part[2]), slope_y, along_y[1].distance - along_y[0].distance}};
}

static void run_query(void *user, uint64_t begin, uint64_t end, uint32_t worker) {
    const query_job *job = user;
    (void)worker;
    for (uint64_t i = begin; i < end; i++) {
        job->samples[i] = sample_at(job->world, job->positions[i]);
    }
}

fm_result fm_world_query(fm_world *world, const float (*positions)[3], uint32_t count, fm_world_sample *samples) {
    if (!world || (count > 0 && (!positions || !samples))) {
        return fm_fail(FM_ERROR_INVALID_ARGUMENT, "%s is NULL", !world ? "world" : positions ? "samples" : "positions");
    }
    if (count == 0) {
        return FM_OK;
    }
    if (world->gpu) {
        return fm_gpu_samples_query(world, positions, count, samples);
    }
    enum { GRAIN = 4096 };
    query_job job = {world, positions, samples};
    fm_passes_begin(world->context);
    fm_pool_run(world->context->pool, count, GRAIN, run_query, &job);
    fm_passes_end(world->context, "query", count * (uint64_t)(sizeof *positions + sizeof *samples));
    return FM_OK;
}
