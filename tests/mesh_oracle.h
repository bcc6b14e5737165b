// SPDX-License-Identifier: MIT
#ifndef MESH_ORACLE_H
#define MESH_ORACLE_H

// Distances and winding numbers of triangles in double precision, by sums over all of them: what fields are checked against.

#include "meshes.h"

#include <math.h>

typedef struct oracle_point {
    double x, y, z;
} oracle_point;

static inline oracle_point oracle_minus(oracle_point a, oracle_point b) {
    return (oracle_point){a.x - b.x, a.y - b.y, a.z - b.z};
}

static inline double oracle_dot(oracle_point a, oracle_point b) {
    return a.x * b.x + a.y * b.y + a.z * b.z;
}

static inline oracle_point oracle_cross(oracle_point a, oracle_point b) {
    return (oracle_point){a.y * b.z - a.z * b.y, a.z * b.x - a.x * b.z, a.x * b.y - a.y * b.x};
}

static inline double oracle_length(oracle_point a) {
    return sqrt(oracle_dot(a, a));
}

static inline oracle_point oracle_corner(const scene_mesh *mesh, uint64_t triangle, int corner) {
    const float *v = mesh->vertices[mesh->triangles[triangle][corner]];
    return (oracle_point){(double)v[0], (double)v[1], (double)v[2]};
}

static inline bool oracle_fits(const scene_mesh *mesh, uint64_t triangle) {
    for (int corner = 0; corner < 3; corner++) {
        const oracle_point p = oracle_corner(mesh, triangle, corner);
        if (!(fabs(p.x) <= 1e18 && fabs(p.y) <= 1e18 && fabs(p.z) <= 1e18)) {
            return false;
        }
    }
    return true;
}

static inline double oracle_to_segment(oracle_point p, oracle_point a, oracle_point b) {
    const oracle_point along = oracle_minus(b, a), offset = oracle_minus(p, a);
    const double square = oracle_dot(along, along);
    const double t = square > 0 ? fmin(fmax(oracle_dot(along, offset) / square, 0), 1) : 0;
    return oracle_length((oracle_point){offset.x - t * along.x, offset.y - t * along.y, offset.z - t * along.z});
}

// From the triangle's edges, or its plane where the point is above its inside.
static inline double oracle_to_triangle(const scene_mesh *mesh, uint64_t triangle, oracle_point p) {
    oracle_point c[3];
    double distance = INFINITY;
    for (int i = 0; i < 3; i++) {
        c[i] = oracle_corner(mesh, triangle, i);
    }
    const oracle_point normal = oracle_cross(oracle_minus(c[1], c[0]), oracle_minus(c[2], c[0]));
    bool above = oracle_length(normal) > 0;
    for (int i = 0; i < 3; i++) {
        const oracle_point from = c[i], to = c[(i + 1) % 3];
        distance = fmin(distance, oracle_to_segment(p, from, to));
        above = above && oracle_dot(oracle_cross(normal, oracle_minus(to, from)), oracle_minus(p, from)) > 0;
    }
    return above ? fmin(distance, fabs(oracle_dot(normal, oracle_minus(p, c[0]))) / oracle_length(normal)) : distance;
}

static inline double oracle_distance(const scene_mesh *mesh, oracle_point p) {
    double distance = INFINITY;
    for (uint64_t i = 0; i < mesh->triangle_count; i++) {
        if (oracle_fits(mesh, i)) {
            distance = fmin(distance, oracle_to_triangle(mesh, i, p));
        }
    }
    return distance;
}

static inline double oracle_winding(const scene_mesh *mesh, oracle_point p) {
    double sum = 0;
    for (uint64_t i = 0; i < mesh->triangle_count; i++) {
        if (!oracle_fits(mesh, i)) {
            continue;
        }
        const oracle_point a = oracle_minus(oracle_corner(mesh, i, 0), p), b = oracle_minus(oracle_corner(mesh, i, 1), p);
        const oracle_point c = oracle_minus(oracle_corner(mesh, i, 2), p);
        const double x = oracle_length(a), y = oracle_length(b), z = oracle_length(c);
        const double below = x * y * z + oracle_dot(a, b) * z + oracle_dot(b, c) * x + oracle_dot(c, a) * y;
        const double volume = oracle_dot(a, oracle_cross(b, c));
        sum += volume == 0 ? 0 : atan2(volume, below);
    }
    return sum / (2 * 3.14159265358979323846);
}

#endif
