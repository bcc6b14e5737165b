// SPDX-License-Identifier: MIT
#ifndef FM_TOUCH_H
#define FM_TOUCH_H

// Which voxels of a grid a triangle touches, by the 13 axes of the separating-axis test, in doubles.

#include "mesh/grid.h"

// A triangle in the grid's units, as the axes see it: a box around the centre p can touch it if low <= n . p <= high for each
// axis n. The bounds hold the box's own extent and what rounding may take.
typedef struct fm_touch_axis {
    double n[2], low, high;
} fm_touch_axis;

typedef struct fm_touch_triangle {
    double low[3], high[3];   // along x, y, z
    double normal[3], plane;  // |normal . p - plane| <= reach
    double reach;
    fm_touch_axis edges[3][3];  // of the projections along x, y, z
} fm_touch_triangle;

// Voxels [from, to] along each axis, both included.
typedef struct fm_touch_range {
    uint32_t from[3], to[3];
} fm_touch_range;

// Called for each voxel that is touched, x fastest.
typedef void (*fm_touch_fn)(void *user, uint32_t x, uint32_t y, uint32_t z);

static inline void fm_touch_projection(const double g[3][3], int u, int v, const double half[3], double slack,
                                       fm_touch_axis edges[3]) {
    for (int i = 0; i < 3; i++) {
        const double *a = g[i], *b = g[(i + 1) % 3];
        fm_touch_axis *edge = &edges[i];
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

static inline void fm_touch_prepare(const fm_mesh *mesh, const fm_grid *grid, uint32_t triangle, const double half[3],
                                    fm_touch_triangle *p) {
    double g[3][3], largest = 0;
    for (int corner = 0; corner < 3; corner++) {
        const float *vertex = mesh->vertices[mesh->triangles[triangle][corner]];
        for (int axis = 0; axis < 3; axis++) {
            const double origin = grid->origin[axis], spacing = grid->spacing[axis];
            g[corner][axis] = ((double)vertex[axis] - origin) / spacing;
            largest = fmax(largest, fabs(g[corner][axis]) + fabs(origin) / spacing);
        }
    }
    const double slack = ldexp(largest + grid->shape.x + grid->shape.y + grid->shape.z, -49);
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
        fm_touch_projection((const double(*)[3])g, u, v, half, slack, p->edges[axis]);
    }
}

static inline bool fm_touch_passes(const fm_touch_axis edges[3], double u, double v) {
    for (int i = 0; i < 3; i++) {
        const double at = edges[i].n[0] * u + edges[i].n[1] * v;
        if (!(at >= edges[i].low && at <= edges[i].high)) {
            return false;
        }
    }
    return true;
}

// The indices within [low, high] that are in the grid.
static inline bool fm_touch_clip(double low, double high, uint32_t from, uint32_t to, uint32_t *first, uint32_t *last) {
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
static inline void fm_touch_clip_plane(const fm_touch_triangle *p, double y, double z, double *low, double *high) {
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

// The voxels within the range, as boxes of half extents `half`, that a triangle touches.
static inline void fm_touch(const fm_mesh *mesh, const fm_grid *grid, uint32_t triangle, const double half[3],
                            const fm_touch_range *range, fm_touch_fn fn, void *user) {
    fm_touch_triangle p;
    fm_touch_prepare(mesh, grid, triangle, half, &p);
    uint32_t z_first, z_last, y_first, y_last, x_first, x_last;
    if (!fm_touch_clip(p.low[2], p.high[2], range->from[2], range->to[2], &z_first, &z_last) ||
        !fm_touch_clip(p.low[1], p.high[1], range->from[1], range->to[1], &y_first, &y_last)) {
        return;
    }
    for (uint32_t z = z_first; z <= z_last; z++) {
        for (uint32_t y = y_first; y <= y_last; y++) {
            if (!fm_touch_passes(p.edges[0], y, z)) {
                continue;
            }
            double low = p.low[0], high = p.high[0];
            fm_touch_clip_plane(&p, y, z, &low, &high);
            if (!fm_touch_clip(low, high, range->from[0], range->to[0], &x_first, &x_last)) {
                continue;
            }
            for (uint32_t x = x_first; x <= x_last; x++) {
                const double off = p.normal[0] * x + p.normal[1] * y + p.normal[2] * z - p.plane;
                if (fabs(off) <= p.reach && fm_touch_passes(p.edges[1], z, x) && fm_touch_passes(p.edges[2], x, y)) {
                    fn(user, x, y, z);
                }
            }
        }
    }
}

#endif
