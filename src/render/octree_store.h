// SPDX-License-Identifier: MIT
#ifndef FM_OCTREE_STORE_H
#define FM_OCTREE_STORE_H

// Where the parts of a stream lie on the device: a piece of memory of fixed size, in which each part has a run of its own, and a
// few copies of the table that pictures find them by, since pictures in flight read those before. gpu_octree_store.c, gpu_none.c.

#include "octree/octree.h"

enum { FM_OCTREE_STORE_PAGE = 1 << 16 };  // rooms are whole ones, so that a driver need not round them up

typedef struct fm_octree_store fm_octree_store;

// Room for `bytes` of parts (0 is fine), and tables of `parts` rows.
fm_result fm_octree_store_create(fm_context *context, uint64_t bytes, uint64_t parts, fm_octree_store **store);
void fm_octree_store_destroy(fm_octree_store *store);
// Of its own besides the parts' room: of the tables.
uint64_t fm_octree_store_tables(uint64_t parts);
// The largest room that a device gives at once.
uint64_t fm_octree_store_most(const fm_context *context);
// Copies `image` to `offset`, with a head in place of its first page, and gives the head's address. Waits for work in flight.
fm_result fm_octree_store_put(fm_octree_store *store, uint64_t offset, uint8_t *image, uint64_t bytes, const fm_octree *numbers,
                              uint64_t *head);
// The address of a table of these rows, which no picture reads that is submitted before.
fm_result fm_octree_store_table(fm_octree_store *store, const fm_octree_part *rows, uint64_t *address);

#endif
