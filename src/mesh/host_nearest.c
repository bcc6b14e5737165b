// SPDX-License-Identifier: MIT
// What the descent works from, and its workers.

#include "mesh/host_nearest.h"

#include "base/cpu.h"
#include "mesh/descent.h"

#include <float.h>
#include <string.h>

typedef struct memory {
    fm_sphere *spheres;
    uint32_t *ids;
    uint64_t *items;
    fm_descent_worker *workers;
    uint8_t *lists;  // of all workers
    uint64_t item_count, list_bytes;
    uint32_t threads;
} memory;

static void memory_free(const fm_mesh *mesh, memory *m) {
    fm_context *context = mesh->context;
    fm_mesh_free(context, m->spheres, mesh->triangle_count * sizeof *m->spheres);
    fm_mesh_free(context, m->ids, mesh->triangle_count * sizeof *m->ids);
    fm_mesh_free(context, m->items, m->item_count * sizeof *m->items);
    fm_mesh_free(context, m->workers, m->threads * sizeof *m->workers);
    fm_mesh_free(context, m->lists, m->list_bytes * m->threads);
}

static bool use_avx2(void) {
#ifdef FM_X86_KERNELS
    return fm_simd_best() >= FM_SIMD_AVX2;
#else
    return false;
#endif
}

// The next `bytes` of a worker's memory; with a NULL base only the sum counts.
static void *take(uint8_t *base, uint64_t *used, uint64_t bytes) {
    void *result = base ? base + *used : NULL;
    *used += fm_round_up(bytes, FM_ALIGNMENT);
    return result;
}

static uint64_t lay_out(const fm_descent *job, uint8_t *base, fm_descent_worker *worker) {
    uint64_t used = 0;
    const uint64_t local = fm_min_u64(job->count, DESCENT_LOCAL_MOST);
    *worker = (fm_descent_worker){0};
    for (int level = 1; level <= job->levels; level++) {
        worker->mask[level] = take(base, &used, job->count);
        if (level < job->levels) {
            worker->list[level] = take(base, &used, job->count * sizeof *worker->list[level]);
        }
    }
    for (int level = 1; level <= DESCENT_LOCAL_LEVEL; level++) {
        worker->local_mask[level] = take(base, &used, local);
        worker->local_list[level] = take(base, &used, local * sizeof *worker->local_list[level]);
    }
    worker->prepared = take(base, &used, local * sizeof *worker->prepared);
    worker->distances = take(base, &used, local * DESCENT_LANES * sizeof(float));
    return used;
}

// A cube's items, in Morton order; counts them when `items` is NULL.
static uint64_t list_items(const fm_grid *grid, int level, int item_level, const uint32_t low[3], uint64_t code, uint64_t *items) {
    if (low[0] >= grid->shape.x || low[1] >= grid->shape.y || low[2] >= grid->shape.z) {
        return 0;
    }
    if (level == item_level) {
        if (items) {
            *items = code;
        }
        return 1;
    }
    uint64_t count = 0;
    for (uint32_t which = 0; which < 8; which++) {
        const uint32_t edge = UINT32_C(1) << (level - 1);
        const uint32_t part[3] = {low[0] + (which & 1) * edge, low[1] + (which >> 1 & 1) * edge, low[2] + (which >> 2) * edge};
        count += list_items(grid, level - 1, item_level, part, code << 3 | which, items ? items + count : NULL);
    }
    return count;
}

static void corners_of(const fm_descent *job, uint64_t triangle, double corners[3][3]) {
    for (int i = 0; i < 3; i++) {
        const float *vertex = job->mesh->vertices[job->mesh->triangles[triangle][i]];
        for (int axis = 0; axis < 3; axis++) {
            corners[i][axis] = (double)vertex[axis] - job->middle[axis];
        }
    }
}

static double distance_between(const double a[3], const double b[3]) {
    const double x = a[0] - b[0], y = a[1] - b[1], z = a[2] - b[2];
    return sqrt(x * x + y * y + z * z);
}

// Around the triangle's centroid or the middle of an edge, whichever sphere is the smallest.
static void make_spheres(void *user, uint64_t begin, uint64_t end, uint32_t worker) {
    const fm_descent *job = user;
    fm_sphere *spheres = (fm_sphere *)job->spheres;
    (void)worker;
    for (uint64_t i = begin; i < end; i++) {
        double corners[3][3], best = INFINITY;
        corners_of(job, job->ids[i], corners);
        for (int choice = 0; choice < 4; choice++) {
            double centre[3], radius = 0;
            for (int axis = 0; axis < 3; axis++) {
                const double sum = corners[0][axis] + corners[1][axis] + corners[2][axis];
                centre[axis] = choice == 3 ? sum / 3 : (sum - corners[choice][axis]) / 2;
            }
            for (int corner = 0; corner < 3; corner++) {
                radius = fmax(radius, distance_between(centre, corners[corner]));
            }
            if (radius < best) {
                best = radius;
                spheres[i] =
                    (fm_sphere){{(float)(centre[0] / job->unit), (float)(centre[1] / job->unit), (float)(centre[2] / job->unit)},
                                (float)(radius / job->unit) * 1.000001f};
            }
        }
    }
}

// Sets the scale: texels about 1 apart, and no square of a coordinate beyond a float.
static void scale(const fm_nearest_field *field, fm_descent *job) {
    const uint32_t size[3] = {job->grid.shape.x, job->grid.shape.y, job->grid.shape.z};
    double farthest = 0, extent = 0;
    uint32_t longest = 2;
    for (int axis = 0; axis < 3; axis++) {
        job->middle[axis] = job->grid.origin[axis] + (size[axis] - 1.0) / 2 * job->grid.spacing[axis];
        job->unit = fmax(job->unit, job->grid.spacing[axis]);
        extent += (size[axis] - 1.0) / 2 * job->grid.spacing[axis];
        longest = size[axis] > longest ? size[axis] : longest;
    }
    for (uint64_t i = 0; i < job->count; i++) {
        double corners[3][3];
        corners_of(job, job->ids[i], corners);
        for (int k = 0; k < 9; k++) {
            farthest = fmax(farthest, fabs(corners[k / 3][k % 3]));
        }
    }
    job->unit = fmax(job->unit, farthest * 1e-18);
    job->band = (float)(field->band / job->unit);
    job->band2 = fminf(job->band * job->band, FLT_MAX);
    job->half_grid = (float)(extent / job->unit);
    for (job->levels = 1; UINT64_C(1) << job->levels < longest; job->levels++) {
    }
}

static fm_result memory_make(fm_descent *job, memory *m) {
    fm_context *context = job->mesh->context;
    static const uint32_t low[3] = {0, 0, 0};
    const int item_level = job->levels < DESCENT_ITEM_LEVEL ? job->levels : DESCENT_ITEM_LEVEL;
    fm_descent_worker unplaced;
    m->threads = fm_pool_threads(context->pool);
    m->item_count = list_items(&job->grid, job->levels, item_level, low, 0, NULL);
    m->list_bytes = lay_out(job, NULL, &unplaced);
    m->items = fm_mesh_alloc(context, m->item_count * sizeof *m->items, "cubes of texels");
    m->workers = fm_mesh_alloc(context, m->threads * sizeof *m->workers, "lists of triangles");
    m->lists = fm_mesh_alloc(context, m->list_bytes * m->threads, "lists of triangles");
    if (!m->items || !m->workers || !m->lists) {
        return FM_ERROR_OUT_OF_HOST_MEMORY;
    }
    list_items(&job->grid, job->levels, item_level, low, 0, m->items);
    for (uint32_t i = 0; i < m->threads; i++) {
        lay_out(job, m->lists + m->list_bytes * i, &m->workers[i]);
    }
    job->items = m->items;
    job->workers = m->workers;
    return FM_OK;
}

static void clear(void *user, uint64_t begin, uint64_t end, uint32_t worker) {
    const fm_descent *job = user;
    const uint64_t slice = (uint64_t)job->grid.shape.x * job->grid.shape.y;
    (void)worker;
    for (uint64_t i = begin * slice; i < end * slice; i++) {
        job->distance[i] = INFINITY;
    }
    if (job->triangles) {
        memset(job->triangles + begin * slice, 0xff, (end - begin) * slice * sizeof *job->triangles);
    }
}

static fm_result run(const fm_nearest_field *field, fm_descent *job, memory *m) {
    const fm_mesh *mesh = job->mesh;
    fm_pool *pool = mesh->context->pool;
    fm_context *context = mesh->context;
    m->spheres = fm_mesh_alloc(context, mesh->triangle_count * sizeof *m->spheres, "spheres around triangles");
    m->ids = fm_mesh_alloc(context, mesh->triangle_count * sizeof *m->ids, "spheres around triangles");
    if (!m->spheres || !m->ids) {
        return FM_ERROR_OUT_OF_HOST_MEMORY;
    }
    for (uint64_t i = 0; i < mesh->triangle_count; i++) {
        m->ids[job->count] = (uint32_t)i;
        job->count += fm_triangle_fits(mesh, i);
    }
    job->spheres = m->spheres;
    job->ids = m->ids;
    scale(field, job);
    if (job->levels >= DESCENT_LEVELS) {
        return fm_fail(FM_ERROR_UNSUPPORTED, "shape is %u x %u x %u: at most %u texels along an axis", job->grid.shape.x,
                       job->grid.shape.y, job->grid.shape.z, 1u << (DESCENT_LEVELS - 1));
    }
    FM_TRY(memory_make(job, m));
    fm_pool_run(pool, job->grid.shape.z, 1, clear, job);
    if (job->count > 0) {
        fm_pool_run(pool, job->count, 4096, make_spheres, job);
        fm_pool_run(pool, m->item_count, 1, use_avx2() ? fm_descend_avx2 : fm_descend_portable, job);
    }
    return FM_OK;
}

fm_result fm_host_nearest(const fm_nearest_field *field) {
    fm_descent job = {.mesh = field->mesh,
                      .grid = field->grid,
                      .hide_beyond = field->hide_beyond,
                      .sided = field->sided,
                      .distance = field->distance,
                      .triangles = field->triangles};
    memory m = {0};
    const fm_result result = run(field, &job, &m);
    memory_free(field->mesh, &m);
    return result;
}
