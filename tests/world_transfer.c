// SPDX-License-Identifier: MIT
// Voxels and distances on their way in and out of a world, and samples of its field. With "--backend vulkan" on a device.

#include "cases.h"
#include "vulkan_common.h"

#include "fathom/world.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>
#include <unistd.h>

static const fm_shape shape = {37, 11, 6};
enum { VOXELS = 37 * 11 * 6 };

static const fm_box everything = {{0, 0, 0}, {37, 11, 6}};

static fm_world *make_world(fm_context *context, fm_field_format format) {
    const fm_world_desc desc = {.shape = shape, .format = format};
    fm_world *world = NULL;
    CHECK_OK(fm_world_create(context, &desc, &world));
    return world;
}

static void random_voxels(uint64_t seed, uint32_t *voxels) {
    for (int i = 0; i < VOXELS; i++) {
        voxels[i] = test_random(&seed) % 10 ? 0 : (uint32_t)test_random(&seed);
    }
}

static bool holds(fm_world *world, const uint32_t *wanted) {
    uint32_t read[VOXELS];
    return CHECK_OK(fm_world_read(world, &everything, read)) && CHECK(memcmp(read, wanted, sizeof read) == 0);
}

static void test_boxes(fm_context *context) {
    fm_world *world = make_world(context, FM_FIELD_PACKED);
    uint32_t model[VOXELS] = {0}, part[VOXELS], read[VOXELS];
    uint64_t seed = 1;
    CHECK(holds(world, model));
    for (int i = 0; i < 60; i++) {
        const uint32_t axes[3] = {shape.x, shape.y, shape.z};
        fm_box box = everything;
        // Whole rows and slices go another way.
        for (int axis = i % 3; axis < 3; axis++) {
            box.begin[axis] = (int64_t)(test_random(&seed) % axes[axis]);
            box.end[axis] = box.begin[axis] + 1 + (int64_t)(test_random(&seed) % (uint64_t)(axes[axis] - box.begin[axis]));
        }
        uint32_t n = 0;
        random_voxels(seed, part);
        for (int64_t z = box.begin[2]; z < box.end[2]; z++) {
            for (int64_t y = box.begin[1]; y < box.end[1]; y++) {
                for (int64_t x = box.begin[0]; x < box.end[0]; x++) {
                    model[x + shape.x * (y + shape.y * z)] = part[n++];
                }
            }
        }
        CHECK_OK(fm_world_write(world, &box, part));
        memset(read, 0xee, sizeof read);
        CHECK_OK(fm_world_read(world, &box, read));
        if (!CHECK(memcmp(read, part, n * sizeof *part) == 0) || !CHECK(read[n] == 0xeeeeeeeeu || n == VOXELS) ||
            !holds(world, model)) {
            break;
        }
    }
    const fm_box bad[] = {{{0, 0, 0}, {0, 1, 1}}, {{-1, 0, 0}, {1, 1, 1}}, {{0, 0, 0}, {1, 12, 1}}, {{0, 0, 3}, {1, 1, 2}}};
    for (int i = 0; i < 4; i++) {
        CHECK_FAILS(fm_world_write(world, &bad[i], part), FM_ERROR_INVALID_ARGUMENT);
        CHECK_FAILS(fm_world_read(world, &bad[i], part), FM_ERROR_INVALID_ARGUMENT);
    }
    CHECK_FAILS(fm_world_read(world, NULL, part), FM_ERROR_INVALID_ARGUMENT);
    CHECK_FAILS(fm_world_write(world, &everything, NULL), FM_ERROR_INVALID_ARGUMENT);
    CHECK_FAILS(fm_world_read(NULL, &everything, part), FM_ERROR_INVALID_ARGUMENT);
    CHECK(holds(world, model));
    fm_world_destroy(world);
}

static void channels(uint32_t color, int rgb[3]) {
    rgb[0] = (int)lround((color >> 5) * 255 / 7.0);
    rgb[1] = (int)lround((color >> 2 & 7) * 255 / 7.0);
    rgb[2] = (int)lround((color & 3) * 255 / 3.0);
}

static int away(const uint8_t *rgb, uint32_t color) {
    int own[3];
    channels(color, own);
    return (rgb[0] - own[0]) * (rgb[0] - own[0]) + (rgb[1] - own[1]) * (rgb[1] - own[1]) + (rgb[2] - own[2]) * (rgb[2] - own[2]);
}

static fm_volume *make_volume(fm_context *context, fm_type type, fm_storage storage) {
    const fm_volume_desc desc = {.shape = shape, .type = type, .storage = storage};
    fm_volume *volume = NULL;
    CHECK_OK(fm_volume_create(context, &desc, &volume));
    return volume;
}

// Solid where it should be, and of the nearest colour.
static void test_palette(fm_context *context, fm_storage storage) {
    fm_world *world = make_world(context, FM_FIELD_PACKED);
    fm_volume *volume = make_volume(context, FM_TYPE_U8, storage);
    uint8_t values[VOXELS], palette[1024];
    uint32_t read[VOXELS];
    uint64_t seed = 3;
    for (int i = 0; i < VOXELS; i++) {
        values[i] = (uint8_t)i;
    }
    for (int i = 0; i < 1024; i++) {
        palette[i] = (uint8_t)test_random(&seed);
    }
    memset(palette + 4 * 9, 0, 4);
    CHECK_OK(fm_volume_upload(volume, values));
    CHECK_OK(fm_volume_set_palette(volume, palette));
    CHECK_OK(fm_world_load(world, volume));
    CHECK_OK(fm_world_read(world, &everything, read));
    bool good = true;
    for (int i = 0; i < VOXELS; i++) {
        good = good && (read[i] != 0) == (values[i] != 0);
        int least = INT32_MAX;
        for (uint32_t color = 0; color < 256; color++) {
            const int way = away(palette + 4 * values[i], color);
            least = way < least ? way : least;
        }
        good = good && (values[i] == 0 || away(palette + 4 * values[i], read[i] & 0xff) == least);
    }
    CHECK(good);
    fm_volume_destroy(volume);
    fm_world_destroy(world);
}

// Which voxels of each type are solid, and that equal values have equal colours, others mostly not.
static void test_types(fm_context *context, fm_storage storage) {
    static const fm_type types[] = {FM_TYPE_U8, FM_TYPE_U16, FM_TYPE_U32, FM_TYPE_F32, FM_TYPE_BITS,
                                    FM_TYPE_I8, FM_TYPE_I16, FM_TYPE_I32, FM_TYPE_U64, FM_TYPE_I64};
    uint8_t values[VOXELS], encoded[VOXELS * 8];
    uint32_t read[VOXELS];
    uint64_t seed = 4;
    for (int i = 0; i < VOXELS; i++) {
        values[i] = test_random(&seed) % 3 == 0;
    }
    for (size_t t = 0; t < sizeof types / sizeof types[0]; t++) {
        fm_world *world = make_world(context, FM_FIELD_SPLIT_U8);
        fm_volume *volume = make_volume(context, types[t], storage);
        const test_encoding encoding = {.type = types[t], .select = FM_SELECT_NONZERO};
        test_encode(&encoding, shape, values, encoded);
        for (int i = 0; i < VOXELS && types[t] == FM_TYPE_F32; i++) {
            const float value = values[i] ? 0.25f : i % 2 ? -1 : NAN;
            memcpy(encoded + 4 * i, &value, 4);
        }
        CHECK_OK(fm_volume_upload(volume, encoded));
        CHECK_OK(fm_world_edit(world, &(fm_brush){.radius = 50, .voxel = 1}, 1));
        CHECK_OK(fm_world_load(world, volume));
        CHECK_OK(fm_world_update(world, NULL));
        CHECK_OK(fm_world_read(world, &everything, read));
        bool good = true;
        for (int i = 0; i < VOXELS; i++) {
            good = good && (read[i] != 0) == (values[i] != 0);
        }
        if (!CHECK(good)) {
            fprintf(stderr, "    type %s\n", fm_type_name(types[t]));
        }
        fm_volume_destroy(volume);
        fm_world_destroy(world);
    }
}

static void test_load_refusals(fm_context *context) {
    fm_world *world = make_world(context, FM_FIELD_PACKED);
    fm_volume *doubles = make_volume(context, FM_TYPE_F64, FM_STORAGE_HOST);
    CHECK_FAILS(fm_world_load(world, doubles), FM_ERROR_INVALID_ARGUMENT);
    CHECK_FAILS(fm_world_save(world, doubles), FM_ERROR_INVALID_ARGUMENT);
    CHECK_FAILS(fm_world_load(world, NULL), FM_ERROR_INVALID_ARGUMENT);
    CHECK_FAILS(fm_world_save(NULL, doubles), FM_ERROR_INVALID_ARGUMENT);
    fm_volume_destroy(doubles);
    fm_volume *other = NULL;
    const fm_volume_desc desc = {.shape = {37, 11, 5}, .storage = FM_STORAGE_HOST};
    CHECK_OK(fm_volume_create(NULL, &desc, &other));
    CHECK_FAILS(fm_world_load(world, other), FM_ERROR_INVALID_ARGUMENT);
    CHECK_FAILS(fm_world_save(world, other), FM_ERROR_INVALID_ARGUMENT);
    fm_volume_destroy(other);
    fm_world_destroy(world);
}

static void test_save(fm_context *context) {
    fm_world *world = make_world(context, FM_FIELD_PACKED);
    fm_volume *whole = make_volume(context, FM_TYPE_U32, FM_STORAGE_HOST);
    fm_volume *colors = make_volume(context, FM_TYPE_U8, FM_STORAGE_HOST);
    uint32_t voxels[VOXELS], again[VOXELS];
    random_voxels(7, voxels);
    voxels[5] = 0x100;
    CHECK_OK(fm_world_write(world, &everything, voxels));
    CHECK_OK(fm_world_save(world, whole));
    CHECK(memcmp(fm_volume_data(whole), voxels, sizeof voxels) == 0 && !fm_volume_palette(whole));
    CHECK_OK(fm_world_save(world, colors));
    const uint8_t *saved = fm_volume_data(colors), *palette = fm_volume_palette(colors);
    bool good = palette != NULL;
    for (int i = 0; i < VOXELS && good; i++) {
        const uint8_t color = (uint8_t)voxels[i];
        int rgb[3];
        channels(saved[i], rgb);
        good = saved[i] == (color || !voxels[i] ? color : 4) &&
               (saved[i] == 0 || (palette[4 * saved[i]] == rgb[0] && palette[4 * saved[i] + 1] == rgb[1] &&
                                  palette[4 * saved[i] + 2] == rgb[2] && palette[4 * saved[i] + 3] == 255));
    }
    CHECK(good);
    // What was saved as colours comes back as the same colours.
    CHECK_OK(fm_world_load(world, colors));
    CHECK_OK(fm_world_read(world, &everything, again));
    for (int i = 0; i < VOXELS; i++) {
        good = good && again[i] == saved[i];
    }
    CHECK(good);
    CHECK_OK(fm_world_load(world, whole));
    holds(world, voxels);
    fm_volume *copy = make_volume(context, FM_TYPE_U32, FM_STORAGE_DEFAULT);
    voxels[9] = 77;
    CHECK_OK(fm_volume_upload(copy, voxels));
    CHECK_OK(fm_world_load(world, copy));
    holds(world, voxels);
    fm_volume_destroy(copy);
    fm_volume_destroy(whole);
    fm_volume_destroy(colors);
    fm_world_destroy(world);
}

// Whether element i of an array is distance d as the type holds it.
static bool value_is(fm_type type, const void *values, uint32_t i, uint32_t d) {
    switch (type) {
    case FM_TYPE_F32:
        return ((const float *)values)[i] == (float)d;
    case FM_TYPE_U32:
        return ((const uint32_t *)values)[i] == d;
    case FM_TYPE_U16:
        return ((const uint16_t *)values)[i] == (d < UINT16_MAX ? d : UINT16_MAX);
    default:
        return ((const uint8_t *)values)[i] == (d < UINT8_MAX ? d : UINT8_MAX);
    }
}

// Boxes of a field whose distances and colours are known: a part of rows, whole rows of a slice, whole slices, a voxel.
static void test_field_box(fm_world *world, const uint32_t *whole) {
    static const fm_box boxes[] = {
        {{2, 3, 4}, {9, 8, 6}}, {{0, 2, 1}, {37, 7, 6}}, {{0, 0, 3}, {37, 11, 6}}, {{3, 4, 5}, {4, 5, 6}}};
    static const fm_type types[] = {FM_TYPE_U8, FM_TYPE_U16, FM_TYPE_U32, FM_TYPE_F32};
    for (int b = 0; b < 4; b++) {
        const fm_box *box = &boxes[b];
        const fm_shape size = {(uint32_t)(box->end[0] - box->begin[0]), (uint32_t)(box->end[1] - box->begin[1]),
                               (uint32_t)(box->end[2] - box->begin[2])};
        for (int t = 0; t < 4; t++) {
            _Alignas(uint32_t) uint8_t values[VOXELS * 4];
            uint8_t colors[VOXELS];
            CHECK_OK(fm_world_read_field(world, box, &(fm_array){values, types[t], size}, &(fm_array){colors, FM_TYPE_U8, size}));
            bool good = true;
            uint32_t i = 0;
            for (int64_t z = box->begin[2]; z < box->end[2]; z++) {
                for (int64_t y = box->begin[1]; y < box->end[1]; y++) {
                    for (int64_t x = box->begin[0]; x < box->end[0]; x++, i++) {
                        const uint32_t d = whole[x + 37 * (y + 11 * z)];
                        good = good && value_is(types[t], values, i, d) && colors[i] == (d == 0 ? 0x34 : 0);
                    }
                }
            }
            CHECK(good);
        }
        uint32_t few[8];
        const fm_array wrong = {few, FM_TYPE_U32, {size.x + 1, size.y, size.z}}, right = {few, FM_TYPE_U32, {1, 1, 1}};
        CHECK_FAILS(fm_world_read_field(world, box, &wrong, NULL), FM_ERROR_INVALID_ARGUMENT);
        CHECK_FAILS(fm_world_read_field(world, &(fm_box){{37, 0, 0}, {38, 1, 1}}, &right, NULL), FM_ERROR_INVALID_ARGUMENT);
        CHECK_FAILS(fm_world_read_field(world, &(fm_box){{1, 1, 1}, {1, 2, 2}}, &right, NULL), FM_ERROR_INVALID_ARGUMENT);
    }
}

static void test_fields(fm_context *context) {
    static const fm_type types[] = {FM_TYPE_U8, FM_TYPE_U16, FM_TYPE_U32, FM_TYPE_F32};
    for (int format = 0; format <= FM_FIELD_SQUARED_U32; format++) {
        fm_world *world = make_world(context, (fm_field_format)format);
        CHECK_OK(fm_world_edit(world, &(fm_brush){.radius = 1, .voxel = 0x1234, .from = {3, 4, 5}}, 1));
        CHECK_OK(fm_world_update(world, NULL));
        uint32_t exact[VOXELS];
        uint8_t converted[VOXELS * 4], colors[VOXELS];
        const fm_array whole = {exact, FM_TYPE_U32, shape};
        CHECK_OK(fm_world_read_field(world, NULL, &whole, NULL));
        CHECK(exact[3 + 37 * (4 + 11 * 5)] == 0 && exact[36 + 37 * (10 + 11 * 0)] == (format == FM_FIELD_SQUARED_U32 ? 1085 : 43));
        for (int t = 0; t < 4; t++) {
            const fm_array array = {converted, types[t], shape};
            CHECK_OK(fm_world_read_field(world, NULL, &array, &(fm_array){colors, FM_TYPE_U8, shape}));
            bool good = true;
            for (int i = 0; i < VOXELS; i++) {
                const uint32_t d = exact[i];
                good = good && colors[i] == (d == 0 ? 0x34 : 0) && value_is(types[t], converted, i, d);
            }
            CHECK(good);
        }
        test_field_box(world, exact);
        CHECK_FAILS(fm_world_read_field(world, NULL, &(fm_array){exact, FM_TYPE_I32, shape}, NULL), FM_ERROR_INVALID_ARGUMENT);
        CHECK_FAILS(fm_world_read_field(world, NULL, &(fm_array){exact, FM_TYPE_U32, {1, 1, 1}}, NULL), FM_ERROR_INVALID_ARGUMENT);
        CHECK_FAILS(fm_world_read_field(world, NULL, &whole, &(fm_array){exact, FM_TYPE_U32, shape}), FM_ERROR_INVALID_ARGUMENT);
        CHECK_FAILS(fm_world_read_field(world, NULL, NULL, NULL), FM_ERROR_INVALID_ARGUMENT);
        fm_world_destroy(world);
    }
}

// Where things lie.
static void test_places(fm_context *context) {
    const bool vulkan = fm_context_backend(context) == FM_BACKEND_VULKAN;
    fm_world *world = make_world(context, FM_FIELD_SPLIT_U16);
    fm_volume_buffer voxels, field, colors;
    int fd = -1;
    CHECK((fm_world_field_data(world) != NULL) == !vulkan);
    CHECK(vulkan || fm_world_map(world) != NULL);
    if (vulkan) {
        CHECK_OK(fm_world_vulkan(world, &voxels, &field, &colors));
        CHECK(voxels.size == 4 * VOXELS && field.size == 2 * VOXELS && colors.size == VOXELS);
        CHECK(voxels.buffer && field.device_address && colors.memory);
        CHECK_OK(fm_world_vulkan(world, NULL, NULL, NULL));
    } else {
        CHECK_FAILS(fm_world_vulkan(world, &voxels, &field, &colors), FM_ERROR_UNSUPPORTED);
        const uint8_t *plane = fm_world_field_data(world);
        CHECK_OK(fm_world_edit(world, &(fm_brush){.voxel = 9}, 1));
        CHECK_OK(fm_world_update(world, NULL));
        CHECK(((const uint16_t *)(const void *)plane)[2] == 2 && plane[2 * VOXELS] == 9 && plane[2 * VOXELS + 1] == 0);
    }
    CHECK_FAILS(fm_world_export_fd(world, &fd), FM_ERROR_UNSUPPORTED);
    CHECK_FAILS(fm_world_export_fd(world, NULL), FM_ERROR_INVALID_ARGUMENT);
    fm_world_destroy(world);
    const fm_world_desc exportable = {.shape = shape, .exportable = true};
    world = NULL;
    if (vulkan && fm_world_create(context, &exportable, &world) == FM_OK) {
        CHECK_OK(fm_world_export_fd(world, &fd));
        CHECK(fd >= 0 && close(fd) == 0);
    }
    fm_world_destroy(world);
}

static double clamp(double value, double high) {
    return value < 0 ? 0 : value > high ? high : value;
}

static double value_at(const float *distance, bool squared, const int at[3]) {
    const double value = distance[at[0] + (int)shape.x * (at[1] + (int)shape.y * at[2])];
    return squared ? sqrt(value) : value;
}

// The interpolation as a sum over 8 corners; `slope` is the axis it is differentiated along, or 3.
static double interpolate(const float *distance, bool squared, const int first[3], const double part[3], int slope) {
    double sum = 0;
    for (int corner = 0; corner < 8; corner++) {
        double weight = 1;
        int at[3];
        for (int axis = 0; axis < 3; axis++) {
            const int step = corner >> axis & 1;
            at[axis] = first[axis] + step;
            weight *= axis == slope ? (step ? 1 : -1) : step ? part[axis] : 1 - part[axis];
        }
        sum += weight * value_at(distance, squared, at);
    }
    return sum;
}

static bool sample_good(const float *distance, bool squared, const float position[3], const fm_world_sample *sample) {
    const double last[3] = {shape.x - 1, shape.y - 1, shape.z - 1};
    int first[3];
    double part[3];
    for (int axis = 0; axis < 3; axis++) {
        const double place = clamp(position[axis], last[axis]);
        first[axis] = (int)fmin(floor(place), last[axis] - 1);
        part[axis] = place - first[axis];
    }
    bool good = fabs(interpolate(distance, squared, first, part, 3) - sample->distance) < 1e-4;
    for (int axis = 0; axis < 3; axis++) {
        good = good && fabs(interpolate(distance, squared, first, part, axis) - sample->gradient[axis]) < 1e-4;
    }
    return good;
}

static void test_query(fm_context *context) {
    enum { COUNT = 5000 };
    static float positions[COUNT][3];
    static fm_world_sample samples[COUNT];
    uint64_t seed = 11;
    for (int i = 0; i < COUNT; i++) {
        for (int axis = 0; axis < 3; axis++) {
            const float whole = (float)(test_random(&seed) % 44) - 3;
            positions[i][axis] = i % 4 ? whole + (float)(test_random(&seed) % 1000) / 1000 : whole;
        }
    }
    positions[0][0] = INFINITY;
    positions[1][1] = -INFINITY;
    positions[2][2] = 3e38f;
    for (int format = 0; format <= FM_FIELD_SQUARED_U32; format++) {
        fm_world *world = make_world(context, (fm_field_format)format);
        static float distance[VOXELS];
        static uint32_t voxels[VOXELS];
        for (int i = 0; i < VOXELS; i++) {
            voxels[i] = test_random(&seed) % 100 == 0;
        }
        CHECK_OK(fm_world_write(world, &everything, voxels));
        CHECK_OK(fm_world_update(world, NULL));
        CHECK_OK(fm_world_read_field(world, NULL, &(fm_array){distance, FM_TYPE_F32, shape}, NULL));
        CHECK_OK(fm_world_query(world, (const float(*)[3])positions, COUNT, samples));
        bool good = true;
        for (int i = 0; i < COUNT && good; i++) {
            good = sample_good(distance, format == FM_FIELD_SQUARED_U32, positions[i], &samples[i]);
            if (!good) {
                fprintf(stderr, "format %d, sample %d at %g %g %g: %g, %g %g %g\n", format, i, positions[i][0], positions[i][1],
                        positions[i][2], samples[i].distance, samples[i].gradient[0], samples[i].gradient[1],
                        samples[i].gradient[2]);
            }
        }
        CHECK(good);
        const float odd[1][3] = {{NAN, 0.5f, 0}};
        CHECK_OK(fm_world_query(world, odd, 1, samples));
        CHECK(isfinite(samples[0].distance));
        CHECK_OK(fm_world_query(world, NULL, 0, NULL));
        CHECK_FAILS(fm_world_query(world, odd, 1, NULL), FM_ERROR_INVALID_ARGUMENT);
        CHECK_FAILS(fm_world_query(NULL, odd, 1, samples), FM_ERROR_INVALID_ARGUMENT);
        fm_world_destroy(world);
    }
    // A world of one voxel has no slope.
    fm_world *dot = NULL;
    CHECK_OK(fm_world_create(context, &(fm_world_desc){.shape = {1, 1, 1}}, &dot));
    CHECK_OK(fm_world_update(dot, NULL));
    CHECK_OK(fm_world_query(dot, (const float(*)[3])positions, 3, samples));
    CHECK(samples[2].distance == 255 && samples[2].gradient[0] == 0 && samples[2].gradient[1] == 0 && samples[2].gradient[2] == 0);
    fm_world_destroy(dot);
}

int main(int count, char **arguments) {
    fm_context *context = NULL;
    const bool vulkan = count > 2 && strcmp(arguments[2], "vulkan") == 0;
    if (vulkan) {
        vulkan_options options;
        if (!vulkan_parse(count, arguments, &options)) {
            return 2;
        }
        if (vulkan_open(&options, NULL, &context) != FM_OK) {
            return vulkan_missing();
        }
    } else {
        CHECK_OK(fm_context_create(&(fm_context_desc){.backend = FM_BACKEND_CPU, .threads = 3}, &context));
    }
    test_boxes(context);
    test_palette(context, FM_STORAGE_HOST);
    test_palette(context, FM_STORAGE_DEFAULT);
    test_types(context, FM_STORAGE_HOST);
    test_types(context, FM_STORAGE_DEFAULT);
    test_load_refusals(context);
    test_save(context);
    test_fields(context);
    test_places(context);
    test_query(context);
    vulkan_close(context);
    return check_summary();
}
