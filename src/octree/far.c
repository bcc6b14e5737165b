// SPDX-License-Identifier: MIT
// How far the surface is at least, far away from it: cells of a coarse grid that triangles come into, and the exact distance from
// every cell to the nearest of them, from face to face.

#include "octree/build.h"

#include <math.h>
#include <string.h>

static const uint64_t MOST_CELLS = UINT64_C(1) << 22;

fm_result fm_octree_far_make(fm_octree_build *build) {
    fm_octree_far *far = &build->far;
    for (far->level = 2;; far->level++) {
        far->count = 1;
        for (int axis = 0; axis < 3; axis++) {
            far->shape[axis] = (uint32_t)fm_div_up(build->cells[axis], UINT64_C(1) << far->level) + 2;
            far->count *= far->shape[axis];
        }
        if (far->count <= MOST_CELLS) {
            break;
        }
    }
    far->occupied = fm_octree_alloc_zero(build->context, far->count, "cells that the surface passes");
    return far->occupied ? FM_OK : FM_ERROR_OUT_OF_HOST_MEMORY;
}

void fm_octree_far_free(fm_octree_build *build) {
    fm_octree_far *far = &build->far;
    fm_octree_free(build->context, far->occupied, far->count);
    fm_octree_free(build->context, far->bound, far->count * sizeof *far->bound);
    far->occupied = NULL;
    far->bound = NULL;
}

typedef struct marking {
    fm_octree_far *far;
    const fm_cell_triangle *triangle;
    uint32_t from[3], to[3];  // of coarse cells
} marking;

// The coarse cells of a cube of 2^steps of them, halved as long as the triangle comes into it.
static void mark_cube(const marking *job, const uint32_t at[3], int steps) {
    const uint32_t edge = UINT32_C(1) << steps;
    const double size = (double)(UINT64_C(1) << job->far->level);
    double low[3];
    for (int axis = 0; axis < 3; axis++) {
        if (at[axis] > job->to[axis] || at[axis] + (edge - 1) < job->from[axis]) {
            return;
        }
        low[axis] = at[axis] * size;
    }
    if (!fm_cell_triangle_touches(job->triangle, low, edge * size)) {
        return;
    }
    if (steps == 0) {
        job->far->occupied[fm_node_at(job->far->shape, at[0] + 1, at[1] + 1, at[2] + 1)] = 1;
        return;
    }
    for (uint32_t i = 0; i < 8; i++) {
        const uint32_t part[3] = {at[0] + (i & 1) * edge / 2, at[1] + (i >> 1 & 1) * edge / 2, at[2] + (i >> 2) * edge / 2};
        mark_cube(job, part, steps - 1);
    }
}

void fm_octree_far_mark(const fm_octree_build *build, fm_octree_far *far, const fm_cell_triangle *t) {
    marking job = {far, t, {0}, {0}};
    const double size = (double)(UINT64_C(1) << far->level);
    bool misses = false;
    for (int axis = 0; axis < 3; axis++) {
        far->outside = far->outside || t->low[axis] < 0 || t->high[axis] > build->cells[axis];
        // The last cells may reach beyond the box.
        misses = misses || t->high[axis] < 0 || t->low[axis] > (far->shape[axis] - 2) * size;
        job.from[axis] = (uint32_t)fmax(0, floor(fmin(t->low[axis] / size, far->shape[axis] - 3.0)));
        job.to[axis] = (uint32_t)fmin(far->shape[axis] - 3.0, fmax(0, floor(t->high[axis] / size)));
    }
    if (misses) {
        return;
    }
    // The smallest aligned cube that holds them all.
    int steps = 0;
    while (job.from[0] >> steps != job.to[0] >> steps || job.from[1] >> steps != job.to[1] >> steps ||
           job.from[2] >> steps != job.to[2] >> steps) {
        steps++;
    }
    const uint32_t at[3] = {job.from[0] >> steps << steps, job.from[1] >> steps << steps, job.from[2] >> steps << steps};
    mark_cube(&job, at, steps);
}

// --- The transform ---

typedef struct lines_job {
    fm_octree_far *far;
    int axis;
    uint32_t longest;
    double *scratch;  // 4 longest a worker
} lines_job;

// Lower envelope of parabolas. Source: Felzenszwalb and Huttenlocher 2012, "Distance transforms of sampled functions", section 2.1.
static void transform_line(float *values, uint64_t stride, uint32_t count, double *scratch, uint32_t longest) {
    double *height = scratch, *place = scratch + longest, *from = scratch + 2 * (uint64_t)longest;
    uint32_t used = 0;
    for (uint32_t i = 0; i < count; i++) {
        const double own = (double)values[i * stride];
        if (isinf(own)) {
            continue;
        }
        double start = -INFINITY;
        while (used > 0) {
            const double other = place[used - 1];
            start = (own + (double)i * i - height[used - 1] - other * other) / (2 * (i - other));
            if (start > from[used - 1]) {
                break;
            }
            used--;
            start = -INFINITY;
        }
        height[used] = own;
        place[used] = i;
        from[used++] = start;
    }
    for (uint32_t i = 0, k = 0; i < count && used > 0; i++) {
        while (k + 1 < used && from[k + 1] <= i) {
            k++;
        }
        values[i * stride] = (float)(height[k] + (i - place[k]) * (i - place[k]));
    }
}

static void transform_lines(void *user, uint64_t begin, uint64_t end, uint32_t worker) {
    const lines_job *job = user;
    const uint32_t *shape = job->far->shape;
    const uint64_t strides[3] = {1, shape[0], (uint64_t)shape[0] * shape[1]};
    const int a = job->axis == 0 ? 1 : 0, b = job->axis == 2 ? 1 : 2;
    double *scratch = job->scratch + (uint64_t)worker * 3 * job->longest;
    for (uint64_t i = begin; i < end; i++) {
        const uint64_t first = i % shape[a] * strides[a] + i / shape[a] * strides[b];
        transform_line(job->far->bound + first, strides[job->axis], shape[job->axis], scratch, job->longest);
    }
}

// Faces of neighbours touch: cells count as occupied that have such a neighbour, so that centres are as far as faces were.
static bool near_occupied(const fm_octree_far *far, uint32_t x, uint32_t y, uint32_t z) {
    const uint32_t low[3] = {x > 0 ? x - 1 : 0, y > 0 ? y - 1 : 0, z > 0 ? z - 1 : 0};
    const uint32_t high[3] = {x + 1 < far->shape[0] ? x + 1 : x, y + 1 < far->shape[1] ? y + 1 : y,
                              z + 1 < far->shape[2] ? z + 1 : z};
    for (uint32_t k = low[2]; k <= high[2]; k++) {
        for (uint32_t j = low[1]; j <= high[1]; j++) {
            for (uint32_t i = low[0]; i <= high[0]; i++) {
                if (far->occupied[fm_node_at(far->shape, i, j, k)]) {
                    return true;
                }
            }
        }
    }
    return false;
}

static void seed_slices(void *user, uint64_t begin, uint64_t end, uint32_t worker) {
    const fm_octree_far *far = user;
    (void)worker;
    for (uint32_t z = (uint32_t)begin; z < end; z++) {
        for (uint32_t y = 0; y < far->shape[1]; y++) {
            for (uint32_t x = 0; x < far->shape[0]; x++) {
                far->bound[fm_node_at(far->shape, x, y, z)] = near_occupied(far, x, y, z) ? 0 : INFINITY;
            }
        }
    }
}

static void root_slices(void *user, uint64_t begin, uint64_t end, uint32_t worker) {
    const fm_octree_far *far = user;
    const uint64_t slice = (uint64_t)far->shape[0] * far->shape[1];
    (void)worker;
    for (uint64_t i = begin * slice; i < end * slice; i++) {
        // Rounded down: squares of floats are off by a part of 2^-24.
        far->bound[i] = sqrtf(far->bound[i]) * (float)(UINT64_C(1) << far->level) * 0.999999f;
    }
}

// What is outside may be as near as the box's border.
static void mark_border(fm_octree_far *far) {
    for (uint32_t z = 0; z < far->shape[2]; z++) {
        for (uint32_t y = 0; y < far->shape[1]; y++) {
            const bool side = z == 0 || y == 0 || z == far->shape[2] - 1 || y == far->shape[1] - 1;
            uint8_t *row = far->occupied + fm_node_at(far->shape, 0, y, z);
            if (side) {
                memset(row, 1, far->shape[0]);
            }
            row[0] = row[far->shape[0] - 1] = 1;
        }
    }
}

fm_result fm_octree_far_finish(fm_octree_build *build) {
    fm_octree_far *far = &build->far;
    fm_context *context = build->context;
    lines_job job = {.far = far};
    for (int axis = 0; axis < 3; axis++) {
        job.longest = far->shape[axis] > job.longest ? far->shape[axis] : job.longest;
    }
    if (far->outside) {
        mark_border(far);
    }
    const uint64_t bytes = (uint64_t)fm_pool_threads(context->pool) * 3 * job.longest * sizeof *job.scratch;
    far->bound = fm_octree_alloc(context, far->count * sizeof *far->bound, "bounds of empty cells");
    job.scratch = fm_octree_alloc(context, bytes, "bounds of empty cells");
    if (far->bound && job.scratch) {
        fm_pool_run(context->pool, far->shape[2], 1, seed_slices, far);
        for (job.axis = 0; job.axis < 3; job.axis++) {
            fm_pool_run(context->pool, far->count / far->shape[job.axis], 64, transform_lines, &job);
        }
        fm_pool_run(context->pool, far->shape[2], 1, root_slices, far);
    }
    fm_octree_free(context, job.scratch, bytes);
    return far->bound && job.scratch ? FM_OK : FM_ERROR_OUT_OF_HOST_MEMORY;
}

float fm_octree_far_bound(const fm_octree_far *far, int level, uint32_t x, uint32_t y, uint32_t z) {
    const uint32_t node[3] = {x, y, z};
    uint32_t from[3], to[3];
    for (int axis = 0; axis < 3; axis++) {
        const uint32_t cells = far->shape[axis] - 2;
        const uint64_t low =
            level < far->level ? (uint64_t)node[axis] >> (far->level - level) : (uint64_t)node[axis] << (level - far->level);
        const uint64_t high = level < far->level ? low : low + (UINT64_C(1) << (level - far->level)) - 1;
        // What is beyond the box does not count.
        if (low >= cells) {
            return INFINITY;
        }
        from[axis] = (uint32_t)low;
        to[axis] = (uint32_t)fm_min_u64(high, cells - 1);
    }
    float bound = INFINITY;
    for (uint32_t k = from[2]; k <= to[2]; k++) {
        for (uint32_t j = from[1]; j <= to[1]; j++) {
            for (uint32_t i = from[0]; i <= to[0]; i++) {
                bound = fminf(bound, far->bound[fm_node_at(far->shape, i + 1, j + 1, k + 1)]);
            }
        }
    }
    return bound;
}
