// SPDX-License-Identifier: MIT
#ifndef FM_WORLD_TRANSFER_H
#define FM_WORLD_TRANSFER_H

#include "gpu/gpu.h"
#include "world/world.h"

// A plane of a world: a number of `width` bytes a voxel.
typedef struct fm_plane {
    const void *there;  // in host memory, or NULL and in
    fm_buffer *buffer;
    uint32_t width;
} fm_plane;

// Takes `count` entries, which are the box's entries from number `first` on.
typedef void (*fm_take_fn)(void *user, const void *entries, uint64_t first, uint64_t count);

// Errors: FM_ERROR_INVALID_ARGUMENT for a box that holds nothing or reaches out of the world.
fm_result fm_world_check_box(const fm_world *world, const fm_box *box);

// Reads a box of a plane, run by run, or copies it. The updates in flight are complete.
fm_result fm_world_read_plane(fm_world *world, const fm_plane *plane, const fm_box *box, fm_take_fn take, void *user);
fm_result fm_world_copy_plane(fm_world *world, const fm_plane *plane, const fm_box *box, void *to);

// The world's voxels where the host may write them once the updates in flight are complete, else NULL.
uint32_t *fm_world_reached_voxels(const fm_world *world);

// Rows of voxels that are worth a transfer of their own.
uint64_t fm_world_piece_rows(const fm_world *world);

// Copies consecutive voxels from `first` on. The updates in flight are complete.
fm_result fm_world_put(fm_world *world, uint64_t first, const uint32_t *voxels, uint64_t count);
fm_result fm_world_get(const fm_world *world, uint64_t first, uint32_t *voxels, uint64_t count);

#endif
