// SPDX-License-Identifier: MIT
// What a chunk's leaves hold, and the words of its nodes. Leaves are numbered by level, then z, y, x, so that neighbours along x
// follow each other and share a column. Published is one order of all leaves; ours is one a chunk, which costs a column where a run
// passes from one chunk to the next, keeps what is near in space near in memory, and needs no memory for sorting.

#include "octree/build.h"
#include "shaders/include/vcp_rule.h"

#include <assert.h>
#include <math.h>
#include <string.h>

enum { SLICES = 2 * FM_CHUNK };  // of all levels of a chunk, at most

typedef struct slice {
    int level;
    uint32_t z;
    uint64_t columns;  // of the slice, then those before it
} slice;

typedef struct tile {
    uint64_t groups;  // of eight children; then those before it
    uint64_t leaves[FM_FIELDS], empty;
} tile;

typedef struct emit_job {
    fm_octree_build *build;
    const fm_octree_chunk *chunk;
    slice slices[SLICES];
    uint32_t slice_count;
    uint32_t tiles[3];
    tile *all;
    uint64_t tile_count;
    uint32_t *words;  // where the chunk's groups begin
    uint64_t first;   // and their number
    uint32_t *roots;
} emit_job;

static bool is_leaf(const fm_octree_nodes *nodes, uint64_t i) {
    return nodes->states[i] == FM_NODE_IS_LEAF;
}

static void count_columns(void *user, uint64_t begin, uint64_t end, uint32_t worker) {
    emit_job *job = user;
    (void)worker;
    for (uint64_t s = begin; s < end; s++) {
        slice *own = &job->slices[s];
        const fm_octree_nodes *nodes = &job->chunk->nodes[own->level];
        const uint64_t rows = nodes->shape[1];
        uint64_t columns = 0;
        for (uint64_t row = own->z * rows; row < (own->z + 1) * rows; row++) {
            bool before = false;
            for (uint64_t i = row * nodes->shape[0]; i < (row + 1) * nodes->shape[0]; i++) {
                const bool leaf = is_leaf(nodes, i);
                columns += leaf ? 1 + !before : 0;
                before = leaf;
            }
        }
        own->columns = columns;
    }
}

// --- Values ---

// The shares of a triangle's corners in a point of it.
static void shares_of(const float (*corners)[3], const double point[3], double shares[3]) {
    double u[3], v[3], w[3], uu = 0, uv = 0, vv = 0, wu = 0, wv = 0;
    for (int axis = 0; axis < 3; axis++) {
        u[axis] = (double)corners[1][axis] - (double)corners[0][axis];
        v[axis] = (double)corners[2][axis] - (double)corners[0][axis];
        w[axis] = point[axis] - (double)corners[0][axis];
        uu += u[axis] * u[axis];
        uv += u[axis] * v[axis];
        vv += v[axis] * v[axis];
        wu += w[axis] * u[axis];
        wv += w[axis] * v[axis];
    }
    const double area2 = uu * vv - uv * uv;
    double b = 0, c = 0;
    if (area2 > 1e-14 * uu * vv) {
        b = fmin(1, fmax(0, (vv * wu - uv * wv) / area2));
        c = fmin(1 - b, fmax(0, (uu * wv - uv * wu) / area2));
    } else if (uu >= vv && uu > 0) {
        b = fmin(1, fmax(0, wu / uu));
    } else if (vv > 0) {
        c = fmin(1, fmax(0, wv / vv));
    }
    shares[0] = 1 - b - c;
    shares[1] = b;
    shares[2] = c;
}

static uint32_t mix_color(const uint32_t paint[3][2], const double shares[3]) {
    uint32_t color = 0;
    for (int channel = 0; channel < 4; channel++) {
        double sum = 0;
        for (int i = 0; i < 3; i++) {
            uint8_t bytes[4];
            memcpy(bytes, &paint[i][0], sizeof bytes);
            sum += bytes[channel] * shares[i];
        }
        color |= (uint32_t)(sum + 0.5) << 8 * channel;
    }
    return color;
}

static uint32_t mix_texture(const uint32_t paint[3][2], const double shares[3]) {
    uint32_t bits[2];
    for (int axis = 0; axis < 2; axis++) {
        double sum = 0;
        for (int i = 0; i < 3; i++) {
            float value;
            memcpy(&value, &paint[i][axis], sizeof value);
            sum += (double)value * shares[i];
        }
        sum = isfinite(sum) ? sum - floor(sum) : 0;
        bits[axis] = (uint32_t)(sum * 65536) & 0xffff;
    }
    return bits[0] | bits[1] << 16;
}

static uint32_t attribute_of(const fm_octree_build *build, const fm_octree_field *field, uint64_t i, const uint32_t corner[3],
                             int level) {
    const fm_octree_soup *soup = &build->soup;
    const uint64_t triangle = field->triangles[i];
    if (build->desc->attribute == FM_OCTREE_TRIANGLE) {
        return soup->numbers[triangle];
    }
    double point[3], shares[3];
    for (int axis = 0; axis < 3; axis++) {
        point[axis] = (double)(corner[axis] << level) + (double)field->vectors[i][axis];
    }
    shares_of((const float(*)[3])soup->mesh.vertices + 3 * triangle, point, shares);
    const uint32_t(*paint)[2] = (const uint32_t(*)[2])soup->paint[triangle];
    return build->desc->attribute == FM_OCTREE_COLOR ? mix_color(paint, shares) : mix_texture(paint, shares);
}

static bool is_leaf_corner(const fm_octree_nodes *nodes, const uint32_t corner[3]) {
    for (uint32_t i = 0; i < 8; i++) {
        // Below 0 is above all.
        const uint32_t x = corner[0] - (i & 1), y = corner[1] - (i >> 1 & 1), z = corner[2] - (i >> 2);
        if (x < nodes->shape[0] && y < nodes->shape[1] && z < nodes->shape[2] &&
            is_leaf(nodes, fm_node_at(nodes->shape, x, y, z))) {
            return true;
        }
    }
    return false;
}

static uint32_t code_vector(const fm_octree_build *build, const float vector[3], int level, uint64_t *errors) {
    const fm_v3 v = {vector[0], vector[1], vector[2]};
    const float edge = (float)(1u << level);
    const int code = (int)build->desc->code;
    const uint32_t word = fm_vcp_encode(v, code, FM_OCTREE_REACH * edge);
    const fm_v3 off = fm_less(fm_vcp_decode(word, code, FM_OCTREE_REACH * edge), v);
    const float error = sqrtf(fm_dot(off, off)) / (edge * FM_ERROR_STEP);
    errors[error < FM_ERROR_BINS - 1 ? (uint32_t)error : FM_ERROR_BINS - 1]++;
    return word;
}

// Every corner once, which up to four columns repeat.
static void code_slices(void *user, uint64_t begin, uint64_t end, uint32_t worker) {
    const emit_job *job = user;
    for (uint64_t z = begin; z < end; z++) {
        for (int level = 0; level <= job->build->leaf_most; level++) {
            const fm_octree_field *field = &job->chunk->fields[level];
            for (uint32_t y = 0; z < field->shape[2] && y < field->shape[1]; y++) {
                for (uint32_t x = 0; x < field->shape[0]; x++) {
                    const uint32_t corner[3] = {x, y, (uint32_t)z};
                    const uint64_t i = fm_node_at(field->shape, x, y, (uint32_t)z);
                    if (field->triangles[i] != FM_NO_TRIANGLE && is_leaf_corner(&job->chunk->nodes[level], corner)) {
                        uint64_t *errors = job->build->errors + (uint64_t)worker * FM_ERROR_BINS;
                        field->codes[i] = code_vector(job->build, field->vectors[i], level, errors);
                    }
                }
            }
        }
    }
}

static void write_value(const fm_octree_build *build, const fm_octree_field *field, uint64_t i, uint8_t *to) {
    const float cell = (float)build->cell, *v = field->vectors[i];
    if (build->desc->kind == FM_OCTREE_DISTANCE) {
        const float distance = (float)((double)field->distance[i] * build->cell);
        memcpy(to, &distance, sizeof distance);
    } else if (build->desc->code == FM_OCTREE_FLOATS) {
        const float world[3] = {v[0] * cell, v[1] * cell, v[2] * cell};
        memcpy(to, world, sizeof world);
    } else if (build->desc->code == FM_OCTREE_SHORT) {
        const uint16_t word = (uint16_t)field->codes[i];
        memcpy(to, &word, sizeof word);
    } else {
        memcpy(to, &field->codes[i], sizeof field->codes[i]);
    }
}

static void write_column(const emit_job *job, int level, const uint32_t corner[3], uint64_t column) {
    const fm_octree_build *build = job->build;
    fm_octree *octree = build->octree;
    const fm_octree_field *field = &job->chunk->fields[level];
    for (uint32_t k = 0; k < FM_COLUMN_VALUES; k++) {
        const uint32_t at[3] = {corner[0], corner[1] + (k & 1), corner[2] + (k >> 1)};
        const uint64_t i = fm_node_at(field->shape, at[0], at[1], at[2]), value = column * FM_COLUMN_VALUES + k;
        assert(field->triangles[i] != FM_NO_TRIANGLE);
        write_value(build, field, i, octree->values.data + value * octree->values.size);
        if (build->desc->attribute != FM_OCTREE_PLAIN) {
            ((uint32_t *)octree->attributes.data)[value] = attribute_of(build, field, i, at, level);
        }
    }
}

static void write_slices(void *user, uint64_t begin, uint64_t end, uint32_t worker) {
    const emit_job *job = user;
    (void)worker;
    for (uint64_t s = begin; s < end; s++) {
        const slice *own = &job->slices[s];
        const fm_octree_nodes *nodes = &job->chunk->nodes[own->level];
        uint64_t column = own->columns;
        for (uint32_t y = 0; y < nodes->shape[1]; y++) {
            bool before = false;
            for (uint32_t x = 0; x <= nodes->shape[0]; x++) {
                const uint64_t i = fm_node_at(nodes->shape, x, y, own->z);
                const bool leaf = x < nodes->shape[0] && is_leaf(nodes, i);
                const uint32_t corner[3] = {x, y, own->z};
                if (leaf || before) {
                    write_column(job, own->level, corner, column);
                }
                if (leaf) {
                    nodes->words[i] = (uint32_t)column;
                }
                column += leaf || before;
                before = leaf;
            }
        }
    }
}

static fm_result emit_values(emit_job *job) {
    fm_octree_build *build = job->build;
    fm_octree *octree = build->octree;
    fm_pool *pool = build->context->pool;
    for (int level = 0; level <= build->leaf_most; level++) {
        for (uint32_t z = 0; z < job->chunk->nodes[level].shape[2]; z++) {
            job->slices[job->slice_count++] = (slice){level, z, 0};
        }
    }
    fm_pool_run(pool, job->slice_count, 1, count_columns, job);
    const uint64_t first = octree->values.count / FM_COLUMN_VALUES;
    uint64_t columns = first;
    for (uint32_t s = 0; s < job->slice_count; s++) {
        const uint64_t own = job->slices[s].columns;
        job->slices[s].columns = columns;
        columns += own;
    }
    if (columns >= INT32_MAX) {
        return fm_fail(FM_ERROR_UNSUPPORTED, "leaves need more than 2^31 columns of values: choose a smaller size");
    }
    const uint64_t more = (columns - first) * FM_COLUMN_VALUES;
    const bool paint = build->desc->attribute != FM_OCTREE_PLAIN;
    if (!fm_octree_reserve(octree, &octree->values, more) || (paint && !fm_octree_reserve(octree, &octree->attributes, more))) {
        return FM_ERROR_OUT_OF_HOST_MEMORY;
    }
    octree->values.count += more;
    octree->attributes.count += paint ? more : 0;
    if (build->desc->kind == FM_OCTREE_CLOSEST && build->desc->code != FM_OCTREE_FLOATS) {
        fm_pool_run(pool, job->chunk->fields[0].shape[2], 1, code_slices, job);
    }
    fm_pool_run(pool, job->slice_count, 1, write_slices, job);
    return FM_OK;
}

// --- Nodes ---

static void place_tile(const emit_job *job, uint64_t index, uint32_t at[3]) {
    const uint64_t row = index / job->tiles[0];
    at[0] = (uint32_t)(index % job->tiles[0]);
    at[1] = (uint32_t)(row % job->tiles[1]);
    at[2] = (uint32_t)(row / job->tiles[1]);
}

static void count_node(const emit_job *job, tile *own, int level, uint32_t x, uint32_t y, uint32_t z) {
    const fm_octree_nodes *nodes = &job->chunk->nodes[level];
    switch (nodes->states[fm_node_at(nodes->shape, x, y, z)]) {
    case FM_NODE_IS_EMPTY:
        own->empty++;
        return;
    case FM_NODE_IS_LEAF:
        own->leaves[level]++;
        return;
    default:
        own->groups++;
        for (uint32_t i = 0; i < 8; i++) {
            count_node(job, own, level - 1, 2 * x + (i & 1), 2 * y + (i >> 1 & 1), 2 * z + (i >> 2));
        }
    }
}

static void count_tiles(void *user, uint64_t begin, uint64_t end, uint32_t worker) {
    const emit_job *job = user;
    (void)worker;
    for (uint64_t i = begin; i < end; i++) {
        uint32_t at[3];
        place_tile(job, i, at);
        job->all[i] = (tile){0};
        count_node(job, &job->all[i], job->build->leaf_most, at[0], at[1], at[2]);
    }
}

// `next`: how many groups the tile has handed out; parents come before their children. `bound`: of what the node lies in.
static uint32_t node_word(const emit_job *job, uint64_t *next, int level, const uint32_t at[3], float bound) {
    const fm_octree_build *build = job->build;
    const fm_octree_nodes *nodes = &job->chunk->nodes[level];
    const uint64_t i = fm_node_at(nodes->shape, at[0], at[1], at[2]);
    if (nodes->states[i] == FM_NODE_IS_LEAF) {
        return ~nodes->words[i];
    }
    if (level >= build->far.level) {
        const int up = FM_CHUNK_LEVEL - level;
        bound = fmaxf(bound, fm_octree_far_bound(&build->far, level, (job->chunk->at[0] << up) + at[0],
                                                 (job->chunk->at[1] << up) + at[1], (job->chunk->at[2] << up) + at[2]));
    }
    if (nodes->states[i] == FM_NODE_IS_EMPTY) {
        float own;
        memcpy(&own, &nodes->words[i], sizeof own);
        return fm_octree_bound_word(build, fmaxf(own, bound));
    }
    const uint64_t group = (*next)++;
    for (uint32_t child = 0; child < 8; child++) {
        const uint32_t part[3] = {2 * at[0] + (child & 1), 2 * at[1] + (child >> 1 & 1), 2 * at[2] + (child >> 2)};
        job->words[8 * group + child] = node_word(job, next, level - 1, part, bound);
    }
    return (uint32_t)(job->first + 8 * group);
}

static void write_tiles(void *user, uint64_t begin, uint64_t end, uint32_t worker) {
    const emit_job *job = user;
    const uint32_t edge = (uint32_t)FM_CHUNK >> job->build->leaf_most;
    const uint32_t shape[3] = {edge, edge, edge};
    (void)worker;
    for (uint64_t i = begin; i < end; i++) {
        uint32_t at[3];
        uint64_t next = job->all[i].groups;
        place_tile(job, i, at);
        job->roots[fm_node_at(shape, at[0], at[1], at[2])] = node_word(job, &next, job->build->leaf_most, at, 0);
    }
}

static fm_result emit_nodes(emit_job *job, uint64_t chunk) {
    fm_octree_build *build = job->build;
    fm_octree *octree = build->octree;
    fm_octree_info *info = &octree->info;
    fm_pool_run(build->context->pool, job->tile_count, 4, count_tiles, job);
    uint64_t groups = 0;
    for (uint64_t i = 0; i < job->tile_count; i++) {
        tile *own = &job->all[i];
        const uint64_t count = own->groups;
        own->groups = groups;
        groups += count;
        info->empty += own->empty;
        for (int level = 0; level < FM_FIELDS; level++) {
            info->leaves[level] += own->leaves[level];
        }
    }
    info->internal += groups;
    const uint64_t root_count = UINT64_C(1) << 3 * (FM_CHUNK_LEVEL - build->leaf_most);
    FM_TRY(fm_octree_more_words(octree, 8 * groups));
    if (!fm_octree_reserve(octree, &build->roots, root_count)) {
        return FM_ERROR_OUT_OF_HOST_MEMORY;
    }
    job->first = octree->words.count;
    job->words = (uint32_t *)octree->words.data + job->first;
    job->roots = (uint32_t *)build->roots.data + build->roots.count;
    build->slots[chunk] = (uint32_t)(build->roots.count / root_count) + 1;
    octree->words.count += 8 * groups;
    build->roots.count += root_count;
    fm_pool_run(build->context->pool, job->tile_count, 4, write_tiles, job);
    return FM_OK;
}

fm_result fm_octree_chunk_emit(fm_octree_build *build, uint64_t chunk) {
    emit_job job = {.build = build, .chunk = &build->chunk, .tile_count = 1};
    for (int axis = 0; axis < 3; axis++) {
        job.tiles[axis] = build->chunk.nodes[build->leaf_most].shape[axis];
        job.tile_count *= job.tiles[axis];
    }
    job.all = fm_octree_alloc(build->context, job.tile_count * sizeof *job.all, "counts of nodes");
    if (!job.all) {
        return FM_ERROR_OUT_OF_HOST_MEMORY;
    }
    fm_result result = emit_values(&job);
    result = result == FM_OK ? emit_nodes(&job, chunk) : result;
    fm_octree_free(build->context, job.all, job.tile_count * sizeof *job.all);
    return result;
}
