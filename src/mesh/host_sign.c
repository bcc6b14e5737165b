// SPDX-License-Identifier: MIT
#include "mesh/host_sign.h"

#include "mesh/boundary.h"

#include <string.h>

// --- From the band to the rest ---

typedef struct spread_job {
    const fm_grid *grid;
    float *distance;
    int8_t *rows;  // the side of each row's first texel: -1 or 1, -2 or 2 where the whole row is of that side; 0: not known
} spread_job;

static float side_of(float value) {
    return value < 0 ? -1.0f : 1.0f;
}

// Rows that reach the band.
static void spread_rows(void *user, uint64_t begin, uint64_t end, uint32_t worker) {
    const spread_job *job = user;
    const uint32_t size = job->grid->shape.x;
    (void)worker;
    for (uint64_t row = begin; row < end; row++) {
        float *values = job->distance + row * size;
        uint32_t first = 0;
        while (first < size && isinf(values[first])) {
            first++;
        }
        if (first == size) {
            continue;
        }
        float side = side_of(values[first]);
        job->rows[row] = (int8_t)side;
        for (uint32_t x = 0; x < size; x++) {
            if (isinf(values[x])) {
                values[x] = side * INFINITY;
            } else {
                side = side_of(values[x]);
            }
        }
    }
}

// Rows that do not: all of one side.
static void fill_rows(void *user, uint64_t begin, uint64_t end, uint32_t worker) {
    const spread_job *job = user;
    const uint32_t size = job->grid->shape.x;
    (void)worker;
    for (uint64_t row = begin; row < end; row++) {
        float *values = job->distance + row * size;
        for (uint32_t x = 0; job->rows[row] == -2 && x < size; x++) {
            values[x] = -values[x];
        }
    }
}

static void carry_one(int8_t from, int8_t *to) {
    if (from != 0 && *to == 0) {
        *to = from < 0 ? -2 : 2;
    }
}

// Carries what is known to the rows beside, `stride` apart, both ways.
static void carry(int8_t *rows, uint64_t count, uint64_t stride) {
    for (uint64_t i = 1; i < count; i++) {
        carry_one(rows[(i - 1) * stride], &rows[i * stride]);
    }
    for (uint64_t i = count - 1; i-- > 0;) {
        carry_one(rows[(i + 1) * stride], &rows[i * stride]);
    }
}

fm_result fm_sign_spread(fm_context *context, const fm_grid *grid, float *distance, bool *known) {
    const fm_shape shape = grid->shape;
    const uint64_t count = (uint64_t)shape.y * shape.z;
    spread_job job = {grid, distance, fm_alloc_zero(&context->allocator, count, "the sides of rows")};
    if (!job.rows) {
        return FM_ERROR_OUT_OF_HOST_MEMORY;
    }
    fm_pool_run(context->pool, count, 64, spread_rows, &job);
    for (uint32_t z = 0; z < shape.z; z++) {
        carry(job.rows + (uint64_t)shape.y * z, shape.y, 1);
    }
    for (uint32_t y = 0; y < shape.y; y++) {
        carry(job.rows + y, shape.z, shape.y);
    }
    *known = job.rows[0] != 0;
    fm_pool_run(context->pool, count, 64, fill_rows, &job);
    fm_free(&context->allocator, job.rows, count);
    return FM_OK;
}

// --- Winding numbers of meshes without a boundary ---

typedef struct crossing_job {
    const fm_mesh *mesh;
    const fm_grid *grid;
    float *distance;
    fm_slabs slabs;
    int32_t *changes;  // a slice for each worker
} crossing_job;

static void sign_slabs(void *user, uint64_t begin, uint64_t end, uint32_t worker) {
    const crossing_job *job = user;
    const fm_shape shape = job->grid->shape;
    const uint64_t slice = (uint64_t)shape.x * shape.y;
    int32_t *changes = job->changes + slice * worker;
    for (uint64_t slab = begin; slab < end; slab++) {
        const uint64_t first = job->slabs.first[slab], last = fm_min_u64((slab + 1) * job->slabs.depth, shape.z);
        for (uint64_t z = slab * job->slabs.depth; z < last; z++) {
            float *distance = job->distance + slice * z;
            memset(changes, 0, slice * sizeof *changes);
            fm_crossings_add(job->mesh, job->grid, job->slabs.triangles + first, job->slabs.first[slab + 1] - first, (uint32_t)z,
                             changes);
            for (uint32_t y = 0; y < shape.y; y++) {
                int32_t winding = 0;
                for (uint64_t i = (y + UINT64_C(1)) * shape.x; i-- > y * (uint64_t)shape.x;) {
                    winding += changes[i];
                    distance[i] = winding > 0 ? -distance[i] : distance[i];
                }
            }
        }
    }
}

static fm_result sign_by_crossings(fm_mesh *mesh, const fm_grid *grid, float *distance) {
    fm_context *context = mesh->context;
    const uint64_t slice = (uint64_t)grid->shape.x * grid->shape.y * sizeof(int32_t);
    crossing_job job = {.mesh = mesh, .grid = grid, .distance = distance};
    void *memory;
    FM_TRY(fm_context_scratch(context, slice * fm_pool_threads(context->pool), &memory));
    job.changes = memory;
    FM_TRY(fm_slabs_make(mesh, grid, &job.slabs));
    fm_pool_run(context->pool, job.slabs.count, 1, sign_slabs, &job);
    fm_slabs_destroy(&context->allocator, &job.slabs);
    return FM_OK;
}

fm_result fm_sign_winding(fm_mesh *mesh, const fm_grid *grid, double band, float *distance) {
    fm_boundary boundary;
    FM_TRY(fm_boundary_make(mesh, &boundary));
    const fm_result result =
        boundary.count == 0 ? sign_by_crossings(mesh, grid, distance) : fm_sign_open(mesh, grid, band, &boundary, distance);
    fm_boundary_destroy(&mesh->context->allocator, &boundary);
    return result;
}
