// SPDX-License-Identifier: MIT
// Bricks of signed distances within a band, and the dense top grid that finds them. A brick has its cells' 9^3 corners, so that no
// neighbour is read: 2916 bytes for 8^3 cells, where 2048 would do without the corners that bricks repeat.

#include "mesh/host_sign.h"
#include "octree/build.h"

#include <math.h>
#include <string.h>

enum { EDGE = 1 << FM_BRICK_LEVEL, CORNERS = EDGE + 1 };

typedef struct brick_job {
    fm_octree_build *build;
    const fm_octree_field *field;
    uint32_t bricks[3];
    uint64_t count;
    float *nearest;   // of each brick's corners
    uint32_t *words;  // of each brick
} brick_job;

static uint64_t corner_of(const brick_job *job, uint64_t brick) {
    const uint64_t row = brick / job->bricks[0];
    return fm_node_at(job->field->shape, (uint32_t)(brick % job->bricks[0]) * EDGE, (uint32_t)(row % job->bricks[1]) * EDGE,
                      (uint32_t)(row / job->bricks[1]) * EDGE);
}

static void find_nearest(void *user, uint64_t begin, uint64_t end, uint32_t worker) {
    const brick_job *job = user;
    const uint32_t *shape = job->field->shape;
    (void)worker;
    for (uint64_t brick = begin; brick < end; brick++) {
        const float *first = job->field->distance + corner_of(job, brick);
        float nearest = INFINITY;
        for (uint32_t z = 0; z < CORNERS; z++) {
            for (uint32_t y = 0; y < CORNERS; y++) {
                const float *row = first + fm_node_at(shape, 0, y, z);
                for (uint32_t x = 0; x < CORNERS; x++) {
                    nearest = fminf(nearest, fabsf(row[x]));
                }
            }
        }
        job->nearest[brick] = nearest;
    }
}

static void write_bricks(void *user, uint64_t begin, uint64_t end, uint32_t worker) {
    const brick_job *job = user;
    const uint32_t *shape = job->field->shape;
    const fm_octree_build *build = job->build;
    const float band = job->field->band;
    (void)worker;
    for (uint64_t brick = begin; brick < end; brick++) {
        if (job->words[brick] <= INT32_MAX) {
            continue;
        }
        const float *first = job->field->distance + corner_of(job, brick);
        float *to = (float *)(void *)build->octree->values.data + (uint64_t)(~job->words[brick]) * FM_BRICK_VALUES;
        for (uint32_t z = 0; z < CORNERS; z++) {
            for (uint32_t y = 0; y < CORNERS; y++) {
                const float *row = first + fm_node_at(shape, 0, y, z);
                for (uint32_t x = 0; x < CORNERS; x++) {
                    *to++ = (float)((double)copysignf(fminf(fabsf(row[x]), band), row[x]) * build->cell);
                }
            }
        }
    }
}

// Signs of corners beyond the band.
static fm_result sign_far(fm_octree_build *build, const fm_octree_field *field) {
    if (build->sign != FM_SIGN_PSEUDONORMAL) {
        return FM_OK;
    }
    const fm_grid grid = {.shape = {field->shape[0], field->shape[1], field->shape[2]}, .spacing = {1, 1, 1}};
    bool known;
    // Where nothing is known there is no brick.
    return fm_sign_spread(build->context, &grid, field->distance, &known);
}

static fm_result number_bricks(brick_job *job) {
    fm_octree_build *build = job->build;
    fm_octree *octree = build->octree;
    const uint32_t *top = octree->info.top;
    const uint64_t before = octree->values.count / FM_BRICK_VALUES;
    uint64_t kept = 0;
    for (uint64_t brick = 0; brick < job->count; brick++) {
        const uint64_t row = brick / job->bricks[0];
        const uint32_t at[3] = {build->chunk.at[0] * (FM_CHUNK / EDGE) + (uint32_t)(brick % job->bricks[0]),
                                build->chunk.at[1] * (FM_CHUNK / EDGE) + (uint32_t)(row % job->bricks[1]),
                                build->chunk.at[2] * (FM_CHUNK / EDGE) + (uint32_t)(row / job->bricks[1])};
        uint32_t *word = (uint32_t *)(void *)octree->words.data + fm_node_at(top, at[0], at[1], at[2]);
        if (job->nearest[brick] <= build->desc->band) {
            *word = ~(uint32_t)(before + kept++);
        } else {
            const float bound = fminf(job->nearest[brick], job->field->band) - 0.8660255f;
            const uint32_t own = fm_octree_bound_word(build, fmaxf(0, bound));
            *word = own > *word ? own : *word;
        }
        job->words[brick] = *word;
    }
    if (before + kept > INT32_MAX) {
        return fm_fail(FM_ERROR_UNSUPPORTED, "more than 2^31 bricks: choose a smaller size");
    }
    if (!fm_octree_reserve(octree, &octree->values, kept * FM_BRICK_VALUES)) {
        return FM_ERROR_OUT_OF_HOST_MEMORY;
    }
    octree->values.count += kept * FM_BRICK_VALUES;
    octree->info.leaves[FM_BRICK_LEVEL] += kept;
    octree->info.empty -= kept;
    return FM_OK;
}

fm_result fm_octree_bricks_emit(fm_octree_build *build) {
    brick_job job = {.build = build, .field = &build->chunk.fields[0], .count = 1};
    for (int axis = 0; axis < 3; axis++) {
        job.bricks[axis] = build->chunk.extent[axis] / EDGE;
        job.count *= job.bricks[axis];
    }
    fm_context *context = build->context;
    FM_TRY(sign_far(build, job.field));
    job.nearest = fm_octree_alloc(context, job.count * sizeof *job.nearest, "bricks");
    job.words = fm_octree_alloc(context, job.count * sizeof *job.words, "bricks");
    fm_result result = job.nearest && job.words ? FM_OK : FM_ERROR_OUT_OF_HOST_MEMORY;
    if (result == FM_OK) {
        fm_pool_run(build->context->pool, job.count, 16, find_nearest, &job);
        result = number_bricks(&job);
    }
    if (result == FM_OK) {
        fm_pool_run(build->context->pool, job.count, 16, write_bricks, &job);
    }
    fm_octree_free(context, job.nearest, job.count * sizeof *job.nearest);
    fm_octree_free(context, job.words, job.count * sizeof *job.words);
    return result;
}

void fm_octree_bricks_clear(fm_octree_build *build) {
    fm_octree *octree = build->octree;
    const uint32_t *top = octree->info.top;
    uint32_t *word = (uint32_t *)(void *)octree->words.data;
    for (uint32_t z = 0; z < top[2]; z++) {
        for (uint32_t y = 0; y < top[1]; y++) {
            for (uint32_t x = 0; x < top[0]; x++) {
                *word++ = fm_octree_bound_word(build, fm_octree_far_bound(&build->far, FM_BRICK_LEVEL, x, y, z));
            }
        }
    }
    octree->info.empty = octree->words.count;
}
