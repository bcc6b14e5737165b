// SPDX-License-Identifier: MIT
// The public calls that make and update a world: arguments are checked here, and nowhere below.

#include "world/chunks.h"
#include "world/refs.h"

#include <string.h>

uint32_t fm_world_cap(const fm_world_desc *desc) {
    switch (desc->format) {
    case FM_FIELD_SPLIT_U16:
        return UINT16_MAX;
    case FM_FIELD_SQUARED_U32:
        return desc->max_distance ? desc->max_distance * desc->max_distance : UINT32_MAX;
    default:
        return UINT8_MAX;
    }
}

uint32_t fm_field_width(fm_field_format format) {
    return format == FM_FIELD_SPLIT_U8 ? 1 : format == FM_FIELD_SPLIT_U16 ? 2 : 4;
}

uint32_t fm_lane_width(fm_field_format format) {
    return format == FM_FIELD_PACKED ? 1 : fm_field_width(format);
}

static const char *const algorithm_names[] = {
    [FM_WORLD_EXACT] = "FM_WORLD_EXACT",
    [FM_WORLD_BRUTE_FORCE] = "FM_WORLD_BRUTE_FORCE",
    [FM_WORLD_FIM] = "FM_WORLD_FIM",
    [FM_WORLD_JFA_PUBLISHED] = "FM_WORLD_JFA_PUBLISHED",
    [FM_WORLD_JFA] = "FM_WORLD_JFA",
    [FM_WORLD_JFA_1_PLUS] = "FM_WORLD_JFA_1_PLUS",
    [FM_WORLD_JFA_PLUS_2] = "FM_WORLD_JFA_PLUS_2",
    [FM_WORLD_JFA_FIM] = "FM_WORLD_JFA_FIM",
    [FM_WORLD_SELECTIVE] = "FM_WORLD_SELECTIVE",
    [FM_WORLD_PUBLISHED_FINAL] = "FM_WORLD_PUBLISHED_FINAL",
};

enum { ALGORITHM_COUNT = sizeof algorithm_names / sizeof algorithm_names[0] };

static fm_result check_enumerators(const fm_world_method *method) {
    if ((unsigned)method->algorithm >= ALGORITHM_COUNT) {
        return fm_fail(FM_ERROR_INVALID_ARGUMENT, "algorithm is %d: not an fm_world_algorithm", (int)method->algorithm);
    }
    if ((unsigned)method->border > FM_BORDER_EXCHANGE) {
        return fm_fail(FM_ERROR_INVALID_ARGUMENT, "border is %d: not an fm_world_border", (int)method->border);
    }
    if ((unsigned)method->convergence > FM_CONVERGE_HOST) {
        return fm_fail(FM_ERROR_INVALID_ARGUMENT, "convergence is %d: not an fm_world_convergence", (int)method->convergence);
    }
    return FM_OK;
}

static fm_result check_selective(fm_world_method *method) {
    if (method->algorithm != FM_WORLD_SELECTIVE) {
        return FM_OK;
    }
    if (method->chunk == 0) {
        return fm_fail(FM_ERROR_INVALID_ARGUMENT, "chunk is 0: FM_WORLD_SELECTIVE chooses by chunk");
    }
    method->near_algorithm = method->near_algorithm == FM_WORLD_EXACT ? FM_WORLD_JFA_FIM : method->near_algorithm;
    method->far_algorithm = method->far_algorithm == FM_WORLD_EXACT ? FM_WORLD_JFA_PUBLISHED : method->far_algorithm;
    if (!fm_chunk_relaxes(method->near_algorithm)) {
        return fm_fail(FM_ERROR_INVALID_ARGUMENT, "near_algorithm is %d: FM_WORLD_FIM and FM_WORLD_JFA_FIM are accepted",
                       (int)method->near_algorithm);
    }
    if (method->far_algorithm != FM_WORLD_JFA_PUBLISHED && !fm_chunk_propagates_sites(method->far_algorithm)) {
        return fm_fail(
            FM_ERROR_INVALID_ARGUMENT,
            "far_algorithm is %d: FM_WORLD_JFA_PUBLISHED, FM_WORLD_JFA, FM_WORLD_JFA_1_PLUS and FM_WORLD_JFA_PLUS_2 are accepted",
            (int)method->far_algorithm);
    }
    return FM_OK;
}

// Sites are packed into 32 bits, 10 for each axis of the domain.
static fm_result check_sites(const fm_world_method *method, fm_shape shape) {
    enum { MAX_DOMAIN = 1024 };
    uint32_t longest = (uint32_t)fm_max_u64(shape.x, fm_max_u64(shape.y, shape.z));
    if (fm_chunk_propagates_sites(method->algorithm) && method->chunk == 0 && longest > MAX_DOMAIN) {
        return fm_fail(FM_ERROR_UNSUPPORTED, "%s on the whole world takes axes up to %d: this one has %u. Use chunks",
                       algorithm_names[method->algorithm], MAX_DOMAIN, longest);
    }
    return FM_OK;
}

static fm_result check_method(fm_world_method *method, const fm_world_desc *desc) {
    FM_TRY(check_enumerators(method));
    const char *name = algorithm_names[method->algorithm];
    bool power = method->chunk >= 8 && method->chunk <= 256 && (method->chunk & (method->chunk - 1)) == 0;
    if (method->chunk != 0 && !power) {
        return fm_fail(FM_ERROR_INVALID_ARGUMENT, "chunk is %u: 0, 8, 16, 32, 64, 128 and 256 are accepted", method->chunk);
    }
    if (method->algorithm == FM_WORLD_EXACT && method->chunk != 0) {
        return fm_fail(FM_ERROR_INVALID_ARGUMENT, "chunk is %u: FM_WORLD_EXACT has no chunks and takes 0", method->chunk);
    }
    if (method->algorithm != FM_WORLD_EXACT && desc->format == FM_FIELD_SQUARED_U32) {
        return fm_fail(FM_ERROR_UNSUPPORTED, "%s computes Manhattan distances: FM_FIELD_SQUARED_U32 wants FM_WORLD_EXACT", name);
    }
    if (method->border == FM_BORDER_EXCHANGE && method->chunk != 0 && !fm_chunk_relaxes(method->algorithm)) {
        return fm_fail(FM_ERROR_INVALID_ARGUMENT, "border is FM_BORDER_EXCHANGE: FM_WORLD_FIM and FM_WORLD_JFA_FIM take it, not %s",
                       name);
    }
    FM_TRY(check_selective(method));
    return check_sites(method, desc->shape);
}

static fm_result check_desc(fm_world_desc *desc) {
    const uint32_t axes[3] = {desc->shape.x, desc->shape.y, desc->shape.z};
    for (int i = 0; i < 3; i++) {
        if (axes[i] == 0 || axes[i] > FM_WORLD_MAX_AXIS) {
            return fm_fail(FM_ERROR_INVALID_ARGUMENT, "shape is %u x %u x %u: every axis must be 1 to %d", axes[0], axes[1],
                           axes[2], FM_WORLD_MAX_AXIS);
        }
    }
    if ((unsigned)desc->format > FM_FIELD_SQUARED_U32) {
        return fm_fail(FM_ERROR_INVALID_ARGUMENT, "format is %d: not an fm_field_format", (int)desc->format);
    }
    if (desc->max_distance != 0 && desc->format != FM_FIELD_SQUARED_U32) {
        return fm_fail(FM_ERROR_INVALID_ARGUMENT, "max_distance is %u: only FM_FIELD_SQUARED_U32 takes one", desc->max_distance);
    }
    if (desc->max_distance > UINT16_MAX) {
        return fm_fail(FM_ERROR_INVALID_ARGUMENT, "max_distance is %u: at most 65535", desc->max_distance);
    }
    return check_method(&desc->method, desc);
}

fm_result fm_world_create(fm_context *context, const fm_world_desc *desc, fm_world **result) {
    if (!context || !desc || !result) {
        return fm_fail(FM_ERROR_INVALID_ARGUMENT, "%s is NULL", !context ? "context" : desc ? "world" : "desc");
    }
    fm_world_desc checked = *desc;
    FM_TRY(check_desc(&checked));
    if (checked.exportable && !context->gpu) {
        return fm_fail(FM_ERROR_UNSUPPORTED, "exportable is set: only device memory can be exported");
    }
    fm_world *world = fm_alloc_zero(&context->allocator, sizeof *world, "a world");
    if (!world) {
        return FM_ERROR_OUT_OF_HOST_MEMORY;
    }
    world->context = context;
    world->desc = checked;
    world->all_dirty = true;
    fm_result status = fm_queue_create(world, &world->queue);
    if (status == FM_OK) {
        status = context->gpu ? fm_gpu_world_create(world) : fm_host_world_create(world, &world->host);
    }
    if (status != FM_OK) {
        fm_world_destroy(world);
        return status;
    }
    *result = world;
    return FM_OK;
}

void fm_world_destroy(fm_world *world) {
    if (!world) {
        return;
    }
    fm_gpu_world_destroy(world);
    fm_host_world_destroy(world);
    fm_chunks_destroy(world);
    fm_queue_destroy(world->queue);
    fm_free(&world->context->allocator, world, sizeof *world);
}

fm_context *fm_world_context(const fm_world *world) {
    return world->context;
}

void fm_world_info(const fm_world *world, fm_world_desc *desc) {
    if (world && desc) {
        *desc = world->desc;
    }
}

// All methods but the published jump flooding are exact within a domain, and only a halo takes what it does not know for air.
bool fm_world_method_overestimates(const fm_world_method *method) {
    if (!method) {
        return false;
    }
    const bool selective = method->algorithm == FM_WORLD_SELECTIVE;
    const fm_world_algorithm far = selective ? method->far_algorithm : method->algorithm;
    // SELECTIVE's EXACT stands for JFA_PUBLISHED there.
    const bool floods = far == FM_WORLD_JFA_PUBLISHED || (selective && far == FM_WORLD_EXACT);
    return floods || (method->chunk && method->border == FM_BORDER_HALO);
}

fm_result fm_world_set_method(fm_world *world, const fm_world_method *method) {
    if (!world || !method) {
        return fm_fail(FM_ERROR_INVALID_ARGUMENT, "%s is NULL", world ? "method" : "world");
    }
    fm_world_method checked = *method;
    FM_TRY(check_method(&checked, &world->desc));
    fm_world_method before = world->desc.method;
    world->desc.method = checked;
    fm_result status = world->gpu ? fm_gpu_world_prepare(world) : fm_host_world_prepare(world);
    if (status != FM_OK) {
        world->desc.method = before;
        return status;
    }
    world->all_dirty = true;
    return FM_OK;
}

void fm_world_set_focus(fm_world *world, const int32_t focus[3]) {
    if (!world || !focus) {
        return;
    }
    memcpy(world->desc.method.focus, focus, sizeof world->desc.method.focus);
    world->focus_moved = world->desc.method.algorithm == FM_WORLD_SELECTIVE;
}

fm_result fm_world_edit(fm_world *world, const fm_brush *brushes, uint32_t count) {
    if (!world || (!brushes && count > 0)) {
        return fm_fail(FM_ERROR_INVALID_ARGUMENT, "%s is NULL", world ? "brushes" : "world");
    }
    return count == 0 ? FM_OK : fm_queue_brushes(world->queue, brushes, count);
}

void fm_world_mark(fm_world *world, const fm_box *box) {
    if (world && box) {
        fm_queue_mark(world->queue, box);
    }
}

static fm_result carry_out(fm_world *world) {
    fm_world_job job = {.full = world->all_dirty};
    const fm_box *touched;
    uint32_t touched_count;
    FM_TRY(fm_queue_job(world->queue, &job, &touched, &touched_count));
    if (job.batch_count == 0 && !job.full && !world->focus_moved) {
        return FM_OK;
    }
    if (world->desc.method.algorithm != FM_WORLD_EXACT) {
        FM_TRY(fm_chunks_plan(world, touched, touched_count, &job));
    }
    return world->gpu ? fm_gpu_world_update(world, &job) : fm_host_world_update(world, &job);
}

fm_result fm_world_update(fm_world *world, fm_ticket *ticket) {
    if (!world) {
        return fm_fail(FM_ERROR_INVALID_ARGUMENT, "world is NULL");
    }
    if (world->all_dirty || world->focus_moved || !fm_queue_empty(world->queue)) {
        FM_TRY(carry_out(world));
        fm_chunks_done(world);
        fm_queue_clear(world->queue);
        world->all_dirty = false;
        world->focus_moved = false;
    }
    if (ticket) {
        *ticket = world->newest;
        return FM_OK;
    }
    return fm_wait(world->context, world->newest);
}

fm_result fm_world_stats_get(fm_world *world, fm_world_stats *stats) {
    if (!world || !stats) {
        return fm_fail(FM_ERROR_INVALID_ARGUMENT, "%s is NULL", world ? "stats" : "world");
    }
    if (world->gpu) {
        FM_TRY(fm_gpu_world_stats(world));
    }
    *stats = world->stats;
    return FM_OK;
}
