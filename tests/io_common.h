// SPDX-License-Identifier: MIT
#ifndef FM_IO_COMMON_H
#define FM_IO_COMMON_H

// What the tests of files share: a directory of their own, volumes with known elements, and comparison.

#include "check.h"
#include "fathom/io.h"
#include "random.h"

#include <dirent.h>
#include <math.h>
#include <stdlib.h>
#include <string.h>
#include <sys/stat.h>
#include <unistd.h>

static char io_directory[256];

static inline bool io_begin(void) {
    const char *root = getenv("TMPDIR");
    snprintf(io_directory, sizeof io_directory, "%s/fathom-test-XXXXXX", root && root[0] ? root : "/tmp");
    return CHECK(mkdtemp(io_directory) != NULL);
}

// Path of a file in the test's directory, in one of a few buffers that take turns.
static inline const char *io_path(const char *name) {
    static char paths[8][512];
    static int turn;
    char *path = paths[turn++ % 8];
    snprintf(path, sizeof paths[0], "%s/%s", io_directory, name);
    return path;
}

static inline int io_file_count(void) {
    DIR *directory = opendir(io_directory);
    int count = 0;
    for (struct dirent *entry; directory && (entry = readdir(directory));) {
        count += strcmp(entry->d_name, ".") != 0 && strcmp(entry->d_name, "..") != 0;
    }
    if (directory) {
        closedir(directory);
    }
    return count;
}

static inline void io_clear(void) {
    DIR *directory = opendir(io_directory);
    for (struct dirent *entry; directory && (entry = readdir(directory));) {
        if (strcmp(entry->d_name, ".") != 0 && strcmp(entry->d_name, "..") != 0) {
            unlink(io_path(entry->d_name));
        }
    }
    if (directory) {
        closedir(directory);
    }
}

static inline int io_end(void) {
    io_clear();
    CHECK(rmdir(io_directory) == 0);
    return check_summary();
}

static inline bool io_exists(const char *path) {
    struct stat status;
    return lstat(path, &status) == 0;
}

static inline bool io_store(const char *path, const void *data, size_t size) {
    FILE *file = fopen(path, "wb");
    bool good = file && fwrite(data, 1, size, file) == size;
    if (file) {
        good = fclose(file) == 0 && good;
    }
    return CHECK(good);
}

// Contents of a file, to be freed; NULL when it cannot be read.
static inline uint8_t *io_contents(const char *path, size_t *size) {
    FILE *file = fopen(path, "rb");
    if (!file) {
        return NULL;
    }
    fseek(file, 0, SEEK_END);
    *size = (size_t)ftell(file);
    rewind(file);
    uint8_t *data = malloc(*size + 1);
    if (data && fread(data, 1, *size, file) != *size) {
        free(data);
        data = NULL;
    }
    fclose(file);
    return data;
}

static inline uint64_t io_bytes(fm_shape shape, fm_type type) {
    uint64_t bytes = 0;
    CHECK_OK(fm_array_bytes(shape, type, &bytes));
    return bytes;
}

// A host volume of random bytes; bits past the end of a row are 0 and no float is NaN.
static inline fm_volume *io_volume(fm_context *context, fm_shape shape, fm_type type, uint64_t seed) {
    fm_volume *volume = NULL;
    fm_volume_desc desc = {.shape = shape, .type = type, .storage = FM_STORAGE_HOST, .spacing = {1, 1, 1}};
    if (!CHECK_OK(fm_volume_create(context, &desc, &volume))) {
        return NULL;
    }
    uint8_t *data = fm_volume_data(volume);
    uint64_t bytes = io_bytes(shape, type);
    uint64_t state = seed;
    for (uint64_t i = 0; i < bytes; i++) {
        data[i] = (uint8_t)(test_random(&state) >> 32);
    }
    uint64_t count = (uint64_t)shape.x * shape.y * shape.z;
    for (uint64_t i = 0; i < count && type == FM_TYPE_F32; i++) {
        ((float *)(void *)data)[i] = i % 7 == 3 ? INFINITY : (float)(int8_t)data[4 * i] * 0.25f;
    }
    for (uint64_t i = 0; i < count && type == FM_TYPE_F64; i++) {
        ((double *)(void *)data)[i] = (double)(int8_t)data[8 * i] * 0.1;
    }
    uint32_t words = (shape.x + 31) / 32;
    for (uint64_t row = 0; row < (uint64_t)shape.y * shape.z && type == FM_TYPE_BITS && shape.x % 32; row++) {
        ((uint32_t *)(void *)data)[row * words + words - 1] &= (1u << shape.x % 32) - 1;
    }
    return volume;
}

static inline bool io_same_shape(fm_shape a, fm_shape b) {
    return a.x == b.x && a.y == b.y && a.z == b.z;
}

// Same shape, type and elements; bits compare with the bytes that stand for them in `read`.
static inline bool io_same(fm_volume *written, fm_volume *read) {
    fm_volume_desc a, b;
    fm_volume_info(written, &a);
    fm_volume_info(read, &b);
    if (!io_same_shape(a.shape, b.shape)) {
        return false;
    }
    if (a.type == b.type) {
        return memcmp(fm_volume_data(written), fm_volume_data(read), (size_t)io_bytes(a.shape, a.type)) == 0;
    }
    if (a.type != FM_TYPE_BITS || b.type != FM_TYPE_U8) {
        return false;
    }
    const uint32_t *words = fm_volume_data(written);
    const uint8_t *bytes = fm_volume_data(read);
    uint32_t row_words = (a.shape.x + 31) / 32;
    for (uint64_t row = 0; row < (uint64_t)a.shape.y * a.shape.z; row++) {
        for (uint32_t x = 0; x < a.shape.x; x++) {
            if ((words[row * row_words + x / 32] >> x % 32 & 1) != bytes[row * a.shape.x + x]) {
                return false;
            }
        }
    }
    return true;
}

#endif
