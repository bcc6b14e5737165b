// SPDX-License-Identifier: MIT
// Octrees of voxels: builds and updates from sources, and memory that is given back.

#include "octree/voxels.h"

#include <string.h>

enum { MOST_VOXELS = 1 << 20 };

const fm_voxel_kind *fm_voxel_kind_of(fm_octree_kind kind) {
    switch (kind) {
    case FM_OCTREE_VOXELS:
        return &fm_kind_voxels;
    case FM_OCTREE_CONTOURS:
        return &fm_kind_contours;
    case FM_OCTREE_DAG:
        return &fm_kind_dag;
    case FM_OCTREE_TREE64:
        return &fm_kind_tree64;
    default:
        return NULL;
    }
}

fm_result fm_voxel_room(fm_voxel_trees *trees, fm_octree_array *array, uint64_t count, uint64_t limit, uint64_t *first) {
    *first = array->count;
    if (array->count + count > limit) {
        return fm_fail(FM_ERROR_UNSUPPORTED, "the octree needs more than the %llu elements that its nodes can tell apart",
                       (unsigned long long)limit);
    }
    if (!fm_octree_reserve(trees->octree, array, count)) {
        return FM_ERROR_OUT_OF_HOST_MEMORY;
    }
    array->count += count;
    return FM_OK;
}

fm_result fm_voxel_number(fm_voxel_trees *trees, uint32_t number, uint32_t *index) {
    fm_octree_array *values = &trees->octree->values;
    uint32_t *kept = &trees->palette[number * 2654435761u >> 20 & (FM_PALETTE - 1)];
    // What a failed update has cut off may still be remembered.
    if (*kept >= values->count || ((const uint32_t *)(const void *)values->data)[*kept] != number) {
        uint64_t first;
        FM_TRY(fm_voxel_room(trees, values, 1, 1u << 30, &first));
        ((uint32_t *)(void *)values->data)[first] = number;
        *kept = (uint32_t)first;
    }
    *index = *kept;
    return FM_OK;
}

static uint64_t elements(const fm_octree *octree) {
    return octree->words.count + octree->values.count + octree->attributes.count + octree->extra.count;
}

static void free_trees(fm_context *context, fm_voxel_trees *trees) {
    if (trees) {
        fm_octree_free(context, trees->nodes, trees->node_room * sizeof *trees->nodes);
        fm_octree_free(context, trees, sizeof *trees);
    }
}

static void forget(fm_octree *octree) {
    free_trees(octree->context, octree->state);
    octree->state = NULL;
}

static fm_result new_trees(fm_octree *octree, fm_voxel_trees **result) {
    fm_voxel_trees *trees = fm_octree_alloc_zero(octree->context, sizeof *trees, "an octree's updates");
    if (!trees) {
        return FM_ERROR_OUT_OF_HOST_MEMORY;
    }
    trees->octree = octree;
    trees->kind = fm_voxel_kind_of(octree->info.kind);
    *result = trees;
    return FM_OK;
}

static void counted(fm_voxel_trees *trees) {
    fm_octree *octree = trees->octree;
    fm_octree_info *info = &octree->info;
    fm_octree_counted(octree);
    info->internal = trees->kind->shared ? trees->node_count : trees->internal;
    info->unshared_bytes = trees->kind->shared ? (fm_round_up(fm_voxel_tops(octree), 8) + trees->unshared) * sizeof(uint32_t)
                                               : info->node_bytes + info->leaf_bytes + info->attribute_bytes;
}

// ---------------------------------------------------------------------------------------------------------------------------
// Copies without what is out of use
// ---------------------------------------------------------------------------------------------------------------------------

static fm_result copy_all(const fm_voxel_copying *work) {
    FM_TRY(fm_voxel_begin(work->to));
    const uint64_t tops = fm_voxel_tops(work->from->octree);
    for (uint64_t i = 0; i < tops; i++) {
        const fm_voxel_ref cell = work->from->kind->placed(work->from, fm_voxel_words(work->from)[i]);
        fm_voxel_ref copy;
        uint32_t word;
        FM_TRY(fm_voxel_copy(work, work->from->octree->info.levels, &cell, &copy));
        FM_TRY(work->to->kind->place(work->to, &copy, &word));
        fm_voxel_words(work->to)[i] = word;
    }
    return FM_OK;
}

static void exchange(fm_octree_array *a, fm_octree_array *b) {
    const fm_octree_array c = *a;
    *a = *b;
    *b = c;
}

static void exchange_arrays(fm_octree *a, fm_octree *b) {
    exchange(&a->words, &b->words);
    exchange(&a->values, &b->values);
    exchange(&a->attributes, &b->attributes);
    exchange(&a->extra, &b->extra);
}

static void free_arrays(fm_octree *octree) {
    fm_octree_array *const arrays[] = {&octree->words, &octree->values, &octree->attributes, &octree->extra};
    for (size_t i = 0; i < sizeof arrays / sizeof *arrays; i++) {
        fm_octree_array_free(octree, arrays[i]);
    }
}

static fm_result compact(fm_octree *octree) {
    fm_voxel_trees *trees = octree->state;
    fm_context *context = octree->context;
    fm_octree fresh = {.context = context, .info = octree->info};
    fresh.words.size = fresh.values.size = fresh.attributes.size = fresh.extra.size = sizeof(uint32_t);
    fm_voxel_copying work = {.from = trees};
    const uint64_t words = octree->words.count;
    FM_TRY(new_trees(&fresh, &work.to));
    fm_result result = FM_OK;
    if (trees->kind->shared) {
        work.known = fm_octree_alloc_zero(context, words * sizeof *work.known, "a copy of an octree");
        result = work.known ? FM_OK : FM_ERROR_OUT_OF_HOST_MEMORY;
    }
    result = result == FM_OK ? copy_all(&work) : result;
    fm_octree_free(context, work.known, words * sizeof *work.known);
    if (result != FM_OK) {
        free_trees(context, work.to);
        free_arrays(&fresh);
        return result;
    }
    exchange_arrays(octree, &fresh);
    free_arrays(&fresh);
    work.to->octree = octree;
    work.to->internal = trees->internal;
    work.to->unshared = trees->unshared;
    work.to->compact = elements(octree);
    free_trees(context, trees);
    octree->state = work.to;
    return FM_OK;
}

// What updates need of an octree; made anew for one that comes from a file.
static fm_result trees_of(fm_octree *octree, fm_voxel_trees **trees) {
    if (!octree->state) {
        FM_TRY(new_trees(octree, trees));
        octree->state = *trees;
        octree->forget = forget;
        (*trees)->internal = octree->info.internal;
        (*trees)->unshared = octree->info.unshared_bytes / sizeof(uint32_t) - fm_round_up(fm_voxel_tops(octree), 8);
        (*trees)->compact = elements(octree);
        if ((*trees)->kind->shared) {
            const fm_result result = compact(octree);  // which finds its nodes
            if (result != FM_OK) {
                forget(octree);
                return result;
            }
            octree->version++;
        }
    }
    *trees = octree->state;
    return FM_OK;
}

// ---------------------------------------------------------------------------------------------------------------------------
// Builds
// ---------------------------------------------------------------------------------------------------------------------------

// Nodes of four along an axis want a top grid of an even level.
static void even_levels(fm_octree *octree) {
    fm_octree_info *info = &octree->info;
    info->levels += info->levels % 2;
    octree->head.levels = (int32_t)info->levels;
    for (int axis = 0; axis < 3; axis++) {
        info->top[axis] = (uint32_t)fm_div_up(info->cells[axis], 1ull << info->levels);
        octree->head.top[axis] = (int32_t)info->top[axis];
    }
}

static fm_result fill(fm_octree *octree, fm_voxel_feed *feed) {
    fm_voxel_trees *trees;
    FM_TRY(new_trees(octree, &trees));
    octree->state = trees;
    octree->forget = forget;
    FM_TRY(fm_voxel_begin(trees));
    octree->info.empty = fm_voxel_tops(octree);
    FM_TRY(fm_voxel_crew_open(trees, feed));
    const fm_result result = fm_voxel_all(trees, feed);
    fm_voxel_crew_close(feed);
    FM_TRY(result);
    trees->compact = elements(octree);
    counted(trees);
    return FM_OK;
}

fm_result fm_voxel_build(fm_context *context, fm_voxel_feed *feed, const fm_octree_desc *desc, const double low[3],
                         const double high[3], fm_octree **result) {
    const uint64_t begin = fm_now_ns();
    fm_octree *octree = NULL;
    FM_TRY(fm_octree_new(context, desc, low, high, &octree));
    if (desc->kind == FM_OCTREE_TREE64) {
        even_levels(octree);
    }
    fm_result status = fm_voxel_feed_open(context, feed);
    if (status == FM_OK) {
        status = fill(octree, feed);
    }
    fm_voxel_feed_close(context, feed);
    if (status != FM_OK) {
        fm_octree_destroy(octree);
        return status;
    }
    octree->info.build_ms = (double)(fm_now_ns() - begin) * 1e-6;
    *result = octree;
    return FM_OK;
}

static fm_result check_source(const fm_voxel_source *source) {
    if (!source || !source->read) {
        return fm_fail(FM_ERROR_INVALID_ARGUMENT, "%s is NULL", source ? "source.read" : "source");
    }
    for (int axis = 0; axis < 3; axis++) {
        if (source->shape[axis] < 1 || source->shape[axis] > MOST_VOXELS) {
            return fm_fail(FM_ERROR_INVALID_ARGUMENT, "source.shape is %u along %c: 1 to %d is accepted", source->shape[axis],
                           "xyz"[axis], MOST_VOXELS);
        }
    }
    return FM_OK;
}

fm_result fm_voxel_build_fed(fm_context *context, fm_voxel_feed *feed, const fm_octree_desc *desc, fm_octree **octree) {
    fm_octree_desc filled;
    FM_TRY(check_source(feed->source));
    FM_TRY(fm_octree_check_desc(desc, &filled));
    if (!fm_voxel_kind_of(filled.kind)) {
        return fm_fail(FM_ERROR_UNSUPPORTED, "kind is %s: voxels become FM_OCTREE_VOXELS, _CONTOURS, _DAG or _TREE64",
                       fm_octree_kind_name(filled.kind));
    }
    filled.size = 1;
    filled.attribute = FM_OCTREE_PLAIN;
    double low[3], high[3];
    for (int axis = 0; axis < 3; axis++) {
        low[axis] = -0.5;
        high[axis] = feed->source->shape[axis] - 0.5;
        filled.size = filled.size > feed->source->shape[axis] ? filled.size : feed->source->shape[axis];
    }
    return fm_voxel_build(context, feed, &filled, low, high, octree);
}

fm_result fm_octree_build_voxels(fm_context *context, const fm_voxel_source *source, const fm_octree_desc *desc,
                                 fm_octree **octree) {
    if (!context || !octree) {
        return fm_fail(FM_ERROR_INVALID_ARGUMENT, "%s is NULL", context ? "octree" : "context");
    }
    fm_voxel_feed feed = {.source = source, .user = source ? source->user : NULL};
    return fm_voxel_build_fed(context, &feed, desc, octree);
}

// ---------------------------------------------------------------------------------------------------------------------------
// Updates
// ---------------------------------------------------------------------------------------------------------------------------

typedef struct top_change {
    uint64_t at;
    uint32_t word;
} top_change;

// Ends of the arrays, and counts: where a failed update goes back to.
typedef struct mark {
    uint64_t words, values, attributes, extra, internal, unshared, nodes;
    fm_octree_info info;
} mark;

static mark mark_of(const fm_octree *octree) {
    const fm_voxel_trees *trees = octree->state;
    return (mark){octree->words.count, octree->values.count, octree->attributes.count, octree->extra.count,
                  trees->internal,     trees->unshared,      trees->node_count,        octree->info};
}

static void go_back(fm_octree *octree, const mark *to) {
    fm_voxel_trees *trees = octree->state;
    octree->words.count = to->words;
    octree->values.count = to->values;
    octree->attributes.count = to->attributes;
    octree->extra.count = to->extra;
    octree->info = to->info;
    trees->internal = to->internal;
    trees->unshared = to->unshared;
    trees->node_count = to->nodes;
    // Other words will stand there.
    for (uint64_t i = 0; i < trees->node_room; i++) {
        trees->nodes[i].word = trees->nodes[i].word >= to->words ? FM_GONE_NODE : trees->nodes[i].word;
    }
}

// The top cells that a box touches.
static void tops_of(const fm_octree *octree, const fm_box *box, uint32_t begin[3], uint32_t end[3]) {
    for (int axis = 0; axis < 3; axis++) {
        begin[axis] = (uint32_t)(box->begin[axis] >> octree->info.levels);
        end[axis] = (uint32_t)((box->end[axis] - 1) >> octree->info.levels) + 1;
    }
}

static fm_result change_top(fm_octree *octree, fm_voxel_feed *feed, const uint32_t top[3], const fm_box *boxes, uint32_t count,
                            top_change *change) {
    fm_voxel_trees *trees = octree->state;
    const uint32_t levels = octree->info.levels, corner[3] = {top[0] << levels, top[1] << levels, top[2] << levels};
    fm_voxel_ref cell;
    change->word = fm_voxel_words(trees)[change->at];
    const fm_voxel_ref old = trees->kind->placed(trees, change->word);
    FM_TRY(fm_voxel_changed(trees, feed, levels, corner, boxes, count, &old, &cell));
    if (memcmp(&old, &cell, sizeof cell) == 0) {
        return FM_OK;
    }
    fm_voxel_count_top(trees, &old, true);
    fm_voxel_count_top(trees, &cell, false);
    return trees->kind->place(trees, &cell, &change->word);
}

static uint64_t most_tops(const fm_octree *octree, const fm_box *boxes, uint32_t count) {
    uint64_t most = 0;
    for (uint32_t i = 0; i < count; i++) {
        uint32_t begin[3], end[3];
        tops_of(octree, &boxes[i], begin, end);
        most += (uint64_t)(end[0] - begin[0]) * (end[1] - begin[1]) * (end[2] - begin[2]);
    }
    return most;
}

static fm_result change_tops(fm_octree *octree, fm_voxel_feed *feed, const fm_box *boxes, uint32_t count, uint8_t *seen,
                             top_change *changes, uint64_t *changed) {
    const uint32_t *top = octree->info.top;
    for (uint32_t i = 0; i < count; i++) {
        uint32_t begin[3], end[3], at[3];
        tops_of(octree, &boxes[i], begin, end);
        for (at[2] = begin[2]; at[2] < end[2]; at[2]++) {
            for (at[1] = begin[1]; at[1] < end[1]; at[1]++) {
                for (at[0] = begin[0]; at[0] < end[0]; at[0]++) {
                    const uint64_t cell = at[0] + (uint64_t)top[0] * (at[1] + (uint64_t)top[1] * at[2]);
                    if (!(seen[cell / 8] >> cell % 8 & 1)) {
                        seen[cell / 8] |= (uint8_t)(1 << cell % 8);
                        changes[*changed].at = cell;
                        FM_TRY(change_top(octree, feed, at, boxes, count, &changes[(*changed)++]));
                    }
                }
            }
        }
    }
    return FM_OK;
}

static void commit(fm_octree *octree, const mark *before, const top_change *changes, uint64_t count) {
    fm_voxel_trees *trees = octree->state;
    const uint64_t slack = 1 << 16;
    fm_octree_change change = {.kept = {before->words, before->values, before->attributes, before->extra}, .low = UINT64_MAX};
    for (uint64_t i = 0; i < count; i++) {
        fm_voxel_words(trees)[changes[i].at] = changes[i].word;
        change.low = fm_min_u64(change.low, changes[i].at);
        change.high = fm_max_u64(change.high, changes[i].at + 1);
    }
    // Without memory for a copy the octree stays as large as it is, and the next update tries again.
    if (elements(octree) <= 2 * trees->compact + slack || compact(octree) != FM_OK) {
        fm_octree_note_change(octree, &change);
    }
    counted(octree->state);
}

static fm_result update_boxes(fm_octree *octree, fm_voxel_feed *feed, const fm_box *boxes, uint32_t count) {
    fm_context *context = octree->context;
    const uint64_t seen_bytes = fm_div_up(fm_voxel_tops(octree), 8);
    const uint64_t most = fm_min_u64(most_tops(octree, boxes, count), fm_voxel_tops(octree));
    fm_voxel_trees *trees;
    FM_TRY(trees_of(octree, &trees));
    const mark before = mark_of(octree);
    uint64_t changed = 0;
    uint8_t *seen = fm_octree_alloc_zero(context, seen_bytes, "an octree's update");
    top_change *changes = fm_octree_alloc(context, most * sizeof *changes, "an octree's update");
    fm_result result = seen && changes ? FM_OK : FM_ERROR_OUT_OF_HOST_MEMORY;
    // Words of a mapped file are not to be written to: room for one more makes them the octree's own.
    if (result == FM_OK && octree->words.room == 0 && !fm_octree_reserve(octree, &octree->words, 1)) {
        result = FM_ERROR_OUT_OF_HOST_MEMORY;
    }
    result = result == FM_OK ? change_tops(octree, feed, boxes, count, seen, changes, &changed) : result;
    if (result != FM_OK) {
        go_back(octree, &before);
    } else {
        commit(octree, &before, changes, changed);
    }
    fm_octree_free(context, seen, seen_bytes);
    fm_octree_free(context, changes, most * sizeof *changes);
    return result;
}

static bool cut_box(const fm_octree *octree, const fm_box *box, fm_box *cut) {
    bool any = true;
    for (int axis = 0; axis < 3; axis++) {
        const int64_t cells = octree->info.cells[axis];
        cut->begin[axis] = box->begin[axis] > 0 ? box->begin[axis] : 0;
        cut->end[axis] = box->end[axis] < cells ? box->end[axis] : cells;
        any = any && cut->begin[axis] < cut->end[axis];
    }
    return any;
}

static fm_result check_update(const fm_octree *octree, const fm_voxel_feed *feed, const fm_box *boxes, uint32_t count) {
    if (!octree || (!boxes && count > 0)) {
        return fm_fail(FM_ERROR_INVALID_ARGUMENT, "%s is NULL", octree ? "boxes" : "octree");
    }
    FM_TRY(check_source(feed->source));
    if (!fm_voxel_kind_of(octree->info.kind)) {
        return fm_fail(FM_ERROR_UNSUPPORTED, "an octree of kind %s takes no updates from voxels",
                       fm_octree_kind_name(octree->info.kind));
    }
    for (int axis = 0; axis < 3; axis++) {
        if (feed->source->shape[axis] != octree->info.cells[axis]) {
            return fm_fail(FM_ERROR_INVALID_ARGUMENT, "the source has %u voxels along %c and the octree %u",
                           feed->source->shape[axis], "xyz"[axis], octree -> info.cells[axis]);
        }
    }
    return FM_OK;
}

fm_result fm_voxel_update_fed(fm_octree *octree, fm_voxel_feed *feed, const fm_box *boxes, uint32_t count) {
    const uint64_t begin = fm_now_ns();
    FM_TRY(check_update(octree, feed, boxes, count));
    fm_context *context = octree->context;
    fm_box *cut = fm_octree_alloc(context, (uint64_t)count * sizeof *cut, "an octree's update");
    if (!cut) {
        return FM_ERROR_OUT_OF_HOST_MEMORY;
    }
    uint32_t left = 0;
    for (uint32_t i = 0; i < count; i++) {
        left += cut_box(octree, &boxes[i], &cut[left]);
    }
    fm_result result = left > 0 ? fm_voxel_feed_open(context, feed) : FM_OK;
    if (result == FM_OK && left > 0) {
        result = update_boxes(octree, feed, cut, left);
    }
    fm_voxel_feed_close(context, feed);
    fm_octree_free(context, cut, (uint64_t)count * sizeof *cut);
    octree->info.build_ms = result == FM_OK ? (double)(fm_now_ns() - begin) * 1e-6 : octree->info.build_ms;
    return result;
}

fm_result fm_octree_update_voxels(fm_octree *octree, const fm_voxel_source *source, const fm_box *boxes, uint32_t count) {
    fm_voxel_feed feed = {.source = source, .user = source ? source->user : NULL};
    return fm_voxel_update_fed(octree, &feed, boxes, count);
}
