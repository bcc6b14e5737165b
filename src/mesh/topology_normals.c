// SPDX-License-Identifier: MIT
// Angle-weighted normals. A flat triangle, whose corners lie on a line, has none: whoever asks across it gets the triangle behind
// it.

#include "mesh/exact.h"
#include "mesh/topology.h"

#include <string.h>

enum { MOST_FLAT = 16 };  // in a row

static double dot(const double a[3], const double b[3]) {
    return a[0] * b[0] + a[1] * b[1] + a[2] * b[2];
}

static const float *corner_of(const fm_mesh *mesh, uint32_t triangle, int corner) {
    return mesh->vertices[mesh->triangles[triangle][corner % 3]];
}

static void edge_of(const fm_mesh *mesh, uint32_t triangle, int edge, double vector[3]) {
    const float *from = corner_of(mesh, triangle, edge), *to = corner_of(mesh, triangle, edge + 1);
    for (int axis = 0; axis < 3; axis++) {
        vector[axis] = (double)to[axis] - from[axis];
    }
}

static bool is_flat(const fm_mesh *mesh, uint32_t triangle) {
    return fm_collinear(corner_of(mesh, triangle, 0), corner_of(mesh, triangle, 1), corner_of(mesh, triangle, 2));
}

// Of length 1, or 0 where the triangle is flat.
static void unit_normal(const fm_mesh *mesh, uint32_t triangle, double normal[3]) {
    double ab[3], bc[3];
    edge_of(mesh, triangle, 0, ab);
    edge_of(mesh, triangle, 1, bc);
    normal[0] = ab[1] * bc[2] - ab[2] * bc[1];
    normal[1] = ab[2] * bc[0] - ab[0] * bc[2];
    normal[2] = ab[0] * bc[1] - ab[1] * bc[0];
    const double length2 = dot(normal, normal);
    // Rounding alone makes no normal as long as this.
    const bool upright = length2 > 1e-24 * dot(ab, ab) * dot(bc, bc) || (length2 > 0 && !is_flat(mesh, triangle));
    const double scale = upright ? 1 / sqrt(length2) : 0;
    for (int axis = 0; axis < 3; axis++) {
        normal[axis] *= scale;
    }
}

static int longest_edge(const fm_mesh *mesh, uint32_t triangle, int except) {
    int longest = -1;
    double most = -1;
    for (int k = 0; k < 3; k++) {
        double edge[3];
        edge_of(mesh, triangle, k, edge);
        if (k != except && dot(edge, edge) > most) {
            most = dot(edge, edge);
            longest = k;
        }
    }
    return longest;
}

// The triangle with an area on the other side of an edge, or FM_NO_TRIANGLE.
static uint32_t across_flat(const fm_mesh *mesh, uint32_t triangle, int edge) {
    uint32_t(*across)[3] = mesh->topology->across;
    uint32_t next = across[triangle][edge];
    for (int i = 0; i < MOST_FLAT && next != FM_NO_TRIANGLE && is_flat(mesh, next); i++) {
        int entered = 0;
        while (entered < 2 && across[next][entered] != triangle) {
            entered++;
        }
        triangle = next;
        next = across[triangle][longest_edge(mesh, triangle, entered)];
    }
    return next;
}

static void add_scaled(double sum[3], const double normal[3], double factor) {
    for (int axis = 0; axis < 3; axis++) {
        sum[axis] += factor * normal[axis];
    }
}

static void add_corners(const fm_mesh *mesh, uint32_t triangle, const double normal[3]) {
    const fm_topology *topology = mesh->topology;
    double edges[3][3];
    for (int k = 0; k < 3; k++) {
        edge_of(mesh, triangle, k, edges[k]);
    }
    for (int k = 0; k < 3; k++) {
        const double *out = edges[k], *in = edges[(k + 2) % 3];
        const double turn[3] = {in[1] * out[2] - in[2] * out[1], in[2] * out[0] - in[0] * out[2], in[0] * out[1] - in[1] * out[0]};
        const double angle = atan2(sqrt(dot(turn, turn)), -dot(in, out));
        add_scaled(topology->corner_normals[topology->distinct[mesh->triangles[triangle][k]]], normal, angle);
    }
}

// The corner between the ends of a flat triangle lies on an edge of the triangle behind.
static void add_flat(const fm_mesh *mesh, uint32_t triangle) {
    const fm_topology *topology = mesh->topology;
    const int edge = longest_edge(mesh, triangle, -1);
    const uint32_t behind = across_flat(mesh, triangle, edge);
    if (behind != FM_NO_TRIANGLE) {
        double normal[3];
        unit_normal(mesh, behind, normal);
        add_scaled(topology->corner_normals[topology->distinct[mesh->triangles[triangle][(edge + 2) % 3]]], normal,
                   3.14159265358979323846);
    }
}

fm_result fm_pseudonormals_prepare(fm_mesh *mesh) {
    FM_TRY(fm_topology_prepare(mesh));
    fm_topology *topology = mesh->topology;
    if (topology->corner_normals && topology->normals_version == mesh->version) {
        return FM_OK;
    }
    const uint64_t bytes = topology->positions * sizeof *topology->corner_normals;
    if (!topology->corner_normals) {
        topology->corner_normals = fm_mesh_alloc(mesh->context, bytes, "a mesh's normals");
        if (!topology->corner_normals) {
            return FM_ERROR_OUT_OF_HOST_MEMORY;
        }
    }
    memset(topology->corner_normals, 0, bytes);
    for (uint32_t i = 0; i < mesh->triangle_count; i++) {
        double normal[3];
        if (!fm_triangle_fits(mesh, i)) {
            continue;
        }
        unit_normal(mesh, i, normal);
        if (dot(normal, normal) > 0) {
            add_corners(mesh, i, normal);
        } else {
            add_flat(mesh, i);
        }
    }
    topology->normals_version = mesh->version;
    return FM_OK;
}

static void add_across(const fm_mesh *mesh, uint32_t triangle, int edge, double normal[3]) {
    const uint32_t other = across_flat(mesh, triangle, edge);
    if (other != FM_NO_TRIANGLE) {
        double beside[3];
        unit_normal(mesh, other, beside);
        add_scaled(normal, beside, 1);
    }
}

void fm_pseudonormal(const fm_mesh *mesh, uint32_t triangle, fm_feature feature, double normal[3]) {
    if (feature >= FM_FEATURE_CORNER_0) {
        const uint32_t vertex = mesh->triangles[triangle][feature - FM_FEATURE_CORNER_0];
        memcpy(normal, mesh->topology->corner_normals[mesh->topology->distinct[vertex]], 3 * sizeof *normal);
        return;
    }
    unit_normal(mesh, triangle, normal);
    if (feature >= FM_FEATURE_EDGE_0) {
        const int edge = feature - FM_FEATURE_EDGE_0;
        add_across(mesh, triangle, edge, normal);
        if (is_flat(mesh, triangle)) {
            add_across(mesh, triangle, longest_edge(mesh, triangle, edge), normal);
        }
    }
}
