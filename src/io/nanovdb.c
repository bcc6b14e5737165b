// SPDX-License-Identifier: MIT

// NanoVDB files of one float grid: the voxels nearer than the band's width as active ones, all others as background, positive or
// negative. The tree is root, upper nodes of 32^3 lower nodes, lower nodes of 16^3 leaves, leaves of 8^3 voxels, each kind of node
// together and in the order of its parents. Positions of fields are those of NanoVDB's version 32 as PNanoVDB.h gives them.

#include "io/file.h"

#include <limits.h>
#include <math.h>
#include <string.h>
#include <zlib.h>

enum { LEAF, LOWER, UPPER, LEVELS };

enum {
    GRID_SIZE = 672,
    TREE_SIZE = 64,
    ROOT_SIZE = 64,
    TILE_SIZE = 32,
    FILE_HEADER = 16,
    FILE_ENTRY = 176,
    VERSION = 32 << 21 | 4 << 10 | 2,
    TYPE_FLOAT = 1,
    CLASS_UNKNOWN = 0,
    CLASS_LEVEL_SET = 1,
    CODEC_NONE = 0,
    // Boxes, ranges, averages, deviations, nodes of a kind together.
    GRID_FLAGS = 2 | 4 | 8 | 16 | 32,
    HAS_BOX = 2,
    BLOCKS_TOLD = 4096,
};

static const char magic[8] = {'N', 'a', 'n', 'o', 'V', 'D', 'B', '0'};
static const char grid_name[] = "distance";

// Of a node's kind: edge of what it covers (by its power of two), of one child, and where its fields lie.
static const struct {
    uint32_t edge, child;
    uint32_t size, child_mask, least, table;
} kinds[LEVELS] = {
    [LEAF] = {3, 0, 2144, 0, 80, 96},
    [LOWER] = {7, 3, 33856, 544, 1056, 1088},
    [UPPER] = {12, 7, 270400, 4128, 8224, 8256},
};

// What stands for a node: itself, or a tile of the background.
typedef enum state { STATE_INSIDE = -1, STATE_NODE = 0, STATE_OUTSIDE = 1 } state;

// Of active voxels.
typedef struct summary {
    uint64_t count;
    float least, most;
    double sum, squares;
    int32_t low[3], high[3];
} summary;

typedef struct level {
    uint32_t size[3];  // in nodes
    int8_t *states;
    summary *summaries;  // NULL for leaves
    uint64_t places;     // of the grid that are covered
    uint64_t nodes;      // of these, how many are nodes
    uint64_t address;    // of the first, from the grid's beginning
} level;

typedef struct nanovdb {
    const fm_writer *writer;
    const float *data;
    fm_shape shape;
    float background;
    bool is_signed;
    level levels[LEVELS];
    uint64_t tiles, tile_inside;  // of the root: all, and those without a node
    uint64_t size;                // of the grid in bytes
    uint64_t done;                // leaves scanned and written
    uint8_t *node;                // room for the one being written
    uint64_t written, children;   // nodes of its level, and those below that have been pointed to
    summary all;
} nanovdb;

static void put(uint8_t *at, const void *value, size_t size) {
    memcpy(at, value, size);
}

static void put_u32(uint8_t *at, uint32_t value) {
    put(at, &value, 4);
}

static void put_u64(uint8_t *at, uint64_t value) {
    put(at, &value, 8);
}

static void put_float(uint8_t *at, float value) {
    put(at, &value, 4);
}

static void set_bit(uint8_t *mask, uint32_t bit) {
    mask[bit / 8] = (uint8_t)(mask[bit / 8] | 1u << bit % 8);
}

// ---------------------------------------------------------------------------------------------------------------------------
// What is active
// ---------------------------------------------------------------------------------------------------------------------------

static fm_result choose_background(nanovdb *g) {
    const double band = g->writer->desc->band;
    if (!(band >= 0) || (float)band > 1e30f) {
        return fm_fail(FM_ERROR_INVALID_ARGUMENT, "band is %g: 0, or a width in world units, is wanted", band);
    }
    const uint64_t count = fm_voxels(g->shape);
    float most = 0;
    for (uint64_t i = 0; i < count; i++) {
        const float value = g->data[i];
        if (isnan(value)) {
            return fm_fail(FM_ERROR_UNSUPPORTED, "%s: voxel %llu is NaN, which a NanoVDB level set has no place for",
                           g->writer->path, (unsigned long long)i);
        }
        g->is_signed = g->is_signed || value < 0;
        most = isfinite(value) ? fmaxf(most, fabsf(value)) : most;
    }
    g->background = band > 0 ? (float)band : most > 0 ? most : 1;
    return FM_OK;
}

static void summary_clear(summary *s) {
    *s = (summary){.least = INFINITY, .most = -INFINITY, .low = {INT_MAX, INT_MAX, INT_MAX}, .high = {INT_MIN, INT_MIN, INT_MIN}};
}

static void summary_add(summary *s, float value, const int32_t at[3]) {
    s->count++;
    s->least = fminf(s->least, value);
    s->most = fmaxf(s->most, value);
    s->sum += (double)value;
    s->squares += (double)value * (double)value;
    for (int k = 0; k < 3; k++) {
        s->low[k] = at[k] < s->low[k] ? at[k] : s->low[k];
        s->high[k] = at[k] > s->high[k] ? at[k] : s->high[k];
    }
}

static void summary_join(summary *s, const summary *other) {
    s->count += other->count;
    s->least = fminf(s->least, other->least);
    s->most = fmaxf(s->most, other->most);
    s->sum += other->sum;
    s->squares += other->squares;
    for (int k = 0; k < 3; k++) {
        s->low[k] = other->low[k] < s->low[k] ? other->low[k] : s->low[k];
        s->high[k] = other->high[k] > s->high[k] ? other->high[k] : s->high[k];
    }
}

// The 512 values of the leaf at `place`, z fastest, what stands outside of the volume as background; bits of `active` likewise.
static state scan_leaf(const nanovdb *g, const uint32_t place[3], float values[512], uint8_t active[64], summary *s) {
    bool inside = false, outside = false;
    memset(active, 0, 64);
    summary_clear(s);
    for (uint32_t i = 0; i < 512; i++) {
        const uint32_t at[3] = {place[0] * 8 + i / 64, place[1] * 8 + i / 8 % 8, place[2] * 8 + i % 8};
        float value = g->background;
        if (at[0] < g->shape.x && at[1] < g->shape.y && at[2] < g->shape.z) {
            value = g->data[at[0] + (uint64_t)g->shape.x * (at[1] + (uint64_t)g->shape.y * at[2])];
        }
        if (fabsf(value) < g->background) {
            set_bit(active, i);
            summary_add(s, value, (const int32_t[]){(int32_t)at[0], (int32_t)at[1], (int32_t)at[2]});
        } else {
            value = copysignf(g->background, value);
            inside = inside || value < 0;
            outside = outside || value > 0;
        }
        values[i] = value;
    }
    return s->count > 0 || (inside && outside) ? STATE_NODE : inside ? STATE_INSIDE : STATE_OUTSIDE;
}

static uint64_t place_index(const level *l, const uint32_t place[3]) {
    return (place[0] * (uint64_t)l->size[1] + place[1]) * l->size[2] + place[2];
}

static state state_at(const level *l, const uint32_t place[3]) {
    for (int k = 0; k < 3; k++) {
        if (place[k] >= l->size[k]) {
            return STATE_OUTSIDE;
        }
    }
    return (state)l->states[place_index(l, place)];
}

// The place, on the level below, of child `i` of the node at `place`.
static void child_place(uint32_t kind, const uint32_t place[3], uint32_t i, uint32_t child[3]) {
    const uint32_t bits = kinds[kind].edge - kinds[kind].child, mask = (1u << bits) - 1;
    child[0] = place[0] << bits | i >> 2 * bits;
    child[1] = place[1] << bits | (i >> bits & mask);
    child[2] = place[2] << bits | (i & mask);
}

static uint32_t child_count(uint32_t kind) {
    return 1u << 3 * (kinds[kind].edge - kinds[kind].child);
}

// Whether the node at `place` has to be one: it has a node below it, or sides of both kinds.
static state join_children(const nanovdb *g, uint32_t kind, const uint32_t place[3]) {
    uint32_t child[3];
    child_place(kind, place, 0, child);
    const state first = state_at(&g->levels[kind - 1], child);
    for (uint32_t i = 0; i < child_count(kind); i++) {
        child_place(kind, place, i, child);
        const state s = state_at(&g->levels[kind - 1], child);
        if (s == STATE_NODE || s != first) {
            return STATE_NODE;
        }
    }
    return first;
}

typedef fm_result (*visit_fn)(nanovdb *g, uint32_t kind, const uint32_t place[3]);

// All places of a level in the file's order, that of their parents, or with `nodes` those of nodes.
static fm_result visit(nanovdb *g, uint32_t kind, bool nodes, visit_fn fn);

static fm_result visit_below(nanovdb *g, uint32_t from, uint32_t kind, const uint32_t place[3], bool nodes, visit_fn fn) {
    if (from == kind) {
        return nodes && state_at(&g->levels[kind], place) != STATE_NODE ? FM_OK : fn(g, kind, place);
    }
    if (nodes && state_at(&g->levels[from], place) != STATE_NODE) {
        return FM_OK;
    }
    const level *below = &g->levels[from - 1];
    for (uint32_t i = 0; i < child_count(from); i++) {
        uint32_t child[3];
        child_place(from, place, i, child);
        if (child[0] < below->size[0] && child[1] < below->size[1] && child[2] < below->size[2]) {
            FM_TRY(visit_below(g, from - 1, kind, child, nodes, fn));
        }
    }
    return FM_OK;
}

static fm_result visit(nanovdb *g, uint32_t kind, bool nodes, visit_fn fn) {
    const uint32_t *size = g->levels[UPPER].size;
    for (uint32_t x = 0; x < size[0]; x++) {
        for (uint32_t y = 0; y < size[1]; y++) {
            for (uint32_t z = 0; z < size[2]; z++) {
                FM_TRY(visit_below(g, UPPER, kind, (const uint32_t[]){x, y, z}, nodes, fn));
            }
        }
    }
    return FM_OK;
}

static fm_result tell(nanovdb *g) {
    const uint64_t total = 2 * g->levels[LEAF].places;
    return g->done++ % BLOCKS_TOLD == 0 && !fm_writer_progress(g->writer, g->done - 1, total) ? FM_ERROR_IO : FM_OK;
}

static fm_result judge_leaf(nanovdb *g, uint32_t kind, const uint32_t place[3]) {
    level *l = &g->levels[kind];
    float values[512];
    uint8_t active[64];
    summary s;
    const state found = scan_leaf(g, place, values, active, &s);
    l->states[place_index(l, place)] = (int8_t)found;
    l->nodes += found == STATE_NODE;
    if (s.count > 0) {
        summary_join(&g->levels[LOWER].summaries[place_index(&g->levels[LOWER],
                                                             (const uint32_t[]){place[0] / 16, place[1] / 16, place[2] / 16})],
                     &s);
    }
    return tell(g);
}

static fm_result judge_node(nanovdb *g, uint32_t kind, const uint32_t place[3]) {
    level *l = &g->levels[kind];
    const uint64_t index = place_index(l, place);
    const state found = join_children(g, kind, place);
    l->states[index] = (int8_t)found;
    l->nodes += found == STATE_NODE;
    summary *above = &g->all;
    if (kind == LOWER) {
        above = &g->levels[UPPER]
                     .summaries[place_index(&g->levels[UPPER], (const uint32_t[]){place[0] / 32, place[1] / 32, place[2] / 32})];
    } else {
        g->tiles += found != STATE_OUTSIDE;
    }
    summary_join(above, &l->summaries[index]);
    return FM_OK;
}

static fm_result make_levels(nanovdb *g) {
    const uint32_t edges[3] = {g->shape.x, g->shape.y, g->shape.z};
    for (uint32_t kind = 0; kind < LEVELS; kind++) {
        level *l = &g->levels[kind];
        l->places = 1;
        for (int k = 0; k < 3; k++) {
            l->size[k] = (uint32_t)(((uint64_t)edges[k] + (1u << kinds[kind].edge) - 1) >> kinds[kind].edge);
            l->places *= l->size[k];
        }
        l->states = fm_alloc(g->writer->allocator, l->places, "a sparse grid's nodes");
        l->summaries =
            kind == LEAF ? NULL : fm_alloc(g->writer->allocator, l->places * sizeof *l->summaries, "a sparse grid's nodes");
        if (!l->states || (kind != LEAF && !l->summaries)) {
            return FM_ERROR_OUT_OF_HOST_MEMORY;
        }
        for (uint64_t i = 0; l->summaries && i < l->places; i++) {
            summary_clear(&l->summaries[i]);
        }
    }
    summary_clear(&g->all);
    FM_TRY(visit(g, LEAF, false, judge_leaf));
    FM_TRY(visit(g, LOWER, false, judge_node));
    FM_TRY(visit(g, UPPER, false, judge_node));
    uint64_t address = GRID_SIZE + TREE_SIZE + ROOT_SIZE + TILE_SIZE * g->tiles;
    for (uint32_t kind = LEVELS; kind-- > 0;) {
        g->levels[kind].address = address;
        address += g->levels[kind].nodes * kinds[kind].size;
    }
    g->size = address;
    return FM_OK;
}

static void free_levels(nanovdb *g) {
    for (uint32_t kind = 0; kind < LEVELS; kind++) {
        level *l = &g->levels[kind];
        fm_free(g->writer->allocator, l->states, l->places);
        fm_free(g->writer->allocator, l->summaries, l->places * sizeof *l->summaries);
    }
}

// ---------------------------------------------------------------------------------------------------------------------------
// The file
// ---------------------------------------------------------------------------------------------------------------------------

// Least, most, average and deviation, at `at`.
static void put_summary(uint8_t *at, const summary *s) {
    if (s->count == 0) {
        return;
    }
    const double average = s->sum / (double)s->count;
    put_float(at, s->least);
    put_float(at + 4, s->most);
    put_float(at + 8, (float)average);
    put_float(at + 12, (float)sqrt(fmax(s->squares / (double)s->count - average * average, 0)));
}

static void put_world_box(const nanovdb *g, uint8_t *at) {
    const fm_volume_desc *desc = &g->writer->volume->desc;
    for (int k = 0; k < 3 && g->all.count > 0; k++) {
        // By convention a voxel's box begins at its centre.
        const double low = desc->origin[k] + desc->spacing[k] * g->all.low[k];
        const double high = desc->origin[k] + desc->spacing[k] * ((double)g->all.high[k] + 1);
        put(at + 8 * k, &low, 8);
        put(at + 24 + 8 * k, &high, 8);
    }
}

// Index to world, its inverse and the shift, in floats and then in doubles.
static void put_map(const nanovdb *g, uint8_t *at) {
    const fm_volume_desc *desc = &g->writer->volume->desc;
    for (int k = 0; k < 3; k++) {
        const double scale = desc->spacing[k], inverse = 1 / scale;
        put_float(at + 16 * k, (float)scale);
        put_float(at + 36 + 16 * k, (float)inverse);
        put_float(at + 72 + 4 * k, (float)desc->origin[k]);
        put(at + 88 + 32 * k, &scale, 8);
        put(at + 160 + 32 * k, &inverse, 8);
        put(at + 232 + 8 * k, &desc->origin[k], 8);
    }
    const double taper = 1;
    put_float(at + 84, 1);
    put(at + 256, &taper, 8);
}

static void put_grid(const nanovdb *g, uint8_t *at) {
    put(at, magic, 8);
    put_u32(at + 16, VERSION);
    put_u32(at + 20, g->all.count > 0 ? GRID_FLAGS : GRID_FLAGS & ~HAS_BOX);
    put_u32(at + 28, 1);
    put_u64(at + 32, g->size);
    put(at + 40, grid_name, sizeof grid_name);
    put_map(g, at + 296);
    put_world_box(g, at + 560);
    put(at + 608, g->writer->volume->desc.spacing, 24);
    put_u32(at + 632, g->is_signed ? CLASS_LEVEL_SET : CLASS_UNKNOWN);
    put_u32(at + 636, TYPE_FLOAT);
}

static void put_tree(const nanovdb *g, uint8_t *at) {
    for (uint32_t kind = 0; kind < LEVELS; kind++) {
        put_u64(at + 8 * kind, g->levels[kind].address - GRID_SIZE);
        put_u32(at + 32 + 4 * kind, (uint32_t)g->levels[kind].nodes);
    }
    put_u64(at + 24, TREE_SIZE);
    put_u64(at + 56, g->all.count);
}

static void put_box(uint8_t *at, const summary *s) {
    put(at, s->low, 12);
    put(at + 12, s->high, 12);
}

static void put_root(const nanovdb *g, uint8_t *at) {
    put_box(at, &g->all);
    put_u32(at + 24, (uint32_t)g->tiles);
    put_float(at + 28, g->background);
    put_summary(at + 32, &g->all);
    const level *l = &g->levels[UPPER];
    uint64_t node = 0;
    uint8_t *tile = at + ROOT_SIZE;
    for (uint64_t i = 0; i < l->places; i++) {
        const uint64_t z = i % l->size[2], y = i / l->size[2] % l->size[1], x = i / l->size[2] / l->size[1];
        if (l->states[i] == STATE_OUTSIDE) {
            continue;
        }
        put_u64(tile, z | y << 21 | x << 42);
        if (l->states[i] == STATE_NODE) {
            put_u64(tile + 8, l->address + node++ * kinds[UPPER].size - GRID_SIZE - TREE_SIZE);
        }
        put_float(tile + 20, (float)l->states[i] * g->background);
        tile += TILE_SIZE;
    }
}

static uint64_t name_key(void) {
    uint64_t key = 0;
    for (const char *at = grid_name; *at; at++) {
        key = key * 67 + (uint8_t)*at + (key >> 56);
    }
    return key;
}

static fm_result write_file_header(const nanovdb *g) {
    uint8_t head[FILE_HEADER + FILE_ENTRY] = {0};
    put(head, magic, 8);
    put_u32(head + 8, VERSION);
    head[12] = 1;
    uint8_t *at = head + FILE_HEADER;
    put_u64(at, g->size);
    put_u64(at + 8, g->size);
    put_u64(at + 16, name_key());
    put_u64(at + 24, g->all.count);
    put_u32(at + 32, TYPE_FLOAT);
    put_u32(at + 36, g->is_signed ? CLASS_LEVEL_SET : CLASS_UNKNOWN);
    put_world_box(g, at + 40);
    put_box(at + 88, &g->all);
    put(at + 112, g->writer->volume->desc.spacing, 24);
    put_u32(at + 136, sizeof grid_name);
    for (uint32_t kind = 0; kind < LEVELS; kind++) {
        put_u32(at + 140 + 4 * kind, (uint32_t)g->levels[kind].nodes);
    }
    put_u32(at + 152, 1);
    put_u32(at + 172, VERSION);
    FM_TRY(fm_output_write(g->writer->output, head, sizeof head));
    return fm_output_write(g->writer->output, grid_name, sizeof grid_name);
}

// Grid, tree and root with its tiles, and the sum over them, which is all that NanoVDB's partial checksum covers.
static fm_result write_top(const nanovdb *g) {
    const uint64_t size = g->levels[UPPER].address;
    uint8_t *top = fm_alloc_zero(g->writer->allocator, size, "a sparse grid's root");
    if (!top) {
        return FM_ERROR_OUT_OF_HOST_MEMORY;
    }
    put_grid(g, top);
    put_tree(g, top + GRID_SIZE);
    put_root(g, top + GRID_SIZE + TREE_SIZE);
    const uLong sum = crc32_z(crc32_z(0, NULL, 0), top + 16, (z_size_t)(size - 16));
    put_u32(top + 8, (uint32_t)sum);
    put_u32(top + 12, UINT32_MAX);
    const fm_result result = fm_output_write(g->writer->output, top, size);
    fm_free(g->writer->allocator, top, size);
    return result;
}

static fm_result write_node(nanovdb *g, uint32_t kind, const uint32_t place[3]) {
    const level *l = &g->levels[kind], *below = &g->levels[kind - 1];
    summary s = l->summaries[place_index(l, place)];
    memset(g->node, 0, kinds[kind].size);
    for (int k = 0; k < 3 && s.count == 0; k++) {
        // No box, but where the node lies is read off its corner.
        s.low[k] = (int32_t)(place[k] << kinds[kind].edge);
        s.high[k] = s.low[k] - 1;
    }
    put_box(g->node, &s);
    put_u64(g->node + 24, s.count > 0 ? HAS_BOX : 0);
    put_summary(g->node + kinds[kind].least, &s);
    const uint64_t own = l->address + g->written++ * kinds[kind].size;
    for (uint32_t i = 0; i < child_count(kind); i++) {
        uint32_t child[3];
        child_place(kind, place, i, child);
        const state found = state_at(below, child);
        uint8_t *entry = g->node + kinds[kind].table + 8 * i;
        if (found == STATE_NODE) {
            set_bit(g->node + kinds[kind].child_mask, i);
            put_u64(entry, below->address + g->children++ * kinds[kind - 1].size - own);
        } else {
            put_float(entry, (float)found * g->background);
        }
    }
    return fm_output_write(g->writer->output, g->node, kinds[kind].size);
}

static fm_result write_leaf(nanovdb *g, uint32_t kind, const uint32_t place[3]) {
    uint8_t leaf[2144] = {0};
    float values[512];
    summary s;
    scan_leaf(g, place, values, leaf + 16, &s);
    for (int k = 0; k < 3; k++) {
        put_u32(leaf + 4 * k, s.count > 0 ? (uint32_t)s.low[k] : place[k] * 8);
        leaf[12 + k] = s.count > 0 ? (uint8_t)(s.high[k] - s.low[k]) : 0;
    }
    leaf[15] = s.count > 0 ? HAS_BOX : 0;
    put_summary(leaf + kinds[kind].least, &s);
    put(leaf + kinds[kind].table, values, sizeof values);
    FM_TRY(tell(g));
    return fm_output_write(g->writer->output, leaf, sizeof leaf);
}

static fm_result write_grid(nanovdb *g) {
    FM_TRY(write_file_header(g));
    FM_TRY(write_top(g));
    for (uint32_t kind = UPPER; kind > LEAF; kind--) {
        g->written = g->children = 0;
        FM_TRY(visit(g, kind, true, write_node));
    }
    return visit(g, LEAF, true, write_leaf);
}

static fm_result nanovdb_write(fm_writer *writer) {
    const fm_volume_desc *desc = &writer->volume->desc;
    if (desc->type != FM_TYPE_F32) {
        return fm_fail(FM_ERROR_UNSUPPORTED, "%s: NanoVDB files hold float32, not %s: write the field as float32", writer->path,
                       fm_type_name(desc->type));
    }
    if (fm_machine_is_big_endian()) {
        return fm_fail(FM_ERROR_UNSUPPORTED, "%s: NanoVDB files are written on little-endian machines only", writer->path);
    }
    nanovdb g = {.writer = writer, .data = writer->data, .shape = desc->shape};
    FM_TRY(choose_background(&g));
    FM_TRY(fm_writer_open(writer, writer->gzip));
    g.node = fm_alloc(writer->allocator, kinds[UPPER].size, "a sparse grid's node");
    fm_result result = g.node ? make_levels(&g) : FM_ERROR_OUT_OF_HOST_MEMORY;
    if (result == FM_OK) {
        result = write_grid(&g);
    }
    const uint64_t total = 2 * g.levels[LEAF].places;
    if (result == FM_OK && !fm_writer_progress(writer, total, total)) {
        result = FM_ERROR_IO;
    }
    fm_free(writer->allocator, g.node, kinds[UPPER].size);
    free_levels(&g);
    return result;
}

static bool nanovdb_matches(const uint8_t *head, size_t size) {
    return size >= sizeof magic && memcmp(head, magic, sizeof magic) == 0;
}

static const char *const extensions[] = {".nvdb", NULL};

const fm_codec fm_codec_nanovdb = {
    .format = FM_FORMAT_NANOVDB,
    .name = "NanoVDB",
    .extensions = extensions,
    .matches = nanovdb_matches,
    .write = nanovdb_write,
};
