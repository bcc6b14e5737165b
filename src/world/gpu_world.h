// SPDX-License-Identifier: MIT
#ifndef FM_GPU_WORLD_H
#define FM_GPU_WORLD_H

#include "gpu/compute.h"
#include "world/world.h"

enum { FM_WORLD_IN_FLIGHT = 3 };

struct fm_gpu_world {
    fm_gpu *gpu;
    fm_buffer *voxels, *bits, *carries;
    fm_buffer *field, *colors;  // colors NULL for FM_FIELD_PACKED
    fm_buffer *middle;          // EXACT: distances after y; rows of `pitch` elements
    uint32_t pitch;
    fm_buffer *lists;  // headers and tile lists of the exact passes, their flags and windows

    // What the host writes for an update in flight and what the kernels write for the host.
    struct {
        fm_buffer *upload, *readback;
        fm_ticket ticket;
    } flights[FM_WORLD_IN_FLIGHT];
    uint32_t flight;

    struct fm_gpu_chunks *chunks;  // gpu_chunks.c
};

// Memory of the current flight that the host writes and kernels read, at least `bytes`; the flight's ticket has been waited for.
fm_result fm_gpu_world_upload(fm_world *world, uint64_t bytes, void **memory, uint64_t *address);

// gpu_chunks.c: records the job's domains into `slot` (which FM_CONVERGE_HOST submits and begins anew), into the field's entries of
// air voxels. The site bits are up to date when it runs.
fm_result fm_gpu_chunks_update(fm_world *world, const fm_world_job *job, fm_slot **slot);
// What the newest update did: chunks, iterations, host_wait_ms.
fm_result fm_gpu_chunks_stats(fm_world *world, fm_world_stats *stats);
void fm_gpu_chunks_destroy(fm_world *world);

#endif
