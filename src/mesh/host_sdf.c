// SPDX-License-Identifier: MIT
// Fields on the processor: the nearest triangles, the sides of texels, and what lies beyond the band. Exact distances far away cost
// no more than flooded ones would, so that FM_FAR_FLOODED has them too.

#include "mesh/host_nearest.h"
#include "mesh/host_sign.h"
#include "mesh/sdf.h"
#include "mesh/topology.h"

#include <string.h>

typedef struct finish_job {
    float *distance;
    float band;
} finish_job;

static void clamp_to_band(void *user, uint64_t begin, uint64_t end, uint32_t worker) {
    const finish_job *job = user;
    (void)worker;
    for (uint64_t i = begin; i < end; i++) {
        const float value = job->distance[i];
        job->distance[i] = value > job->band ? job->band : value < -job->band ? -job->band : value;
    }
}

// The side of a grid that the band does not reach, by its first texel.
static fm_result side_of_all(const fm_nearest_field *field, bool *inside) {
    float distance;
    fm_nearest_field one = *field;
    one.grid.shape = (fm_shape){1, 1, 1};
    one.band = INFINITY;
    one.distance = &distance;
    one.triangles = NULL;
    FM_TRY(fm_host_nearest(&one));
    *inside = distance < 0;
    return FM_OK;
}

static void negate(void *user, uint64_t begin, uint64_t end, uint32_t worker) {
    float *distance = user;
    (void)worker;
    for (uint64_t i = begin; i < end; i++) {
        distance[i] = -distance[i];
    }
}

static fm_result spread_side(const fm_nearest_field *field) {
    fm_context *context = field->mesh->context;
    bool known, inside = false;
    FM_TRY(fm_sign_spread(context, &field->grid, field->distance, &known));
    if (!known) {
        FM_TRY(side_of_all(field, &inside));
    }
    if (inside) {
        fm_pool_run(context->pool, fm_voxels(field->grid.shape), 1 << 16, negate, field->distance);
    }
    return FM_OK;
}

fm_result fm_host_sdf(fm_mesh *mesh, const fm_sdf_plan *plan, fm_volume *distance, fm_volume *triangles) {
    fm_context *context = mesh->context;
    const uint64_t texels = fm_voxels(plan->shape);
    fm_passes_begin(context);
    fm_nearest_field field = {.mesh = mesh,
                              .grid = {.shape = plan->shape},
                              .hide_beyond = plan->band,
                              .sided = plan->sign == FM_SIGN_PSEUDONORMAL,
                              .distance = distance->data,
                              .triangles = triangles ? triangles->data : NULL};
    memcpy(field.grid.spacing, plan->spacing, sizeof field.grid.spacing);
    memcpy(field.grid.origin, plan->origin, sizeof field.grid.origin);
    const double widest = fmax(plan->spacing[0], fmax(plan->spacing[1], plan->spacing[2]));
    const bool far = plan->far_texels != FM_FAR_BAND;
    // Sides spread from a band that is at least a voxel wide.
    field.band = far ? INFINITY : fmax((double)plan->band, widest * 1.001);
    if (field.sided) {
        FM_TRY(fm_pseudonormals_prepare(mesh));
        fm_passes_end(context, "normals", mesh->triangle_count * 24);
    }
    FM_TRY(fm_host_nearest(&field));
    fm_passes_end(context, "nearest", texels * (triangles ? 8 : 4));
    if (field.sided && !far) {
        FM_TRY(spread_side(&field));
    } else if (plan->sign == FM_SIGN_WINDING) {
        FM_TRY(fm_sign_winding(mesh, &field.grid, field.band, field.distance));
    }
    if (!far) {
        finish_job job = {field.distance, plan->band};
        fm_pool_run(context->pool, texels, 1 << 16, clamp_to_band, &job);
    }
    fm_passes_end(context, "sign", texels * 8);
    return FM_OK;
}
