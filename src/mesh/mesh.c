// SPDX-License-Identifier: MIT
#include "mesh/mesh.h"

void fm_mesh_arrays(const fm_mesh *mesh, const float (**vertices)[3], uint64_t *vertex_count, const uint32_t (**triangles)[3],
                    uint64_t *triangle_count) {
    if (vertices) {
        *vertices = (const float (*)[3])mesh->vertices;
    }
    if (vertex_count) {
        *vertex_count = mesh->vertex_count;
    }
    if (triangles) {
        *triangles = (const uint32_t (*)[3])mesh->triangles;
    }
    if (triangle_count) {
        *triangle_count = mesh->triangle_count;
    }
}
