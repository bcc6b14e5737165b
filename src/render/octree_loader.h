// SPDX-License-Identifier: MIT
#ifndef FM_OCTREE_LOADER_H
#define FM_OCTREE_LOADER_H

// Reads parts of a file, and checks them, on a thread of its own, which touches neither the context nor the device. The calls are
// for one other thread.

#include "octree/file.h"

enum { FM_LOADS = 8 };  // that can wait or be under way

typedef struct fm_octree_loader fm_octree_loader;

typedef struct fm_octree_load {
    uint64_t part;
    fm_fmo_part row;
    uint8_t *image;  // of `row.bytes`, the caller's
    // Filled by the thread.
    fm_octree numbers;  // whose arrays are in the image
    fm_result result;
    char message[256];
} fm_octree_load;

// The file and the name must outlive it. What it reads must be of the kind, code and attributes of `like`, and cover its cube
// of `grid`. `most`: bytes of the largest part.
fm_result fm_octree_loader_create(fm_context *context, int file, const char *name, const fm_octree *like,
                                  const fm_octree_grid *grid, uint64_t most, fm_octree_loader **loader);
// Waits for the read that is under way. Images of loads that were not taken are the caller's still.
void fm_octree_loader_destroy(fm_octree_loader *loader);
// False: it has as much to do as it can take.
bool fm_octree_loader_ask(fm_octree_loader *loader, uint64_t part, const fm_fmo_part *row, uint8_t *image);
// Takes a load that is done, in the order in which they were asked for; `wait`: waits for the next one. False: there is none.
bool fm_octree_loader_take(fm_octree_loader *loader, bool wait, fm_octree_load *load);

#endif
