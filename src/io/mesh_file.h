// SPDX-License-Identifier: MIT
#ifndef FM_MESH_FILE_H
#define FM_MESH_FILE_H

// What the formats of meshes have in common: a table row each, the arrays that a reader fills, and a writer.

#include "fathom/mesh_io.h"
#include "io/blocks.h"

// One file being read.
typedef struct fm_mesh_reader {
    const fm_allocator *allocator;
    const char *path;               // NULL: there is nothing beside the file
    const fm_mesh_read_desc *desc;  // never NULL
    fm_input *input;
    fm_mesh_file_info info;
    fm_blocks blocks;
    uint64_t limit;  // of the mesh's bytes
    float (*vertices)[3];
    uint32_t (*triangles)[3];
    uint64_t vertex_count, vertex_capacity;
    uint64_t triangle_count, triangle_capacity;
    uint64_t small_faces;  // of fewer than three corners
} fm_mesh_reader;

// One file being written.
typedef struct fm_mesh_writer {
    const fm_allocator *allocator;
    const fm_mesh_write_desc *desc;  // never NULL
    const float (*vertices)[3];
    const uint32_t (*triangles)[3];
    uint64_t vertex_count, triangle_count;
    fm_output *output;
} fm_mesh_writer;

typedef struct fm_mesh_codec {
    fm_mesh_format format;
    const char *name;
    const char *const *extensions;                      // with the dot, lower case; ends with NULL
    bool (*matches)(const uint8_t *head, size_t size);  // NULL: known by its name only
    // Fills the reader's arrays, counts `info.faces` and sets what else it knows of `info`.
    fm_result (*read)(fm_mesh_reader *reader);
    fm_result (*write)(fm_mesh_writer *writer);  // NULL: only read
    uint64_t default_limit;                      // for `max_bytes` 0; 0: none
} fm_mesh_codec;

extern const fm_mesh_codec fm_mesh_codec_ply;
extern const fm_mesh_codec fm_mesh_codec_obj;
extern const fm_mesh_codec fm_mesh_codec_stl;
extern const fm_mesh_codec fm_mesh_codec_gltf;

// Reads from an input that is open already and stays the caller's.
fm_result fm_mesh_read_input(fm_context *context, fm_input *input, const char *path, const fm_mesh_read_desc *desc, fm_mesh **mesh,
                             fm_mesh_file_info *info);

// Room for `more` vertices or triangles after those that are there. `more` is to be what the file is known to have, or 1.
fm_result fm_mesh_grow_vertices(fm_mesh_reader *reader, uint64_t more);
fm_result fm_mesh_grow_triangles(fm_mesh_reader *reader, uint64_t more);
// Room for a claim that has been checked against the file: all of it, or where the file's size is only a bound a part to begin
// with.
fm_result fm_mesh_expect(fm_mesh_reader *reader, uint64_t vertices, uint64_t triangles);

static inline fm_result fm_mesh_add_vertex(fm_mesh_reader *reader, const float position[3]) {
    if (reader->vertex_count == reader->vertex_capacity) {
        FM_TRY(fm_mesh_grow_vertices(reader, 1));
    }
    float *to = reader->vertices[reader->vertex_count++];
    to[0] = position[0];
    to[1] = position[1];
    to[2] = position[2];
    return FM_OK;
}

static inline fm_result fm_mesh_add_triangle(fm_mesh_reader *reader, uint32_t a, uint32_t b, uint32_t c) {
    if (reader->triangle_count == reader->triangle_capacity) {
        FM_TRY(fm_mesh_grow_triangles(reader, 1));
    }
    uint32_t *to = reader->triangles[reader->triangle_count++];
    to[0] = a;
    to[1] = b;
    to[2] = c;
    return FM_OK;
}

void fm_mesh_note(fm_mesh_reader *reader, const char *format, ...) FM_PRINTF(2, 3);
// What is left of the file is set aside, with a note if it is more than blanks.
fm_result fm_mesh_set_rest_aside(fm_mesh_reader *reader);

// Tells the progress; false: cancelled, with the message set.
bool fm_mesh_writer_progress(const fm_mesh_writer *writer, uint64_t done, uint64_t total);
// Elements of a piece between two reports of a writer.
enum { FM_MESH_PIECE = 1 << 16 };

#endif
