// SPDX-License-Identifier: MIT
#include "io/file.h"

#include <stdarg.h>
#include <stdio.h>
#include <string.h>

enum { PIECE = 4 << 20 };

void fm_swap_elements(void *data, uint64_t count, size_t size) {
    uint8_t *bytes = data;
    switch (size) {
    case 2:
        for (uint64_t i = 0; i < count; i++) {
            uint16_t value;
            memcpy(&value, bytes + 2 * i, 2);
            value = __builtin_bswap16(value);
            memcpy(bytes + 2 * i, &value, 2);
        }
        break;
    case 4:
        for (uint64_t i = 0; i < count; i++) {
            uint32_t value;
            memcpy(&value, bytes + 4 * i, 4);
            value = __builtin_bswap32(value);
            memcpy(bytes + 4 * i, &value, 4);
        }
        break;
    case 8:
        for (uint64_t i = 0; i < count; i++) {
            uint64_t value;
            memcpy(&value, bytes + 8 * i, 8);
            value = __builtin_bswap64(value);
            memcpy(bytes + 8 * i, &value, 8);
        }
        break;
    default:
        break;
    }
}

static bool told(fm_progress_fn progress, void *user, uint64_t done, uint64_t total, const char *name) {
    if (!progress || progress(user, done, total)) {
        return true;
    }
    fm_fail(FM_ERROR_IO, "%s: cancelled", name);
    return false;
}

bool fm_reader_progress(const fm_reader *reader, uint64_t done, uint64_t total) {
    return told(reader->desc->progress, reader->desc->progress_user, done, total, fm_input_name(reader->input));
}

bool fm_writer_progress(const fm_writer *writer, uint64_t done, uint64_t total) {
    return told(writer->desc->progress, writer->desc->progress_user, done, total, writer->path);
}

fm_result fm_reader_shape(fm_reader *reader, const uint64_t *axes, uint32_t count, uint32_t kept[3]) {
    uint64_t found[3] = {1, 1, 1};
    uint32_t surplus = count > 3 ? count - 3 : 0;
    uint32_t first[3] = {count, count, count};
    uint32_t left = count - surplus;
    for (uint32_t i = count; i-- > 0;) {
        if (surplus > 0 && axes[i] == 1) {
            surplus--;
        } else if (left > 0) {
            left--;
            found[left] = axes[i];
            first[left] = i;
        }
    }
    if (surplus > 0) {
        return fm_input_fail(reader->input, FM_ERROR_UNSUPPORTED,
                             "has %u axes: 1 to 3 are read, further ones only when they are 1; split the file", count);
    }
    for (int i = 0; i < 3; i++) {
        if (found[i] == 0 || found[i] > INT32_MAX) {
            return fm_input_fail(reader->input, FM_ERROR_FORMAT,
                                 "has the shape %llu x %llu x %llu: every axis must be 1 to 2147483647",
                                 (unsigned long long)found[0], (unsigned long long)found[1], (unsigned long long)found[2]);
        }
    }
    if (kept) {
        memcpy(kept, first, sizeof first);
    }
    reader->info.shape = (fm_shape){(uint32_t)found[0], (uint32_t)found[1], (uint32_t)found[2]};
    return FM_OK;
}

fm_result fm_dense_require(fm_reader *reader) {
    uint64_t bytes;
    fm_result result = fm_array_bytes(reader->info.shape, reader->dense.type, &bytes);
    if (result != FM_OK) {
        return fm_fail_prefix(FM_ERROR_FORMAT, fm_input_name(reader->input));
    }
    char claim[128];
    snprintf(claim, sizeof claim, "its shape %u x %u x %u of %s", reader->info.shape.x, reader->info.shape.y, reader->info.shape.z,
             fm_type_name(reader->dense.type));
    reader->info.type = reader->dense.scaled ? FM_TYPE_F32 : reader->dense.type;
    return fm_input_require(reader->input, bytes, claim);
}

#define SCALE_CASE(name, ctype)                                                                                                    \
    case name:                                                                                                                     \
        for (uint64_t i = 0; i < count; i++) {                                                                                     \
            ctype value;                                                                                                           \
            memcpy(&value, source + i * sizeof value, sizeof value);                                                               \
            target[i] = (float)((double)value * dense->slope + dense->intercept);                                                  \
        }                                                                                                                          \
        break;

static void scale(const fm_dense *dense, const uint8_t *source, uint64_t count, float *target) {
    switch (dense->type) {
        SCALE_CASE(FM_TYPE_U8, uint8_t)
        SCALE_CASE(FM_TYPE_U16, uint16_t)
        SCALE_CASE(FM_TYPE_U32, uint32_t)
        SCALE_CASE(FM_TYPE_U64, uint64_t)
        SCALE_CASE(FM_TYPE_I8, int8_t)
        SCALE_CASE(FM_TYPE_I16, int16_t)
        SCALE_CASE(FM_TYPE_I32, int32_t)
        SCALE_CASE(FM_TYPE_I64, int64_t)
        SCALE_CASE(FM_TYPE_F32, float)
        SCALE_CASE(FM_TYPE_F64, double)
    case FM_TYPE_BITS:
        break;
    }
}

static fm_result load_in_order(fm_reader *reader, uint8_t *target, uint64_t bytes) {
    size_t size = reader->dense.type == FM_TYPE_BITS ? 4 : fm_type_size(reader->dense.type);
    for (uint64_t done = 0; done < bytes;) {
        uint64_t piece = fm_min_u64(bytes - done, PIECE);
        FM_TRY(fm_input_read(reader->input, target + done, piece, "its elements"));
        if (reader->dense.swap) {
            fm_swap_elements(target + done, piece / size, size);
        }
        done += piece;
        if (!fm_reader_progress(reader, done, bytes)) {
            return FM_ERROR_IO;
        }
    }
    return FM_OK;
}

static fm_result load_scaled(fm_reader *reader, float *target, uint64_t bytes, uint8_t *piece_memory) {
    size_t size = fm_type_size(reader->dense.type);
    for (uint64_t done = 0; done < bytes;) {
        uint64_t piece = fm_min_u64(bytes - done, PIECE);
        FM_TRY(fm_input_read(reader->input, piece_memory, piece, "its elements"));
        if (reader->dense.swap) {
            fm_swap_elements(piece_memory, piece / size, size);
        }
        scale(&reader->dense, piece_memory, piece / size, target + done / size);
        done += piece;
        if (!fm_reader_progress(reader, done, bytes)) {
            return FM_ERROR_IO;
        }
    }
    return FM_OK;
}

// The file runs over z first, then y, then x. Several of its x planes are held at once, so that each row is written in runs.
static fm_result load_fortran(fm_reader *reader, uint8_t *target, uint64_t bytes, uint8_t *planes, uint32_t depth) {
    fm_shape shape = reader->info.shape;
    size_t size = fm_type_size(reader->dense.type);
    uint64_t plane = (uint64_t)shape.y * shape.z;
    for (uint32_t x = 0; x < shape.x; x += depth) {
        uint32_t run = (uint32_t)fm_min_u64(depth, shape.x - x);
        FM_TRY(fm_input_read(reader->input, planes, run * plane * size, "its elements"));
        if (reader->dense.swap) {
            fm_swap_elements(planes, run * plane, size);
        }
        for (uint64_t zy = 0; zy < plane; zy++) {
            uint64_t z = zy / shape.y, y = zy % shape.y;
            uint8_t *row = target + (zy * shape.x + x) * size;
            const uint8_t *column = planes + (y * shape.z + z) * size;
            for (uint32_t i = 0; i < run; i++) {
                memcpy(row + i * size, column + i * plane * size, size);
            }
        }
        if (!fm_reader_progress(reader, (uint64_t)(x + run) * plane * size, bytes)) {
            return FM_ERROR_IO;
        }
    }
    return FM_OK;
}

fm_result fm_dense_load(fm_reader *reader, fm_volume *volume) {
    const fm_dense *dense = &reader->dense;
    fm_shape shape = reader->info.shape;
    uint64_t bytes;
    FM_TRY(fm_array_bytes(shape, dense->type, &bytes));
    if (!fm_reader_progress(reader, 0, bytes)) {
        return FM_ERROR_IO;
    }
    bool transpose = dense->fortran_order && (shape.y > 1 || shape.z > 1);
    if (!dense->scaled && !transpose) {
        return load_in_order(reader, volume->data, bytes);
    }
    uint64_t plane = (uint64_t)shape.y * shape.z * fm_type_size(dense->type);
    uint64_t depth = fm_max_u64(1, fm_min_u64(shape.x, PIECE / plane));
    uint64_t memory_bytes = transpose ? depth * plane : fm_min_u64(bytes, PIECE);
    uint8_t *memory = fm_alloc(reader->allocator, memory_bytes, "a piece of a file");
    if (!memory) {
        return FM_ERROR_OUT_OF_HOST_MEMORY;
    }
    fm_result result = transpose ? load_fortran(reader, volume->data, bytes, memory, (uint32_t)depth)
                                 : load_scaled(reader, volume->data, bytes, memory);
    fm_free(reader->allocator, memory, memory_bytes);
    return result;
}

fm_type fm_writer_type(const fm_writer *writer) {
    fm_type type = writer->volume->desc.type;
    return type == FM_TYPE_BITS ? FM_TYPE_U8 : type;
}

fm_result fm_writer_open(fm_writer *writer, bool gzip) {
    return fm_output_open(writer->allocator, writer->path, gzip, &writer->output);
}

fm_result fm_writer_text(fm_output *output, const char *format, ...) {
    char text[4096 + 256];  // a path and a few words
    va_list arguments;
    va_start(arguments, format);
    int length = vsnprintf(text, sizeof text, format, arguments);
    va_end(arguments);
    if (length < 0 || (size_t)length >= sizeof text) {
        return fm_fail(FM_ERROR_INTERNAL, "a header line of %d bytes is too long", length);
    }
    return fm_output_write(output, text, (uint64_t)length);
}

static fm_result write_unpacked(fm_writer *writer, fm_output *output) {
    fm_shape shape = writer->volume->desc.shape;
    uint64_t rows = (uint64_t)shape.y * shape.z;
    uint64_t total = fm_voxels(shape);
    const uint32_t *row = writer->data;
    uint8_t bytes[4096];
    uint64_t told_at = 0;
    for (uint64_t r = 0; r < rows; r++, row += fm_bits_row_words(shape)) {
        for (uint32_t x = 0; x < shape.x;) {
            uint32_t run = (uint32_t)fm_min_u64(shape.x - x, sizeof bytes);
            for (uint32_t i = 0; i < run; i++) {
                bytes[i] = fm_bit(row, x + i);
            }
            FM_TRY(fm_output_write(output, bytes, run));
            x += run;
        }
        uint64_t done = (r + 1) * shape.x;
        if (done - told_at >= PIECE || r + 1 == rows) {
            told_at = done;
            if (!fm_writer_progress(writer, done, total)) {
                return FM_ERROR_IO;
            }
        }
    }
    return FM_OK;
}

fm_result fm_writer_elements(fm_writer *writer, fm_output *output, bool unpack) {
    uint64_t bytes = writer->volume->bytes;
    bool bits = writer->volume->desc.type == FM_TYPE_BITS;
    if (!fm_writer_progress(writer, 0, bits && unpack ? fm_voxels(writer->volume->desc.shape) : bytes)) {
        return FM_ERROR_IO;
    }
    if (bits && unpack) {
        return write_unpacked(writer, output);
    }
    const uint8_t *data = writer->data;
    for (uint64_t done = 0; done < bytes;) {
        uint64_t piece = fm_min_u64(bytes - done, PIECE);
        FM_TRY(fm_output_write(output, data + done, piece));
        done += piece;
        if (!fm_writer_progress(writer, done, bytes)) {
            return FM_ERROR_IO;
        }
    }
    return FM_OK;
}
