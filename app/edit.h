// SPDX-License-Identifier: MIT
#ifndef FM_APP_EDIT_H
#define FM_APP_EDIT_H

// Edits that can be taken back: the voxels that a brush may change are read before it is applied. Memory is bounded; what is
// too old or too big is forgotten.

#include "fathom/world.h"

typedef struct edit_step {
    fm_brush brush;
    fm_box box;        // within the world
    uint32_t *before;  // the voxels of the box
    uint64_t bytes;
} edit_step;

typedef struct edit_history {
    edit_step *steps;
    uint32_t count, capacity;
    uint32_t at;     // steps before it are done, the others undone
    uint64_t bytes;  // of all `before`
    uint64_t limit;
} edit_history;

// Forgets everything.
void edit_clear(edit_history *h);

// Queues a sphere for the next update, which must have nothing else to do: voxels are read as they are before. The only wait is
// that for them. `changes` tells whether the sphere changes any voxel, or, where too little memory is left to know, may change one;
// else nothing is queued and nothing forgotten. False when the world refuses, which fm_last_error explains; the history is then as
// it was.
bool edit_apply(edit_history *h, fm_world *world, const fm_brush *brush, bool *changes);
// The same holds. False when there is nothing to take back or do again (`failed` false) or the world refuses (`failed` true).
bool edit_undo(edit_history *h, fm_world *world, bool *failed);
bool edit_redo(edit_history *h, fm_world *world, bool *failed);

// The brush for what the mouse points at: it deletes around the voxel, or builds on its face.
fm_brush edit_brush(const int32_t voxel[3], int32_t face, uint32_t radius, uint32_t color, bool erase);

#endif
