// SPDX-License-Identifier: MIT

// STL files: triangles without shared vertices, 50 bytes each, or as text. Binary files may begin with "solid" as text does.
// Source: 3D Systems, "StereoLithography Interface Specification", 1989.

#include "io/file.h"
#include "io/mesh_file.h"

#include <math.h>
#include <string.h>
#include <strings.h>

enum {
    HEADER = 80,
    RECORD = 50,
    NORMAL = 12,  // bytes of a record before its corners
    WORD = 512,   // no word of a text is longer
};

// ---------------------------------------------------------------------------------------------------------------------------
// Which of the two it is
// ---------------------------------------------------------------------------------------------------------------------------

static bool word_at(const uint8_t *at, const uint8_t *end, const char *word) {
    const size_t length = strlen(word);
    return (size_t)(end - at) >= length && strncasecmp((const char *)at, word, length) == 0 &&
           ((size_t)(end - at) == length || fm_is_space(at[length]));
}

static const uint8_t *skip_spaces(const uint8_t *at, const uint8_t *end) {
    while (at < end && fm_is_space(*at)) {
        at++;
    }
    return at;
}

// "solid", a name up to the end of the line, then a facet or the end.
static bool is_text(const uint8_t *head, size_t size) {
    const uint8_t *end = head + size;
    const uint8_t *at = skip_spaces(head, end);
    if (!word_at(at, end, "solid")) {
        return false;
    }
    at = memchr(at, '\n', (size_t)(end - at));
    at = at ? skip_spaces(at, end) : end;
    return word_at(at, end, "facet") || word_at(at, end, "endsolid");
}

static uint64_t claimed_size(const uint8_t *head) {
    return HEADER + 4 + (uint64_t)RECORD * fm_load_u32(head + HEADER);
}

// ---------------------------------------------------------------------------------------------------------------------------
// Binary
// ---------------------------------------------------------------------------------------------------------------------------

static fm_result read_binary(fm_mesh_reader *reader) {
    uint8_t header[HEADER + 4];
    FM_TRY(fm_input_read(reader->input, header, sizeof header, "its header"));
    const uint64_t count = fm_load_u32(header + HEADER);
    FM_TRY(fm_input_require(reader->input, count * RECORD, "what its header announces"));
    FM_TRY(fm_mesh_expect(reader, count * 3, count));
    reader->info.binary = true;
    reader->info.faces = count;
    fm_blocks *blocks = &reader->blocks;
    for (uint64_t i = 0; i < count; i++, blocks->at += RECORD) {
        FM_TRY(fm_blocks_need(blocks, RECORD, "its triangles"));
        float corners[3][3];
        memcpy(corners, blocks->at + NORMAL, sizeof corners);
        if (fm_machine_is_big_endian()) {
            fm_swap_elements(corners, 9, 4);
        }
        for (int k = 0; k < 3; k++) {
            FM_TRY(fm_mesh_add_vertex(reader, corners[k]));
        }
        const uint32_t first = (uint32_t)(3 * i);
        FM_TRY(fm_mesh_add_triangle(reader, first, first + 1, first + 2));
    }
    return fm_mesh_set_rest_aside(reader);
}

// ---------------------------------------------------------------------------------------------------------------------------
// Text
// ---------------------------------------------------------------------------------------------------------------------------

typedef struct text {
    fm_mesh_reader *reader;
    fm_blocks *blocks;
    uint64_t line;
    uint64_t corners;  // of the loop that is open
    bool solid, facet, loop;
    uint32_t first, before;
} text;

static fm_result text_fails(const text *t, const char *what) {
    return fm_input_fail(t->reader->input, FM_ERROR_FORMAT, "%s in line %llu: mend that line or export the file again", what,
                         (unsigned long long)t->line);
}

// The next word lies complete at `blocks->at`; there is none at the end of the file.
static fm_result next_word(text *t) {
    fm_blocks *blocks = t->blocks;
    for (;;) {
        FM_TRY(fm_blocks_want(blocks, WORD));
        while (fm_is_space(*blocks->at)) {
            t->line += *blocks->at++ == '\n';
        }
        if (fm_blocks_left(blocks) >= WORD || blocks->ended) {
            return FM_OK;
        }
    }
}

static fm_result skip_line(text *t) {
    for (;;) {
        uint8_t *newline = memchr(t->blocks->at, '\n', fm_blocks_left(t->blocks));
        t->blocks->at = newline ? newline : t->blocks->end;
        if (newline || t->blocks->ended) {
            return FM_OK;
        }
        FM_TRY(fm_blocks_fill(t->blocks));
    }
}

static fm_result read_corner(text *t) {
    float position[3];
    for (int k = 0; k < 3; k++) {
        FM_TRY(next_word(t));
        const uint8_t *end = fm_parse_float(t->blocks->at, &position[k]);
        if (!end || end - t->blocks->at >= WORD || !(fm_is_space(*end) || end == t->blocks->end)) {
            return text_fails(t,
                              t->blocks->at == t->blocks->end ? "the file ends within a vertex" : "a vertex is not three numbers");
        }
        t->blocks->at += end - t->blocks->at;
    }
    const uint32_t corner = (uint32_t)t->reader->vertex_count;
    FM_TRY(fm_mesh_add_vertex(t->reader, position));
    if (t->corners == 0) {
        t->first = corner;
    } else if (t->corners > 1) {
        FM_TRY(fm_mesh_add_triangle(t->reader, t->first, t->before, corner));
    }
    t->before = corner;
    t->corners++;
    return FM_OK;
}

static bool take(text *t, const char *word) {
    if (!word_at(t->blocks->at, t->blocks->end, word)) {
        return false;
    }
    t->blocks->at += strlen(word);
    return true;
}

// One word, and what belongs to it.
static fm_result read_statement(text *t) {
    if (t->loop && take(t, "vertex")) {
        return read_corner(t);
    }
    if (t->loop && take(t, "endloop")) {
        t->loop = false;
        t->reader->info.faces++;
        t->reader->small_faces += t->corners < 3;
        return FM_OK;
    }
    if (t->facet && !t->loop && take(t, "outer")) {
        t->loop = true;
        t->corners = 0;
        return skip_line(t);
    }
    if (t->facet && !t->loop && take(t, "endfacet")) {
        t->facet = false;
        return FM_OK;
    }
    if (t->solid && !t->facet && take(t, "facet")) {
        t->facet = true;
        return skip_line(t);
    }
    if (t->solid && !t->facet && take(t, "endsolid")) {
        t->solid = false;
        return skip_line(t);
    }
    if (!t->solid && take(t, "solid")) {
        t->solid = true;
        return skip_line(t);
    }
    return text_fails(t, t->loop    ? "a word stands where \"vertex\" or \"endloop\" is wanted"
                         : t->facet ? "a word stands where \"outer loop\" or \"endfacet\" is wanted"
                         : t->solid ? "a word stands where \"facet\" or \"endsolid\" is wanted"
                                    : "a word stands where \"solid\" is wanted");
}

static fm_result read_text(fm_mesh_reader *reader) {
    text t = {.reader = reader, .blocks = &reader->blocks, .line = 1};
    for (;;) {
        FM_TRY(next_word(&t));
        if (t.blocks->at == t.blocks->end) {
            break;
        }
        FM_TRY(read_statement(&t));
    }
    return t.solid ? text_fails(&t, "the file ends without \"endsolid\": it is truncated") : FM_OK;
}

// ---------------------------------------------------------------------------------------------------------------------------
// The codec
// ---------------------------------------------------------------------------------------------------------------------------

static bool stl_matches(const uint8_t *head, size_t size) {
    return is_text(head, size);
}

static fm_result stl_read(fm_mesh_reader *reader) {
    const uint8_t *head;
    size_t size;
    FM_TRY(fm_input_peek(reader->input, 1024, &head, &size));
    // A size that fits to the byte outweighs what the header looks like.
    const bool fits = size >= HEADER + 4 && !fm_input_is_gzip(reader->input) && fm_input_bound(reader->input) == claimed_size(head);
    if (!fits && is_text(head, size)) {
        return read_text(reader);
    }
    if (size < HEADER + 4) {
        return fm_input_fail(reader->input, FM_ERROR_FORMAT,
                             "is no STL file: it is neither the text of a solid nor as long as a header; get it again");
    }
    return read_binary(reader);
}

static void write_normal(const float (*vertices)[3], const uint32_t corners[3], float normal[3]) {
    double a[3], b[3];
    for (int k = 0; k < 3; k++) {
        a[k] = (double)vertices[corners[1]][k] - (double)vertices[corners[0]][k];
        b[k] = (double)vertices[corners[2]][k] - (double)vertices[corners[0]][k];
    }
    const double n[3] = {a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]};
    const double length = sqrt(n[0] * n[0] + n[1] * n[1] + n[2] * n[2]);
    for (int k = 0; k < 3; k++) {
        normal[k] = length > 0 && length < INFINITY ? (float)(n[k] / length) : 0;
    }
}

static fm_result stl_write(fm_mesh_writer *writer) {
    enum { ROWS = 1024 };
    uint8_t header[HEADER + 4] = "binary STL by fathom";
    fm_store_u32(header + HEADER, (uint32_t)writer->triangle_count);
    FM_TRY(fm_output_write(writer->output, header, sizeof header));
    uint8_t rows[ROWS * RECORD];
    memset(rows, 0, sizeof rows);
    for (uint64_t i = 0; i < writer->triangle_count; i += ROWS) {
        if (i % FM_MESH_PIECE == 0 && !fm_mesh_writer_progress(writer, i, writer->triangle_count)) {
            return FM_ERROR_IO;
        }
        const uint64_t count = fm_min_u64(ROWS, writer->triangle_count - i);
        for (uint64_t k = 0; k < count; k++) {
            float record[4][3];
            write_normal(writer->vertices, writer->triangles[i + k], record[0]);
            for (int corner = 0; corner < 3; corner++) {
                memcpy(record[corner + 1], writer->vertices[writer->triangles[i + k][corner]], sizeof record[0]);
            }
            if (fm_machine_is_big_endian()) {
                fm_swap_elements(record, 12, 4);
            }
            memcpy(rows + k * RECORD, record, sizeof record);
        }
        FM_TRY(fm_output_write(writer->output, rows, count * RECORD));
    }
    return fm_mesh_writer_progress(writer, writer->triangle_count, writer->triangle_count) ? FM_OK : FM_ERROR_IO;
}

static const char *const extensions[] = {".stl", NULL};

const fm_mesh_codec fm_mesh_codec_stl = {
    .format = FM_MESH_FORMAT_STL,
    .name = "STL",
    .extensions = extensions,
    .matches = stl_matches,
    .read = stl_read,
    .write = stl_write,
};
