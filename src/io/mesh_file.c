// SPDX-License-Identifier: MIT
#include "io/mesh_file.h"

#include "io/file.h"
#include "mesh/mesh.h"

#include <string.h>
#include <strings.h>

static const fm_mesh_codec *const codecs[] = {&fm_mesh_codec_ply, &fm_mesh_codec_obj, &fm_mesh_codec_stl, &fm_mesh_codec_gltf};
enum { CODEC_COUNT = sizeof codecs / sizeof codecs[0], VERTEX_BYTES = 12, TRIANGLE_BYTES = 12 };

static const uint64_t MOST_VERTICES = UINT32_MAX;
static const uint64_t MOST_TRIANGLES = (UINT64_C(1) << 31) - 1;

static const fm_mesh_codec *codec_of(fm_mesh_format format) {
    for (int i = 0; i < CODEC_COUNT; i++) {
        if (codecs[i]->format == format) {
            return codecs[i];
        }
    }
    return NULL;
}

const char *fm_mesh_format_name(fm_mesh_format format) {
    const fm_mesh_codec *codec = codec_of(format);
    return codec ? codec->name : format == FM_MESH_FORMAT_AUTO ? "auto" : "unknown format";
}

// By the name, a .gz at its end aside.
static const fm_mesh_codec *codec_by_name(const char *name) {
    const size_t length = strlen(name) - (fm_name_ends(name, ".gz") ? 3 : 0);
    for (int i = 0; i < CODEC_COUNT; i++) {
        for (const char *const *extension = codecs[i]->extensions; *extension; extension++) {
            const size_t tail = strlen(*extension);
            if (length > tail && strncasecmp(name + length - tail, *extension, tail) == 0) {
                return codecs[i];
            }
        }
    }
    return NULL;
}

static const fm_mesh_codec *codec_by_bytes(const uint8_t *head, size_t size) {
    for (int i = 0; i < CODEC_COUNT; i++) {
        if (codecs[i]->matches && codecs[i]->matches(head, size)) {
            return codecs[i];
        }
    }
    return NULL;
}

// ---------------------------------------------------------------------------------------------------------------------------
// Reading
// ---------------------------------------------------------------------------------------------------------------------------

void fm_mesh_note(fm_mesh_reader *reader, const char *format, ...) {
    va_list arguments;
    va_start(arguments, format);
    fm_note_append(reader->info.note, format, arguments);
    va_end(arguments);
}

static fm_result check_limit(const fm_mesh_reader *reader, uint64_t bytes) {
    if (bytes > reader->limit) {
        return fm_input_fail(reader->input, FM_ERROR_RANGE,
                             "makes a mesh of over %llu bytes, which is the limit: raise max_bytes if that is meant",
                             (unsigned long long)reader->limit);
    }
    return FM_OK;
}

// Makes an array of elements of 12 bytes larger. `other` is what the other array holds, in bytes.
static fm_result grow(fm_mesh_reader *reader, void **array, uint64_t count, uint64_t *capacity, uint64_t more, uint64_t most,
                      uint64_t other, const char *what) {
    enum { BYTES = VERTEX_BYTES, LEAST = 1024 };
    uint64_t needed;
    if (fm_add_overflows(count, more, &needed) || needed > most) {
        return fm_input_fail(reader->input, FM_ERROR_RANGE, "has more %s than the %llu that a mesh can: cut it into parts", what,
                             (unsigned long long)most);
    }
    FM_TRY(check_limit(reader, needed * BYTES + other));
    if (needed <= *capacity) {
        return FM_OK;
    }
    // A number that is known from the start is taken as it is.
    const uint64_t larger =
        more > 1 && count == 0 ? needed : fm_max_u64(needed, fm_max_u64(LEAST, fm_min_u64(*capacity * 2, most)));
    void *memory = fm_alloc(reader->allocator, larger * BYTES, "a mesh's arrays");
    if (!memory) {
        return fm_fail_prefix(FM_ERROR_OUT_OF_HOST_MEMORY, fm_input_name(reader->input));
    }
    if (count > 0) {
        memcpy(memory, *array, (size_t)(count * BYTES));
    }
    fm_free(reader->allocator, *array, *capacity * BYTES);
    *array = memory;
    *capacity = larger;
    return FM_OK;
}

fm_result fm_mesh_grow_vertices(fm_mesh_reader *reader, uint64_t more) {
    void *array = reader->vertices;
    const fm_result result = grow(reader, &array, reader->vertex_count, &reader->vertex_capacity, more, MOST_VERTICES,
                                  reader->triangle_count * TRIANGLE_BYTES, "vertices");
    reader->vertices = array;
    return result;
}

fm_result fm_mesh_grow_triangles(fm_mesh_reader *reader, uint64_t more) {
    void *array = reader->triangles;
    const fm_result result = grow(reader, &array, reader->triangle_count, &reader->triangle_capacity, more, MOST_TRIANGLES,
                                  reader->vertex_count * VERTEX_BYTES, "triangles");
    reader->triangles = array;
    return result;
}

fm_result fm_mesh_expect(fm_mesh_reader *reader, uint64_t vertices, uint64_t triangles) {
    enum { BEGIN = 1 << 20 };
    const uint64_t most = fm_input_is_gzip(reader->input) || fm_input_file_size(reader->input) == UINT64_MAX ? BEGIN : UINT64_MAX;
    const uint64_t bytes = reader->limit / VERTEX_BYTES;
    if (vertices > bytes || triangles > bytes - vertices) {
        return fm_input_fail(reader->input, FM_ERROR_RANGE,
                             "makes a mesh of %llu vertices and %llu triangles, over the limit of %llu bytes: raise max_bytes if "
                             "that is meant",
                             (unsigned long long)vertices, (unsigned long long)triangles, (unsigned long long)reader->limit);
    }
    if (vertices > 0) {
        FM_TRY(fm_mesh_grow_vertices(reader, fm_min_u64(vertices, most)));
    }
    return triangles > 0 ? fm_mesh_grow_triangles(reader, fm_min_u64(triangles, most)) : FM_OK;
}

fm_result fm_mesh_set_rest_aside(fm_mesh_reader *reader) {
    uint64_t bytes = 0;
    FM_TRY(fm_blocks_drain(&reader->blocks, &bytes));
    if (bytes > 0) {
        fm_mesh_note(reader, "%llu bytes behind the mesh are set aside", (unsigned long long)bytes);
    }
    return FM_OK;
}

static fm_result choose_codec(fm_mesh_reader *reader, const fm_mesh_codec **chosen) {
    const uint8_t *head;
    size_t size;
    FM_TRY(fm_input_peek(reader->input, 1024, &head, &size));
    if (size == 0) {
        return fm_input_fail(reader->input, FM_ERROR_FORMAT, "is empty: get it again");
    }
    if (reader->desc->format != FM_MESH_FORMAT_AUTO) {
        *chosen = codec_of(reader->desc->format);
        return *chosen ? FM_OK
                       : fm_fail(FM_ERROR_INVALID_ARGUMENT, "format is %d: not an fm_mesh_format", (int)reader->desc->format);
    }
    *chosen = codec_by_bytes(head, size);
    if (!*chosen && reader->path) {
        *chosen = codec_by_name(reader->path);
    }
    if (!*chosen) {
        return fm_input_fail(reader->input, FM_ERROR_FORMAT,
                             "is of no known mesh format: .ply, .obj, .stl, .gltf and .glb are read; name it by its format");
    }
    return FM_OK;
}

static fm_result read_arrays(fm_mesh_reader *reader) {
    const fm_mesh_codec *codec = NULL;
    FM_TRY(choose_codec(reader, &codec));
    reader->info.format = codec->format;
    reader->info.compressed = fm_input_is_gzip(reader->input);
    const uint64_t limit = reader->desc->max_bytes ? reader->desc->max_bytes : codec->default_limit;
    reader->limit = limit ? limit : UINT64_MAX;
    FM_TRY(fm_blocks_open(&reader->blocks, reader->allocator, reader->input, reader->desc->progress, reader->desc->progress_user));
    FM_TRY(codec->read(reader));
    FM_TRY(check_limit(reader, reader->vertex_count * VERTEX_BYTES + reader->triangle_count * TRIANGLE_BYTES));
    if (reader->small_faces > 0) {
        fm_mesh_note(reader, "%llu faces of fewer than three corners are set aside", (unsigned long long)reader->small_faces);
    }
    const uint64_t size = fm_input_file_size(reader->input);
    reader->info.file_bytes = size == UINT64_MAX ? 0 : size;
    reader->info.vertices = reader->vertex_count;
    reader->info.triangles = reader->triangle_count;
    return FM_OK;
}

static fm_result make_mesh(fm_mesh_reader *reader, fm_context *context, fm_mesh **mesh) {
    const fm_mesh_desc desc = {
        .vertices = (const float(*)[3])reader->vertices,
        .vertex_count = reader->vertex_count,
        .triangles = (const uint32_t(*)[3])reader->triangles,
        .triangle_count = reader->triangle_count,
    };
    const fm_result result = fm_mesh_create(context, &desc, mesh);
    if (result != FM_OK) {
        return fm_fail_prefix(result, fm_input_name(reader->input));
    }
    const fm_mesh_read_desc *told = reader->desc;
    if (told->progress && !told->progress(told->progress_user, reader->info.file_bytes, reader->info.file_bytes)) {
        fm_mesh_destroy(*mesh);
        *mesh = NULL;
        return fm_fail(FM_ERROR_IO, "cancelled");
    }
    return FM_OK;
}

fm_result fm_mesh_read_input(fm_context *context, fm_input *input, const char *path, const fm_mesh_read_desc *desc, fm_mesh **mesh,
                             fm_mesh_file_info *info) {
    static const fm_mesh_read_desc defaults;
    fm_mesh_reader reader = {.allocator = &context->allocator, .path = path, .desc = desc ? desc : &defaults, .input = input};
    const locale_t before = fm_locale_plain();
    fm_result result = read_arrays(&reader);
    fm_locale_restore(before);
    fm_blocks_close(&reader.blocks);
    if (result == FM_OK) {
        result = make_mesh(&reader, context, mesh);
    }
    fm_free(reader.allocator, reader.vertices, reader.vertex_capacity * VERTEX_BYTES);
    fm_free(reader.allocator, reader.triangles, reader.triangle_capacity * TRIANGLE_BYTES);
    if (result == FM_OK && info) {
        *info = reader.info;
    }
    return result;
}

fm_result fm_mesh_read(fm_context *context, const char *path, const fm_mesh_read_desc *desc, fm_mesh **mesh,
                       fm_mesh_file_info *info) {
    if (!context || !path || !mesh) {
        return fm_fail(FM_ERROR_INVALID_ARGUMENT, "%s is NULL", !context ? "context" : path ? "mesh" : "path");
    }
    fm_input *input = NULL;
    FM_TRY(fm_input_open(&context->allocator, path, &input));
    const fm_result result = fm_mesh_read_input(context, input, strcmp(path, "-") == 0 ? NULL : path, desc, mesh, info);
    fm_input_close(input);
    return result;
}

fm_mesh_format fm_mesh_format_of(const char *path) {
    fm_input *input = NULL;
    if (!path || strcmp(path, "-") == 0 || fm_input_open(&fm_default_allocator, path, &input) != FM_OK) {
        return FM_MESH_FORMAT_AUTO;
    }
    const uint8_t *head;
    size_t size;
    const fm_mesh_codec *codec = NULL;
    if (fm_input_peek(input, 1024, &head, &size) == FM_OK) {
        codec = codec_by_bytes(head, size);
        codec = codec ? codec : codec_by_name(path);
    }
    fm_input_close(input);
    return codec ? codec->format : FM_MESH_FORMAT_AUTO;
}

// ---------------------------------------------------------------------------------------------------------------------------
// Writing
// ---------------------------------------------------------------------------------------------------------------------------

bool fm_mesh_writer_progress(const fm_mesh_writer *writer, uint64_t done, uint64_t total) {
    if (!writer->desc->progress || writer->desc->progress(writer->desc->progress_user, done, total)) {
        return true;
    }
    fm_fail(FM_ERROR_IO, "cancelled");
    return false;
}

static fm_result choose_writer(const char *path, const fm_mesh_write_desc *desc, const fm_mesh_codec **codec) {
    *codec = desc->format == FM_MESH_FORMAT_AUTO ? codec_by_name(path) : codec_of(desc->format);
    if (!*codec && desc->format != FM_MESH_FORMAT_AUTO) {
        return fm_fail(FM_ERROR_INVALID_ARGUMENT, "format is %d: not an fm_mesh_format", (int)desc->format);
    }
    if (!*codec && (strcmp(path, "-") == 0 || strncmp(path, "/dev/", 5) == 0)) {
        *codec = &fm_mesh_codec_ply;
    }
    if (!*codec) {
        return fm_fail(FM_ERROR_INVALID_ARGUMENT,
                       "%s: the name does not say the format: end it in .ply, .obj or .stl, with or without .gz", path);
    }
    if (!(*codec)->write) {
        return fm_fail(FM_ERROR_UNSUPPORTED, "%s: %s files are only read: write .ply, .obj or .stl", path, (*codec)->name);
    }
    return FM_OK;
}

static fm_result write_batch(const fm_mesh_codec *codec, fm_mesh_writer *writer, const char *path, fm_file_batch *batch) {
    const bool gzip = writer->desc->compress || fm_name_ends(path, ".gz");
    FM_TRY(fm_output_open(writer->allocator, path, gzip, &writer->output));
    const locale_t before = fm_locale_plain();
    fm_result result = codec->write(writer);
    fm_locale_restore(before);
    if (result != FM_OK) {
        fm_output_destroy(writer->output);
        return result;
    }
    return fm_batch_add(batch, writer->output);
}

fm_result fm_mesh_write(const fm_mesh *mesh, const char *path, const fm_mesh_write_desc *desc) {
    static const fm_mesh_write_desc defaults;
    if (!mesh || !path) {
        return fm_fail(FM_ERROR_INVALID_ARGUMENT, "%s is NULL", mesh ? "path" : "mesh");
    }
    desc = desc ? desc : &defaults;
    const fm_mesh_codec *codec = NULL;
    FM_TRY(choose_writer(path, desc, &codec));
    fm_file_batch own = {.allocator = mesh->context->allocator};
    fm_file_batch *batch = desc->batch ? desc->batch : &own;
    fm_mesh_writer writer = {.allocator = &batch->allocator, .desc = desc};
    fm_mesh_arrays(mesh, &writer.vertices, &writer.vertex_count, &writer.triangles, &writer.triangle_count);
    fm_result result = write_batch(codec, &writer, path, batch);
    if (result == FM_OK && batch == &own) {
        result = fm_file_batch_commit(&own);
    }
    fm_batch_clear(&own);
    return result;
}
