// SPDX-License-Identifier: MIT
#include "mesh/bvh.h"

#include "mesh/triangle.h"

#include <assert.h>
#include <float.h>
#include <string.h>

enum { LEAF_TRIANGLES = 4, MOST_DEPTH = 64 };

typedef struct node {
    float low[3], high[3];
    uint32_t first;  // triangle of a leaf, or left child; the right one follows it
    uint32_t count;  // triangles; 0: no leaf
} node;

struct fm_bvh {
    uint64_t version, built_version;
    node *nodes;
    uint32_t *order;
    uint32_t node_count, node_room, triangle_count, order_room;
};

void fm_bvh_destroy(const fm_allocator *allocator, fm_bvh *bvh) {
    if (!bvh) {
        return;
    }
    fm_free(allocator, bvh->nodes, bvh->node_room * sizeof *bvh->nodes);
    fm_free(allocator, bvh->order, bvh->order_room * sizeof *bvh->order);
    fm_free(allocator, bvh, sizeof *bvh);
}

static void box_of(const fm_mesh *mesh, const uint32_t *order, uint32_t count, float low[3], float high[3]) {
    for (int axis = 0; axis < 3; axis++) {
        low[axis] = FLT_MAX;
        high[axis] = -FLT_MAX;
    }
    for (uint32_t i = 0; i < count; i++) {
        for (int k = 0; k < 3; k++) {
            const float *p = mesh->vertices[mesh->triangles[order[i]][k]];
            for (int axis = 0; axis < 3; axis++) {
                low[axis] = fminf(low[axis], p[axis]);
                high[axis] = fmaxf(high[axis], p[axis]);
            }
        }
    }
}

static float centre(const fm_mesh *mesh, uint32_t triangle, int axis) {
    const uint32_t *corners = mesh->triangles[triangle];
    return mesh->vertices[corners[0]][axis] / 3 + mesh->vertices[corners[1]][axis] / 3 + mesh->vertices[corners[2]][axis] / 3;
}

// Puts the smaller half in front.
static void select_half(const fm_mesh *mesh, uint32_t *order, int64_t count, int axis) {
    int64_t first = 0, last = count - 1;
    const int64_t middle = count / 2;
    while (first < last) {
        const float pivot = centre(mesh, order[(first + last) / 2], axis);
        int64_t i = first, j = last;
        while (i <= j) {
            while (centre(mesh, order[i], axis) < pivot) {
                i++;
            }
            while (pivot < centre(mesh, order[j], axis)) {
                j--;
            }
            if (i <= j) {
                const uint32_t swapped = order[i];
                order[i++] = order[j];
                order[j--] = swapped;
            }
        }
        if (middle <= j) {
            last = j;
        } else if (middle >= i) {
            first = i;
        } else {
            return;
        }
    }
}

static void split(const fm_mesh *mesh, fm_bvh *bvh, uint32_t number, uint32_t first, uint32_t count) {
    node *here = &bvh->nodes[number];
    box_of(mesh, bvh->order + first, count, here->low, here->high);
    if (count <= LEAF_TRIANGLES) {
        here->first = first;
        here->count = count;
        return;
    }
    int longest = 0;
    for (int axis = 1; axis < 3; axis++) {
        longest = here->high[axis] - here->low[axis] > here->high[longest] - here->low[longest] ? axis : longest;
    }
    select_half(mesh, bvh->order + first, count, longest);
    here->first = bvh->node_count;
    here->count = 0;
    bvh->node_count += 2;
    split(mesh, bvh, here->first, first, count / 2);
    split(mesh, bvh, here->first + 1, first + count / 2, count - count / 2);
}

fm_result fm_bvh_prepare(fm_mesh *mesh) {
    if (mesh->bvh && mesh->bvh->version == mesh->version) {
        return FM_OK;
    }
    const fm_allocator *allocator = &mesh->context->allocator;
    fm_bvh *bvh = fm_alloc_zero(allocator, sizeof *bvh, "a tree");
    if (!bvh) {
        return FM_ERROR_OUT_OF_HOST_MEMORY;
    }
    bvh->order_room = (uint32_t)mesh->triangle_count;
    bvh->node_room = 2 * (uint32_t)mesh->triangle_count + 1;
    bvh->order = fm_alloc(allocator, bvh->order_room * sizeof *bvh->order, "a tree's triangles");
    bvh->nodes = fm_alloc(allocator, bvh->node_room * sizeof *bvh->nodes, "a tree's nodes");
    if (!bvh->order || !bvh->nodes) {
        fm_bvh_destroy(allocator, bvh);
        return FM_ERROR_OUT_OF_HOST_MEMORY;
    }
    for (uint32_t i = 0; i < bvh->order_room; i++) {
        if (fm_triangle_fits(mesh, i)) {
            bvh->order[bvh->triangle_count++] = i;
        }
    }
    if (bvh->triangle_count > 0) {
        bvh->node_count = 1;
        split(mesh, bvh, 0, 0, bvh->triangle_count);
    }
    bvh->version = mesh->version;
    fm_bvh_destroy(allocator, mesh->bvh);
    mesh->bvh = bvh;
    return FM_OK;
}

static float box_distance2(const node *box, const float p[3]) {
    float sum = 0;
    for (int axis = 0; axis < 3; axis++) {
        const float beside = fmaxf(fmaxf(box->low[axis] - p[axis], p[axis] - box->high[axis]), 0);
        sum += beside * beside;
    }
    return sum;
}

void fm_bvh_nearest(const fm_mesh *mesh, const float position[3], fm_nearest *nearest) {
    const fm_bvh *bvh = mesh->bvh;
    uint32_t stack[2 * MOST_DEPTH];
    int depth = 0;
    if (bvh->node_count > 0 && fm_coordinate_fits(position[0]) && fm_coordinate_fits(position[1]) &&
        fm_coordinate_fits(position[2])) {
        stack[depth++] = 0;
    }
    while (depth > 0) {
        const node *here = &bvh->nodes[stack[--depth]];
        // A box that is as near as the bound is looked into: its distance is rounded too.
        if (box_distance2(here, position) > nearest->distance2) {
            continue;
        }
        if (here->count == 0) {
            const uint32_t left = here->first;
            const bool right_first = box_distance2(&bvh->nodes[left + 1], position) < box_distance2(&bvh->nodes[left], position);
            stack[depth++] = right_first ? left : left + 1;
            stack[depth++] = right_first ? left + 1 : left;
        }
        for (uint32_t i = 0; i < here->count; i++) {
            const fm_nearest found = fm_triangle_nearest(mesh, bvh->order[here->first + i], position);
            if (found.distance2 < nearest->distance2) {
                *nearest = found;
            }
        }
    }
}

static bool box_is_hit(const node *box, const fm_mesh_ray *ray, float last) {
    double from = ray->first, to = last;
    for (int axis = 0; axis < 3; axis++) {
        if (ray->direction[axis] == 0) {
            if (ray->origin[axis] < box->low[axis] || ray->origin[axis] > box->high[axis]) {
                return false;
            }
            continue;
        }
        const double a = ((double)box->low[axis] - ray->origin[axis]) / ray->direction[axis];
        const double b = ((double)box->high[axis] - ray->origin[axis]) / ray->direction[axis];
        from = fmax(from, fmin(a, b));
        to = fmin(to, fmax(a, b));
    }
    return from <= to * (1 + 1e-12);
}

fm_mesh_hit fm_bvh_cast(const fm_mesh *mesh, const fm_mesh_ray *ray, bool any) {
    const fm_bvh *bvh = mesh->bvh;
    fm_mesh_hit hit = {.t = INFINITY, .triangle = FM_NO_TRIANGLE};
    fm_sheared_ray sheared;
    uint32_t stack[2 * MOST_DEPTH];
    int depth = 0;
    if (bvh->node_count > 0 && fm_ray_shear(ray, &sheared)) {
        stack[depth++] = 0;
    }
    while (depth > 0) {
        const node *here = &bvh->nodes[stack[--depth]];
        if (!box_is_hit(here, ray, fminf(ray->last, hit.t))) {
            continue;
        }
        if (here->count == 0) {
            stack[depth++] = here->first;
            stack[depth++] = here->first + 1;
        }
        for (uint32_t i = 0; i < here->count; i++) {
            fm_ray_triangle(mesh, bvh->order[here->first + i], &sheared, &hit);
            if (any && hit.triangle != FM_NO_TRIANGLE) {
                return hit;
            }
        }
    }
    return hit;
}
