// SPDX-License-Identifier: MIT
#include "volume/volume.h"

#include "gpu/gpu.h"

#include <math.h>
#include <string.h>

enum { PALETTE_BYTES = 1024 };

typedef struct type_row {
    const char *name;
    size_t size;
} type_row;

static const type_row types[] = {
    [FM_TYPE_U8] = {"uint8", 1},   [FM_TYPE_U16] = {"uint16", 2}, [FM_TYPE_U32] = {"uint32", 4},  [FM_TYPE_F32] = {"float32", 4},
    [FM_TYPE_BITS] = {"bits", 0},  [FM_TYPE_I8] = {"int8", 1},    [FM_TYPE_I16] = {"int16", 2},   [FM_TYPE_I32] = {"int32", 4},
    [FM_TYPE_U64] = {"uint64", 8}, [FM_TYPE_I64] = {"int64", 8},  [FM_TYPE_F64] = {"float64", 8},
};
enum { TYPE_COUNT = sizeof types / sizeof types[0] };

const char *fm_type_name(fm_type type) {
    return (unsigned)type < TYPE_COUNT ? types[type].name : "unknown type";
}

size_t fm_type_size(fm_type type) {
    return (unsigned)type < TYPE_COUNT ? types[type].size : 0;
}

fm_result fm_array_bytes(fm_shape shape, fm_type type, uint64_t *bytes) {
    if (!bytes) {
        return fm_fail(FM_ERROR_INVALID_ARGUMENT, "bytes is NULL");
    }
    if ((unsigned)type >= TYPE_COUNT) {
        return fm_fail(FM_ERROR_INVALID_ARGUMENT, "type is %d: not an fm_type", (int)type);
    }
    const uint32_t axes[3] = {shape.x, shape.y, shape.z};
    for (int i = 0; i < 3; i++) {
        if (axes[i] == 0 || axes[i] > INT32_MAX) {
            return fm_fail(FM_ERROR_INVALID_ARGUMENT, "shape is %u x %u x %u: every axis must be 1 to 2147483647", shape.x, shape.y,
                           shape.z);
        }
    }
    uint64_t row = type == FM_TYPE_BITS ? (uint64_t)fm_bits_row_words(shape) * 4 : (uint64_t)shape.x * types[type].size;
    if (fm_mul_overflows(row, shape.y, bytes) || fm_mul_overflows(*bytes, shape.z, bytes) || *bytes > INT64_MAX) {
        return fm_fail(FM_ERROR_RANGE, "shape is %u x %u x %u of %s: more bytes than 63 bits count", shape.x, shape.y, shape.z,
                       fm_type_name(type));
    }
    return FM_OK;
}

fm_result fm_spacing_resolve(const double spacing[3], double resolved[3]) {
    bool unset = spacing[0] == 0 && spacing[1] == 0 && spacing[2] == 0;
    for (int i = 0; i < 3; i++) {
        resolved[i] = unset ? 1.0 : spacing[i];
        if (!isfinite(resolved[i]) || resolved[i] <= 0) {
            return fm_fail(FM_ERROR_INVALID_ARGUMENT, "spacing is %g, %g, %g: finite numbers above 0, or all 0 for 1, 1, 1",
                           spacing[0], spacing[1], spacing[2]);
        }
    }
    return FM_OK;
}

static fm_result check_origin(const double origin[3]) {
    for (int i = 0; i < 3; i++) {
        if (!isfinite(origin[i])) {
            return fm_fail(FM_ERROR_INVALID_ARGUMENT, "origin is %g, %g, %g: finite numbers are accepted", origin[0], origin[1],
                           origin[2]);
        }
    }
    return FM_OK;
}

static fm_result resolve_storage(const fm_context *context, fm_volume_desc *desc) {
    bool on_gpu = context && context->gpu;
    switch (desc->storage) {
    case FM_STORAGE_DEFAULT:
        desc->storage = on_gpu ? FM_STORAGE_DEVICE : FM_STORAGE_HOST;
        break;
    case FM_STORAGE_HOST:
        break;
    case FM_STORAGE_DEVICE:
        if (!on_gpu) {
            return fm_fail(FM_ERROR_UNSUPPORTED, "storage is FM_STORAGE_DEVICE: %s",
                           context ? "the context runs on the CPU backend" : "there is no context");
        }
        break;
    default:
        return fm_fail(FM_ERROR_INVALID_ARGUMENT, "storage is %d: not an fm_storage", (int)desc->storage);
    }
    if (desc->exportable && desc->storage != FM_STORAGE_DEVICE) {
        return fm_fail(FM_ERROR_UNSUPPORTED, "exportable is set: only device memory can be exported");
    }
    return FM_OK;
}

fm_result fm_volume_create(fm_context *context, const fm_volume_desc *desc, fm_volume **result) {
    if (!desc || !result) {
        return fm_fail(FM_ERROR_INVALID_ARGUMENT, "%s is NULL", desc ? "volume" : "desc");
    }
    fm_volume_desc resolved = *desc;
    uint64_t bytes;
    FM_TRY(fm_array_bytes(desc->shape, desc->type, &bytes));
    FM_TRY(fm_spacing_resolve(desc->spacing, resolved.spacing));
    FM_TRY(check_origin(desc->origin));
    FM_TRY(resolve_storage(context, &resolved));

    const fm_allocator *allocator = context ? &context->allocator : &fm_default_allocator;
    fm_volume *volume = fm_alloc_zero(allocator, sizeof *volume, "a volume");
    if (!volume) {
        return FM_ERROR_OUT_OF_HOST_MEMORY;
    }
    volume->context = context;
    volume->allocator = *allocator;
    volume->desc = resolved;
    volume->bytes = bytes;
    fm_result status = FM_OK;
    if (resolved.storage == FM_STORAGE_DEVICE) {
        status = fm_buffer_create(context->gpu, FM_PURPOSE_VOLUMES, bytes, resolved.exportable, &volume->buffer);
    } else {
        volume->data = fm_alloc(allocator, bytes, "a volume's elements");
        status = volume->data ? FM_OK : FM_ERROR_OUT_OF_HOST_MEMORY;
        if (status == FM_OK && context) {
            fm_meter_add(&context->host[FM_PURPOSE_VOLUMES], bytes);
        }
    }
    if (status != FM_OK) {
        fm_free(allocator, volume, sizeof *volume);
        return status;
    }
    *result = volume;
    return FM_OK;
}

void fm_volume_destroy(fm_volume *volume) {
    if (!volume) {
        return;
    }
    if (volume->buffer) {
        // A device that is lost has nothing in flight.
        (void)fm_gpu_wait(volume->context->gpu, fm_gpu_newest(volume->context->gpu));
        fm_buffer_destroy(volume->buffer);
    }
    if (volume->data) {
        fm_free(&volume->allocator, volume->data, volume->bytes);
        if (volume->context) {
            fm_meter_remove(&volume->context->host[FM_PURPOSE_VOLUMES], volume->bytes);
        }
    }
    fm_free(&volume->allocator, volume->palette, PALETTE_BYTES);
    fm_allocator allocator = volume->allocator;
    fm_free(&allocator, volume, sizeof *volume);
}

void fm_volume_info(const fm_volume *volume, fm_volume_desc *desc) {
    *desc = volume->desc;
}

fm_result fm_volume_place(fm_volume *volume, const double spacing[3], const double origin[3]) {
    if (!volume) {
        return fm_fail(FM_ERROR_INVALID_ARGUMENT, "volume is NULL");
    }
    double resolved[3] = {1, 1, 1};
    if (spacing) {
        FM_TRY(fm_spacing_resolve(spacing, resolved));
    }
    if (origin) {
        FM_TRY(check_origin(origin));
        memcpy(volume->desc.origin, origin, sizeof volume->desc.origin);
    }
    if (spacing) {
        memcpy(volume->desc.spacing, resolved, sizeof resolved);
    }
    return FM_OK;
}

void *fm_volume_data(fm_volume *volume) {
    return volume->data;
}

const uint8_t *fm_volume_palette(const fm_volume *volume) {
    return volume->palette;
}

fm_result fm_volume_set_palette(fm_volume *volume, const uint8_t *rgba) {
    if (!volume) {
        return fm_fail(FM_ERROR_INVALID_ARGUMENT, "volume is NULL");
    }
    if (!rgba) {
        fm_free(&volume->allocator, volume->palette, PALETTE_BYTES);
        volume->palette = NULL;
        return FM_OK;
    }
    if (!volume->palette) {
        volume->palette = fm_alloc(&volume->allocator, PALETTE_BYTES, "a palette");
        if (!volume->palette) {
            return FM_ERROR_OUT_OF_HOST_MEMORY;
        }
    }
    memcpy(volume->palette, rgba, PALETTE_BYTES);
    return FM_OK;
}

fm_result fm_volume_upload(fm_volume *volume, const void *source) {
    if (!volume || !source) {
        return fm_fail(FM_ERROR_INVALID_ARGUMENT, "%s is NULL", volume ? "source" : "volume");
    }
    if (volume->buffer) {
        return fm_buffer_upload_at(volume->buffer, 0, source, volume->bytes);
    }
    memcpy(volume->data, source, volume->bytes);
    return FM_OK;
}

fm_result fm_volume_download(fm_volume *volume, void *target) {
    if (!volume || !target) {
        return fm_fail(FM_ERROR_INVALID_ARGUMENT, "%s is NULL", volume ? "target" : "volume");
    }
    if (volume->buffer) {
        return fm_buffer_download_at(volume->buffer, 0, target, volume->bytes);
    }
    memcpy(target, volume->data, volume->bytes);
    return FM_OK;
}

fm_result fm_volume_copy(fm_context *context, const fm_volume *source, fm_volume *target, fm_ticket *ticket) {
    if (!context || !source || !target) {
        return fm_fail(FM_ERROR_INVALID_ARGUMENT, "%s is NULL", !context ? "context" : source ? "target" : "source");
    }
    if (source == target || source->desc.type != target->desc.type || !fm_shape_equal(source->desc.shape, target->desc.shape)) {
        return fm_fail(FM_ERROR_INVALID_ARGUMENT, "source and target must be two volumes of the same shape and type");
    }
    if ((source->buffer && source->context != context) || (target->buffer && target->context != context)) {
        return fm_fail(FM_ERROR_INVALID_ARGUMENT, "a device volume belongs to another context");
    }
    if (source->buffer && target->buffer) {
        return fm_gpu_copy(context->gpu, source->buffer, target->buffer, source->bytes, ticket);
    }
    if (source->buffer) {
        FM_TRY(fm_buffer_download_at(source->buffer, 0, target->data, source->bytes));
    } else if (target->buffer) {
        FM_TRY(fm_buffer_upload_at(target->buffer, 0, source->data, source->bytes));
    } else {
        fm_passes_begin(context);
        memcpy(target->data, source->data, source->bytes);
        fm_passes_end(context, "copy", 2 * source->bytes);
    }
    if (ticket) {
        *ticket = 0;
    }
    return FM_OK;
}

fm_result fm_volume_vulkan(const fm_volume *volume, fm_volume_buffer *buffer) {
    if (!volume || !buffer) {
        return fm_fail(FM_ERROR_INVALID_ARGUMENT, "%s is NULL", volume ? "buffer" : "volume");
    }
    if (!volume->buffer) {
        return fm_fail(FM_ERROR_UNSUPPORTED, "the volume lies in host memory: it has no Vulkan buffer");
    }
    fm_buffer_describe(volume->buffer, buffer);
    buffer->size = volume->bytes;
    return FM_OK;
}

fm_result fm_volume_export_fd(const fm_volume *volume, int *fd) {
    if (!volume || !fd) {
        return fm_fail(FM_ERROR_INVALID_ARGUMENT, "%s is NULL", volume ? "fd" : "volume");
    }
    if (!volume->buffer || !volume->desc.exportable) {
        return fm_fail(FM_ERROR_UNSUPPORTED,
                       "the volume was not made exportable: set exportable and device storage in its descriptor");
    }
    return fm_buffer_export_fd(volume->buffer, fd);
}
