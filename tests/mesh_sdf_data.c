// SPDX-License-Identifier: MIT
// Sides of real meshes: the open Stanford bunny against exact sums, most of all where the winding number passes 1/2 away from the
// surface, and a closed mesh by both signs.

#include "check.h"
#include "fathom/mesh_io.h"
#include "fathom/sdf.h"
#include "mesh_oracle.h"
#include "random.h"

#include <stdlib.h>
#include <unistd.h>

static fm_context *context;

static float *field_of(fm_mesh *mesh, fm_sign sign, uint32_t size, fm_volume_desc *grid) {
    fm_volume *distance;
    *grid = (fm_volume_desc){.type = FM_TYPE_F32};
    if (!CHECK_OK(fm_mesh_fit(mesh, size, 4, grid)) || !CHECK_OK(fm_volume_create(context, grid, &distance))) {
        return NULL;
    }
    float *values = malloc((size_t)grid->shape.x * grid->shape.y * grid->shape.z * sizeof *values);
    CHECK_OK(fm_mesh_sdf(mesh, &(fm_sdf_desc){.sign = sign}, distance, NULL, NULL, NULL));
    CHECK_OK(fm_volume_download(distance, values));
    fm_volume_destroy(distance);
    return values;
}

static void check_side(const scene_mesh *shape, const fm_volume_desc *grid, const float *values, size_t texel) {
    const fm_shape size = grid->shape;
    const oracle_point p = {grid->origin[0] + (double)(texel % size.x) * grid->spacing[0],
                            grid->origin[1] + (double)(texel / size.x % size.y) * grid->spacing[1],
                            grid->origin[2] + (double)(texel / size.x / size.y) * grid->spacing[2]};
    CHECK((values[texel] < 0) == (oracle_winding(shape, p) > 0.5));
}

static void run_open(const char *path) {
    fm_mesh *mesh;
    fm_volume_desc grid;
    if (!CHECK_OK(fm_mesh_read(context, path, NULL, &mesh, NULL))) {
        return;
    }
    const float(*vertices)[3];
    const uint32_t(*triangles)[3];
    scene_mesh shape;
    fm_mesh_arrays(mesh, &vertices, &shape.vertex_count, &triangles, &shape.triangle_count);
    shape.vertices = (float(*)[3])(uintptr_t)vertices;
    shape.triangles = (uint32_t(*)[3])(uintptr_t)triangles;
    float *values = field_of(mesh, FM_SIGN_AUTO, 72, &grid);
    const size_t count = (size_t)grid.shape.x * grid.shape.y * grid.shape.z;
    uint64_t seed = 1;
    size_t parted = 0;
    for (size_t i = 0; values && i + 1 < count; i++) {
        // Neighbours of different sides with no surface between them.
        const bool apart = i % grid.shape.x != grid.shape.x - 1 && (values[i] < 0) != (values[i + 1] < 0) &&
                           (double)(fabsf(values[i]) + fabsf(values[i + 1])) > 1.01 * grid.spacing[0];
        parted += apart;
        if (apart || (fabs((double)values[i]) < 3 * grid.spacing[0] && test_random(&seed) % 400 == 0)) {
            check_side(&shape, &grid, values, i);
            check_side(&shape, &grid, values, i + 1);
        }
    }
    printf("%zu neighbours of different sides with no surface between them\n", parted);
    CHECK(parted > 0);
    free(values);
    fm_mesh_destroy(mesh);
}

static void run_closed(const char *path) {
    fm_mesh *mesh;
    fm_volume_desc grid;
    if (!CHECK_OK(fm_mesh_read(context, path, NULL, &mesh, NULL))) {
        return;
    }
    float *normals = field_of(mesh, FM_SIGN_PSEUDONORMAL, 80, &grid), *winding = field_of(mesh, FM_SIGN_WINDING, 80, &grid);
    for (size_t i = 0; normals && winding && i < (size_t)grid.shape.x * grid.shape.y * grid.shape.z; i++) {
        CHECK(normals[i] == winding[i]);
    }
    free(normals);
    free(winding);
    fm_mesh_destroy(mesh);
}

int main(void) {
    static const char bunny[] = "../shared/data/meshes/stanford_bunny_zipper.ply";
    if (access(bunny, R_OK) != 0) {
        return check_skip("../shared/data/meshes is not there");
    }
    const fm_context_desc desc = {.backend = FM_BACKEND_CPU, .threads = 2};
    if (CHECK_OK(fm_context_create(&desc, &context))) {
        run_open(bunny);
        run_closed("../shared/data/meshes/armadillo.obj");
        run_closed("../shared/data/meshes/spot.obj");
        fm_context_destroy(context);
    }
    return check_summary();
}
