// SPDX-License-Identifier: MIT

// NumPy's .npy, versions 1 to 3. The header is a Python dictionary of three known keys, parsed as just that.

#include "io/file.h"

#include <stdio.h>
#include <string.h>

enum { MAX_HEADER = 1 << 16, MAX_AXES = 32 };

typedef struct npy_header {
    char descr[64];
    bool fortran_order;
    bool has_descr, has_order, has_shape;
    uint64_t axes[MAX_AXES];  // slowest first in C order
    uint32_t count;
} npy_header;

static bool npy_matches(const uint8_t *head, size_t size) {
    return size >= 6 && memcmp(head, "\x93NUMPY", 6) == 0;
}

static void skip_space(const char **at) {
    while (**at == ' ' || **at == '\t' || **at == '\n' || **at == '\r') {
        ++*at;
    }
}

static bool take(const char **at, const char *token) {
    skip_space(at);
    size_t length = strlen(token);
    if (strncmp(*at, token, length) != 0) {
        return false;
    }
    *at += length;
    return true;
}

static bool take_string(const char **at, char *text, size_t capacity) {
    skip_space(at);
    char quote = **at;
    if (quote != '\'' && quote != '"') {
        return false;
    }
    const char *start = ++*at;
    while (**at && **at != quote) {
        ++*at;
    }
    size_t length = (size_t)(*at - start);
    if (!**at || length >= capacity) {
        return false;
    }
    memcpy(text, start, length);
    text[length] = 0;
    ++*at;
    return true;
}

static bool take_number(const char **at, uint64_t *number) {
    skip_space(at);
    if (**at < '0' || **at > '9') {
        return false;
    }
    *number = 0;
    for (; **at >= '0' && **at <= '9'; ++*at) {
        if (fm_mul_overflows(*number, 10, number) || fm_add_overflows(*number, (uint64_t)(**at - '0'), number)) {
            return false;
        }
    }
    // Python 2 wrote long integers with an L.
    if (**at == 'L') {
        ++*at;
    }
    return true;
}

static bool take_shape(const char **at, npy_header *header) {
    if (!take(at, "(")) {
        return false;
    }
    while (!take(at, ")")) {
        if (header->count == MAX_AXES || !take_number(at, &header->axes[header->count++])) {
            return false;
        }
        if (!take(at, ",")) {
            return take(at, ")");
        }
    }
    return true;
}

static bool parse_dictionary(const char *at, npy_header *header) {
    char key[32];
    if (!take(&at, "{")) {
        return false;
    }
    while (!take(&at, "}")) {
        if (!take_string(&at, key, sizeof key) || !take(&at, ":")) {
            return false;
        }
        if (strcmp(key, "descr") == 0 && !header->has_descr) {
            header->has_descr = true;
            skip_space(&at);
            // A list is a structured type; its text is only shown.
            if (*at == '[') {
                snprintf(header->descr, sizeof header->descr, "structured");
                return true;
            }
            if (!take_string(&at, header->descr, sizeof header->descr)) {
                return false;
            }
        } else if (strcmp(key, "fortran_order") == 0 && !header->has_order) {
            header->has_order = true;
            header->fortran_order = take(&at, "True");
            if (!header->fortran_order && !take(&at, "False")) {
                return false;
            }
        } else if (strcmp(key, "shape") == 0 && !header->has_shape) {
            header->has_shape = true;
            if (!take_shape(&at, header)) {
                return false;
            }
        } else {
            return false;
        }
        if (!take(&at, ",") && *at != '}') {
            skip_space(&at);
            if (*at != '}') {
                return false;
            }
        }
    }
    skip_space(&at);
    return *at == 0 && header->has_descr && header->has_order && header->has_shape;
}

static fm_result read_header_text(fm_reader *reader, char *text) {
    uint8_t fixed[12];
    FM_TRY(fm_input_read(reader->input, fixed, 8, "its header"));
    if (fixed[6] < 1 || fixed[6] > 3) {
        return fm_input_fail(reader->input, FM_ERROR_UNSUPPORTED, "is .npy of version %u.%u: versions 1 to 3 are read", fixed[6],
                             fixed[7]);
    }
    size_t width = fixed[6] == 1 ? 2 : 4;
    FM_TRY(fm_input_read(reader->input, fixed + 8, width, "its header"));
    uint32_t length = fixed[8] | (uint32_t)fixed[9] << 8;
    if (width == 4) {
        length |= (uint32_t)fixed[10] << 16 | (uint32_t)fixed[11] << 24;
    }
    if (length >= MAX_HEADER) {
        return fm_input_fail(reader->input, FM_ERROR_FORMAT, "claims a header of %u bytes: at most %d are read", length,
                             MAX_HEADER - 1);
    }
    FM_TRY(fm_input_read(reader->input, text, length, "its header"));
    text[length] = 0;
    if (strlen(text) != length) {
        return fm_input_fail(reader->input, FM_ERROR_FORMAT, "has a NUL byte in its header");
    }
    return FM_OK;
}

static fm_result parse_type(fm_reader *reader, const char *descr) {
    static const struct {
        const char *code;
        fm_type type;
    } rows[] = {
        {"b1", FM_TYPE_U8},  {"u1", FM_TYPE_U8},  {"u2", FM_TYPE_U16}, {"u4", FM_TYPE_U32}, {"u8", FM_TYPE_U64}, {"i1", FM_TYPE_I8},
        {"i2", FM_TYPE_I16}, {"i4", FM_TYPE_I32}, {"i8", FM_TYPE_I64}, {"f4", FM_TYPE_F32}, {"f8", FM_TYPE_F64},
    };
    bool has_order = descr[0] && strchr("<>|=", descr[0]);
    const char *code = descr + (has_order ? 1 : 0);
    for (size_t i = 0; i < sizeof rows / sizeof rows[0]; i++) {
        if (strcmp(code, rows[i].code) == 0) {
            bool wide = fm_type_size(rows[i].type) > 1;
            reader->dense.type = rows[i].type;
            reader->info.big_endian = wide && descr[0] == '>';
            reader->dense.swap = wide && ((descr[0] == '>') != fm_machine_is_big_endian()) && (descr[0] == '>' || descr[0] == '<');
            if (code[0] == 'b') {
                fm_reader_note(reader, "booleans, read as uint8");
            }
            return FM_OK;
        }
    }
    return fm_input_fail(
        reader->input, FM_ERROR_UNSUPPORTED,
        "has elements of type \"%.60s\": integers of 1 to 8 bytes, float32, float64 and bool are read; convert it with "
        "astype",
        descr);
}

static fm_result npy_parse(fm_reader *reader, char *text) {
    FM_TRY(read_header_text(reader, text));
    npy_header header = {0};
    bool parsed = parse_dictionary(text, &header);
    if (header.has_descr && (parsed || strcmp(header.descr, "structured") == 0)) {
        FM_TRY(parse_type(reader, header.descr));
    }
    if (!parsed) {
        return fm_input_fail(reader->input, FM_ERROR_FORMAT,
                             "has a damaged .npy header: descr, fortran_order and shape are expected in it");
    }
    uint64_t axes[MAX_AXES];  // fastest first
    for (uint32_t i = 0; i < header.count; i++) {
        axes[i] = header.axes[header.count - 1 - i];
    }
    FM_TRY(fm_reader_shape(reader, axes, header.count, NULL));
    reader->dense.fortran_order = header.fortran_order && header.count > 1;
    reader->info.fortran_order = reader->dense.fortran_order;
    if (reader->dense.fortran_order) {
        fm_reader_note(reader, "Fortran order, transposed to C order");
    }
    return fm_dense_require(reader);
}

static fm_result npy_open(fm_reader *reader) {
    char *text = fm_alloc(reader->allocator, MAX_HEADER, "a header");
    if (!text) {
        return FM_ERROR_OUT_OF_HOST_MEMORY;
    }
    fm_result result = npy_parse(reader, text);
    fm_free(reader->allocator, text, MAX_HEADER);
    return result;
}

static const char *npy_code(fm_type type) {
    switch (type) {
    case FM_TYPE_BITS:
        return "b1";
    case FM_TYPE_U8:
        return "u1";
    case FM_TYPE_U16:
        return "u2";
    case FM_TYPE_U32:
        return "u4";
    case FM_TYPE_U64:
        return "u8";
    case FM_TYPE_I8:
        return "i1";
    case FM_TYPE_I16:
        return "i2";
    case FM_TYPE_I32:
        return "i4";
    case FM_TYPE_I64:
        return "i8";
    case FM_TYPE_F32:
        return "f4";
    case FM_TYPE_F64:
        return "f8";
    }
    return "";
}

static fm_result npy_write(fm_writer *writer) {
    enum { PREFIX = 10, ALIGNED = 128 };
    fm_shape shape = writer->volume->desc.shape;
    fm_type type = writer->volume->desc.type;
    char order = fm_type_size(type) <= 1 ? '|' : fm_machine_is_big_endian() ? '>' : '<';
    char header[ALIGNED * 2];
    int length =
        snprintf(header, sizeof header, "\x93NUMPY\x01%c%c%c{'descr': '%c%s', 'fortran_order': False, 'shape': (%u, %u, %u), }", 0,
                 0, 0, order, npy_code(type), shape.z, shape.y, shape.x);
    // The elements begin on a multiple of 64 bytes, the header's last byte being a newline.
    uint32_t total = (uint32_t)fm_round_up((uint64_t)length + 1, 64);
    memset(header + length, ' ', total - (uint32_t)length);
    header[total - 1] = '\n';
    header[8] = (char)((total - PREFIX) & 0xff);
    header[9] = (char)((total - PREFIX) >> 8);
    FM_TRY(fm_writer_open(writer, writer->gzip));
    FM_TRY(fm_output_write(writer->output, header, total));
    return fm_writer_elements(writer, writer->output, true);
}

static const char *const extensions[] = {".npy", NULL};

const fm_codec fm_codec_npy = {
    .format = FM_FORMAT_NPY,
    .name = "npy",
    .extensions = extensions,
    .matches = npy_matches,
    .open = npy_open,
    .load = fm_dense_load,
    .write = npy_write,
};
