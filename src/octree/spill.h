// SPDX-License-Identifier: MIT
#ifndef FM_OCTREE_SPILL_H
#define FM_OCTREE_SPILL_H

// Records that come in any order of their keys and are read key by key. What memory does not hold waits in a file without a name.

#include "volume/context.h"

typedef struct fm_spill fm_spill;

// Keys are below 2^32. At most about `bytes` of host memory are used, besides 16 bytes for each key of each time that memory was
// full. `folder` NULL: that of TMPDIR, else /tmp. The file is made when it is first needed.
fm_result fm_spill_create(fm_context *context, const char *folder, uint32_t record_bytes, uint64_t bytes, fm_spill **spill);
void fm_spill_destroy(fm_spill *spill);
// Errors: FM_ERROR_IO, FM_ERROR_OUT_OF_HOST_MEMORY; the record may be lost then.
fm_result fm_spill_add(fm_spill *spill, uint32_t key, const void *record);
// No more is added.
fm_result fm_spill_finish(fm_spill *spill);
// Of the key, in the order they were added: calls `fn` for each after telling how many there are. Keys must be asked for in rising
// order.
uint64_t fm_spill_count(fm_spill *spill, uint32_t key);
fm_result fm_spill_read(fm_spill *spill, uint32_t key, void (*fn)(void *user, const void *record), void *user);

#endif
