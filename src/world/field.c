// SPDX-License-Identifier: MIT
// The field as host arrays: distances by themselves, in the type that is wanted, and colours.

#include "world/gpu_world.h"
#include "world/host_world.h"
#include "world/transfer.h"

static fm_result check_array(const fm_array *array, const char *name, const fm_box *box, bool any_type) {
    if (!array->data) {
        return fm_fail(FM_ERROR_INVALID_ARGUMENT, "%s has no data", name);
    }
    const fm_shape shape = array->shape;
    uint32_t size[3];
    for (int i = 0; i < 3; i++) {
        size[i] = (uint32_t)(box->end[i] - box->begin[i]);
    }
    if (!fm_shape_equal(shape, (fm_shape){size[0], size[1], size[2]})) {
        return fm_fail(FM_ERROR_INVALID_ARGUMENT, "%s is %u x %u x %u: what is read is %u x %u x %u", name, shape.x, shape.y,
                       shape.z, size[0], size[1], size[2]);
    }
    const bool good = array->type == FM_TYPE_U8 ||
                      (any_type && (array->type == FM_TYPE_U16 || array->type == FM_TYPE_U32 || array->type == FM_TYPE_F32));
    if (!good) {
        return fm_fail(FM_ERROR_INVALID_ARGUMENT, "%s is of %s: %s accepted", name, fm_type_name(array->type),
                       any_type ? "uint8, uint16, uint32 and float32 are" : "uint8 is");
    }
    if ((uintptr_t)array->data % fm_type_size(array->type) != 0) {
        return fm_fail(FM_ERROR_INVALID_ARGUMENT, "%s is at %p: not aligned to its elements", name, array->data);
    }
    return FM_OK;
}

static void store_distances(const fm_array *array, uint64_t first, const uint32_t *distances, uint64_t count) {
    for (uint64_t i = 0; i < count; i++) {
        const uint32_t value = distances[i];
        switch (array->type) {
        case FM_TYPE_U8:
            ((uint8_t *)array->data)[first + i] = (uint8_t)fm_min_u64(value, UINT8_MAX);
            break;
        case FM_TYPE_U16:
            ((uint16_t *)array->data)[first + i] = (uint16_t)fm_min_u64(value, UINT16_MAX);
            break;
        case FM_TYPE_U32:
            ((uint32_t *)array->data)[first + i] = value;
            break;
        default:
            ((float *)array->data)[first + i] = (float)value;
            break;
        }
    }
}

// Whether the array takes the field's distances as they are.
static bool same_type(fm_field_format format, fm_type type) {
    return (format == FM_FIELD_SPLIT_U8 && type == FM_TYPE_U8) || (format == FM_FIELD_SPLIT_U16 && type == FM_TYPE_U16) ||
           (format == FM_FIELD_SQUARED_U32 && type == FM_TYPE_U32);
}

typedef struct field_arrays {
    fm_field_format format;
    const fm_array *distance;
    const fm_array *colors;  // of a packed field; else NULL
} field_arrays;

static void take_entries(void *user, const void *entries, uint64_t first, uint64_t count) {
    enum { RUN = 1024 };
    const field_arrays *to = user;
    uint32_t run[RUN];
    for (uint64_t done = 0; done < count; done += RUN) {
        const uint64_t length = fm_min_u64(RUN, count - done);
        for (uint64_t i = 0; i < length; i++) {
            run[i] = fm_field_distance(to->format, entries, done + i);
        }
        store_distances(to->distance, first + done, run, length);
    }
    for (uint64_t i = 0; to->colors && i < count; i++) {
        ((uint8_t *)to->colors->data)[first + i] = (uint8_t)((const uint32_t *)entries)[i];
    }
}

fm_result fm_world_read_field(fm_world *world, const fm_box *box, const fm_array *distance, const fm_array *colors) {
    if (!world || !distance) {
        return fm_fail(FM_ERROR_INVALID_ARGUMENT, "%s is NULL", world ? "distance" : "world");
    }
    const fm_shape shape = world->desc.shape;
    const fm_box all = {{0, 0, 0}, {shape.x, shape.y, shape.z}};
    if (box) {
        FM_TRY(fm_world_check_box(world, box));
    } else {
        box = &all;
    }
    FM_TRY(check_array(distance, "distance", box, true));
    if (colors) {
        FM_TRY(check_array(colors, "colors", box, false));
    }
    FM_TRY(fm_wait(world->context, world->newest));
    const fm_field_format format = world->desc.format;
    const fm_host_world *host = world->host;
    const fm_gpu_world *gpu = world->gpu;
    if (colors && format != FM_FIELD_PACKED) {
        const fm_plane plane = {host ? host->colors : NULL, gpu ? gpu->colors : NULL, 1};
        FM_TRY(fm_world_copy_plane(world, &plane, box, colors->data));
        colors = NULL;
    }
    const fm_plane plane = {host ? host->field : NULL, gpu ? gpu->field : NULL, fm_field_width(format)};
    if (same_type(format, distance->type)) {
        return fm_world_copy_plane(world, &plane, box, distance->data);
    }
    field_arrays to = {format, distance, colors};
    return fm_world_read_plane(world, &plane, box, take_entries, &to);
}
