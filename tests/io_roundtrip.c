// SPDX-License-Identifier: MIT

// Every format that is written and read, with every type and odd shapes: what comes back is what went out.

#include "io_common.h"

typedef struct target {
    const char *name;
    bool keeps_place;  // spacing and origin
    bool keeps_bits;
    bool only_u8;  // and bits
} target;

static const target targets[] = {
    {"a.npy", false, false, false},    {"a.npy.gz", false, false, false}, {"a.raw", true, true, false},
    {"a.raw.gz", true, true, false},   {"a.vox", false, false, true},     {"a.nrrd", true, false, false},
    {"a.nrrd.gz", true, false, false}, {"a.nhdr", true, false, false},    {"a.nii", true, false, false},
    {"a.nii.gz", true, false, false},
};

static const fm_type types[] = {
    FM_TYPE_U8,  FM_TYPE_U16, FM_TYPE_U32, FM_TYPE_F32, FM_TYPE_BITS, FM_TYPE_I8,
    FM_TYPE_I16, FM_TYPE_I32, FM_TYPE_U64, FM_TYPE_I64, FM_TYPE_F64,
};

static const fm_shape shapes[] = {{1, 1, 1}, {3, 5, 7}, {33, 2, 1}, {1, 1, 40}, {64, 3, 2}, {1, 9, 1}, {257, 5, 300}};

#define COUNT(array) (sizeof(array) / sizeof((array)[0]))

static void one(const target *t, fm_type type, fm_shape shape) {
    const double spacing[3] = {0.5, 1.25, 3}, origin[3] = {-1.5, 0, 1024};
    fm_volume *written = io_volume(NULL, shape, type, shape.x + 31 * shape.y + (uint64_t)type);
    CHECK_OK(fm_volume_place(written, spacing, origin));
    fm_volume *read = NULL;
    fm_file_info info = {0}, probed = {0};
    bool good = CHECK_OK(fm_file_write(io_path(t->name), written, NULL)) &&
                CHECK_OK(fm_file_probe(io_path(t->name), NULL, &probed)) &&
                CHECK_OK(fm_file_read(NULL, io_path(t->name), NULL, &read, &info));
    if (good) {
        fm_volume_desc desc;
        fm_volume_info(read, &desc);
        good = CHECK(io_same(written, read)) && CHECK(memcmp(&info, &probed, sizeof info) == 0) &&
               CHECK(desc.type == (type == FM_TYPE_BITS && !t->keeps_bits ? FM_TYPE_U8 : type));
        for (int i = 0; i < 3 && t->keeps_place; i++) {
            good = CHECK(desc.spacing[i] == spacing[i]) && CHECK(desc.origin[i] == origin[i]) && good;
        }
    }
    if (!good) {
        fprintf(stderr, "    %s, %s, %u x %u x %u\n", t->name, fm_type_name(type), shape.x, shape.y, shape.z);
    }
    fm_volume_destroy(written);
    fm_volume_destroy(read);
    io_clear();
}

int main(void) {
    if (!io_begin()) {
        return check_summary();
    }
    for (size_t t = 0; t < COUNT(targets); t++) {
        for (size_t k = 0; k < COUNT(types); k++) {
            for (size_t s = 0; s < COUNT(shapes); s++) {
                if (!targets[t].only_u8 || types[k] == FM_TYPE_U8 || types[k] == FM_TYPE_BITS) {
                    one(&targets[t], types[k], shapes[s]);
                }
            }
        }
    }
    return io_end();
}
