// SPDX-License-Identifier: MIT
#ifndef FM_CHUNKS_H
#define FM_CHUNKS_H

// What both backends of the chunked methods share.

#include "world/world.h"

enum {
    FM_CHUNK_UNKNOWN = UINT16_MAX,  // distance where no site is known; the longest way within a world is 3 * 16383
    FM_MAX_STEPS = 24,              // of jump flooding
    FM_SITE_BITS = 10,              // of a coordinate in a packed site: x, y, z from the lowest
};

static const uint32_t fm_site_none = UINT32_MAX;

// Jump flooding of sites over 26 neighbours is exact for Manhattan distances with these steps, though not for others: the way from
// a voxel's nearest site takes, along each axis, the steps that its length has in binary, each once, and so never leaves the box
// between the two. Were another site nearer to a voxel q on the way, it would be nearer to its end too, for lengths within the box
// add up at q; one that is as near is as good there. That of distances moves along one axis a step, and has no such way.
//
// The steps of a jump flooding algorithm (JFA_FIM and PUBLISHED_FINAL: those of JFA_PUBLISHED): from the largest power of two below
// the domains' longest edge, or 1, down to 1; steps of 1 before or of 2 and 1 behind them where the variant has them. Domains that
// the world's end cuts short take the same steps as the others.
uint32_t fm_chunk_steps(const fm_world *world, fm_world_algorithm algorithm, uint32_t steps[FM_MAX_STEPS]);
bool fm_chunk_propagates_sites(fm_world_algorithm algorithm);
bool fm_chunk_relaxes(fm_world_algorithm algorithm);

// The newest plan was carried out: the chunks are on the sides of the focus that it gave them.
void fm_chunks_done(fm_world *world);

#endif
