// SPDX-License-Identifier: MIT
#ifndef FM_WORLD_H
#define FM_WORLD_H

// An editable world as its parts see it. world.c checks arguments, queues edits and keeps track of what is dirty; an update becomes
// a job that one of two backends carries out: host_*.c on the CPU, gpu_*.c on Vulkan. Both do the same steps:
//
// 1. rows: brushes are applied to the voxels; the row's site bits, its carries (see shaders/include/sites.glsl) and the field's
//    entries of solid voxels (distance 0 and their colour; colour 0 for what became air) follow. Done for every method.
// 2. exact: columns along y, then along z, that the changed rows reach. The distances after y are kept (`middle`).
// 2. chunked methods: the dirty domains, from the bits; distances of air voxels are written into the field.

#include "fathom/world.h"
#include "shaders/include/shared.h"
#include "volume/volume.h"

enum {
    FM_WORLD_MAX_AXIS = 16384,
    FM_BUNDLE_ROWS = 8,
    FM_MAX_RADIUS = 1 << 30,
};

// Layout shared with the kernels (shared.h): fm_gpu_brush, fm_gpu_bundle.

// The edits of one update that are carried out together. `order` holds brush numbers: bundle i applies order[first] ...
// order[first + count - 1], in that order.
typedef struct fm_world_batch {
    const fm_gpu_bundle *bundles;
    uint32_t bundle_count;
    const fm_gpu_brush *brushes;
    uint32_t brush_count;
    const uint32_t *order;
    uint32_t order_count;
} fm_world_batch;

// What chunked methods compute at a time: distances of `result` from the sites of `domain`, which holds it.
typedef struct fm_world_domain {
    uint32_t begin[3], size[3];  // domain, inside the world
    uint32_t result_begin[3], result_size[3];
    fm_world_algorithm algorithm;  // never EXACT or SELECTIVE
    bool padded;                   // beyond the domain all is solid
    bool linked;                   // beyond the domain the field holds true distances (FM_BORDER_EXCHANGE)
} fm_world_domain;

typedef struct fm_world_job {
    bool full;  // everything is dirty; there may be batches all the same
    const fm_world_batch *batches;
    uint32_t batch_count;
    const fm_world_domain *domains;  // of a chunked method; all of them when full
    uint32_t domain_count;
} fm_world_job;

typedef struct fm_host_world fm_host_world;
typedef struct fm_gpu_world fm_gpu_world;

struct fm_world {
    fm_context *context;
    fm_world_desc desc;
    fm_host_world *host;  // one of the two
    fm_gpu_world *gpu;
    fm_ticket newest;
    fm_world_stats stats;  // of the newest update; the Vulkan backend fills it in when asked
    struct fm_world_queue *queue;
    bool all_dirty;
    bool focus_moved;              // since the newest update
    struct fm_chunk_plan *chunks;  // chunks.c; NULL until it is needed
};

// Distances above this become this: what the format holds, and the cap.
uint32_t fm_world_cap(const fm_world_desc *desc);
// Bytes of a distance (or a packed field's entry).
uint32_t fm_field_width(fm_field_format format);
// Bytes of a distance by itself, as the exact passes keep it.
uint32_t fm_lane_width(fm_field_format format);
// Distance of entry i of a field, or of a part of one.
static inline uint32_t fm_field_distance(fm_field_format format, const void *entries, uint64_t i) {
    switch (format) {
    case FM_FIELD_PACKED:
        return ((const uint32_t *)entries)[i] >> 24;
    case FM_FIELD_SPLIT_U8:
        return ((const uint8_t *)entries)[i];
    case FM_FIELD_SPLIT_U16:
        return ((const uint16_t *)entries)[i];
    default:
        return ((const uint32_t *)entries)[i];
    }
}

// queue.c: edits and dirty boxes that wait for the update.
typedef struct fm_world_queue fm_world_queue;
fm_result fm_queue_create(fm_world *world, fm_world_queue **queue);
void fm_queue_destroy(fm_world_queue *queue);
fm_result fm_queue_brushes(fm_world_queue *queue, const fm_brush *brushes, uint32_t count);
void fm_queue_mark(fm_world_queue *queue, const fm_box *box);
bool fm_queue_empty(const fm_world_queue *queue);
// Makes the job's batches and the boxes of all that may change; what they point to lives until fm_queue_clear.
fm_result fm_queue_job(fm_world_queue *queue, fm_world_job *job, const fm_box **touched, uint32_t *touched_count);
void fm_queue_clear(fm_world_queue *queue);

// chunks.c: the domains of a chunked method that boxes of edits make dirty (all when job->full), and those that a moved focus
// does. They live until the next call.
fm_result fm_chunks_plan(fm_world *world, const fm_box *touched, uint32_t touched_count, fm_world_job *job);
void fm_chunks_destroy(fm_world *world);

// host_world.c. `prepare` gets the memory that world->desc.method needs. `destroy` is fine with a world that has no backend.
fm_result fm_host_world_create(fm_world *world, fm_host_world **host);
void fm_host_world_destroy(fm_world *world);
fm_result fm_host_world_prepare(fm_world *world);
fm_result fm_host_world_update(fm_world *world, const fm_world_job *job);

// gpu_world.c. `update` sets world->newest; `stats` waits for it and fills in world->stats.
fm_result fm_gpu_world_create(fm_world *world);
void fm_gpu_world_destroy(fm_world *world);
fm_result fm_gpu_world_prepare(fm_world *world);
fm_result fm_gpu_world_update(fm_world *world, const fm_world_job *job);
fm_result fm_gpu_world_stats(fm_world *world);

#endif
