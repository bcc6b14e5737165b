// SPDX-License-Identifier: MIT
// Which cells of a chunk are leaves: from the finest upwards, eight leaves become one where its own corners say the same. Source:
// Demir and Westermann 2015, section 3. Ours: a leaf replaces others only if besides no corner of the finest grid near the surface
// gets another distance by more than the threshold.

#include "octree/build.h"
#include "shaders/include/vcp_rule.h"

#include <math.h>
#include <string.h>

static const float NEAR_SURFACE = 1.7320508f, MOST_OFF = 0.05f;

typedef struct corner_set {
    float x[8], y[8], z[8];        // vectors in edges of the cell
    float length2[8], inverse[8];  // of their squared lengths; without length: +infinity and 0
    float values[8];               // in finest cells
} corner_set;

typedef struct merge_job {
    const fm_octree_build *build;
    const fm_octree_chunk *chunk;
    uint32_t tiles[3];
    bool signed_values;
    float threshold;
} merge_job;

static float bits_float(uint32_t bits) {
    float value;
    memcpy(&value, &bits, sizeof value);
    return value;
}

static uint32_t float_bits(float value) {
    uint32_t bits;
    memcpy(&bits, &value, sizeof bits);
    return bits;
}

static float nearest_corner(const fm_octree_field *field, uint32_t x, uint32_t y, uint32_t z) {
    float least = INFINITY;
    for (uint32_t i = 0; i < 8; i++) {
        least = fminf(least, fabsf(field->distance[fm_node_at(field->shape, x + (i & 1), y + (i >> 1 & 1), z + (i >> 2))]));
    }
    return least;
}

// No place of a cell is farther from all its corners than half its diagonal. What is grown may be too far, seldom by more than a
// quarter of a cell, and knows nothing of what its lattice does not reach.
static float bound_by_corners(const merge_job *job, int level, const uint32_t at[3], float nearest) {
    const bool grown = job->build->desc->method == FM_OCTREE_GROWN;
    const float bound = fminf(nearest, job->chunk->fields[level].band) - 0.8660255f * (float)(1u << level) - (grown ? 0.5f : 0);
    return fmaxf(0, grown ? fminf(bound, fm_octree_grown_reach(job->chunk, level, at)) : bound);
}

static bool outside(const merge_job *job, int level, uint32_t x, uint32_t y, uint32_t z) {
    const uint32_t at[3] = {x, y, z};
    for (int axis = 0; axis < 3; axis++) {
        if (job->chunk->at[axis] * (uint64_t)FM_CHUNK + ((uint64_t)at[axis] << level) >= job->build->cells[axis]) {
            return true;
        }
    }
    return false;
}

// Whether the place of the surface nearest to some corner is in the cell or within the band of it. Of a plane through a cell one
// always is.
static bool passed(const merge_job *job, uint32_t x, uint32_t y, uint32_t z) {
    const fm_octree_field *field = &job->chunk->fields[0];
    const float low = -job->build->desc->band, high = 1 - low;
    for (uint32_t i = 0; i < 8; i++) {
        const uint64_t at = fm_node_at(field->shape, x + (i & 1), y + (i >> 1 & 1), z + (i >> 2));
        bool in = field->triangles[at] != FM_NO_TRIANGLE;
        for (uint32_t axis = 0; axis < 3 && in; axis++) {
            const float place = (float)(i >> axis & 1) + field->vectors[at][axis];
            in = place >= low && place <= high;
        }
        if (in) {
            return true;
        }
    }
    return false;
}

static void set_cell(const merge_job *job, uint32_t x, uint32_t y, uint32_t z) {
    const fm_octree_nodes *nodes = &job->chunk->nodes[0];
    const fm_octree_field *field = &job->chunk->fields[0];
    const uint64_t i = fm_node_at(nodes->shape, x, y, z);
    const float nearest = nearest_corner(field, x, y, z);
    const bool beyond = outside(job, 0, x, y, z);
    const bool empty = beyond || (fm_octree_is_thin(job->build) ? !passed(job, x, y, z) : nearest > job->build->desc->band);
    nodes->states[i] = empty ? FM_NODE_IS_EMPTY : FM_NODE_IS_LEAF;
    nodes->words[i] = float_bits(beyond ? INFINITY : bound_by_corners(job, 0, (const uint32_t[3]){x, y, z}, nearest));
}

static bool corners_of(const merge_job *job, int level, uint32_t x, uint32_t y, uint32_t z, corner_set *set) {
    const fm_octree_field *field = &job->chunk->fields[level];
    const float scale = 1.0f / (float)(1u << level);
    for (uint32_t i = 0; i < 8; i++) {
        const uint64_t at = fm_node_at(field->shape, x + (i & 1), y + (i >> 1 & 1), z + (i >> 2));
        if (field->triangles[at] == FM_NO_TRIANGLE) {
            return false;
        }
        set->values[i] = field->distance[at];
        const float *v = field->vectors[at];
        set->x[i] = v[0] * scale;
        set->y[i] = v[1] * scale;
        set->z[i] = v[2] * scale;
        const float length2 = set->x[i] * set->x[i] + set->y[i] * set->y[i] + set->z[i] * set->z[i];
        set->length2[i] = length2 > 0 ? length2 : INFINITY;
        set->inverse[i] = length2 > 0 ? 1 / length2 : 0;
    }
    return true;
}

// fm_vcp_between of eight lanes, without the divisions that all places of a cell share.
static fm_v3 vector_between(const corner_set *set, fm_v3 at) {
    static const float cx[8] = {0, 1, 0, 1, 0, 1, 0, 1}, cy[8] = {0, 0, 1, 1, 0, 0, 1, 1}, cz[8] = {0, 0, 0, 0, 1, 1, 1, 1};
    float weight[8], along[8], square[8];
    fm_v3 line = {0, 0, 0};
    for (int i = 0; i < 8; i++) {
        const float x = at.x - cx[i], y = at.y - cy[i], z = at.z - cz[i];
        weight[i] = (1 - fabsf(x)) * (1 - fabsf(y)) * (1 - fabsf(z));
        along[i] = 1 - (set->x[i] * x + set->y[i] * y + set->z[i] * z) * set->inverse[i];
        square[i] = along[i] * along[i] * set->length2[i];
    }
    int best = 0;
    for (int i = 0; i < 8; i++) {
        line = fm_add(line, fm_v3_of(weight[i] * set->x[i], weight[i] * set->y[i], weight[i] * set->z[i]));
        best = square[i] < square[best] ? i : best;
    }
    if (square[best] < INFINITY && square[best] > fm_dot(line, line)) {
        return fm_times(fm_v3_of(set->x[best], set->y[best], set->z[best]), along[best]);
    }
    return line;
}

static float value_between(const corner_set *set, fm_v3 at) {
    float sum = 0;
    for (uint32_t i = 0; i < 8; i++) {
        const float x = i & 1 ? at.x : 1 - at.x, y = i >> 1 & 1 ? at.y : 1 - at.y, z = i >> 2 ? at.z : 1 - at.z;
        sum += x * y * z * set->values[i];
    }
    return sum;
}

// How far what the set says of a place is from what a corner of another field knows.
static float deviation(const merge_job *job, const corner_set *set, int level, fm_v3 at, const fm_octree_field *field, uint64_t i) {
    if (job->signed_values) {
        return fabsf(value_between(set, at) - field->distance[i]);
    }
    const float *exact = field->vectors[i];
    const fm_v3 said = fm_times(vector_between(set, at), (float)(1u << level));
    const fm_v3 off = fm_less(said, fm_v3_of(exact[0], exact[1], exact[2]));
    return sqrtf(fm_dot(off, off));
}

static float length_deviation(const merge_job *job, const corner_set *set, int level, fm_v3 at, const fm_octree_field *field,
                              uint64_t i) {
    if (job->signed_values) {
        return deviation(job, set, level, at, field, i);
    }
    const fm_v3 said = vector_between(set, at);
    return fabsf(sqrtf(fm_dot(said, said)) * (float)(1u << level) - fabsf(field->distance[i]));
}

// The corners of the eight children that are not the node's own, as far as they are those of leaves.
static bool children_agree(const merge_job *job, const corner_set *set, int level, uint32_t x, uint32_t y, uint32_t z,
                           uint32_t leaves) {
    const fm_octree_field *field = &job->chunk->fields[level - 1];
    for (uint32_t k = 0; k < 3; k++) {
        for (uint32_t j = 0; j < 3; j++) {
            for (uint32_t i = 0; i < 3; i++) {
                uint32_t around = 0;
                for (uint32_t child = 0; child < 8; child++) {
                    const uint32_t dx = i - (child & 1), dy = j - (child >> 1 & 1), dz = k - (child >> 2);
                    around |= dx <= 1 && dy <= 1 && dz <= 1 ? 1u << child : 0;
                }
                if ((i != 1 && j != 1 && k != 1) || !(around & leaves)) {
                    continue;
                }
                const uint64_t at = fm_node_at(field->shape, 2 * x + i, 2 * y + j, 2 * z + k);
                const fm_v3 place = fm_v3_of((float)i * 0.5f, (float)j * 0.5f, (float)k * 0.5f);
                if (field->triangles[at] == FM_NO_TRIANGLE || !(deviation(job, set, level, place, field, at) <= job->threshold)) {
                    return false;
                }
            }
        }
    }
    return true;
}

static bool surface_stays(const merge_job *job, const corner_set *set, int level, uint32_t x, uint32_t y, uint32_t z) {
    const fm_octree_field *field = &job->chunk->fields[0];
    const uint32_t edge = 1u << level;
    const float scale = 1.0f / (float)edge;
    for (uint32_t k = 0; k <= edge; k++) {
        for (uint32_t j = 0; j <= edge; j++) {
            const uint64_t row = fm_node_at(field->shape, x << level, (y << level) + j, (z << level) + k);
            for (uint32_t i = 0; i <= edge; i++) {
                const fm_v3 place = fm_v3_of((float)i * scale, (float)j * scale, (float)k * scale);
                if (fabsf(field->distance[row + i]) <= NEAR_SURFACE &&
                    !(length_deviation(job, set, level, place, field, row + i) <= job->threshold)) {
                    return false;
                }
            }
        }
    }
    return true;
}

static bool may_merge(const merge_job *job, int level, uint32_t x, uint32_t y, uint32_t z, uint32_t leaves) {
    merge_job vectors = *job;
    corner_set set;
    if (!corners_of(job, level, x, y, z, &set)) {
        return false;
    }
    if (fm_octree_is_thin(job->build) && !job->signed_values) {
        const fm_sheet_answer answer = fm_octree_sheet(job->build, level, x, y, z);
        if (answer != FM_SHEET_NONE) {
            return answer == FM_SHEET_STAYS;
        }
        // Where there is no sheet a ray must come within epsilon of the vectors' surface.
        vectors.threshold = fminf(job->threshold, MOST_OFF);
    }
    return children_agree(&vectors, &set, level, x, y, z, leaves) && (level == 1 || surface_stays(&vectors, &set, level, x, y, z));
}

static void set_node(const merge_job *job, int level, uint32_t x, uint32_t y, uint32_t z) {
    const fm_octree_nodes *nodes = &job->chunk->nodes[level], *finer = &job->chunk->nodes[level - 1];
    const uint64_t own = fm_node_at(nodes->shape, x, y, z);
    uint64_t children[8];
    uint32_t leaves = 0, internal = 0;
    float bound = INFINITY;
    for (uint32_t i = 0; i < 8; i++) {
        children[i] = fm_node_at(finer->shape, 2 * x + (i & 1), 2 * y + (i >> 1 & 1), 2 * z + (i >> 2));
        const uint8_t state = finer->states[children[i]];
        leaves |= state == FM_NODE_IS_LEAF ? 1u << i : 0;
        internal |= state == FM_NODE_IS_INTERNAL ? 1u << i : 0;
        bound = state == FM_NODE_IS_EMPTY ? fminf(bound, bits_float(finer->words[children[i]])) : bound;
    }
    if (!leaves && !internal) {
        const fm_octree_field *field = &job->chunk->fields[level];
        nodes->states[own] = FM_NODE_IS_EMPTY;
        const float own_bound = bound_by_corners(job, level, (const uint32_t[3]){x, y, z}, nearest_corner(field, x, y, z));
        nodes->words[own] = float_bits(fmaxf(bound, own_bound));
        return;
    }
    const bool merged = !internal && job->threshold >= 0 && may_merge(job, level, x, y, z, leaves);
    nodes->states[own] = merged ? FM_NODE_IS_LEAF : FM_NODE_IS_INTERNAL;
    for (uint32_t i = 0; merged && i < 8; i++) {
        finer->states[children[i]] = leaves >> i & 1 ? FM_NODE_IS_MERGED : FM_NODE_IS_EMPTY;
    }
}

// True where the surface is too far from the whole tile for any leaf: then only its root is looked at.
static bool clear_tile(const merge_job *job, const uint32_t at[3]) {
    const fm_octree_build *build = job->build;
    const int root = build->leaf_most, up = FM_CHUNK_LEVEL - root;
    const uint32_t *chunk = job->chunk->at;
    const float far =
        fm_octree_far_bound(&build->far, root, (chunk[0] << up) + at[0], (chunk[1] << up) + at[1], (chunk[2] << up) + at[2]);
    if (far <= build->desc->band) {
        return false;
    }
    for (int level = 0; level <= root; level++) {
        const fm_octree_nodes *nodes = &job->chunk->nodes[level];
        const uint32_t edge = 1u << (root - level);
        for (uint32_t i = 0; i < edge * edge; i++) {
            const uint32_t y = at[1] * edge + i % edge, z = at[2] * edge + i / edge;
            memset(nodes->states + fm_node_at(nodes->shape, at[0] * edge, y, z), FM_NODE_IS_EMPTY, edge);
        }
    }
    const uint64_t own = fm_node_at(job->chunk->nodes[root].shape, at[0], at[1], at[2]);
    const float nearest = nearest_corner(&job->chunk->fields[root], at[0], at[1], at[2]);
    job->chunk->nodes[root].words[own] = float_bits(bound_by_corners(job, root, at, nearest));
    return true;
}

static void merge_tiles(void *user, uint64_t begin, uint64_t end, uint32_t worker) {
    const merge_job *job = user;
    (void)worker;
    for (uint64_t tile = begin; tile < end; tile++) {
        const uint64_t row = tile / job->tiles[0];
        const uint32_t at[3] = {(uint32_t)(tile % job->tiles[0]), (uint32_t)(row % job->tiles[1]), (uint32_t)(row / job->tiles[1])};
        if (clear_tile(job, at)) {
            continue;
        }
        for (int level = 0; level <= job->build->leaf_most; level++) {
            const int up = job->build->leaf_most - level;
            for (uint32_t i = 0; i < UINT32_C(1) << 3 * up; i++) {
                const uint32_t mask = (1u << up) - 1;
                const uint32_t x = (at[0] << up) + (i & mask), y = (at[1] << up) + (i >> up & mask),
                               z = (at[2] << up) + (i >> 2 * up);
                if (level == 0) {
                    set_cell(job, x, y, z);
                } else {
                    set_node(job, level, x, y, z);
                }
            }
        }
    }
}

void fm_octree_merge(fm_octree_build *build) {
    merge_job job = {.build = build,
                     .chunk = &build->chunk,
                     .signed_values = build->desc->kind == FM_OCTREE_DISTANCE,
                     .threshold = build->desc->threshold};
    uint64_t count = 1;
    for (int axis = 0; axis < 3; axis++) {
        job.tiles[axis] = build->chunk.nodes[build->leaf_most].shape[axis];
        count *= job.tiles[axis];
    }
    fm_pool_run(build->context->pool, count, 4, merge_tiles, &job);
}
