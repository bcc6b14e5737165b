// SPDX-License-Identifier: MIT

// glTF 2.0: a scene as JSON, its numbers in buffers, which lie in the same file (.glb), in data URIs or in files beside it.
// Source: Khronos Group, "glTF 2.0 Specification".

#include "io/file.h"
#include "io/mesh_file.h"

#include <cjson/cJSON.h>
#include <math.h>
#include <string.h>
#include <strings.h>

enum {
    CHUNK_JSON = 0x4e4f534a,
    CHUNK_BIN = 0x004e4942,
    MOST_JSON = 1 << 30,
    MODE_TRIANGLES = 4,
    MODE_STRIP = 5,
    MODE_FAN = 6,
};

typedef enum component { BYTE = 5120, UBYTE, SHORT, USHORT, UINT = 5125, FLOAT } component;

// An array of the document, for access by number.
typedef struct list {
    const cJSON **items;
    uint64_t count;
} list;

typedef struct buffer {
    uint8_t *data;  // NULL until it is needed
    uint64_t size;
} buffer;

typedef struct gltf {
    fm_mesh_reader *reader;
    cJSON *root;
    list accessors, views, buffers, meshes, nodes;
    buffer *loaded;  // one for each of `buffers`
    uint8_t *bin;    // the binary chunk
    uint64_t bin_size;
    uint64_t set_aside;  // primitives of points and lines
} gltf;

// Elements of an accessor, where they lie.
typedef struct elements {
    const uint8_t *data;  // NULL: zeros
    uint64_t stride;
    component type;
    uint64_t parts;  // 1 or 3
    bool normalized;
    uint64_t count;
    const cJSON *sparse;
} elements;

// Rows of an affine matrix.
typedef struct place {
    double rows[3][4];
} place;

static fm_result gltf_fails(const gltf *g, const char *what, uint64_t number) {
    return fm_input_fail(g->reader->input, FM_ERROR_FORMAT, "%s %llu: the file is damaged or its exporter was wrong", what,
                         (unsigned long long)number);
}

// ---------------------------------------------------------------------------------------------------------------------------
// The document
// ---------------------------------------------------------------------------------------------------------------------------

// A whole number of at least 0; `otherwise` when it is not there. False when it is something else.
static bool get_number(const cJSON *object, const char *key, uint64_t otherwise, uint64_t *value) {
    const cJSON *item = cJSON_GetObjectItemCaseSensitive(object, key);
    *value = otherwise;
    if (!item) {
        return true;
    }
    const double number = item->valuedouble;
    if (!cJSON_IsNumber(item) || !(number >= 0 && number <= 0x1p53) || number != floor(number)) {
        return false;
    }
    *value = (uint64_t)number;
    return true;
}

// `count` numbers of the array `key`; `values` stays as it is when there is none.
static bool get_doubles(const cJSON *object, const char *key, double *values, int count) {
    const cJSON *array = cJSON_GetObjectItemCaseSensitive(object, key);
    if (!array) {
        return true;
    }
    if (cJSON_GetArraySize(array) != count) {
        return false;
    }
    const cJSON *item;
    cJSON_ArrayForEach(item, array) {
        if (!cJSON_IsNumber(item)) {
            return false;
        }
        *values++ = item->valuedouble;
    }
    return true;
}

static fm_result make_list(const gltf *g, const char *key, list *l) {
    const cJSON *array = cJSON_GetObjectItemCaseSensitive(g->root, key);
    if (array && !cJSON_IsArray(array)) {
        return fm_input_fail(g->reader->input, FM_ERROR_FORMAT, "has \"%s\" that is no list: the file is damaged", key);
    }
    const uint64_t count = array ? (uint64_t)cJSON_GetArraySize(array) : 0;
    if (count == 0) {
        return FM_OK;
    }
    l->items = fm_alloc(g->reader->allocator, count * sizeof *l->items, "a document's lists");
    if (!l->items) {
        return FM_ERROR_OUT_OF_HOST_MEMORY;
    }
    const cJSON *item;
    cJSON_ArrayForEach(item, array) {
        l->items[l->count++] = item;
    }
    return FM_OK;
}

static fm_result check_version(const gltf *g) {
    const cJSON *asset = cJSON_GetObjectItemCaseSensitive(g->root, "asset");
    const char *version = cJSON_GetStringValue(cJSON_GetObjectItemCaseSensitive(asset, "version"));
    if (!version) {
        return fm_input_fail(g->reader->input, FM_ERROR_FORMAT, "has no \"asset\" with a \"version\": it is no glTF file");
    }
    if (strncmp(version, "2.", 2) != 0) {
        return fm_input_fail(g->reader->input, FM_ERROR_UNSUPPORTED, "is glTF %.16s: export it as glTF 2.0", version);
    }
    const cJSON *name, *required = cJSON_GetObjectItemCaseSensitive(g->root, "extensionsRequired");
    static const char *const unknown[] = {"KHR_draco_mesh_compression", "EXT_meshopt_compression", "EXT_mesh_gpu_instancing"};
    cJSON_ArrayForEach(name, required) {
        for (size_t i = 0; i < sizeof unknown / sizeof unknown[0]; i++) {
            if (cJSON_IsString(name) && strcmp(name->valuestring, unknown[i]) == 0) {
                return fm_input_fail(g->reader->input, FM_ERROR_UNSUPPORTED, "needs the extension %s: export it without",
                                     unknown[i]);
            }
        }
    }
    return FM_OK;
}

static fm_result parse_document(gltf *g, const uint8_t *text, uint64_t size) {
    const char *end = NULL;
    g->root = cJSON_ParseWithLengthOpts((const char *)text, (size_t)size, &end, false);
    if (!g->root) {
        return fm_input_fail(g->reader->input, FM_ERROR_FORMAT, "is not valid JSON at byte %lld: get the file again",
                             end ? (long long)((const uint8_t *)end - text) : 0);
    }
    FM_TRY(check_version(g));
    FM_TRY(make_list(g, "accessors", &g->accessors));
    FM_TRY(make_list(g, "bufferViews", &g->views));
    FM_TRY(make_list(g, "buffers", &g->buffers));
    FM_TRY(make_list(g, "meshes", &g->meshes));
    FM_TRY(make_list(g, "nodes", &g->nodes));
    if (g->buffers.count > 0) {
        g->loaded = fm_alloc_zero(g->reader->allocator, g->buffers.count * sizeof *g->loaded, "a document's buffers");
    }
    return g->buffers.count > 0 && !g->loaded ? FM_ERROR_OUT_OF_HOST_MEMORY : FM_OK;
}

// A chunk of a binary file, into memory of the reader's.
static fm_result read_chunk(const gltf *g, uint64_t size, const char *what, uint8_t **data) {
    FM_TRY(fm_input_require(g->reader->input,
                            size > fm_blocks_left(&g->reader->blocks) ? size - fm_blocks_left(&g->reader->blocks) : 0, what));
    *data = fm_alloc(g->reader->allocator, size, "a file's contents");
    return *data ? fm_blocks_read(&g->reader->blocks, *data, size, what) : FM_ERROR_OUT_OF_HOST_MEMORY;
}

static fm_result read_binary(gltf *g) {
    fm_mesh_reader *reader = g->reader;
    fm_blocks *blocks = &reader->blocks;
    uint8_t head[20];
    FM_TRY(fm_blocks_read(blocks, head, sizeof head, "its header"));
    const uint32_t version = fm_load_u32(head + 4), kind = fm_load_u32(head + 16);
    const uint64_t json_size = fm_load_u32(head + 12);
    if (version != 2) {
        return fm_input_fail(reader->input, FM_ERROR_UNSUPPORTED, "is binary glTF %u: export it as glTF 2.0", version);
    }
    if (kind != CHUNK_JSON || json_size > MOST_JSON) {
        return fm_input_fail(reader->input, FM_ERROR_FORMAT, "does not begin with a chunk of JSON: get the file again");
    }
    reader->info.binary = true;
    uint8_t *json = NULL;
    fm_result result = read_chunk(g, json_size, "its JSON", &json);
    if (result == FM_OK) {
        result = parse_document(g, json, json_size);
    }
    fm_free(reader->allocator, json, json_size);
    FM_TRY(result);
    FM_TRY(fm_blocks_want(blocks, 8));
    if (fm_blocks_left(blocks) >= 8 && fm_load_u32(blocks->at + 4) == CHUNK_BIN) {
        const uint64_t size = fm_load_u32(blocks->at);
        blocks->at += 8;
        g->bin_size = size;
        FM_TRY(read_chunk(g, size, "its binary chunk", &g->bin));
    }
    // Chunks of other kinds are to be ignored.
    uint64_t rest;
    return fm_blocks_drain(blocks, &rest);
}

static fm_result read_document(gltf *g) {
    const uint8_t *head;
    size_t size;
    FM_TRY(fm_input_peek(g->reader->input, 4, &head, &size));
    if (size == 4 && memcmp(head, "glTF", 4) == 0) {
        return read_binary(g);
    }
    uint8_t *json = NULL;
    uint64_t json_size = 0;
    FM_TRY(fm_input_slurp(g->reader->input, MOST_JSON, &json, &json_size));
    const fm_result result = parse_document(g, json, json_size);
    fm_free(g->reader->allocator, json, json_size);
    return result;
}

// ---------------------------------------------------------------------------------------------------------------------------
// Buffers
// ---------------------------------------------------------------------------------------------------------------------------

static int base64_digit(char c) {
    return c >= 'A' && c <= 'Z'   ? c - 'A'
           : c >= 'a' && c <= 'z' ? c - 'a' + 26
           : c >= '0' && c <= '9' ? c - '0' + 52
           : c == '+' || c == '-' ? 62
           : c == '/' || c == '_' ? 63
                                  : -1;
}

// Exactly `size` bytes; more may be there.
static bool decode_base64(const char *text, uint8_t *data, uint64_t size) {
    uint32_t bits = 0;
    int held = 0;
    for (uint64_t done = 0; done < size; text++) {
        const int digit = base64_digit(*text);
        if (digit < 0) {
            return false;
        }
        bits = bits << 6 | (uint32_t)digit;
        held += 6;
        if (held >= 8) {
            held -= 8;
            data[done++] = (uint8_t)(bits >> held);
        }
    }
    return true;
}

static int hex_digit(char c) {
    return c >= '0' && c <= '9' ? c - '0' : c >= 'a' && c <= 'f' ? c - 'a' + 10 : c >= 'A' && c <= 'F' ? c - 'A' + 10 : -1;
}

// Only names at or below the folder of the document: a file from somebody else must not choose what is read.
static bool is_beside(const char *uri) {
    if (uri[0] == '/' || uri[0] == 0 || strchr(uri, ':') || strchr(uri, '\\')) {
        return false;
    }
    for (const char *part = uri; part; part = strchr(part, '/') ? strchr(part, '/') + 1 : NULL) {
        if (part[0] == '.' && part[1] == '.' && (part[2] == '/' || part[2] == 0)) {
            return false;
        }
    }
    return true;
}

// %20 and the like become what they stand for, in place. False for a byte that no name has.
static bool decode_percent(char *text) {
    char *to = text;
    for (; *text; text++) {
        const int high = *text == '%' ? hex_digit(text[1]) : -1, low = high >= 0 ? hex_digit(text[2]) : -1;
        *to = low >= 0 ? (char)(high * 16 + low) : *text;
        text += low >= 0 ? 2 : 0;
        if (*to++ == 0) {
            return false;
        }
    }
    *to = 0;
    return true;
}

static fm_result read_beside(const gltf *g, const char *name, uint8_t *data, uint64_t size) {
    fm_input *input = NULL;
    FM_TRY(fm_input_open_plain(g->reader->allocator, name, &input));
    fm_result result = fm_input_require(input, size, "the buffer that the document names");
    if (result == FM_OK) {
        result = fm_input_read(input, data, size, "a buffer");
    }
    fm_input_close(input);
    return result;
}

static fm_result load_beside(const gltf *g, const char *uri, uint8_t *data, uint64_t size) {
    const char *path = g->reader->path ? g->reader->path : "";
    const char *slash = strrchr(path, '/');
    uint64_t name_size;
    char *name = fm_name_with_suffix(g->reader->allocator, path, slash ? strlen(slash + 1) : strlen(path), uri, &name_size);
    if (!name) {
        return FM_ERROR_OUT_OF_HOST_MEMORY;
    }
    char *tail = name + name_size - 1 - strlen(uri);
    fm_result result;
    if (!g->reader->path || !decode_percent(tail) || !is_beside(tail)) {
        result =
            fm_input_fail(g->reader->input, FM_ERROR_UNSUPPORTED,
                          "has a buffer in \"%.100s\": only files of its own folder or below are read; export it as .glb", uri);
    } else {
        result = read_beside(g, name, data, size);
    }
    fm_free(g->reader->allocator, name, name_size);
    return result;
}

// What the buffer `number` lacks to be loaded: its size is checked against where it comes from before memory is taken.
static fm_result load_buffer(const gltf *g, uint64_t number) {
    const cJSON *object = g->buffers.items[number];
    const char *uri = cJSON_GetStringValue(cJSON_GetObjectItemCaseSensitive(object, "uri"));
    uint64_t size;
    if (!get_number(object, "byteLength", 0, &size) || size == 0) {
        return gltf_fails(g, "lacks the \"byteLength\" of buffer", number);
    }
    const bool inside = uri && strncmp(uri, "data:", 5) == 0;
    const char *comma = inside ? strchr(uri, ',') : NULL;
    if (inside && (!comma || comma - uri < 7 || strncmp(comma - 7, ";base64", 7) != 0 || strlen(comma + 1) / 4 * 3 + 3 < size)) {
        return gltf_fails(g, "has a data URI that is no base64 or too short in buffer", number);
    }
    buffer *loaded = &g->loaded[number];
    loaded->data = fm_alloc(g->reader->allocator, size, "a mesh file's buffer");
    if (!loaded->data) {
        return FM_ERROR_OUT_OF_HOST_MEMORY;
    }
    loaded->size = size;
    if (!inside) {
        return load_beside(g, uri, loaded->data, size);
    }
    return decode_base64(comma + 1, loaded->data, size) ? FM_OK : gltf_fails(g, "has a data URI that is damaged in buffer", number);
}

static fm_result find_buffer(const gltf *g, uint64_t number, const uint8_t **data, uint64_t *size) {
    if (number >= g->buffers.count) {
        return gltf_fails(g, "names a buffer that is not there,", number);
    }
    if (!cJSON_GetObjectItemCaseSensitive(g->buffers.items[number], "uri")) {
        *data = g->bin;
        *size = g->bin_size;
        return g->bin && number == 0 ? FM_OK : gltf_fails(g, "has no data for buffer", number);
    }
    if (!g->loaded[number].data) {
        FM_TRY(load_buffer(g, number));
    }
    *data = g->loaded[number].data;
    *size = g->loaded[number].size;
    return FM_OK;
}

// `*stride` gets the view's own, or `packed`. `bytes` of one element must be there `count` times.
static fm_result find_view(const gltf *g, uint64_t number, uint64_t offset, uint64_t count, uint64_t bytes, const uint8_t **data,
                           uint64_t *stride) {
    uint64_t in, start, length, size = 0;
    if (number >= g->views.count) {
        return gltf_fails(g, "names a buffer view that is not there,", number);
    }
    const cJSON *view = g->views.items[number];
    if (!get_number(view, "buffer", UINT64_MAX, &in) || !get_number(view, "byteOffset", 0, &start) ||
        !get_number(view, "byteLength", 0, &length) || !get_number(view, "byteStride", bytes, stride) || *stride == 0 ||
        *stride > 4096) {
        return gltf_fails(g, "has a bad number in buffer view", number);
    }
    FM_TRY(find_buffer(g, in, data, &size));
    // Each below 2^53, so that the sums do not overflow.
    if (start + length > size || count > length || offset > length || bytes > length - offset ||
        (count > 0 && (count - 1) > (length - offset - bytes) / *stride)) {
        return gltf_fails(g, "has fewer bytes than are asked of buffer view", number);
    }
    *data += start + offset;
    return FM_OK;
}

// ---------------------------------------------------------------------------------------------------------------------------
// Accessors
// ---------------------------------------------------------------------------------------------------------------------------

static uint64_t component_size(uint64_t type) {
    return type == BYTE || type == UBYTE ? 1 : type == SHORT || type == USHORT ? 2 : type == UINT || type == FLOAT ? 4 : 0;
}

static fm_result find_elements(const gltf *g, uint64_t number, elements *e) {
    uint64_t view, offset, type;
    if (number >= g->accessors.count) {
        return gltf_fails(g, "names an accessor that is not there,", number);
    }
    const cJSON *accessor = g->accessors.items[number];
    const char *shape = cJSON_GetStringValue(cJSON_GetObjectItemCaseSensitive(accessor, "type"));
    if (!get_number(accessor, "bufferView", UINT64_MAX, &view) || !get_number(accessor, "byteOffset", 0, &offset) ||
        !get_number(accessor, "componentType", 0, &type) || !get_number(accessor, "count", 0, &e->count) || !component_size(type) ||
        !shape) {
        return gltf_fails(g, "has a bad number in accessor", number);
    }
    e->type = (component)type;
    e->parts = strcmp(shape, "SCALAR") == 0 ? 1 : strcmp(shape, "VEC3") == 0 ? 3 : 0;
    e->normalized = cJSON_IsTrue(cJSON_GetObjectItemCaseSensitive(accessor, "normalized"));
    e->sparse = cJSON_GetObjectItemCaseSensitive(accessor, "sparse");
    e->data = NULL;
    if (view == UINT64_MAX) {
        // Zeros, which only make sense when something is put over them.
        return e->sparse ? FM_OK : gltf_fails(g, "has no buffer view in accessor", number);
    }
    return find_view(g, view, offset, e->count, e->parts * component_size(type), &e->data, &e->stride);
}

static inline double load_component(const uint8_t *at, component type, bool normalized) {
    union {
        uint32_t bits;
        float number;
    } word;
    switch (type) {
    case BYTE:
        return normalized ? fmax((int8_t)at[0] / 127.0, -1) : (int8_t)at[0];
    case UBYTE:
        return normalized ? at[0] / 255.0 : at[0];
    case SHORT: {
        const int16_t value = (int16_t)(at[0] | at[1] << 8);
        return normalized ? fmax(value / 32767.0, -1) : value;
    }
    case USHORT: {
        const uint16_t value = (uint16_t)(at[0] | at[1] << 8);
        return normalized ? value / 65535.0 : value;
    }
    case UINT:
        return fm_load_u32(at);
    default:
        word.bits = fm_load_u32(at);
        return (double)word.number;
    }
}

static inline uint32_t load_index(const uint8_t *at, component type) {
    return type == UBYTE ? at[0] : type == USHORT ? (uint32_t)(at[0] | at[1] << 8) : fm_load_u32(at);
}

static bool is_index(const elements *e) {
    return e->parts == 1 && (e->type == UBYTE || e->type == USHORT || e->type == UINT);
}

// Puts what a sparse accessor holds over the `e->count` elements of `target`, `parts` doubles each.
static fm_result apply_sparse(const gltf *g, const elements *e, uint64_t accessor, double *target) {
    const cJSON *indices = cJSON_GetObjectItemCaseSensitive(e->sparse, "indices");
    const cJSON *values = cJSON_GetObjectItemCaseSensitive(e->sparse, "values");
    uint64_t count, type, views[2], offsets[2], strides[2];
    const uint8_t *data[2];
    if (!get_number(e->sparse, "count", 0, &count) || !get_number(indices, "componentType", 0, &type) ||
        !get_number(indices, "bufferView", UINT64_MAX, &views[0]) || !get_number(indices, "byteOffset", 0, &offsets[0]) ||
        !get_number(values, "bufferView", UINT64_MAX, &views[1]) || !get_number(values, "byteOffset", 0, &offsets[1]) ||
        (type != UBYTE && type != USHORT && type != UINT)) {
        return gltf_fails(g, "has a bad number in the sparse part of accessor", accessor);
    }
    const uint64_t size = component_size(e->type);
    FM_TRY(find_view(g, views[0], offsets[0], count, component_size(type), &data[0], &strides[0]));
    FM_TRY(find_view(g, views[1], offsets[1], count, e->parts * size, &data[1], &strides[1]));
    for (uint64_t i = 0; i < count; i++) {
        const uint64_t to = load_index(data[0] + i * strides[0], (component)type);
        if (to >= e->count) {
            return gltf_fails(g, "has an index out of range in the sparse part of accessor", accessor);
        }
        for (uint64_t k = 0; k < e->parts; k++) {
            target[to * e->parts + k] = load_component(data[1] + i * strides[1] + k * size, e->type, e->normalized);
        }
    }
    return FM_OK;
}

// All elements as doubles in memory of the reader's, for the rare sparse accessors.
static fm_result expand_sparse(const gltf *g, const elements *e, uint64_t accessor, double **values) {
    const uint64_t numbers = e->count * e->parts;
    if (e->count > g->reader->limit / sizeof **values) {
        return fm_input_fail(g->reader->input, FM_ERROR_RANGE, "has an accessor of %llu elements: raise max_bytes if that is meant",
                             (unsigned long long)e->count);
    }
    *values = fm_alloc_zero(g->reader->allocator, numbers * sizeof **values, "a sparse accessor");
    if (!*values) {
        return FM_ERROR_OUT_OF_HOST_MEMORY;
    }
    const uint64_t size = component_size(e->type);
    for (uint64_t i = 0; e->data && i < numbers; i++) {
        (*values)[i] = load_component(e->data + i / e->parts * e->stride + i % e->parts * size, e->type, e->normalized);
    }
    return apply_sparse(g, e, accessor, *values);
}

// ---------------------------------------------------------------------------------------------------------------------------
// Primitives
// ---------------------------------------------------------------------------------------------------------------------------

static fm_result add_vertex(const gltf *g, const place *at, const double p[3]) {
    float position[3];
    for (int i = 0; i < 3; i++) {
        position[i] = (float)(at->rows[i][0] * p[0] + at->rows[i][1] * p[1] + at->rows[i][2] * p[2] + at->rows[i][3]);
    }
    return fm_mesh_add_vertex(g->reader, position);
}

static fm_result add_positions(const gltf *g, const place *at, uint64_t accessor, uint64_t *count) {
    elements e;
    FM_TRY(find_elements(g, accessor, &e));
    if (e.parts != 3 || e.type == UINT) {
        return gltf_fails(g, "has positions that are not three coordinates each in accessor", accessor);
    }
    *count = e.count;
    double *values = NULL;
    fm_result result = e.sparse ? expand_sparse(g, &e, accessor, &values) : FM_OK;
    if (result == FM_OK && e.count > 0) {
        result = fm_mesh_grow_vertices(g->reader, e.count);
    }
    const uint64_t size = component_size(e.type);
    for (uint64_t i = 0; i < e.count && result == FM_OK; i++) {
        double p[3];
        for (uint64_t k = 0; k < 3; k++) {
            p[k] = values ? values[3 * i + k] : load_component(e.data + i * e.stride + k * size, e.type, e.normalized);
        }
        result = add_vertex(g, at, p);
    }
    fm_free(g->reader->allocator, values, e.count * e.parts * sizeof *values);
    return result;
}

// Where the corners of a primitive come from: an accessor, or the vertices in their order.
typedef struct corners {
    elements indices;
    double *values;  // of a sparse accessor
    bool indexed;
    uint64_t count, vertices, base;
    bool turned;
} corners;

static fm_result corner(const gltf *g, const corners *c, uint64_t i, uint32_t *vertex) {
    uint64_t number = i;
    if (c->indexed) {
        number = c->values ? (uint64_t)c->values[i] : load_index(c->indices.data + i * c->indices.stride, c->indices.type);
    }
    if (number >= c->vertices) {
        return fm_input_fail(g->reader->input, FM_ERROR_FORMAT,
                             "names vertex %llu in face %llu, but that primitive's %llu vertices are 0 to %lld",
                             (unsigned long long)number, (unsigned long long)g->reader->info.faces, (unsigned long long)c->vertices,
                             (long long)c->vertices - 1);
    }
    *vertex = (uint32_t)(c->base + number);
    return FM_OK;
}

// Corners of triangle `i` by the primitive's mode.
static fm_result add_triangle(const gltf *g, const corners *c, uint64_t mode, uint64_t i) {
    uint64_t order[3] = {i, i + 1, i + 2};
    if (mode == MODE_TRIANGLES) {
        order[0] = 3 * i;
        order[1] = 3 * i + 1;
        order[2] = 3 * i + 2;
    } else if (mode == MODE_FAN) {
        order[0] = 0;
    }
    if ((mode == MODE_STRIP && i % 2) != c->turned) {
        const uint64_t second = order[1];
        order[1] = order[2];
        order[2] = second;
    }
    uint32_t v[3] = {0, 0, 0};
    for (int k = 0; k < 3; k++) {
        FM_TRY(corner(g, c, order[k], &v[k]));
    }
    g->reader->info.faces++;
    // Strips go on through triangles that name a vertex twice.
    return mode == MODE_STRIP && (v[0] == v[1] || v[1] == v[2] || v[0] == v[2]) ? FM_OK
                                                                                : fm_mesh_add_triangle(g->reader, v[0], v[1], v[2]);
}

static fm_result add_triangles(const gltf *g, const corners *c, uint64_t mode) {
    const uint64_t count = mode == MODE_TRIANGLES ? c->count / 3 : c->count < 3 ? 0 : c->count - 2;
    if (count > 0) {
        FM_TRY(fm_mesh_grow_triangles(g->reader, count));
    }
    for (uint64_t i = 0; i < count; i++) {
        FM_TRY(add_triangle(g, c, mode, i));
    }
    return FM_OK;
}

static fm_result add_faces(const gltf *g, const cJSON *primitive, uint64_t mode, corners *c) {
    uint64_t accessor;
    if (!get_number(primitive, "indices", UINT64_MAX, &accessor)) {
        return fm_input_fail(g->reader->input, FM_ERROR_FORMAT, "has \"indices\" that are no number: the file is damaged");
    }
    c->indexed = accessor != UINT64_MAX;
    c->count = c->vertices;
    fm_result result = FM_OK;
    if (c->indexed) {
        FM_TRY(find_elements(g, accessor, &c->indices));
        if (!is_index(&c->indices)) {
            return gltf_fails(g, "has indices of a wrong type in accessor", accessor);
        }
        c->count = c->indices.count;
        result = c->indices.sparse ? expand_sparse(g, &c->indices, accessor, &c->values) : FM_OK;
    }
    if (result == FM_OK) {
        result = add_triangles(g, c, mode);
    }
    fm_free(g->reader->allocator, c->values, c->indices.count * sizeof *c->values);
    return result;
}

static bool is_mirror(const place *at) {
    const double(*m)[4] = at->rows;
    return m[0][0] * (m[1][1] * m[2][2] - m[1][2] * m[2][1]) - m[0][1] * (m[1][0] * m[2][2] - m[1][2] * m[2][0]) +
               m[0][2] * (m[1][0] * m[2][1] - m[1][1] * m[2][0]) <
           0;
}

static fm_result add_mesh(gltf *g, uint64_t number, const place *at) {
    if (number >= g->meshes.count) {
        return gltf_fails(g, "names a mesh that is not there,", number);
    }
    const cJSON *primitive, *primitives = cJSON_GetObjectItemCaseSensitive(g->meshes.items[number], "primitives");
    uint64_t last = UINT64_MAX;
    corners shared = {.turned = is_mirror(at)};
    cJSON_ArrayForEach(primitive, primitives) {
        uint64_t mode, positions;
        const cJSON *attributes = cJSON_GetObjectItemCaseSensitive(primitive, "attributes");
        if (!get_number(primitive, "mode", MODE_TRIANGLES, &mode) || mode > MODE_FAN ||
            !get_number(attributes, "POSITION", UINT64_MAX, &positions)) {
            return gltf_fails(g, "has a bad primitive in mesh", number);
        }
        if (mode < MODE_TRIANGLES || positions == UINT64_MAX) {
            g->set_aside++;
            continue;
        }
        // Primitives of one mesh often share their vertices.
        if (positions != last) {
            shared.base = g->reader->vertex_count;
            FM_TRY(add_positions(g, at, positions, &shared.vertices));
            last = positions;
        }
        corners c = shared;
        FM_TRY(add_faces(g, primitive, mode, &c));
    }
    return FM_OK;
}

// ---------------------------------------------------------------------------------------------------------------------------
// Nodes
// ---------------------------------------------------------------------------------------------------------------------------

static bool own_place(const cJSON *node, place *own) {
    double m[16] = {1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1};
    if (!get_doubles(node, "matrix", m, 16)) {
        return false;
    }
    double t[3] = {m[12], m[13], m[14]}, q[4] = {0, 0, 0, 1}, s[3] = {1, 1, 1};
    if (!get_doubles(node, "translation", t, 3) || !get_doubles(node, "rotation", q, 4) || !get_doubles(node, "scale", s, 3)) {
        return false;
    }
    // Of the matrix or of the three, the file has one, so that the other is the identity here.
    const double x = q[0], y = q[1], z = q[2], w = q[3];
    const double r[3][3] = {{1 - 2 * (y * y + z * z), 2 * (x * y - z * w), 2 * (x * z + y * w)},
                            {2 * (x * y + z * w), 1 - 2 * (x * x + z * z), 2 * (y * z - x * w)},
                            {2 * (x * z - y * w), 2 * (y * z + x * w), 1 - 2 * (x * x + y * y)}};
    for (int i = 0; i < 3; i++) {
        for (int k = 0; k < 3; k++) {
            own->rows[i][k] = 0;
            for (int j = 0; j < 3; j++) {
                own->rows[i][k] += m[4 * j + i] * r[j][k] * s[k];
            }
        }
        own->rows[i][3] = t[i];
    }
    return true;
}

// What `inner` does, then `outer`.
static place compose(const place *outer, const place *inner) {
    place both;
    for (int i = 0; i < 3; i++) {
        for (int k = 0; k < 4; k++) {
            both.rows[i][k] = k == 3 ? outer->rows[i][3] : 0;
            for (int j = 0; j < 3; j++) {
                both.rows[i][k] += outer->rows[i][j] * inner->rows[j][k];
            }
        }
    }
    return both;
}

typedef struct waiting {
    uint64_t node;
    place parent;
} waiting;

// Nodes in the order of a walk, each once: that makes the stack as long as there are nodes, and a circle an error.
typedef struct walk {
    waiting *stack;
    uint64_t depth;
    bool *seen;
} walk;

static fm_result push(const gltf *g, walk *w, double number, const place *parent) {
    if (!(number >= 0 && number < (double)g->nodes.count)) {
        return fm_input_fail(g->reader->input, FM_ERROR_FORMAT, "names node %g, which is not there: the file is damaged", number);
    }
    const uint64_t node = (uint64_t)number;
    if (w->seen[node]) {
        return gltf_fails(g, "places twice node", node);
    }
    w->seen[node] = true;
    w->stack[w->depth++] = (waiting){node, *parent};
    return FM_OK;
}

// The last first, so that the first is taken first.
static fm_result push_all(const gltf *g, walk *w, const cJSON *numbers, const place *parent) {
    const uint64_t from = w->depth;
    const cJSON *number;
    cJSON_ArrayForEach(number, numbers) {
        FM_TRY(push(g, w, cJSON_IsNumber(number) ? number->valuedouble : -1, parent));
    }
    for (uint64_t low = from, high = w->depth; low + 1 < high; low++) {
        const waiting swap = w->stack[low];
        w->stack[low] = w->stack[--high];
        w->stack[high] = swap;
    }
    return FM_OK;
}

static fm_result walk_nodes(gltf *g, walk *w) {
    while (w->depth > 0) {
        const waiting next = w->stack[--w->depth];
        const cJSON *node = g->nodes.items[next.node];
        place own;
        uint64_t mesh;
        if (!own_place(node, &own) || !get_number(node, "mesh", UINT64_MAX, &mesh)) {
            return gltf_fails(g, "has a bad number in node", next.node);
        }
        const place at = compose(&next.parent, &own);
        if (mesh != UINT64_MAX) {
            FM_TRY(add_mesh(g, mesh, &at));
        }
        FM_TRY(push_all(g, w, cJSON_GetObjectItemCaseSensitive(node, "children"), &at));
    }
    return FM_OK;
}

// Nodes that are nobody's children.
static fm_result push_roots(const gltf *g, walk *w, const place *identity) {
    for (uint64_t i = 0; i < g->nodes.count; i++) {
        const cJSON *child;
        cJSON_ArrayForEach(child, cJSON_GetObjectItemCaseSensitive(g->nodes.items[i], "children")) {
            if (cJSON_IsNumber(child) && child->valuedouble >= 0 && child->valuedouble < (double)g->nodes.count) {
                w->seen[(uint64_t)child->valuedouble] = true;
            }
        }
    }
    for (uint64_t i = g->nodes.count; i-- > 0;) {
        if (!w->seen[i]) {
            w->stack[w->depth++] = (waiting){i, *identity};
        }
    }
    memset(w->seen, 0, g->nodes.count);
    return FM_OK;
}

static fm_result walk_scene(gltf *g, walk *w) {
    static const place identity = {{{1, 0, 0, 0}, {0, 1, 0, 0}, {0, 0, 1, 0}}};
    const cJSON *scenes = cJSON_GetObjectItemCaseSensitive(g->root, "scenes");
    uint64_t number;
    if (!get_number(g->root, "scene", 0, &number)) {
        return fm_input_fail(g->reader->input, FM_ERROR_FORMAT, "has a \"scene\" that is no number: the file is damaged");
    }
    if (!scenes) {
        FM_TRY(push_roots(g, w, &identity));
    } else if (number >= (uint64_t)cJSON_GetArraySize(scenes)) {
        return gltf_fails(g, "names a scene that is not there,", number);
    } else {
        FM_TRY(push_all(g, w, cJSON_GetObjectItemCaseSensitive(cJSON_GetArrayItem(scenes, (int)number), "nodes"), &identity));
    }
    return walk_nodes(g, w);
}

static fm_result read_scene(gltf *g) {
    const fm_allocator *allocator = g->reader->allocator;
    const uint64_t count = g->nodes.count;
    walk w = {.stack = fm_alloc(allocator, count * sizeof *w.stack, "a scene's nodes"),
              .seen = fm_alloc_zero(allocator, count * sizeof *w.seen, "a scene's nodes")};
    const fm_result result = w.stack && w.seen ? walk_scene(g, &w) : FM_ERROR_OUT_OF_HOST_MEMORY;
    fm_free(allocator, w.stack, count * sizeof *w.stack);
    fm_free(allocator, w.seen, count * sizeof *w.seen);
    return result;
}

// ---------------------------------------------------------------------------------------------------------------------------
// The codec
// ---------------------------------------------------------------------------------------------------------------------------

static void free_list(const fm_allocator *allocator, const list *l) {
    fm_free(allocator, (void *)(uintptr_t)l->items, l->count * sizeof *l->items);
}

static void gltf_free(gltf *g) {
    const fm_allocator *allocator = g->reader->allocator;
    for (uint64_t i = 0; g->loaded && i < g->buffers.count; i++) {
        fm_free(allocator, g->loaded[i].data, g->loaded[i].size);
    }
    fm_free(allocator, g->loaded, g->buffers.count * sizeof *g->loaded);
    fm_free(allocator, g->bin, g->bin_size);
    free_list(allocator, &g->accessors);
    free_list(allocator, &g->views);
    free_list(allocator, &g->buffers);
    free_list(allocator, &g->meshes);
    free_list(allocator, &g->nodes);
    cJSON_Delete(g->root);
}

static fm_result gltf_read(fm_mesh_reader *reader) {
    gltf g = {.reader = reader};
    fm_result result = read_document(&g);
    if (result == FM_OK) {
        result = read_scene(&g);
    }
    if (result == FM_OK && g.set_aside > 0) {
        fm_mesh_note(reader, "%llu primitives that are no triangles are set aside", (unsigned long long)g.set_aside);
    }
    gltf_free(&g);
    return result;
}

// A document begins with a brace, but so do other things: one of its first words must be of glTF.
static bool gltf_matches(const uint8_t *head, size_t size) {
    if (size >= 4 && memcmp(head, "glTF", 4) == 0) {
        return true;
    }
    size_t at = size >= 3 && memcmp(head, "\xef\xbb\xbf", 3) == 0 ? 3 : 0;
    while (at < size && fm_is_space(head[at])) {
        at++;
    }
    if (at == size || head[at] != '{') {
        return false;
    }
    static const char *const words[] = {"\"asset\"", "\"accessors\"", "\"bufferViews\"", "\"meshes\"", "\"extensionsUsed\""};
    for (size_t i = 0; i < sizeof words / sizeof words[0]; i++) {
        if (memmem(head, size, words[i], strlen(words[i]))) {
            return true;
        }
    }
    return false;
}

static const char *const extensions[] = {".gltf", ".glb", NULL};

const fm_mesh_codec fm_mesh_codec_gltf = {
    .format = FM_MESH_FORMAT_GLTF,
    .name = "glTF",
    .extensions = extensions,
    .matches = gltf_matches,
    .read = gltf_read,
    .default_limit = UINT64_C(16) << 30,
};
