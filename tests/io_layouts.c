// SPDX-License-Identifier: MIT

// Other people's layouts, made by rewriting our own files byte by byte: the other byte order, Fortran order, scales, skipped bytes,
// more and fewer axes.

#include "io_common.h"

static const fm_shape shape = {5, 4, 3};

static void swap_bytes(uint8_t *bytes, size_t count, size_t size) {
    for (size_t i = 0; i < count; i++, bytes += size) {
        for (size_t k = 0; k < size / 2; k++) {
            uint8_t byte = bytes[k];
            bytes[k] = bytes[size - 1 - k];
            bytes[size - 1 - k] = byte;
        }
    }
}

// A volume of known elements, and the bytes of the file that it was written to.
static uint8_t *written(fm_volume *volume, const char *name, size_t *size) {
    CHECK_OK(fm_file_write(io_path(name), volume, NULL));
    uint8_t *bytes = io_contents(io_path(name), size);
    CHECK(bytes != NULL);
    return bytes;
}

// Replaces the first `before` by `after`, which is no longer, and pads with spaces.
static bool patch(uint8_t *bytes, size_t size, const char *before, const char *after) {
    size_t length = strlen(before);
    for (size_t i = 0; i + length <= size; i++) {
        if (memcmp(bytes + i, before, length) == 0) {
            memset(bytes + i, ' ', length);
            memcpy(bytes + i, after, strlen(after));
            return true;
        }
    }
    return CHECK(!"nothing to patch");
}

static fm_volume *read_bytes(const char *name, const uint8_t *bytes, size_t size, fm_file_info *info) {
    fm_volume *volume = NULL;
    io_store(io_path(name), bytes, size);
    CHECK_OK(fm_file_read(NULL, io_path(name), NULL, &volume, info));
    return volume;
}

static void swap_nifti(uint8_t *b) {
    swap_bytes(b, 1, 4);
    swap_bytes(b + 40, 8, 2);
    swap_bytes(b + 70, 2, 2);
    swap_bytes(b + 76, 11, 4);
    swap_bytes(b + 252, 2, 2);
    swap_bytes(b + 256, 18, 4);
}

static void big_endian(fm_type type) {
    fm_volume *volume = io_volume(NULL, shape, type, 11);
    const double spacing[3] = {0.5, 2, 4}, origin[3] = {1, -2, 3};
    CHECK_OK(fm_volume_place(volume, spacing, origin));
    static const char *const names[] = {"a.npy", "a.nrrd", "a.nii", "a.raw"};
    size_t element = fm_type_size(type), count = 5 * 4 * 3;
    for (int i = 0; i < 4; i++) {
        size_t size = 0;
        uint8_t *bytes = written(volume, names[i], &size);
        if (!bytes) {
            continue;
        }
        swap_bytes(bytes + size - count * element, count, element);
        if (i == 0) {
            patch(bytes, size, "'<", "'>");
        } else if (i == 1) {
            patch(bytes, size, "endian: little", "endian: big");
        } else if (i == 2) {
            swap_nifti(bytes);
        } else {
            size_t sidecar_size = 0;
            uint8_t *sidecar = io_contents(io_path("a.raw.txt"), &sidecar_size);
            sidecar[sidecar_size] = 0;
            char *line = strstr((char *)sidecar, "byte_order little");
            // The words after it move up.
            memcpy(line, "byte_order big", 14);
            memmove(line + 14, line + 17, strlen(line + 17) + 1);
            io_store(io_path("a.raw.txt"), sidecar, strlen((char *)sidecar));
            free(sidecar);
        }
        fm_file_info info = {0};
        fm_volume *read = read_bytes(names[i], bytes, size, &info);
        bool good = CHECK(read && io_same(volume, read)) && CHECK(info.big_endian);
        good = good && (i == 0 || (CHECK(info.spacing[2] == 4) && CHECK(info.origin[1] == -2)));
        if (!good) {
            fprintf(stderr, "    %s, %s\n", names[i], fm_type_name(type));
        }
        fm_volume_destroy(read);
        free(bytes);
    }
    fm_volume_destroy(volume);
    io_clear();
}

static void fortran(fm_shape axes) {
    fm_volume *volume = io_volume(NULL, axes, FM_TYPE_U16, 12);
    const uint16_t *file = fm_volume_data(volume);
    size_t size = 0;
    uint8_t *bytes = written(volume, "a.npy", &size);
    patch(bytes, size, "False", "True");
    fm_file_info info = {0};
    fm_volume *read = read_bytes("a.npy", bytes, size, &info);
    if (read && CHECK(info.fortran_order) && CHECK(io_same_shape(info.shape, axes))) {
        const uint16_t *got = fm_volume_data(read);
        bool equal = true;
        for (uint32_t z = 0; z < axes.z; z++) {
            for (uint32_t y = 0; y < axes.y; y++) {
                for (uint32_t x = 0; x < axes.x; x++) {
                    equal = equal && got[x + axes.x * (y + (size_t)axes.y * z)] == file[z + axes.z * (y + (size_t)axes.y * x)];
                }
            }
        }
        CHECK(equal);
    }
    fm_volume_destroy(read);
    fm_volume_destroy(volume);
    free(bytes);
}

static void scaled_nifti(void) {
    fm_volume *volume = io_volume(NULL, shape, FM_TYPE_I16, 13);
    size_t size = 0;
    uint8_t *bytes = written(volume, "a.nii", &size);
    const float scale[2] = {0.5f, 10};
    memcpy(bytes + 112, scale, sizeof scale);
    fm_file_info info = {0};
    fm_volume *read = read_bytes("a.nii", bytes, size, &info);
    if (read && CHECK(info.type == FM_TYPE_F32)) {
        for (int i = 0; i < 60; i++) {
            CHECK(((const float *)fm_volume_data(read))[i] == ((const int16_t *)fm_volume_data(volume))[i] * 0.5f + 10);
        }
    }
    fm_volume_destroy(read);
    // A slope of 0 means that there is no scale; a fourth axis of 1 is no obstacle, one of 2 is.
    memset(bytes + 112, 0, 8);
    bytes[40] = 4;
    read = read_bytes("a.nii", bytes, size, &info);
    CHECK(read && io_same(volume, read));
    fm_volume_destroy(read);
    bytes[48] = 2;
    io_store(io_path("a.nii"), bytes, size);
    read = NULL;
    CHECK_FAILS(fm_file_read(NULL, io_path("a.nii"), NULL, &read, NULL), FM_ERROR_UNSUPPORTED);
    free(bytes);
    fm_volume_destroy(volume);
}

// The orientation counts only where a code says that there is one.
static void placed_nifti(void) {
    enum { QFORM_CODE = 252, SFORM_CODE = 254, QUATERN_B = 256, QOFFSET_X = 268, SROW_X = 280 };
    const short no_code = 0;
    const float nan = NAN, moved = 7.5f, turned = 1;
    fm_volume *volume = io_volume(NULL, shape, FM_TYPE_U8, 14);
    size_t size = 0;
    uint8_t *bytes = written(volume, "a.nii", &size);
    fm_file_info info = {0};
    memcpy(bytes + QUATERN_B, &nan, sizeof nan);
    memcpy(bytes + SROW_X + 12, &moved, sizeof moved);
    fm_volume *read = read_bytes("a.nii", bytes, size, &info);
    CHECK(read && info.origin[0] == 7.5 && info.note[0] == 0);
    fm_volume_destroy(read);
    memcpy(bytes + SFORM_CODE, &no_code, sizeof no_code);
    io_store(io_path("a.nii"), bytes, size);
    CHECK_FAILS(fm_file_read(NULL, io_path("a.nii"), NULL, &read, NULL), FM_ERROR_FORMAT);
    memset(bytes + QUATERN_B, 0, sizeof nan);
    memcpy(bytes + QOFFSET_X, &moved, sizeof moved);
    memcpy(bytes + SROW_X, &nan, sizeof nan);
    read = read_bytes("a.nii", bytes, size, &info);
    CHECK(read && info.origin[0] == 7.5 && info.note[0] == 0);
    fm_volume_destroy(read);
    memcpy(bytes + QUATERN_B, &turned, sizeof turned);
    read = read_bytes("a.nii", bytes, size, &info);
    CHECK(read && info.origin[0] == 7.5 && strstr(info.note, "orientation"));
    fm_volume_destroy(read);
    memcpy(bytes + QFORM_CODE, &no_code, sizeof no_code);
    memcpy(bytes + QUATERN_B, &nan, sizeof nan);
    read = read_bytes("a.nii", bytes, size, &info);
    CHECK(read && info.origin[0] == 0 && info.note[0] == 0);
    fm_volume_destroy(read);
    fm_volume_destroy(volume);
    free(bytes);
}

static void nrrd_by_hand(void) {
    static const struct {
        const char *header;
        fm_shape shape;
        double spacing[3], origin[3];
    } rows[] = {
        {"NRRD0001\ntype: unsigned char\ndimension: 1\nsizes: 24\nencoding: raw\n\n", {24, 1, 1}, {1, 1, 1}, {0, 0, 0}},
        {"NRRD0002\r\n# remark\r\ntype: uchar\r\ndimension: 2\r\nsizes: 4 6\r\nspacings: 0.5 nan\r\nencoding: raw\r\n\r\n",
         {4, 6, 1},
         {0.5, 1, 1},
         {0, 0, 0}},
        {"NRRD0005\ntype: uint8\ndimension: 4\nsizes: 1 4 3 2\nspacings: nan 2 3 4\nencoding: raw\nkey:=value: x\n\n",
         {4, 3, 2},
         {2, 3, 4},
         {0, 0, 0}},
        {"NRRD0004\ntype: uint8\ndimension: 3\nspace: left-posterior-superior\nsizes: 4 3 2\nspace directions: (3,4,0) (0,2,0) "
         "(0,0,1)\n"
         "space origin: (7,8,9)\nkinds: domain domain domain\nencoding: raw\n\n",
         {4, 3, 2},
         {5, 2, 1},
         {7, 8, 9}},
        {"NRRD0004\ntype: uint8\ndimension: 3\nsizes: 4 3 2\nencoding: raw\nline skip: 2\nbyte skip: 3\n\nfirst\nsecond\nxyz",
         {4, 3, 2},
         {1, 1, 1},
         {0, 0, 0}},
        {"NRRD0004\ntype: uint8\ndimension: 3\nsizes: 4 3 2\nencoding: raw\nbyte skip: -1\n\nwhatever",
         {4, 3, 2},
         {1, 1, 1},
         {0, 0, 0}},
    };
    for (size_t i = 0; i < sizeof rows / sizeof rows[0]; i++) {
        char bytes[1024];
        size_t header = strlen(rows[i].header);
        memcpy(bytes, rows[i].header, header);
        for (int k = 0; k < 24; k++) {
            bytes[header + (size_t)k] = (char)(k + 1);
        }
        fm_file_info info = {0};
        fm_volume *read = read_bytes("hand.nrrd", (uint8_t *)bytes, header + 24, &info);
        bool good =
            read && CHECK(io_same_shape(info.shape, rows[i].shape)) && CHECK(memcmp(fm_volume_data(read), bytes + header, 24) == 0);
        for (int k = 0; good && k < 3; k++) {
            good = CHECK(info.spacing[k] == rows[i].spacing[k]) && CHECK(info.origin[k] == rows[i].origin[k]);
        }
        if (!good) {
            fprintf(stderr, "    header %zu\n", i);
        }
        fm_volume_destroy(read);
    }
}

// Two streams one after the other are one file, and a second copy of the elements is not.
static void gzip_members(void) {
    fm_volume *volume = io_volume(NULL, (fm_shape){30, 20, 10}, FM_TYPE_U8, 14);
    size_t size = 0;
    uint8_t *bytes = written(volume, "a_30x20x10_u8.raw.gz", &size);
    uint8_t *twice = malloc(2 * size);
    memcpy(twice, bytes, size);
    memcpy(twice + size, bytes, size);
    fm_file_info info = {0};
    fm_volume *read = read_bytes("b_30x20x20_u8.raw.gz", twice, 2 * size, &info);
    CHECK(read && memcmp(fm_volume_data(read), fm_volume_data(volume), 6000) == 0);
    CHECK(read && memcmp((uint8_t *)fm_volume_data(read) + 6000, fm_volume_data(volume), 6000) == 0);
    fm_volume_destroy(read);
    read = NULL;
    io_store(io_path("c_30x20x10_u8.raw.gz"), twice, 2 * size);
    CHECK_FAILS(fm_file_read(NULL, io_path("c_30x20x10_u8.raw.gz"), NULL, &read, NULL), FM_ERROR_FORMAT);
    twice[size] = 'x';
    io_store(io_path("c_30x20x10_u8.raw.gz"), twice, 2 * size);
    CHECK_FAILS(fm_file_read(NULL, io_path("c_30x20x10_u8.raw.gz"), NULL, &read, NULL), FM_ERROR_FORMAT);
    // A wrong sum.
    bytes[size - 6] ^= 1;
    io_store(io_path("c_30x20x10_u8.raw.gz"), bytes, size);
    CHECK_FAILS(fm_file_read(NULL, io_path("c_30x20x10_u8.raw.gz"), NULL, &read, NULL), FM_ERROR_FORMAT);
    free(twice);
    free(bytes);
    fm_volume_destroy(volume);
}

int main(void) {
    const uint16_t one = 1;
    if (*(const uint8_t *)&one == 0) {
        return check_skip("the bytes are worked out for a little-endian machine");
    }
    if (!io_begin()) {
        return check_summary();
    }
    static const fm_type types[] = {FM_TYPE_U16, FM_TYPE_I16, FM_TYPE_U32, FM_TYPE_F32, FM_TYPE_I64, FM_TYPE_F64};
    for (size_t i = 0; i < sizeof types / sizeof types[0]; i++) {
        big_endian(types[i]);
    }
    fortran(shape);
    fortran((fm_shape){1, 7, 9});
    fortran((fm_shape){130, 200, 150});
    scaled_nifti();
    placed_nifti();
    nrrd_by_hand();
    gzip_members();
    return io_end();
}
