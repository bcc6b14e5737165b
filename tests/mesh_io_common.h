// SPDX-License-Identifier: MIT
#ifndef FM_MESH_IO_COMMON_H
#define FM_MESH_IO_COMMON_H

// What the tests of mesh files share.

#include "check.h"
#include "fathom/mesh_io.h"
#include "random.h"

#include <stdlib.h>

// Random positions and triangles of random corners.
static inline fm_mesh *mesh_io_random(fm_context *context, uint32_t vertices, uint32_t triangles, uint64_t seed) {
    float(*positions)[3] = malloc(((size_t)vertices + 1) * sizeof *positions);
    uint32_t(*corners)[3] = malloc(((size_t)triangles + 1) * sizeof *corners);
    uint64_t state = seed;
    for (uint32_t i = 0; i < vertices; i++) {
        for (int k = 0; k < 3; k++) {
            positions[i][k] = (float)((double)(int64_t)test_random(&state) * 1e-18);
        }
    }
    for (uint32_t i = 0; i < triangles; i++) {
        for (int k = 0; k < 3; k++) {
            corners[i][k] = (uint32_t)(test_random(&state) >> 33) % vertices;
        }
    }
    const fm_mesh_desc desc = {(const float(*)[3])positions, vertices, (const uint32_t(*)[3])corners, triangles};
    fm_mesh *mesh = NULL;
    CHECK_OK(fm_mesh_create(context, &desc, &mesh));
    free(positions);
    free(corners);
    return mesh;
}

#endif
