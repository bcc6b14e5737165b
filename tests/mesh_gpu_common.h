// SPDX-License-Identifier: MIT
#ifndef FM_MESH_GPU_COMMON_H
#define FM_MESH_GPU_COMMON_H

// Meshes, positions and an oracle in doubles for the tests of meshes on Vulkan.

#include "meshes.h"
#include "random.h"
#include "vulkan_common.h"

#include <float.h>
#include <math.h>

static inline float uniform(uint64_t *seed, float low, float high) {
    return low + (high - low) * (float)(test_random(seed) >> 40) / 16777216.0f;
}

static inline bool corner_fits(const float p[3]) {
    return fabsf(p[0]) <= 1e18f && fabsf(p[1]) <= 1e18f && fabsf(p[2]) <= 1e18f;
}

static inline bool triangle_fits(const scene_mesh *mesh, uint64_t i) {
    const uint32_t *t = mesh->triangles[i];
    return corner_fits(mesh->vertices[t[0]]) && corner_fits(mesh->vertices[t[1]]) && corner_fits(mesh->vertices[t[2]]);
}

// The box of what fits, and the largest coordinate.
static inline float mesh_box(const scene_mesh *mesh, float low[3], float high[3]) {
    float largest = 0;
    for (int axis = 0; axis < 3; axis++) {
        low[axis] = FLT_MAX, high[axis] = -FLT_MAX;
    }
    for (uint64_t i = 0; i < mesh->triangle_count; i++) {
        for (int k = 0; k < 3 && triangle_fits(mesh, i); k++) {
            for (int axis = 0; axis < 3; axis++) {
                const float x = mesh->vertices[mesh->triangles[i][k]][axis];
                low[axis] = fminf(low[axis], x), high[axis] = fmaxf(high[axis], x);
                largest = fmaxf(largest, fabsf(x));
            }
        }
    }
    return largest;
}

typedef struct vector3 {
    double x, y, z;
} vector3;

static inline vector3 from(const float a[3], const float b[3]) {
    return (vector3){(double)b[0] - a[0], (double)b[1] - a[1], (double)b[2] - a[2]};
}

static inline double dot3(vector3 a, vector3 b) {
    return a.x * b.x + a.y * b.y + a.z * b.z;
}

static inline vector3 cross3(vector3 a, vector3 b) {
    return (vector3){a.y * b.z - a.z * b.y, a.z * b.x - a.x * b.z, a.x * b.y - a.y * b.x};
}

static inline vector3 add3(vector3 a, vector3 b, double scale) {
    return (vector3){a.x + scale * b.x, a.y + scale * b.y, a.z + scale * b.z};
}

static inline double segment_distance2(vector3 a, vector3 b) {
    const vector3 e = add3(b, a, -1);
    const double length2 = dot3(e, e);
    const double t = length2 > 0 ? fmin(fmax(-dot3(a, e) / length2, 0), 1) : 0;
    const vector3 q = add3(a, e, t);
    return dot3(q, q);
}

// Squared distance of a triangle.
static inline double oracle_distance2(const scene_mesh *mesh, uint64_t i, const float p[3]) {
    const uint32_t *t = mesh->triangles[i];
    const vector3 a = from(p, mesh->vertices[t[0]]), b = from(p, mesh->vertices[t[1]]), c = from(p, mesh->vertices[t[2]]);
    const double edges = fmin(fmin(segment_distance2(a, b), segment_distance2(b, c)), segment_distance2(c, a));
    const vector3 n = cross3(from(mesh->vertices[t[0]], mesh->vertices[t[1]]), from(mesh->vertices[t[0]], mesh->vertices[t[2]]));
    const double n2 = dot3(n, n);
    if (n2 > 0 && dot3(cross3(a, b), n) >= 0 && dot3(cross3(b, c), n) >= 0 && dot3(cross3(c, a), n) >= 0) {
        return fmin(edges, dot3(a, n) * dot3(a, n) / n2);
    }
    return edges;
}

static inline double oracle_nearest2(const scene_mesh *mesh, const float p[3]) {
    double best = INFINITY;
    for (uint64_t i = 0; i < mesh->triangle_count; i++) {
        best = triangle_fits(mesh, i) ? fmin(best, oracle_distance2(mesh, i, p)) : best;
    }
    return best;
}

static inline double oracle_solid_angle(const scene_mesh *mesh, uint64_t i, const float p[3]) {
    const uint32_t *t = mesh->triangles[i];
    const vector3 a = from(p, mesh->vertices[t[0]]), b = from(p, mesh->vertices[t[1]]), c = from(p, mesh->vertices[t[2]]);
    const double la = sqrt(dot3(a, a)), lb = sqrt(dot3(b, b)), lc = sqrt(dot3(c, c));
    return 2 * atan2(dot3(a, cross3(add3(b, a, -1), add3(c, a, -1))),
                     la * lb * lc + dot3(a, b) * lc + dot3(b, c) * la + dot3(c, a) * lb);
}

static inline double oracle_winding(const scene_mesh *mesh, const float p[3]) {
    double sum = 0;
    for (uint64_t i = 0; i < mesh->triangle_count; i++) {
        sum += triangle_fits(mesh, i) ? oracle_solid_angle(mesh, i, p) : 0;
    }
    return sum / (4 * 3.14159265358979323846);
}

// ---------------------------------------------------------------------------------------------------------------------------
// Meshes that a tree may stumble over
// ---------------------------------------------------------------------------------------------------------------------------

static inline scene_mesh bad_soup(uint32_t triangles, uint64_t seed) {
    scene_mesh mesh = scene_mesh_soup(triangles, seed, (const float[]){0, 0, 0}, 2, 0.3f);
    for (uint64_t i = 0; i < mesh.triangle_count; i++) {
        float *corner = mesh.vertices[mesh.triangles[i][i % 3]];
        const float *next = mesh.vertices[mesh.triangles[i][(i + 1) % 3]];
        switch (i % 7) {
        case 0:
            corner[i % 3] = NAN;
            break;
        case 1:
            corner[i % 3] = i % 2 ? INFINITY : -1e30f;
            break;
        case 2:  // a segment
            memcpy(corner, next, 3 * sizeof(float));
            break;
        case 3:  // a point
            memcpy(corner, next, 3 * sizeof(float));
            memcpy(mesh.vertices[mesh.triangles[i][(i + 2) % 3]], next, 3 * sizeof(float));
            break;
        default:
            break;
        }
    }
    return mesh;
}

static inline scene_mesh all_equal(uint32_t triangles) {
    scene_mesh mesh = scene_mesh_soup(triangles, 3, (const float[]){0, 0, 0}, 2, 0.5f);
    for (uint64_t i = 3; i < mesh.vertex_count; i++) {
        memcpy(mesh.vertices[i], mesh.vertices[i % 3], sizeof mesh.vertices[i]);
    }
    return mesh;
}

// Slim ones: two corners far apart, the third beside their middle.
static inline scene_mesh slivers(uint32_t triangles) {
    scene_mesh mesh = scene_mesh_soup(triangles, 5, (const float[]){0, 0, 0}, 2, 1);
    uint64_t seed = 1;
    for (uint64_t i = 0; i < mesh.triangle_count; i++) {
        const uint32_t *t = mesh.triangles[i];
        const float part = uniform(&seed, 0, 1), aside = powf(10, uniform(&seed, -7, -2));
        for (int axis = 0; axis < 3; axis++) {
            const float a = mesh.vertices[t[0]][axis], b = mesh.vertices[t[1]][axis];
            mesh.vertices[t[2]][axis] = a + part * (b - a) + uniform(&seed, -aside, aside);
        }
    }
    return mesh;
}

typedef struct named_mesh {
    const char *name;
    scene_mesh mesh;
    bool oriented;  // closed, and does not intersect itself
} named_mesh;

enum { NAMED_MESHES = 17 };

static inline void make_meshes(named_mesh meshes[NAMED_MESHES]) {
    const float here[3] = {0, 0, 0}, far_away[3] = {1000, -2000, 4000}, low[3] = {-1, -0.5f, -2}, high[3] = {1, 0.5f, 2};
    const named_mesh made[NAMED_MESHES] = {{"empty", scene_mesh_soup(0, 1, here, 2, 0.3f), false},
                                           {"one", scene_mesh_soup(1, 1, here, 2, 0.8f), false},
                                           {"two", scene_mesh_soup(2, 1, here, 2, 0.8f), false},
                                           {"three", scene_mesh_soup(3, 1, here, 2, 0.8f), false},
                                           {"five", scene_mesh_soup(5, 1, here, 2, 0.8f), false},
                                           {"nine", scene_mesh_soup(9, 1, here, 2, 0.8f), false},
                                           {"box", scene_mesh_box(low, high), true},
                                           {"sphere", scene_mesh_sphere(24, 40, here, 1), true},
                                           {"sphere far away", scene_mesh_sphere(12, 20, far_away, 1), true},
                                           {"torus", scene_mesh_torus(30, 12, here, 1, 0.3f), true},
                                           {"sheet", scene_mesh_sheet(16, here, 2, 0.2f), false},
                                           {"tubes", scene_mesh_tubes(24, here, 2), false},
                                           {"soup", scene_mesh_soup(500, 7, here, 2, 0.2f), false},
                                           {"bad soup", bad_soup(400, 9), false},
                                           {"all bad", bad_soup(1, 9), false},
                                           {"all equal", all_equal(150), false},
                                           {"slivers", slivers(200), false}};
    memcpy(meshes, made, sizeof made);
}

#endif
