// SPDX-License-Identifier: MIT
// Voxels of a mesh on the processor. A worker owns a slab of slices. Whether a triangle touches a box, or one of a voxel's middle
// lines, which are boxes without thickness, is decided by the 13 axes of the separating-axis test.

#include "mesh/grid.h"
#include "mesh/voxelize.h"

#include <string.h>

// A triangle in the grid's units, as the axes see it: a box around the centre p can touch it if low <= n . p <= high for each
// axis n. The bounds hold the box's own extent and what rounding may take.
typedef struct axis2 {
    double n[2], low, high;
} axis2;

typedef struct prepared {
    double low[3], high[3];   // along x, y, z
    double normal[3], plane;  // |normal . p - plane| <= reach
    double reach;
    axis2 edges[3][3];  // of the projections along x, y, z
} prepared;

typedef struct job {
    const fm_mesh *mesh;
    const fm_voxelize_desc *desc;
    fm_volume *voxels;
    fm_grid grid;
    fm_slabs slabs;
    int32_t *changes;  // a slice for each worker
    double half[3][3];
    int boxes;
} job;

static void prepare_projection(const double g[3][3], int u, int v, const double half[3], double slack, axis2 edges[3]) {
    for (int i = 0; i < 3; i++) {
        const double *a = g[i], *b = g[(i + 1) % 3];
        axis2 *edge = &edges[i];
        edge->n[0] = a[v] - b[v];
        edge->n[1] = b[u] - a[u];
        double low = INFINITY, high = -INFINITY;
        for (int k = 0; k < 3; k++) {
            const double at = edge->n[0] * g[k][u] + edge->n[1] * g[k][v];
            low = fmin(low, at);
            high = fmax(high, at);
        }
        const double length = fabs(edge->n[0]) + fabs(edge->n[1]);
        const double extent = fabs(edge->n[0]) * half[u] + fabs(edge->n[1]) * half[v] + length * slack;
        edge->low = low - extent;
        edge->high = high + extent;
    }
}

static void prepare(const job *work, uint32_t triangle, const double half[3], prepared *p) {
    double g[3][3], largest = 0;
    for (int corner = 0; corner < 3; corner++) {
        const float *vertex = work->mesh->vertices[work->mesh->triangles[triangle][corner]];
        for (int axis = 0; axis < 3; axis++) {
            const double origin = work->grid.origin[axis], spacing = work->grid.spacing[axis];
            g[corner][axis] = ((double)vertex[axis] - origin) / spacing;
            largest = fmax(largest, fabs(g[corner][axis]) + fabs(origin) / spacing);
        }
    }
    const double slack = ldexp(largest + work->grid.shape.x + work->grid.shape.y + work->grid.shape.z, -49);
    double e[3], f[3], e_length = 0, f_length = 0;
    for (int axis = 0; axis < 3; axis++) {
        p->low[axis] = fmin(g[0][axis], fmin(g[1][axis], g[2][axis])) - half[axis] - slack;
        p->high[axis] = fmax(g[0][axis], fmax(g[1][axis], g[2][axis])) + half[axis] + slack;
        e[axis] = g[1][axis] - g[0][axis];
        f[axis] = g[2][axis] - g[0][axis];
        e_length += fabs(e[axis]);
        f_length += fabs(f[axis]);
    }
    p->reach = e_length * f_length * slack;
    p->plane = 0;
    for (int axis = 0; axis < 3; axis++) {
        const int u = (axis + 1) % 3, v = (axis + 2) % 3;
        p->normal[axis] = e[u] * f[v] - e[v] * f[u];
        p->plane += p->normal[axis] * g[0][axis];
        p->reach += fabs(p->normal[axis]) * half[axis];
        prepare_projection((const double(*)[3])g, u, v, half, slack, p->edges[axis]);
    }
}

static bool passes(const axis2 edges[3], double u, double v) {
    for (int i = 0; i < 3; i++) {
        const double at = edges[i].n[0] * u + edges[i].n[1] * v;
        if (!(at >= edges[i].low && at <= edges[i].high)) {
            return false;
        }
    }
    return true;
}

static void set(fm_volume *voxels, uint32_t x, uint64_t row) {
    if (voxels->desc.type == FM_TYPE_U8) {
        ((uint8_t *)voxels->data)[x + row * voxels->desc.shape.x] = 1;
    } else {
        ((uint32_t *)voxels->data)[x / 32 + row * fm_bits_row_words(voxels->desc.shape)] |= UINT32_C(1) << x % 32;
    }
}

// The indices within [low, high] that are in the grid.
static bool clip(double low, double high, uint32_t from, uint32_t to, uint32_t *first, uint32_t *last) {
    low = fmax(ceil(low), from);
    high = fmin(floor(high), to);
    if (!(low <= high)) {
        return false;
    }
    *first = (uint32_t)low;
    *last = (uint32_t)high;
    return true;
}

// The range of x in a row in which the plane can pass through a box.
static void clip_plane(const prepared *p, double y, double z, double *low, double *high) {
    const double rest = p->plane - p->normal[1] * y - p->normal[2] * z;
    const double a = (rest - p->reach) / p->normal[0], b = (rest + p->reach) / p->normal[0];
    if (p->normal[0] == 0) {
        *high = fabs(rest) <= p->reach ? *high : -INFINITY;
        return;
    }
    // A voxel more on both sides: what the division rounds.
    *low = fmax(*low, fmin(a, b) - 1);
    *high = fmin(*high, fmax(a, b) + 1);
}

static void touch(const job *work, uint32_t triangle, const double half[3], uint32_t z_from, uint32_t z_to) {
    const fm_shape shape = work->grid.shape;
    prepared p;
    prepare(work, triangle, half, &p);
    uint32_t z_first, z_last, y_first, y_last, x_first, x_last;
    if (!clip(p.low[2], p.high[2], z_from, z_to, &z_first, &z_last) ||
        !clip(p.low[1], p.high[1], 0, shape.y - 1, &y_first, &y_last)) {
        return;
    }
    for (uint32_t z = z_first; z <= z_last; z++) {
        for (uint32_t y = y_first; y <= y_last; y++) {
            if (!passes(p.edges[0], y, z)) {
                continue;
            }
            double low = p.low[0], high = p.high[0];
            clip_plane(&p, y, z, &low, &high);
            if (!clip(low, high, 0, shape.x - 1, &x_first, &x_last)) {
                continue;
            }
            for (uint32_t x = x_first; x <= x_last; x++) {
                const double off = p.normal[0] * x + p.normal[1] * y + p.normal[2] * z - p.plane;
                if (fabs(off) <= p.reach && passes(p.edges[1], z, x) && passes(p.edges[2], x, y)) {
                    set(work->voxels, x, y + (uint64_t)shape.y * z);
                }
            }
        }
    }
}

static void fill(const job *work, uint32_t slab, uint32_t z, int32_t *changes) {
    const fm_shape shape = work->grid.shape;
    const uint64_t first = work->slabs.first[slab];
    memset(changes, 0, (uint64_t)shape.x * shape.y * sizeof *changes);
    fm_crossings_add(work->mesh, &work->grid, work->slabs.triangles + first, work->slabs.first[slab + 1] - first, z, changes);
    for (uint32_t y = 0; y < shape.y; y++) {
        int32_t left = 0;
        for (uint32_t x = shape.x; x-- > 0;) {
            left += changes[x + (uint64_t)shape.x * y];
            if (left > 0) {
                set(work->voxels, x, y + (uint64_t)shape.y * z);
            }
        }
    }
}

static void work_slabs(void *user, uint64_t begin, uint64_t end, uint32_t worker) {
    const job *work = user;
    const fm_shape shape = work->grid.shape;
    const uint64_t slice = work->voxels->bytes / shape.z;
    for (uint64_t slab = begin; slab < end; slab++) {
        const uint32_t z_from = (uint32_t)slab * work->slabs.depth;
        const uint32_t z_to = (uint32_t)fm_min_u64(z_from + (uint64_t)work->slabs.depth, shape.z) - 1;
        memset((uint8_t *)work->voxels->data + z_from * slice, 0, (z_to - z_from + 1) * slice);
        for (uint64_t i = work->slabs.first[slab]; i < work->slabs.first[slab + 1]; i++) {
            for (int box = 0; box < work->boxes; box++) {
                touch(work, work->slabs.triangles[i], work->half[box], z_from, z_to);
            }
        }
        for (uint32_t z = z_from; work->changes && z <= z_to; z++) {
            fill(work, (uint32_t)slab, z, work->changes + (uint64_t)shape.x * shape.y * worker);
        }
    }
}

fm_result fm_host_voxelize(fm_mesh *mesh, const fm_voxelize_desc *desc, fm_volume *voxels) {
    fm_context *context = mesh->context;
    job work = {.mesh = mesh, .desc = desc, .voxels = voxels, .grid = {.shape = voxels->desc.shape}};
    memcpy(work.grid.spacing, voxels->desc.spacing, sizeof work.grid.spacing);
    memcpy(work.grid.origin, voxels->desc.origin, sizeof work.grid.origin);
    work.boxes = desc->separation == FM_SEPARATION_26 ? 1 : 3;
    for (int box = 0; box < work.boxes; box++) {
        for (int axis = 0; axis < 3; axis++) {
            work.half[box][axis] = work.boxes == 1 || box == axis ? 0.5 : 0;
        }
    }
    fm_passes_begin(context);
    if (desc->solid) {
        const uint64_t texels = (uint64_t)work.grid.shape.x * work.grid.shape.y * fm_pool_threads(context->pool);
        void *memory;
        FM_TRY(fm_context_scratch(context, texels * sizeof *work.changes, &memory));
        work.changes = memory;
    }
    FM_TRY(fm_slabs_make(mesh, &work.grid, &work.slabs));
    fm_pool_run(context->pool, work.slabs.count, 1, work_slabs, &work);
    fm_slabs_destroy(&context->allocator, &work.slabs);
    fm_passes_end(context, "voxelize", voxels->bytes + mesh->triangle_count * 12);
    return FM_OK;
}
