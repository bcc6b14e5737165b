// SPDX-License-Identifier: MIT

// NanoVDB files by a walk of their tree, as PNanoVDB.h says it is done; what is refused; memory that runs out.

#include "faulty.h"

typedef struct grid {
    uint8_t *file;
    size_t size;
    const uint8_t *root;
    float background;
} grid;

static int32_t load_int(const uint8_t *at) {
    int32_t value;
    memcpy(&value, at, sizeof value);
    return value;
}

static int64_t load_long(const uint8_t *at) {
    int64_t value;
    memcpy(&value, at, sizeof value);
    return value;
}

static float load_float(const uint8_t *at) {
    float value;
    memcpy(&value, at, sizeof value);
    return value;
}

static bool has_bit(const uint8_t *mask, uint32_t bit) {
    return mask[bit / 8] >> bit % 8 & 1;
}

// The value at a place and whether it is active.
static float probe(const grid *g, const uint32_t at[3], bool *active) {
    const uint64_t key = at[2] >> 12 | (uint64_t)(at[1] >> 12) << 21 | (uint64_t)(at[0] >> 12) << 42;
    *active = false;
    for (int32_t i = 0; i < load_int(g->root + 24); i++) {
        const uint8_t *tile = g->root + 64 + 32 * i;
        if ((uint64_t)load_long(tile) != key) {
            continue;
        }
        if (load_long(tile + 8) == 0) {
            return load_float(tile + 20);
        }
        const uint8_t *upper = g->root + load_long(tile + 8);
        const uint32_t u = (at[0] >> 7 & 31) << 10 | (at[1] >> 7 & 31) << 5 | (at[2] >> 7 & 31);
        if (!has_bit(upper + 4128, u)) {
            return load_float(upper + 8256 + 8 * u);
        }
        const uint8_t *lower = upper + load_long(upper + 8256 + 8 * u);
        const uint32_t l = (at[0] >> 3 & 15) << 8 | (at[1] >> 3 & 15) << 4 | (at[2] >> 3 & 15);
        if (!has_bit(lower + 544, l)) {
            return load_float(lower + 1088 + 8 * l);
        }
        const uint8_t *leaf = lower + load_long(lower + 1088 + 8 * l);
        const uint32_t v = (at[0] & 7) << 6 | (at[1] & 7) << 3 | (at[2] & 7);
        *active = has_bit(leaf + 16, v);
        return load_float(leaf + 96 + 4 * v);
    }
    return g->background;
}

static bool open_grid(const char *path, grid *g) {
    g->file = io_contents(path, &g->size);
    if (!CHECK(g->file && g->size > 16 + 176 + 9 + 800 && memcmp(g->file, "NanoVDB0", 8) == 0)) {
        return false;
    }
    const uint8_t *head = g->file + 16, *at = head + 176 + 9;
    CHECK(memcmp(head + 176, "distance", 9) == 0 && memcmp(at, "NanoVDB0", 8) == 0 && memcmp(at + 40, "distance", 9) == 0);
    CHECK((uint64_t)load_long(at + 32) == g->size - (size_t)(at - g->file) && load_long(head) == load_long(at + 32));
    g->root = at + 672 + load_long(at + 672 + 24);
    g->background = load_float(g->root + 28);
    // As many nodes of each kind as the tree's size has room for.
    const uint8_t *tree = at + 672;
    const uint64_t nodes =
        270400 * (uint64_t)load_int(tree + 40) + 33856 * (uint64_t)load_int(tree + 36) + 2144 * (uint64_t)load_int(tree + 32);
    return CHECK((uint64_t)load_long(at + 32) == 672 + 64 + 64 + 32 * (uint64_t)load_int(g->root + 24) + nodes);
}

// A ball, or with `sign` -1 all but it, cut at `band` if that is above 0.
static fm_volume *make_ball(fm_shape shape, float radius, float sign, float band) {
    const fm_volume_desc desc = {
        .shape = shape, .type = FM_TYPE_F32, .storage = FM_STORAGE_HOST, .spacing = {0.5, 1, 2}, .origin = {-3, 0.25, 1e3}};
    fm_volume *volume = NULL;
    if (!CHECK_OK(fm_volume_create(NULL, &desc, &volume))) {
        return NULL;
    }
    float *data = fm_volume_data(volume);
    for (uint32_t z = 0; z < shape.z; z++) {
        for (uint32_t y = 0; y < shape.y; y++) {
            for (uint32_t x = 0; x < shape.x; x++) {
                const float dx = (float)x - (float)shape.x / 2, dy = (float)y - (float)shape.y / 2,
                            dz = (float)z - (float)shape.z / 2;
                const float value = sign * (sqrtf(dx * dx + dy * dy + dz * dz) - radius);
                *data++ = band > 0 ? fmaxf(-band, fminf(band, value)) : value;
            }
        }
    }
    return volume;
}

static void check_ball(fm_shape shape, float radius, float sign, float cut, double band) {
    fm_volume *volume = make_ball(shape, radius, sign, cut);
    const fm_write_desc write = {.band = band};
    grid g = {0};
    if (volume && CHECK_OK(fm_file_write(io_path("a.nvdb"), volume, &write)) && open_grid(io_path("a.nvdb"), &g)) {
        const float *data = fm_volume_data(volume);
        const float wanted = band > 0 ? (float)band : cut;
        CHECK(g.background == wanted);
        uint64_t wrong = 0, count = 0;
        for (uint32_t z = 0; z < shape.z + 9; z++) {
            for (uint32_t y = 0; y < shape.y + 9; y++) {
                for (uint32_t x = 0; x < shape.x + 9; x++) {
                    const bool in = x < shape.x && y < shape.y && z < shape.z;
                    const float value = in ? data[x + shape.x * (y + (uint64_t)shape.y * z)] : wanted;
                    const bool on = fabsf(value) < wanted;
                    bool active;
                    const float got = probe(&g, (const uint32_t[]){x, y, z}, &active);
                    wrong += active != on || got != (on ? value : copysignf(wanted, value));
                    count += on;
                }
            }
        }
        CHECK(wrong == 0);
        const uint8_t *at = g.file + 16 + 176 + 9;
        CHECK((uint64_t)load_long(at + 672 + 56) == count && (uint64_t)load_long(g.file + 16 + 24) == count);
        double map[3];
        memcpy(map, at + 296 + 232, sizeof map);
        CHECK(map[0] == -3 && map[1] == 0.25 && map[2] == 1e3);
    }
    free(g.file);
    fm_volume_destroy(volume);
    io_clear();
}

static void refusals(void) {
    fm_volume *volume = io_volume(NULL, (fm_shape){9, 3, 2}, FM_TYPE_U8, 1);
    CHECK_FAILS(fm_file_write(io_path("a.nvdb"), volume, NULL), FM_ERROR_UNSUPPORTED);
    fm_volume_destroy(volume);
    volume = make_ball((fm_shape){9, 9, 9}, 3, 1, 2);
    for (int i = 0; i < 3; i++) {
        const fm_write_desc wrong = {.band = (const double[]){-1, (double)NAN, (double)INFINITY}[i]};
        CHECK_FAILS(fm_file_write(io_path("a.nvdb"), volume, &wrong), FM_ERROR_INVALID_ARGUMENT);
    }
    CHECK_OK(fm_file_write(io_path("b.nvdb"), volume, NULL));
    fm_volume *read = NULL;
    CHECK_FAILS(fm_file_read(NULL, io_path("b.nvdb"), NULL, &read, NULL), FM_ERROR_UNSUPPORTED);
    CHECK_FAILS(fm_file_probe(io_path("b.nvdb"), NULL, &(fm_file_info){0}), FM_ERROR_UNSUPPORTED);
    ((float *)fm_volume_data(volume))[7] = NAN;
    CHECK_FAILS(fm_file_write(io_path("a.nvdb"), volume, NULL), FM_ERROR_UNSUPPORTED);
    CHECK(strstr(fm_last_error(), "voxel 7 is NaN") != NULL);
    CHECK(io_file_count() == 1);
    fm_volume_destroy(volume);
    io_clear();
}

static fm_result attempt_write(fm_context *context, void *user) {
    const fm_volume_desc desc = {.shape = {9, 3, 2}, .type = FM_TYPE_F32, .storage = FM_STORAGE_HOST};
    fm_volume *volume = NULL;
    fm_result result = fm_volume_create(context, &desc, &volume);
    if (result == FM_OK) {
        memset(fm_volume_data(volume), 0, 9 * 3 * 2 * sizeof(float));
        result = fm_file_write(user, volume, NULL);
    }
    fm_volume_destroy(volume);
    return result;
}

int main(void) {
    if (!io_begin()) {
        return check_summary();
    }
    check_ball((fm_shape){70, 50, 30}, 12, 1, 3, 0);
    check_ball((fm_shape){70, 50, 30}, 12, -1, 3, 0);
    check_ball((fm_shape){150, 140, 9}, 60, 1, 0, 2);
    check_ball((fm_shape){4100, 3, 2}, 2044, 1, 0, 1.5);
    check_ball((fm_shape){1, 1, 1}, 1, 1, 0, 2);
    check_ball((fm_shape){20, 20, 20}, 100, 1, 1, 0);
    refusals();
    char path[512];
    snprintf(path, sizeof path, "%s", io_path("a.nvdb"));
    exhaust("a.nvdb", attempt_write, path, 0);
    return io_end();
}
