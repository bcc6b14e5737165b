// SPDX-License-Identifier: MIT
#ifndef FM_GPU_WORLD_H
#define FM_GPU_WORLD_H

#include "gpu/compute.h"
#include "world/world.h"

enum { FM_WORLD_IN_FLIGHT = 3 };

// How a world's columns are cut into tiles and segments; tiles of both axes are equally wide.
typedef struct fm_column_layout {
    fm_kernel kernel;
    uint32_t lanes, rows, tile_width;  // rows of a segment
    uint32_t segments_y, segments_z;
    uint32_t tiles;  // along x
} fm_column_layout;

// What the host writes for an update in flight, and what the kernels write for the host.
typedef struct fm_world_flight {
    fm_buffer *upload;
    uint64_t upload_bytes, used;
    fm_buffer *readback;  // FM_READBACK_WORDS 32-bit words
    fm_ticket ticket;
} fm_world_flight;

// Words of a flight's readback memory.
enum { FM_COUNTED_Y = 0, FM_COUNTED_Z, FM_COUNTED_CHUNKS /* gpu_chunk_relax.c */, FM_READBACK_WORDS = 64 };

struct fm_gpu_world {
    fm_gpu *gpu;
    fm_buffer *voxels, *bits, *carries;
    fm_buffer *field, *colors;  // colors NULL for FM_FIELD_PACKED
    fm_buffer *middle;          // EXACT: distances after y; rows of `pitch` elements; else NULL
    fm_buffer *lists;           // EXACT: headers and tile lists of the passes, their flags and windows; else NULL
    fm_column_layout layout;
    uint32_t pitch;

    fm_world_flight flights[FM_WORLD_IN_FLIGHT];
    uint32_t flight;  // of the newest update
    uint32_t next;    // of the one that is being recorded
    uint64_t rows;    // that the newest update looked at
    uint32_t parity;  // which header of the tiles along y the next update uses

    struct fm_gpu_chunks *chunks;    // gpu_chunks.c; NULL until it is needed
    struct fm_gpu_samples *samples;  // gpu_samples.c; NULL until it is needed
};

// Memory of the update that is being recorded, which the host writes and kernels read. Where it is full, what has been recorded is
// carried out first, so that `slot` is another one.
fm_result fm_gpu_world_upload(fm_world *world, fm_slot **slot, uint64_t bytes, void **memory, uint64_t *address);

// Headers of lists without an entry.
void fm_gpu_world_empty_lists(uint32_t (*headers)[4], uint32_t count);

// gpu_chunks.c: the memory of chunked methods, which must be there before an update is recorded: what fills it is recorded too.
fm_result fm_gpu_chunks_prepare(fm_world *world);
// Records the job's domains into `slot` (which FM_CONVERGE_HOST submits and begins anew), into the field's entries of
// air voxels. The site bits are up to date when it runs.
fm_result fm_gpu_chunks_update(fm_world *world, const fm_world_job *job, fm_slot **slot);
// What the newest update did, which is complete: chunks, iterations, host_wait_ms.
void fm_gpu_chunks_stats(fm_world *world, fm_world_stats *stats);
void fm_gpu_chunks_destroy(fm_world *world);

// gpu_samples.c: fm_world_query; waits. Its buffers stay with the world.
fm_result fm_gpu_samples_query(fm_world *world, const float (*positions)[3], uint32_t count, fm_world_sample *samples);
void fm_gpu_samples_destroy(struct fm_gpu_samples *own);

#endif
