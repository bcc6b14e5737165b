// SPDX-License-Identifier: MIT
// How far a world's field is from the exact one. The reference is made by the transform on the CPU from the world's own voxels: of
// the whole world, and of what each chunk sees.

#include "noise.h"
#include "world.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

typedef struct comparison {
    fm_context *cpu;
    fm_world *world;
    fm_world_desc desc;
    uint64_t count, samples;
    uint32_t cap;  // what distances saturate at
    bool squared;
    uint8_t *solid;           // a byte a voxel
    void *field, *reference;  // U32 if squared, else U16
} comparison;

static fm_type value_type(const comparison *c) {
    return c->squared ? FM_TYPE_U32 : FM_TYPE_U16;
}

static uint32_t cap_of(const fm_world_desc *desc) {
    switch (desc->format) {
    case FM_FIELD_PACKED:
    case FM_FIELD_SPLIT_U8:
        return UINT8_MAX;
    case FM_FIELD_SPLIT_U16:
        return UINT16_MAX;
    case FM_FIELD_SQUARED_U32:
        break;
    }
    return desc->max_distance ? desc->max_distance * desc->max_distance : UINT32_MAX;
}

// Reads the voxels in slabs: all of them as 32-bit numbers would be four times the memory.
static const char *read_solid(comparison *c) {
    const fm_shape shape = c->desc.shape;
    const uint64_t slice = (uint64_t)shape.x * shape.y;
    const uint32_t most = slice < (1 << 22) ? (uint32_t)((1 << 22) / slice) : 1;
    uint32_t *slab = malloc(slice * most * sizeof *slab);
    fm_result result = slab ? FM_OK : FM_ERROR_OUT_OF_HOST_MEMORY;
    for (uint32_t z = 0; result == FM_OK && z < shape.z; z += most) {
        const uint32_t end = shape.z - z < most ? shape.z : z + most;
        result = fm_world_read(c->world, &(fm_box){{0, 0, z}, {shape.x, shape.y, end}}, slab);
        for (uint64_t i = 0; i < slice * (end - z); i++) {
            c->solid[slice * z + i] = slab[i] != 0;
        }
    }
    free(slab);
    return result == FM_OK ? NULL : slab ? fm_last_error() : "out of memory for the check";
}

static fm_result transform(const comparison *c, const uint8_t *solid, fm_shape shape, fm_outside outside, void *distance) {
    const fm_transform_desc desc = {
        .metric = c->squared ? FM_METRIC_L2 : FM_METRIC_L1, .squared = c->squared, .saturate = true, .outside = outside};
    // The input is only read; the array type serves inputs and outputs alike.
    const fm_array in = {(void *)(uintptr_t)solid, FM_TYPE_U8, shape}, out = {distance, value_type(c), shape};
    return fm_transform_host(c->cpu, &desc, &in, &out, NULL);
}

static uint32_t value_at(const comparison *c, const void *values, uint64_t i) {
    const uint32_t value = c->squared ? ((const uint32_t *)values)[i] : ((const uint16_t *)values)[i];
    return value < c->cap ? value : c->cap;
}

static double distance_of(const comparison *c, uint32_t value) {
    return c->squared ? sqrt((double)value) : (double)value;
}

static void compare(const comparison *c, bench_world_errors *errors) {
    const bool all = c->samples >= c->count;
    const uint64_t samples = all ? c->count : c->samples;
    for (uint64_t s = 0; s < samples; s++) {
        const uint64_t i = all ? s : fm_mix(s) % c->count;
        const uint32_t value = value_at(c, c->field, i), wanted = value_at(c, c->reference, i);
        const double error = distance_of(c, value) - distance_of(c, wanted);
        errors->above += value > wanted;
        errors->below += value < wanted;
        errors->most_above = fmax(errors->most_above, error);
        errors->most_below = fmax(errors->most_below, -error);
        errors->sum += fabs(error);
    }
    errors->compared += samples;
}

typedef struct box {
    uint32_t begin[3], size[3];
} box;

static uint64_t row_of(const comparison *c, const box *b, uint32_t y, uint32_t z) {
    return b->begin[0] + (uint64_t)c->desc.shape.x * (b->begin[1] + y + (uint64_t)c->desc.shape.y * (b->begin[2] + z));
}

// What the chunk sees: itself, or with its 26 neighbours.
static box domain_of(const comparison *c, const box *chunk) {
    const uint32_t extents[3] = {c->desc.shape.x, c->desc.shape.y, c->desc.shape.z};
    box domain = *chunk;
    for (int a = 0; c->desc.method.border == FM_BORDER_HALO && a < 3; a++) {
        const uint32_t edge = c->desc.method.chunk, end = chunk->begin[a] + chunk->size[a];
        domain.begin[a] = chunk->begin[a] - (chunk->begin[a] < edge ? chunk->begin[a] : edge);
        domain.size[a] = (extents[a] - end < edge ? extents[a] : end + edge) - domain.begin[a];
    }
    return domain;
}

static fm_result chunk_reference(comparison *c, const box *chunk, uint8_t *solid, uint16_t *distance) {
    const box domain = domain_of(c, chunk);
    const fm_shape shape = {domain.size[0], domain.size[1], domain.size[2]};
    for (uint32_t z = 0; z < shape.z; z++) {
        for (uint32_t y = 0; y < shape.y; y++) {
            memcpy(solid + shape.x * (y + (uint64_t)shape.y * z), c->solid + row_of(c, &domain, y, z), shape.x);
        }
    }
    const fm_outside outside = c->desc.method.border == FM_BORDER_PADDING ? FM_OUTSIDE_SOLID : FM_OUTSIDE_EMPTY;
    const fm_result result = transform(c, solid, shape, outside, distance);
    for (uint32_t z = 0; result == FM_OK && z < chunk->size[2]; z++) {
        for (uint32_t y = 0; y < chunk->size[1]; y++) {
            const uint64_t from =
                chunk->begin[0] - domain.begin[0] +
                shape.x * (chunk->begin[1] - domain.begin[1] + y + (uint64_t)shape.y * (chunk->begin[2] - domain.begin[2] + z));
            memcpy((uint16_t *)c->reference + row_of(c, chunk, y, z), distance + from, chunk->size[0] * sizeof *distance);
        }
    }
    return result;
}

// The reference of a chunked method. The world's own edge is a face like others.
static const char *domain_reference(comparison *c) {
    const uint32_t extents[3] = {c->desc.shape.x, c->desc.shape.y, c->desc.shape.z}, edge = c->desc.method.chunk;
    uint64_t most = 1;
    for (int a = 0; a < 3; a++) {
        most *= extents[a] < 3 * edge ? extents[a] : 3 * edge;
    }
    uint8_t *solid = malloc(most);
    uint16_t *distance = malloc(most * sizeof *distance);
    fm_result result = solid && distance ? FM_OK : FM_ERROR_OUT_OF_HOST_MEMORY;
    for (uint32_t z = 0; z < extents[2]; z += edge) {
        for (uint32_t y = 0; y < extents[1]; y += edge) {
            for (uint32_t x = 0; result == FM_OK && x < extents[0]; x += edge) {
                box chunk = {{x, y, z}, {edge, edge, edge}};
                for (int a = 0; a < 3; a++) {
                    chunk.size[a] = extents[a] - chunk.begin[a] < edge ? extents[a] - chunk.begin[a] : edge;
                }
                result = chunk_reference(c, &chunk, solid, distance);
            }
        }
    }
    const char *failure = result == FM_OK ? NULL : solid && distance ? fm_last_error() : "out of memory for the check";
    free(solid);
    free(distance);
    return failure;
}

static const char *check(comparison *c, bench_world_errors *whole, bench_world_errors *domain) {
    const fm_array field = {c->field, value_type(c), c->desc.shape};
    const char *failure = read_solid(c);
    if (failure) {
        return failure;
    }
    if (fm_world_read_field(c->world, NULL, &field, NULL) != FM_OK ||
        transform(c, c->solid, c->desc.shape, FM_OUTSIDE_EMPTY, c->reference) != FM_OK) {
        return fm_last_error();
    }
    compare(c, whole);
    if (c->desc.method.chunk && c->desc.method.border != FM_BORDER_EXCHANGE) {
        failure = domain_reference(c);
        if (!failure) {
            compare(c, domain);
        }
    }
    return failure;
}

const char *bench_world_check(bench_session *session, fm_world *world, uint64_t samples, bench_world_errors *whole,
                              bench_world_errors *domain) {
    comparison c = {.cpu = bench_session_context(session, FM_BACKEND_CPU), .world = world, .samples = samples};
    if (!c.cpu) {
        return fm_last_error();
    }
    fm_world_info(world, &c.desc);
    c.count = (uint64_t)c.desc.shape.x * c.desc.shape.y * c.desc.shape.z;
    c.squared = c.desc.format == FM_FIELD_SQUARED_U32;
    c.cap = cap_of(&c.desc);
    c.solid = malloc(c.count);
    c.field = malloc(c.count * fm_type_size(value_type(&c)));
    c.reference = malloc(c.count * fm_type_size(value_type(&c)));
    const char *failure = c.solid && c.field && c.reference ? check(&c, whole, domain) : "out of memory for the check";
    free(c.solid);
    free(c.field);
    free(c.reference);
    return failure;
}
