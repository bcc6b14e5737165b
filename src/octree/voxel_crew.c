// SPDX-License-Identifier: MIT
// Octrees of voxels by many threads. Tiles, which are cubes of 2^6 voxels, are found in the order in which one thread would read
// them, some at a time; each is built in memory of its own; then the calling thread, which goes through the tree as it does alone,
// copies them to where they belong.

#include "octree/voxels.h"

#include <stdio.h>
#include <string.h>

// The most top cells of a tile, levels between a top cell and a tile, and tiles at a time for each thread and for all.
enum { MOST_TOPS = 512, MOST_DEPTH = 16, TILES_EACH = 8, MOST_TILES = 256, MESSAGE = 256 };

typedef struct tile {
    uint32_t corner[3];
    fm_box box;
    fm_voxel_block voxels;
    uint32_t *own;  // TILE_VOXELS, where only the calling thread may read
    fm_octree octree;
    fm_voxel_trees trees;
    fm_voxel_ref cells[MOST_TOPS];
    uint32_t *known;  // of shared nodes, while they are copied: `known_room`
    uint64_t known_room;
    fm_result result;
    char message[MESSAGE];
} tile;

typedef struct step {
    uint32_t level, corner[3], next;
} step;

struct fm_voxel_crew {
    fm_voxel_trees *trees;
    fm_voxel_feed *feed;   // the calling thread's
    fm_voxel_feed *feeds;  // of each worker, with room for what it reads
    uint32_t workers;
    bool concurrent;
    tile *tiles;
    uint32_t room, count, next;
    // The way to the tile behind the last: top cells, or tiles where those are smaller, that were looked at, and cells from one
    // down.
    uint32_t size[3];
    uint64_t tops, seen;
    step steps[MOST_DEPTH];
    uint32_t depth;
};

// ---------------------------------------------------------------------------------------------------------------------------
// Which tiles
// ---------------------------------------------------------------------------------------------------------------------------

static uint32_t top_level(const fm_voxel_crew *crew) {
    const uint32_t levels = crew->trees->octree->info.levels;
    return levels < FM_TILE_LEVEL ? FM_TILE_LEVEL : levels;
}

// The next cell below the last step, or the next top cell.
static bool next_cell(fm_voxel_crew *crew, uint32_t *level, uint32_t corner[3]) {
    while (crew->depth > 0) {
        step *last = &crew->steps[crew->depth - 1];
        const uint32_t branch = crew->trees->kind->branch(last->level), edge = 1u << branch, i = last->next++;
        if (i < edge * edge * edge) {
            const uint32_t at[3] = {i % edge, i / edge % edge, i / edge / edge};
            *level = last->level - branch;
            for (int axis = 0; axis < 3; axis++) {
                corner[axis] = last->corner[axis] + (at[axis] << *level);
            }
            return true;
        }
        crew->depth--;
    }
    if (crew->seen == crew->tops) {
        return false;
    }
    *level = top_level(crew);
    corner[0] = (uint32_t)(crew->seen % crew->size[0]) << *level;
    corner[1] = (uint32_t)(crew->seen / crew->size[0] % crew->size[1]) << *level;
    corner[2] = (uint32_t)(crew->seen / crew->size[0] / crew->size[1]) << *level;
    crew->seen++;
    return true;
}

static bool next_tile(fm_voxel_crew *crew, tile *found) {
    step cell = {0};
    while (next_cell(crew, &cell.level, cell.corner)) {
        if (!fm_voxel_box(crew->feed, cell.level, cell.corner, &found->box)) {
            continue;
        }
        if (cell.level == FM_TILE_LEVEL) {
            memcpy(found->corner, cell.corner, sizeof found->corner);
            return true;
        }
        crew->steps[crew->depth++] = cell;
    }
    return false;
}

// ---------------------------------------------------------------------------------------------------------------------------
// What is in them
// ---------------------------------------------------------------------------------------------------------------------------

static void begin_tile(const fm_voxel_crew *crew, tile *work) {
    const fm_octree *model = crew->trees->octree;
    fm_octree *octree = &work->octree;
    octree->info = (fm_octree_info){.kind = model->info.kind, .levels = model->info.levels, .top = {1, 1, 1}};
    octree->words.count = octree->values.count = 0;
    fm_voxel_trees *trees = &work->trees;
    trees->node_used = trees->node_count = trees->internal = trees->unshared = 0;
    if (trees->nodes) {
        memset(trees->nodes, 0, trees->node_room * sizeof *trees->nodes);
    }
}

static fm_result build_cells(fm_voxel_crew *crew, const fm_voxel_feed *feed, tile *work) {
    begin_tile(crew, work);
    FM_TRY(fm_voxel_begin(&work->trees));
    if (crew->concurrent) {
        FM_TRY(fm_voxel_read(feed, FM_TILE_LEVEL, &work->box, &work->voxels));
    }
    const uint32_t levels = work->octree.info.levels;
    if (levels >= FM_TILE_LEVEL) {
        return fm_voxel_from_block(&work->trees, feed, work->voxels, FM_TILE_LEVEL, work->corner, work->cells);
    }
    for (uint32_t i = 0; i < 1u << 3 * (FM_TILE_LEVEL - levels); i++) {
        uint32_t top[3];
        if (fm_voxel_small_top(crew->trees->octree, work->corner, i, top)) {
            FM_TRY(fm_voxel_from_tile(&work->trees, feed, work->voxels, top, &work->cells[i]));
        }
    }
    return FM_OK;
}

static void build_tiles(void *user, uint64_t begin, uint64_t end, uint32_t worker) {
    fm_voxel_crew *crew = user;
    for (uint64_t i = begin; i < end; i++) {
        tile *work = &crew->tiles[i];
        work->result = build_cells(crew, &crew->feeds[worker], work);
        if (work->result != FM_OK) {
            // Messages are a thread's own.
            snprintf(work->message, sizeof work->message, "%s", fm_last_error());
        }
    }
}

static fm_result read_tile(const fm_voxel_crew *crew, tile *found) {
    fm_voxel_feed feed = *crew->feed;
    feed.tile = found->own;
    return fm_voxel_read(&feed, FM_TILE_LEVEL, &found->box, &found->voxels);
}

static fm_result build_more(fm_voxel_crew *crew) {
    crew->count = crew->next = 0;
    while (crew->count < crew->room && next_tile(crew, &crew->tiles[crew->count])) {
        if (!crew->concurrent) {
            FM_TRY(read_tile(crew, &crew->tiles[crew->count]));
        }
        crew->count++;
    }
    fm_pool_run(crew->trees->octree->context->pool, crew->count, 1, build_tiles, crew);
    for (uint32_t i = 0; i < crew->count; i++) {
        const tile *work = &crew->tiles[i];
        FM_TRY(work->result == FM_OK ? FM_OK : fm_fail(work->result, "%s", work->message));
    }
    return FM_OK;
}

fm_result fm_voxel_crew_reaches(fm_voxel_crew *crew, uint32_t level, const uint32_t corner[3], bool *reaches) {
    if (crew->next == crew->count) {
        FM_TRY(build_more(crew));
    }
    *reaches = crew->next < crew->count;
    for (int axis = 0; axis < 3 && *reaches; axis++) {
        *reaches = crew->tiles[crew->next].corner[axis] >> level == corner[axis] >> level;
    }
    return FM_OK;
}

// ---------------------------------------------------------------------------------------------------------------------------
// Into the octree
// ---------------------------------------------------------------------------------------------------------------------------

// What counts cells, once for each tile.
static void add_counts(fm_voxel_trees *to, const fm_voxel_trees *from) {
    fm_octree_info *info = &to->octree->info;
    for (size_t level = 0; level < sizeof info->leaves / sizeof *info->leaves; level++) {
        info->leaves[level] += from->octree->info.leaves[level];
    }
    info->empty += from->octree->info.empty;
    to->internal += from->internal;
    to->unshared += from->unshared;
}

static fm_result begin_copy(fm_voxel_crew *crew, tile *from) {
    add_counts(crew->trees, &from->trees);
    if (!crew->trees->kind->shared) {
        return FM_OK;
    }
    fm_context *context = crew->trees->octree->context;
    const uint64_t count = from->octree.words.count;
    if (count > from->known_room) {
        fm_octree_free(context, from->known, from->known_room * sizeof *from->known);
        from->known = fm_octree_alloc(context, count * sizeof *from->known, "a copy of an octree");
        from->known_room = from->known ? count : 0;
    }
    if (!from->known) {
        return FM_ERROR_OUT_OF_HOST_MEMORY;
    }
    memset(from->known, 0, count * sizeof *from->known);
    return FM_OK;
}

fm_result fm_voxel_crew_copy(fm_voxel_crew *crew, uint32_t i, fm_voxel_ref *cell) {
    tile *from = &crew->tiles[crew->next];
    const uint32_t levels = from->octree.info.levels;
    if (i == 0) {
        FM_TRY(begin_copy(crew, from));
    }
    const fm_voxel_copying work = {&from->trees, crew->trees, crew->trees->kind->shared ? from->known : NULL};
    return fm_voxel_copy(&work, levels < FM_TILE_LEVEL ? levels : FM_TILE_LEVEL, &from->cells[i], cell);
}

void fm_voxel_crew_pass(fm_voxel_crew *crew) {
    crew->next++;
}

// ---------------------------------------------------------------------------------------------------------------------------
// The crew
// ---------------------------------------------------------------------------------------------------------------------------

static uint64_t own_bytes(const fm_voxel_crew *crew) {
    return crew->concurrent ? 0 : FM_TILE_VOXELS * sizeof(uint32_t);
}

static bool make_tile(const fm_voxel_crew *crew, tile *made) {
    const fm_octree *model = crew->trees->octree;
    made->octree = (fm_octree){.context = model->context, .desc = model->desc, .head = model->head};
    made->octree.info.kind = model->info.kind;
    fm_octree_size_arrays(&made->octree);
    made->trees.octree = &made->octree;
    made->trees.kind = crew->trees->kind;
    if (!crew->concurrent) {
        made->own = fm_octree_alloc(model->context, own_bytes(crew), "voxels of an octree");
    }
    return crew->concurrent || made->own;
}

static void free_tile(const fm_voxel_crew *crew, tile *made) {
    fm_context *context = crew->trees->octree->context;
    if (made->octree.context) {
        fm_octree_array_free(&made->octree, &made->octree.words);
        fm_octree_array_free(&made->octree, &made->octree.values);
    }
    fm_octree_free(context, made->trees.nodes, made->trees.node_room * sizeof *made->trees.nodes);
    fm_octree_free(context, made->known, made->known_room * sizeof *made->known);
    fm_octree_free(context, made->own, own_bytes(crew));
}

static fm_result fill_crew(fm_voxel_crew *crew) {
    fm_context *context = crew->trees->octree->context;
    crew->feeds = fm_octree_alloc_zero(context, crew->workers * sizeof *crew->feeds, "threads of an octree");
    crew->tiles = fm_octree_alloc_zero(context, crew->room * sizeof *crew->tiles, "tiles of an octree");
    if (!crew->feeds || !crew->tiles) {
        return FM_ERROR_OUT_OF_HOST_MEMORY;
    }
    for (uint32_t i = 0; i < crew->workers; i++) {
        crew->feeds[i] = *crew->feed;
        crew->feeds[i].tile = NULL;
        crew->feeds[i].user = crew->feed->users ? crew->feed->users[i] : crew->feed->user;
        if (crew->concurrent) {
            FM_TRY(fm_voxel_feed_open(context, &crew->feeds[i]));
        }
    }
    for (uint32_t i = 0; i < crew->room; i++) {
        if (!make_tile(crew, &crew->tiles[i])) {
            return FM_ERROR_OUT_OF_HOST_MEMORY;
        }
    }
    return FM_OK;
}

fm_result fm_voxel_crew_open(fm_voxel_trees *trees, fm_voxel_feed *feed) {
    const fm_octree *octree = trees->octree;
    const uint32_t workers = fm_pool_threads(octree->context->pool);
    fm_voxel_crew model = {.trees = trees, .feed = feed, .workers = workers};
    const uint32_t level = top_level(&model);
    uint64_t tiles = 1;
    model.tops = 1;
    for (int axis = 0; axis < 3; axis++) {
        model.size[axis] = (uint32_t)fm_div_up(octree->info.cells[axis], 1ull << level);
        model.tops *= model.size[axis];
        tiles *= fm_div_up(octree->info.cells[axis], FM_TILE);
    }
    if (workers == 1 || tiles == 1) {
        return FM_OK;
    }
    model.concurrent = feed->dense || feed->users || feed->source->concurrent;
    model.room = (uint32_t)fm_min_u64(fm_min_u64(MOST_TILES, (uint64_t)workers * TILES_EACH), tiles);
    feed->crew = fm_octree_alloc(octree->context, sizeof model, "threads of an octree");
    if (!feed->crew) {
        return FM_ERROR_OUT_OF_HOST_MEMORY;
    }
    *feed->crew = model;
    const fm_result result = fill_crew(feed->crew);
    if (result != FM_OK) {
        fm_voxel_crew_close(feed);
    }
    return result;
}

void fm_voxel_crew_close(fm_voxel_feed *feed) {
    fm_voxel_crew *crew = feed->crew;
    if (!crew) {
        return;
    }
    fm_context *context = crew->trees->octree->context;
    for (uint32_t i = 0; i < crew->room && crew->tiles; i++) {
        free_tile(crew, &crew->tiles[i]);
    }
    for (uint32_t i = 0; i < crew->workers && crew->feeds; i++) {
        fm_voxel_feed_close(context, &crew->feeds[i]);
    }
    fm_octree_free(context, crew->tiles, crew->room * sizeof *crew->tiles);
    fm_octree_free(context, crew->feeds, crew->workers * sizeof *crew->feeds);
    fm_octree_free(context, crew, sizeof *crew);
    feed->crew = NULL;
}
