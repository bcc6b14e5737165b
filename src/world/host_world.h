// SPDX-License-Identifier: MIT
#ifndef FM_HOST_WORLD_H
#define FM_HOST_WORLD_H

#include "world/world.h"

struct fm_host_world {
    uint32_t *voxels;  // element x + X * (y + Y * z)
    uint32_t *bits;    // sites, FM_TYPE_BITS layout
    void *field;       // packed entries or distances
    uint8_t *colors;   // NULL for FM_FIELD_PACKED
    void *middle;      // EXACT: distances after the pass along y, of the field's distance type; else NULL
    // Flags a tile of columns, for the passes along y and z (host_exact.c).
    uint8_t *dirty_y, *dirty_z;
};

// host_exact.c: columns along y, then z, that changed rows reach; all when full.
fm_result fm_host_exact(fm_world *world, const fm_world_job *job);

// host_chunks.c: the job's domains, into the field's entries of air voxels. Sets the stats' chunks and iterations.
fm_result fm_host_chunks(fm_world *world, const fm_world_job *job);

// The distance of a voxel as the field has it, and its change (solid voxels keep their colour).
uint32_t fm_host_distance(const fm_world *world, uint64_t element);
void fm_host_set_distance(fm_world *world, uint64_t element, uint32_t distance);

#endif
