// SPDX-License-Identifier: MIT
// The arrays that a chunk is worked in, made once for the greatest.

#include "octree/build.h"

#include <math.h>

float fm_octree_reach(const fm_octree_build *build, int level) {
    const double band = (double)build->desc->band, edge = 1 << level;
    return (float)((fm_octree_is_thin(build) ? sqrt(3) * (edge + band) : band + sqrt(3) * edge) * 1.0001);
}

static void set_extent(const fm_octree_build *build, fm_octree_chunk *chunk) {
    for (int axis = 0; axis < 3; axis++) {
        const uint64_t left = build->cells[axis] - (uint64_t)chunk->at[axis] * FM_CHUNK;
        chunk->extent[axis] = (uint32_t)fm_min_u64(FM_CHUNK, fm_round_up(left, UINT64_C(1) << build->grain));
    }
    for (int level = 0; level <= build->leaf_most; level++) {
        for (int axis = 0; axis < 3; axis++) {
            chunk->nodes[level].shape[axis] = chunk->extent[axis] >> level;
            chunk->fields[level].shape[axis] = (chunk->extent[axis] >> level) + 1;
        }
    }
}

static void *take(uint8_t *base, uint64_t *used, uint64_t bytes) {
    void *result = base ? base + *used : NULL;
    *used += fm_round_up(bytes, FM_ALIGNMENT);
    return result;
}

static uint64_t lay_out(const fm_octree_build *build, fm_octree_chunk *chunk, uint8_t *base) {
    uint64_t used = 0;
    for (int level = 0; level <= build->leaf_most; level++) {
        fm_octree_field *field = &chunk->fields[level];
        const uint64_t corners = (uint64_t)field->shape[0] * field->shape[1] * field->shape[2];
        field->distance = take(base, &used, corners * sizeof *field->distance);
        field->triangles = take(base, &used, corners * sizeof *field->triangles);
        field->vectors = take(base, &used, corners * sizeof *field->vectors);
        field->codes = take(base, &used, corners * sizeof *field->codes);
        field->band = fm_octree_reach(build, level);
        fm_octree_nodes *nodes = &chunk->nodes[level];
        const uint64_t count = (uint64_t)nodes->shape[0] * nodes->shape[1] * nodes->shape[2];
        nodes->states = take(base, &used, count);
        nodes->words = take(base, &used, count * sizeof *nodes->words);
    }
    return used;
}

fm_result fm_octree_chunk_make(fm_octree_build *build) {
    fm_octree_chunk *chunk = &build->chunk;
    for (int axis = 0; axis < 3; axis++) {
        chunk->at[axis] = 0;
    }
    set_extent(build, chunk);
    chunk->bytes = lay_out(build, chunk, NULL);
    chunk->memory = fm_alloc(&build->context->allocator, chunk->bytes, "a chunk's corners and nodes");
    if (!chunk->memory) {
        return FM_ERROR_OUT_OF_HOST_MEMORY;
    }
    fm_meter_add(&build->context->host[FM_PURPOSE_OCTREES], chunk->bytes);
    lay_out(build, chunk, chunk->memory);
    return FM_OK;
}

void fm_octree_chunk_place(fm_octree_build *build, uint64_t at) {
    fm_octree_chunk *chunk = &build->chunk;
    const uint64_t row = at / build->chunks[0];
    chunk->at[0] = (uint32_t)(at % build->chunks[0]);
    chunk->at[1] = (uint32_t)(row % build->chunks[1]);
    chunk->at[2] = (uint32_t)(row / build->chunks[1]);
    set_extent(build, chunk);
}

void fm_octree_chunk_free(fm_octree_build *build) {
    fm_octree_chunk *chunk = &build->chunk;
    if (chunk->memory) {
        fm_meter_remove(&build->context->host[FM_PURPOSE_OCTREES], chunk->bytes);
        fm_free(&build->context->allocator, chunk->memory, chunk->bytes);
    }
    *chunk = (fm_octree_chunk){0};
}
