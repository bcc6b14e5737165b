// SPDX-License-Identifier: MIT
#ifndef FM_HOST_WORLD_H
#define FM_HOST_WORLD_H

#include "world/world.h"

struct fm_host_world {
    uint32_t *voxels;  // element x + X * (y + Y * z)
    uint32_t *bits;    // sites, FM_TYPE_BITS layout
    void *field;       // packed entries or distances; then the colours
    uint8_t *colors;   // NULL for FM_FIELD_PACKED
    uint64_t voxel_bytes, bits_bytes, field_bytes;
    struct fm_host_exact *exact;  // host_exact.c; NULL for other methods
};

// host_exact.c: what the exact method keeps. A row of sites that has changed is told to it, with what it was; then come the columns
// along y and z that changed rows reach. All of them when full, where nothing need be told.
fm_result fm_host_exact_create(fm_world *world, fm_host_world *host);
void fm_host_exact_destroy(fm_world *world, struct fm_host_exact *exact);
void fm_host_exact_changed(fm_world *world, const uint32_t *before, uint32_t y, uint32_t z);
void fm_host_exact_update(fm_world *world, bool full);
uint64_t fm_host_exact_bytes(const fm_world *world);
// Site bits of `words` times 32 voxels.
void fm_host_encode(const uint32_t *voxels, uint64_t words, uint32_t *bits);

// host_chunks.c: the job's domains, into the field's entries of air voxels. Sets the stats' chunks and iterations.
fm_result fm_host_chunks(fm_world *world, const fm_world_job *job);

// The distance of a voxel as the field has it, and its change (solid voxels keep their colour).
uint32_t fm_host_distance(const fm_world *world, uint64_t element);
void fm_host_set_distance(fm_world *world, uint64_t element, uint32_t distance);

#endif
