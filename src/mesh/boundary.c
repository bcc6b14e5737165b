// SPDX-License-Identifier: MIT
#include "mesh/boundary.h"

#include "mesh/topology.h"

#include <stdlib.h>

// An edge as a triangle runs along it.
typedef struct half_edge {
    uint32_t low, high;  // numbers of positions
    uint32_t from, to;   // vertices, from low to high
    int32_t direction;
} half_edge;

static int compare(const void *a, const void *b) {
    const half_edge *x = a, *y = b;
    if (x->low != y->low) {
        return x->low < y->low ? -1 : 1;
    }
    return x->high < y->high ? -1 : x->high > y->high;
}

// Whether the triangle across the edge runs along it the other way, so that the two cancel.
static bool cancels(const fm_mesh *mesh, uint64_t triangle, int edge) {
    const fm_topology *topology = mesh->topology;
    const uint32_t other = topology->across[triangle][edge];
    if (other == FM_NO_TRIANGLE || !fm_triangle_fits(mesh, other)) {
        return false;
    }
    const uint32_t from = topology->distinct[mesh->triangles[triangle][edge]];
    const uint32_t to = topology->distinct[mesh->triangles[triangle][(edge + 1) % 3]];
    for (int i = 0; i < 3; i++) {
        if (topology->distinct[mesh->triangles[other][i]] == to &&
            topology->distinct[mesh->triangles[other][(i + 1) % 3]] == from) {
            return true;
        }
    }
    return false;
}

// Lists the edges that do not cancel with the triangle across; counts them when `list` is NULL.
static uint64_t list_edges(const fm_mesh *mesh, half_edge *list) {
    uint64_t count = 0;
    for (uint64_t i = 0; i < mesh->triangle_count; i++) {
        for (int edge = 0; fm_triangle_fits(mesh, i) && edge < 3; edge++) {
            const uint32_t from = mesh->triangles[i][edge], to = mesh->triangles[i][(edge + 1) % 3];
            const uint32_t a = mesh->topology->distinct[from], b = mesh->topology->distinct[to];
            if (a == b || cancels(mesh, i, edge)) {
                continue;
            }
            if (list) {
                list[count] = a < b ? (half_edge){a, b, from, to, 1} : (half_edge){b, a, to, from, -1};
            }
            count++;
        }
    }
    return count;
}

static void add_edge(const fm_mesh *mesh, const half_edge *edge, int32_t times, fm_boundary *boundary) {
    fm_boundary_edge *result = &boundary->edges[boundary->count++];
    for (int axis = 0; axis < 3; axis++) {
        const float *from = mesh->vertices[times > 0 ? edge->from : edge->to],
                    *to = mesh->vertices[times > 0 ? edge->to : edge->from];
        result->from[axis] = (double)from[axis];
        result->to[axis] = (double)to[axis];
    }
    result->times = abs(times);
}

fm_result fm_boundary_make(fm_mesh *mesh, fm_boundary *boundary) {
    const fm_allocator *allocator = &mesh->context->allocator;
    *boundary = (fm_boundary){0};
    FM_TRY(fm_topology_prepare(mesh));
    const uint64_t count = list_edges(mesh, NULL);
    if (count == 0) {
        return FM_OK;
    }
    half_edge *list = fm_alloc(allocator, count * sizeof *list, "a mesh's boundary");
    boundary->edges = fm_alloc(allocator, count * sizeof *boundary->edges, "a mesh's boundary");
    boundary->capacity = count;
    if (!list || !boundary->edges) {
        fm_free(allocator, list, count * sizeof *list);
        fm_boundary_destroy(allocator, boundary);
        return FM_ERROR_OUT_OF_HOST_MEMORY;
    }
    list_edges(mesh, list);
    qsort(list, count, sizeof *list, compare);
    for (uint64_t i = 0; i < count;) {
        const uint64_t first = i;
        int32_t times = 0;
        for (; i < count && compare(&list[first], &list[i]) == 0; i++) {
            times += list[i].direction;
        }
        if (times != 0) {
            add_edge(mesh, &list[first], times, boundary);
        }
    }
    fm_free(allocator, list, count * sizeof *list);
    return FM_OK;
}

void fm_boundary_destroy(const fm_allocator *allocator, fm_boundary *boundary) {
    fm_free(allocator, boundary->edges, boundary->capacity * sizeof *boundary->edges);
    *boundary = (fm_boundary){0};
}

double fm_boundary_gradient(const fm_boundary *boundary, const double at[3], double radius) {
    double sum = 0;
    for (uint64_t i = 0; i < boundary->count; i++) {
        const fm_boundary_edge *edge = &boundary->edges[i];
        double distance2 = 0, length2 = 0;
        for (int axis = 0; axis < 3; axis++) {
            const double offset = at[axis] - (edge->from[axis] + edge->to[axis]) / 2, along = edge->to[axis] - edge->from[axis];
            distance2 += offset * offset;
            length2 += along * along;
        }
        const double length = sqrt(length2), left = sqrt(distance2) - radius - length / 2;
        if (left <= 0) {
            return INFINITY;
        }
        sum += edge->times * length / (left * left);
    }
    return sum / (4 * 3.14159265358979323846);
}

typedef struct turn {
    double x, y;
} turn;

static turn turn_by(turn a, turn b) {
    const turn both = {a.x * b.x - a.y * b.y, a.x * b.y + a.y * b.x};
    const double size = fabs(both.x) + fabs(both.y);
    return size > 0 ? (turn){both.x / size, both.y / size} : a;
}

// Turned by half the solid angle of the spherical triangle of the directions to an edge's ends and of -x.
static turn curtain_of(const fm_boundary_edge *edge, const double at[3]) {
    double a[3], b[3];
    for (int axis = 0; axis < 3; axis++) {
        a[axis] = edge->from[axis] - at[axis];
        b[axis] = edge->to[axis] - at[axis];
    }
    const double a_length = sqrt(a[0] * a[0] + a[1] * a[1] + a[2] * a[2]);
    const double b_length = sqrt(b[0] * b[0] + b[1] * b[1] + b[2] * b[2]);
    // Van Oosterom and Strackee 1983, with the third direction (-1, 0, 0).
    return (turn){a_length * b_length + (a[0] * b[0] + a[1] * b[1] + a[2] * b[2]) - a[0] * b_length - b[0] * a_length,
                  a[2] * b[1] - a[1] * b[2]};
}

double fm_boundary_curtain(const fm_boundary *boundary, const double at[3]) {
    // A winding number of 1 is a full turn of halves of solid angles, so that whole ones fall away.
    turn sum = {1, 0};
    for (uint64_t i = 0; i < boundary->count; i++) {
        const turn one = curtain_of(&boundary->edges[i], at);
        for (int32_t k = 0; k < boundary->edges[i].times; k++) {
            sum = turn_by(sum, one);
        }
    }
    // The curtain runs along each edge against the mesh.
    return -atan2(sum.y, sum.x) / (2 * 3.14159265358979323846);
}
