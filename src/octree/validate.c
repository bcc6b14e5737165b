// SPDX-License-Identifier: MIT
// Whether an octree from a file is one that rays can go through: what a cast follows must end within the arrays and the levels.

#include "octree/validate.h"

#include <math.h>
#include <string.h>

enum { CHILDREN = 8, MOST_LEVELS = 20 };

typedef struct tree {
    const uint32_t *words;
    uint64_t count;   // of them
    uint64_t top;     // of the top grid, in which no children lie: updates overwrite it
    uint64_t leaves;  // numbers that leaves may have
    bool shared;      // siblings may have several parents
    uint8_t *marks;   // of the first of eight siblings: 1 and their height, once it is known
} tree;

// A group of siblings on the way down: which child is next, and how high those before it are.
typedef struct place {
    uint64_t first;
    uint32_t next;
    uint32_t height;
} place;

uint64_t fm_octree_marks(const fm_octree *octree) {
    return 4 * (octree->words.count + octree->extra.count);
}

static bool is_internal(uint32_t word) {
    return word < FM_NODE_EMPTY;
}

static fm_result check_word(const tree *t, uint64_t at) {
    const uint32_t word = t->words[at];
    const uint64_t leaf = (uint64_t)(uint32_t)~word;
    if (is_internal(word) && (word < t->top || word + (uint64_t)CHILDREN > t->count)) {
        return fm_fail(FM_ERROR_FORMAT,
                       "node %llu: its children begin at %u, but there are %llu nodes, %llu of them the top grid's",
                       (unsigned long long)at, word, (unsigned long long)t->count, (unsigned long long)t->top);
    }
    if (word >> 31 && leaf >= t->leaves) {
        return fm_fail(FM_ERROR_FORMAT, "node %llu: is leaf %llu, but there are %llu leaves", (unsigned long long)at,
                       (unsigned long long)leaf, (unsigned long long)t->leaves);
    }
    return FM_OK;
}

static fm_result check_parents(const tree *t, uint64_t first) {
    return t->shared || t->marks[first] == 0
               ? FM_OK
               : fm_fail(FM_ERROR_FORMAT, "node %llu: has more than one parent, which this kind's have not",
                         (unsigned long long)first);
}

// Whether all below a node of `levels` levels is sound. Groups that were seen are not gone into again, so that shared ones cost
// nothing; what would be a cycle is deeper than the levels.
static fm_result check_below(const tree *t, uint64_t node, uint32_t levels) {
    place path[MOST_LEVELS + 1];
    FM_TRY(check_word(t, node));
    if (!is_internal(t->words[node])) {
        return FM_OK;
    }
    uint32_t depth = 0;
    path[0] = (place){.first = t->words[node]};
    FM_TRY(check_parents(t, t->words[node]));
    for (;;) {
        place *here = &path[depth];
        const uint8_t mark = t->marks[here->first];
        // Heights above what is left are told from here, where the node is known.
        if (depth + (mark > 0 ? mark : 1u) > levels) {
            return fm_fail(FM_ERROR_FORMAT,
                           "node %llu: more than %u levels lie below it: the tree is too deep, or runs in a circle",
                           (unsigned long long)node, levels);
        }
        if (mark == 0 && here->next < CHILDREN) {
            const uint64_t child = here->first + here->next;
            FM_TRY(check_word(t, child));
            here->next++;
            if (is_internal(t->words[child])) {
                FM_TRY(check_parents(t, t->words[child]));
                path[++depth] = (place){.first = t->words[child]};
            }
            continue;
        }
        if (mark == 0) {
            t->marks[here->first] = (uint8_t)(here->height + 1);
        }
        const uint32_t height = t->marks[here->first];
        if (depth == 0) {
            return FM_OK;
        }
        depth--;
        path[depth].height = height > path[depth].height ? height : path[depth].height;
    }
}

fm_result fm_octree_check_top(const fm_octree *octree, uint64_t *nodes) {
    const fm_octree_info *info = &octree->info;
    if (fm_mul_overflows((uint64_t)info->top[0] * info->top[1], info->top[2], nodes) || *nodes > octree->words.count) {
        return fm_fail(FM_ERROR_FORMAT, "the top grid has %u x %u x %u nodes, but there are %llu", info->top[0], info->top[1],
                       info->top[2], (unsigned long long)octree->words.count);
    }
    return FM_OK;
}

static fm_result check_nodes(const fm_octree *octree, uint64_t leaves, uint8_t *marks) {
    const fm_octree_info *info = &octree->info;
    uint64_t top = 0;
    FM_TRY(fm_octree_check_top(octree, &top));
    const tree t = {.words = (const uint32_t *)(const void *)octree->words.data,
                    .count = octree->words.count,
                    .top = top,
                    .leaves = leaves,
                    .shared = info->kind != FM_OCTREE_VOXELS,
                    .marks = marks};
    for (uint64_t node = 0; node < top; node++) {
        FM_TRY(check_below(&t, node, info->levels));
    }
    return FM_OK;
}

// Vectors and distances of leaves are no longer than FM_OCTREE_REACH of their cells.
static fm_result check_floats(const fm_octree *octree) {
    const float *values = (const float *)(const void *)octree->values.data;
    const uint64_t count = octree->values.count * octree->values.size / sizeof *values;
    const float most = (float)ldexp((double)FM_OCTREE_REACH * octree->info.cell * 1.001, (int)octree->info.levels);
    for (uint64_t i = 0; i < count; i++) {
        if (!(fabsf(values[i]) <= most)) {
            return fm_fail(FM_ERROR_FORMAT, "value %llu is %g: finite numbers, up to %g in size, are possible",
                           (unsigned long long)i, (double)values[i], (double)most);
        }
    }
    return FM_OK;
}

static fm_result check_attributes(const fm_octree *octree, bool wanted) {
    const uint64_t count = octree->attributes.count;
    if (count != (wanted ? octree->values.count : 0)) {
        return fm_fail(FM_ERROR_FORMAT, "%llu attributes for %llu values, of kind %d", (unsigned long long)count,
                       (unsigned long long)octree->values.count, (int)octree->info.attribute);
    }
    return FM_OK;
}

// CLOSEST and DISTANCE: leaf i has the columns i and i + 1.
static fm_result check_columns(const fm_octree *octree, uint8_t *marks) {
    const uint64_t columns = octree->values.count / FM_COLUMN_VALUES;
    if (octree->info.kind == FM_OCTREE_DISTANCE || octree->info.code == FM_OCTREE_FLOATS) {
        FM_TRY(check_floats(octree));
    }
    return check_nodes(octree, columns > 0 ? columns - 1 : 0, marks);
}

static fm_result check_bricks(const fm_octree *octree) {
    const tree t = {.words = (const uint32_t *)(const void *)octree->words.data,
                    .count = octree->words.count,
                    .leaves = octree->values.count / FM_BRICK_VALUES};
    uint64_t top = 0;
    FM_TRY(fm_octree_check_top(octree, &top));
    FM_TRY(check_floats(octree));
    if (octree->info.levels != FM_BRICK_LEVEL) {
        return fm_fail(FM_ERROR_FORMAT, "%u levels: bricks have %d", octree->info.levels, FM_BRICK_LEVEL);
    }
    for (uint64_t node = 0; node < top; node++) {
        FM_TRY(check_word(&t, node));
        if (is_internal(t.words[node])) {
            return fm_fail(FM_ERROR_FORMAT, "node %llu: has children, which bricks have not", (unsigned long long)node);
        }
    }
    return FM_OK;
}

fm_result fm_octree_validate(const fm_octree *octree, uint8_t *marks) {
    FM_TRY(check_attributes(octree, octree->info.kind == FM_OCTREE_CLOSEST && octree->info.attribute != FM_OCTREE_PLAIN));
    switch (octree->info.kind) {
    case FM_OCTREE_CLOSEST:
    case FM_OCTREE_DISTANCE:
        return check_columns(octree, marks);
    case FM_OCTREE_VOXELS:
        return check_nodes(octree, octree->values.count, marks);
    case FM_OCTREE_CONTOURS:
        return fm_octree_check_contours(octree, marks);
    case FM_OCTREE_DAG:
        return fm_octree_check_dag(octree, marks);
    case FM_OCTREE_TREE64:
        return fm_octree_check_tree64(octree, marks);
    case FM_OCTREE_BRICKS:
        return check_bricks(octree);
    default:
        return fm_fail(FM_ERROR_FORMAT, "kind %d is not known", (int)octree->info.kind);
    }
}
