// SPDX-License-Identifier: MIT

// Bare elements. The layout comes from the caller, from the sidecar NAME.txt, or from a name such as bone_256x256x99_u16.raw.gz.

#include "io/file.h"

#include <errno.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <unistd.h>

enum { MAX_LINE = 256 };

static const struct {
    const char *suffix;
    fm_type type;
} short_names[] = {
    {"u8", FM_TYPE_U8},   {"u16", FM_TYPE_U16}, {"u32", FM_TYPE_U32},   {"u64", FM_TYPE_U64},
    {"i8", FM_TYPE_I8},   {"i16", FM_TYPE_I16}, {"i32", FM_TYPE_I32},   {"i64", FM_TYPE_I64},
    {"f32", FM_TYPE_F32}, {"f64", FM_TYPE_F64}, {"bits", FM_TYPE_BITS},
};
enum { TYPE_COUNT = sizeof short_names / sizeof short_names[0] };

static bool raw_matches(const uint8_t *head, size_t size) {
    (void)head;
    (void)size;
    return false;
}

// Parses X "x" Y "x" Z "_" TYPE (or X "x" Y for one slice) at `text`, followed by "." or the end.
static bool parse_layout(const char *text, uint64_t axes[3], fm_type *type) {
    int count = 0;
    for (bool last = false; !last; count++) {
        char *end;
        if (count == 3 || *text < '0' || *text > '9') {
            return false;
        }
        errno = 0;
        axes[count] = strtoull(text, &end, 10);
        last = *end == '_';
        if (errno || (!last && *end != 'x')) {
            return false;
        }
        text = end + 1;
    }
    if (count == 2) {
        axes[2] = 1;
    }
    for (int i = 0; count >= 2 && i < TYPE_COUNT; i++) {
        size_t length = strlen(short_names[i].suffix);
        if (strncmp(text, short_names[i].suffix, length) == 0 && (text[length] == 0 || text[length] == '.')) {
            *type = short_names[i].type;
            return true;
        }
    }
    return false;
}

static bool layout_from_name(const char *path, uint64_t axes[3], fm_type *type) {
    const char *slash = strrchr(path, '/');
    const char *name = slash ? slash + 1 : path;
    for (const char *at = name; *at; at++) {
        if ((at == name || at[-1] == '_') && parse_layout(at, axes, type)) {
            return true;
        }
    }
    return false;
}

static bool parse_doubles(const char *text, double values[3]) {
    for (int i = 0; i < 3; i++) {
        char *end;
        values[i] = strtod(text, &end);
        if (end == text) {
            return false;
        }
        text = end;
    }
    return text[strspn(text, " \t")] == 0;
}

static bool parse_axes(const char *text, uint64_t axes[3]) {
    int used = 0;
    unsigned long long values[3];
    if (strchr(text, '-') || sscanf(text, "%llu %llu %llu %n", &values[0], &values[1], &values[2], &used) != 3 || text[used] != 0) {
        return false;
    }
    for (int i = 0; i < 3; i++) {
        axes[i] = values[i];
    }
    return true;
}

static bool parse_type_name(const char *text, fm_type *type) {
    for (int i = 0; i < TYPE_COUNT; i++) {
        if (strcmp(text, short_names[i].suffix) == 0 || strcmp(text, fm_type_name(short_names[i].type)) == 0) {
            *type = short_names[i].type;
            return true;
        }
    }
    return false;
}

typedef struct sidecar {
    uint64_t axes[3];
    fm_type type;
    uint64_t offset;
    bool big_endian;
    double spacing[3], origin[3];
    bool has_shape, has_type, has_spacing;
} sidecar;

static bool parse_entry(sidecar *side, const char *key, const char *value) {
    if (strcmp(key, "shape") == 0) {
        return side->has_shape = parse_axes(value, side->axes);
    }
    if (strcmp(key, "type") == 0) {
        return side->has_type = parse_type_name(value, &side->type);
    }
    if (strcmp(key, "byte_order") == 0) {
        side->big_endian = strcmp(value, "big") == 0;
        return side->big_endian || strcmp(value, "little") == 0;
    }
    if (strcmp(key, "offset") == 0) {
        unsigned long long offset;
        int used = 0;
        bool good = sscanf(value, "%llu%n", &offset, &used) == 1 && value[used] == 0 && value[0] != '-';
        side->offset = good ? offset : 0;
        return good;
    }
    if (strcmp(key, "spacing") == 0) {
        return side->has_spacing = parse_doubles(value, side->spacing);
    }
    return strcmp(key, "origin") == 0 && parse_doubles(value, side->origin);
}

static fm_result parse_sidecar(fm_input *input, sidecar *side) {
    char line[MAX_LINE];
    bool end = false;
    FM_TRY(fm_input_line(input, line, sizeof line, &end));
    if (strcmp(line, "fathom raw 1") != 0) {
        return fm_input_fail(input, FM_ERROR_FORMAT,
                             "does not begin with \"fathom raw 1\": it is no sidecar of a raw file; move it away or "
                             "give the shape");
    }
    for (;;) {
        FM_TRY(fm_input_line(input, line, sizeof line, &end));
        if (end) {
            break;
        }
        if (line[0] == 0 || line[0] == '#') {
            continue;
        }
        char *space = strchr(line, ' ');
        if (space) {
            *space = 0;
        }
        if (!space || !parse_entry(side, line, space + 1)) {
            return fm_input_fail(input, FM_ERROR_FORMAT, "has a line that is not understood: \"%s%s%s\"", line, space ? " " : "",
                                 space ? space + 1 : "");
        }
    }
    if (!side->has_shape || !side->has_type) {
        return fm_input_fail(input, FM_ERROR_FORMAT, "lacks the line \"%s\"", side->has_shape ? "type" : "shape");
    }
    return FM_OK;
}

static fm_result read_sidecar(fm_reader *reader, sidecar *side, bool *found) {
    uint64_t size;
    *found = false;
    if (!reader->path) {
        return FM_OK;
    }
    char *name = fm_name_with_suffix(reader->allocator, reader->path, 0, ".txt", &size);
    if (!name) {
        return FM_ERROR_OUT_OF_HOST_MEMORY;
    }
    fm_result result = FM_OK;
    if (access(name, F_OK) == 0) {
        fm_input *input = NULL;
        result = fm_input_open(reader->allocator, name, &input);
        if (result == FM_OK) {
            result = parse_sidecar(input, side);
            fm_input_close(input);
        }
        *found = result == FM_OK;
    }
    fm_free(reader->allocator, name, size);
    return result;
}

static fm_result raw_open(fm_reader *reader) {
    const fm_read_desc *desc = reader->desc;
    sidecar side = {.spacing = {1, 1, 1}};
    bool given = desc->shape.x || desc->shape.y || desc->shape.z;
    bool found = false;
    if (given) {
        side.axes[0] = desc->shape.x;
        side.axes[1] = desc->shape.y;
        side.axes[2] = desc->shape.z;
        side.type = desc->type;
        side.offset = desc->offset;
        side.big_endian = desc->big_endian;
    } else {
        FM_TRY(read_sidecar(reader, &side, &found));
        if (!found) {
            found = reader->path && layout_from_name(reader->path, side.axes, &side.type);
            side.offset = desc->offset;
            side.big_endian = desc->big_endian;
        }
    }
    if (!given && !found) {
        return fm_input_fail(
            reader->input, FM_ERROR_FORMAT,
            "is raw, and its shape is not known: give shape and type, or name it as in bone_256x256x99_u16.raw, or put a "
            "sidecar beside it");
    }
    fm_file_info *info = &reader->info;
    memcpy(info->spacing, side.spacing, sizeof info->spacing);
    info->has_spacing = side.has_spacing;
    memcpy(info->origin, side.origin, sizeof info->origin);
    info->big_endian = side.big_endian;
    reader->dense.type = side.type;
    reader->dense.swap = side.big_endian != fm_machine_is_big_endian();
    FM_TRY(fm_reader_shape(reader, side.axes, 3, NULL));
    FM_TRY(fm_input_skip(reader->input, side.offset, "the bytes before its elements"));
    return fm_dense_require(reader);
}

static fm_result write_sidecar(fm_writer *writer) {
    uint64_t size;
    char *name = fm_name_with_suffix(writer->allocator, writer->path, 0, ".txt", &size);
    if (!name) {
        return FM_ERROR_OUT_OF_HOST_MEMORY;
    }
    fm_result result = fm_output_open(writer->allocator, name, false, &writer->second);
    fm_free(writer->allocator, name, size);
    FM_TRY(result);
    const fm_volume_desc *desc = &writer->volume->desc;
    return fm_writer_text(
        writer->second,
        "fathom raw 1\nshape %u %u %u\ntype %s\nbyte_order %s\noffset 0\nspacing %.17g %.17g %.17g\norigin %.17g %.17g "
        "%.17g\n",
        desc->shape.x, desc->shape.y, desc->shape.z, fm_type_name(desc->type), fm_machine_is_big_endian() ? "big" : "little",
        desc->spacing[0], desc->spacing[1], desc->spacing[2], desc->origin[0], desc->origin[1], desc->origin[2]);
}

static fm_result raw_write(fm_writer *writer) {
    FM_TRY(fm_writer_open(writer, writer->gzip));
    if (!fm_output_is_direct(writer->output)) {
        FM_TRY(write_sidecar(writer));
    }
    return fm_writer_elements(writer, writer->output, false);
}

static const char *const extensions[] = {".raw", NULL};

const fm_codec fm_codec_raw = {
    .format = FM_FORMAT_RAW,
    .name = "raw",
    .extensions = extensions,
    .no_magic = true,
    .matches = raw_matches,
    .open = raw_open,
    .load = fm_dense_load,
    .write = raw_write,
};
