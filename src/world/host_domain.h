// SPDX-License-Identifier: MIT
#ifndef FM_HOST_DOMAIN_H
#define FM_HOST_DOMAIN_H

// One domain of a chunked method on the CPU, computed in scratch memory. Its distances are 16-bit numbers with a rim of one voxel,
// which holds what is known beyond its faces.

#include "world/chunks.h"
#include "world/host_world.h"

typedef struct fm_domain_work {
    fm_world *world;
    const fm_world_domain *domain;
    fm_pool *pool;        // shares a domain's slices; NULL: the caller alone works on it
    uint32_t size[3];     // of the domain
    uint64_t row, slice;  // elements between neighbours along y, z
    uint16_t *now, *next;
    uint32_t *sites, *next_sites;        // packed, without a rim
    uint8_t *changed, *next_changed;     // a slice of the last iteration, with a rim
    uint32_t step, initial, iterations;  // initial: what air starts with
} fm_domain_work;

// Bytes that a domain needs, and their use.
uint64_t fm_domain_scratch(const fm_world_domain *domain);
void fm_domain_lay_out(fm_domain_work *w, const fm_world_domain *domain, void *scratch);
// The domain's distances by its algorithm, from the site bits into the field. Counts iterations.
void fm_domain_compute(fm_domain_work *w);

// FM_BORDER_EXCHANGE: the distances of a domain and of its neighbours' nearest layers as the field has them, relaxed until nothing
// changes, and written.
void fm_domain_load(fm_domain_work *w);
void fm_domain_relax(fm_domain_work *w);
void fm_domain_store(fm_domain_work *w);

#endif
