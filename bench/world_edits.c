// SPDX-License-Identifier: MIT
#include "noise.h"
#include "world.h"

typedef struct stream {
    uint64_t key, drawn;
} stream;

static uint32_t below(stream *random, uint32_t limit) {
    return (uint32_t)((fm_mix(random->key + random->drawn++ * 0x9e3779b97f4a7c15u) >> 32) * limit >> 32);
}

// At most twice the radius away, so that boxes and lines are about as big as spheres.
static int32_t near(stream *random, int32_t from, uint32_t radius) {
    return from - 2 * (int32_t)radius + (int32_t)below(random, 4 * radius + 1);
}

void bench_edits_at(const bench_edits *edits, fm_shape shape, uint64_t update, fm_brush *brushes) {
    const uint32_t extents[3] = {shape.x, shape.y, shape.z};
    stream random = {fm_mix(fm_mix(edits->seed) + update), 0};
    for (uint32_t i = 0; i < edits->per_update; i++) {
        fm_brush *brush = &brushes[i];
        const uint32_t color = 1 + below(&random, 255);
        *brush = (fm_brush){.kind = edits->kinds[below(&random, edits->kind_count)], .voxel = below(&random, 2) ? color : 0};
        brush->radius = edits->least_radius + below(&random, edits->greatest_radius - edits->least_radius + 1);
        for (int axis = 0; axis < 3; axis++) {
            brush->from[axis] = (int32_t)below(&random, extents[axis]);
            brush->to[axis] = near(&random, brush->from[axis], brush->radius);
        }
    }
}
