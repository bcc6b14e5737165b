// SPDX-License-Identifier: MIT

// glTF: containers, buffers, types of numbers, primitives and transforms. Every document below is the same tetrahedron.

#include "io_common.h"
#include "mesh_io_common.h"

static const float corners[4][3] = {{0, 0, 0}, {1, 0, 0}, {0, 2, 0}, {0, 0, -3.5f}};
static const uint32_t faces[4][3] = {{0, 1, 2}, {0, 2, 3}, {0, 3, 1}, {1, 3, 2}};

// What the buffer holds, at the offsets that `tail` names.
typedef struct content {
    float positions[4][3];   // view 0
    uint32_t words[12];      // view 1
    uint16_t halves[12];     // view 2
    uint8_t small[12];       // view 3
    uint8_t strip[12];       // view 4: 10 used
    uint8_t fan[8];          // view 5: 5 used
    float soup[12][3];       // view 6
    float mirrored[4][3];    // view 7: x negated
    float moved[4][3];       // view 8: half as large, turned and shifted
    int8_t quantized[4][4];  // view 9: stride 4, twice the coordinates
    float wrong[4][3];       // view 10: the last position is to be replaced
    uint16_t third[2];       // view 11: 3
    uint8_t turned[12];      // view 12: for the mirrored ones
} content;

static const content *fill(void) {
    static content c;
    memcpy(c.positions, corners, sizeof corners);
    memcpy(c.words, faces, sizeof faces);
    for (int i = 0; i < 12; i++) {
        c.halves[i] = (uint16_t)c.words[i];
        c.small[i] = (uint8_t)c.words[i];
        c.turned[i] = (uint8_t)c.words[i / 3 * 3 + 2 - i % 3];
        memcpy(c.soup[i], corners[c.words[i]], sizeof c.soup[0]);
    }
    memcpy(c.strip, (uint8_t[]){0, 1, 2, 2, 0, 3, 0, 3, 1, 2}, 10);
    memcpy(c.fan, (uint8_t[]){0, 1, 2, 3, 1}, 5);
    for (int i = 0; i < 4; i++) {
        const float *p = corners[i];
        memcpy(c.mirrored[i], (float[]){-p[0], p[1], p[2]}, sizeof c.mirrored[0]);
        // Of the node: twice, half a turn about z, then by (1, 2, 3); of its parent: by (-1, -2, -3).
        memcpy(c.moved[i], (float[]){-p[0] / 2, -p[1] / 2, p[2] / 2}, sizeof c.moved[0]);
        for (int k = 0; k < 3; k++) {
            c.quantized[i][k] = (int8_t)(2 * p[k]);
        }
    }
    memcpy(c.wrong, corners, 3 * sizeof corners[0]);
    c.wrong[3][0] = 77;
    c.third[0] = 3;
    return &c;
}

#define VIEW(member) "{\"buffer\":0,\"byteOffset\":%zu,\"byteLength\":%zu}"
#define AT(member) offsetof(content, member), sizeof((content *)0)->member

// Views, and accessors 0 to 10 over views 0 to 10, 11 over a part of view 3, 12 over view 12. `buffer` is how the buffer is
// described.
static void tail(char *text, size_t size, const char *buffer) {
    snprintf(
        text, size,
        "\"bufferViews\":[" VIEW(0) "," VIEW(1) "," VIEW(2) "," VIEW(3) "," VIEW(4) "," VIEW(5) "," VIEW(6) "," VIEW(7) "," VIEW(
            8) ",{\"buffer\":0,\"byteOffset\":%zu,\"byteLength\":%zu,\"byteStride\":4}"
               "," VIEW(10) "," VIEW(11) "," VIEW(12) "],\"accessors\":["
                                                      "{\"bufferView\":0,\"componentType\":5126,"
                                                      "\"count\":4,\"type\":\"VEC3\"},"
                                                      "{\"bufferView\":1,\"componentType\":5125,"
                                                      "\"count\":12,\"type\":\"SCALAR\"},"
                                                      "{\"bufferView\":2,\"componentType\":5123,"
                                                      "\"count\":12,\"type\":\"SCALAR\"},"
                                                      "{\"bufferView\":3,\"componentType\":5121,"
                                                      "\"count\":12,\"type\":\"SCALAR\"},"
                                                      "{\"bufferView\":4,\"componentType\":5121,"
                                                      "\"count\":10,\"type\":\"SCALAR\"},"
                                                      "{\"bufferView\":5,\"componentType\":5121,"
                                                      "\"count\":5,\"type\":\"SCALAR\"},"
                                                      "{\"bufferView\":6,\"componentType\":5126,"
                                                      "\"count\":12,\"type\":\"VEC3\"},"
                                                      "{\"bufferView\":7,\"componentType\":5126,"
                                                      "\"count\":4,\"type\":\"VEC3\"},"
                                                      "{\"bufferView\":8,\"componentType\":5126,"
                                                      "\"count\":4,\"type\":\"VEC3\"},"
                                                      "{\"bufferView\":9,\"componentType\":5120,"
                                                      "\"count\":4,\"type\":\"VEC3\"},"
                                                      "{\"bufferView\":10,\"componentType\":5126,"
                                                      "\"count\":4,\"type\":\"VEC3\",\"sparse\":{"
                                                      "\"count\":1,\"indices\":"
                                                      "{\"bufferView\":11,\"componentType\":5123},"
                                                      "\"values\":{\"bufferView\":0,\"byteOffset\":36}}"
                                                      "},"
                                                      "{\"bufferView\":3,\"byteOffset\":9,"
                                                      "\"componentType\":5121,\"count\":3,\"type\":"
                                                      "\"SCALAR\"},"
                                                      "{\"bufferView\":12,\"componentType\":5121,\"count\":12,\"type\":\"SCALAR\"}"
                                                      "],\"buffers\":[{\"byteLength\":%zu%s}]}",
        AT(positions), AT(words), AT(halves), AT(small), AT(strip), AT(fan), AT(soup), AT(mirrored), AT(moved), AT(quantized),
        AT(wrong), AT(third), AT(turned), sizeof(content), buffer);
}

#define ASSET "{\"asset\":{\"version\":\"2.0\"},"
#define ONE(primitives)                                                                                                            \
    ASSET "\"scene\":0,\"scenes\":[{\"nodes\":[0]}],\"nodes\":[{\"mesh\":0}],\"meshes\":[{\"primitives\":[" primitives "]}],"
#define POSITION(number) "{\"attributes\":{\"NORMAL\":0,\"POSITION\":" number "}"

static const struct {
    const char *what, *head;
    uint64_t vertices;
    const char *note;
} documents[] = {
    {"words", ONE(POSITION("0") ",\"indices\":1}"), 4, ""},
    {"halves", ONE(POSITION("0") ",\"indices\":2,\"mode\":4}"), 4, ""},
    {"bytes", ONE(POSITION("0") ",\"indices\":3}"), 4, ""},
    {"strip", ONE(POSITION("0") ",\"indices\":4,\"mode\":5}"), 4, ""},
    {"fan", ONE(POSITION("0") ",\"indices\":5,\"mode\":6}," POSITION("0") ",\"indices\":11}"), 4, ""},
    {"soup", ONE(POSITION("6") "}"), 12, ""},
    {"sparse", ONE(POSITION("10") ",\"indices\":3}"), 4, ""},
    {"lines", ONE(POSITION("0") ",\"mode\":1}," POSITION("0") ",\"indices\":3}"), 4, "1 primitives"},
    {"mirror",
     ASSET "\"nodes\":[{\"mesh\":0,\"scale\":[-1,1,1]}],\"meshes\":[{\"primitives\":[" POSITION("7") ",\"indices\":12}]}],", 4, ""},
    {"moved",
     ASSET "\"scenes\":[{\"nodes\":[1]}],\"nodes\":[{\"mesh\":0,\"scale\":[2,2,2],\"rotation\":[0,0,1,0],\"translation\":[1,2,3]},"
           "{\"children\":[0],\"matrix\":[1,0,0,0,0,1,0,0,0,0,1,0,-1,-2,-3,1]}],\"meshes\":[{\"primitives\":[" POSITION(
               "8") ",\"indices\":3}]}],",
     4, ""},
    {"quantized",
     ASSET "\"extensionsRequired\":[\"KHR_mesh_quantization\"],\"nodes\":[{\"mesh\":0,\"scale\":[0.5,0.5,0.5]}],\"meshes\":[{"
           "\"primitives\":[" POSITION("9") ",\"indices\":3}]}],",
     4, ""},
};

// The same places, the same way round; any corner may come first, and -0 is 0.
static bool is_tetrahedron(const fm_mesh *mesh) {
    const float(*vertices)[3];
    const uint32_t(*triangles)[3];
    uint64_t count;
    fm_mesh_arrays(mesh, &vertices, NULL, &triangles, &count);
    bool good = count == 4;
    for (int i = 0; i < 4 && good; i++) {
        bool same = false;
        for (int turn = 0; turn < 3; turn++) {
            bool all = true;
            for (int k = 0; k < 3; k++) {
                for (int axis = 0; axis < 3; axis++) {
                    all = all && vertices[triangles[i][(k + turn) % 3]][axis] == corners[faces[i][k]][axis];
                }
            }
            same = same || all;
        }
        good = same;
    }
    return good;
}

static void check_document(fm_context *context, size_t i, const char *path, bool binary) {
    fm_mesh *mesh = NULL;
    fm_mesh_file_info info;
    bool good = CHECK_OK(fm_mesh_read(context, path, NULL, &mesh, &info));
    good = good && CHECK(info.format == FM_MESH_FORMAT_GLTF && info.binary == binary && info.vertices == documents[i].vertices) &&
           CHECK(documents[i].note[0] ? strstr(info.note, documents[i].note) != NULL : info.note[0] == 0) &&
           CHECK(is_tetrahedron(mesh));
    if (!good) {
        fprintf(stderr, "    %s, %s\n", documents[i].what, path);
    }
    fm_mesh_destroy(mesh);
}

static void put_u32(uint8_t *at, uint32_t value) {
    for (int i = 0; i < 4; i++) {
        at[i] = (uint8_t)(value >> 8 * i);
    }
}

// Returns the size; bytes of any other chunk may follow.
static size_t make_glb(uint8_t *file, const char *json, bool other) {
    const size_t length = strlen(json), padded = (length + 3) / 4 * 4;
    memcpy(file, "glTF", 4);
    put_u32(file + 4, 2);
    put_u32(file + 12, (uint32_t)padded);
    memcpy(file + 16, "JSON", 4);
    memset(file + 20, ' ', padded);
    memcpy(file + 20, json, length);
    uint8_t *at = file + 20 + padded;
    put_u32(at, sizeof(content));
    memcpy(at + 4, "BIN", 4);
    memcpy(at + 8, fill(), sizeof(content));
    at += 8 + sizeof(content);
    if (other) {
        memcpy(at, "\4\0\0\0ABCDefgh", 12);
        at += 12;
    }
    put_u32(file + 8, (uint32_t)(at - file));
    return (size_t)(at - file);
}

static void write_base64(const uint8_t *data, size_t size, char *text) {
    static const char digits[] = "ABCDEFGHIJKLMNOPQRSTUVWXYZabcdefghijklmnopqrstuvwxyz0123456789+/";
    for (size_t i = 0; i < size; i += 3) {
        const uint32_t bits =
            (uint32_t)data[i] << 16 | (uint32_t)(i + 1 < size ? data[i + 1] : 0) << 8 | (i + 2 < size ? data[i + 2] : 0u);
        for (int k = 0; k < 4; k++) {
            *text++ = i + (size_t)k > size ? '=' : digits[bits >> (18 - 6 * k) & 63];
        }
    }
    *text = 0;
}

int main(void) {
    static char buffer[8192], json[16384], rest[12288];
    static uint8_t file[32768];
    fm_context *context = NULL;
    const fm_context_desc desc = {.backend = FM_BACKEND_CPU, .threads = 1};
    if (!io_begin() || !CHECK_OK(fm_context_create(&desc, &context))) {
        return check_summary();
    }
    mkdir(io_path("sub dir"), 0777);
    io_store(io_path("sub dir/a b.bin"), fill(), sizeof(content));
    for (size_t i = 0; i < sizeof documents / sizeof documents[0]; i++) {
        const char *path = io_path("d.glb");
        unlink(path);
        tail(rest, sizeof rest, "");
        snprintf(json, sizeof json, "%s%s", documents[i].head, rest);
        const size_t size = make_glb(file, json, i % 2);
        io_store(path, file, size);
        check_document(context, i, path, true);
        // Cut anywhere it is an error.
        for (size_t cut = 1; i == 0 && cut < size; cut += 37) {
            fm_mesh *mesh = NULL;
            unlink(path);
            io_store(path, file, cut);
            CHECK_FAILS(fm_mesh_read(context, path, NULL, &mesh, NULL), FM_ERROR_FORMAT);
            fm_mesh_destroy(mesh);
        }
        path = io_path("d.gltf");
        unlink(path);
        tail(rest, sizeof rest, ",\"uri\":\"./sub%20dir/a b.bin\"");
        snprintf(json, sizeof json, "\xef\xbb\xbf\n%s%s", documents[i].head, rest);
        io_store(path, json, strlen(json));
        check_document(context, i, path, false);
        memcpy(buffer, ",\"uri\":\"data:application/gltf-buffer;base64,", 44);
        write_base64((const uint8_t *)fill(), sizeof(content), buffer + 44);
        strcat(buffer, "\"");
        tail(rest, sizeof rest, buffer);
        snprintf(json, sizeof json, "%s%s", documents[i].head, rest);
        unlink(path);
        io_store(path, json, strlen(json));
        check_document(context, i, path, false);
    }
    unlink(io_path("sub dir/a b.bin"));
    rmdir(io_path("sub dir"));
    fm_context_destroy(context);
    return io_end();
}
