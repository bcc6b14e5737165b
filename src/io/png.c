// SPDX-License-Identifier: MIT
#include "io/png.h"
#include "fathom/io.h"
#include "io/sized.h"
#include "io/stream.h"

#include <png.h>
#include <string.h>

// What libpng's callbacks share. A message that is set already (by the output or the allocator) is the better one.
typedef struct png_sink {
    const fm_allocator *allocator;
    fm_output *output;
    fm_result result;
} png_sink;

static void on_error(png_structp png, png_const_charp message) {
    png_sink *sink = png_get_error_ptr(png);
    if (sink->result == FM_OK) {
        sink->result = fm_fail(FM_ERROR_INTERNAL, "libpng: %s", message);
    }
    png_longjmp(png, 1);
}

static void on_warning(png_structp png, png_const_charp message) {
    (void)png;
    (void)message;
}

static void on_write(png_structp png, png_bytep data, size_t size) {
    png_sink *sink = png_get_io_ptr(png);
    sink->result = fm_output_write(sink->output, data, size);
    if (sink->result != FM_OK) {
        png_error(png, "write");
    }
}

static void on_flush(png_structp png) {
    (void)png;
}

// libpng reports a failed allocation by an error of its own or by NULL, as it sees fit.
static png_voidp on_alloc(png_structp png, png_alloc_size_t size) {
    png_sink *sink = png_get_mem_ptr(png);
    void *memory = fm_sized_alloc(sink->allocator, size);
    if (!memory) {
        sink->result = FM_ERROR_OUT_OF_HOST_MEMORY;
    }
    return memory;
}

static void on_free(png_structp png, png_voidp memory) {
    const png_sink *sink = png_get_mem_ptr(png);
    fm_sized_free(sink->allocator, memory);
}

// The only function with a setjmp: its locals do not change after it.
static fm_result encode(png_structp png, png_infop info, png_sink *sink, const fm_picture *picture) {
    if (setjmp(png_jmpbuf(png))) {
        return sink->result;
    }
    static const int types[] = {[1] = PNG_COLOR_TYPE_GRAY, [3] = PNG_COLOR_TYPE_RGB, [4] = PNG_COLOR_TYPE_RGBA};
    png_set_write_fn(png, sink, on_write, on_flush);
    png_set_compression_level(png, 6);
    png_set_user_limits(png, 0x7fffffff, 0x7fffffff);
    png_set_IHDR(png, info, picture->width, picture->height, 8, types[picture->channels], PNG_INTERLACE_NONE,
                 PNG_COMPRESSION_TYPE_DEFAULT, PNG_FILTER_TYPE_DEFAULT);
    png_write_info(png, info);
    for (uint32_t y = 0; y < picture->height; y++) {
        png_write_row(png, picture->row(picture->user, y));
    }
    png_write_end(png, info);
    return FM_OK;
}

fm_result fm_picture_write(const fm_allocator *allocator, const char *path, const fm_picture *picture, fm_file_batch *shared) {
    fm_file_batch own = {.allocator = *allocator};
    fm_file_batch *batch = shared ? shared : &own;
    allocator = &batch->allocator;
    png_sink sink = {.allocator = allocator};
    FM_TRY(fm_output_open(allocator, path, false, &sink.output));
    // A failure without a message of its own can only be one of memory.
    fm_result result = FM_ERROR_OUT_OF_HOST_MEMORY;
    png_structp png = png_create_write_struct_2(PNG_LIBPNG_VER_STRING, &sink, on_error, on_warning, &sink, on_alloc, on_free);
    png_infop info = png ? png_create_info_struct(png) : NULL;
    if (info) {
        result = encode(png, info, &sink, picture);
    }
    if (png) {
        png_destroy_write_struct(&png, &info);
    }
    if (result == FM_OK) {
        result = fm_batch_add(batch, sink.output);
    } else {
        fm_output_destroy(sink.output);
    }
    if (result == FM_OK && batch == &own) {
        result = fm_file_batch_commit(&own);
    }
    fm_batch_clear(&own);
    return result;
}

typedef struct pixels {
    const uint8_t *data;
    uint64_t row_bytes;
} pixels;

static const uint8_t *pixel_row(void *user, uint32_t y) {
    const pixels *p = user;
    return p->data + p->row_bytes * y;
}

fm_result fm_image_write_png(const char *path, uint32_t width, uint32_t height, uint32_t channels, const uint8_t *data) {
    if (!path || !data) {
        return fm_fail(FM_ERROR_INVALID_ARGUMENT, "%s is NULL", path ? "pixels" : "path");
    }
    if (channels != 1 && channels != 3 && channels != 4) {
        return fm_fail(FM_ERROR_INVALID_ARGUMENT, "channels is %u: 1, 3 or 4 are accepted", channels);
    }
    if (width == 0 || height == 0 || width > FM_PNG_MAX_EDGE || height > FM_PNG_MAX_EDGE) {
        return fm_fail(FM_ERROR_INVALID_ARGUMENT, "the picture is %u x %u pixels: 1 to %d along each edge are accepted", width,
                       height, FM_PNG_MAX_EDGE);
    }
    pixels p = {data, (uint64_t)width * channels};
    fm_picture picture = {width, height, channels, pixel_row, &p};
    return fm_picture_write(&fm_default_allocator, path, &picture, NULL);
}
