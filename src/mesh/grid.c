// SPDX-License-Identifier: MIT
#include "mesh/grid.h"

#include <string.h>

enum { SLAB_DEPTH = 8 };

// The indices [first, last] along an axis that come within a voxel of the triangle; empty outside of the grid.
static bool reach(const fm_mesh *mesh, const fm_grid *grid, const uint32_t corners[3], int axis, uint32_t size, uint32_t *first,
                  uint32_t *last) {
    const double a = (double)mesh->vertices[corners[0]][axis];
    const double b = (double)mesh->vertices[corners[1]][axis];
    const double c = (double)mesh->vertices[corners[2]][axis];
    const double low = ceil((fmin(a, fmin(b, c)) - grid->origin[axis]) / grid->spacing[axis] - 1);
    const double high = floor((fmax(a, fmax(b, c)) - grid->origin[axis]) / grid->spacing[axis] + 1);
    if (!(low <= size - 1.0 && high >= 0)) {
        return false;
    }
    *first = (uint32_t)fmax(low, 0);
    *last = (uint32_t)fmin(high, size - 1.0);
    return true;
}

static bool slabs_of(const fm_mesh *mesh, const fm_grid *grid, uint64_t triangle, uint32_t *first, uint32_t *last) {
    uint32_t y_first, y_last;
    const uint32_t *corners = mesh->triangles[triangle];
    if (!fm_triangle_fits(mesh, triangle) || !reach(mesh, grid, corners, 1, grid->shape.y, &y_first, &y_last) ||
        !reach(mesh, grid, corners, 2, grid->shape.z, first, last)) {
        return false;
    }
    *first /= SLAB_DEPTH;
    *last /= SLAB_DEPTH;
    return true;
}

fm_result fm_slabs_make(const fm_mesh *mesh, const fm_grid *grid, fm_slabs *slabs) {
    const fm_allocator *allocator = &mesh->context->allocator;
    *slabs = (fm_slabs){.depth = SLAB_DEPTH, .count = (uint32_t)fm_div_up(grid->shape.z, SLAB_DEPTH)};
    slabs->first = fm_alloc_zero(allocator, (slabs->count + UINT64_C(1)) * sizeof *slabs->first, "lists of triangles");
    if (!slabs->first) {
        return FM_ERROR_OUT_OF_HOST_MEMORY;
    }
    uint32_t first, last;
    for (uint64_t i = 0; i < mesh->triangle_count; i++) {
        if (slabs_of(mesh, grid, i, &first, &last)) {
            for (uint32_t slab = first; slab <= last; slab++) {
                slabs->first[slab + 1]++;
            }
        }
    }
    for (uint32_t slab = 0; slab < slabs->count; slab++) {
        slabs->first[slab + 1] += slabs->first[slab];
    }
    slabs->triangles = fm_alloc(allocator, slabs->first[slabs->count] * sizeof *slabs->triangles, "lists of triangles");
    if (!slabs->triangles) {
        fm_slabs_destroy(allocator, slabs);
        return FM_ERROR_OUT_OF_HOST_MEMORY;
    }
    // The starts serve as ends while the lists fill, and are moved back by a slab afterwards.
    for (uint64_t i = 0; i < mesh->triangle_count; i++) {
        if (slabs_of(mesh, grid, i, &first, &last)) {
            for (uint32_t slab = first; slab <= last; slab++) {
                slabs->triangles[slabs->first[slab]++] = (uint32_t)i;
            }
        }
    }
    memmove(slabs->first + 1, slabs->first, slabs->count * sizeof *slabs->first);
    slabs->first[0] = 0;
    return FM_OK;
}

void fm_slabs_destroy(const fm_allocator *allocator, fm_slabs *slabs) {
    if (slabs->first && slabs->triangles) {
        fm_free(allocator, slabs->triangles, slabs->first[slabs->count] * sizeof *slabs->triangles);
    }
    fm_free(allocator, slabs->first, (slabs->count + UINT64_C(1)) * sizeof *slabs->first);
    *slabs = (fm_slabs){0};
}

// How often the triangle's outline goes around the ray, counter-clockwise seen from +x: 1 where the ray leaves, -1 where it enters.
// Each edge is judged from its lower end, whichever triangle asks.
static int around(const float *const corners[3], double y, double z) {
    int turns = 0;
    for (int i = 0; i < 3; i++) {
        const float *from = corners[i], *to = corners[(i + 1) % 3];
        const bool rises = (double)from[1] <= y;
        if (rises == ((double)to[1] <= y)) {
            continue;
        }
        const float *low = rises ? from : to, *high = rises ? to : from;
        const double side = ((double)low[2] - z) * ((double)high[1] - y) - ((double)high[2] - z) * ((double)low[1] - y);
        if (side > 0) {
            turns += rises ? -1 : 1;
        }
    }
    return turns;
}

// Where the ray meets the triangle's plane, within the triangle's box.
static double crossing(const float *const corners[3], double y, double z) {
    const float *a = corners[0], *b = corners[1], *c = corners[2];
    double e[3], f[3];
    for (int axis = 0; axis < 3; axis++) {
        e[axis] = (double)b[axis] - (double)a[axis];
        f[axis] = (double)c[axis] - (double)a[axis];
    }
    const double normal[3] = {e[1] * f[2] - e[2] * f[1], e[2] * f[0] - e[0] * f[2], e[0] * f[1] - e[1] * f[0]};
    const double x = (double)a[0] - (normal[1] * (y - (double)a[1]) + normal[2] * (z - (double)a[2])) / normal[0];
    const double low = fmin((double)a[0], fmin((double)b[0], (double)c[0]));
    const double high = fmax((double)a[0], fmax((double)b[0], (double)c[0]));
    return fmin(fmax(x, low), high);  // fmax takes the other number where the division gave none
}

void fm_crossings_add(const fm_mesh *mesh, const fm_grid *grid, const uint32_t *triangles, uint64_t count, uint32_t z,
                      int32_t *changes) {
    const double at_z = fm_grid_at(grid, 2, z);
    for (uint64_t i = 0; i < count; i++) {
        const uint32_t *indices = mesh->triangles[triangles[i]];
        const float *const corners[3] = {mesh->vertices[indices[0]], mesh->vertices[indices[1]], mesh->vertices[indices[2]]};
        const int above = ((double)corners[0][2] > at_z) + ((double)corners[1][2] > at_z) + ((double)corners[2][2] > at_z);
        const int below = ((double)corners[0][2] < at_z) + ((double)corners[1][2] < at_z) + ((double)corners[2][2] < at_z);
        uint32_t first, last;
        if (above == 3 || below == 3 || !reach(mesh, grid, indices, 1, grid->shape.y, &first, &last)) {
            continue;
        }
        for (uint32_t y = first; y <= last; y++) {
            const double at_y = fm_grid_at(grid, 1, y);
            const int turns = around(corners, at_y, at_z);
            if (turns == 0) {
                continue;
            }
            const double x = floor((crossing(corners, at_y, at_z) - grid->origin[0]) / grid->spacing[0]);
            if (x >= 0) {
                changes[(uint64_t)fmin(x, grid->shape.x - 1.0) + (uint64_t)grid->shape.x * y] += turns;
            }
        }
    }
}
