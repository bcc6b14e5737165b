// SPDX-License-Identifier: MIT
// Nearest triangles at a chunk's corners by the descent of src/mesh, and the vectors, lengths and signs that follow from them.

#include "mesh/host_nearest.h"
#include "mesh/host_sign.h"
#include "mesh/topology.h"
#include "octree/build.h"

#include <string.h>

fm_result fm_octree_fields_exact(fm_octree_build *build) {
    for (int level = 0; level <= build->leaf_most; level++) {
        const fm_octree_field *own = &build->chunk.fields[level];
        const double edge = (double)(1u << level);
        const fm_nearest_field field = {
            .mesh = &build->soup.mesh,
            .grid = {.shape = {own->shape[0], own->shape[1], own->shape[2]}, .spacing = {edge, edge, edge}},
            .band = (double)own->band,
            .hide_beyond = own->band,
            .distance = own->distance,
            .triangles = own->triangles};
        FM_TRY(fm_host_nearest(&field));
    }
    return FM_OK;
}

typedef struct finish_job {
    const fm_octree_build *build;
    const fm_octree_field *field;
    float edge;
} finish_job;

static void finish_corner(const fm_octree_build *build, const fm_octree_field *field, uint64_t i, const float at[3]) {
    const uint32_t triangle = field->triangles[i];
    if (triangle == FM_NO_TRIANGLE) {
        field->distance[i] = INFINITY;
        return;
    }
    const fm_mesh *mesh = &build->soup.mesh;
    const float *const corners[3] = {mesh->vertices[3 * (uint64_t)triangle], mesh->vertices[3 * (uint64_t)triangle + 1],
                                     mesh->vertices[3 * (uint64_t)triangle + 2]};
    const fm_point_on_triangle point = fm_point_nearest(corners, at);
    for (int axis = 0; axis < 3; axis++) {
        field->vectors[i][axis] = (float)point.offset[axis];
    }
    field->distance[i] = (float)sqrt(point.distance2);
    if (build->sign == FM_SIGN_PSEUDONORMAL) {
        double normal[3];
        fm_pseudonormal(build->mesh, build->soup.numbers[triangle], point.feature, normal);
        const double side = normal[0] * point.offset[0] + normal[1] * point.offset[1] + normal[2] * point.offset[2];
        field->distance[i] = side > 0 ? -field->distance[i] : field->distance[i];
    }
}

static void finish_slices(void *user, uint64_t begin, uint64_t end, uint32_t worker) {
    const finish_job *job = user;
    const fm_octree_field *field = job->field;
    (void)worker;
    for (uint32_t z = (uint32_t)begin; z < end; z++) {
        for (uint32_t y = 0; y < field->shape[1]; y++) {
            for (uint32_t x = 0; x < field->shape[0]; x++) {
                const float at[3] = {(float)x * job->edge, (float)y * job->edge, (float)z * job->edge};
                finish_corner(job->build, field, fm_node_at(field->shape, x, y, z), at);
            }
        }
    }
}

void fm_octree_fields_finish(fm_octree_build *build) {
    for (int level = 0; level <= build->leaf_most; level++) {
        finish_job job = {build, &build->chunk.fields[level], (float)(1u << level)};
        fm_pool_run(build->context->pool, job.field->shape[2], 1, finish_slices, &job);
    }
}

// Corners of coarser cells are corners of the finest too, which have signs wherever they are.
static void copy_signs(const fm_octree_field *finest, const fm_octree_field *field, int level) {
    for (uint32_t z = 0; z < field->shape[2]; z++) {
        for (uint32_t y = 0; y < field->shape[1]; y++) {
            for (uint32_t x = 0; x < field->shape[0]; x++) {
                float *value = &field->distance[fm_node_at(field->shape, x, y, z)];
                *value = copysignf(*value, finest->distance[fm_node_at(finest->shape, x << level, y << level, z << level)]);
            }
        }
    }
}

fm_result fm_octree_fields_wind(fm_octree_build *build) {
    const fm_octree_chunk *chunk = &build->chunk;
    const fm_octree_field *finest = &chunk->fields[0];
    const uint64_t count = (uint64_t)finest->shape[0] * finest->shape[1] * finest->shape[2];
    fm_grid grid = {.shape = {finest->shape[0], finest->shape[1], finest->shape[2]}};
    for (int axis = 0; axis < 3; axis++) {
        grid.spacing[axis] = build->cell;
        grid.origin[axis] = build->origin[axis] + (double)chunk->at[axis] * FM_CHUNK * build->cell;
    }
    for (uint64_t i = 0; i < count; i++) {
        finest->distance[i] *= (float)build->cell;
    }
    FM_TRY(fm_sign_winding(build->mesh, &grid, (double)finest->band * build->cell, finest->distance));
    for (uint64_t i = 0; i < count; i++) {
        finest->distance[i] /= (float)build->cell;
    }
    for (int level = 1; level <= build->leaf_most; level++) {
        copy_signs(finest, &chunk->fields[level], level);
    }
    return FM_OK;
}
