// SPDX-License-Identifier: MIT

// What is seen: the scene graph of .vox files against positions worked out by hand, the order of binvox, and pictures of slices.

#include "io_common.h"

#include <png.h>

typedef struct builder {
    uint8_t bytes[8192];
    size_t size;
} builder;

static void put(builder *b, const void *data, size_t size) {
    memcpy(b->bytes + b->size, data, size);
    b->size += size;
}

static void put_u32(builder *b, uint32_t value) {
    const uint8_t bytes[4] = {(uint8_t)value, (uint8_t)(value >> 8), (uint8_t)(value >> 16), (uint8_t)(value >> 24)};
    put(b, bytes, 4);
}

static void put_text(builder *b, const char *text) {
    put_u32(b, (uint32_t)strlen(text));
    put(b, text, strlen(text));
}

static void put_chunk(builder *b, const char *id, const builder *content) {
    put(b, id, 4);
    put_u32(b, (uint32_t)content->size);
    put_u32(b, 0);
    put(b, content->bytes, content->size);
}

static void put_model(builder *b, uint32_t x, uint32_t y, uint32_t z, const uint8_t *voxels, uint32_t count) {
    builder size = {.size = 0}, xyzi = {.size = 0};
    put_u32(&size, x);
    put_u32(&size, y);
    put_u32(&size, z);
    put_u32(&xyzi, count);
    put(&xyzi, voxels, 4 * (size_t)count);
    put_chunk(b, "SIZE", &size);
    put_chunk(b, "XYZI", &xyzi);
}

static void put_transform(builder *b, uint32_t id, uint32_t child, bool hidden, uint32_t layer, const char *turn,
                          const char *move) {
    builder c = {.size = 0};
    put_u32(&c, id);
    put_u32(&c, hidden);
    if (hidden) {
        put_text(&c, "_hidden");
        put_text(&c, "1");
    }
    put_u32(&c, child);
    put_u32(&c, UINT32_MAX);
    put_u32(&c, layer);
    put_u32(&c, 1);
    put_u32(&c, (turn ? 1 : 0) + (move ? 1 : 0));
    if (turn) {
        put_text(&c, "_r");
        put_text(&c, turn);
    }
    if (move) {
        put_text(&c, "_t");
        put_text(&c, move);
    }
    put_chunk(b, "nTRN", &c);
}

static void put_group(builder *b, uint32_t id, const uint32_t *children, uint32_t count) {
    builder c = {.size = 0};
    put_u32(&c, id);
    put_u32(&c, 0);
    put_u32(&c, count);
    for (uint32_t i = 0; i < count; i++) {
        put_u32(&c, children[i]);
    }
    put_chunk(b, "nGRP", &c);
}

static void put_shape(builder *b, uint32_t id, uint32_t model) {
    const uint32_t words[] = {id, 0, 1, model, 0};
    builder c = {.size = 0};
    for (int i = 0; i < 5; i++) {
        put_u32(&c, words[i]);
    }
    put_chunk(b, "nSHP", &c);
}

static fm_result read_scene(const builder *chunks, const fm_read_desc *desc, fm_volume **volume, fm_file_info *info) {
    builder file = {.size = 0};
    put(&file, "VOX \x96\0\0\0MAIN\0\0\0\0", 16);
    put_u32(&file, (uint32_t)chunks->size);
    put(&file, chunks->bytes, chunks->size);
    *volume = NULL;
    io_store(io_path("scene.vox"), file.bytes, file.size);
    return fm_file_read(NULL, io_path("scene.vox"), desc, volume, info);
}

static uint8_t at(fm_volume *volume, const fm_file_info *info, int x, int y, int z) {
    int64_t i = x - (int64_t)info->origin[0], k = y - (int64_t)info->origin[1], l = z - (int64_t)info->origin[2];
    if (i < 0 || k < 0 || l < 0 || i >= info->shape.x || k >= info->shape.y || l >= info->shape.z) {
        return 0;
    }
    return ((const uint8_t *)fm_volume_data(volume))[i + info->shape.x * (k + (int64_t)info->shape.y * l)];
}

static const uint8_t bar[] = {0, 0, 0, 1, 2, 0, 0, 2, 1, 3, 0, 3};  // in a model of 3 x 4 x 1; its pivot is (1, 2, 0)

static void turned_twice(void) {
    builder b = {.size = 0};
    const uint32_t children[] = {2, 4};
    put_model(&b, 3, 4, 1, bar, 3);
    put_transform(&b, 0, 1, false, UINT32_MAX, NULL, "10 0 0");
    put_group(&b, 1, children, 2);
    // As drawn.
    put_transform(&b, 2, 3, false, 0, NULL, "0 0 5");
    put_shape(&b, 3, 0);
    // A quarter about z: rows (0 -1 0), (1 0 0), (0 0 1): column 1 first, then 0, the first row negative.
    put_transform(&b, 4, 3, false, 0, "17", "0 20 0");
    fm_volume *volume;
    fm_file_info info;
    if (!CHECK_OK(read_scene(&b, NULL, &volume, &info))) {
        return;
    }
    CHECK(info.placed == 2 && info.rotated == 1 && info.hidden == 0);
    CHECK(at(volume, &info, 9, -2, 5) == 1);
    CHECK(at(volume, &info, 11, -2, 5) == 2);
    CHECK(at(volume, &info, 10, 1, 5) == 3);
    // Cell (x, y) becomes (-1 - y, x): offsets (-1, -2), (1, -2), (0, 1) become (1, -1), (1, 1), (-2, 0).
    CHECK(at(volume, &info, 11, 19, 0) == 1);
    CHECK(at(volume, &info, 11, 21, 0) == 2);
    CHECK(at(volume, &info, 8, 20, 0) == 3);
    // Boxes: (9..11, -2..1, 5) and (8..11, 19..21, 0).
    CHECK(io_same_shape(info.shape, (fm_shape){4, 24, 6}));
    CHECK(info.origin[0] == 8 && info.origin[1] == -2 && info.origin[2] == 0);
    fm_volume_destroy(volume);
}

static void hidden_and_overlapping(void) {
    static const uint8_t one[] = {0, 0, 0, 7}, two[] = {0, 0, 0, 9};
    builder b = {.size = 0}, layer = {.size = 0};
    const uint32_t children[] = {2, 4, 6, 8};
    put_model(&b, 1, 1, 1, one, 1);
    put_model(&b, 1, 1, 1, two, 1);
    put_u32(&layer, 3);
    put_u32(&layer, 1);
    put_text(&layer, "_hidden");
    put_text(&layer, "1");
    put_u32(&layer, UINT32_MAX);
    put_chunk(&b, "LAYR", &layer);
    put_transform(&b, 0, 1, false, UINT32_MAX, NULL, NULL);
    put_group(&b, 1, children, 4);
    put_transform(&b, 2, 3, false, 0, NULL, NULL);
    put_shape(&b, 3, 0);
    put_transform(&b, 4, 5, false, 0, NULL, NULL);
    put_shape(&b, 5, 1);
    put_transform(&b, 6, 3, true, 0, NULL, "4 0 0");
    put_transform(&b, 8, 3, false, 3, NULL, "0 6 0");
    fm_volume *volume;
    fm_file_info info;
    if (CHECK_OK(read_scene(&b, NULL, &volume, &info))) {
        CHECK(info.placed == 2 && info.hidden == 2);
        CHECK(io_same_shape(info.shape, (fm_shape){1, 1, 1}));
        CHECK(at(volume, &info, 0, 0, 0) == 9);
        fm_volume_destroy(volume);
    }
    const fm_read_desc all = {.include_hidden = true};
    if (CHECK_OK(read_scene(&b, &all, &volume, &info))) {
        CHECK(info.placed == 4 && info.hidden == 2);
        CHECK(io_same_shape(info.shape, (fm_shape){5, 7, 1}));
        CHECK(at(volume, &info, 4, 0, 0) == 7 && at(volume, &info, 0, 6, 0) == 7);
        fm_volume_destroy(volume);
    }
}

static void damaged_scenes(void) {
    fm_volume *volume;
    builder loop = {.size = 0};
    const uint32_t itself[] = {1};
    put_model(&loop, 3, 4, 1, bar, 3);
    put_transform(&loop, 0, 1, false, 0, NULL, NULL);
    put_group(&loop, 1, itself, 1);
    CHECK_FAILS(read_scene(&loop, NULL, &volume, NULL), FM_ERROR_FORMAT);

    // Each group doubles what is below it.
    builder doubling = {.size = 0};
    put_model(&doubling, 3, 4, 1, bar, 3);
    put_transform(&doubling, 0, 1, false, 0, NULL, NULL);
    for (uint32_t i = 1; i < 60; i++) {
        const uint32_t twice[] = {i + 1, i + 1};
        put_group(&doubling, i, twice, 2);
    }
    put_shape(&doubling, 60, 0);
    CHECK_FAILS(read_scene(&doubling, NULL, &volume, NULL), FM_ERROR_FORMAT);

    builder missing = {.size = 0};
    put_model(&missing, 3, 4, 1, bar, 3);
    put_transform(&missing, 0, 77, false, 0, NULL, NULL);
    CHECK_FAILS(read_scene(&missing, NULL, &volume, NULL), FM_ERROR_FORMAT);

    static const char *const turns[] = {"0", "5", "3", "128", "x", "-1"};
    for (size_t i = 0; i < sizeof turns / sizeof turns[0]; i++) {
        builder turned = {.size = 0};
        put_model(&turned, 3, 4, 1, bar, 3);
        put_transform(&turned, 0, 1, false, 0, turns[i], NULL);
        put_shape(&turned, 1, 0);
        CHECK_FAILS(read_scene(&turned, NULL, &volume, NULL), FM_ERROR_FORMAT);
    }

    // Two voxels a world apart must not cost a world of memory.
    builder far = {.size = 0};
    const uint32_t children[] = {2, 4};
    put_model(&far, 3, 4, 1, bar, 3);
    put_transform(&far, 0, 1, false, 0, NULL, NULL);
    put_group(&far, 1, children, 2);
    put_transform(&far, 2, 3, false, 0, NULL, "-500000000 -500000000 -500000000");
    put_transform(&far, 4, 3, false, 0, NULL, "500000000 500000000 500000000");
    put_shape(&far, 3, 0);
    CHECK_FAILS(read_scene(&far, NULL, &volume, NULL), FM_ERROR_RANGE);

    builder outside = {.size = 0};
    put_model(&outside, 1, 4, 1, bar, 3);
    CHECK_FAILS(read_scene(&outside, NULL, &volume, NULL), FM_ERROR_FORMAT);
    builder none = {.size = 0};
    CHECK_FAILS(read_scene(&none, NULL, &volume, NULL), FM_ERROR_FORMAT);
}

// Empty tiles in the middle are left out; the corners keep the box.
static void tiles(void) {
    fm_volume *volume = NULL, *again = NULL;
    const fm_volume_desc desc = {.shape = {600, 300, 270}, .type = FM_TYPE_U8, .storage = FM_STORAGE_HOST, .origin = {-5, 7, 0}};
    if (!CHECK_OK(fm_volume_create(NULL, &desc, &volume))) {
        return;
    }
    uint8_t *data = fm_volume_data(volume);
    memset(data, 0, (size_t)600 * 300 * 270);
    data[599 + 600 * (299 + 300 * 0)] = 5;
    data[256 + 600 * (100 + 300 * 257)] = 255;
    uint8_t palette[1024];
    for (int i = 0; i < 1024; i++) {
        palette[i] = (uint8_t)(i * 7);
    }
    CHECK_OK(fm_volume_set_palette(volume, palette));
    CHECK_OK(fm_file_write(io_path("tiles.vox"), volume, NULL));
    fm_file_info info;
    if (CHECK_OK(fm_file_read(NULL, io_path("tiles.vox"), NULL, &again, &info))) {
        CHECK(io_same(volume, again));
        CHECK(info.models == 4);
        CHECK(info.origin[0] == -5 && info.origin[1] == 7 && info.origin[2] == 0);
        CHECK(memcmp(fm_volume_palette(again) + 4, palette + 4, 1020) == 0);
    }
    fm_volume_destroy(volume);
    fm_volume_destroy(again);
}

static void binvox_order(void) {
    // 2 x 3 x 4 along x, y, z; the file runs over y, then z, then x, and its "dim" names x, z, y.
    static const char head[] = "#binvox 1\ndim 2 4 3\ntranslate 1 2 3\nscale 8\ndata\n";
    // Voxel (x 1, y 2, z 3) is the last; voxel (0, 1, 0) the second.
    static const uint8_t runs[] = {0, 1, 1, 1, 0, 21, 1, 1};
    uint8_t file[128];
    memcpy(file, head, sizeof head - 1);
    memcpy(file + sizeof head - 1, runs, sizeof runs);
    io_store(io_path("a.binvox"), file, sizeof head - 1 + sizeof runs);
    fm_volume *volume = NULL;
    fm_file_info info;
    if (CHECK_OK(fm_file_read(NULL, io_path("a.binvox"), NULL, &volume, &info))) {
        CHECK(io_same_shape(info.shape, (fm_shape){2, 3, 4}));
        const uint8_t *data = fm_volume_data(volume);
        for (int i = 0; i < 24; i++) {
            CHECK(data[i] == (i == 0 + 2 * 1 || i == 1 + 2 * (2 + 3 * 3)));
        }
        CHECK(info.spacing[0] == 2 && info.origin[0] == 2 && info.origin[2] == 4);
    }
    fm_volume_destroy(volume);
}

static uint8_t *decode_png(const char *path, uint32_t *width, uint32_t *height) {
    png_image image = {.version = PNG_IMAGE_VERSION};
    if (!png_image_begin_read_from_file(&image, path)) {
        return NULL;
    }
    image.format = PNG_FORMAT_RGB;
    uint8_t *pixels = malloc(PNG_IMAGE_SIZE(image));
    if (!png_image_finish_read(&image, NULL, pixels, 0, NULL)) {
        free(pixels);
        return NULL;
    }
    *width = image.width;
    *height = image.height;
    return pixels;
}

static bool pixel_is(const uint8_t *pixels, uint32_t width, uint32_t x, uint32_t y, const uint8_t rgb[3]) {
    return memcmp(pixels + 3 * (x + (size_t)width * y), rgb, 3) == 0;
}

static void slice_pictures(void) {
    fm_volume *volume = NULL;
    const fm_volume_desc desc = {.shape = {4, 3, 2}, .type = FM_TYPE_F32, .storage = FM_STORAGE_HOST};
    if (!CHECK_OK(fm_volume_create(NULL, &desc, &volume))) {
        return;
    }
    float *data = fm_volume_data(volume);
    for (int i = 0; i < 24; i++) {
        data[i] = (float)i;
    }
    data[12 + 1] = INFINITY;
    data[12 + 2] = NAN;
    fm_slice_info info;
    uint8_t low[3], high[3];
    const uint8_t grey[3] = {128, 128, 128}, magenta[3] = {255, 0, 255};
    fm_color_map_rgb(FM_COLOR_SEQUENTIAL, 0, low);
    fm_color_map_rgb(FM_COLOR_SEQUENTIAL, 1, high);
    uint32_t width = 0, height = 0;
    const fm_slice_desc doubled = {.scale = 2};
    CHECK_OK(fm_slice_png(volume, 2, 1, &doubled, io_path("z.png"), &info));
    CHECK(info.min == 12 && info.max == 23 && info.no_site == 2 && info.map == FM_COLOR_SEQUENTIAL);
    uint8_t *pixels = decode_png(io_path("z.png"), &width, &height);
    if (CHECK(pixels != NULL) && CHECK(width == 8 && height == 6 && info.width == 8 && info.height == 6)) {
        CHECK(pixel_is(pixels, width, 0, 0, low) && pixel_is(pixels, width, 1, 1, low));
        CHECK(pixel_is(pixels, width, 7, 5, high));
        CHECK(pixel_is(pixels, width, 2, 0, grey) && pixel_is(pixels, width, 4, 1, magenta));
    }
    free(pixels);
    // Across y, z runs upwards: the lowest value is at the lower left.
    CHECK_OK(fm_slice_png(volume, 1, 0, NULL, io_path("y.png"), &info));
    pixels = decode_png(io_path("y.png"), &width, &height);
    if (CHECK(pixels != NULL) && CHECK(width == 4 && height == 2)) {
        CHECK(pixel_is(pixels, width, 0, 1, low) && pixel_is(pixels, width, 3, 0, high));
    }
    free(pixels);
    CHECK_OK(fm_slice_png(volume, 0, 3, NULL, io_path("x.png"), &info));
    pixels = decode_png(io_path("x.png"), &width, &height);
    if (CHECK(pixels != NULL) && CHECK(width == 3 && height == 2)) {
        CHECK(pixel_is(pixels, width, 0, 1, low) && pixel_is(pixels, width, 2, 0, high));
    }
    free(pixels);
    const fm_slice_desc flipped = {.flip = true};
    CHECK_OK(fm_slice_png(volume, 0, 3, &flipped, io_path("x.png"), &info));
    pixels = decode_png(io_path("x.png"), &width, &height);
    if (CHECK(pixels != NULL) && CHECK(width == 3 && height == 2)) {
        CHECK(pixel_is(pixels, width, 0, 0, low) && pixel_is(pixels, width, 2, 1, high));
    }
    free(pixels);
    // Signed values: 0 has the middle colour, and the range is symmetric.
    data[0] = -30;
    CHECK_OK(fm_slice_png(volume, 2, 0, NULL, io_path("d.png"), &info));
    CHECK(info.map == FM_COLOR_DIVERGING && info.min == -30 && info.max == 30);
    CHECK_FAILS(fm_slice_png(volume, 3, 0, NULL, io_path("e.png"), NULL), FM_ERROR_INVALID_ARGUMENT);
    CHECK_FAILS(fm_slice_png(volume, 2, 2, NULL, io_path("e.png"), NULL), FM_ERROR_INVALID_ARGUMENT);
    const fm_slice_desc palette = {.map = FM_COLOR_PALETTE};
    CHECK_FAILS(fm_slice_png(volume, 2, 0, &palette, io_path("e.png"), NULL), FM_ERROR_INVALID_ARGUMENT);
    CHECK(!io_exists(io_path("e.png")));
    fm_volume_destroy(volume);
}

// Labels are told apart, 0 is black, and whole numbers below 0 are no signed distances by default.
static void label_pictures(void) {
    fm_volume *volume = NULL;
    const fm_volume_desc desc = {.shape = {4, 2, 1}, .type = FM_TYPE_I16, .storage = FM_STORAGE_HOST};
    if (!CHECK_OK(fm_volume_create(NULL, &desc, &volume))) {
        return;
    }
    const int16_t labels[8] = {0, 1, 2, 3, 1000, 1001, -5, 1};
    memcpy(fm_volume_data(volume), labels, sizeof labels);
    fm_slice_info info;
    uint32_t width = 0, height = 0;
    const uint8_t black[3] = {0, 0, 0}, white[3] = {255, 255, 255};
    const fm_slice_desc by_label = {.map = FM_COLOR_LABELS};
    CHECK_OK(fm_slice_png(volume, 2, 0, &by_label, io_path("l.png"), &info));
    uint8_t *pixels = decode_png(io_path("l.png"), &width, &height);
    if (CHECK(pixels != NULL) && CHECK(width == 4 && height == 2 && info.map == FM_COLOR_LABELS)) {
        CHECK(pixel_is(pixels, width, 0, 0, black));
        CHECK(memcmp(pixels + 3, pixels + 21, 3) == 0);
        for (int i = 0; i < 7; i++) {
            for (int k = 0; k < i; k++) {
                CHECK(memcmp(pixels + (size_t)3 * i, pixels + (size_t)3 * k, 3) != 0);
            }
        }
    }
    free(pixels);
    CHECK_OK(fm_slice_png(volume, 2, 0, NULL, io_path("l.png"), &info));
    pixels = decode_png(io_path("l.png"), &width, &height);
    CHECK(info.map == FM_COLOR_GREY && info.min == -5 && info.max == 1001);
    if (CHECK(pixels != NULL)) {
        CHECK(pixel_is(pixels, width, 2, 1, black) && pixel_is(pixels, width, 1, 1, white));
    }
    free(pixels);
    fm_volume_destroy(volume);
}

static double luminance(const uint8_t rgb[3]) {
    double sum = 0;
    const double weights[3] = {0.2126, 0.7152, 0.0722};
    for (int i = 0; i < 3; i++) {
        double c = rgb[i] / 255.0;
        sum += weights[i] * (c <= 0.04045 ? c / 12.92 : pow((c + 0.055) / 1.055, 2.4));
    }
    return sum;
}

// A map is readable in grey: brightness rises throughout, or falls away from the middle.
static void maps_are_monotone(void) {
    double before = -1;
    for (int i = 0; i <= 64; i++) {
        uint8_t rgb[3];
        fm_color_map_rgb(FM_COLOR_SEQUENTIAL, i / 64.0, rgb);
        CHECK(luminance(rgb) > before);
        before = luminance(rgb);
    }
    for (int side = -1; side <= 1; side += 2) {
        before = 2;
        for (int i = 0; i <= 32; i++) {
            uint8_t rgb[3];
            fm_color_map_rgb(FM_COLOR_DIVERGING, 0.5 + side * i / 64.0, rgb);
            CHECK(luminance(rgb) < before);
            before = luminance(rgb);
        }
    }
}

int main(void) {
    if (!io_begin()) {
        return check_summary();
    }
    turned_twice();
    hidden_and_overlapping();
    damaged_scenes();
    tiles();
    binvox_order();
    slice_pictures();
    label_pictures();
    maps_are_monotone();
    return io_end();
}
