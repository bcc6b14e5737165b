// SPDX-License-Identifier: MIT

// Files that are truncated, mislabelled, oversized or hostile: one clear line that names the file, and nothing made.

#include "io/file.h"
#include "io_common.h"

typedef struct bad_row {
    const char *name;
    const char *text;
    size_t size;
    fm_result result;
    const char *says;  // a part of the message
} bad_row;

// Literals hold NULs, so their sizes are taken from their arrays.
#define TEXT(literal) literal, sizeof(literal) - 1

#define NPY(length, dictionary) TEXT("\x93NUMPY\1\0" length "\0" dictionary)
// Headers padded by the 64 bytes of elements that follow.
#define X64 "0123456789012345678901234567890123456789012345678901234567890123"
#define NRRD_HEAD "NRRD0004\ntype: uint8\ndimension: 3\nsizes: 4 4 4\n"
#define BT_HEAD "# Octomap OcTree binary file\nid OcTree\n"

static const bad_row rows[] = {
    {"empty.npy", TEXT(""), FM_ERROR_FORMAT, "empty.npy"},
    {"text.npy", TEXT("hello, this is no array"), FM_ERROR_FORMAT, "is no npy file"},
    {"unknown.xyz", TEXT("hello, this is no array"), FM_ERROR_FORMAT, "no known format"},
    {"archive.npz", TEXT("PK\3\4 and so on"), FM_ERROR_UNSUPPORTED, "zip archive"},
    {"cut.npy", TEXT("\x93NUMPY\1\0"), FM_ERROR_FORMAT, "truncated"},
    {"version.npy", TEXT("\x93NUMPY\7\0\1\0 "), FM_ERROR_UNSUPPORTED, "version"},
    {"long.npy", TEXT("\x93NUMPY\2\0\xff\xff\xff\x7f{}"), FM_ERROR_FORMAT, "header"},
    {"header.npy", NPY("\x10", "{'descr': '<f4',"), FM_ERROR_FORMAT, "damaged .npy header"},
    {"half.npy",
     NPY("\x3a", "{'descr': '<f2', 'fortran_order': False, 'shape': (4, 8)}"
                 "\n" X64),
     FM_ERROR_UNSUPPORTED, "<f2"},
    {"short.npy",
     NPY("\x3a", "{'descr': '<f4', 'fortran_order': False, 'shape': (8, 4)}"
                 "\n" X64),
     FM_ERROR_FORMAT, "128 bytes"},
    {"surplus.npy",
     NPY("\x3a", "{'descr': '<f4', 'fortran_order': False, 'shape': (1, 4)}"
                 "\n" X64),
     FM_ERROR_FORMAT, "after its last"},
    {"zero.npy",
     NPY("\x3a", "{'descr': '<f4', 'fortran_order': False, 'shape': (0, 4)}"
                 "\n" X64),
     FM_ERROR_FORMAT, "every axis"},
    {"huge.npy", NPY("\x50", "{'descr': '<f8', 'fortran_order': False, 'shape': (2147483647,2147483647,2)}   \n" X64),
     FM_ERROR_FORMAT, "huge.npy"},
    {"overflow.npy", NPY("\x50", "{'descr': '<f8', 'fortran_order': False, 'shape': (99999999999999999999999, 4)}\n" X64),
     FM_ERROR_FORMAT, "damaged .npy header"},
    {"wrap.npy", NPY("\x50", "{'descr': '<f8', 'fortran_order': False, 'shape': (2147483647,2147483647,2147483647)}\n" X64),
     FM_ERROR_FORMAT, "wrap.npy"},
    {"axes.npy", NPY("\x40", "{'descr': '<f4', 'fortran_order': False, 'shape': (2,2,2,2)}   \n" X64), FM_ERROR_UNSUPPORTED,
     "axes"},
    {"negative.npy", NPY("\x40", "{'descr': '<f4', 'fortran_order': False, 'shape': (-2,2,2)}    \n" X64), FM_ERROR_FORMAT,
     "damaged"},

    {"nolayout.raw", TEXT(X64), FM_ERROR_FORMAT, "shape is not known"},
    {"cut_8x8x8_u16.raw", TEXT(X64), FM_ERROR_FORMAT, "1024 bytes"},
    {"surplus_2x2x2_u8.raw", TEXT(X64), FM_ERROR_FORMAT, "56 bytes after"},
    {"huge_4294967295x4294967295x4294967295_f64.raw", TEXT(X64), FM_ERROR_FORMAT, "every axis"},
    {"zero_0x4x4_u8.raw", TEXT(X64), FM_ERROR_FORMAT, "every axis"},
    {"cutgzip_8x8x1_u8.raw.gz", TEXT("\x1f\x8b\x08\0\0\0\0\0\0\3"), FM_ERROR_FORMAT, "gzip stream is cut off"},
    {"badgzip_8x8x1_u8.raw.gz", TEXT("\x1f\x8b\x08\0\0\0\0\0\0\3\7zzzzzzzzzzz"), FM_ERROR_FORMAT, "gzip stream is damaged"},
    {"bomb_2000x2000x2000_f64.raw.gz", TEXT("\x1f\x8b\x08\0\0\0\0\0\0\3zzzzzzzzzzzz"), FM_ERROR_FORMAT, "bomb"},

    {"a.nrrd", TEXT(NRRD_HEAD), FM_ERROR_FORMAT, "truncated"},
    {"b.nrrd", TEXT(NRRD_HEAD "\n" X64), FM_ERROR_FORMAT, "lacks a header line"},
    {"c.nrrd", TEXT(NRRD_HEAD "encoding: ascii\n\n" X64), FM_ERROR_UNSUPPORTED, "ascii"},
    {"d.nrrd", TEXT(NRRD_HEAD "encoding: raw\nnonsense: 4\n\n" X64), FM_ERROR_FORMAT, "nonsense"},
    {"e.nrrd", TEXT(NRRD_HEAD "encoding: raw\nsizes: 4 4 4\n\n" X64), FM_ERROR_FORMAT, "two header lines"},
    {"f.nrrd", TEXT(NRRD_HEAD "encoding: raw\n\n" X64 "more"), FM_ERROR_FORMAT, "after its last"},
    {"g.nrrd", TEXT(NRRD_HEAD "encoding: raw\nbyte skip: 5\n\n" X64), FM_ERROR_FORMAT, "needs 64 bytes"},
    {"h.nrrd", TEXT(NRRD_HEAD "encoding: raw\nline skip: 9999999999\n\n" X64), FM_ERROR_FORMAT, "truncated"},
    {"i.nrrd", TEXT("NRRD0004\ntype: uint8\ndimension: 3\nsizes: 4 4\nencoding: raw\n\n" X64), FM_ERROR_FORMAT, "teem"},
    {"j.nrrd", TEXT("NRRD0004\ntype: uint8\ndimension: 3\nsizes: 2147483647 2147483647 2147483647\nencoding: raw\n\n" X64),
     FM_ERROR_FORMAT, "j.nrrd"},
    {"k.nrrd", TEXT("NRRD0004\ntype: short\ndimension: 1\nsizes: 32\nencoding: raw\n\n" X64), FM_ERROR_FORMAT, "k.nrrd"},
    {"l.nrrd", TEXT("NRRD0004\ntype: block\nblock size: 4\ndimension: 1\nsizes: 16\nencoding: raw\n\n" X64), FM_ERROR_FORMAT,
     "l.nrrd"},
    {"m.nhdr", TEXT(NRRD_HEAD "encoding: raw\ndata file: missing.raw\n"), FM_ERROR_IO, "missing.raw"},
    {"n.nhdr", TEXT(NRRD_HEAD "encoding: raw\ndata file: /dev/zero\n"), FM_ERROR_FORMAT, "no regular file"},
    {"o.nhdr", TEXT(NRRD_HEAD "encoding: raw\ndata file: LIST\nx.raw\n"), FM_ERROR_FORMAT, "x.raw"},
    {"p.nhdr", TEXT(NRRD_HEAD "encoding: raw\ndata file: x%03d.raw 1 4 1\n"), FM_ERROR_UNSUPPORTED, "several files"},
    {"q.nrrd", TEXT("NRRD0009\n"), FM_ERROR_UNSUPPORTED, "version"},
    {"r.nrrd", TEXT(NRRD_HEAD "encoding: gzip\nbyte skip: -1\n\n" X64), FM_ERROR_UNSUPPORTED, "byte skip"},
    {"s.nrrd", TEXT(NRRD_HEAD "encoding: gzip\n\n" X64), FM_ERROR_FORMAT, "gzip stream is damaged"},
    {"t.nrrd", TEXT("NRRD0004\ntype: uint8\ndimension: 4\nsizes: 4 4 2 2\nencoding: raw\n\n" X64), FM_ERROR_UNSUPPORTED, "axes"},

    {"cut.vox", TEXT("VOX \x96\0\0\0MAIN"), FM_ERROR_FORMAT, "damaged MAIN"},
    {"claim.vox", TEXT("VOX \x96\0\0\0MAIN\0\0\0\0\xff\xff\xff\x7f"), FM_ERROR_FORMAT, "truncated"},
    {"chunk.vox", TEXT("VOX \x96\0\0\0MAIN\0\0\0\0\x0c\0\0\0SIZE\xff\xff\xff\x7f\0\0\0\0"), FM_ERROR_FORMAT,
     "longer than the file"},
    {"orphan.vox", TEXT("VOX \x96\0\0\0MAIN\0\0\0\0\x10\0\0\0XYZI\4\0\0\0\0\0\0\0\0\0\0\0"), FM_ERROR_FORMAT,
     "without a chunk SIZE"},
    {"big.vox", TEXT("VOX \x96\0\0\0MAIN\0\0\0\0\x18\0\0\0SIZE\x0c\0\0\0\0\0\0\0\1\0\0\0\xff\xff\xff\x7f\1\0\0\0"), FM_ERROR_FORMAT,
     "256"},
    {"count.vox",
     TEXT("VOX \x96\0\0\0MAIN\0\0\0\0\x28\0\0\0SIZE\x0c\0\0\0\0\0\0\0\1\0\0\0\1\0\0\0\1\0\0\0XYZI\4\0\0\0\0\0\0\0\xff\xff\xff\xff"),
     FM_ERROR_FORMAT, "more than the chunk holds"},
    {"novoxels.vox", TEXT("VOX \x96\0\0\0MAIN\0\0\0\0\x18\0\0\0SIZE\x0c\0\0\0\0\0\0\0\1\0\0\0\1\0\0\0\1\0\0\0"), FM_ERROR_FORMAT,
     "XYZI is missing"},

    {"a.binvox", TEXT("#binvox 1\ndim 4 4 4\n"), FM_ERROR_FORMAT, "truncated"},
    {"b.binvox", TEXT("#binvox 1\ndata\n\1\x40"), FM_ERROR_FORMAT, "dim"},
    {"c.binvox", TEXT("#binvox 1\ndim 4 4 -4\ndata\n\1\x40"), FM_ERROR_FORMAT, "dim 4 4 -4"},
    {"d.binvox", TEXT("#binvox 1\ndim 4 4 4\ndata\n\1\x20"), FM_ERROR_FORMAT, "truncated"},
    {"e.binvox", TEXT("#binvox 1\ndim 4 4 4\ndata\n\1\x41"), FM_ERROR_FORMAT, "bad run"},
    {"f.binvox", TEXT("#binvox 1\ndim 4 4 4\ndata\n\2\x40"), FM_ERROR_FORMAT, "bad run"},
    {"g.binvox", TEXT("#binvox 1\ndim 4 4 4\ndata\n\1\0\1\x40"), FM_ERROR_FORMAT, "bad run"},
    {"h.binvox", TEXT("#binvox 1\ndim 4 4 4\ndata\n\1\x40\1\1"), FM_ERROR_FORMAT, "after its last"},
    {"i.binvox", TEXT("#binvox 1\ndim 2000000 2000000 2000000\ndata\n\1\x40"), FM_ERROR_FORMAT, "truncated or its header wrong"},
    {"j.binvox", TEXT("#binvox 1\ndim 4 4 4\nscale -1\ndata\n\1\x40"), FM_ERROR_FORMAT, "spacing"},

    {"a.3dmap", TEXT("voxel 4 4\n"), FM_ERROR_FORMAT, "voxel X Y Z"},
    {"b.3dmap", TEXT("voxel 4 4 4\n1 2 4\n"), FM_ERROR_FORMAT, "1 2 4"},
    {"c.3dmap", TEXT("voxel 4 4 4\n1 2 -3\n"), FM_ERROR_FORMAT, "1 2 -3"},
    {"d.3dmap", TEXT("voxel 4 4 4\n1 2 3 4\n"), FM_ERROR_FORMAT, "1 2 3 4"},
    {"e.3dmap", TEXT("voxel 0 4 4\n"), FM_ERROR_FORMAT, "every axis"},
    {"f.3dmap", TEXT("voxel 2000000 2000000 4\n"), FM_ERROR_RANGE, "over the limit"},
    {"g.3dmap", TEXT("voxel 2000000000 2000000000 2000000000\n"), FM_ERROR_RANGE, "63 bits"},
    {"a.vxl", TEXT("\0\1\1\0cccc"), FM_ERROR_FORMAT, "a.vxl"},

    {"a.bt", TEXT(BT_HEAD "data\n"), FM_ERROR_FORMAT, "lacks a line"},
    {"b.bt", TEXT(BT_HEAD "size 9\nres 0.1\ndata\n\3"), FM_ERROR_FORMAT, "cut off"},
    {"c.bt", TEXT(BT_HEAD "size 9\nres 0.1\ndata\n\2\0"), FM_ERROR_FORMAT, "claims 9 nodes"},
    {"d.bt", TEXT(BT_HEAD "size 2\nres 0.1\ndata\n\2\0\0\0"), FM_ERROR_FORMAT, "2 bytes over"},
    {"e.bt", TEXT(BT_HEAD "size 0\nres 0.1\ndata\n"), FM_ERROR_FORMAT, "empty"},
    {"f.bt", TEXT(BT_HEAD "size 2\nres 0\ndata\n\2\0"), FM_ERROR_FORMAT, "res"},
    {"g.bt", TEXT(BT_HEAD "size 2\nres nan\ndata\n\2\0"), FM_ERROR_FORMAT, "res"},
    {"h.bt", TEXT("# Octomap OcTree binary file\nid ColorOcTree\nsize 2\nres 1\ndata\n\2\0"), FM_ERROR_UNSUPPORTED, "ColorOcTree"},
    {"i.bt", TEXT(BT_HEAD "size 3\nres 0.1\ndata\n\2\x80"), FM_ERROR_RANGE, "over the limit"},
};

static void check_row(const bad_row *row) {
    fm_volume *volume = NULL;
    fm_file_info info = {0};
    io_store(io_path(row->name), row->text, row->size);
    bool good = CHECK_FAILS(fm_file_read(NULL, io_path(row->name), NULL, &volume, &info), row->result);
    good = CHECK(volume == NULL) && good;
    good = CHECK(strstr(fm_last_error(), row->says) != NULL) && good;
    good = CHECK(strchr(fm_last_error(), '\n') == NULL) && good;
    if (!good) {
        fprintf(stderr, "    %s: \"%s\"\n", row->name, fm_last_error());
    }
    fm_volume_destroy(volume);
    unlink(io_path(row->name));
}

static fm_result read_memory(const uint8_t *bytes, size_t size, fm_volume **volume) {
    const fm_read_desc desc = {.max_bytes = 1 << 20};
    fm_input *input = NULL;
    *volume = NULL;
    FM_TRY(fm_input_open_memory(&fm_default_allocator, bytes, size, "memory", &input));
    fm_result result = fm_file_read_input(NULL, input, NULL, &desc, volume, NULL);
    fm_input_close(input);
    return result;
}

// Any shorter beginning of a valid file is refused, and any single changed bit is at worst another volume.
static void cut_and_flip(const char *name, fm_type type) {
    fm_volume *volume = io_volume(NULL, (fm_shape){5, 4, 3}, type, 3);
    CHECK_OK(fm_file_write(io_path(name), volume, NULL));
    fm_volume_destroy(volume);
    size_t size = 0;
    uint8_t *bytes = io_contents(io_path(name), &size);
    for (size_t length = 0; length < size; length++) {
        if (!CHECK(read_memory(bytes, length, &volume) != FM_OK) || !CHECK(volume == NULL)) {
            fprintf(stderr, "    %s cut to %zu of %zu bytes\n", name, length, size);
        }
        fm_volume_destroy(volume);
    }
    for (size_t i = 0; i < size; i++) {
        for (int bit = 0; bit < 8; bit++) {
            bytes[i] ^= (uint8_t)(1 << bit);
            fm_result result = read_memory(bytes, size, &volume);
            CHECK((result == FM_OK) == (volume != NULL));
            fm_volume_destroy(volume);
            bytes[i] ^= (uint8_t)(1 << bit);
        }
    }
    free(bytes);
    io_clear();
}

static void sidecars(void) {
    static const char *const texts[] = {
        "",
        "something else\n",
        "fathom raw 1\nshape 4 4 4\n",
        "fathom raw 1\ntype uint8\n",
        "fathom raw 1\nshape 4 4\ntype uint8\n",
        "fathom raw 1\nshape 4 4 -4\ntype uint8\n",
        "fathom raw 1\nshape 4 4 4\ntype float16\n",
        "fathom raw 1\nshape 4 4 4\ntype uint8\noffset -1\n",
        "fathom raw 1\nshape 4 4 4\ntype uint8\noffset 1\n",
        "fathom raw 1\nshape 4 4 4\ntype uint8\nspacing 0 1 1\n",
        "fathom raw 1\nshape 4 4 4\ntype uint8\nspacing 1 nan 1\n",
        "fathom raw 1\nshape 4 4 4\ntype uint8\norigin inf 1 1\n",
        "fathom raw 1\nshape 4 4 4\ntype uint8\nbyte_order middle\n",
        "fathom raw 1\nshape 4 4 4\ntype uint8\ncolour red\n",
        "fathom raw 1\nshape 99999999999999999999999 4 4\ntype uint8\n",
    };
    for (size_t i = 0; i < sizeof texts / sizeof texts[0]; i++) {
        fm_volume *volume = NULL;
        io_store(io_path("a.raw"), X64, 64);
        io_store(io_path("a.raw.txt"), texts[i], strlen(texts[i]));
        if (!CHECK_FAILS(fm_file_read(NULL, io_path("a.raw"), NULL, &volume, NULL), FM_ERROR_FORMAT)) {
            fprintf(stderr, "    sidecar %zu\n", i);
        }
        fm_volume_destroy(volume);
    }
    // The caller's layout comes before the sidecar.
    const fm_read_desc desc = {.shape = {2, 3, 5}, .type = FM_TYPE_U16, .offset = 4, .big_endian = true};
    fm_volume *volume = NULL;
    if (CHECK_OK(fm_file_read(NULL, io_path("a.raw"), &desc, &volume, NULL))) {
        const uint16_t *data = fm_volume_data(volume);
        CHECK(data[0] == ('4' << 8 | '5') && data[29] == ('2' << 8 | '3'));
    }
    fm_volume_destroy(volume);
    io_clear();
}

static void arguments(void) {
    fm_volume *volume = NULL;
    fm_file_info info;
    CHECK_FAILS(fm_file_read(NULL, NULL, NULL, &volume, NULL), FM_ERROR_INVALID_ARGUMENT);
    CHECK_FAILS(fm_file_read(NULL, "x", NULL, NULL, NULL), FM_ERROR_INVALID_ARGUMENT);
    CHECK_FAILS(fm_file_probe("-", NULL, &info), FM_ERROR_INVALID_ARGUMENT);
    CHECK_FAILS(fm_file_read(NULL, io_path("nothing.npy"), NULL, &volume, NULL), FM_ERROR_IO);
    CHECK_FAILS(fm_file_read(NULL, io_directory, NULL, &volume, NULL), FM_ERROR_IO);
    const fm_read_desc unknown = {.format = (fm_format)99};
    io_store(io_path("x.npy"), "x", 1);
    CHECK_FAILS(fm_file_read(NULL, io_path("x.npy"), &unknown, &volume, NULL), FM_ERROR_INVALID_ARGUMENT);
    const fm_read_desc other = {.format = FM_FORMAT_VOX};
    CHECK_FAILS(fm_file_read(NULL, io_path("x.npy"), &other, &volume, NULL), FM_ERROR_FORMAT);
    fm_volume *written = io_volume(NULL, (fm_shape){4, 4, 4}, FM_TYPE_F32, 1);
    CHECK_FAILS(fm_file_write(io_path("x.xyz"), written, NULL), FM_ERROR_INVALID_ARGUMENT);
    CHECK_FAILS(fm_file_write("", written, NULL), FM_ERROR_INVALID_ARGUMENT);
    CHECK_FAILS(fm_file_write(io_path("x.bt"), written, NULL), FM_ERROR_UNSUPPORTED);
    CHECK_FAILS(fm_file_write(io_path("x.vox"), written, NULL), FM_ERROR_UNSUPPORTED);
    fm_volume_destroy(written);
    written = io_volume(NULL, (fm_shape){32768, 1, 1}, FM_TYPE_U8, 1);
    CHECK_FAILS(fm_file_write(io_path("x.nii"), written, NULL), FM_ERROR_UNSUPPORTED);
    fm_volume_destroy(written);
    unlink(io_path("x.npy"));
    CHECK(io_file_count() == 0);
}

int main(void) {
    if (!io_begin()) {
        return check_summary();
    }
    for (size_t i = 0; i < sizeof rows / sizeof rows[0]; i++) {
        check_row(&rows[i]);
    }
    static const char *const names[] = {"a.npy", "a.npy.gz", "a.nrrd", "a.nii", "a.nii.gz", "a.vox"};
    for (size_t i = 0; i < sizeof names / sizeof names[0]; i++) {
        cut_and_flip(names[i], FM_TYPE_U8);
    }
    sidecars();
    arguments();
    return io_end();
}
