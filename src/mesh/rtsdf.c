// SPDX-License-Identifier: MIT
// RTSDF: what is checked and worked out once, whatever the backend.

#include "mesh/rtsdf.h"

static const uint32_t usual_edge = 128;
static const double usual_beta = 0.1, usual_mask = 0.1, usual_alpha = 0.95, usual_bias = 0.01;
enum { MOST_RAYS = 64 };

static fm_result resolve_shape(fm_rtsdf_desc *desc) {
    fm_shape *shape = &desc->coarse;
    if (shape->x == 0 && shape->y == 0 && shape->z == 0) {
        *shape = (fm_shape){usual_edge, usual_edge, usual_edge};
    }
    const uint32_t axes[3] = {shape->x, shape->y, shape->z};
    for (int i = 0; i < 3; i++) {
        if (axes[i] == 0 || axes[i] > FM_SEED_MOST) {
            return fm_fail(FM_ERROR_INVALID_ARGUMENT, "coarse is %u x %u x %u: every axis must be 1 to %d, or all 0 for 128",
                           shape->x, shape->y, shape->z, FM_SEED_MOST);
        }
    }
    return FM_OK;
}

static fm_result resolve_box(fm_rtsdf_desc *desc) {
    bool unset = true;
    for (int i = 0; i < 3; i++) {
        unset = unset && desc->low[i] == 0 && desc->high[i] == 0;
    }
    for (int i = 0; i < 3; i++) {
        desc->high[i] = unset ? 1 : desc->high[i];
        // As floats, for texels are placed in floats: neighbours must differ.
        if (!(fabs(desc->low[i]) <= 1e18 && fabs(desc->high[i]) <= 1e18 && (float)desc->low[i] < (float)desc->high[i])) {
            return fm_fail(FM_ERROR_INVALID_ARGUMENT,
                           "low[%d] is %g and high[%d] is %g: low below high as floats, neither above 1e18 in size", i,
                           desc->low[i], i, desc->high[i]);
        }
    }
    return FM_OK;
}

static fm_result check_numbers(const fm_rtsdf_desc *desc) {
    if ((unsigned)desc->flood > FM_FLOOD_JFA_PLUS_2) {
        return fm_fail(FM_ERROR_INVALID_ARGUMENT, "flood is %d: one of FM_FLOOD_JFA, _JFA_1_PLUS, _JFA_PLUS_2", (int)desc->flood);
    }
    if (!(desc->beta >= 0) || !isfinite(desc->beta)) {
        return fm_fail(FM_ERROR_INVALID_ARGUMENT, "beta is %g: finite and at least 0", (double)desc->beta);
    }
    if (!(desc->mask >= 0)) {
        return fm_fail(FM_ERROR_INVALID_ARGUMENT, "mask is %g: at least 0, or +infinity", (double)desc->mask);
    }
    if (!(desc->alpha >= 0 && desc->alpha <= 1)) {
        return fm_fail(FM_ERROR_INVALID_ARGUMENT, "alpha is %g: above 0 and at most 1, or 0 for %g", (double)desc->alpha,
                       usual_alpha);
    }
    if (!isfinite(desc->bias)) {
        return fm_fail(FM_ERROR_INVALID_ARGUMENT, "bias is %g: finite", (double)desc->bias);
    }
    if (desc->rays > MOST_RAYS) {
        return fm_fail(FM_ERROR_INVALID_ARGUMENT, "rays is %u: at most %d", desc->rays, MOST_RAYS);
    }
    return FM_OK;
}

// Half the longest edge, or the greatest power of two below it, down to 1; a grid of one texel takes a step too, which looks
// nowhere.
static void plan_steps(fm_rtsdf *rtsdf, fm_shape shape, fm_flood flood) {
    const int longest = (int)fm_max_u64(shape.x, fm_max_u64(shape.y, shape.z));
    if (flood == FM_FLOOD_JFA_1_PLUS) {
        rtsdf->steps[rtsdf->step_count++] = 1;
    }
    for (int step = (int)fm_floor_power_of_two((uint64_t)fm_max_u64((uint64_t)longest - 1, 1)); step >= 1; step /= 2) {
        rtsdf->steps[rtsdf->step_count++] = step;
    }
    if (flood == FM_FLOOD_JFA_PLUS_2) {
        rtsdf->steps[rtsdf->step_count++] = 2;
        rtsdf->steps[rtsdf->step_count++] = 1;
    }
}

static fm_result create_fields(fm_rtsdf *rtsdf, const fm_rtsdf_desc *desc) {
    const fm_shape shape = desc->coarse;
    fm_volume_desc coarse = {.shape = shape, .type = FM_TYPE_F32};
    fm_volume_desc fine = {.shape = {2 * shape.x, 2 * shape.y, 2 * shape.z}, .type = FM_TYPE_F32};
    const uint32_t axes[3] = {shape.x, shape.y, shape.z};
    for (int i = 0; i < 3; i++) {
        coarse.spacing[i] = (desc->high[i] - desc->low[i]) / axes[i];
        coarse.origin[i] = desc->low[i] + coarse.spacing[i] / 2;
        fine.spacing[i] = coarse.spacing[i] / 2;
        fine.origin[i] = desc->low[i] + fine.spacing[i] / 2;
        rtsdf->origin[i] = (float)fine.origin[i];
        rtsdf->spacing[i] = (float)fine.spacing[i];
    }
    FM_TRY(fm_volume_create(rtsdf->context, &coarse, &rtsdf->coarse));
    FM_TRY(fm_volume_create(rtsdf->context, &fine, &rtsdf->fine));
    rtsdf->grid = fm_voxel_grid_of(&coarse);
    const double unit = fmin(coarse.spacing[0], fmin(coarse.spacing[1], coarse.spacing[2]));
    for (int i = 0; i < 3; i++) {
        const double edge = coarse.spacing[i] / unit;
        // Edges that differ by rounding are equal.
        rtsdf->weight[i] = fabs(edge - 1) < 1e-6 ? 1 : (float)(edge * edge);
    }
    const double longest = fmax(desc->high[0] - desc->low[0], fmax(desc->high[1] - desc->low[1], desc->high[2] - desc->low[2]));
    rtsdf->unit = (float)unit;
    rtsdf->beta = (float)(desc->beta > 0 ? (double)desc->beta * longest : usual_beta * unit);
    rtsdf->mask = (float)((desc->mask > 0 ? (double)desc->mask : usual_mask) * longest);
    rtsdf->bias = desc->bias < 0 ? 0 : (float)((desc->bias > 0 ? (double)desc->bias : usual_bias) * longest);
    rtsdf->alpha = desc->alpha > 0 ? desc->alpha : (float)usual_alpha;
    return FM_OK;
}

fm_result fm_rtsdf_create(fm_context *context, const fm_rtsdf_desc *desc, fm_rtsdf **result) {
    if (!context || !result) {
        return fm_fail(FM_ERROR_INVALID_ARGUMENT, "%s is NULL", context ? "rtsdf" : "context");
    }
    fm_rtsdf_desc resolved = desc ? *desc : (fm_rtsdf_desc){0};
    FM_TRY(resolve_shape(&resolved));
    FM_TRY(resolve_box(&resolved));
    FM_TRY(check_numbers(&resolved));
    fm_rtsdf *rtsdf = fm_alloc_zero(&context->allocator, sizeof *rtsdf, "an RTSDF");
    if (!rtsdf) {
        return FM_ERROR_OUT_OF_HOST_MEMORY;
    }
    rtsdf->context = context;
    rtsdf->rays = resolved.rays;
    rtsdf->seed = resolved.seed;
    plan_steps(rtsdf, resolved.coarse, resolved.flood);
    fm_result status = create_fields(rtsdf, &resolved);
    if (status == FM_OK) {
        status = context->gpu ? fm_gpu_rtsdf_create(rtsdf) : fm_host_rtsdf_create(rtsdf);
    }
    if (status != FM_OK) {
        fm_rtsdf_destroy(rtsdf);
        return status;
    }
    *result = rtsdf;
    return FM_OK;
}

void fm_rtsdf_destroy(fm_rtsdf *rtsdf) {
    if (!rtsdf) {
        return;
    }
    if (rtsdf->context->gpu) {
        fm_gpu_rtsdf_destroy(rtsdf);
    } else {
        fm_host_rtsdf_destroy(rtsdf);
    }
    fm_volume_destroy(rtsdf->coarse);
    fm_volume_destroy(rtsdf->fine);
    fm_free(&rtsdf->context->allocator, rtsdf, sizeof *rtsdf);
}

fm_result fm_rtsdf_update(fm_rtsdf *rtsdf, fm_mesh *mesh, fm_ticket *ticket) {
    if (!rtsdf || !mesh) {
        return fm_fail(FM_ERROR_INVALID_ARGUMENT, "%s is NULL", rtsdf ? "mesh" : "rtsdf");
    }
    if (mesh->context != rtsdf->context) {
        return fm_fail(FM_ERROR_INVALID_ARGUMENT, "mesh belongs to another context: to the one of rtsdf it should");
    }
    if (rtsdf->context->gpu) {
        FM_TRY(fm_gpu_rtsdf_update(rtsdf, mesh, ticket));
    } else {
        FM_TRY(fm_host_rtsdf_update(rtsdf, mesh));
        if (ticket) {
            *ticket = 0;
        }
    }
    rtsdf->frame++;
    return FM_OK;
}

fm_result fm_rtsdf_reset(fm_rtsdf *rtsdf) {
    if (!rtsdf) {
        return fm_fail(FM_ERROR_INVALID_ARGUMENT, "rtsdf is NULL");
    }
    rtsdf->frame = 0;
    return FM_OK;
}

void fm_rtsdf_fields(fm_rtsdf *rtsdf, fm_volume **coarse, fm_volume **fine) {
    if (coarse) {
        *coarse = rtsdf->coarse;
    }
    if (fine) {
        *fine = rtsdf->fine;
    }
}

uint64_t fm_rtsdf_bits_bytes(const fm_rtsdf *rtsdf) {
    const fm_shape shape = rtsdf->coarse->desc.shape;
    return (uint64_t)fm_bits_row_words(shape) * 4 * shape.y * shape.z;
}

uint64_t fm_rtsdf_seed_bytes(const fm_rtsdf *rtsdf) {
    return 4 * fm_voxels(rtsdf->coarse->desc.shape);
}

// The first step reads bits, all others seeds; all write 4 bytes a texel.
uint64_t fm_rtsdf_flood_bytes(const fm_rtsdf *rtsdf) {
    return fm_rtsdf_bits_bytes(rtsdf) + (2 * (uint64_t)rtsdf->step_count - 1) * fm_rtsdf_seed_bytes(rtsdf);
}

// The coarse field is read and the fine one written; what the texels held and the mesh come on top, as the mask goes.
uint64_t fm_rtsdf_trace_bytes(const fm_rtsdf *rtsdf) {
    return rtsdf->coarse->bytes + rtsdf->fine->bytes;
}
