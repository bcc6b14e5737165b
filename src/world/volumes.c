// SPDX-License-Identifier: MIT
// Worlds from volumes and back. Colours are RGB332: red in the highest three bits, then green, then two bits of blue.

#include "gpu/gpu.h"
#include "world/gpu_world.h"
#include "world/transfer.h"

#include <string.h>

enum {
    PALETTE_COLORS = 256,
    SOLID_BLACK = 0x100,       // solid, yet its colour is 0
    NEAREST_TO_BLACK = 1 << 2  // of the colours that are not 0, the lowest of those equally near
};

static uint8_t to_332(const uint8_t *rgb) {
    const uint32_t red = (rgb[0] * 7u + 127) / 255, green = (rgb[1] * 7u + 127) / 255, blue = (rgb[2] * 3u + 127) / 255;
    return (uint8_t)(red << 5 | green << 2 | blue);
}

static void from_332(uint32_t color, uint8_t *rgba) {
    rgba[0] = (uint8_t)(((color >> 5) * 255 + 3) / 7);
    rgba[1] = (uint8_t)(((color >> 2 & 7) * 255 + 3) / 7);
    rgba[2] = (uint8_t)((color & 3) * 85);
    rgba[3] = 255;
}

// The voxel for each value from 1 on. Without a palette 1 is white, and neighbours among the 255 colours that follow differ.
static void fill_table(const uint8_t *palette, uint32_t table[PALETTE_COLORS]) {
    table[0] = 0;
    for (uint32_t value = 1; value < PALETTE_COLORS; value++) {
        const uint32_t color = palette ? to_332(palette + 4 * value) : 255 - (value - 1) * 97 % 255;
        table[value] = color ? color : SOLID_BLACK;
    }
}

typedef struct conversion {
    uint32_t table[PALETTE_COLORS];
    bool has_palette;
} conversion;

static inline uint32_t voxel_of(const conversion *to, uint64_t value) {
    if (value < PALETTE_COLORS) {
        return to->table[value];
    }
    return to->table[to->has_palette ? PALETTE_COLORS - 1 : 1 + (value - 1) % (PALETTE_COLORS - 1)];
}

#define CONVERT(type, value_of)                                                                                                    \
    {                                                                                                                              \
        const type *from = source;                                                                                                 \
        for (uint64_t i = 0; i < count; i++) {                                                                                     \
            voxels[i] = voxel_of(to, (uint64_t)(value_of));                                                                        \
        }                                                                                                                          \
        break;                                                                                                                     \
    }

static uint64_t float_value(float value) {
    return value > 0 ? (value < 1 ? 1 : value < PALETTE_COLORS ? (uint64_t)value : PALETTE_COLORS - 1) : 0;
}

// `count` elements; of bits: one row of them.
static void convert(const conversion *to, fm_type type, const void *source, uint64_t count, uint32_t *voxels) {
    switch (type) {
    case FM_TYPE_U8:
        CONVERT(uint8_t, from[i])
    case FM_TYPE_U16:
        CONVERT(uint16_t, from[i])
    case FM_TYPE_U32:
        CONVERT(uint32_t, from[i])
    case FM_TYPE_U64:
        CONVERT(uint64_t, from[i])
    case FM_TYPE_I8:
        CONVERT(int8_t, from[i])
    case FM_TYPE_I16:
        CONVERT(int16_t, from[i])
    case FM_TYPE_I32:
        CONVERT(int32_t, from[i])
    case FM_TYPE_I64:
        CONVERT(int64_t, from[i])
    case FM_TYPE_F32:
        CONVERT(float, float_value(from[i]))
    case FM_TYPE_BITS:
        CONVERT(uint32_t, from[i / 32] >> i % 32 & 1)
    case FM_TYPE_F64:
        break;
    }
}

static fm_result check_volume(const fm_world *world, const fm_volume *volume) {
    if (!world || !volume) {
        return fm_fail(FM_ERROR_INVALID_ARGUMENT, "%s is NULL", world ? "volume" : "world");
    }
    const fm_shape shape = volume->desc.shape, own = world->desc.shape;
    if (!fm_shape_equal(shape, own)) {
        return fm_fail(FM_ERROR_INVALID_ARGUMENT, "volume is %u x %u x %u: the world is %u x %u x %u", shape.x, shape.y, shape.z,
                       own.x, own.y, own.z);
    }
    return FM_OK;
}

static uint64_t row_bytes(const fm_volume *volume) {
    const fm_shape shape = volume->desc.shape;
    return volume->desc.type == FM_TYPE_BITS ? fm_bits_row_words(shape) * sizeof(uint32_t)
                                             : shape.x * fm_type_size(volume->desc.type);
}

// Rows of the volume where the host reads them: at `piece` when they lie on the device.
static fm_result fetch_rows(const fm_volume *volume, uint64_t row, uint64_t rows, void *piece, const void **source) {
    const uint64_t bytes = row_bytes(volume);
    if (volume->data) {
        *source = (const uint8_t *)volume->data + row * bytes;
        return FM_OK;
    }
    *source = piece;
    return fm_buffer_download_at(volume->buffer, row * bytes, piece, rows * bytes);
}

static fm_result load_converted(fm_world *world, const fm_volume *volume) {
    const fm_shape shape = world->desc.shape;
    const uint64_t all = (uint64_t)shape.y * shape.z;
    const uint64_t most = fm_min_u64(all, fm_world_piece_rows(world));
    const uint64_t piece_bytes = fm_round_up(most * shape.x * sizeof(uint32_t), FM_ALIGNMENT);
    conversion to = {.has_palette = volume->palette != NULL};
    fill_table(volume->palette, to.table);
    void *scratch;
    FM_TRY(fm_context_scratch(world->context, piece_bytes + (volume->data ? 0 : most * row_bytes(volume)), &scratch));
    uint32_t *reached = fm_world_reached_voxels(world);
    for (uint64_t row = 0; row < all; row += most) {
        const uint64_t rows = fm_min_u64(most, all - row);
        const void *source;
        FM_TRY(fetch_rows(volume, row, rows, (uint8_t *)scratch + piece_bytes, &source));
        uint32_t *voxels = reached ? reached + row * shape.x : scratch;
        if (volume->desc.type == FM_TYPE_BITS) {
            for (uint64_t i = 0; i < rows; i++) {
                convert(&to, FM_TYPE_BITS, (const uint8_t *)source + i * row_bytes(volume), shape.x, voxels + i * shape.x);
            }
        } else {
            convert(&to, volume->desc.type, source, rows * shape.x, voxels);
        }
        if (!reached) {
            FM_TRY(fm_world_put(world, row * shape.x, voxels, rows * shape.x));
        }
    }
    return FM_OK;
}

static fm_result load_as_it_is(fm_world *world, const fm_volume *volume) {
    if (volume->data) {
        return fm_world_put(world, 0, volume->data, fm_voxels(world->desc.shape));
    }
    return fm_gpu_copy(world->context->gpu, volume->buffer, world->gpu->voxels, volume->bytes, NULL);
}

fm_result fm_world_load(fm_world *world, const fm_volume *volume) {
    FM_TRY(check_volume(world, volume));
    if (volume->desc.type == FM_TYPE_F64) {
        return fm_fail(FM_ERROR_INVALID_ARGUMENT, "volume is of float64: integer types, bits and float32 are accepted");
    }
    if (volume->buffer && volume->context != world->context) {
        return fm_fail(FM_ERROR_INVALID_ARGUMENT, "volume lies in the device memory of another context");
    }
    FM_TRY(fm_wait(world->context, world->newest));
    const bool as_it_is = volume->desc.type == FM_TYPE_U32 && !volume->palette;
    FM_TRY(as_it_is ? load_as_it_is(world, volume) : load_converted(world, volume));
    fm_queue_clear(world->queue);
    world->all_dirty = true;
    return FM_OK;
}

static fm_result save_colors(fm_world *world, fm_volume *volume) {
    const fm_shape shape = world->desc.shape;
    const uint64_t all = fm_voxels(shape);
    const uint64_t most = fm_min_u64(all, fm_world_piece_rows(world) * shape.x);
    uint8_t palette[4 * PALETTE_COLORS] = {0};
    for (uint32_t i = 1; i < PALETTE_COLORS; i++) {
        from_332(i, palette + 4 * (size_t)i);
    }
    void *piece;
    FM_TRY(fm_context_scratch(world->context, most * sizeof(uint32_t), &piece));
    for (uint64_t first = 0; first < all; first += most) {
        const uint64_t count = fm_min_u64(most, all - first);
        FM_TRY(fm_world_get(world, first, piece, count));
        if (first == 0) {
            // What can fail other than a device has been done: until here the volume is as it was.
            FM_TRY(fm_volume_set_palette(volume, palette));
        }
        const uint32_t *voxels = piece;
        uint8_t *out = (uint8_t *)volume->data + first;
        for (uint64_t i = 0; i < count; i++) {
            const uint8_t color = (uint8_t)voxels[i];
            out[i] = voxels[i] == 0 ? 0 : color ? color : NEAREST_TO_BLACK;
        }
    }
    return FM_OK;
}

fm_result fm_world_save(fm_world *world, fm_volume *volume) {
    FM_TRY(check_volume(world, volume));
    if (!volume->data) {
        return fm_fail(FM_ERROR_INVALID_ARGUMENT, "volume lies in device memory: host memory is accepted");
    }
    const fm_type type = volume->desc.type;
    if (type != FM_TYPE_U8 && type != FM_TYPE_U32) {
        return fm_fail(FM_ERROR_INVALID_ARGUMENT, "volume is of %s: uint8 and uint32 are accepted", fm_type_name(type));
    }
    FM_TRY(fm_wait(world->context, world->newest));
    if (type == FM_TYPE_U8) {
        return save_colors(world, volume);
    }
    FM_TRY(fm_world_get(world, 0, volume->data, fm_voxels(world->desc.shape)));
    return fm_volume_set_palette(volume, NULL);
}
