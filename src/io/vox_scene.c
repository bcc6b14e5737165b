// SPDX-License-Identifier: MIT
#include "io/vox.h"

#include <stdlib.h>
#include <string.h>

enum { MAX_DEPTH = 256, MAX_TEXT = 64, MAX_MOVE = 1 << 30 };

// Of walking the scene: bytes of the nodes reached, and a little for each.
static const uint64_t max_work = 64 << 20;

// A stretch of the file being parsed. Reading past its end gives zeros and sets `bad`.
typedef struct cursor {
    const uint8_t *at, *end;
    bool bad;
} cursor;

typedef struct pose {
    fm_vox_turn turn;
    int64_t move[3];
    bool hidden;
} pose;

static const fm_vox_turn identity = {{0, 1, 2}, {1, 1, 1}};

static uint64_t left(const cursor *c) {
    return (uint64_t)(c->end - c->at);
}

static uint32_t get_u32(cursor *c) {
    if (left(c) < 4) {
        c->bad = true;
        return 0;
    }
    c->at += 4;
    return fm_load_u32(c->at - 4);
}

// The next `size` bytes; NULL when they are not there.
static const uint8_t *get_bytes(cursor *c, uint64_t size) {
    if (c->bad || left(c) < size) {
        c->bad = true;
        return NULL;
    }
    c->at += size;
    return c->at - size;
}

static fm_result damaged(const fm_reader *reader, const char *part) {
    return fm_input_fail(reader->input, FM_ERROR_FORMAT, "has a damaged %s: get the file again", part);
}

// Makes room for one more element of an array.
static fm_result grow(const fm_allocator *allocator, void **array, uint32_t count, uint32_t *capacity, size_t size) {
    if (count < *capacity) {
        return FM_OK;
    }
    if (*capacity > UINT32_MAX / 2) {
        return fm_fail(FM_ERROR_FORMAT, "a .vox scene has over %u parts", *capacity);
    }
    uint32_t grown = *capacity ? *capacity * 2 : 16;
    void *larger = fm_alloc(allocator, (uint64_t)grown * size, "a .vox scene");
    if (!larger) {
        return FM_ERROR_OUT_OF_HOST_MEMORY;
    }
    if (*array) {
        memcpy(larger, *array, count * size);
        fm_free(allocator, *array, (uint64_t)*capacity * size);
    }
    *array = larger;
    *capacity = grown;
    return FM_OK;
}

#define GROW(reader, scene, array, count, capacity)                                                                                \
    grow((reader)->allocator, (void **)&(scene)->array, (scene)->count, &(scene)->capacity, sizeof *(scene)->array)

void fm_vox_free(const fm_allocator *allocator, fm_vox_scene *scene) {
    fm_free(allocator, scene->bytes, scene->size);
    fm_free(allocator, scene->models, scene->model_capacity * sizeof *scene->models);
    fm_free(allocator, scene->nodes, scene->node_capacity * sizeof *scene->nodes);
    fm_free(allocator, scene->hidden_layers, scene->hidden_layer_capacity * sizeof *scene->hidden_layers);
    fm_free(allocator, scene->places, scene->place_capacity * sizeof *scene->places);
}

// ---------------------------------------------------------------------------------------------------------------------------
// Chunks
// ---------------------------------------------------------------------------------------------------------------------------

// Text of `key` in the dictionary at the cursor, which is moved past it; empty when it is not there or too long to be of use.
static void get_dictionary(cursor *c, int wanted, const char *const keys[], char texts[][MAX_TEXT]) {
    for (int k = 0; k < wanted; k++) {
        texts[k][0] = 0;
    }
    uint32_t count = get_u32(c);
    for (uint32_t i = 0; i < count && !c->bad; i++) {
        uint32_t key_size = get_u32(c);
        const uint8_t *key = get_bytes(c, key_size);
        uint32_t value_size = get_u32(c);
        const uint8_t *value = get_bytes(c, value_size);
        for (int k = 0; k < wanted && !c->bad; k++) {
            if (key_size == strlen(keys[k]) && memcmp(key, keys[k], key_size) == 0 && value_size < MAX_TEXT) {
                memcpy(texts[k], value, value_size);
                texts[k][value_size] = 0;
            }
        }
    }
}

static fm_result add_size(fm_reader *reader, fm_vox_scene *scene, cursor c) {
    fm_vox_model model = {0};
    for (int i = 0; i < 3; i++) {
        model.size[i] = get_u32(&c);
        if (c.bad || model.size[i] == 0 || model.size[i] > FM_VOX_MAX_EDGE) {
            return fm_input_fail(reader->input, FM_ERROR_FORMAT,
                                 "has a model %u of %u x %u x %u: 1 to %d along each axis are expected", scene->model_count,
                                 model.size[0], model.size[1], model.size[2], FM_VOX_MAX_EDGE);
        }
    }
    FM_TRY(GROW(reader, scene, models, model_count, model_capacity));
    scene->models[scene->model_count++] = model;
    return FM_OK;
}

static fm_result add_voxels(fm_reader *reader, fm_vox_scene *scene, cursor c) {
    fm_vox_model *model = scene->model_count ? &scene->models[scene->model_count - 1] : NULL;
    if (!model || model->voxels) {
        return fm_input_fail(reader->input, FM_ERROR_FORMAT, "has a chunk XYZI without a chunk SIZE before it");
    }
    model->count = get_u32(&c);
    model->voxels = get_bytes(&c, (uint64_t)model->count * 4);
    if (!model->voxels) {
        return fm_input_fail(reader->input, FM_ERROR_FORMAT, "claims %u voxels in model %u, more than the chunk holds",
                             model->count, scene->model_count - 1);
    }
    for (uint32_t v = 0; v < model->count; v++) {
        const uint8_t *voxel = model->voxels + 4 * (uint64_t)v;
        if (voxel[0] >= model->size[0] || voxel[1] >= model->size[1] || voxel[2] >= model->size[2]) {
            return fm_input_fail(reader->input, FM_ERROR_FORMAT,
                                 "has the voxel (%u, %u, %u) in model %u, whose size is %u x %u x %u", voxel[0], voxel[1], voxel[2],
                                 scene->model_count - 1, model->size[0], model->size[1], model->size[2]);
        }
    }
    return FM_OK;
}

static fm_result add_node(fm_reader *reader, fm_vox_scene *scene, cursor c, char kind) {
    fm_vox_node node = {.id = get_u32(&c), .kind = kind, .body = c.at, .size = left(&c)};
    if (c.bad) {
        return damaged(reader, "scene node");
    }
    FM_TRY(GROW(reader, scene, nodes, node_count, node_capacity));
    scene->nodes[scene->node_count++] = node;
    return FM_OK;
}

static fm_result add_layer(fm_reader *reader, fm_vox_scene *scene, cursor c) {
    static const char *const keys[] = {"_hidden"};
    char text[1][MAX_TEXT];
    uint32_t id = get_u32(&c);
    get_dictionary(&c, 1, keys, text);
    if (c.bad) {
        return damaged(reader, "layer");
    }
    if (strcmp(text[0], "1") == 0) {
        FM_TRY(GROW(reader, scene, hidden_layers, hidden_layer_count, hidden_layer_capacity));
        scene->hidden_layers[scene->hidden_layer_count++] = id;
    }
    return FM_OK;
}

static fm_result add_chunk(fm_reader *reader, fm_vox_scene *scene, const char *id, cursor content) {
    if (memcmp(id, "SIZE", 4) == 0) {
        return add_size(reader, scene, content);
    }
    if (memcmp(id, "XYZI", 4) == 0) {
        return add_voxels(reader, scene, content);
    }
    if (memcmp(id, "nTRN", 4) == 0 || memcmp(id, "nGRP", 4) == 0 || memcmp(id, "nSHP", 4) == 0) {
        return add_node(reader, scene, content, id[1]);
    }
    if (memcmp(id, "LAYR", 4) == 0) {
        return add_layer(reader, scene, content);
    }
    if (memcmp(id, "RGBA", 4) == 0) {
        scene->colors = get_bytes(&content, FM_VOX_PALETTE_BYTES);
        return scene->colors ? FM_OK : damaged(reader, "palette");
    }
    return FM_OK;
}

static int compare_nodes(const void *a, const void *b) {
    const fm_vox_node *x = a, *y = b;
    return x->id < y->id ? -1 : x->id > y->id;
}

fm_result fm_vox_parse(fm_reader *reader, fm_vox_scene *scene) {
    cursor c = {scene->bytes, scene->bytes + scene->size, false};
    get_bytes(&c, 8);
    const uint8_t *main_id = get_bytes(&c, 4);
    uint32_t content = get_u32(&c);
    uint32_t children = get_u32(&c);
    get_bytes(&c, content);
    if (c.bad || memcmp(main_id, "MAIN", 4) != 0) {
        return damaged(reader, "MAIN chunk");
    }
    if (children > left(&c)) {
        return fm_input_fail(reader->input, FM_ERROR_FORMAT, "claims %u bytes of chunks, but %llu follow: the file is truncated",
                             children, (unsigned long long)left(&c));
    }
    c.end = c.at + children;
    while (left(&c) > 0) {
        const uint8_t *id = get_bytes(&c, 4);
        uint32_t size = get_u32(&c);
        uint32_t child_size = get_u32(&c);
        const uint8_t *body = get_bytes(&c, size);
        get_bytes(&c, child_size);
        if (c.bad) {
            return fm_input_fail(reader->input, FM_ERROR_FORMAT, "has a chunk that is longer than the file: the file is truncated");
        }
        FM_TRY(add_chunk(reader, scene, (const char *)id, (cursor){body, body + size, false}));
    }
    for (uint32_t m = 0; m < scene->model_count; m++) {
        if (!scene->models[m].voxels) {
            return fm_input_fail(reader->input, FM_ERROR_FORMAT, "has a model %u without voxels: the chunk XYZI is missing", m);
        }
    }
    if (scene->node_count > 0) {
        qsort(scene->nodes, scene->node_count, sizeof *scene->nodes, compare_nodes);
    }
    for (uint32_t n = 1; n < scene->node_count; n++) {
        if (scene->nodes[n].id == scene->nodes[n - 1].id) {
            return fm_input_fail(reader->input, FM_ERROR_FORMAT, "has two scene nodes %u", scene->nodes[n].id);
        }
    }
    return FM_OK;
}

// ---------------------------------------------------------------------------------------------------------------------------
// The scene
// ---------------------------------------------------------------------------------------------------------------------------

// a after b.
static fm_vox_turn turn_compose(fm_vox_turn a, fm_vox_turn b) {
    fm_vox_turn result;
    for (int i = 0; i < 3; i++) {
        result.column[i] = b.column[a.column[i]];
        result.sign[i] = (int8_t)(a.sign[i] * b.sign[a.column[i]]);
    }
    return result;
}

// Two bits each for the columns of the first two rows, then a bit each for the signs of all three.
static bool parse_turn(const char *text, fm_vox_turn *turn) {
    *turn = identity;
    if (text[0] == 0) {
        return true;
    }
    char *end;
    unsigned long bits = strtoul(text, &end, 10);
    unsigned first = bits & 3, second = bits >> 2 & 3;
    if (*end || bits > 127 || first == second || first == 3 || second == 3) {
        return false;
    }
    turn->column[0] = (uint8_t)first;
    turn->column[1] = (uint8_t)second;
    turn->column[2] = (uint8_t)(3 - first - second);
    for (int i = 0; i < 3; i++) {
        turn->sign[i] = bits >> (4 + i) & 1 ? -1 : 1;
    }
    return true;
}

static bool parse_move(const char *text, int64_t move[3]) {
    for (int i = 0; i < 3 && text[0]; i++) {
        char *end;
        long value = strtol(text, &end, 10);
        if (end == text || value > MAX_MOVE || value < -MAX_MOVE) {
            return false;
        }
        move[i] = value;
        text = end;
        if (i < 2 && text[0] == 0) {
            return false;
        }
    }
    return true;
}

static fm_result place_model(fm_reader *reader, fm_vox_scene *scene, const pose *at, uint32_t model) {
    if (model >= scene->model_count) {
        return fm_input_fail(reader->input, FM_ERROR_FORMAT, "places model %u, but has %u", model, scene->model_count);
    }
    scene->hidden_places += at->hidden;
    if (at->hidden && !reader->desc->include_hidden) {
        return FM_OK;
    }
    fm_vox_place place = {.model = model, .turn = at->turn};
    memcpy(place.move, at->move, sizeof place.move);
    const uint32_t *size = scene->models[model].size;
    const uint8_t corners[2][3] = {{0, 0, 0}, {(uint8_t)(size[0] - 1), (uint8_t)(size[1] - 1), (uint8_t)(size[2] - 1)}};
    int64_t ends[2][3];
    for (int e = 0; e < 2; e++) {
        fm_vox_position(&place, size, corners[e], ends[e]);
    }
    for (int i = 0; i < 3; i++) {
        place.low[i] = ends[0][i] < ends[1][i] ? ends[0][i] : ends[1][i];
        place.size[i] = size[place.turn.column[i]];
    }
    FM_TRY(GROW(reader, scene, places, place_count, place_capacity));
    scene->places[scene->place_count++] = place;
    return FM_OK;
}

static fm_result visit(fm_reader *reader, fm_vox_scene *scene, uint32_t id, const pose *at, int depth);

static fm_result visit_transform(fm_reader *reader, fm_vox_scene *scene, cursor c, const pose *at, int depth) {
    static const char *const node_keys[] = {"_hidden"};
    static const char *const frame_keys[] = {"_r", "_t"};
    char node_texts[1][MAX_TEXT], texts[2][MAX_TEXT];
    get_dictionary(&c, 1, node_keys, node_texts);
    uint32_t child = get_u32(&c);
    get_u32(&c);  // reserved
    uint32_t layer = get_u32(&c);
    get_u32(&c);  // frames of an animation: the first one is shown
    get_dictionary(&c, 2, frame_keys, texts);
    fm_vox_turn turn;
    int64_t move[3] = {0, 0, 0};
    if (c.bad || !parse_turn(texts[0], &turn) || !parse_move(texts[1], move)) {
        return damaged(reader, "transform node");
    }
    pose next = {.turn = turn_compose(at->turn, turn), .hidden = at->hidden || strcmp(node_texts[0], "1") == 0};
    for (uint32_t i = 0; i < scene->hidden_layer_count; i++) {
        next.hidden = next.hidden || scene->hidden_layers[i] == layer;
    }
    for (int i = 0; i < 3; i++) {
        next.move[i] = at->move[i] + at->turn.sign[i] * move[at->turn.column[i]];
    }
    return visit(reader, scene, child, &next, depth + 1);
}

static fm_result visit_group(fm_reader *reader, fm_vox_scene *scene, cursor c, const pose *at, int depth) {
    static const char *const keys[] = {"_hidden"};
    char texts[1][MAX_TEXT];
    get_dictionary(&c, 1, keys, texts);
    uint32_t count = get_u32(&c);
    pose next = *at;
    next.hidden = at->hidden || strcmp(texts[0], "1") == 0;
    for (uint32_t i = 0; i < count && !c.bad; i++) {
        uint32_t child = get_u32(&c);
        if (!c.bad) {
            FM_TRY(visit(reader, scene, child, &next, depth + 1));
        }
    }
    return c.bad ? damaged(reader, "group node") : FM_OK;
}

static fm_result visit_shape(fm_reader *reader, fm_vox_scene *scene, cursor c, const pose *at) {
    static const char *const keys[] = {"_hidden"};
    char texts[1][MAX_TEXT];
    get_dictionary(&c, 1, keys, texts);
    uint32_t count = get_u32(&c);  // over one: frames of an animation, the first one is shown
    uint32_t model = get_u32(&c);
    if (c.bad || count == 0) {
        return damaged(reader, "shape node");
    }
    pose here = *at;
    here.hidden = at->hidden || strcmp(texts[0], "1") == 0;
    return place_model(reader, scene, &here, model);
}

static fm_result visit_body(fm_reader *reader, fm_vox_scene *scene, const fm_vox_node *node, const pose *at, int depth) {
    cursor c = {node->body, node->body + node->size, false};
    switch (node->kind) {
    case 'T':
        return visit_transform(reader, scene, c, at, depth);
    case 'G':
        return visit_group(reader, scene, c, at, depth);
    default:
        return visit_shape(reader, scene, c, at);
    }
}

static fm_result visit(fm_reader *reader, fm_vox_scene *scene, uint32_t id, const pose *at, int depth) {
    const fm_vox_node key = {.id = id};
    fm_vox_node *node = bsearch(&key, scene->nodes, scene->node_count, sizeof key, compare_nodes);
    // Nodes may be shared, so a scene can be far larger than its file, but not endless.
    if (!node || node->open || depth > MAX_DEPTH) {
        const char *why = !node ? "is missing" : node->open ? "is inside itself" : "lies too deep";
        return fm_input_fail(reader->input, FM_ERROR_FORMAT, "has a damaged scene: node %u %s", id, why);
    }
    scene->work += 64 + node->size;
    if (scene->work > max_work) {
        return fm_input_fail(reader->input, FM_ERROR_FORMAT, "repeats its nodes too often: its scene is not sensible");
    }
    node->open = true;
    fm_result result = visit_body(reader, scene, node, at, depth);
    node->open = false;
    return result;
}

fm_result fm_vox_walk(fm_reader *reader, fm_vox_scene *scene) {
    pose origin = {.turn = identity};
    if (scene->model_count == 0) {
        return fm_input_fail(reader->input, FM_ERROR_FORMAT, "has no model");
    }
    if (scene->node_count > 0) {
        return visit(reader, scene, scene->nodes[0].id, &origin, 0);
    }
    // Without a scene the model's lowest corner is the origin.
    for (int i = 0; i < 3; i++) {
        origin.move[i] = scene->models[0].size[i] / 2;
    }
    if (scene->model_count > 1) {
        fm_reader_note(reader, "%u models without a scene: the first one is read", scene->model_count);
    }
    return place_model(reader, scene, &origin, 0);
}
