// SPDX-License-Identifier: MIT
// Meshes that move: each pose turns the mesh a little and sends a wave through it.

#include "fathom/mesh_io.h"
#include "mesh.h"
#include "meshes.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

static const double full_turn = 6.283185307179586, most_angle = 0.15, wave = 0.01, waves = 3, margin = 0.08;

static bool take(bench_mesh *mesh, const float (*vertices)[3], uint64_t vertex_count, const uint32_t (*triangles)[3],
                 uint64_t triangle_count) {
    mesh->vertex_count = vertex_count;
    mesh->triangle_count = triangle_count;
    mesh->triangles = malloc(triangle_count * sizeof *mesh->triangles + 1);
    mesh->poses[0] = malloc(vertex_count * sizeof *vertices + 1);
    if (!mesh->triangles || !mesh->poses[0]) {
        return false;
    }
    memcpy(mesh->triangles, triangles, triangle_count * sizeof *triangles);
    memcpy(mesh->poses[0], vertices, vertex_count * sizeof *vertices);
    return true;
}

static bool take_file(bench_mesh *mesh, const char *path) {
    const fm_context_desc desc = {.backend = FM_BACKEND_CPU};
    fm_context *context = NULL;
    fm_mesh *file = NULL;
    bool good = fm_context_create(&desc, &context) == FM_OK && fm_mesh_read(context, path, NULL, &file, NULL) == FM_OK;
    if (good) {
        const float(*vertices)[3];
        const uint32_t(*triangles)[3];
        uint64_t vertex_count, triangle_count;
        fm_mesh_arrays(file, &vertices, &vertex_count, &triangles, &triangle_count);
        good = take(mesh, vertices, vertex_count, triangles, triangle_count);
    }
    fm_mesh_destroy(file);
    fm_context_destroy(context);
    return good;
}

static bool take_shape(bench_mesh *mesh, const char *name, uint32_t triangles) {
    static const float middle[3] = {0, 0, 0};
    const uint32_t edge = (uint32_t)fmax(3, round(sqrt(triangles / 2.0)));
    scene_mesh shape = {0};
    if (strcmp(name, "torus") == 0) {
        shape = scene_mesh_torus(edge, edge, middle, 0.35f, 0.13f);
    } else if (strcmp(name, "sphere") == 0) {
        shape = scene_mesh_sphere(edge + 1, edge, middle, 0.45f);
    } else if (strcmp(name, "tubes") == 0) {
        shape = scene_mesh_tubes((uint32_t)fmax(3, triangles / 8.0), middle, 0.9f);
    } else if (strcmp(name, "sheet") == 0) {
        shape = scene_mesh_sheet(edge, middle, 0.9f, 0.1f);
    } else {
        return take_file(mesh, name);
    }
    const bool good = shape.triangle_count > 0 && take(mesh, (const float(*)[3])shape.vertices, shape.vertex_count,
                                                       (const uint32_t(*)[3])shape.triangles, shape.triangle_count);
    scene_mesh_free(&shape);
    return good;
}

static void grow(double low[3], double high[3], const float p[3]) {
    for (int i = 0; i < 3; i++) {
        if (isfinite(p[i]) && fabsf(p[i]) < 1e18f) {
            low[i] = fmin(low[i], (double)p[i]);
            high[i] = fmax(high[i], (double)p[i]);
        }
    }
}

// Turned around the axis z of the middle, a wave along x that moves y.
static void pose_vertex(const float from[3], const double middle[3], double size, double time, float to[3]) {
    const double angle = most_angle * sin(time), x = from[0] - middle[0], y = from[1] - middle[1];
    const double bent = y + wave * size * sin(time) * sin(waves * full_turn * x / size);
    to[0] = (float)(middle[0] + x * cos(angle) - bent * sin(angle));
    to[1] = (float)(middle[1] + x * sin(angle) + bent * cos(angle));
    to[2] = from[2];
}

static bool make_poses(bench_mesh *mesh, bool still) {
    double low[3] = {INFINITY, INFINITY, INFINITY}, high[3] = {-INFINITY, -INFINITY, -INFINITY};
    for (uint64_t v = 0; v < mesh->vertex_count; v++) {
        grow(low, high, mesh->poses[0][v]);
    }
    double middle[3], size = 1e-6;
    for (int i = 0; i < 3; i++) {
        middle[i] = low[i] <= high[i] ? (low[i] + high[i]) / 2 : 0;
        size = fmax(size, high[i] - low[i]);
    }
    for (int pose = 1; pose < BENCH_MESH_POSES; pose++) {
        mesh->poses[pose] = malloc(mesh->vertex_count * sizeof **mesh->poses + 1);
        if (!mesh->poses[pose]) {
            return false;
        }
        for (uint64_t v = 0; v < mesh->vertex_count; v++) {
            pose_vertex(mesh->poses[0][v], middle, size, still ? 0 : full_turn * pose / BENCH_MESH_POSES, mesh->poses[pose][v]);
            grow(low, high, mesh->poses[pose][v]);
        }
    }
    double longest = 1e-6;
    for (int i = 0; i < 3; i++) {
        longest = fmax(longest, high[i] - low[i]);
    }
    for (int i = 0; i < 3; i++) {
        const double centre = low[i] <= high[i] ? (low[i] + high[i]) / 2 : 0;
        mesh->low[i] = centre - longest * (0.5 + margin);
        mesh->high[i] = centre + longest * (0.5 + margin);
    }
    return true;
}

bench_mesh *bench_mesh_create(const char *what, uint32_t triangles, bool still) {
    bench_mesh *mesh = calloc(1, sizeof *mesh);
    if (mesh) {
        snprintf(mesh->name, sizeof mesh->name, "%s", what);
        if (take_shape(mesh, what, triangles) && make_poses(mesh, still)) {
            return mesh;
        }
    }
    bench_mesh_destroy(mesh);
    return NULL;
}

void bench_mesh_destroy(bench_mesh *mesh) {
    for (int pose = 0; mesh && pose < BENCH_MESH_POSES; pose++) {
        free(mesh->poses[pose]);
    }
    if (mesh) {
        free(mesh->triangles);
    }
    free(mesh);
}

fm_mesh *bench_mesh_on(const bench_mesh *mesh, fm_context *context, uint32_t pose) {
    const fm_mesh_desc desc = {.vertices = (const float(*)[3])mesh->poses[pose],
                               .vertex_count = mesh->vertex_count,
                               .triangles = (const uint32_t(*)[3])mesh->triangles,
                               .triangle_count = mesh->triangle_count};
    fm_mesh *result = NULL;
    return fm_mesh_create(context, &desc, &result) == FM_OK ? result : NULL;
}
