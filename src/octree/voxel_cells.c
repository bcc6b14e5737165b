// SPDX-License-Identifier: MIT
// Cells of octrees from voxels, from the finest upwards.

#include "octree/voxels.h"

#include <string.h>

// Voxels are read in cubes of 2^6, and an update reads whole ones of 2^4.
enum { TILE_LEVEL = 6, TILE = 1 << TILE_LEVEL, TILE_VOXELS = TILE * TILE * TILE, PATCH_LEVEL = 4 };

// Voxels of a cube in memory.
typedef struct block {
    const uint32_t *at;
    uint64_t row, slice;  // from one row, and from one slice, to the next
} block;

fm_result fm_voxel_feed_open(fm_context *context, fm_voxel_feed *feed) {
    feed->tile = fm_alloc(&context->allocator, 2ull * TILE_VOXELS * sizeof *feed->tile, "voxels of an octree");
    feed->part = feed->tile ? feed->tile + TILE_VOXELS : NULL;
    return feed->tile ? FM_OK : FM_ERROR_OUT_OF_HOST_MEMORY;
}

void fm_voxel_feed_close(fm_context *context, fm_voxel_feed *feed) {
    fm_free(&context->allocator, feed->tile, 2ull * TILE_VOXELS * sizeof *feed->tile);
    feed->tile = feed->part = NULL;
}

void fm_voxel_count(fm_voxel_trees *trees, uint32_t level, const fm_voxel_ref *children, bool away) {
    fm_octree_info *info = &trees->octree->info;
    const uint32_t branch = trees->kind->branch(level), count = 1u << 3 * branch;
    const uint64_t one = away ? UINT64_MAX : 1;
    uint64_t words = branch == 1 ? 1 : 2;
    for (uint32_t i = 0; i < count; i++) {
        info->leaves[level - branch] += children[i].type == FM_REF_SOLID ? one : 0;
        info->empty += children[i].type == FM_REF_EMPTY ? one : 0;
        words += branch == 1 && children[i].type != FM_REF_EMPTY;
    }
    trees->internal += one;
    trees->unshared += away ? UINT64_MAX - words + 1 : words;
}

void fm_voxel_count_top(fm_voxel_trees *trees, const fm_voxel_ref *cell, bool away) {
    fm_octree_info *info = &trees->octree->info;
    const uint64_t one = away ? UINT64_MAX : 1;
    info->leaves[info->levels] += cell->type == FM_REF_SOLID ? one : 0;
    info->empty += cell->type == FM_REF_EMPTY ? one : 0;
}

// The same for all that is in a cell.
static void count_away(fm_voxel_trees *trees, uint32_t level, const fm_voxel_ref *cell) {
    if (cell->type == FM_REF_NODE) {
        const uint32_t branch = trees->kind->branch(level);
        fm_voxel_ref children[FM_BRANCHES];
        trees->kind->split(trees, level, cell, children);
        fm_voxel_count(trees, level, children, true);
        for (uint32_t i = 0; i < 1u << 3 * branch; i++) {
            count_away(trees, level - branch, &children[i]);
        }
    }
}

fm_result fm_voxel_joined(fm_voxel_trees *trees, uint32_t level, const fm_voxel_ref *children, fm_voxel_ref *cell) {
    const uint32_t count = 1u << 3 * trees->kind->branch(level);
    bool same = children->type != FM_REF_NODE && children->contour == 0;
    for (uint32_t i = 1; i < count && same; i++) {
        same = children[i].type == children->type && children[i].contour == 0 && children[i].w[0] == children->w[0];
    }
    if (same) {
        *cell = *children;
        return FM_OK;
    }
    FM_TRY(trees->kind->join(trees, level, children, cell));
    fm_voxel_count(trees, level, children, false);
    return FM_OK;
}

// Whether all voxels of a cube of 4^3 are as the first.
static bool uniform4(const block *from) {
    const uint32_t first = *from->at;
    uint32_t other = 0;
    for (int z = 0; z < 4; z++) {
        for (int y = 0; y < 4; y++) {
            const uint32_t *row = from->at + from->slice * (uint64_t)z + from->row * (uint64_t)y;
            other |= (row[0] ^ first) | (row[1] ^ first) | (row[2] ^ first) | (row[3] ^ first);
        }
    }
    return other == 0;
}

static fm_voxel_ref ref_of(const fm_voxel_trees *trees, const fm_voxel_feed *feed, uint32_t number, const uint32_t corner[3]) {
    fm_voxel_ref ref = {0};
    if (number != 0) {
        ref.type = FM_REF_SOLID;
        ref.w[0] = trees->kind->colorless ? 1 : number;
        ref.contour = feed->contour ? feed->contour(feed->source->user, corner) : 0;
    }
    return ref;
}

static fm_result from_block(fm_voxel_trees *trees, const fm_voxel_feed *feed, block from, uint32_t level, const uint32_t corner[3],
                            fm_voxel_ref *cell) {
    if (level == 0 || (level == 2 && uniform4(&from) && (*from.at == 0 || !feed->contour))) {
        *cell = ref_of(trees, feed, *from.at, corner);
        return FM_OK;
    }
    const uint32_t branch = trees->kind->branch(level), edge = 1u << branch, below = level - branch, size = 1u << below;
    fm_voxel_ref children[FM_BRANCHES];
    for (uint32_t i = 0; i < 1u << 3 * branch; i++) {
        const uint32_t x = i % edge * size, y = i / edge % edge * size, z = i / edge / edge * size;
        const block part = {from.at + x + from.row * y + from.slice * z, from.row, from.slice};
        const uint32_t at[3] = {corner[0] + x, corner[1] + y, corner[2] + z};
        if (below == 0) {
            children[i] = ref_of(trees, feed, *part.at, at);
        } else {
            FM_TRY(from_block(trees, feed, part, below, at, &children[i]));
        }
    }
    return fm_voxel_joined(trees, level, children, cell);
}

// The box of a cell, cut to the voxels that there are; false: nothing is left.
static bool box_of(const fm_voxel_feed *feed, uint32_t level, const uint32_t corner[3], fm_box *box) {
    for (int axis = 0; axis < 3; axis++) {
        box->begin[axis] = corner[axis];
        box->end[axis] = (int64_t)fm_min_u64((uint64_t)corner[axis] + (1ull << level), feed->source->shape[axis]);
        if (box->begin[axis] >= box->end[axis]) {
            return false;
        }
    }
    return true;
}

static void spread(const fm_voxel_feed *feed, uint32_t level, const fm_box *box) {
    const uint64_t edge = 1ull << level, x = (uint64_t)(box->end[0] - box->begin[0]), y = (uint64_t)(box->end[1] - box->begin[1]),
                   z = (uint64_t)(box->end[2] - box->begin[2]);
    memset(feed->tile, 0, edge * edge * edge * sizeof *feed->tile);
    for (uint64_t row = 0; row < y * z; row++) {
        memcpy(feed->tile + (row / y * edge + row % y) * edge, feed->part + row * x, x * sizeof *feed->tile);
    }
}

// The voxels of a cell of TILE_LEVEL at most; what lies outside is air.
static fm_result read_block(const fm_voxel_feed *feed, uint32_t level, const uint32_t corner[3], const fm_box *box, block *voxels) {
    const uint64_t edge = 1ull << level;
    bool whole = true;
    for (int axis = 0; axis < 3; axis++) {
        whole = whole && (uint64_t)(box->end[axis] - box->begin[axis]) == edge;
    }
    if (feed->dense && whole) {
        const uint64_t row = feed->source->shape[0], slice = row * feed->source->shape[1];
        *voxels = (block){feed->dense + corner[0] + row * corner[1] + slice * corner[2], row, slice};
        return FM_OK;
    }
    FM_TRY(feed->source->read(feed->source->user, box, whole ? feed->tile : feed->part));
    if (!whole) {
        spread(feed, level, box);
    }
    *voxels = (block){feed->tile, edge, edge * edge};
    return FM_OK;
}

fm_result fm_voxel_cell(fm_voxel_trees *trees, fm_voxel_feed *feed, uint32_t level, const uint32_t corner[3], fm_voxel_ref *cell) {
    *cell = (fm_voxel_ref){0};
    fm_box box;
    if (!box_of(feed, level, corner, &box) || (feed->source->air && feed->source->air(feed->source->user, &box))) {
        return FM_OK;
    }
    if (level <= TILE_LEVEL) {
        block voxels;
        FM_TRY(read_block(feed, level, corner, &box, &voxels));
        return from_block(trees, feed, voxels, level, corner, cell);
    }
    const uint32_t branch = trees->kind->branch(level), edge = 1u << branch, below = level - branch;
    fm_voxel_ref children[FM_BRANCHES];
    for (uint32_t i = 0; i < 1u << 3 * branch; i++) {
        const uint32_t at[3] = {corner[0] + (i % edge << below), corner[1] + (i / edge % edge << below),
                                corner[2] + (i / edge / edge << below)};
        FM_TRY(fm_voxel_cell(trees, feed, below, at, &children[i]));
    }
    return fm_voxel_joined(trees, level, children, cell);
}

static bool touched(uint32_t level, const uint32_t corner[3], const fm_box *boxes, uint32_t count) {
    for (uint32_t i = 0; i < count; i++) {
        bool apart = false;
        for (int axis = 0; axis < 3; axis++) {
            apart = apart || boxes[i].begin[axis] >= (int64_t)corner[axis] + (1ll << level) || boxes[i].end[axis] <= corner[axis];
        }
        if (!apart) {
            return true;
        }
    }
    return false;
}

// Whether one of the boxes holds all voxels of a cell.
static bool covered(const fm_voxel_feed *feed, uint32_t level, const uint32_t corner[3], const fm_box *boxes, uint32_t count) {
    for (uint32_t i = 0; i < count; i++) {
        bool all = true;
        for (int axis = 0; axis < 3; axis++) {
            const int64_t cell = (int64_t)corner[axis] + (1ll << level), shape = feed->source->shape[axis];
            all = all && boxes[i].begin[axis] <= corner[axis] && boxes[i].end[axis] >= (cell < shape ? cell : shape);
        }
        if (all) {
            return true;
        }
    }
    return false;
}

fm_result fm_voxel_changed(fm_voxel_trees *trees, fm_voxel_feed *feed, uint32_t level, const uint32_t corner[3],
                           const fm_box *boxes, uint32_t count, const fm_voxel_ref *old, fm_voxel_ref *cell) {
    *cell = *old;
    if (!touched(level, corner, boxes, count)) {
        return FM_OK;
    }
    if (level <= PATCH_LEVEL || covered(feed, level, corner, boxes, count)) {
        count_away(trees, level, old);
        return fm_voxel_cell(trees, feed, level, corner, cell);
    }
    const uint32_t branch = trees->kind->branch(level), edge = 1u << branch, below = level - branch, all = 1u << 3 * branch;
    fm_voxel_ref before[FM_BRANCHES], after[FM_BRANCHES];
    for (uint32_t i = 0; i < all; i++) {
        before[i] = *old;
    }
    if (old->type == FM_REF_NODE) {
        trees->kind->split(trees, level, old, before);
    }
    bool same = true;
    for (uint32_t i = 0; i < all; i++) {
        const uint32_t at[3] = {corner[0] + (i % edge << below), corner[1] + (i / edge % edge << below),
                                corner[2] + (i / edge / edge << below)};
        FM_TRY(fm_voxel_changed(trees, feed, below, at, boxes, count, &before[i], &after[i]));
        same = same && memcmp(&before[i], &after[i], sizeof *before) == 0;
    }
    if (same) {
        return FM_OK;
    }
    if (old->type == FM_REF_NODE) {
        fm_voxel_count(trees, level, before, true);
    }
    return fm_voxel_joined(trees, level, after, cell);
}

// The top grid is that of an empty octree until then, whose cells have been counted.
static fm_result put_top(fm_voxel_trees *trees, const uint32_t top[3], const fm_voxel_ref *cell) {
    const uint32_t *count = trees->octree->info.top;
    static const fm_voxel_ref empty = {0};
    uint32_t word;
    FM_TRY(trees->kind->place(trees, cell, &word));
    fm_voxel_words(trees)[top[0] + (uint64_t)count[0] * (top[1] + (uint64_t)count[1] * top[2])] = word;
    fm_voxel_count_top(trees, &empty, true);
    fm_voxel_count_top(trees, cell, false);
    return FM_OK;
}

// Top cells that are smaller than what is read at a time: those of one tile.
static fm_result small_tops(fm_voxel_trees *trees, fm_voxel_feed *feed, const uint32_t tile[3]) {
    const fm_octree_info *info = &trees->octree->info;
    const uint32_t edge = 1u << (TILE_LEVEL - info->levels), corner[3] = {tile[0] * TILE, tile[1] * TILE, tile[2] * TILE};
    fm_box box;
    block voxels;
    if (!box_of(feed, TILE_LEVEL, corner, &box) || (feed->source->air && feed->source->air(feed->source->user, &box))) {
        return FM_OK;
    }
    FM_TRY(read_block(feed, TILE_LEVEL, corner, &box, &voxels));
    for (uint32_t i = 0; i < edge * edge * edge; i++) {
        const uint32_t in[3] = {i % edge, i / edge % edge, i / edge / edge};
        const uint32_t top[3] = {tile[0] * edge + in[0], tile[1] * edge + in[1], tile[2] * edge + in[2]};
        if (top[0] >= info->top[0] || top[1] >= info->top[1] || top[2] >= info->top[2]) {
            continue;
        }
        const uint32_t at[3] = {top[0] << info->levels, top[1] << info->levels, top[2] << info->levels};
        const block part = {voxels.at + ((uint64_t)in[0] + voxels.row * in[1] + voxels.slice * in[2]) * (1u << info->levels),
                            voxels.row, voxels.slice};
        fm_voxel_ref cell;
        FM_TRY(from_block(trees, feed, part, info->levels, at, &cell));
        FM_TRY(put_top(trees, top, &cell));
    }
    return FM_OK;
}

static fm_result large_top(fm_voxel_trees *trees, fm_voxel_feed *feed, const uint32_t top[3]) {
    const fm_octree_info *info = &trees->octree->info;
    const uint32_t corner[3] = {top[0] << info->levels, top[1] << info->levels, top[2] << info->levels};
    fm_voxel_ref cell;
    FM_TRY(fm_voxel_cell(trees, feed, info->levels, corner, &cell));
    return put_top(trees, top, &cell);
}

fm_result fm_voxel_all(fm_voxel_trees *trees, fm_voxel_feed *feed) {
    const fm_octree_info *info = &trees->octree->info;
    const bool small = info->levels < TILE_LEVEL;
    uint32_t count[3];
    for (int axis = 0; axis < 3; axis++) {
        count[axis] = small ? (uint32_t)fm_div_up((uint64_t)info->top[axis] << info->levels, TILE) : info->top[axis];
    }
    for (uint32_t z = 0; z < count[2]; z++) {
        for (uint32_t y = 0; y < count[1]; y++) {
            for (uint32_t x = 0; x < count[0]; x++) {
                const uint32_t at[3] = {x, y, z};
                FM_TRY(small ? small_tops(trees, feed, at) : large_top(trees, feed, at));
            }
        }
    }
    return FM_OK;
}
