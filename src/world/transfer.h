// SPDX-License-Identifier: MIT
#ifndef FM_WORLD_TRANSFER_H
#define FM_WORLD_TRANSFER_H

#include "world/world.h"

// The world's voxels where the host may write them once the updates in flight are complete, else NULL.
uint32_t *fm_world_reached_voxels(const fm_world *world);

// Rows of voxels that are worth a transfer of their own.
uint64_t fm_world_piece_rows(const fm_world *world);

// Copies consecutive voxels from `first` on. The updates in flight are complete.
fm_result fm_world_put(fm_world *world, uint64_t first, const uint32_t *voxels, uint64_t count);
fm_result fm_world_get(const fm_world *world, uint64_t first, uint32_t *voxels, uint64_t count);

#endif
