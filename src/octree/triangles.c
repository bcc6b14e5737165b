// SPDX-License-Identifier: MIT
// Triangles in finest cells, and which chunks they come near to.

#include "octree/build.h"

#include <math.h>
#include <string.h>

bool fm_cell_triangle_of(const fm_octree_build *build, const float *const corners[3], fm_cell_triangle *t) {
    double farthest = 0, u[3], v[3];
    for (int axis = 0; axis < 3; axis++) {
        t->low[axis] = INFINITY;
        t->high[axis] = -INFINITY;
        for (int i = 0; i < 3; i++) {
            if (!fm_coordinate_fits(corners[i][axis])) {
                return false;
            }
            const double at = ((double)corners[i][axis] - build->origin[axis]) / build->cell;
            t->corner[i][axis] = at;
            t->low[axis] = fmin(t->low[axis], at);
            t->high[axis] = fmax(t->high[axis], at);
            farthest = fmax(farthest, fabs(at));
        }
        u[axis] = t->corner[1][axis] - t->corner[0][axis];
        v[axis] = t->corner[2][axis] - t->corner[0][axis];
    }
    double sum = 0;
    for (int axis = 0; axis < 3; axis++) {
        const int a = (axis + 1) % 3, b = (axis + 2) % 3;
        t->normal[axis] = u[a] * v[b] - u[b] * v[a];
        sum += fabs(t->normal[axis]);
    }
    t->slack = sum * (farthest + 1) * 1e-12;
    return true;
}

bool fm_cell_triangle_touches(const fm_cell_triangle *t, const double low[3], double edge) {
    double along = 0, reach = 0;
    for (int axis = 0; axis < 3; axis++) {
        if (t->low[axis] > low[axis] + edge || t->high[axis] < low[axis]) {
            return false;
        }
        along += t->normal[axis] * (low[axis] + edge / 2 - t->corner[0][axis]);
        reach += fabs(t->normal[axis]) * edge / 2;
    }
    // Not so that NaN would say no.
    return !(fabs(along) > reach + t->slack);
}

void fm_cell_triangle_chunks(const fm_octree_build *build, const fm_cell_triangle *t, fm_chunk_fn fn, void *user) {
    uint32_t from[3], to[3];
    for (int axis = 0; axis < 3; axis++) {
        const double first = floor((t->low[axis] - build->margin) / FM_CHUNK);
        const double last = floor((t->high[axis] + build->margin) / FM_CHUNK);
        if (last < 0 || first >= build->chunks[axis]) {
            return;
        }
        from[axis] = (uint32_t)fmax(first, 0);
        to[axis] = (uint32_t)fmin(last, build->chunks[axis] - 1.0);
    }
    for (uint32_t z = from[2]; z <= to[2]; z++) {
        for (uint32_t y = from[1]; y <= to[1]; y++) {
            for (uint32_t x = from[0]; x <= to[0]; x++) {
                const double low[3] = {x * (double)FM_CHUNK - build->margin, y * (double)FM_CHUNK - build->margin,
                                       z * (double)FM_CHUNK - build->margin};
                if (fm_cell_triangle_touches(t, low, FM_CHUNK + 2 * build->margin)) {
                    fn(user, fm_node_at(build->chunks, x, y, z));
                }
            }
        }
    }
}

static void count_one(void *user, uint64_t chunk) {
    uint64_t *first = user;
    first[chunk + 1]++;
}

typedef struct filling {
    uint64_t *next;
    uint32_t *listed, number;
} filling;

static void list_one(void *user, uint64_t chunk) {
    filling *job = user;
    job->listed[job->next[chunk]++] = job->number;
}

static void corners_of(const fm_mesh *mesh, uint64_t triangle, const float *corners[3]) {
    for (int i = 0; i < 3; i++) {
        corners[i] = mesh->vertices[mesh->triangles[triangle][i]];
    }
}

// A visit to every triangle that takes part: counts, marks what is far from them, or lists.
static void visit(fm_octree_build *build, filling *job) {
    const fm_mesh *mesh = build->mesh;
    for (uint64_t i = 0; i < mesh->triangle_count; i++) {
        const float *corners[3];
        fm_cell_triangle t;
        corners_of(mesh, i, corners);
        if (!fm_cell_triangle_of(build, corners, &t)) {
            continue;
        }
        if (job) {
            job->number = (uint32_t)i;
            fm_cell_triangle_chunks(build, &t, list_one, job);
        } else {
            fm_cell_triangle_chunks(build, &t, count_one, build->first);
            fm_octree_far_mark(build, &build->far, &t);
        }
    }
}

fm_result fm_octree_sort_mesh(fm_octree_build *build) {
    fm_context *context = build->context;
    const uint64_t bytes = (build->chunk_count + 1) * sizeof(uint64_t);
    build->first = fm_octree_alloc_zero(context, bytes, "lists of triangles");
    if (!build->first) {
        return FM_ERROR_OUT_OF_HOST_MEMORY;
    }
    visit(build, NULL);
    for (uint64_t i = 0; i < build->chunk_count; i++) {
        build->first[i + 1] += build->first[i];
    }
    filling job = {.next = fm_octree_alloc(context, bytes, "lists of triangles")};
    build->listed = fm_octree_alloc(context, build->first[build->chunk_count] * sizeof(uint32_t), "lists of triangles");
    job.listed = build->listed;
    if (job.next && job.listed) {
        memcpy(job.next, build->first, bytes);
        visit(build, &job);
    }
    fm_octree_free(context, job.next, bytes);
    return job.next && job.listed ? FM_OK : FM_ERROR_OUT_OF_HOST_MEMORY;
}

void fm_octree_soup_free(const fm_octree_build *build, fm_octree_soup *soup) {
    fm_context *context = build->context;
    fm_octree_free(context, soup->mesh.vertices, soup->room * 3 * sizeof *soup->mesh.vertices);
    fm_octree_free(context, soup->mesh.triangles, soup->room * sizeof *soup->mesh.triangles);
    fm_octree_free(context, soup->numbers, soup->room * sizeof *soup->numbers);
    fm_octree_free(context, soup->paint, soup->room * sizeof *soup->paint);
    *soup = (fm_octree_soup){0};
}

fm_result fm_octree_soup_reserve(const fm_octree_build *build, fm_octree_soup *soup, uint64_t count, bool paint) {
    fm_context *context = build->context;
    soup->mesh.context = build->context;
    soup->mesh.triangle_count = soup->mesh.vertex_count = 0;
    if (count <= soup->room) {
        return FM_OK;
    }
    if (count > UINT32_MAX / 3) {
        return fm_fail(FM_ERROR_UNSUPPORTED, "%llu triangles come near to one chunk: at most %u", (unsigned long long)count,
                       UINT32_MAX / 3);
    }
    fm_octree_soup_free(build, soup);
    soup->mesh.context = build->context;
    soup->room = count + count / 4;
    soup->mesh.vertices = fm_octree_alloc(context, soup->room * 3 * sizeof *soup->mesh.vertices, "triangles near a chunk");
    soup->mesh.triangles = fm_octree_alloc(context, soup->room * sizeof *soup->mesh.triangles, "triangles near a chunk");
    soup->numbers = fm_octree_alloc(context, soup->room * sizeof *soup->numbers, "triangles near a chunk");
    soup->paint = paint ? fm_octree_alloc(context, soup->room * sizeof *soup->paint, "triangles near a chunk") : NULL;
    if (!soup->mesh.vertices || !soup->mesh.triangles || !soup->numbers || (paint && !soup->paint)) {
        fm_octree_soup_free(build, soup);
        return FM_ERROR_OUT_OF_HOST_MEMORY;
    }
    return FM_OK;
}

void fm_octree_soup_add(const fm_octree_build *build, fm_octree_soup *soup, uint64_t chunk, uint32_t number,
                        const float *const corners[3]) {
    fm_mesh *mesh = &soup->mesh;
    const uint64_t row = chunk / build->chunks[0];
    const uint64_t at[3] = {chunk % build->chunks[0], row % build->chunks[1], row / build->chunks[1]};
    const uint64_t i = mesh->triangle_count++;
    for (uint32_t corner = 0; corner < 3; corner++) {
        for (int axis = 0; axis < 3; axis++) {
            const double place = ((double)corners[corner][axis] - build->origin[axis]) / build->cell;
            mesh->vertices[3 * i + corner][axis] = (float)(place - (double)at[axis] * FM_CHUNK);
        }
        mesh->triangles[i][corner] = (uint32_t)(3 * i + corner);
    }
    mesh->vertex_count += 3;
    soup->numbers[i] = number;
}

static void paint_corner(const fm_octree_build *build, uint32_t vertex, uint32_t paint[2]) {
    if (build->desc->attribute == FM_OCTREE_COLOR) {
        memcpy(&paint[0], build->desc->colors[vertex], sizeof paint[0]);
    } else {
        memcpy(paint, build->desc->texture[vertex], 2 * sizeof paint[0]);
    }
}

fm_result fm_octree_soup_of_mesh(fm_octree_build *build, uint64_t chunk, fm_octree_soup *soup) {
    const bool paint = build->desc->attribute >= FM_OCTREE_COLOR;
    const fm_mesh *mesh = build->mesh;
    FM_TRY(fm_octree_soup_reserve(build, soup, build->first[chunk + 1] - build->first[chunk], paint));
    for (uint64_t i = build->first[chunk]; i < build->first[chunk + 1]; i++) {
        const uint32_t number = build->listed[i];
        const float *corners[3];
        corners_of(mesh, number, corners);
        const uint64_t at = soup->mesh.triangle_count;
        fm_octree_soup_add(build, soup, chunk, number, corners);
        for (int corner = 0; paint && corner < 3; corner++) {
            paint_corner(build, mesh->triangles[number][corner], soup->paint[at][corner]);
        }
    }
    return FM_OK;
}
