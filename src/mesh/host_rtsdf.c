// SPDX-License-Identifier: MIT
// RTSDF on the processor: the kernels' arithmetic, texel by texel.

#include "mesh/bvh.h"
#include "mesh/rtsdf.h"

#include <string.h>

enum { TRIANGLE_GRAIN = 256, ROW_GRAIN = 16 };

typedef struct frame_job {
    const fm_rtsdf *rtsdf;
    const fm_mesh *mesh;
    uint32_t *bits;
    // A step of the flood.
    const uint32_t *source;
    uint32_t *target;
    float *distance;  // not NULL: what the last step writes instead
    int step;
} frame_job;

fm_result fm_host_rtsdf_create(fm_rtsdf *rtsdf) {
    const uint64_t bytes = fm_rtsdf_bits_bytes(rtsdf) + fm_rtsdf_seed_bytes(rtsdf);
    rtsdf->memory = fm_alloc(&rtsdf->context->allocator, bytes, "an RTSDF's voxels and seeds");
    if (!rtsdf->memory) {
        return FM_ERROR_OUT_OF_HOST_MEMORY;
    }
    fm_meter_add(&rtsdf->context->host[FM_PURPOSE_UPDATE], bytes);
    return FM_OK;
}

void fm_host_rtsdf_destroy(fm_rtsdf *rtsdf) {
    if (rtsdf->memory) {
        const uint64_t bytes = fm_rtsdf_bits_bytes(rtsdf) + fm_rtsdf_seed_bytes(rtsdf);
        fm_free(&rtsdf->context->allocator, rtsdf->memory, bytes);
        fm_meter_remove(&rtsdf->context->host[FM_PURPOSE_UPDATE], bytes);
    }
}

static void voxelize(void *user, uint64_t begin, uint64_t end, uint32_t worker) {
    (void)worker;
    const frame_job *job = user;
    const fm_mesh *mesh = job->mesh;
    const fm_shape shape = job->rtsdf->coarse->desc.shape;
    const uint64_t row_words = fm_bits_row_words(shape);
    for (uint64_t i = begin; i < end; i++) {
        if (!fm_triangle_fits(mesh, i)) {
            continue;
        }
        const uint32_t *corners = mesh->triangles[i];
        const fm_voxel_triangle t = fm_voxel_axes(
            fm_voxel_box(job->rtsdf->grid, mesh->vertices[corners[0]], mesh->vertices[corners[1]], mesh->vertices[corners[2]]));
        for (int z = t.begin[2]; z < t.end[2]; z++) {
            for (int y = t.begin[1]; y < t.end[1]; y++) {
                uint32_t *row = job->bits + ((uint64_t)z * shape.y + (uint64_t)y) * row_words;
                for (int x = t.begin[0]; x < t.end[0]; x++) {
                    if (fm_voxel_sets(t, true, x, y, z)) {
                        __atomic_fetch_or(row + x / 32, UINT32_C(1) << x % 32, __ATOMIC_RELAXED);
                    }
                }
            }
        }
    }
}

// A voxel that is set is its own seed.
static void seed_rows(void *user, uint64_t begin, uint64_t end, uint32_t worker) {
    (void)worker;
    const frame_job *job = user;
    const fm_shape shape = job->rtsdf->coarse->desc.shape;
    for (uint64_t row = begin; row < end; row++) {
        const uint32_t *words = job->bits + row * fm_bits_row_words(shape);
        const uint32_t place = (uint32_t)(row % shape.y) << 10 | (uint32_t)(row / shape.y) << 20;
        for (uint32_t x = 0; x < shape.x; x++) {
            job->target[row * shape.x + x] = words[x / 32] >> x % 32 & 1 ? x | place : FM_SEED_NONE;
        }
    }
}

// The best that a row's texels have found so far.
typedef struct row_best {
    float distance2[FM_SEED_MOST];
    uint32_t seed[FM_SEED_MOST];
} row_best;

// Offers seeds[i] to texel (x + i, y, z).
static void offer(row_best *best, const uint32_t *seeds, int x, int count, int y, int z, const float weight[3]) {
    float *distance2 = best->distance2 + x;
    uint32_t *kept = best->seed + x;
    for (int i = 0; i < count; i++) {
        const uint32_t seed = seeds[i];
        const float found = fm_seed_distance2(seed, x + i, y, z, weight);
        const bool nearer = seed != FM_SEED_NONE && found < distance2[i];
        distance2[i] = nearer ? found : distance2[i];
        kept[i] = nearer ? seed : kept[i];
    }
}

// The texel's own seed first, then its neighbours' in the order of rtsdf_flood.comp, for all texels of a row at once.
static void nearest_seeds(const frame_job *job, fm_shape shape, int y, int z, row_best *best) {
    const float *weight = job->rtsdf->weight;
    const int step = job->step, n = (int)shape.x;
    for (int x = 0; x < n; x++) {
        best->distance2[x] = INFINITY;
        best->seed[x] = FM_SEED_NONE;
    }
    offer(best, job->source + ((uint64_t)z * shape.y + (uint64_t)y) * shape.x, 0, n, y, z, weight);
    for (int k = z - step; k <= z + step; k += step) {
        for (int j = y - step; j <= y + step; j += step) {
            if (j < 0 || k < 0 || j >= (int)shape.y || k >= (int)shape.z) {
                continue;
            }
            const uint32_t *row = job->source + ((uint64_t)k * shape.y + (uint64_t)j) * shape.x;
            if (step < n) {
                offer(best, row, step, n - step, y, z, weight);
            }
            offer(best, row, 0, n, y, z, weight);
            if (step < n) {
                offer(best, row + step, 0, n - step, y, z, weight);
            }
        }
    }
}

static void flood(void *user, uint64_t begin, uint64_t end, uint32_t worker) {
    (void)worker;
    const frame_job *job = user;
    const fm_shape shape = job->rtsdf->coarse->desc.shape;
    row_best best;
    for (uint64_t row = begin; row < end; row++) {
        nearest_seeds(job, shape, (int)(row % shape.y), (int)(row / shape.y), &best);
        if (!job->distance) {
            memcpy(job->target + row * shape.x, best.seed, shape.x * sizeof *best.seed);
            continue;
        }
        for (uint32_t x = 0; x < shape.x; x++) {
            job->distance[row * shape.x + x] = sqrtf(best.distance2[x]) * job->rtsdf->unit - job->rtsdf->beta;
        }
    }
}

// Seeds go to and fro between their own memory and the coarse field's, so that the last step, which writes that, reads the other.
static void flood_all(frame_job *job) {
    const fm_rtsdf *rtsdf = job->rtsdf;
    const fm_shape shape = rtsdf->coarse->desc.shape;
    const uint64_t rows = (uint64_t)shape.y * shape.z;
    uint32_t *const places[2] = {rtsdf->coarse->data, (uint32_t *)((char *)rtsdf->memory + fm_rtsdf_bits_bytes(rtsdf))};
    job->target = places[rtsdf->step_count % 2];
    fm_pool_run(rtsdf->context->pool, rows, ROW_GRAIN, seed_rows, job);
    for (int i = 0; i < rtsdf->step_count; i++) {
        const int left = rtsdf->step_count - 1 - i;
        job->step = rtsdf->steps[i];
        job->source = job->target;
        job->target = places[left % 2];
        job->distance = left == 0 ? rtsdf->coarse->data : NULL;
        fm_pool_run(rtsdf->context->pool, rows, ROW_GRAIN, flood, job);
    }
}

static float coarse_row(const fm_rtsdf *rtsdf, fm_between x, int y, int z) {
    const fm_shape shape = rtsdf->coarse->desc.shape;
    const float *row = (const float *)rtsdf->coarse->data + ((uint64_t)z * shape.y + (uint64_t)y) * shape.x;
    return fm_coarse_mix(row[x.first], row[x.second], x.weight);
}

static float coarse_at(const fm_rtsdf *rtsdf, int x, int y, int z) {
    const fm_shape shape = rtsdf->coarse->desc.shape;
    const fm_between along_x = fm_coarse_of(x, (int)shape.x);
    const fm_between along_y = fm_coarse_of(y, (int)shape.y);
    const fm_between along_z = fm_coarse_of(z, (int)shape.z);
    const float near = fm_coarse_mix(coarse_row(rtsdf, along_x, along_y.first, along_z.first),
                                     coarse_row(rtsdf, along_x, along_y.second, along_z.first), along_y.weight);
    const float far = fm_coarse_mix(coarse_row(rtsdf, along_x, along_y.first, along_z.second),
                                    coarse_row(rtsdf, along_x, along_y.second, along_z.second), along_y.weight);
    return fm_coarse_mix(near, far, along_z.weight);
}

static fm_ray_hits shoot(const frame_job *job, const int at[3]) {
    const fm_rtsdf *rtsdf = job->rtsdf;
    fm_mesh_ray ray = {.last = INFINITY};
    for (int i = 0; i < 3; i++) {
        ray.origin[i] = rtsdf->origin[i] + (float)at[i] * rtsdf->spacing[i];
    }
    fm_ray_hits hits = {.nearest = INFINITY};
    for (uint32_t i = 0; i < rtsdf->rays; i++) {
        const fm_ray_way way = fm_ray_direction(at[0], at[1], at[2], rtsdf->frame, i, rtsdf->seed);
        memcpy(ray.direction, &way, sizeof ray.direction);
        const fm_mesh_hit hit = fm_bvh_cast(job->mesh, &ray, false);
        if (hit.triangle != FM_NO_TRIANGLE) {
            hits.nearest = fminf(hits.nearest, hit.t);
            hits.behind += hit.back ? 1 : -1;
        }
    }
    return hits;
}

static void trace(void *user, uint64_t begin, uint64_t end, uint32_t worker) {
    (void)worker;
    const frame_job *job = user;
    const fm_rtsdf *rtsdf = job->rtsdf;
    const fm_shape shape = rtsdf->fine->desc.shape;
    float *fine = rtsdf->fine->data;
    for (uint64_t row = begin; row < end; row++) {
        for (uint32_t x = 0; x < shape.x; x++) {
            const int at[3] = {(int)x, (int)(row % shape.y), (int)(row / shape.y)};
            float *texel = fine + row * shape.x + x;
            const float c = coarse_at(rtsdf, at[0], at[1], at[2]);
            const bool first = rtsdf->frame == 0;
            fm_ray_hits hits = {.nearest = INFINITY};
            if (c <= rtsdf->mask) {
                hits = shoot(job, at);
            }
            *texel = fm_rtsdf_accumulate(c, first ? 0 : *texel, first, hits, rtsdf->mask, rtsdf->alpha, rtsdf->bias);
        }
    }
}

fm_result fm_host_rtsdf_update(fm_rtsdf *rtsdf, fm_mesh *mesh) {
    fm_context *context = rtsdf->context;
    frame_job job = {.rtsdf = rtsdf, .mesh = mesh, .bits = rtsdf->memory};
    fm_passes_begin(context);
    if (rtsdf->rays > 0) {
        FM_TRY(fm_bvh_prepare(mesh));
        fm_passes_end(context, "tree", 12 * (mesh->triangle_count + mesh->vertex_count));
    }
    memset(job.bits, 0, fm_rtsdf_bits_bytes(rtsdf));
    fm_pool_run(context->pool, mesh->triangle_count, TRIANGLE_GRAIN, voxelize, &job);
    fm_passes_end(context, "voxelize", 12 * (mesh->triangle_count + mesh->vertex_count) + fm_rtsdf_bits_bytes(rtsdf));
    flood_all(&job);
    fm_passes_end(context, "flood", fm_rtsdf_flood_bytes(rtsdf));
    const fm_shape fine = rtsdf->fine->desc.shape;
    fm_pool_run(context->pool, (uint64_t)fine.y * fine.z, ROW_GRAIN, trace, &job);
    fm_passes_end(context, "trace", fm_rtsdf_trace_bytes(rtsdf));
    return FM_OK;
}
