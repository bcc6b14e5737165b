// SPDX-License-Identifier: MIT
#include "meshes.h"

#include "noise.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

static const double TURN = 6.283185307179586;

static scene_mesh room(uint64_t vertices, uint64_t triangles) {
    scene_mesh mesh = {malloc(vertices * sizeof *mesh.vertices), malloc(triangles * sizeof *mesh.triangles), 0, 0};
    if (!mesh.vertices || !mesh.triangles) {
        scene_mesh_free(&mesh);
    }
    return mesh;
}

void scene_mesh_free(scene_mesh *mesh) {
    free(mesh->vertices);
    free(mesh->triangles);
    *mesh = (scene_mesh){0};
}

fm_mesh_desc scene_mesh_describe(const scene_mesh *mesh) {
    return (fm_mesh_desc){(const float(*)[3])mesh->vertices, mesh->vertex_count, (const uint32_t(*)[3])mesh->triangles,
                          mesh->triangle_count};
}

static uint32_t add_vertex(scene_mesh *mesh, const float centre[3], double x, double y, double z) {
    float *vertex = mesh->vertices[mesh->vertex_count];
    vertex[0] = (float)(centre[0] + x);
    vertex[1] = (float)(centre[1] + y);
    vertex[2] = (float)(centre[2] + z);
    return (uint32_t)mesh->vertex_count++;
}

static void add_triangle(scene_mesh *mesh, uint32_t a, uint32_t b, uint32_t c) {
    memcpy(mesh->triangles[mesh->triangle_count++], (uint32_t[3]){a, b, c}, sizeof(uint32_t[3]));
}

static void add_quad(scene_mesh *mesh, uint32_t a, uint32_t b, uint32_t c, uint32_t d) {
    add_triangle(mesh, a, b, c);
    add_triangle(mesh, a, c, d);
}

scene_mesh scene_mesh_sphere(uint32_t rings, uint32_t sectors, const float centre[3], float radius) {
    scene_mesh mesh = room((uint64_t)(rings - 1) * sectors + 2, 2 * (uint64_t)(rings - 1) * sectors);
    if (!mesh.vertices) {
        return mesh;
    }
    const uint32_t south = add_vertex(&mesh, centre, 0, 0, -radius), north = add_vertex(&mesh, centre, 0, 0, radius);
    for (uint32_t ring = 1; ring < rings; ring++) {
        const double latitude = TURN / 2 * ring / rings;
        for (uint32_t i = 0; i < sectors; i++) {
            const double turn = TURN * i / sectors, around = radius * sin(latitude);
            add_vertex(&mesh, centre, around * cos(turn), around * sin(turn), -radius * cos(latitude));
        }
    }
    for (uint32_t i = 0; i < sectors; i++) {
        const uint32_t first = 2, next = (i + 1) % sectors, last = 2 + (rings - 2) * sectors;
        add_triangle(&mesh, south, first + next, first + i);
        for (uint32_t ring = 0; ring + 2 < rings; ring++) {
            const uint32_t below = first + ring * sectors, above = below + sectors;
            add_quad(&mesh, below + i, below + next, above + next, above + i);
        }
        add_triangle(&mesh, north, last + i, last + next);
    }
    return mesh;
}

scene_mesh scene_mesh_torus(uint32_t rings, uint32_t sectors, const float centre[3], float radius, float tube) {
    scene_mesh mesh = room((uint64_t)rings * sectors, 2 * (uint64_t)rings * sectors);
    if (!mesh.vertices) {
        return mesh;
    }
    for (uint32_t ring = 0; ring < rings; ring++) {
        const double turn = TURN * ring / rings;
        for (uint32_t i = 0; i < sectors; i++) {
            const double tilt = TURN * i / sectors, around = radius + tube * cos(tilt);
            add_vertex(&mesh, centre, around * cos(turn), around * sin(turn), tube * sin(tilt));
        }
    }
    for (uint32_t ring = 0; ring < rings; ring++) {
        const uint32_t here = ring * sectors, there = (ring + 1) % rings * sectors;
        for (uint32_t i = 0; i < sectors; i++) {
            const uint32_t next = (i + 1) % sectors;
            add_quad(&mesh, here + i, there + i, there + next, here + next);
        }
    }
    return mesh;
}

scene_mesh scene_mesh_box(const float low[3], const float high[3]) {
    static const float origin[3] = {0};
    scene_mesh mesh = room(8, 12);
    if (!mesh.vertices) {
        return mesh;
    }
    for (int i = 0; i < 8; i++) {
        add_vertex(&mesh, origin, i & 1 ? high[0] : low[0], i & 2 ? high[1] : low[1], i & 4 ? high[2] : low[2]);
    }
    add_quad(&mesh, 0, 2, 3, 1);
    add_quad(&mesh, 4, 5, 7, 6);
    add_quad(&mesh, 0, 1, 5, 4);
    add_quad(&mesh, 2, 6, 7, 3);
    add_quad(&mesh, 0, 4, 6, 2);
    add_quad(&mesh, 1, 3, 7, 5);
    return mesh;
}

scene_mesh scene_mesh_sheet(uint32_t cells, const float centre[3], float size, float wave) {
    const uint32_t points = cells + 1;
    scene_mesh mesh = room((uint64_t)points * points, 2 * (uint64_t)cells * cells);
    if (!mesh.vertices) {
        return mesh;
    }
    for (uint32_t j = 0; j < points; j++) {
        for (uint32_t i = 0; i < points; i++) {
            const double x = (double)i / cells - 0.5, y = (double)j / cells - 0.5;
            add_vertex(&mesh, centre, size * x, size * y, wave * sin(TURN * x) * cos(TURN * 1.5 * y));
        }
    }
    for (uint32_t j = 0; j < cells; j++) {
        for (uint32_t i = 0; i < cells; i++) {
            const uint32_t corner = i + points * j;
            add_quad(&mesh, corner, corner + 1, corner + 1 + points, corner + points);
        }
    }
    return mesh;
}

static void add_tube(scene_mesh *mesh, uint32_t sectors, const float centre[3], double size, bool along_y) {
    const double half = size / 2, radius = size / 8;
    // A half turn about the diagonal in the plane swaps x and y and keeps faces outwards.
    uint32_t ends[2] = {0}, rims[2] = {0};
    for (int end = 0; end < 2; end++) {
        const double at = end ? half : -half;
        ends[end] = add_vertex(mesh, centre, along_y ? 0 : at, along_y ? at : 0, 0);
        for (uint32_t i = 0; i < sectors; i++) {
            const double a = radius * cos(TURN * i / sectors), b = radius * sin(TURN * i / sectors);
            const uint32_t vertex = add_vertex(mesh, centre, along_y ? a : at, along_y ? at : a, along_y ? -b : b);
            rims[end] = i == 0 ? vertex : rims[end];
        }
    }
    for (uint32_t i = 0; i < sectors; i++) {
        const uint32_t next = (i + 1) % sectors;
        add_triangle(mesh, ends[0], rims[0] + next, rims[0] + i);
        add_triangle(mesh, ends[1], rims[1] + i, rims[1] + next);
        add_quad(mesh, rims[0] + i, rims[0] + next, rims[1] + next, rims[1] + i);
    }
}

scene_mesh scene_mesh_tubes(uint32_t sectors, const float centre[3], float size) {
    scene_mesh mesh = room(4 * ((uint64_t)sectors + 1), 8 * (uint64_t)sectors);
    if (mesh.vertices) {
        add_tube(&mesh, sectors, centre, size, false);
        add_tube(&mesh, sectors, centre, size, true);
    }
    return mesh;
}

// Uniform in -1/2 to 1/2.
static double draw(uint64_t *state) {
    *state = fm_mix(*state + 0x9e3779b97f4a7c15u);
    return (double)(*state >> 11) / 9007199254740992.0 - 0.5;
}

scene_mesh scene_mesh_soup(uint32_t triangles, uint64_t seed, const float centre[3], float size, float edge) {
    scene_mesh mesh = room(3 * (uint64_t)triangles, triangles);
    uint64_t state = fm_mix(seed);
    for (uint32_t i = 0; mesh.vertices && i < triangles; i++) {
        const double x = (size - edge) * draw(&state), y = (size - edge) * draw(&state), z = (size - edge) * draw(&state);
        for (int k = 0; k < 3; k++) {
            const double dx = edge * draw(&state), dy = edge * draw(&state), dz = edge * draw(&state);
            add_vertex(&mesh, centre, x + dx, y + dy, z + dz);
        }
        add_triangle(&mesh, 3 * i, 3 * i + 1, 3 * i + 2);
    }
    return mesh;
}
