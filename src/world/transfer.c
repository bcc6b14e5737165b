// SPDX-License-Identifier: MIT
// Voxels and distances on their way between a world and host arrays, and where they lie. What the host does not reach goes through
// a piece of a few MiB, whole rows of the world at a time.

#include "world/transfer.h"

#include "world/gpu_world.h"
#include "world/host_world.h"

#include <string.h>

static uint64_t row_voxels(const fm_world *world) {
    return world->desc.shape.x;
}

uint32_t *fm_world_reached_voxels(const fm_world *world) {
    return world->host ? world->host->voxels : fm_buffer_mapped(world->gpu->voxels);
}

uint64_t fm_world_piece_rows(const fm_world *world) {
    enum { PIECE_VOXELS = 1 << 20 };
    return fm_max_u64(1, PIECE_VOXELS / row_voxels(world));
}

fm_result fm_world_put(fm_world *world, uint64_t first, const uint32_t *voxels, uint64_t count) {
    uint32_t *there = fm_world_reached_voxels(world);
    if (there) {
        memcpy(there + first, voxels, count * sizeof *voxels);
        return FM_OK;
    }
    return fm_buffer_upload_at(world->gpu->voxels, first * sizeof *voxels, voxels, count * sizeof *voxels);
}

fm_result fm_world_get(const fm_world *world, uint64_t first, uint32_t *voxels, uint64_t count) {
    if (world->host) {
        memcpy(voxels, world->host->voxels + first, count * sizeof *voxels);
        return FM_OK;
    }
    return fm_buffer_download_at(world->gpu->voxels, first * sizeof *voxels, voxels, count * sizeof *voxels);
}

static fm_result check_box(const fm_world *world, const fm_box *box, const void *voxels) {
    if (!world || !box || !voxels) {
        return fm_fail(FM_ERROR_INVALID_ARGUMENT, "%s is NULL", !world ? "world" : box ? "voxels" : "box");
    }
    const fm_shape shape = world->desc.shape;
    const int64_t axes[3] = {shape.x, shape.y, shape.z};
    for (int i = 0; i < 3; i++) {
        if (box->begin[i] < 0 || box->end[i] > axes[i] || box->begin[i] >= box->end[i]) {
            return fm_fail(FM_ERROR_INVALID_ARGUMENT,
                           "box is %lld to %lld along %c: it must hold a voxel and lie within 0 to %lld, its end excluded",
                           (long long)box->begin[i], (long long)box->end[i], "xyz"[i], (long long)axes[i]);
        }
    }
    return FM_OK;
}

// A run of rows of a box within one slice (all of the box where its rows follow each other), or what is left of it.
typedef struct box_walk {
    fm_shape shape;
    fm_box box;
    uint64_t width, rows;  // of the box in a slice
    bool whole_rows;       // of the world
    bool linear;           // no gap between slices either
    uint64_t next;         // row of the box
    uint64_t most;         // rows of a step
    uint64_t first;        // element of the world at which the step's first row begins
    uint64_t count;        // rows of the step
    uint64_t done;         // voxels of the box before the step
} box_walk;

static box_walk walk_box(const fm_world *world, const fm_box *box, uint64_t most) {
    box_walk walk = {.shape = world->desc.shape, .box = *box, .most = most};
    walk.width = (uint64_t)(box->end[0] - box->begin[0]);
    walk.rows = (uint64_t)(box->end[1] - box->begin[1]);
    walk.whole_rows = walk.width == walk.shape.x;
    walk.linear = walk.whole_rows && walk.rows == walk.shape.y;
    return walk;
}

static bool walk_next(box_walk *walk) {
    const uint64_t all = walk->rows * (uint64_t)(walk->box.end[2] - walk->box.begin[2]);
    walk->next += walk->count;
    if (walk->next == all) {
        return false;
    }
    const uint64_t y = (uint64_t)walk->box.begin[1] + walk->next % walk->rows;
    const uint64_t z = (uint64_t)walk->box.begin[2] + walk->next / walk->rows;
    const uint64_t left = walk->linear ? all - walk->next : walk->rows - walk->next % walk->rows;
    walk->first = walk->shape.x * (y + walk->shape.y * z);
    walk->count = fm_min_u64(left, walk->most);
    walk->done = walk->next * walk->width;
    return true;
}

// Copies `count` rows between a dense box and rows of the world.
static void copy_rows(uint32_t *to, uint64_t to_pitch, const uint32_t *from, uint64_t from_pitch, uint64_t width, uint64_t count) {
    for (uint64_t i = 0; i < count; i++) {
        memcpy(to + i * to_pitch, from + i * from_pitch, width * sizeof *to);
    }
}

fm_result fm_world_write(fm_world *world, const fm_box *box, const uint32_t *voxels) {
    FM_TRY(check_box(world, box, voxels));
    FM_TRY(fm_wait(world->context, world->newest));
    const uint64_t pitch = row_voxels(world), begin = (uint64_t)box->begin[0];
    uint32_t *there = fm_world_reached_voxels(world);
    void *piece = NULL;
    box_walk walk = walk_box(world, box, there ? UINT64_MAX : fm_world_piece_rows(world));
    if (!there && !walk.whole_rows) {
        FM_TRY(fm_context_scratch(world->context, walk.most * pitch * sizeof(uint32_t), &piece));
    }
    while (walk_next(&walk)) {
        if (there) {
            copy_rows(there + walk.first + begin, pitch, voxels + walk.done, walk.width, walk.width, walk.count);
        } else if (walk.whole_rows) {
            FM_TRY(fm_world_put(world, walk.first, voxels + walk.done, walk.count * pitch));
        } else {
            FM_TRY(fm_world_get(world, walk.first, piece, walk.count * pitch));
            copy_rows((uint32_t *)piece + begin, pitch, voxels + walk.done, walk.width, walk.width, walk.count);
            FM_TRY(fm_world_put(world, walk.first, piece, walk.count * pitch));
        }
    }
    fm_world_mark(world, box);
    return FM_OK;
}

fm_result fm_world_read(fm_world *world, const fm_box *box, uint32_t *voxels) {
    FM_TRY(check_box(world, box, voxels));
    FM_TRY(fm_wait(world->context, world->newest));
    const uint64_t pitch = row_voxels(world), begin = (uint64_t)box->begin[0];
    void *piece = NULL;
    box_walk walk = walk_box(world, box, world->host ? UINT64_MAX : fm_world_piece_rows(world));
    if (!world->host && !walk.whole_rows) {
        FM_TRY(fm_context_scratch(world->context, walk.most * pitch * sizeof(uint32_t), &piece));
    }
    while (walk_next(&walk)) {
        if (world->host) {
            copy_rows(voxels + walk.done, walk.width, world->host->voxels + walk.first + begin, pitch, walk.width, walk.count);
        } else if (walk.whole_rows) {
            FM_TRY(fm_world_get(world, walk.first, voxels + walk.done, walk.count * pitch));
        } else {
            FM_TRY(fm_world_get(world, walk.first, piece, walk.count * pitch));
            copy_rows(voxels + walk.done, walk.width, (uint32_t *)piece + begin, pitch, walk.width, walk.count);
        }
    }
    return FM_OK;
}

uint32_t *fm_world_map(fm_world *world) {
    return world ? fm_world_reached_voxels(world) : NULL;
}

const void *fm_world_field_data(const fm_world *world) {
    return world && world->host ? world->host->field : NULL;
}

static fm_result check_on_device(const fm_world *world) {
    if (!world) {
        return fm_fail(FM_ERROR_INVALID_ARGUMENT, "world is NULL");
    }
    if (!world->gpu) {
        return fm_fail(FM_ERROR_UNSUPPORTED, "the world lies in host memory: it has no Vulkan buffers");
    }
    return FM_OK;
}

static void describe(const fm_buffer *buffer, uint64_t bytes, fm_volume_buffer *description) {
    if (!description) {
        return;
    }
    *description = (fm_volume_buffer){0};
    if (buffer) {
        fm_buffer_describe(buffer, description);
        description->size = bytes;
    }
}

fm_result fm_world_vulkan(const fm_world *world, fm_volume_buffer *voxels, fm_volume_buffer *field, fm_volume_buffer *colors) {
    FM_TRY(check_on_device(world));
    const uint64_t count = fm_voxels(world->desc.shape);
    describe(world->gpu->voxels, count * sizeof(uint32_t), voxels);
    describe(world->gpu->field, count * fm_field_width(world->desc.format), field);
    describe(world->gpu->colors, count, colors);
    return FM_OK;
}

fm_result fm_world_export_fd(const fm_world *world, int *fd) {
    if (!fd) {
        return fm_fail(FM_ERROR_INVALID_ARGUMENT, "fd is NULL");
    }
    FM_TRY(check_on_device(world));
    if (!world->desc.exportable) {
        return fm_fail(FM_ERROR_UNSUPPORTED, "the world was not made exportable: set exportable in its descriptor");
    }
    return fm_buffer_export_fd(world->gpu->field, fd);
}

static fm_result check_array(const fm_world *world, const fm_array *array, const char *name, bool any_type) {
    if (!array->data) {
        return fm_fail(FM_ERROR_INVALID_ARGUMENT, "%s has no data", name);
    }
    const fm_shape shape = array->shape, own = world->desc.shape;
    if (!fm_shape_equal(shape, own)) {
        return fm_fail(FM_ERROR_INVALID_ARGUMENT, "%s is %u x %u x %u: the world is %u x %u x %u", name, shape.x, shape.y, shape.z,
                       own.x, own.y, own.z);
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

static void convert_entries(const fm_world *world, const void *entries, uint64_t first, uint64_t count, const fm_array *distance,
                            const fm_array *colors) {
    enum { RUN = 1024 };
    const fm_field_format format = world->desc.format;
    uint32_t run[RUN];
    for (uint64_t done = 0; done < count; done += RUN) {
        const uint64_t length = fm_min_u64(RUN, count - done);
        for (uint64_t i = 0; i < length; i++) {
            run[i] = fm_field_distance(format, entries, done + i);
        }
        store_distances(distance, first + done, run, length);
    }
    for (uint64_t i = 0; colors && format == FM_FIELD_PACKED && i < count; i++) {
        ((uint8_t *)colors->data)[first + i] = (uint8_t)((const uint32_t *)entries)[i];
    }
}

fm_result fm_world_read_field(fm_world *world, const fm_array *distance, const fm_array *colors) {
    if (!world || !distance) {
        return fm_fail(FM_ERROR_INVALID_ARGUMENT, "%s is NULL", world ? "distance" : "world");
    }
    FM_TRY(check_array(world, distance, "distance", true));
    if (colors) {
        FM_TRY(check_array(world, colors, "colors", false));
    }
    FM_TRY(fm_wait(world->context, world->newest));
    const uint64_t voxels = fm_voxels(world->desc.shape);
    const uint64_t width = fm_field_width(world->desc.format);
    const bool direct = same_type(world->desc.format, distance->type);
    if (colors && world->desc.format != FM_FIELD_PACKED) {
        if (world->host) {
            memcpy(colors->data, world->host->colors, voxels);
        } else {
            FM_TRY(fm_buffer_download_at(world->gpu->colors, 0, colors->data, voxels));
        }
    }
    if (world->host) {
        convert_entries(world, world->host->field, 0, voxels, distance, colors);
        return FM_OK;
    }
    if (direct) {
        return fm_buffer_download_at(world->gpu->field, 0, distance->data, voxels * width);
    }
    const uint64_t most = fm_world_piece_rows(world) * row_voxels(world);
    void *piece;
    FM_TRY(fm_context_scratch(world->context, most * width, &piece));
    for (uint64_t first = 0; first < voxels; first += most) {
        const uint64_t count = fm_min_u64(most, voxels - first);
        FM_TRY(fm_buffer_download_at(world->gpu->field, first * width, piece, count * width));
        convert_entries(world, piece, first, count, distance, colors);
    }
    return FM_OK;
}
