// SPDX-License-Identifier: MIT

// OBJ files: a statement a line, of which vertices and faces count here.
// Source: Wavefront, "Advanced Visualizer" manual, appendix B1, "Object Files (.obj)".

#include "io/file.h"
#include "io/mesh_file.h"

#include <stdio.h>
#include <string.h>

typedef struct obj {
    fm_mesh_reader *reader;
    uint64_t line;
    uint64_t unknown;  // lines of no known statement
    // The greatest number of a vertex that a face names, and where: vertices may come after their faces.
    uint64_t greatest, greatest_line;
} obj;

static fm_result obj_fails(const obj *o, const char *what) {
    return fm_input_fail(o->reader->input, FM_ERROR_FORMAT, "line %llu: %s; mend that line or export the file again",
                         (unsigned long long)o->line, what);
}

static inline const uint8_t *skip_blanks(const uint8_t *at) {
    while (fm_is_blank(*at)) {
        at++;
    }
    return at;
}

static inline fm_result read_vertex(obj *o, const uint8_t *at, const uint8_t *end) {
    float position[3];
    for (int k = 0; k < 3; k++) {
        at = fm_parse_float(skip_blanks(at), &position[k]);
        if (!at || at > end || !(fm_is_space(*at) || at == end)) {
            return obj_fails(o, "a vertex is not three numbers");
        }
    }
    return fm_mesh_add_vertex(o->reader, position);
}

// A corner is v, v/vt, v//vn or v/vt/vn: its first number, from 1, or from the last vertex backwards when negative.
static inline const uint8_t *parse_corner(const uint8_t *at, int64_t *number) {
    at = fm_parse_integer(at, number);
    for (int part = 0; at && *at == '/' && part < 2; part++) {
        int64_t ignored;
        const uint8_t *next = fm_parse_integer(at + 1, &ignored);
        at = next ? next : at + 1;
    }
    return at;
}

static fm_result bad_number(const obj *o, int64_t number) {
    char text[120];
    snprintf(text, sizeof text, "a face names vertex %lld, where %llu vertices have been given", (long long)number,
             (unsigned long long)o->reader->vertex_count);
    return obj_fails(o, text);
}

static inline fm_result find_vertex(obj *o, int64_t number, uint32_t *corner) {
    const int64_t count = (int64_t)o->reader->vertex_count;
    const int64_t vertex = number > 0 ? number : count + 1 + number;
    if (number == 0 || vertex < 1 || vertex > UINT32_MAX) {
        return bad_number(o, number);
    }
    if ((uint64_t)vertex > o->greatest) {
        o->greatest = (uint64_t)vertex;
        o->greatest_line = o->line;
    }
    *corner = (uint32_t)(vertex - 1);
    return FM_OK;
}

static inline fm_result read_face(obj *o, const uint8_t *at, const uint8_t *end) {
    uint32_t first = 0, before = 0, corner = 0;
    uint64_t count = 0;
    for (at = skip_blanks(at); at < end && *at != '#'; at = skip_blanks(at), count++, before = corner) {
        int64_t number = 0;
        at = parse_corner(at, &number);
        if (!at || at > end || !(fm_is_space(*at) || at == end)) {
            return obj_fails(o, "a corner of a face is not v, v/vt, v//vn or v/vt/vn");
        }
        FM_TRY(find_vertex(o, number, &corner));
        if (count == 0) {
            first = corner;
        } else if (count > 1) {
            FM_TRY(fm_mesh_add_triangle(o->reader, first, before, corner));
        }
    }
    o->reader->info.faces++;
    o->reader->small_faces += count < 3;
    return FM_OK;
}

// Statements that say nothing about triangles.
static bool is_known(const uint8_t *word, size_t length) {
    static const char *const words[] = {
        "vt",   "vn",     "vp",     "g",     "o",        "s",          "usemtl",    "mtllib", "l",   "p",
        "mg",   "usemap", "maplib", "bevel", "c_interp", "d_interp",   "lod",       "cstype", "deg", "bmat",
        "step", "curv",   "curv2",  "surf",  "parm",     "trim",       "hole",      "scrv",   "sp",  "end",
        "con",  "ctech",  "stech",  "call",  "csh",      "shadow_obj", "trace_obj",
    };
    for (size_t i = 0; i < sizeof words / sizeof words[0]; i++) {
        if (strlen(words[i]) == length && memcmp(words[i], word, length) == 0) {
            return true;
        }
    }
    return false;
}

static fm_result other_statement(obj *o, const uint8_t *at, const uint8_t *end) {
    size_t length = 0;
    while (at + length < end && at[length] > ' ' && at[length] < 127) {
        length++;
    }
    if (at + length < end && !fm_is_blank(at[length])) {
        return obj_fails(o, "a byte that no text holds");
    }
    o->unknown += !is_known(at, length);
    return FM_OK;
}

static inline fm_result read_line(obj *o, const uint8_t *at, const uint8_t *end) {
    at = skip_blanks(at);
    if (at >= end || *at == '#') {
        return FM_OK;
    }
    if (*at == 'v' && fm_is_blank(at[1])) {
        return read_vertex(o, at + 1, end);
    }
    if (*at == 'f' && (fm_is_blank(at[1]) || at + 1 == end)) {
        return read_face(o, at + 1, end);
    }
    return other_statement(o, at, end);
}

static fm_result check_end(obj *o) {
    fm_mesh_reader *reader = o->reader;
    if (o->greatest > reader->vertex_count) {
        o->line = o->greatest_line;
        return bad_number(o, (int64_t)o->greatest);
    }
    if (reader->vertex_count == 0 && o->unknown > 0) {
        return fm_input_fail(reader->input, FM_ERROR_FORMAT,
                             "is no OBJ file: it has no vertex, and %llu lines of no known statement",
                             (unsigned long long)o->unknown);
    }
    if (o->unknown > 0) {
        fm_mesh_note(reader, "%llu lines of no known statement are set aside", (unsigned long long)o->unknown);
    }
    return FM_OK;
}

static fm_result obj_read(fm_mesh_reader *reader) {
    obj o = {.reader = reader};
    fm_blocks *blocks = &reader->blocks;
    for (;;) {
        uint64_t joined = 0;
        uint8_t *end = NULL;
        FM_TRY(fm_blocks_line(blocks, &end, &joined));
        o.line++;
        FM_TRY(read_line(&o, blocks->at, end));
        o.line += joined;
        if (end == blocks->end) {
            break;
        }
        blocks->at = end + 1;
    }
    return check_end(&o);
}

// ---------------------------------------------------------------------------------------------------------------------------
// Writing
// ---------------------------------------------------------------------------------------------------------------------------

static fm_result obj_write(fm_mesh_writer *writer) {
    const uint64_t total = writer->vertex_count + writer->triangle_count;
    FM_TRY(fm_writer_text(writer->output, "# by fathom: %llu vertices, %llu triangles\n", (unsigned long long)writer->vertex_count,
                          (unsigned long long)writer->triangle_count));
    for (uint64_t i = 0; i < writer->vertex_count; i++) {
        if (i % FM_MESH_PIECE == 0 && !fm_mesh_writer_progress(writer, i, total)) {
            return FM_ERROR_IO;
        }
        const float *v = writer->vertices[i];
        FM_TRY(fm_writer_text(writer->output, "v %.9g %.9g %.9g\n", (double)v[0], (double)v[1], (double)v[2]));
    }
    for (uint64_t i = 0; i < writer->triangle_count; i++) {
        if (i % FM_MESH_PIECE == 0 && !fm_mesh_writer_progress(writer, writer->vertex_count + i, total)) {
            return FM_ERROR_IO;
        }
        const uint32_t *t = writer->triangles[i];
        FM_TRY(fm_writer_text(writer->output, "f %llu %llu %llu\n", (unsigned long long)t[0] + 1, (unsigned long long)t[1] + 1,
                              (unsigned long long)t[2] + 1));
    }
    return fm_mesh_writer_progress(writer, total, total) ? FM_OK : FM_ERROR_IO;
}

static const char *const extensions[] = {".obj", NULL};

const fm_mesh_codec fm_mesh_codec_obj = {
    .format = FM_MESH_FORMAT_OBJ,
    .name = "OBJ",
    .extensions = extensions,
    .read = obj_read,
    .write = obj_write,
};
