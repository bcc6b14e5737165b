// SPDX-License-Identifier: MIT

// glTF scenes: nodes that place meshes, whose primitives are triangles, strips and fans.
// Source: Khronos Group, "glTF 2.0 Specification".

#include "io/mesh_gltf.h"

#include <string.h>

enum { MODE_TRIANGLES = 4, MODE_STRIP, MODE_FAN };

// Rows of an affine matrix.
typedef struct place {
    double rows[3][4];
} place;

static bool is_index(const fm_gltf_accessor *e) {
    return e->parts == 1 && (e->type == FM_GLTF_UBYTE || e->type == FM_GLTF_USHORT || e->type == FM_GLTF_UINT);
}

// ---------------------------------------------------------------------------------------------------------------------------
// Primitives
// ---------------------------------------------------------------------------------------------------------------------------

static fm_result add_vertex(const fm_gltf *g, const place *at, const double p[3]) {
    float position[3];
    for (int i = 0; i < 3; i++) {
        position[i] = (float)(at->rows[i][0] * p[0] + at->rows[i][1] * p[1] + at->rows[i][2] * p[2] + at->rows[i][3]);
    }
    return fm_mesh_add_vertex(g->reader, position);
}

static fm_result add_positions(const fm_gltf *g, const place *at, uint64_t accessor, uint64_t *count) {
    fm_gltf_accessor e;
    FM_TRY(fm_gltf_elements(g, accessor, &e));
    if (e.parts != 3 || e.type == FM_GLTF_UINT) {
        return fm_gltf_fails(g, "has positions that are not three coordinates each in accessor", accessor);
    }
    *count = e.count;
    double *values = NULL;
    fm_result result = e.sparse ? fm_gltf_expand(g, &e, accessor, &values) : FM_OK;
    if (result == FM_OK && e.count > 0) {
        result = fm_mesh_grow_vertices(g->reader, e.count);
    }
    const uint64_t size = fm_gltf_size(e.type);
    for (uint64_t i = 0; i < e.count && result == FM_OK; i++) {
        double p[3];
        for (uint64_t k = 0; k < 3; k++) {
            p[k] = values ? values[3 * i + k] : fm_gltf_value(e.data + i * e.stride + k * size, e.type, e.normalized);
        }
        result = add_vertex(g, at, p);
    }
    fm_free(g->reader->allocator, values, e.count * e.parts * sizeof *values);
    return result;
}

// Where the corners of a primitive come from: an accessor, or the vertices in their order.
typedef struct corners {
    fm_gltf_accessor indices;
    double *values;  // of a sparse accessor
    bool indexed;
    uint64_t count, vertices, base;
    bool turned;
} corners;

static fm_result corner(const fm_gltf *g, const corners *c, uint64_t i, uint32_t *vertex) {
    uint64_t number = i;
    if (c->indexed) {
        number = c->values ? (uint64_t)c->values[i] : fm_gltf_index(c->indices.data + i * c->indices.stride, c->indices.type);
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
static fm_result add_triangle(const fm_gltf *g, const corners *c, uint64_t mode, uint64_t i) {
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

static fm_result add_triangles(const fm_gltf *g, const corners *c, uint64_t mode) {
    const uint64_t count = mode == MODE_TRIANGLES ? c->count / 3 : c->count < 3 ? 0 : c->count - 2;
    if (count > 0) {
        FM_TRY(fm_mesh_grow_triangles(g->reader, count));
    }
    for (uint64_t i = 0; i < count; i++) {
        FM_TRY(add_triangle(g, c, mode, i));
    }
    return FM_OK;
}

static fm_result add_faces(const fm_gltf *g, const cJSON *primitive, uint64_t mode, corners *c) {
    uint64_t accessor;
    if (!fm_gltf_number(primitive, "indices", UINT64_MAX, &accessor)) {
        return fm_input_fail(g->reader->input, FM_ERROR_FORMAT, "has \"indices\" that are no number: the file is damaged");
    }
    c->indexed = accessor != UINT64_MAX;
    c->count = c->vertices;
    fm_result result = FM_OK;
    if (c->indexed) {
        FM_TRY(fm_gltf_elements(g, accessor, &c->indices));
        if (!is_index(&c->indices)) {
            return fm_gltf_fails(g, "has indices of a wrong type in accessor", accessor);
        }
        c->count = c->indices.count;
        result = c->indices.sparse ? fm_gltf_expand(g, &c->indices, accessor, &c->values) : FM_OK;
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

static fm_result add_mesh(fm_gltf *g, uint64_t number, const place *at) {
    if (number >= g->meshes.count) {
        return fm_gltf_fails(g, "names a mesh that is not there,", number);
    }
    const cJSON *primitive, *primitives = cJSON_GetObjectItemCaseSensitive(g->meshes.items[number], "primitives");
    uint64_t last = UINT64_MAX;
    corners shared = {.turned = is_mirror(at)};
    cJSON_ArrayForEach(primitive, primitives) {
        uint64_t mode, positions;
        const cJSON *attributes = cJSON_GetObjectItemCaseSensitive(primitive, "attributes");
        if (!fm_gltf_number(primitive, "mode", MODE_TRIANGLES, &mode) || mode > MODE_FAN ||
            !fm_gltf_number(attributes, "POSITION", UINT64_MAX, &positions)) {
            return fm_gltf_fails(g, "has a bad primitive in mesh", number);
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
    if (!fm_gltf_doubles(node, "matrix", m, 16)) {
        return false;
    }
    double t[3] = {m[12], m[13], m[14]}, q[4] = {0, 0, 0, 1}, s[3] = {1, 1, 1};
    if (!fm_gltf_doubles(node, "translation", t, 3) || !fm_gltf_doubles(node, "rotation", q, 4) ||
        !fm_gltf_doubles(node, "scale", s, 3)) {
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

static fm_result push(const fm_gltf *g, walk *w, double number, const place *parent) {
    if (!(number >= 0 && number < (double)g->nodes.count)) {
        return fm_input_fail(g->reader->input, FM_ERROR_FORMAT, "names node %g, which is not there: the file is damaged", number);
    }
    const uint64_t node = (uint64_t)number;
    if (w->seen[node]) {
        return fm_gltf_fails(g, "places twice node", node);
    }
    w->seen[node] = true;
    w->stack[w->depth++] = (waiting){node, *parent};
    return FM_OK;
}

// The last first, so that the first is taken first.
static fm_result push_all(const fm_gltf *g, walk *w, const cJSON *numbers, const place *parent) {
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

static fm_result walk_nodes(fm_gltf *g, walk *w) {
    while (w->depth > 0) {
        const waiting next = w->stack[--w->depth];
        const cJSON *node = g->nodes.items[next.node];
        place own;
        uint64_t mesh;
        if (!own_place(node, &own) || !fm_gltf_number(node, "mesh", UINT64_MAX, &mesh)) {
            return fm_gltf_fails(g, "has a bad number in node", next.node);
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
static fm_result push_roots(const fm_gltf *g, walk *w, const place *identity) {
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

static fm_result walk_scene(fm_gltf *g, walk *w) {
    static const place identity = {{{1, 0, 0, 0}, {0, 1, 0, 0}, {0, 0, 1, 0}}};
    const cJSON *scenes = cJSON_GetObjectItemCaseSensitive(g->root, "scenes");
    uint64_t number;
    if (!fm_gltf_number(g->root, "scene", 0, &number)) {
        return fm_input_fail(g->reader->input, FM_ERROR_FORMAT, "has a \"scene\" that is no number: the file is damaged");
    }
    if (!scenes) {
        FM_TRY(push_roots(g, w, &identity));
    } else if (number >= (uint64_t)cJSON_GetArraySize(scenes)) {
        return fm_gltf_fails(g, "names a scene that is not there,", number);
    } else {
        FM_TRY(push_all(g, w, cJSON_GetObjectItemCaseSensitive(cJSON_GetArrayItem(scenes, (int)number), "nodes"), &identity));
    }
    return walk_nodes(g, w);
}

static fm_result read_scene(fm_gltf *g) {
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

static fm_result gltf_read(fm_mesh_reader *reader) {
    fm_gltf g = {.reader = reader};
    fm_result result = fm_gltf_open(&g);
    if (result == FM_OK) {
        result = read_scene(&g);
    }
    if (result == FM_OK && g.set_aside > 0) {
        fm_mesh_note(reader, "%llu primitives that are no triangles are set aside", (unsigned long long)g.set_aside);
    }
    fm_gltf_close(&g);
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
    .default_limit = UINT64_C(4) << 30,
};
