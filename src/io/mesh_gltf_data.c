// SPDX-License-Identifier: MIT

// glTF documents: JSON, whose numbers lie in buffers, in the same file (.glb), in data URIs or in files beside it.
// Source: Khronos Group, "glTF 2.0 Specification".

#include "io/mesh_gltf.h"

#include <string.h>

enum {
    CHUNK_JSON = 0x4e4f534a,
    CHUNK_BIN = 0x004e4942,
    MOST_JSON = 1 << 30,
    MOST_ZEROS = 1 << 24,
};

fm_result fm_gltf_fails(const fm_gltf *g, const char *what, uint64_t number) {
    return fm_input_fail(g->reader->input, FM_ERROR_FORMAT, "%s %llu: the file is damaged or its exporter was wrong", what,
                         (unsigned long long)number);
}

// ---------------------------------------------------------------------------------------------------------------------------
// The document
// ---------------------------------------------------------------------------------------------------------------------------

bool fm_gltf_number(const cJSON *object, const char *key, uint64_t otherwise, uint64_t *value) {
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

bool fm_gltf_doubles(const cJSON *object, const char *key, double *values, int count) {
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

static fm_result make_list(const fm_gltf *g, const char *key, fm_gltf_list *l) {
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

static fm_result check_version(const fm_gltf *g) {
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

static fm_result parse_document(fm_gltf *g, const uint8_t *text, uint64_t size) {
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
static fm_result read_chunk(const fm_gltf *g, uint64_t size, const char *what, uint8_t **data) {
    FM_TRY(fm_input_require(g->reader->input,
                            size > fm_blocks_left(&g->reader->blocks) ? size - fm_blocks_left(&g->reader->blocks) : 0, what));
    *data = fm_alloc(g->reader->allocator, size, "a file's contents");
    return *data ? fm_blocks_read(&g->reader->blocks, *data, size, what) : FM_ERROR_OUT_OF_HOST_MEMORY;
}

static fm_result read_binary(fm_gltf *g) {
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

fm_result fm_gltf_open(fm_gltf *g) {
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

static fm_result read_beside(const fm_gltf *g, const char *name, uint8_t *data, uint64_t size) {
    fm_input *input = NULL;
    FM_TRY(fm_input_open_plain(g->reader->allocator, name, &input));
    fm_result result = fm_input_require(input, size, "the buffer that the document names");
    if (result == FM_OK) {
        result = fm_input_read(input, data, size, "a buffer");
    }
    fm_input_close(input);
    return result;
}

static fm_result load_beside(const fm_gltf *g, const char *uri, uint8_t *data, uint64_t size) {
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
static fm_result load_buffer(const fm_gltf *g, uint64_t number) {
    const cJSON *object = g->buffers.items[number];
    const char *uri = cJSON_GetStringValue(cJSON_GetObjectItemCaseSensitive(object, "uri"));
    uint64_t size;
    if (!fm_gltf_number(object, "byteLength", 0, &size) || size == 0) {
        return fm_gltf_fails(g, "lacks the \"byteLength\" of buffer", number);
    }
    const bool inside = uri && strncmp(uri, "data:", 5) == 0;
    const char *comma = inside ? strchr(uri, ',') : NULL;
    if (inside && (!comma || comma - uri < 7 || strncmp(comma - 7, ";base64", 7) != 0 || strlen(comma + 1) / 4 * 3 + 3 < size)) {
        return fm_gltf_fails(g, "has a data URI that is no base64 or too short in buffer", number);
    }
    fm_gltf_buffer *loaded = &g->loaded[number];
    loaded->data = fm_alloc(g->reader->allocator, size, "a mesh file's buffer");
    if (!loaded->data) {
        return FM_ERROR_OUT_OF_HOST_MEMORY;
    }
    loaded->size = size;
    if (!inside) {
        return load_beside(g, uri, loaded->data, size);
    }
    return decode_base64(comma + 1, loaded->data, size) ? FM_OK
                                                        : fm_gltf_fails(g, "has a data URI that is damaged in buffer", number);
}

static fm_result find_buffer(const fm_gltf *g, uint64_t number, const uint8_t **data, uint64_t *size) {
    if (number >= g->buffers.count) {
        return fm_gltf_fails(g, "names a buffer that is not there,", number);
    }
    if (!cJSON_GetObjectItemCaseSensitive(g->buffers.items[number], "uri")) {
        *data = g->bin;
        *size = g->bin_size;
        return g->bin && number == 0 ? FM_OK : fm_gltf_fails(g, "has no data for buffer", number);
    }
    if (!g->loaded[number].data) {
        FM_TRY(load_buffer(g, number));
    }
    *data = g->loaded[number].data;
    *size = g->loaded[number].size;
    return FM_OK;
}

// `*stride` gets the view's own, or `packed`. `bytes` of one element must be there `count` times.
static fm_result find_view(const fm_gltf *g, uint64_t number, uint64_t offset, uint64_t count, uint64_t bytes, const uint8_t **data,
                           uint64_t *stride) {
    uint64_t in, start, length, size = 0;
    if (number >= g->views.count) {
        return fm_gltf_fails(g, "names a buffer view that is not there,", number);
    }
    const cJSON *view = g->views.items[number];
    if (!fm_gltf_number(view, "buffer", UINT64_MAX, &in) || !fm_gltf_number(view, "byteOffset", 0, &start) ||
        !fm_gltf_number(view, "byteLength", 0, &length) || !fm_gltf_number(view, "byteStride", bytes, stride) || *stride == 0 ||
        *stride > 4096) {
        return fm_gltf_fails(g, "has a bad number in buffer view", number);
    }
    FM_TRY(find_buffer(g, in, data, &size));
    // Each below 2^53, so that the sums do not overflow.
    if (start + length > size || count > length || offset > length || bytes > length - offset ||
        (count > 0 && (count - 1) > (length - offset - bytes) / *stride)) {
        return fm_gltf_fails(g, "has fewer bytes than are asked of buffer view", number);
    }
    *data += start + offset;
    return FM_OK;
}

// ---------------------------------------------------------------------------------------------------------------------------
// Accessors
// ---------------------------------------------------------------------------------------------------------------------------

fm_result fm_gltf_elements(const fm_gltf *g, uint64_t number, fm_gltf_accessor *e) {
    uint64_t view, offset, type;
    if (number >= g->accessors.count) {
        return fm_gltf_fails(g, "names an accessor that is not there,", number);
    }
    const cJSON *accessor = g->accessors.items[number];
    const char *shape = cJSON_GetStringValue(cJSON_GetObjectItemCaseSensitive(accessor, "type"));
    if (!fm_gltf_number(accessor, "bufferView", UINT64_MAX, &view) || !fm_gltf_number(accessor, "byteOffset", 0, &offset) ||
        !fm_gltf_number(accessor, "componentType", 0, &type) || !fm_gltf_number(accessor, "count", 0, &e->count) ||
        !fm_gltf_size(type) || !shape) {
        return fm_gltf_fails(g, "has a bad number in accessor", number);
    }
    e->type = (fm_gltf_component)type;
    e->parts = strcmp(shape, "SCALAR") == 0 ? 1 : strcmp(shape, "VEC3") == 0 ? 3 : 0;
    e->normalized = cJSON_IsTrue(cJSON_GetObjectItemCaseSensitive(accessor, "normalized"));
    e->sparse = cJSON_GetObjectItemCaseSensitive(accessor, "sparse");
    e->data = NULL;
    if (view == UINT64_MAX) {
        // Zeros, which only make sense when something is put over them.
        return e->sparse ? FM_OK : fm_gltf_fails(g, "has no buffer view in accessor", number);
    }
    return find_view(g, view, offset, e->count, e->parts * fm_gltf_size(type), &e->data, &e->stride);
}

// Puts what a sparse accessor holds over the `e->count` elements of `target`, `parts` doubles each.
static fm_result apply_sparse(const fm_gltf *g, const fm_gltf_accessor *e, uint64_t accessor, double *target) {
    const cJSON *indices = cJSON_GetObjectItemCaseSensitive(e->sparse, "indices");
    const cJSON *values = cJSON_GetObjectItemCaseSensitive(e->sparse, "values");
    uint64_t count, type, views[2], offsets[2], strides[2];
    const uint8_t *data[2];
    if (!fm_gltf_number(e->sparse, "count", 0, &count) || !fm_gltf_number(indices, "componentType", 0, &type) ||
        !fm_gltf_number(indices, "bufferView", UINT64_MAX, &views[0]) || !fm_gltf_number(indices, "byteOffset", 0, &offsets[0]) ||
        !fm_gltf_number(values, "bufferView", UINT64_MAX, &views[1]) || !fm_gltf_number(values, "byteOffset", 0, &offsets[1]) ||
        (type != FM_GLTF_UBYTE && type != FM_GLTF_USHORT && type != FM_GLTF_UINT)) {
        return fm_gltf_fails(g, "has a bad number in the sparse part of accessor", accessor);
    }
    const uint64_t size = fm_gltf_size(e->type);
    FM_TRY(find_view(g, views[0], offsets[0], count, fm_gltf_size(type), &data[0], &strides[0]));
    FM_TRY(find_view(g, views[1], offsets[1], count, e->parts * size, &data[1], &strides[1]));
    for (uint64_t i = 0; i < count; i++) {
        const uint64_t to = fm_gltf_index(data[0] + i * strides[0], (fm_gltf_component)type);
        if (to >= e->count) {
            return fm_gltf_fails(g, "has an index out of range in the sparse part of accessor", accessor);
        }
        for (uint64_t k = 0; k < e->parts; k++) {
            target[to * e->parts + k] = fm_gltf_value(data[1] + i * strides[1] + k * size, e->type, e->normalized);
        }
    }
    return FM_OK;
}

fm_result fm_gltf_expand(const fm_gltf *g, const fm_gltf_accessor *e, uint64_t accessor, double **values) {
    const uint64_t numbers = e->count * e->parts;
    // Zeros out of nothing must not cost more than a file could be.
    if (e->count > (e->data ? g->reader->limit / sizeof **values : MOST_ZEROS)) {
        return fm_input_fail(g->reader->input, FM_ERROR_RANGE, "has an accessor of %llu elements: raise max_bytes if that is meant",
                             (unsigned long long)e->count);
    }
    *values = fm_alloc_zero(g->reader->allocator, numbers * sizeof **values, "a sparse accessor");
    if (!*values) {
        return FM_ERROR_OUT_OF_HOST_MEMORY;
    }
    const uint64_t size = fm_gltf_size(e->type);
    for (uint64_t i = 0; e->data && i < numbers; i++) {
        (*values)[i] = fm_gltf_value(e->data + i / e->parts * e->stride + i % e->parts * size, e->type, e->normalized);
    }
    return apply_sparse(g, e, accessor, *values);
}

static void free_list(const fm_allocator *allocator, const fm_gltf_list *l) {
    fm_free(allocator, (void *)(uintptr_t)l->items, l->count * sizeof *l->items);
}

void fm_gltf_close(fm_gltf *g) {
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
