// SPDX-License-Identifier: MIT
// Rays through octrees on Vulkan: one dispatch for as many as a buffer of rays holds. They all wait.

#include "gpu/compute.h"
#include "octree/octree.h"

#include <string.h>

_Static_assert(sizeof(fm_mesh_ray) == 32 && sizeof(fm_octree_hit) == 24, "as octree_cast.comp has them");

enum { THREADS = 64, MOST_RAYS = 1 << 20 };

typedef struct cast_room {
    fm_buffer *rays, *hits;
} cast_room;

static fm_result cast_batch(fm_octree *octree, const fm_dispatch *what, const fm_octree_cast_push *push) {
    fm_gpu *gpu = octree->context->gpu;
    fm_dispatch dispatch = *what;
    dispatch.push = push;
    dispatch.push_bytes = sizeof *push;
    dispatch.groups = fm_div_up(push->count, THREADS);
    fm_slot *slot;
    FM_TRY(fm_commands_begin(gpu, &slot));
    FM_TRY(fm_commands_dispatch(gpu, slot, &dispatch));
    fm_commands_pass(gpu, slot, "cast", push->count * (uint64_t)(sizeof(fm_mesh_ray) + sizeof(fm_octree_hit)));
    return fm_commands_submit(gpu, slot, NULL);
}

static fm_result cast_all(fm_octree *octree, const cast_room *room, const fm_mesh_ray *rays, uint32_t count, float epsilon,
                          bool stepped, fm_octree_hit *hits) {
    const uint32_t constants[] = {(uint32_t)octree->head.kind, (uint32_t)octree->head.code, stepped};
    const fm_dispatch what = {.kernel = FM_KERNEL_OCTREE_CAST, .constants = constants, .constant_count = 3};
    fm_octree_cast_push push = {.rays = fm_buffer_address(room->rays), .hits = fm_buffer_address(room->hits), .epsilon = epsilon};
    FM_TRY(fm_gpu_octree_head(octree, &push.head));
    for (uint32_t done = 0; done < count; done += push.count) {
        push.count = (uint32_t)fm_min_u64(count - done, MOST_RAYS);
        memcpy(fm_buffer_mapped(room->rays), rays + done, push.count * sizeof *rays);
        FM_TRY(cast_batch(octree, &what, &push));
        memcpy(hits + done, fm_buffer_mapped(room->hits), push.count * sizeof *hits);
    }
    return FM_OK;
}

fm_result fm_gpu_octree_cast(fm_octree *octree, const fm_mesh_ray *rays, uint32_t count, float epsilon, bool stepped,
                             fm_octree_hit *hits) {
    if (count == 0) {
        return FM_OK;
    }
    fm_gpu *gpu = octree->context->gpu;
    const uint64_t most = fm_min_u64(count, MOST_RAYS);
    cast_room room = {0};
    fm_result status = fm_buffer_create(gpu, FM_PURPOSE_UPLOAD, most * sizeof *rays, false, &room.rays);
    if (status == FM_OK) {
        status = fm_buffer_create(gpu, FM_PURPOSE_READBACK, most * sizeof *hits, false, &room.hits);
    }
    if (status == FM_OK) {
        status = cast_all(octree, &room, rays, count, epsilon, stepped, hits);
    }
    fm_buffer_destroy(room.rays);
    fm_buffer_destroy(room.hits);
    return status;
}
