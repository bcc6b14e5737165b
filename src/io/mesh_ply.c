// SPDX-License-Identifier: MIT

// PLY files: a header that says what follows, element by element, property by property, as text or binary.
// Source: G. Turk, "The PLY Polygon File Format", Stanford University, 1994.

#include "io/file.h"
#include "io/mesh_file.h"

#include <stdio.h>
#include <string.h>

enum {
    MOST_ELEMENTS = 64,
    MOST_PROPERTIES = 1024,
    HEADER_LINE = 4096,
    TOKEN = 512,  // no number is longer
};

typedef enum ply_type { I8, U8, I16, U16, I32, U32, F32, F64 } ply_type;

static const uint8_t type_sizes[] = {1, 1, 2, 2, 4, 4, 4, 8};

// What a property is for: x, y, z of a position (0 to 2), a list of corners, or nothing.
typedef enum ply_role { ROLE_X = 0, ROLE_Y, ROLE_Z, ROLE_CORNERS, ROLE_NONE } ply_role;

typedef struct ply_property {
    ply_role role;
    bool list;
    ply_type type;
    ply_type count_type;  // of a list
} ply_property;

typedef enum ply_kind { KIND_OTHER = 0, KIND_VERTEX, KIND_FACE, KIND_STRIPS } ply_kind;

typedef struct ply_element {
    ply_kind kind;
    uint64_t count;
    uint32_t first, properties;  // in the file's array of properties
    bool has_list;
    uint64_t least;  // bytes that a row has at least: exact in a binary file without lists
} ply_element;

typedef struct ply {
    fm_mesh_reader *reader;
    fm_blocks *blocks;
    bool ascii, swap;
    uint64_t vertices;  // of the header
    uint32_t element_count, property_count;
    ply_element elements[MOST_ELEMENTS];
    ply_property properties[MOST_PROPERTIES];
} ply;

// ---------------------------------------------------------------------------------------------------------------------------
// Header
// ---------------------------------------------------------------------------------------------------------------------------

static bool ply_matches(const uint8_t *head, size_t size) {
    return size >= 4 && memcmp(head, "ply", 3) == 0 && (head[3] == '\n' || head[3] == '\r');
}

static bool parse_type(const char *word, ply_type *type) {
    static const char *const names[][2] = {{"char", "int8"}, {"uchar", "uint8"}, {"short", "int16"},   {"ushort", "uint16"},
                                           {"int", "int32"}, {"uint", "uint32"}, {"float", "float32"}, {"double", "float64"}};
    for (int i = 0; i < 8; i++) {
        if (strcmp(word, names[i][0]) == 0 || strcmp(word, names[i][1]) == 0) {
            *type = (ply_type)i;
            return true;
        }
    }
    return false;
}

static fm_result bad_line(const ply *p, const char *line) {
    return fm_input_fail(p->reader->input, FM_ERROR_FORMAT, "has a header line that is not understood: \"%.60s\"", line);
}

static fm_result parse_format(ply *p, const char *line, const char *name) {
    const bool big = strcmp(name, "binary_big_endian") == 0;
    p->ascii = strcmp(name, "ascii") == 0;
    if (!p->ascii && !big && strcmp(name, "binary_little_endian") != 0) {
        return bad_line(p, line);
    }
    p->swap = !p->ascii && big != fm_machine_is_big_endian();
    p->reader->info.binary = !p->ascii;
    p->reader->info.big_endian = big;
    return FM_OK;
}

static fm_result parse_element(ply *p, const char *line, const char *name, const char *number) {
    int64_t count = 0;
    const uint8_t *end = fm_parse_integer((const uint8_t *)number, &count);
    if (!end || *end || count < 0) {
        return bad_line(p, line);
    }
    if (p->element_count == MOST_ELEMENTS) {
        return fm_input_fail(p->reader->input, FM_ERROR_UNSUPPORTED, "has over %d elements: write it with fewer", MOST_ELEMENTS);
    }
    const ply_kind kind = strcmp(name, "vertex") == 0      ? KIND_VERTEX
                          : strcmp(name, "face") == 0      ? KIND_FACE
                          : strcmp(name, "tristrips") == 0 ? KIND_STRIPS
                                                           : KIND_OTHER;
    for (uint32_t i = 0; i < p->element_count && kind == KIND_VERTEX; i++) {
        if (p->elements[i].kind == KIND_VERTEX) {
            return fm_input_fail(p->reader->input, FM_ERROR_FORMAT, "has the element \"vertex\" twice: remove one of them");
        }
    }
    if (kind == KIND_VERTEX) {
        p->vertices = (uint64_t)count;
    }
    p->elements[p->element_count++] = (ply_element){.kind = kind, .count = (uint64_t)count, .first = p->property_count};
    return FM_OK;
}

static ply_role role_of(ply_kind kind, bool list, const char *name) {
    if (kind == KIND_VERTEX && !list && name[0] >= 'x' && name[0] <= 'z' && name[1] == 0) {
        return (ply_role)(name[0] - 'x');
    }
    const bool corners = strcmp(name, "vertex_indices") == 0 || strcmp(name, "vertex_index") == 0;
    return (kind == KIND_FACE || kind == KIND_STRIPS) && list && corners ? ROLE_CORNERS : ROLE_NONE;
}

// `words` are those behind "property".
static fm_result parse_property(ply *p, const char *line, char words[4][32], int count) {
    ply_property property = {.list = strcmp(words[0], "list") == 0};
    const bool good = property.list ? count == 4 && parse_type(words[1], &property.count_type) && property.count_type < F32 &&
                                          parse_type(words[2], &property.type)
                                    : count == 2 && parse_type(words[0], &property.type);
    if (!good || p->element_count == 0) {
        return bad_line(p, line);
    }
    if (p->property_count == MOST_PROPERTIES) {
        return fm_input_fail(p->reader->input, FM_ERROR_UNSUPPORTED, "has over %d properties: write it with fewer",
                             MOST_PROPERTIES);
    }
    ply_element *element = &p->elements[p->element_count - 1];
    property.role = role_of(element->kind, property.list, words[count - 1]);
    for (uint32_t i = element->first; i < p->property_count; i++) {
        if (property.role != ROLE_NONE && p->properties[i].role == property.role) {
            return fm_input_fail(p->reader->input, FM_ERROR_FORMAT,
                                 "has the property \"%s\" twice in an element: remove one of them", words[count - 1]);
        }
    }
    element->has_list = element->has_list || property.list;
    // A number of text and what parts it from the next.
    element->least += p->ascii ? 2 : type_sizes[property.list ? property.count_type : property.type];
    element->properties++;
    p->properties[p->property_count++] = property;
    return FM_OK;
}

static fm_result parse_header(ply *p) {
    char line[HEADER_LINE];
    bool format = false;
    FM_TRY(fm_input_line(p->reader->input, line, sizeof line, NULL));
    for (;;) {
        char key[32] = "", words[4][32] = {"", "", "", ""};
        FM_TRY(fm_input_line(p->reader->input, line, sizeof line, NULL));
        const int count = sscanf(line, "%31s %31s %31s %31s %31s", key, words[0], words[1], words[2], words[3]) - 1;
        if (strcmp(key, "end_header") == 0) {
            break;
        }
        if (count < 0 || strcmp(key, "comment") == 0 || strcmp(key, "obj_info") == 0) {
            continue;
        }
        if (strcmp(key, "format") == 0) {
            FM_TRY(parse_format(p, line, words[0]));
            format = true;
        } else if (format && strcmp(key, "element") == 0 && count == 2) {
            FM_TRY(parse_element(p, line, words[0], words[1]));
        } else if (format && strcmp(key, "property") == 0) {
            FM_TRY(parse_property(p, line, words, count));
        } else {
            return bad_line(p, line);
        }
    }
    return format ? FM_OK : fm_input_fail(p->reader->input, FM_ERROR_FORMAT, "lacks the header line \"format\": get it again");
}

static const ply_property *find_role(const ply *p, const ply_element *element, ply_role role) {
    for (uint32_t i = 0; i < element->properties; i++) {
        if (p->properties[element->first + i].role == role) {
            return &p->properties[element->first + i];
        }
    }
    return NULL;
}

// What the header must have, and that the file can be as long as the header says.
static fm_result check_header(ply *p) {
    uint64_t bytes = 0, triangles = 0;
    for (uint32_t i = 0; i < p->element_count; i++) {
        const ply_element *element = &p->elements[i];
        uint64_t rows;
        if (fm_mul_overflows(element->count, element->least, &rows) || fm_add_overflows(bytes, rows, &bytes)) {
            return fm_input_fail(p->reader->input, FM_ERROR_FORMAT, "has a header that claims more than any file can hold");
        }
        for (ply_role role = ROLE_X; element->kind == KIND_VERTEX && role <= ROLE_Z; role++) {
            if (!find_role(p, element, role)) {
                return fm_input_fail(p->reader->input, FM_ERROR_FORMAT, "has vertices without \"%c\": not a mesh in space",
                                     'x' + (int)role);
            }
        }
        const bool faces = element->kind == KIND_FACE || element->kind == KIND_STRIPS;
        if (faces && element->count > 0 && !find_role(p, element, ROLE_CORNERS)) {
            return fm_input_fail(p->reader->input, FM_ERROR_UNSUPPORTED, "has faces without a list \"vertex_indices\"");
        }
        triangles += element->kind == KIND_FACE ? element->count : 0;
    }
    // The last number of a text needs nothing behind it.
    FM_TRY(fm_input_require(p->reader->input, bytes - (p->ascii && bytes > 0), "what its header announces"));
    return fm_mesh_expect(p->reader, p->vertices, triangles);
}

// ---------------------------------------------------------------------------------------------------------------------------
// Values
// ---------------------------------------------------------------------------------------------------------------------------

static inline double load(const uint8_t *bytes, ply_type type, bool swap) {
    uint8_t turned[8];
    if (swap) {
        for (int i = 0; i < type_sizes[type]; i++) {
            turned[i] = bytes[type_sizes[type] - 1 - i];
        }
        bytes = turned;
    }
    union {
        int8_t i8;
        uint8_t u8;
        int16_t i16;
        uint16_t u16;
        int32_t i32;
        uint32_t u32;
        float f32;
        double f64;
    } value;
    memcpy(&value, bytes, type_sizes[type]);
    switch (type) {
    case I8:
        return value.i8;
    case U8:
        return value.u8;
    case I16:
        return value.i16;
    case U16:
        return value.u16;
    case I32:
        return value.i32;
    case U32:
        return value.u32;
    case F32:
        return (double)value.f32;
    default:
        return value.f64;
    }
}

static fm_result bad_value(const ply *p, const ply_element *element, uint64_t row) {
    static const char *const kinds[] = {"row", "vertex", "face", "strip"};
    char word[24];
    size_t length = 0;
    while (length < sizeof word - 1 && p->blocks->at + length < p->blocks->end && p->blocks->at[length] > ' ' &&
           p->blocks->at[length] < 127) {
        word[length] = (char)p->blocks->at[length];
        length++;
    }
    word[length] = 0;
    if (p->blocks->at == p->blocks->end) {
        return fm_input_fail(p->reader->input, FM_ERROR_FORMAT, "ends within %s %llu: the file is truncated, get it again",
                             kinds[element->kind], (unsigned long long)row);
    }
    return fm_input_fail(p->reader->input, FM_ERROR_FORMAT, "has \"%s\" in %s %llu, where a number is wanted", word,
                         kinds[element->kind], (unsigned long long)row);
}

// The next word of a text lies complete at `blocks->at`.
static fm_result next_word(ply *p) {
    fm_blocks *blocks = p->blocks;
    for (;;) {
        FM_TRY(fm_blocks_want(blocks, TOKEN));
        while (fm_is_space(*blocks->at)) {
            blocks->at++;
        }
        if (fm_blocks_left(blocks) >= TOKEN || blocks->ended) {
            return FM_OK;
        }
    }
}

static inline bool word_ends(const fm_blocks *blocks, const uint8_t *at) {
    return at && at <= blocks->end && at - blocks->at < TOKEN && (fm_is_space(*at) || at == blocks->end);
}

static inline fm_result next_float(ply *p, const ply_element *element, uint64_t row, ply_type type, float *value) {
    fm_blocks *blocks = p->blocks;
    if (!p->ascii) {
        FM_TRY(fm_blocks_need(blocks, type_sizes[type], "its elements"));
        *value = (float)load(blocks->at, type, p->swap);
        blocks->at += type_sizes[type];
        return FM_OK;
    }
    FM_TRY(next_word(p));
    const uint8_t *end = fm_parse_float(blocks->at, value);
    if (!word_ends(blocks, end)) {
        return bad_value(p, element, row);
    }
    blocks->at += end - blocks->at;
    return FM_OK;
}

// A whole number, which may be stored in floating point: 1.5 is refused, and what is NaN or beyond 2^62 in size becomes -2^62.
static inline fm_result next_integer(ply *p, const ply_element *element, uint64_t row, ply_type type, int64_t *value) {
    fm_blocks *blocks = p->blocks;
    if (!p->ascii) {
        FM_TRY(fm_blocks_need(blocks, type_sizes[type], "its elements"));
        const double number = load(blocks->at, type, p->swap);
        *value = number > -0x1p62 && number < 0x1p62 ? (int64_t)number : INT64_MIN / 2;
        if (number > -0x1p62 && number < 0x1p62 && number != (double)*value) {
            return fm_input_fail(p->reader->input, FM_ERROR_FORMAT, "has %g in row %llu of its lists: a whole number is needed",
                                 number, (unsigned long long)row);
        }
        blocks->at += type_sizes[type];
        return FM_OK;
    }
    FM_TRY(next_word(p));
    const uint8_t *end = fm_parse_integer(blocks->at, value);
    if (!word_ends(blocks, end)) {
        return bad_value(p, element, row);
    }
    blocks->at += end - blocks->at;
    return FM_OK;
}

static fm_result skip_values(ply *p, const ply_element *element, uint64_t row, ply_type type, uint64_t count) {
    if (!p->ascii) {
        return fm_blocks_skip(p->blocks, count * type_sizes[type], "its elements");
    }
    for (uint64_t i = 0; i < count; i++) {
        FM_TRY(next_word(p));
        if (p->blocks->at == p->blocks->end) {
            return bad_value(p, element, row);
        }
        while (p->blocks->at < p->blocks->end && !fm_is_space(*p->blocks->at)) {
            p->blocks->at++;
        }
    }
    return FM_OK;
}

static fm_result list_count(ply *p, const ply_element *element, uint64_t row, const ply_property *property, uint64_t *count) {
    int64_t value = 0;
    FM_TRY(next_integer(p, element, row, property->count_type, &value));
    if (value < 0 || value > UINT32_MAX) {
        return fm_input_fail(p->reader->input, FM_ERROR_FORMAT, "has a list of %lld values in row %llu", (long long)value,
                             (unsigned long long)row);
    }
    *count = (uint64_t)value;
    return FM_OK;
}

// ---------------------------------------------------------------------------------------------------------------------------
// Elements
// ---------------------------------------------------------------------------------------------------------------------------

static fm_result corner_out_of_range(const ply *p, const ply_element *element, uint64_t row, int64_t corner) {
    return fm_input_fail(p->reader->input, FM_ERROR_FORMAT, "has vertex %lld in %s %llu, but its %llu vertices are 0 to %lld",
                         (long long)corner, element->kind == KIND_STRIPS ? "strip" : "face", (unsigned long long)row,
                         (unsigned long long)p->vertices, (long long)p->vertices - 1);
}

static inline fm_result next_corner(ply *p, const ply_element *element, uint64_t row, ply_type type, uint32_t *corner) {
    int64_t value = 0;
    FM_TRY(next_integer(p, element, row, type, &value));
    if (value < 0 || (uint64_t)value >= p->vertices) {
        return corner_out_of_range(p, element, row, value);
    }
    *corner = (uint32_t)value;
    return FM_OK;
}

static fm_result read_polygon(ply *p, const ply_element *element, uint64_t row, const ply_property *property) {
    uint64_t count = 0;
    uint32_t first = 0, before = 0, corner = 0;
    FM_TRY(list_count(p, element, row, property, &count));
    p->reader->small_faces += count < 3;
    for (uint64_t i = 0; i < count; i++, before = corner) {
        FM_TRY(next_corner(p, element, row, property->type, &corner));
        if (i == 0) {
            first = corner;
        } else if (i > 1) {
            FM_TRY(fm_mesh_add_triangle(p->reader, first, before, corner));
        }
    }
    return FM_OK;
}

// Every second triangle is turned; -1 begins a new strip. Triangles that name a vertex twice only lead on to the next ones.
static fm_result read_strip(ply *p, const ply_element *element, uint64_t row, const ply_property *property) {
    uint64_t count = 0, length = 0;
    uint32_t last[2] = {0, 0};
    FM_TRY(list_count(p, element, row, property, &count));
    for (uint64_t i = 0; i < count; i++) {
        int64_t value = 0;
        FM_TRY(next_integer(p, element, row, property->type, &value));
        if (value == -1) {
            length = 0;
            continue;
        }
        if (value < 0 || (uint64_t)value >= p->vertices) {
            return corner_out_of_range(p, element, row, value);
        }
        const uint32_t corner = (uint32_t)value;
        if (length >= 2 && corner != last[0] && corner != last[1] && last[0] != last[1]) {
            const bool turned = length % 2;
            FM_TRY(fm_mesh_add_triangle(p->reader, last[turned], last[!turned], corner));
        }
        last[0] = last[1];
        last[1] = corner;
        length++;
    }
    return FM_OK;
}

static fm_result read_row(ply *p, const ply_element *element, uint64_t row) {
    float position[3] = {0, 0, 0};
    for (uint32_t i = 0; i < element->properties; i++) {
        const ply_property *property = &p->properties[element->first + i];
        if (property->role <= ROLE_Z) {
            FM_TRY(next_float(p, element, row, property->type, &position[property->role]));
        } else if (property->role == ROLE_CORNERS) {
            FM_TRY(element->kind == KIND_FACE ? read_polygon(p, element, row, property) : read_strip(p, element, row, property));
        } else {
            uint64_t count = 1;
            if (property->list) {
                FM_TRY(list_count(p, element, row, property, &count));
            }
            FM_TRY(skip_values(p, element, row, property->type, count));
        }
    }
    return element->kind == KIND_VERTEX ? fm_mesh_add_vertex(p->reader, position) : FM_OK;
}

// Positions among rows of one size. `types` and `offsets` are those of x, y and z.
static fm_result read_vertices(ply *p, const ply_element *element) {
    ply_type types[3] = {F32, F32, F32};
    uint64_t offsets[3] = {0, 0, 0}, offset = 0;
    for (uint32_t i = 0; i < element->properties; i++) {
        const ply_property *property = &p->properties[element->first + i];
        if (property->role <= ROLE_Z) {
            types[property->role] = property->type;
            offsets[property->role] = offset;
        }
        offset += type_sizes[property->type];
    }
    const size_t stride = (size_t)offset;
    const bool plain = types[0] == F32 && types[1] == F32 && types[2] == F32 && offsets[1] == offsets[0] + 4 &&
                       offsets[2] == offsets[0] + 8 && !p->swap;
    fm_mesh_reader *reader = p->reader;
    if (plain && stride == 12 && reader->vertex_capacity >= element->count) {
        reader->vertex_count = element->count;
        return fm_blocks_read(p->blocks, reader->vertices, element->count * 12, "its vertices");
    }
    for (uint64_t left = element->count; left > 0;) {
        FM_TRY(fm_blocks_need(p->blocks, stride, "its vertices"));
        uint64_t rows = fm_min_u64(left, fm_blocks_left(p->blocks) / stride);
        left -= rows;
        for (; rows > 0; rows--, p->blocks->at += stride) {
            float position[3];
            if (plain) {
                memcpy(position, p->blocks->at + offsets[0], sizeof position);
            } else {
                for (int k = 0; k < 3; k++) {
                    position[k] = (float)load(p->blocks->at + offsets[k], types[k], p->swap);
                }
            }
            FM_TRY(fm_mesh_add_vertex(reader, position));
        }
    }
    return FM_OK;
}

// How many bytes of a face stand before and after its list, when that list is all that is not of one size, has a count of one byte
// and corners of four bytes.
static bool common_face(const ply *p, const ply_element *element, size_t *before, size_t *after) {
    bool passed = false;
    *before = *after = 0;
    for (uint32_t i = 0; i < element->properties; i++) {
        const ply_property *property = &p->properties[element->first + i];
        if (property->role == ROLE_CORNERS) {
            passed = true;
            if (property->count_type > U8 || (property->type != I32 && property->type != U32)) {
                return false;
            }
        } else if (property->list) {
            return false;
        } else {
            *(passed ? after : before) += type_sizes[property->type];
        }
    }
    return passed && !p->ascii;
}

// Triangles in a row that lie complete in memory and name vertices that exist; 0 when something else comes.
static inline uint64_t take_triangles(ply *p, size_t before, size_t after, uint64_t most, bool swap) {
    fm_mesh_reader *reader = p->reader;
    const size_t stride = before + 13 + after;
    const uint8_t *at = p->blocks->at + before;
    most = fm_min_u64(most, fm_blocks_left(p->blocks) / stride);
    most = fm_min_u64(most, reader->triangle_capacity - reader->triangle_count);
    uint64_t taken = 0;
    for (; taken < most && *at == 3; taken++, at += stride) {
        uint32_t corners[3];
        memcpy(corners, at + 1, sizeof corners);
        if (swap) {
            for (int k = 0; k < 3; k++) {
                corners[k] = __builtin_bswap32(corners[k]);
            }
        }
        if (corners[0] >= p->vertices || corners[1] >= p->vertices || corners[2] >= p->vertices) {
            break;
        }
        memcpy(reader->triangles[reader->triangle_count + taken], corners, sizeof corners);
    }
    reader->triangle_count += taken;
    p->blocks->at += taken * stride;
    return taken;
}

static fm_result read_faces(ply *p, const ply_element *element) {
    size_t before, after;
    const bool common = common_face(p, element, &before, &after);
    for (uint64_t row = 0; row < element->count;) {
        const uint64_t left = element->count - row;
        if (common) {
            row += p->swap ? take_triangles(p, before, after, left, true) : take_triangles(p, before, after, left, false);
        }
        if (row < element->count) {
            FM_TRY(read_row(p, element, row++));
        }
    }
    return FM_OK;
}

static fm_result read_element(ply *p, const ply_element *element) {
    if (element->properties == 0) {
        return FM_OK;
    }
    if (element->kind == KIND_FACE || element->kind == KIND_STRIPS) {
        p->reader->info.faces += element->count;
        return read_faces(p, element);
    }
    if (!p->ascii && !element->has_list) {
        return element->kind == KIND_VERTEX ? read_vertices(p, element)
                                            : fm_blocks_skip(p->blocks, element->count * element->least, "its elements");
    }
    for (uint64_t row = 0; row < element->count; row++) {
        FM_TRY(read_row(p, element, row));
    }
    return FM_OK;
}

static fm_result read_body(ply *p) {
    FM_TRY(parse_header(p));
    FM_TRY(check_header(p));
    for (uint32_t i = 0; i < p->element_count; i++) {
        FM_TRY(read_element(p, &p->elements[i]));
    }
    return fm_mesh_set_rest_aside(p->reader);
}

static fm_result ply_read(fm_mesh_reader *reader) {
    const uint8_t *head;
    size_t size;
    FM_TRY(fm_input_peek(reader->input, 4, &head, &size));
    if (!ply_matches(head, size)) {
        return fm_input_fail(reader->input, FM_ERROR_FORMAT, "is no PLY file: it does not begin as one");
    }
    ply *p = fm_alloc_zero(reader->allocator, sizeof *p, "a PLY file's header");
    if (!p) {
        return FM_ERROR_OUT_OF_HOST_MEMORY;
    }
    p->reader = reader;
    p->blocks = &reader->blocks;
    const fm_result result = read_body(p);
    fm_free(reader->allocator, p, sizeof *p);
    return result;
}

// ---------------------------------------------------------------------------------------------------------------------------
// Writing
// ---------------------------------------------------------------------------------------------------------------------------

static fm_result ply_write(fm_mesh_writer *writer) {
    const uint64_t total = writer->vertex_count + writer->triangle_count;
    FM_TRY(
        fm_writer_text(writer->output,
                       "ply\nformat binary_%s_endian 1.0\ncomment by fathom\nelement vertex %llu\nproperty float x\nproperty float "
                       "y\nproperty float z\nelement face %llu\nproperty list uchar %s vertex_indices\nend_header\n",
                       fm_machine_is_big_endian() ? "big" : "little", (unsigned long long)writer->vertex_count,
                       (unsigned long long)writer->triangle_count, writer->vertex_count > INT32_MAX ? "uint" : "int"));
    for (uint64_t i = 0; i < writer->vertex_count; i += FM_MESH_PIECE) {
        if (!fm_mesh_writer_progress(writer, i, total)) {
            return FM_ERROR_IO;
        }
        const uint64_t count = fm_min_u64(FM_MESH_PIECE, writer->vertex_count - i);
        FM_TRY(fm_output_write(writer->output, writer->vertices + i, count * sizeof writer->vertices[0]));
    }
    enum { ROWS = 1024, ROW = 13 };
    uint8_t rows[ROWS * ROW];
    for (uint64_t i = 0; i < writer->triangle_count; i += ROWS) {
        if (i % FM_MESH_PIECE == 0 && !fm_mesh_writer_progress(writer, writer->vertex_count + i, total)) {
            return FM_ERROR_IO;
        }
        const uint64_t count = fm_min_u64(ROWS, writer->triangle_count - i);
        for (uint64_t k = 0; k < count; k++) {
            rows[k * ROW] = 3;
            memcpy(rows + k * ROW + 1, writer->triangles[i + k], 12);
        }
        FM_TRY(fm_output_write(writer->output, rows, count * ROW));
    }
    return fm_mesh_writer_progress(writer, total, total) ? FM_OK : FM_ERROR_IO;
}

static const char *const extensions[] = {".ply", NULL};

const fm_mesh_codec fm_mesh_codec_ply = {
    .format = FM_MESH_FORMAT_PLY,
    .name = "PLY",
    .extensions = extensions,
    .matches = ply_matches,
    .read = ply_read,
    .write = ply_write,
};
