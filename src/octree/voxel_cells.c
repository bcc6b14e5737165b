// SPDX-License-Identifier: MIT
// Cells of octrees from voxels, from the finest upwards.

#include "octree/voxels.h"

#include <string.h>

// An update reads whole cubes of these, where each costs a call and where voxels lie in memory.
enum { PATCH_LEVEL = 4, DENSE_PATCH_LEVEL = 3 };

fm_result fm_voxel_feed_open(fm_context *context, fm_voxel_feed *feed) {
    feed->tile = fm_octree_alloc(context, 2ull * FM_TILE_VOXELS * sizeof *feed->tile, "voxels of an octree");
    feed->part = feed->tile ? feed->tile + FM_TILE_VOXELS : NULL;
    return feed->tile ? FM_OK : FM_ERROR_OUT_OF_HOST_MEMORY;
}

void fm_voxel_feed_close(fm_context *context, fm_voxel_feed *feed) {
    fm_octree_free(context, feed->tile, 2ull * FM_TILE_VOXELS * sizeof *feed->tile);
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
    cell->contour = trees->kind->around ? trees->kind->around(trees, children) : 0;
    fm_voxel_count(trees, level, children, false);
    return FM_OK;
}

// Whether all voxels of a cube of 4^3 are as the first.
static bool uniform4(const fm_voxel_block *from) {
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
        ref.contour = feed->contour ? feed->contour(feed->user, corner) : 0;
    }
    return ref;
}

fm_result fm_voxel_from_block(fm_voxel_trees *trees, const fm_voxel_feed *feed, fm_voxel_block from, uint32_t level,
                              const uint32_t corner[3], fm_voxel_ref *cell) {
    if (level == 0 || (level == 2 && uniform4(&from) && (*from.at == 0 || !feed->contour))) {
        *cell = ref_of(trees, feed, *from.at, corner);
        return FM_OK;
    }
    const uint32_t branch = trees->kind->branch(level), edge = 1u << branch, below = level - branch, size = 1u << below;
    fm_voxel_ref children[FM_BRANCHES];
    for (uint32_t i = 0; i < 1u << 3 * branch; i++) {
        const uint32_t x = i % edge * size, y = i / edge % edge * size, z = i / edge / edge * size;
        const fm_voxel_block part = {from.at + x + from.row * y + from.slice * z, from.row, from.slice};
        const uint32_t at[3] = {corner[0] + x, corner[1] + y, corner[2] + z};
        if (below == 0) {
            children[i] = ref_of(trees, feed, *part.at, at);
        } else {
            FM_TRY(fm_voxel_from_block(trees, feed, part, below, at, &children[i]));
        }
    }
    return fm_voxel_joined(trees, level, children, cell);
}

bool fm_voxel_box(const fm_voxel_feed *feed, uint32_t level, const uint32_t corner[3], fm_box *box) {
    for (int axis = 0; axis < 3; axis++) {
        box->begin[axis] = corner[axis];
        box->end[axis] = (int64_t)fm_min_u64((uint64_t)corner[axis] + (1ull << level), feed->source->shape[axis]);
        if (box->begin[axis] >= box->end[axis]) {
            return false;
        }
    }
    return !feed->source->air || !feed->source->air(feed->user, box);
}

// Rows of a box in the corner of a cube that is else empty.
static void spread(const fm_voxel_feed *feed, uint32_t level, const fm_box *box, fm_voxel_block from) {
    const uint64_t edge = 1ull << level, x = (uint64_t)(box->end[0] - box->begin[0]), y = (uint64_t)(box->end[1] - box->begin[1]),
                   z = (uint64_t)(box->end[2] - box->begin[2]);
    memset(feed->tile, 0, edge * edge * edge * sizeof *feed->tile);
    for (uint64_t row = 0; row < y * z; row++) {
        memcpy(feed->tile + (row / y * edge + row % y) * edge, from.at + row / y * from.slice + row % y * from.row,
               x * sizeof *feed->tile);
    }
}

fm_result fm_voxel_read(const fm_voxel_feed *feed, uint32_t level, const fm_box *box, fm_voxel_block *voxels) {
    const uint64_t edge = 1ull << level;
    uint64_t size[3];
    for (int axis = 0; axis < 3; axis++) {
        size[axis] = (uint64_t)(box->end[axis] - box->begin[axis]);
    }
    const bool whole = size[0] == edge && size[1] == edge && size[2] == edge;
    if (feed->dense) {
        const uint64_t row = feed->source->shape[0], slice = row * feed->source->shape[1];
        const uint64_t at = (uint64_t)box->begin[0] + row * (uint64_t)box->begin[1] + slice * (uint64_t)box->begin[2];
        *voxels = (fm_voxel_block){feed->dense + at, row, slice};
    } else {
        *voxels = (fm_voxel_block){whole ? feed->tile : feed->part, size[0], size[0] * size[1]};
        FM_TRY(feed->source->read(feed->user, box, whole ? feed->tile : feed->part));
    }
    if (!whole) {
        spread(feed, level, box, *voxels);
        *voxels = (fm_voxel_block){feed->tile, edge, edge * edge};
    }
    return FM_OK;
}

fm_result fm_voxel_cell(fm_voxel_trees *trees, fm_voxel_feed *feed, uint32_t level, const uint32_t corner[3], fm_voxel_ref *cell) {
    *cell = (fm_voxel_ref){0};
    fm_box box;
    bool any = true;
    if (feed->crew) {
        FM_TRY(fm_voxel_crew_reaches(feed->crew, level, corner, &any));
    } else {
        any = fm_voxel_box(feed, level, corner, &box);
    }
    if (!any) {
        return FM_OK;
    }
    if (level <= FM_TILE_LEVEL && feed->crew) {
        const fm_result result = fm_voxel_crew_copy(feed->crew, 0, cell);
        fm_voxel_crew_pass(feed->crew);
        return result;
    }
    if (level <= FM_TILE_LEVEL) {
        fm_voxel_block voxels;
        FM_TRY(fm_voxel_read(feed, level, &box, &voxels));
        return fm_voxel_from_block(trees, feed, voxels, level, corner, cell);
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
    if (level <= (feed->dense ? DENSE_PATCH_LEVEL : PATCH_LEVEL) || covered(feed, level, corner, boxes, count)) {
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

bool fm_voxel_small_top(const fm_octree *octree, const uint32_t tile[3], uint32_t i, uint32_t top[3]) {
    const uint32_t edge = 1u << (FM_TILE_LEVEL - octree->info.levels), in[3] = {i % edge, i / edge % edge, i / edge / edge};
    bool inside = true;
    for (int axis = 0; axis < 3; axis++) {
        top[axis] = (tile[axis] >> octree->info.levels) + in[axis];
        inside = inside && top[axis] < octree->info.top[axis];
    }
    return inside;
}

fm_result fm_voxel_from_tile(fm_voxel_trees *trees, const fm_voxel_feed *feed, fm_voxel_block tile, const uint32_t top[3],
                             fm_voxel_ref *cell) {
    const uint32_t levels = trees->octree->info.levels, at[3] = {top[0] << levels, top[1] << levels, top[2] << levels};
    const uint32_t in[3] = {at[0] % FM_TILE, at[1] % FM_TILE, at[2] % FM_TILE};
    const fm_voxel_block part = {tile.at + in[0] + tile.row * in[1] + tile.slice * in[2], tile.row, tile.slice};
    return fm_voxel_from_block(trees, feed, part, levels, at, cell);
}

static fm_result small_tops(fm_voxel_trees *trees, fm_voxel_feed *feed, const uint32_t tile[3]) {
    const uint32_t count = 1u << 3 * (FM_TILE_LEVEL - trees->octree->info.levels);
    fm_box box;
    fm_voxel_block voxels = {0};
    bool any = false;
    if (feed->crew) {
        FM_TRY(fm_voxel_crew_reaches(feed->crew, FM_TILE_LEVEL, tile, &any));
    } else if (fm_voxel_box(feed, FM_TILE_LEVEL, tile, &box)) {
        any = true;
        FM_TRY(fm_voxel_read(feed, FM_TILE_LEVEL, &box, &voxels));
    }
    for (uint32_t i = 0; any && i < count; i++) {
        uint32_t top[3];
        fm_voxel_ref cell;
        if (fm_voxel_small_top(trees->octree, tile, i, top)) {
            FM_TRY(feed->crew ? fm_voxel_crew_copy(feed->crew, i, &cell) : fm_voxel_from_tile(trees, feed, voxels, top, &cell));
            FM_TRY(put_top(trees, top, &cell));
        }
    }
    if (any && feed->crew) {
        fm_voxel_crew_pass(feed->crew);
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
    const bool small = info->levels < FM_TILE_LEVEL;
    uint32_t count[3];
    for (int axis = 0; axis < 3; axis++) {
        count[axis] = small ? (uint32_t)fm_div_up((uint64_t)info->top[axis] << info->levels, FM_TILE) : info->top[axis];
    }
    for (uint32_t z = 0; z < count[2]; z++) {
        for (uint32_t y = 0; y < count[1]; y++) {
            for (uint32_t x = 0; x < count[0]; x++) {
                const uint32_t top[3] = {x, y, z}, tile[3] = {x * FM_TILE, y * FM_TILE, z * FM_TILE};
                FM_TRY(small ? small_tops(trees, feed, tile) : large_top(trees, feed, top));
            }
        }
    }
    return FM_OK;
}

fm_result fm_voxel_begin(fm_voxel_trees *trees) {
    const uint64_t tops = fm_voxel_tops(trees->octree), all = fm_round_up(tops, 8);
    const fm_voxel_ref empty = {0};
    uint64_t first;
    uint32_t word;
    FM_TRY(fm_voxel_room(trees, &trees->octree->words, all, 1ull << 30, &first));
    FM_TRY(trees->kind->place(trees, &empty, &word));
    for (uint64_t i = 0; i < all; i++) {
        fm_voxel_words(trees)[i] = i < tops ? word : 0;
    }
    return FM_OK;
}

fm_result fm_voxel_copy(const fm_voxel_copying *work, uint32_t level, const fm_voxel_ref *cell, fm_voxel_ref *copy) {
    *copy = *cell;
    if (cell->type != FM_REF_NODE) {
        return FM_OK;
    }
    if (work->known && work->known[cell->w[0]] != 0) {
        copy->w[0] = work->known[cell->w[0]];
        return FM_OK;
    }
    const uint32_t branch = work->from->kind->branch(level);
    fm_voxel_ref children[FM_BRANCHES];
    work->from->kind->split(work->from, level, cell, children);
    for (uint32_t i = 0; i < 1u << 3 * branch; i++) {
        if (children[i].type == FM_REF_NODE) {
            const fm_voxel_ref child = children[i];
            FM_TRY(fm_voxel_copy(work, level - branch, &child, &children[i]));
        }
    }
    FM_TRY(work->to->kind->join(work->to, level, children, copy));
    copy->contour = cell->contour;
    if (work->known) {
        work->known[cell->w[0]] = copy->w[0];
    }
    return FM_OK;
}
