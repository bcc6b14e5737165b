// SPDX-License-Identifier: MIT

// Meshes in files: every form of every format, and what is written and read again.

#include "io_common.h"
#include "mesh_io_common.h"

#include <locale.h>

// ---------------------------------------------------------------------------------------------------------------------------
// Forms
// ---------------------------------------------------------------------------------------------------------------------------

// A tetrahedron: what all the files below hold. Its triangles in this order, each from any corner on.
static const float corners[4][3] = {{0, 0, 0}, {1, 0, 0}, {0, 2, 0}, {0, 0, -3.5f}};
static const uint32_t faces[4][3] = {{0, 1, 2}, {0, 2, 3}, {0, 3, 1}, {1, 3, 2}};

#define TEXT(string) string, sizeof(string) - 1

static const struct {
    const char *name, *text;
    size_t size;
    uint64_t vertices, triangles;
    const char *note;  // a part of it; "" for none
} forms[] = {
    {"plain.obj", TEXT("v 0 0 0\nv 1 0 0\nv 0 2 0\nv 0 0 -3.5\nf 1 2 3\nf 1 3 4\nf 1 4 2\nf 2 4 3\n"), 4, 4, ""},
    {"all.obj",
     TEXT("# x\r\nmtllib a.mtl\r\no thing\r\nv 0 0 0 1\r\nv 1 0 0 .5 .5 .5\r\n  v\t0 2e0 0 # remark\r\nvt 0 0\r\nvn 0 0 1\r\n"
          "f -3/1/1 -2/1/1 3/1/1\r\ng side\r\nusemtl none\r\ns off\r\nf 1//1 3//1 \\\r\n 4//1\r\nv 0 0 -35e-1\r\n"
          "f 1/1 -1/1 2/1\r\n\r\nl 1 2\r\nf 2 4 3"),
     4, 4, ""},
    {"polygon.obj", TEXT("v 0 0 0\nv 1 0 0\nv 1 1 0\nv 0 1 0\nv -1 .5 0\nf 1 2 3 4 5\nf 1 2\nf 3\nf\nfoo 1\n"), 5, 3,
     "1 lines of no known statement are set aside; 3 faces of fewer"},
    {"empty.obj", TEXT("# nothing\n"), 0, 0, ""},
    {"plain.ply",
     TEXT("ply\nformat ascii 1.0\ncomment a b c\nobj_info d\nelement vertex 4\nproperty float x\nproperty float y\nproperty float "
          "z\n"
          "element face 4\nproperty list uchar int vertex_indices\nend_header\n0 0 0\n1 0 0\n0 2 0\n0 0 -3.5\n3 0 1 2\n3 0 2 3\n"
          "3 0 3 1\n3 1 3 2\n"),
     4, 4, ""},
    {"odd.ply",
     TEXT("ply\r\nformat ascii 1.0\r\nelement edge 1\r\nproperty int a\r\nproperty int b\r\nelement face 4\r\n"
          "property uchar red\r\nproperty list int uint vertex_index\r\nproperty list uchar float texcoord\r\n"
          "element vertex 4\r\nproperty double z\r\nproperty list uchar int junk\r\nproperty float32 x\r\nproperty int16 y\r\n"
          "element nothing 1000000000000\r\nend_header\r\n7 8\r\n1 3 0 1 2 0\r\n2 3 0 2 3 2 .5 .5\r\n3 3 0 3 1 0 4 3 1 3 2 0\r\n"
          "0 0 0 0\r\n0 1 9 1 0\r\n0 2 9 9 0 2\r\n-3.5 0 0 0\r\n"),
     4, 4, ""},
    {"strip.ply",
     TEXT("ply\nformat ascii 1.0\nelement vertex 4\nproperty float x\nproperty float y\nproperty float z\n"
          "element tristrips 2\nproperty list int int vertex_indices\nend_header\n0 0 0 1 0 0 0 2 0 0 0 -3.5\n"
          "8 0 1 2 2 0 3 3 -1 7 0 3 1 -1 1 3 2"),
     4, 4, ""},
    {"polygon.ply",
     TEXT(
         "ply\nformat ascii 1.0\nelement vertex 5\nproperty float x\nproperty float y\nproperty float z\n"
         "element face 3\nproperty list uchar int vertex_indices\nend_header\n0 0 0 1 0 0 1 1 0 0 1 0 -1 .5 0 5 0 1 2 3 4 2 0 1 0\n"
         "tail"),
     5, 3, "4 bytes behind the mesh are set aside; 2 faces of fewer"},
    {"points.ply",
     TEXT(
         "ply\nformat ascii 1.0\nelement vertex 1\nproperty float x\nproperty float y\nproperty float z\nend_header\n1 nan -inf\n"),
     1, 0, ""},
    {"text.stl",
     TEXT("solid a name of words\nfacet normal 0 0 1\nouter loop\nvertex 0 0 0\nvertex 1 0 0\nvertex 0 2 0\nendloop\nendfacet\n"
          "FACET NORMAL 1 0 0\r\n OUTER LOOP\r\n  VERTEX 0 0 0\r\n VERTEX 0 2 0\r\n VERTEX 0 0 -3.5\r\n ENDLOOP\r\nENDFACET\r\n"
          "endsolid a name of words\nsolid\nfacet normal 0 0 0\nouter loop\nvertex 0 0 0\nvertex 0 0 -3.5\nvertex 1 0 0\nendloop\n"
          "endfacet\nfacet normal nan nan nan outer\nouter loop\nvertex 1 0 0\nvertex 0 0 -3.5\nvertex 0 2 0\nendloop\nendfacet\n"
          "endsolid"),
     12, 4, ""},
    {"empty.stl", TEXT("solid nothing\nendsolid nothing\n"), 0, 0, ""},
    {"head.gltf", TEXT("{\"asset\": {\"version\": \"2.0\"}}"), 0, 0, ""},
};

// The same place and the same way round.
static bool same_triangle(const float (*vertices)[3], const uint32_t *triangle, const uint32_t *wanted) {
    for (int turn = 0; turn < 3; turn++) {
        bool same = true;
        for (int k = 0; k < 3; k++) {
            same = same && memcmp(vertices[triangle[(k + turn) % 3]], corners[wanted[k]], sizeof corners[0]) == 0;
        }
        if (same) {
            return true;
        }
    }
    return false;
}

static bool is_tetrahedron(const fm_mesh *mesh) {
    const float(*vertices)[3];
    const uint32_t(*triangles)[3];
    uint64_t triangle_count;
    fm_mesh_arrays(mesh, &vertices, NULL, &triangles, &triangle_count);
    bool same = triangle_count == 4;
    for (int i = 0; i < 4 && same; i++) {
        same = same_triangle(vertices, triangles[i], faces[i]);
    }
    return same;
}

static void read_forms(fm_context *context) {
    for (size_t i = 0; i < sizeof forms / sizeof forms[0]; i++) {
        const char *path = io_path(forms[i].name);
        io_store(path, forms[i].text, forms[i].size);
        fm_mesh *mesh = NULL;
        fm_mesh_file_info info;
        if (!CHECK_OK(fm_mesh_read(context, path, NULL, &mesh, &info))) {
            continue;
        }
        bool good = CHECK(info.vertices == forms[i].vertices) && CHECK(info.triangles == forms[i].triangles) &&
                    CHECK(forms[i].note[0] ? strstr(info.note, forms[i].note) != NULL : info.note[0] == 0) &&
                    CHECK(info.file_bytes == forms[i].size) && CHECK(!info.binary) && CHECK(fm_mesh_format_of(path) == info.format);
        if (good && info.triangles == 4) {
            good = CHECK(is_tetrahedron(mesh)) && CHECK(info.faces == (strcmp(forms[i].name, "strip.ply") == 0 ? 2 : 4));
        }
        if (!good) {
            fprintf(stderr, "    %s: %llu vertices, %llu triangles, note \"%s\"\n", forms[i].name,
                    (unsigned long long)info.vertices, (unsigned long long)info.triangles, info.note);
        }
        fm_mesh_destroy(mesh);
    }
    io_clear();
}

// ---------------------------------------------------------------------------------------------------------------------------
// Binary PLY of every type, order and byte order
// ---------------------------------------------------------------------------------------------------------------------------

typedef struct bytes {
    uint8_t data[4096];
    size_t size;
} bytes;

static void put_value(bytes *b, double value, int type, bool big) {
    union {
        int8_t i8;
        uint8_t u8;
        int16_t i16;
        uint16_t u16;
        int32_t i32;
        uint32_t u32;
        float f32;
        double f64;
        uint8_t bytes[8];
    } v;
    static const size_t sizes[] = {1, 1, 2, 2, 4, 4, 4, 8};
    switch (type) {
    case 0:
        v.i8 = (int8_t)value;
        break;
    case 1:
        v.u8 = (uint8_t)value;
        break;
    case 2:
        v.i16 = (int16_t)value;
        break;
    case 3:
        v.u16 = (uint16_t)value;
        break;
    case 4:
        v.i32 = (int32_t)value;
        break;
    case 5:
        v.u32 = (uint32_t)value;
        break;
    case 6:
        v.f32 = (float)value;
        break;
    default:
        v.f64 = value;
        break;
    }
    for (size_t i = 0; i < sizes[type]; i++) {
        b->data[b->size++] = v.bytes[big ? sizes[type] - 1 - i : i];
    }
}

static void put_text(bytes *b, const char *text) {
    memcpy(b->data + b->size, text, strlen(text));
    b->size += strlen(text);
}

static void binary_ply(fm_context *context, int position_type, int count_type, int index_type, bool big, int extra) {
    static const char *const types[] = {"char", "uchar", "short", "ushort", "int", "uint", "float", "double"};
    bytes b = {.size = 0};
    char head[512];
    snprintf(head, sizeof head,
             "ply\nformat binary_%s_endian 1.0\nelement vertex 4\n%sproperty %s x\nproperty %s y\nproperty %s z\n"
             "element face 4\n%sproperty list %s %s vertex_indices\n%send_header\n",
             big ? "big" : "little", extra & 1 ? "property short s\n" : "", types[position_type], types[position_type],
             types[position_type], extra & 2 ? "property double d\n" : "", types[count_type], types[index_type],
             extra & 4 ? "property list uchar ushort more\n" : "");
    put_text(&b, head);
    for (int i = 0; i < 4; i++) {
        if (extra & 1) {
            put_value(&b, 700, 2, big);
        }
        for (int k = 0; k < 3; k++) {
            put_value(&b, position_type < 6 ? fabs((double)corners[i][k]) : (double)corners[i][k], position_type, big);
        }
    }
    for (int i = 0; i < 4; i++) {
        if (extra & 2) {
            put_value(&b, 0.1, 7, big);
        }
        put_value(&b, 3, count_type, big);
        for (int k = 0; k < 3; k++) {
            put_value(&b, faces[i][k], index_type, big);
        }
        if (extra & 4) {
            put_value(&b, i, 1, big);
            for (int k = 0; k < i; k++) {
                put_value(&b, 9, 3, big);
            }
        }
    }
    const char *path = io_path("b.ply");
    unlink(path);
    io_store(path, b.data, b.size);
    fm_mesh *mesh = NULL;
    fm_mesh_file_info info;
    if (CHECK_OK(fm_mesh_read(context, path, NULL, &mesh, &info))) {
        bool good = CHECK(info.binary && info.big_endian == big && info.faces == 4 && info.vertices == 4);
        good = CHECK(position_type < 6 || is_tetrahedron(mesh)) && good;
        good = CHECK(info.triangles == 4 && info.note[0] == 0) && good;
        if (!good) {
            fprintf(stderr, "    %s", head);
        }
    }
    fm_mesh_destroy(mesh);
    // Every shorter file fails, and says so.
    for (size_t size = 0; size < b.size; size += size < b.size - 20 ? 7 : 1) {
        // Some file systems wait for the disk when a file is emptied and written again.
        unlink(path);
        io_store(path, b.data, size);
        if (!CHECK_FAILS(fm_mesh_read(context, path, NULL, &mesh, NULL), FM_ERROR_FORMAT)) {
            fprintf(stderr, "    cut to %zu of %zu bytes\n", size, b.size);
            fm_mesh_destroy(mesh);
        }
    }
}

static void binary_plys(fm_context *context) {
    for (int type = 0; type < 8; type++) {
        for (int extra = 0; extra < 8; extra++) {
            binary_ply(context, type, 1, 4, extra & 1, extra);
            binary_ply(context, 6, type % 6, 4 + extra % 2, type & 1, extra);
            binary_ply(context, 6 + extra % 2, 1, type, extra & 2, extra);
        }
    }
    io_clear();
}

// ---------------------------------------------------------------------------------------------------------------------------
// Written and read again
// ---------------------------------------------------------------------------------------------------------------------------

static bool equal_meshes(const fm_mesh *a, const fm_mesh *b, bool unshared) {
    const float(*va)[3], (*vb)[3];
    const uint32_t(*ta)[3], (*tb)[3];
    uint64_t nva, nvb, nta, ntb;
    fm_mesh_arrays(a, &va, &nva, &ta, &nta);
    fm_mesh_arrays(b, &vb, &nvb, &tb, &ntb);
    if (nta != ntb || nvb != (unshared ? 3 * nta : nva)) {
        return false;
    }
    for (uint64_t i = 0; i < nta; i++) {
        for (int k = 0; k < 3; k++) {
            if (memcmp(va[ta[i][k]], vb[tb[i][k]], 12) != 0 || (!unshared && ta[i][k] != tb[i][k])) {
                return false;
            }
        }
    }
    return unshared || nva == 0 || memcmp(va, vb, nva * 12) == 0;
}

static void roundtrip(fm_context *context, const fm_mesh *mesh, const char *name, bool compress) {
    const char *path = io_path(name);
    const fm_mesh_write_desc write = {.compress = compress};
    fm_mesh *again = NULL;
    fm_mesh_file_info info;
    if (CHECK_OK(fm_mesh_write(mesh, path, &write)) && CHECK_OK(fm_mesh_read(context, path, NULL, &again, &info))) {
        const bool good = CHECK(equal_meshes(mesh, again, strcasestr(name, ".stl") != NULL)) && CHECK(info.note[0] == 0) &&
                          CHECK(info.compressed == (compress || strstr(name, ".gz") != NULL));
        if (!good) {
            fprintf(stderr, "    %s: %s\n", name, info.note);
        }
    }
    fm_mesh_destroy(again);
}

static void roundtrips(fm_context *context) {
    static const char *const names[] = {"a.ply", "a.obj", "a.stl", "a.ply.gz", "a.OBJ.gz", "a.Stl.gz"};
    // Enough that files go through their buffers several times.
    static const uint32_t sizes[] = {0, 3, 100, 90000};
    for (int s = 0; s < 4; s++) {
        fm_mesh *mesh = mesh_io_random(context, sizes[s], 2 * sizes[s], 3);
        for (int i = 0; mesh && i < 6; i++) {
            if (sizes[s] <= 100 || i < 4) {
                roundtrip(context, mesh, names[i], i == 0 && s == 2);
            }
        }
        fm_mesh_destroy(mesh);
    }
    io_clear();
}

// Normals look outwards and have unit length; a binary file may begin with "solid".
static void stl_details(fm_context *context) {
    const fm_mesh_desc desc = {corners, 4, faces, 4};
    fm_mesh *mesh = NULL, *again = NULL;
    CHECK_OK(fm_mesh_create(context, &desc, &mesh));
    CHECK_OK(fm_mesh_write(mesh, io_path("n.stl"), NULL));
    size_t size = 0;
    uint8_t *data = io_contents(io_path("n.stl"), &size);
    if (CHECK(data && size == 84 + 4 * 50)) {
        float normal[3];
        memcpy(normal, data + 84, sizeof normal);
        CHECK(normal[0] == 0 && normal[1] == 0 && normal[2] == 1);
        memcpy(data, "solid x\nfacet ", 14);
        io_store(io_path("s.stl"), data, size);
        fm_mesh_file_info info;
        CHECK_OK(fm_mesh_read(context, io_path("s.stl"), NULL, &again, &info));
        CHECK(again && info.binary && is_tetrahedron(again));
        fm_mesh_destroy(again);
        again = NULL;
        memcpy(data, "solid name that no line ends", 28);
        data = realloc(data, size + 3);
        memcpy(data + size, "end", 3);
        io_store(io_path("t.stl"), data, size + 3);
        CHECK_OK(fm_mesh_read(context, io_path("t.stl"), NULL, &again, &info));
        CHECK(again && info.binary && strstr(info.note, "3 bytes behind"));
        fm_mesh_destroy(again);
    }
    free(data);
    fm_mesh_destroy(mesh);
    io_clear();
}

// A decimal comma of the program's changes nothing.
static void decimal_comma(fm_context *context) {
    static const char *const locales[] = {"de_DE.UTF-8", "de_DE.utf8", "fr_FR.UTF-8"};
    for (int i = 0; i < 3; i++) {
        if (setlocale(LC_ALL, locales[i])) {
            read_forms(context);
            roundtrips(context);
            setlocale(LC_ALL, "C");
            return;
        }
    }
}

int main(void) {
    fm_context *context = NULL;
    const fm_context_desc desc = {.backend = FM_BACKEND_CPU, .threads = 1};
    if (!io_begin() || !CHECK_OK(fm_context_create(&desc, &context))) {
        return check_summary();
    }
    read_forms(context);
    binary_plys(context);
    roundtrips(context);
    stl_details(context);
    decimal_comma(context);
    fm_context_destroy(context);
    return io_end();
}
