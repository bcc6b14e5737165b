// SPDX-License-Identifier: MIT

// Real files against the figures that come with them.

#include "io_common.h"

static const char *data_root;

static const char *data_path(const char *name) {
    static char path[1024];
    snprintf(path, sizeof path, "%s/%s", data_root, name);
    return path;
}

typedef struct volume_row {
    const char *name;
    fm_format format;
    fm_shape shape;
    fm_type type;
    double low, high;  // of the values
    uint64_t nonzero;  // 0: no figure given
} volume_row;

static const volume_row volumes[] = {
    {"voxels/flyingapts.vox", FM_FORMAT_VOX, {256, 256, 183}, FM_TYPE_U8, 0, -1, 439886},
    {"voxels/metro_store8.vox", FM_FORMAT_VOX, {124, 124, 68}, FM_TYPE_U8, 0, -1, 441118},
    {"voxels/metro_aliens.vox", FM_FORMAT_VOX, {126, 126, 64}, FM_TYPE_U8, 0, -1, 138979},
    {"voxels/many_models_small.vox", FM_FORMAT_VOX, {106, 106, 16}, FM_TYPE_U8, 0, -1, 12926},
    {"voxels/mesa_512x512x64_u8.raw.gz", FM_FORMAT_RAW, {512, 512, 64}, FM_TYPE_U8, 0, 1, 0},
    {"voxels/minecraft_1.16_368x128x176_u8.raw.gz", FM_FORMAT_RAW, {368, 128, 176}, FM_TYPE_U8, 0, -1, 0},
    {"volumes/berea_sandstone_400x400x400_u8.raw.gz", FM_FORMAT_RAW, {400, 400, 400}, FM_TYPE_U8, 0, 1, 0},
    {"volumes/connectomics_labels_512x512x512_u16.raw.gz", FM_FORMAT_RAW, {512, 512, 512}, FM_TYPE_U16, 0, 2523, 0},
    {"volumes/freiburg_geb079.bt", FM_FORMAT_OCTOMAP, {487, 187, 39}, FM_TYPE_U8, 0, 2, 950759 + 185673},
    {"volumes/freiburg_geb079_487x187x39_u8.raw.gz", FM_FORMAT_RAW, {487, 187, 39}, FM_TYPE_U8, 0, 2, 950759 + 185673},
    {"volumes/ct_aorta_120x126x164_i16.raw.gz", FM_FORMAT_RAW, {120, 126, 164}, FM_TYPE_I16, -1078, 3343, 0},
    {"volumes/ct_aorta_mask_120x126x164_u8.raw.gz", FM_FORMAT_RAW, {120, 126, 164}, FM_TYPE_U8, 0, 1, 0},
    {"voxels/mesa.vxl", FM_FORMAT_VXL, {512, 512, 64}, FM_TYPE_U8, 0, 1, 0},
    {"voxels/warframe_Full1.3dmap", FM_FORMAT_3DMAP, {659, 549, 624}, FM_TYPE_U8, 0, 1, 310049},
    {"volumes/etopo5_asia_1024x1024_i16.raw.gz", FM_FORMAT_RAW, {1024, 1024, 1}, FM_TYPE_I16, -9394, 7833, 0},
};

static double value_at(const void *data, fm_type type, uint64_t i) {
    return type == FM_TYPE_U8    ? ((const uint8_t *)data)[i]
           : type == FM_TYPE_U16 ? ((const uint16_t *)data)[i]
                                 : ((const int16_t *)data)[i];
}

static void check_volume(const volume_row *row) {
    fm_volume *volume = NULL;
    fm_file_info info;
    if (!CHECK_OK(fm_file_read(NULL, data_path(row->name), NULL, &volume, &info))) {
        return;
    }
    bool good = CHECK(info.format == row->format) && CHECK(io_same_shape(info.shape, row->shape)) && CHECK(info.type == row->type);
    uint64_t nonzero = 0;
    double low = INFINITY, high = -INFINITY;
    for (uint64_t i = 0; good && i < (uint64_t)row->shape.x * row->shape.y * row->shape.z; i++) {
        double value = value_at(fm_volume_data(volume), row->type, i);
        nonzero += value != 0;
        low = fmin(low, value);
        high = fmax(high, value);
    }
    if (row->high > row->low) {
        good = CHECK(low == row->low) && CHECK(high == row->high) && good;
    }
    if (row->nonzero) {
        good = CHECK(nonzero == row->nonzero) && good;
    }
    if (!good) {
        fprintf(stderr, "    %s: %u x %u x %u, %g to %g, %llu not 0\n", row->name, info.shape.x, info.shape.y, info.shape.z, low,
                high, (unsigned long long)nonzero);
    }
    fm_volume_destroy(volume);
}

static uint64_t count_at_least(fm_volume *volume, uint64_t count, uint8_t least) {
    const uint8_t *data = fm_volume_data(volume);
    uint64_t found = 0;
    for (uint64_t i = 0; i < count; i++) {
        found += data[i] >= least;
    }
    return found;
}

// Values 0 and 1 are kinds of air.
static void minecraft(void) {
    fm_volume *volume = NULL;
    if (CHECK_OK(fm_file_read(NULL, data_path("voxels/minecraft_1.16_368x128x176_u8.raw.gz"), NULL, &volume, NULL))) {
        CHECK(count_at_least(volume, 368 * 128 * 176, 2) == 5082508);
    }
    fm_volume_destroy(volume);
}

static void octomap_equals_raw(void) {
    fm_volume *tree = NULL, *raw = NULL;
    fm_file_info info;
    CHECK_OK(fm_file_read(NULL, data_path("volumes/freiburg_geb079.bt"), NULL, &tree, &info));
    CHECK_OK(fm_file_read(NULL, data_path("volumes/freiburg_geb079_487x187x39_u8.raw.gz"), NULL, &raw, NULL));
    if (tree && raw) {
        CHECK(io_same(raw, tree));
        CHECK(count_at_least(tree, 487 * 187 * 39, 2) == 185673);
        CHECK(count_at_least(tree, 487 * 187 * 39, 1) == 950759 + 185673);
        const double keys[3] = {-100, -94, -4};
        for (int i = 0; i < 3; i++) {
            CHECK(info.spacing[i] == 0.08);
            CHECK(fabs(info.origin[i] - (keys[i] + 0.5) * 0.08) < 1e-9);
        }
    }
    fm_volume_destroy(tree);
    fm_volume_destroy(raw);
}

static void vxl_equals_raw(void) {
    fm_volume *map = NULL, *raw = NULL;
    CHECK_OK(fm_file_read(NULL, data_path("voxels/mesa.vxl"), NULL, &map, NULL));
    CHECK_OK(fm_file_read(NULL, data_path("voxels/mesa_512x512x64_u8.raw.gz"), NULL, &raw, NULL));
    CHECK(map && raw && io_same(raw, map));
    fm_volume_destroy(map);
    fm_volume_destroy(raw);
}

static void study(bool hidden) {
    const fm_read_desc desc = {.include_hidden = hidden};
    fm_volume *volume = NULL;
    fm_file_info info;
    if (!CHECK_OK(fm_file_read(NULL, data_path("voxels/study.vox"), &desc, &volume, &info))) {
        return;
    }
    uint64_t count = (uint64_t)info.shape.x * info.shape.y * info.shape.z;
    CHECK(info.models == 16);
    CHECK(info.placed == (hidden ? 54 : 53));
    CHECK(info.hidden == 1);
    CHECK(info.palette_count == 256 && fm_volume_palette(volume));
    if (hidden) {
        CHECK(io_same_shape(info.shape, (fm_shape){325, 298, 151}));
        CHECK(count_at_least(volume, count, 1) == 751185);
    } else {
        CHECK(info.shape.x <= 325 && info.shape.y < 298 && info.shape.z <= 151);
        CHECK(count_at_least(volume, count, 1) < 751185);
    }
    // Written in tiles and read again it is the same scene.
    fm_volume *again = NULL;
    CHECK_OK(fm_file_write(io_path("study.vox"), volume, NULL));
    if (CHECK_OK(fm_file_read(NULL, io_path("study.vox"), NULL, &again, NULL))) {
        fm_volume_desc a, b;
        fm_volume_info(volume, &a);
        fm_volume_info(again, &b);
        CHECK(io_same(volume, again));
        CHECK(memcmp(a.origin, b.origin, sizeof a.origin) == 0);
        CHECK(memcmp(fm_volume_palette(volume) + 4, fm_volume_palette(again) + 4, 1020) == 0);
    }
    fm_volume_destroy(again);
    fm_volume_destroy(volume);
}

int main(void) {
    data_root = getenv("FATHOM_DATA");
    if (!data_root || !data_root[0]) {
        data_root = io_exists("data") ? "data" : "../shared/data";
    }
    if (!io_exists(data_path("voxels/study.vox"))) {
        return check_skip(
            "the data of other people is not here (to test with it, name its folder in the environment variable FATHOM_DATA)");
    }
    if (!io_begin()) {
        return check_summary();
    }
    for (size_t i = 0; i < sizeof volumes / sizeof volumes[0]; i++) {
        check_volume(&volumes[i]);
    }
    minecraft();
    octomap_equals_raw();
    vxl_equals_raw();
    study(false);
    study(true);
    fm_file_info info;
    CHECK(CHECK_OK(fm_file_probe(data_path("voxels/many_models_small.vox"), NULL, &info)) && info.models == 41 &&
          info.placed == 104 && info.rotated == 87);
    return io_end();
}
