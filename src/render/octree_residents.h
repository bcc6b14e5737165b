// SPDX-License-Identifier: MIT
#ifndef FM_OCTREE_RESIDENTS_H
#define FM_OCTREE_RESIDENTS_H

// Which parts of a streamed octree are in memory, which are to come, and which have to go for them.

#include "octree/file.h"
#include "render/octree_loader.h"
#include "render/octree_store.h"

typedef enum fm_part_state {
    FM_PART_ABSENT = 0,
    FM_PART_LOADING,
    FM_PART_THERE,
    FM_PART_LEAVING,  // fades, and is dropped then
    FM_PART_FAILED,   // until it is tried again
} fm_part_state;

typedef struct fm_part {
    fm_part_state state;
    uint64_t offset;  // in the room for parts
    uint8_t *image;   // CPU, and while it is loading
    uint64_t again;   // FAILED: when it may be tried again
    uint32_t tries;   // that failed since it was there
} fm_part;

typedef struct fm_part_wish {
    float score;
    uint32_t part;
} fm_part_wish;

typedef struct fm_octree_residents {
    fm_context *context;
    uint64_t count;
    const fm_fmo_part *rows;
    fm_part *parts;
    fm_octree_part *table;   // what pictures see
    fm_part_wish *wishes;    // room for as many as there are parts, as is
    const fm_part **places;  // this
    fm_octree_loader *loader;
    fm_octree_store *store;  // NULL on the CPU
    float fade_ms, retry_ms;
    uint64_t now;      // of the update that is under way, in nanoseconds
    uint64_t room;     // bytes for parts. On the CPU their places in it are but numbers
    uint64_t used;     // by parts that are there, are leaving or are loading
    uint64_t loading;  // parts
    uint64_t loaded, dropped, failed;
    uint32_t resident, wanted, failing;
    char failure[256];
} fm_octree_residents;

// `context`, `count`, `rows`, `room`, `fade_ms` and `retry_ms` are set; the loader and the store come later, and are the residents'
// then.
fm_result fm_residents_create(fm_octree_residents *residents);
void fm_residents_destroy(fm_octree_residents *residents);
// Parts that have been read get their places; `wait`: at least one, if one is under way.
fm_result fm_residents_settle(fm_octree_residents *residents, bool wait);
void fm_residents_fade(fm_octree_residents *residents, double ms);
// Asks for the parts that are wanted most, and lets those go that are wanted least where there is no room: they fade before, but
// with `at_once`.
fm_result fm_residents_choose(fm_octree_residents *residents, const float *scores, bool at_once);

#endif
