// SPDX-License-Identifier: MIT

// Mesh files that are damaged, hostile or not what they seem: each fails with a message that names the file and says why, and
// leaves nothing behind. And what fails around a file: memory, cancelled calls, formats.

#include "faulty.h"
#include "mesh_io_common.h"

#define TEXT(string) string, sizeof(string) - 1
#define PLY_HEAD                                                                                                                   \
    "ply\nformat ascii 1.0\nelement vertex 3\nproperty float x\nproperty float y\nproperty float z\nelement face 1\nproperty "     \
    "list "                                                                                                                        \
    "uchar int vertex_indices\nend_header\n"
#define PLY_BINARY "ply\nformat binary_little_endian 1.0\n"
#define XYZ "property float x\nproperty float y\nproperty float z\n"
#define GLTF "{\"asset\":{\"version\":\"2.0\"},"
#define TRIANGLE "solid\nfacet normal 0 0 0\nouter loop\nvertex 0 0 0\nvertex 1 0 0\nvertex 0 1 0\n"

static const struct {
    const char *name, *text;
    size_t size;
    fm_result result;
    const char *word;  // of the message
} rows[] = {
    {"empty.ply", TEXT(""), FM_ERROR_FORMAT, "is empty"},
    {"what.dat", TEXT("hello"), FM_ERROR_FORMAT, "no known mesh format"},
    {"other.ply", TEXT("v 0 0 0\n"), FM_ERROR_FORMAT, "is no PLY file"},
    {"head.ply", TEXT("ply\nformat ascii 1.0\n"), FM_ERROR_FORMAT, "ends within the header"},
    {"form.ply", TEXT("ply\nformat octal 1.0\nend_header\n"), FM_ERROR_FORMAT, "not understood"},
    {"none.ply", TEXT("ply\nend_header\n"), FM_ERROR_FORMAT, "lacks the header line"},
    {"word.ply", TEXT("ply\nformat ascii 1.0\nwhat 1\nend_header\n"), FM_ERROR_FORMAT, "\"what 1\""},
    {"type.ply", TEXT("ply\nformat ascii 1.0\nelement vertex 1\nproperty long x\nend_header\n"), FM_ERROR_FORMAT,
     "property long x"},
    {"list.ply", TEXT("ply\nformat ascii 1.0\nelement a 1\nproperty list float int x\nend_header\n"), FM_ERROR_FORMAT,
     "list float"},
    {"prop.ply", TEXT("ply\nformat ascii 1.0\nproperty int x\nend_header\n"), FM_ERROR_FORMAT, "property int x"},
    {"minus.ply", TEXT("ply\nformat ascii 1.0\nelement vertex -1\nend_header\n"), FM_ERROR_FORMAT, "element vertex -1"},
    {"huge.ply", TEXT("ply\nformat ascii 1.0\nelement vertex 99999999999999999999\nend_header\n"), FM_ERROR_FORMAT,
     "element vertex 9"},
    {"twice.ply", TEXT("ply\nformat ascii 1.0\nelement vertex 0\n" XYZ "element vertex 0\n" XYZ "end_header\n"), FM_ERROR_FORMAT,
     "twice"},
    {"flat.ply", TEXT("ply\nformat ascii 1.0\nelement vertex 1\nproperty float x\nproperty float y\nend_header\n1 2\n"),
     FM_ERROR_FORMAT, "without \"z\""},
    {"same.ply", TEXT("ply\nformat ascii 1.0\nelement vertex 1\n" XYZ "property int x\nend_header\n1 2 3 4\n"), FM_ERROR_FORMAT,
     "twice"},
    {"corner.ply", TEXT(PLY_HEAD "0 0 0 1 0 0 0 1 0 3 0 1 3\n"), FM_ERROR_FORMAT, "vertex 3 in face 0"},
    {"below.ply", TEXT(PLY_HEAD "0 0 0 1 0 0 0 1 0 3 0 1 -1\n"), FM_ERROR_FORMAT, "vertex -1 in face 0"},
    {"half.ply",
     TEXT(PLY_BINARY "element vertex 3\nproperty uchar x\nproperty uchar y\nproperty uchar z\nelement face 1\n"
                     "property list uchar float vertex_indices\nend_header\n"
                     "\0\0\0\1\0\0\0\1\0\3\0\0\0\0\0\0\x80\x3f\0\0\xc0\x3f"),
     FM_ERROR_FORMAT, "1.5 in row 0"},
    {"short.ply", TEXT(PLY_HEAD "0 0 0 1 0 0 0 1 0 3 0 1"), FM_ERROR_FORMAT, "ends within face 0"},
    {"shorter.ply", TEXT(PLY_HEAD "0 0 0 1 0 0 0 1"), FM_ERROR_FORMAT, "header wrong"},
    {"letter.ply", TEXT(PLY_HEAD "0 0 0 1 0 b 0 1 0 3 0 1 2 "), FM_ERROR_FORMAT, "\"b\" in vertex 1"},
    {"comma.ply", TEXT(PLY_HEAD "0 0 0 1 0 0,5 0 1 0 3 0 1 2 "), FM_ERROR_FORMAT, "\"0,5\" in vertex 1"},
    {"count.ply", TEXT(PLY_HEAD "0 0 0 1 0 0 0 1 0 -3 0 1 2 "), FM_ERROR_FORMAT, "list of -3"},
    {"billion.ply",
     TEXT(PLY_BINARY "element vertex 3\n" XYZ "element face 1000000000\nproperty list uchar int vertex_indices\nend_header\n"),
     FM_ERROR_FORMAT, "header wrong"},
    {"more.ply", TEXT(PLY_BINARY "element vertex 900000000000000000\n" XYZ "end_header\n"), FM_ERROR_FORMAT, "header wrong"},
    {"most.ply",
     TEXT(PLY_BINARY "element vertex 900000000000000000\n" XYZ "element a 900000000000000000\n" XYZ
                     "element b 900000000000000000\n" XYZ "end_header\n"),
     FM_ERROR_FORMAT, "more than any file"},
    {"length.ply",
     TEXT(PLY_BINARY "element vertex 1\n" XYZ "element face 1\nproperty list uint int vertex_indices\nend_header\n"
                     "0000000000000000\xff\xff\xff\xff"),
     FM_ERROR_FORMAT, "vertex -1 in face 0"},
    {"lists.ply",
     TEXT(PLY_BINARY "element vertex 0\n" XYZ "element a 1\nproperty list uint int b\nend_header\n\xff\xff\xff\xff\0\0\0\0"),
     FM_ERROR_FORMAT, "truncated"},
    {"index.obj", TEXT("v 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 3\n\nf 1 2 4\n"), FM_ERROR_FORMAT, "line 6: a face names vertex 4"},
    {"zero.obj", TEXT("v 0 0 0\nf 0 1 1\n"), FM_ERROR_FORMAT, "line 2: a face names vertex 0"},
    {"minus.obj", TEXT("v 0 0 0\nf 1 \\\n 1 -2\n"), FM_ERROR_FORMAT, "line 2: a face names vertex -2"},
    {"large.obj", TEXT("v 0 0 0\nf 1 1 99999999999\n"), FM_ERROR_FORMAT, "vertex 99999999999"},
    {"larger.obj", TEXT("v 0 0 0\nf 1 1 99999999999999999999\n"), FM_ERROR_FORMAT, "line 2: a corner"},
    {"two.obj", TEXT("v 0 0 0\nv 1 2\n3\n"), FM_ERROR_FORMAT, "line 2: a vertex is not three numbers"},
    {"bad.obj", TEXT("v 0 0 x\n"), FM_ERROR_FORMAT, "line 1: a vertex"},
    {"slash.obj", TEXT("v 0 0 0\nf 1/1/1/1 1 1\n"), FM_ERROR_FORMAT, "line 2: a corner"},
    {"bytes.obj", TEXT("\0\1\2\3"), FM_ERROR_FORMAT, "line 1: a byte"},
    {"text.obj", TEXT("once upon a time\nthere was\n"), FM_ERROR_FORMAT, "2 lines of no known statement"},
    {"short.stl", TEXT("solid"), FM_ERROR_FORMAT, "neither the text"},
    {"cut.stl", TEXT(TRIANGLE), FM_ERROR_FORMAT, "ends without \"endsolid\": it is truncated in line 7"},
    {"vertex.stl", TEXT("solid\nfacet normal 0 0 0\nouter loop\nvertex 0 0"), FM_ERROR_FORMAT, "ends within a vertex in line 4"},
    {"number.stl", TEXT("solid\nfacet normal 0 0 0\nouter loop\nvertex 0 0 zero"), FM_ERROR_FORMAT, "not three numbers in line 4"},
    {"order.stl", TEXT("solid\nfacet normal 0 0 0\nvertex 0 0 0\n"), FM_ERROR_FORMAT, "\"outer loop\""},
    {"loop.stl", TEXT(TRIANGLE "outer\n"), FM_ERROR_FORMAT, "\"endloop\""},
    {"after.stl", TEXT("solid\nendsolid\nfacet\n"), FM_ERROR_FORMAT, "where \"solid\" is wanted"},
    {"in.stl", TEXT("solid\nendsolid\nsolid\nvertex\n"), FM_ERROR_FORMAT, "\"facet\" or \"endsolid\""},
    {"json.gltf", TEXT("{\"asset\": {\"version\""), FM_ERROR_FORMAT, "not valid JSON"},
    {"asset.gltf", TEXT("{\"meshes\": []}"), FM_ERROR_FORMAT, "no \"asset\""},
    {"one.gltf", TEXT("{\"asset\": {\"version\": \"1.0\"}}"), FM_ERROR_UNSUPPORTED, "is glTF 1.0"},
    {"draco.gltf", TEXT(GLTF "\"extensionsRequired\": [\"KHR_draco_mesh_compression\"]}"), FM_ERROR_UNSUPPORTED, "KHR_draco"},
    {"list.gltf", TEXT(GLTF "\"nodes\": 3}"), FM_ERROR_FORMAT, "\"nodes\" that is no list"},
    {"scene.gltf", TEXT(GLTF "\"scene\": 1, \"scenes\": [{}]}"), FM_ERROR_FORMAT, "scene that is not there, 1"},
    {"node.gltf", TEXT(GLTF "\"scenes\": [{\"nodes\": [1e30]}]}"), FM_ERROR_FORMAT, "names node 1e+30"},
    {"circle.gltf", TEXT(GLTF "\"scenes\": [{\"nodes\": [0]}], \"nodes\": [{\"children\": [1]}, {\"children\": [0]}]}"),
     FM_ERROR_FORMAT, "places twice node 0"},
    {"matrix.gltf", TEXT(GLTF "\"nodes\": [{\"matrix\": [1, 0]}]}"), FM_ERROR_FORMAT, "bad number in node 0"},
    {"mesh.gltf", TEXT(GLTF "\"nodes\": [{\"mesh\": 7}]}"), FM_ERROR_FORMAT, "mesh that is not there, 7"},
    {"accessor.gltf",
     TEXT(GLTF "\"nodes\": [{\"mesh\": 0}], \"meshes\": [{\"primitives\": [{\"attributes\": {\"POSITION\": 2}}]}]}"),
     FM_ERROR_FORMAT, "accessor that is not there, 2"},
    {"outside.gltf",
     TEXT(GLTF
          "\"nodes\": [{\"mesh\": 0}], \"meshes\": [{\"primitives\": [{\"attributes\": {\"POSITION\": 0}}]}], \"accessors\": "
          "[{\"bufferView\": 0, \"componentType\": 5126, \"count\": 3, \"type\": \"VEC3\"}], \"bufferViews\": [{\"buffer\": 0, "
          "\"byteLength\": 36}], \"buffers\": [{\"byteLength\": 36, \"uri\": \"a/%2e%2e/../secret\"}]}"),
     FM_ERROR_UNSUPPORTED, "own folder"},
    {"missing.gltf",
     TEXT(GLTF
          "\"nodes\": [{\"mesh\": 0}], \"meshes\": [{\"primitives\": [{\"attributes\": {\"POSITION\": 0}}]}], \"accessors\": "
          "[{\"bufferView\": 0, \"componentType\": 5126, \"count\": 3, \"type\": \"VEC3\"}], \"bufferViews\": [{\"buffer\": 0, "
          "\"byteLength\": 36}], \"buffers\": [{\"byteLength\": 36, \"uri\": \"not%20there.bin\"}]}"),
     FM_ERROR_IO, "not there.bin"},
    {"few.gltf",
     TEXT(GLTF "\"nodes\": [{\"mesh\": 0}], \"meshes\": [{\"primitives\": [{\"attributes\": {\"POSITION\": 0}}]}], \"accessors\": "
               "[{\"bufferView\": 0, \"componentType\": 5126, \"count\": 1000000000, \"type\": \"VEC3\"}], \"bufferViews\": "
               "[{\"buffer\": 0, \"byteLength\": 3}], \"buffers\": [{\"byteLength\": 3, \"uri\": "
               "\"data:application/octet-stream;base64,AAAA\"}]}"),
     FM_ERROR_FORMAT, "fewer bytes than are asked of buffer view 0"},
    {"uri.gltf",
     TEXT(GLTF "\"nodes\": [{\"mesh\": 0}], \"meshes\": [{\"primitives\": [{\"attributes\": {\"POSITION\": 0}}]}], \"accessors\": "
               "[{\"bufferView\": 0, \"componentType\": 5126, \"count\": 1, \"type\": \"VEC3\"}], \"bufferViews\": "
               "[{\"buffer\": 0, \"byteLength\": 12}], \"buffers\": [{\"byteLength\": 4000000000, \"uri\": "
               "\"data:application/octet-stream;base64,AAAA\"}]}"),
     FM_ERROR_FORMAT, "too short in buffer 0"},
    {"head.glb", TEXT("glTF\2\0\0\0\0\0\0\0"), FM_ERROR_FORMAT, "truncated"},
    {"old.glb", TEXT("glTF\1\0\0\0\0\0\0\0\0\0\0\0\0\0\0\0"), FM_ERROR_UNSUPPORTED, "binary glTF 1"},
    {"chunk.glb", TEXT("glTF\2\0\0\0\0\0\0\0\0\0\0\0JSOM"), FM_ERROR_FORMAT, "chunk of JSON"},
    {"long.glb", TEXT("glTF\2\0\0\0\0\0\0\0\0\0\0\1JSON{}"), FM_ERROR_FORMAT, "its JSON needs"},
};

static void bad_files(fm_context *context) {
    for (size_t i = 0; i < sizeof rows / sizeof rows[0]; i++) {
        const char *path = io_path(rows[i].name);
        io_store(path, rows[i].text, rows[i].size);
        fm_mesh *mesh = NULL;
        bool good = CHECK_FAILS(fm_mesh_read(context, path, NULL, &mesh, NULL), rows[i].result);
        good = good && CHECK(!mesh) && CHECK(strncmp(fm_last_error(), io_directory, strlen(io_directory)) == 0) &&
               CHECK(strstr(fm_last_error(), rows[i].word) != NULL);
        if (!good) {
            fprintf(stderr, "    %s: %s\n", rows[i].name, fm_last_error());
        }
        fm_mesh_destroy(mesh);
    }
    io_clear();
}

// Headers that lie about a binary STL, and a line without end.
static void large_claims(fm_context *context) {
    static char data[6 << 20];
    fm_mesh *mesh = NULL;
    memset(data, 'x', sizeof data);
    memcpy(data + 80, "\x00\xca\x9a\x3b", 4);
    io_store(io_path("billion.stl"), data, 84 + 500);
    CHECK_FAILS(fm_mesh_read(context, io_path("billion.stl"), NULL, &mesh, NULL), FM_ERROR_FORMAT);
    CHECK(strstr(fm_last_error(), "header wrong") != NULL);
    memset(data, ' ', sizeof data);
    io_store(io_path("endless.obj"), data, sizeof data);
    CHECK_FAILS(fm_mesh_read(context, io_path("endless.obj"), NULL, &mesh, NULL), FM_ERROR_FORMAT);
    CHECK(strstr(fm_last_error(), "has a line of over") != NULL);
    memcpy(data, TRIANGLE, sizeof TRIANGLE - 1);
    memset(data + sizeof TRIANGLE - 1, '7', sizeof data - sizeof TRIANGLE + 1);
    memcpy(data + sizeof TRIANGLE - 1, "vertex ", 7);
    io_store(io_path("endless.stl"), data, sizeof data);
    CHECK_FAILS(fm_mesh_read(context, io_path("endless.stl"), NULL, &mesh, NULL), FM_ERROR_FORMAT);
    memcpy(data, PLY_HEAD, sizeof PLY_HEAD - 1);
    memset(data + sizeof PLY_HEAD - 1, '7', sizeof data - sizeof PLY_HEAD + 1);
    io_store(io_path("endless.ply"), data, sizeof data);
    CHECK_FAILS(fm_mesh_read(context, io_path("endless.ply"), NULL, &mesh, NULL), FM_ERROR_FORMAT);
    CHECK(strstr(fm_last_error(), "in vertex 0") != NULL);
    // As many faces as there is room for, but more than the limit.
    io_store(io_path("limit.obj"), TEXT("v 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 3\nf 1 3 2\n"));
    fm_mesh_read_desc desc = {.max_bytes = 59};
    CHECK_FAILS(fm_mesh_read(context, io_path("limit.obj"), &desc, &mesh, NULL), FM_ERROR_RANGE);
    CHECK(strstr(fm_last_error(), "max_bytes") != NULL && !mesh);
    desc.max_bytes = 60;
    CHECK_OK(fm_mesh_read(context, io_path("limit.obj"), &desc, &mesh, NULL));
    fm_mesh_destroy(mesh);
    io_clear();
}

// Numbers that no triangle can have are kept, and counted by fm_mesh_info.
static void wild_numbers(fm_context *context) {
    fm_mesh *mesh = NULL;
    io_store(io_path("wild.obj"),
             TEXT("v 1e30 0 0\nv 1 nan 0\nv 0 1e400 0\nv 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 4 5\nf 2 4 5\nf 3 4 5\nf 4 5 6\n"));
    fm_mesh_info info;
    if (CHECK_OK(fm_mesh_read(context, io_path("wild.obj"), NULL, &mesh, NULL)) && CHECK_OK(fm_mesh_describe(mesh, &info))) {
        CHECK(info.triangles == 4 && info.dropped == 3 && info.high[0] == 1 && info.low[0] == 0);
    }
    fm_mesh_destroy(mesh);
    io_clear();
}

// ---------------------------------------------------------------------------------------------------------------------------
// Memory, calls and cancelling
// ---------------------------------------------------------------------------------------------------------------------------

static fm_result attempt_read(fm_context *context, void *user) {
    fm_mesh *mesh = NULL;
    const fm_result result = fm_mesh_read(context, user, NULL, &mesh, NULL);
    CHECK((result == FM_OK) == (mesh != NULL));
    fm_mesh_destroy(mesh);
    return result;
}

static fm_result attempt_write(fm_context *context, void *user) {
    static const float corners[3][3] = {{0, 0, 0}, {1, 0, 0}, {0, 1, 0}};
    static const uint32_t face[1][3] = {{0, 1, 2}};
    const fm_mesh_desc desc = {corners, 3, face, 1};
    fm_mesh *mesh = NULL;
    fm_result result = fm_mesh_create(context, &desc, &mesh);
    if (result == FM_OK) {
        result = fm_mesh_write(mesh, user, NULL);
    }
    fm_mesh_destroy(mesh);
    return result;
}

static void failing_memory(void) {
    static const char *const written[] = {"a.ply", "a.ply.gz", "a.obj", "a.stl", "a.stl.gz"};
    char path[512];
    for (int i = 0; i < 5; i++) {
        snprintf(path, sizeof path, "%s", io_path(written[i]));
        exhaust(written[i], attempt_write, path, 0);
        exhaust(written[i], attempt_read, path, -1);
        io_clear();
    }
    static const struct {
        const char *name, *text;
        size_t size;
    } texts[] = {
        {"t.stl", TEXT(TRIANGLE "endloop\nendfacet\nendsolid\n")},
        {"t.ply", TEXT(PLY_HEAD "0 0 0 1 0 0 0 1 0 3 0 1 2")},
        {"t.gltf",
         TEXT(GLTF
              "\"nodes\": [{\"mesh\": 0}], \"meshes\": [{\"primitives\": [{\"attributes\": {\"POSITION\": 0}}]}], \"accessors\": "
              "[{\"bufferView\": 0, \"componentType\": 5121, \"count\": 3, \"type\": \"VEC3\", \"sparse\": {\"count\": 1, "
              "\"indices\": {\"bufferView\": 0, \"componentType\": 5121}, \"values\": {\"bufferView\": 0}}}], "
              "\"bufferViews\": [{\"buffer\": 0, \"byteLength\": 9}], \"buffers\": [{\"byteLength\": 9, \"uri\": "
              "\"data:application/octet-stream;base64,AAAAAAAAAAAA\"}]}")},
    };
    for (int i = 0; i < 3; i++) {
        snprintf(path, sizeof path, "%s", io_path(texts[i].name));
        io_store(path, texts[i].text, texts[i].size);
        exhaust(texts[i].name, attempt_read, path, -1);
    }
    io_clear();
}

typedef struct stopper {
    uint64_t calls, stop_at, last, total;
    bool falls;  // it went backwards
} stopper;

static bool stop(void *user, uint64_t done, uint64_t total) {
    stopper *s = user;
    s->falls = s->falls || done < s->last;
    s->last = done;
    s->total = total;
    return s->calls++ != s->stop_at;
}

static void progress(fm_context *context) {
    static const char *const names[] = {"p.ply", "p.obj", "p.stl", "p.ply.gz"};
    fm_mesh *mesh = mesh_io_random(context, 200000, 400000, 11), *again = NULL;
    for (int i = 0; mesh && i < 4; i++) {
        stopper s = {.stop_at = UINT64_MAX};
        fm_mesh_write_desc write = {.progress = stop, .progress_user = &s};
        CHECK_OK(fm_mesh_write(mesh, io_path(names[i]), &write));
        CHECK(s.calls > 4 && !s.falls && s.last == s.total);
        const uint64_t writes = s.calls;
        s = (stopper){.stop_at = UINT64_MAX};
        fm_mesh_read_desc read = {.progress = stop, .progress_user = &s};
        CHECK_OK(fm_mesh_read(context, io_path(names[i]), &read, &again, NULL));
        CHECK(s.calls > 2 && !s.falls && s.last == s.total && s.total > 0);
        const uint64_t reads = s.calls;
        fm_mesh_destroy(again);
        again = NULL;
        for (uint64_t at = 0; at < reads; at += reads - 1) {
            s = (stopper){.stop_at = at};
            CHECK_FAILS(fm_mesh_read(context, io_path(names[i]), &read, &again, NULL), FM_ERROR_IO);
            CHECK(!again && strcmp(fm_last_error(), "cancelled") == 0);
        }
        io_clear();
        for (uint64_t at = 0; at < writes; at += writes - 1) {
            s = (stopper){.stop_at = at};
            CHECK_FAILS(fm_mesh_write(mesh, io_path(names[i]), &write), FM_ERROR_IO);
            CHECK(io_file_count() == 0);
        }
    }
    fm_mesh_destroy(mesh);
}

static void bad_calls(fm_context *context) {
    fm_mesh *mesh = mesh_io_random(context, 3, 1, 1), *read = NULL;
    fm_mesh_read_desc wrong = {.format = (fm_mesh_format)99};
    fm_mesh_write_desc gltf = {.format = FM_MESH_FORMAT_GLTF}, unknown = {.format = (fm_mesh_format)99};
    CHECK_FAILS(fm_mesh_read(NULL, "a.ply", NULL, &read, NULL), FM_ERROR_INVALID_ARGUMENT);
    CHECK_FAILS(fm_mesh_read(context, NULL, NULL, &read, NULL), FM_ERROR_INVALID_ARGUMENT);
    CHECK_FAILS(fm_mesh_read(context, "a.ply", NULL, NULL, NULL), FM_ERROR_INVALID_ARGUMENT);
    CHECK_FAILS(fm_mesh_read(context, io_path("none.ply"), NULL, &read, NULL), FM_ERROR_IO);
    CHECK_FAILS(fm_mesh_write(NULL, "a.ply", NULL), FM_ERROR_INVALID_ARGUMENT);
    CHECK_FAILS(fm_mesh_write(mesh, NULL, NULL), FM_ERROR_INVALID_ARGUMENT);
    CHECK_FAILS(fm_mesh_write(mesh, io_path("a.txt"), NULL), FM_ERROR_INVALID_ARGUMENT);
    CHECK_FAILS(fm_mesh_write(mesh, io_path("a.ply"), &unknown), FM_ERROR_INVALID_ARGUMENT);
    CHECK_FAILS(fm_mesh_write(mesh, io_path("a.glb"), NULL), FM_ERROR_UNSUPPORTED);
    CHECK_FAILS(fm_mesh_write(mesh, io_path("a.ply"), &gltf), FM_ERROR_UNSUPPORTED);
    CHECK_FAILS(fm_mesh_write(mesh, io_path("no/such/a.ply"), NULL), FM_ERROR_IO);
    CHECK(io_file_count() == 0);
    CHECK_OK(fm_mesh_write(mesh, io_path("a.ply"), NULL));
    CHECK_FAILS(fm_mesh_read(context, io_path("a.ply"), &wrong, &read, NULL), FM_ERROR_INVALID_ARGUMENT);
    CHECK(fm_mesh_format_of("-") == FM_MESH_FORMAT_AUTO && fm_mesh_format_of(io_path("none.ply")) == FM_MESH_FORMAT_AUTO);
    CHECK(strcmp(fm_mesh_format_name(FM_MESH_FORMAT_GLTF), "glTF") == 0 && fm_mesh_format_name((fm_mesh_format)99));
    // Files of a batch appear together.
    fm_file_batch *batch = NULL;
    CHECK_OK(fm_file_batch_create(context, &batch));
    const fm_mesh_write_desc shared = {.batch = batch};
    CHECK_OK(fm_mesh_write(mesh, io_path("b.ply"), &shared));
    CHECK_OK(fm_mesh_write(mesh, io_path("b.stl"), &shared));
    CHECK(!io_exists(io_path("b.ply")) && !io_exists(io_path("b.stl")));
    CHECK_OK(fm_file_batch_commit(batch));
    CHECK(io_exists(io_path("b.ply")) && io_exists(io_path("b.stl")));
    fm_file_batch_destroy(batch);
    fm_mesh_destroy(mesh);
    io_clear();
}

int main(void) {
    fm_context *context = NULL;
    const fm_context_desc desc = {.backend = FM_BACKEND_CPU, .threads = 1};
    if (!io_begin() || !CHECK_OK(fm_context_create(&desc, &context))) {
        return check_summary();
    }
    bad_files(context);
    large_claims(context);
    wild_numbers(context);
    failing_memory();
    progress(context);
    bad_calls(context);
    fm_context_destroy(context);
    return io_end();
}
