// SPDX-License-Identifier: MIT
// The pairs of a mesh's triangles that intersect: each triangle looks for those of greater number in the tree.

#include "mesh/bvh.h"
#include "mesh/intersect.h"
#include "mesh/topology.h"

#include <stdatomic.h>

typedef struct search {
    const fm_mesh *mesh;
    uint64_t most;
    atomic_uint_fast64_t pairs;
} search;

typedef struct seeker {
    const fm_mesh *mesh;
    uint32_t triangle, places[3];
    const float *corners[3];
    float low[3], high[3];
    uint64_t pairs;
} seeker;

static void find_corners(const fm_mesh *mesh, uint32_t triangle, const float *corners[3], uint32_t places[3]) {
    for (int k = 0; k < 3; k++) {
        const uint32_t vertex = mesh->triangles[triangle][k];
        corners[k] = mesh->vertices[vertex];
        places[k] = mesh->topology->distinct[vertex];
    }
}

static bool boxes_meet(const seeker *s, const float *const corners[3]) {
    for (int axis = 0; axis < 3; axis++) {
        const float a = corners[0][axis], b = corners[1][axis], c = corners[2][axis];
        if (fminf(a, fminf(b, c)) > s->high[axis] || fmaxf(a, fmaxf(b, c)) < s->low[axis]) {
            return false;
        }
    }
    return true;
}

static bool shares_place(const uint32_t a[3], const uint32_t b[3]) {
    for (int i = 0; i < 3; i++) {
        if (a[i] == b[0] || a[i] == b[1] || a[i] == b[2]) {
            return true;
        }
    }
    return false;
}

static void try_pair(void *user, uint32_t other) {
    seeker *s = user;
    const float *corners[3];
    uint32_t places[3];
    if (other <= s->triangle) {
        return;
    }
    find_corners(s->mesh, other, corners, places);
    s->pairs += boxes_meet(s, corners) && !shares_place(s->places, places) && fm_triangles_intersect(s->corners, corners);
}

static void seek(void *user, uint64_t begin, uint64_t end, uint32_t worker) {
    (void)worker;
    search *all = user;
    for (uint64_t i = begin; i < end; i++) {
        if (all->most > 0 && atomic_load_explicit(&all->pairs, memory_order_relaxed) >= all->most) {
            return;
        }
        if (!fm_triangle_fits(all->mesh, i)) {
            continue;
        }
        seeker s = {.mesh = all->mesh, .triangle = (uint32_t)i};
        find_corners(s.mesh, s.triangle, s.corners, s.places);
        for (int axis = 0; axis < 3; axis++) {
            const float a = s.corners[0][axis], b = s.corners[1][axis], c = s.corners[2][axis];
            s.low[axis] = fminf(a, fminf(b, c));
            s.high[axis] = fmaxf(a, fmaxf(b, c));
        }
        fm_bvh_overlaps(s.mesh, s.low, s.high, try_pair, &s);
        atomic_fetch_add_explicit(&all->pairs, s.pairs, memory_order_relaxed);
    }
}

fm_result fm_mesh_intersections(fm_mesh *mesh, uint64_t most, uint64_t *pairs) {
    if (!mesh || !pairs) {
        return fm_fail(FM_ERROR_INVALID_ARGUMENT, "%s is NULL", mesh ? "pairs" : "mesh");
    }
    FM_TRY(fm_topology_prepare(mesh));
    FM_TRY(fm_bvh_prepare(mesh));
    search all = {.mesh = mesh, .most = most};
    fm_pool_run(mesh->context->pool, mesh->triangle_count, 256, seek, &all);
    *pairs = atomic_load(&all.pairs);
    *pairs = most > 0 && *pairs > most ? most : *pairs;
    return FM_OK;
}

fm_result fm_mesh_intersects(fm_mesh *mesh, bool *intersects) {
    if (!mesh->intersects_known || mesh->intersects_version != mesh->host_version) {
        uint64_t pairs;
        FM_TRY(fm_mesh_intersections(mesh, 1, &pairs));
        mesh->intersects = pairs > 0;
        mesh->intersects_known = true;
        mesh->intersects_version = mesh->host_version;
    }
    *intersects = mesh->intersects;
    return FM_OK;
}
