// SPDX-License-Identifier: MIT
// The public calls: arguments are checked here, and nowhere below.

#include "transform/plan.h"

#include <string.h>

static fm_result check_array(const fm_array *array, const char *name, fm_shape shape, uint64_t *bytes) {
    fm_result result = fm_array_bytes(array->shape, array->type, bytes);
    if (result != FM_OK) {
        return fm_fail_prefix(result, name);
    }
    if (!array->data) {
        return fm_fail(FM_ERROR_INVALID_ARGUMENT, "%s: data is NULL", name);
    }
    size_t alignment = array->type == FM_TYPE_BITS ? sizeof(uint32_t) : fm_type_size(array->type);
    if ((uintptr_t)array->data % alignment != 0) {
        return fm_fail(FM_ERROR_INVALID_ARGUMENT, "%s: data is %p, not aligned to the %zu bytes of its elements", name, array->data,
                       alignment);
    }
    if (!fm_shape_equal(array->shape, shape)) {
        return fm_fail(FM_ERROR_INVALID_ARGUMENT, "%s: shape is %u x %u x %u where solid has %u x %u x %u", name, array->shape.x,
                       array->shape.y, array->shape.z, shape.x, shape.y, shape.z);
    }
    return FM_OK;
}

static bool overlap(const fm_array *a, uint64_t a_bytes, const fm_array *b, uint64_t b_bytes) {
    uintptr_t a_start = (uintptr_t)a->data;
    uintptr_t b_start = (uintptr_t)b->data;
    return a_start < b_start + b_bytes && b_start < a_start + a_bytes;
}

static fm_result check_arrays(const fm_array *solid, const fm_array *distance, const fm_array *indices) {
    const fm_array *arrays[3] = {solid, distance, indices};
    static const char *const names[3] = {"solid", "distance", "indices"};
    uint64_t bytes[3] = {0, 0, 0};
    if (!solid) {
        return fm_fail(FM_ERROR_INVALID_ARGUMENT, "solid is NULL");
    }
    for (int i = 0; i < 3; i++) {
        if (!arrays[i]) {
            continue;
        }
        FM_TRY(check_array(arrays[i], names[i], solid->shape, &bytes[i]));
        for (int j = 0; j < i; j++) {
            if (arrays[j] && overlap(arrays[j], bytes[j], arrays[i], bytes[i])) {
                return fm_fail(FM_ERROR_INVALID_ARGUMENT, "%s overlaps %s: each needs memory of its own", names[i], names[j]);
            }
        }
    }
    return FM_OK;
}

// Bits that need no encoding: they select themselves and rows have no padding.
static bool is_sites(const fm_plan *plan, fm_type type) {
    return type == FM_TYPE_BITS && plan->select == FM_SELECT_NONZERO && plan->shape.x % 32 == 0;
}

static uint64_t sites_bytes(const fm_plan *plan) {
    return (uint64_t)fm_bits_row_words(plan->shape) * plan->shape.y * plan->shape.z * sizeof(uint32_t);
}

static fm_result run_on_cpu(fm_context *context, const fm_plan *plan, const fm_array *solid, bool nan_is_empty, void *distance,
                            void *indices) {
    bool direct = is_sites(plan, solid->type);
    uint64_t encoded = direct ? 0 : fm_round_up(sites_bytes(plan), FM_ALIGNMENT);
    uint64_t bytes;
    void *memory;
    FM_TRY(fm_cpu_scratch_bytes(context, plan, &bytes));
    if (fm_add_overflows(bytes, encoded, &bytes)) {
        return fm_fail(FM_ERROR_RANGE, "shape is %u x %u x %u: the scratch memory is more than 64 bits count", plan->shape.x,
                       plan->shape.y, plan->shape.z);
    }
    FM_TRY(fm_context_scratch(context, bytes, &memory));
    fm_passes_begin(context);
    fm_sites sites = {plan->shape, direct ? solid->data : memory};
    if (!direct) {
        FM_TRY(fm_sites_encode(context, plan, solid->type, solid->data, nan_is_empty, memory));
    }
    fm_cpu_transform(context, plan, &sites, (uint8_t *)memory + encoded, distance, indices);
    return FM_OK;
}

// Volumes on the device for one host call.
typedef struct staged_volumes {
    fm_volume *solid, *distance, *indices;
} staged_volumes;

static void staged_destroy(staged_volumes *staged) {
    fm_volume_destroy(staged->solid);
    fm_volume_destroy(staged->distance);
    fm_volume_destroy(staged->indices);
}

static fm_result staged_create(fm_context *context, fm_shape shape, const fm_array *distance, const fm_array *indices,
                               staged_volumes *staged) {
    fm_volume_desc desc = {.shape = shape, .type = FM_TYPE_BITS, .storage = FM_STORAGE_DEVICE};
    FM_TRY(fm_volume_create(context, &desc, &staged->solid));
    if (distance) {
        desc.type = distance->type;
        FM_TRY(fm_volume_create(context, &desc, &staged->distance));
    }
    if (indices) {
        desc.type = indices->type;
        FM_TRY(fm_volume_create(context, &desc, &staged->indices));
    }
    return FM_OK;
}

static fm_result run_staged(fm_context *context, const fm_plan *plan, const fm_array *solid, const fm_array *distance,
                            const fm_array *indices, staged_volumes *staged) {
    FM_TRY(staged_create(context, plan->shape, distance, indices, staged));
    const void *words = solid->data;
    if (!is_sites(plan, solid->type)) {
        void *memory;
        FM_TRY(fm_context_scratch(context, sites_bytes(plan), &memory));
        FM_TRY(fm_sites_encode(context, plan, solid->type, solid->data, false, memory));
        words = memory;
    }
    FM_TRY(fm_volume_upload(staged->solid, words));
    // The bits are the answer to the selection already.
    fm_plan bits = *plan;
    bits.select = FM_SELECT_NONZERO;
    fm_ticket ticket = 0;
    FM_TRY(fm_gpu_transform(context, &bits, staged->solid, staged->distance, staged->indices, &ticket));
    FM_TRY(fm_wait(context, ticket));
    if (distance) {
        FM_TRY(fm_volume_download(staged->distance, distance->data));
    }
    return indices ? fm_volume_download(staged->indices, indices->data) : FM_OK;
}

fm_result fm_transform_host(fm_context *context, const fm_transform_desc *desc, const fm_array *solid, const fm_array *distance,
                            const fm_array *indices) {
    if (!context) {
        return fm_fail(FM_ERROR_INVALID_ARGUMENT, "context is NULL");
    }
    FM_TRY(check_arrays(solid, distance, indices));
    fm_plan plan;
    FM_TRY(
        fm_plan_make(desc, solid->shape, solid->type, distance ? &distance->type : NULL, indices ? &indices->type : NULL, &plan));
    if (!context->gpu) {
        return run_on_cpu(context, &plan, solid, false, distance ? distance->data : NULL, indices ? indices->data : NULL);
    }
    staged_volumes staged = {0};
    fm_result result = run_staged(context, &plan, solid, distance, indices, &staged);
    staged_destroy(&staged);
    return result;
}

static fm_result check_volume(const fm_context *context, const fm_volume *volume, const char *name, fm_shape shape) {
    if ((volume->buffer != NULL) != (context->gpu != NULL)) {
        return fm_fail(FM_ERROR_INVALID_ARGUMENT, "%s lies in %s memory: the context computes in %s memory", name,
                       volume->buffer ? "device" : "host", context->gpu ? "device" : "host");
    }
    if (volume->buffer && volume->context != context) {
        return fm_fail(FM_ERROR_INVALID_ARGUMENT, "%s belongs to another context", name);
    }
    const fm_shape own = volume->desc.shape;
    if (!fm_shape_equal(own, shape)) {
        return fm_fail(FM_ERROR_INVALID_ARGUMENT, "%s: shape is %u x %u x %u where solid has %u x %u x %u", name, own.x, own.y,
                       own.z, shape.x, shape.y, shape.z);
    }
    return FM_OK;
}

static fm_result check_volumes(const fm_context *context, const fm_volume *solid, const fm_volume *distance,
                               const fm_volume *indices) {
    const fm_volume *volumes[3] = {solid, distance, indices};
    static const char *const names[3] = {"solid", "distance", "indices"};
    if (!solid) {
        return fm_fail(FM_ERROR_INVALID_ARGUMENT, "solid is NULL");
    }
    for (int i = 0; i < 3; i++) {
        if (!volumes[i]) {
            continue;
        }
        FM_TRY(check_volume(context, volumes[i], names[i], solid->desc.shape));
        for (int j = 0; j < i; j++) {
            if (volumes[i] == volumes[j]) {
                return fm_fail(FM_ERROR_INVALID_ARGUMENT, "%s and %s are the same volume", names[j], names[i]);
            }
        }
    }
    return FM_OK;
}

static fm_result check_device_type(fm_type type) {
    if (type != FM_TYPE_U8 && type != FM_TYPE_U16 && type != FM_TYPE_U32 && type != FM_TYPE_F32 && type != FM_TYPE_BITS) {
        return fm_fail(FM_ERROR_INVALID_ARGUMENT, "solid is %s: in device memory uint8, uint16, uint32, float32 or bits are read",
                       fm_type_name(type));
    }
    return FM_OK;
}

fm_result fm_transform(fm_context *context, const fm_transform_desc *desc, const fm_volume *solid, fm_volume *distance,
                       fm_volume *indices, fm_ticket *ticket) {
    if (!context) {
        return fm_fail(FM_ERROR_INVALID_ARGUMENT, "context is NULL");
    }
    FM_TRY(check_volumes(context, solid, distance, indices));
    fm_plan plan;
    FM_TRY(fm_plan_make(desc, solid->desc.shape, solid->desc.type, distance ? &distance->desc.type : NULL,
                        indices ? &indices->desc.type : NULL, &plan));
    fm_ticket done = 0;
    if (context->gpu) {
        FM_TRY(check_device_type(solid->desc.type));
        FM_TRY(fm_gpu_transform(context, &plan, solid, distance, indices, &done));
        if (!ticket) {
            FM_TRY(fm_wait(context, done));
        }
    } else {
        fm_array array = {solid->data, solid->desc.type, solid->desc.shape};
        FM_TRY(run_on_cpu(context, &plan, &array, true, distance ? distance->data : NULL, indices ? indices->data : NULL));
    }
    if (ticket) {
        *ticket = done;
    }
    if (distance) {
        memcpy(distance->desc.spacing, solid->desc.spacing, sizeof distance->desc.spacing);
        memcpy(distance->desc.origin, solid->desc.origin, sizeof distance->desc.origin);
    }
    return FM_OK;
}
