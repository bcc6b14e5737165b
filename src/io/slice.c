// SPDX-License-Identifier: MIT
#include "fathom/io.h"
#include "io/file.h"
#include "io/png.h"

#include <math.h>
#include <string.h>

enum { MAX_SCALE = 64, LEVELS = 1024 };

static const uint8_t no_site_color[3] = {128, 128, 128};
static const uint8_t nan_color[3] = {255, 0, 255};

// One slice being painted, row by row from the top.
typedef struct slice {
    const fm_volume *volume;
    const uint8_t *data;
    uint32_t axis, index;
    uint32_t columns, rows;  // in voxels
    uint32_t scale;
    bool mark_largest, flip;
    fm_slice_info info;
    uint8_t *line;     // of pixels
    uint32_t painted;  // the voxel row that `line` shows
    uint8_t lut[LEVELS][3];
} slice;

// Value of an element, NaN and infinities included.
static double element(const slice *s, uint32_t x, uint32_t y, uint32_t z) {
    fm_shape shape = s->volume->desc.shape;
    if (s->volume->desc.type == FM_TYPE_BITS) {
        const uint32_t *row = (const uint32_t *)(const void *)s->data + (y + (uint64_t)shape.y * z) * fm_bits_row_words(shape);
        return fm_bit(row, x);
    }
    uint64_t i = x + (uint64_t)shape.x * (y + (uint64_t)shape.y * z);
    const void *data = s->data;
    switch (s->volume->desc.type) {
    case FM_TYPE_U8:
        return ((const uint8_t *)data)[i];
    case FM_TYPE_U16:
        return ((const uint16_t *)data)[i];
    case FM_TYPE_U32:
        return ((const uint32_t *)data)[i];
    case FM_TYPE_U64:
        return (double)((const uint64_t *)data)[i];
    case FM_TYPE_I8:
        return ((const int8_t *)data)[i];
    case FM_TYPE_I16:
        return ((const int16_t *)data)[i];
    case FM_TYPE_I32:
        return ((const int32_t *)data)[i];
    case FM_TYPE_I64:
        return (double)((const int64_t *)data)[i];
    case FM_TYPE_F32:
        return (double)((const float *)data)[i];
    case FM_TYPE_F64:
        return ((const double *)data)[i];
    case FM_TYPE_BITS:
        break;
    }
    return 0;
}

// The value that stands for "no solid voxel" in an integer field.
static double largest_value(fm_type type) {
    switch (type) {
    case FM_TYPE_U8:
        return UINT8_MAX;
    case FM_TYPE_U16:
        return UINT16_MAX;
    case FM_TYPE_U32:
        return UINT32_MAX;
    case FM_TYPE_U64:
        return (double)UINT64_MAX;
    case FM_TYPE_I8:
        return INT8_MAX;
    case FM_TYPE_I16:
        return INT16_MAX;
    case FM_TYPE_I32:
        return INT32_MAX;
    case FM_TYPE_I64:
        return (double)INT64_MAX;
    default:
        return INFINITY;
    }
}

// Column and row of the slice, the row counted from the top of the picture.
static double slice_value(const slice *s, uint32_t column, uint32_t row) {
    switch (s->axis) {
    case 0:
        return element(s, s->index, column, s->rows - 1 - row);
    case 1:
        return element(s, column, s->index, s->rows - 1 - row);
    default:
        return element(s, column, row, s->index);
    }
}

static bool is_no_site(const slice *s, double value) {
    return !isfinite(value) || (s->mark_largest && fabs(value) >= largest_value(s->volume->desc.type));
}

static void find_range(slice *s, double *low, double *high) {
    *low = INFINITY;
    *high = -INFINITY;
    for (uint32_t row = 0; row < s->rows; row++) {
        for (uint32_t column = 0; column < s->columns; column++) {
            double value = slice_value(s, column, row);
            if (is_no_site(s, value)) {
                s->info.no_site++;
                continue;
            }
            *low = value < *low ? value : *low;
            *high = value > *high ? value : *high;
        }
    }
    if (*low > *high) {
        *low = *high = 0;
    }
}

static void choose_map(slice *s, const fm_slice_desc *desc) {
    double low, high;
    find_range(s, &low, &high);
    if (desc->min != 0 || desc->max != 0) {
        low = desc->min;
        high = desc->max;
    }
    fm_slice_info *info = &s->info;
    info->map = desc->map;
    if (info->map == FM_COLOR_AUTO) {
        const fm_type type = s->volume->desc.type;
        const bool floating = type == FM_TYPE_F32 || type == FM_TYPE_F64;
        info->map = s->volume->palette ? FM_COLOR_PALETTE
                    : low >= 0         ? FM_COLOR_SEQUENTIAL
                    : floating         ? FM_COLOR_DIVERGING
                                       : FM_COLOR_GREY;
    }
    if (info->map == FM_COLOR_DIVERGING) {
        high = fmax(fabs(low), fabs(high));
        low = -high;
    }
    info->min = low;
    info->max = high;
    for (int i = 0; i < LEVELS; i++) {
        fm_color_map_rgb(info->map, (double)i / (LEVELS - 1), s->lut[i]);
    }
}

static const uint8_t *label_color(const slice *s, double value) {
    uint64_t bits;
    memcpy(&bits, &value, sizeof bits);
    // The upper half of the product depends on all bits.
    return s->lut[value == 0 ? 0 : 1 + (bits * 0x9e3779b97f4a7c15u >> 32) % (LEVELS - 1)];
}

static const uint8_t *color_of(const slice *s, double value) {
    if (isnan(value)) {
        return nan_color;
    }
    if (s->info.map == FM_COLOR_PALETTE) {
        return s->volume->palette + 4 * (value > 0 ? value < 255 ? (int)value : 255 : 0);
    }
    if (is_no_site(s, value)) {
        return no_site_color;
    }
    if (s->info.map == FM_COLOR_LABELS) {
        return label_color(s, value);
    }
    double span = s->info.max - s->info.min;
    // A slice of one value lies at the middle of a diverging map (it is 0 then) and at the foot of the others.
    double t = span > 0 ? (value - s->info.min) / span : s->info.map == FM_COLOR_DIVERGING ? 0.5 : 0;
    return s->lut[(int)((t > 0 ? t < 1 ? t : 1 : 0) * (LEVELS - 1) + 0.5)];
}

static const uint8_t *paint_row(void *user, uint32_t y) {
    slice *s = user;
    uint32_t row = y / s->scale;
    if (row != s->painted) {
        s->painted = row;
        uint8_t *pixel = s->line;
        for (uint32_t column = 0; column < s->columns; column++) {
            const uint8_t *color = color_of(s, slice_value(s, column, s->flip ? s->rows - 1 - row : row));
            for (uint32_t i = 0; i < s->scale; i++, pixel += 3) {
                memcpy(pixel, color, 3);
            }
        }
    }
    return s->line;
}

static fm_result check_slice(const fm_volume *volume, uint32_t axis, uint32_t index, const fm_slice_desc *desc) {
    if (axis > 2) {
        return fm_fail(FM_ERROR_INVALID_ARGUMENT, "axis is %u: 0 (x), 1 (y) or 2 (z) are accepted", axis);
    }
    fm_shape shape = volume->desc.shape;
    uint32_t length = axis == 0 ? shape.x : axis == 1 ? shape.y : shape.z;
    if (index >= length) {
        return fm_fail(FM_ERROR_INVALID_ARGUMENT, "index is %u: the %c axis has slices 0 to %u", index, "xyz"[axis], length - 1);
    }
    if ((unsigned)desc->map > FM_COLOR_LABELS) {
        return fm_fail(FM_ERROR_INVALID_ARGUMENT, "map is %d: not an fm_color_map", (int)desc->map);
    }
    if (desc->map == FM_COLOR_PALETTE && !volume->palette) {
        return fm_fail(FM_ERROR_INVALID_ARGUMENT, "map is FM_COLOR_PALETTE: the volume has no palette");
    }
    if (!isfinite(desc->min) || !isfinite(desc->max) || desc->min > desc->max) {
        return fm_fail(FM_ERROR_INVALID_ARGUMENT, "min is %g and max %g: finite numbers, min not above max", desc->min, desc->max);
    }
    if (desc->scale > MAX_SCALE) {
        return fm_fail(FM_ERROR_INVALID_ARGUMENT, "scale is %u: 1 to %d are accepted, 0 means 1", desc->scale, MAX_SCALE);
    }
    return FM_OK;
}

static fm_result paint(slice *s, const fm_slice_desc *desc, const char *path) {
    fm_shape shape = s->volume->desc.shape;
    const fm_allocator *allocator = &s->volume->allocator;
    s->columns = s->axis == 0 ? shape.y : shape.x;
    s->rows = s->axis == 2 ? shape.y : shape.z;
    s->scale = desc->scale ? desc->scale : 1;
    if (fm_max_u64(s->columns, s->rows) * s->scale > FM_PNG_MAX_EDGE) {
        return fm_fail(FM_ERROR_UNSUPPORTED,
                       "the slice is %u x %u voxels at scale %u: a picture has at most %d pixels along an edge", s->columns,
                       s->rows, s->scale, FM_PNG_MAX_EDGE);
    }
    s->mark_largest = desc->mark_largest;
    s->flip = desc->flip;
    s->painted = UINT32_MAX;
    s->info.width = s->columns * s->scale;
    s->info.height = s->rows * s->scale;
    choose_map(s, desc);
    s->line = fm_alloc(allocator, (uint64_t)s->info.width * 3, "a row of pixels");
    if (!s->line) {
        return FM_ERROR_OUT_OF_HOST_MEMORY;
    }
    fm_picture picture = {s->info.width, s->info.height, 3, paint_row, s};
    fm_result result = fm_picture_write(allocator, path, &picture, desc->batch);
    fm_free(allocator, s->line, (uint64_t)s->info.width * 3);
    return result;
}

fm_result fm_slice_png(const fm_volume *volume, uint32_t axis, uint32_t index, const fm_slice_desc *desc, const char *path,
                       fm_slice_info *info) {
    static const fm_slice_desc defaults;
    desc = desc ? desc : &defaults;
    if (!volume || !path) {
        return fm_fail(FM_ERROR_INVALID_ARGUMENT, "%s is NULL", volume ? "path" : "volume");
    }
    FM_TRY(check_slice(volume, axis, index, desc));
    const fm_allocator *allocator = &volume->allocator;
    slice *s = fm_alloc_zero(allocator, sizeof *s, "a slice");
    void *copy = s && !volume->data ? fm_alloc(allocator, volume->bytes, "a copy of a device volume") : NULL;
    fm_result result = s && (volume->data || copy) ? FM_OK : FM_ERROR_OUT_OF_HOST_MEMORY;
    if (copy) {
        // Downloading does not change a volume, but its type does not say so.
        result = fm_volume_download((fm_volume *)(uintptr_t)volume, copy);
    }
    if (result == FM_OK) {
        s->volume = volume;
        s->data = copy ? copy : volume->data;
        s->axis = axis;
        s->index = index;
        result = paint(s, desc, path);
    }
    if (result == FM_OK && info) {
        *info = s->info;
    }
    fm_free(allocator, copy, volume->bytes);
    fm_free(allocator, s, sizeof *s);
    return result;
}
