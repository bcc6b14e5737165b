// SPDX-License-Identifier: MIT
// An octree's memory on Vulkan: a copy of its arrays, and its head, which holds their addresses there.

#include "gpu/compute.h"
#include "octree/gpu_build.h"
#include "octree/octree.h"
#include "world/refs.h"

#include <string.h>

enum { WORDS, VALUES, ATTRIBUTES, EXTRA, ARRAYS };

struct fm_gpu_octree {
    fm_buffer *arrays[ARRAYS], *head;
    uint64_t room[ARRAYS];  // bytes
    uint64_t version;       // of what is there; 0: nothing
    fm_buffer *gathered;    // voxels on their way to the host
    uint64_t gathered_room;
};

static const fm_octree_array *array_of(const fm_octree *octree, int i) {
    return i == WORDS ? &octree->words : i == VALUES ? &octree->values : i == ATTRIBUTES ? &octree->attributes : &octree->extra;
}

// Elements [begin, end) of an array.
static fm_result send(const fm_octree_array *array, fm_buffer *buffer, uint64_t begin, uint64_t end) {
    const uint64_t from = begin * array->size, bytes = end > begin ? (end - begin) * array->size : 0;
    return bytes > 0 ? fm_buffer_upload_at(buffer, from, array->data + from, bytes) : FM_OK;
}

// `change`: what alone has to be sent; NULL: everything.
static fm_result upload(const fm_octree *octree, struct fm_gpu_octree *own, int i, const fm_octree_change *change) {
    const fm_octree_array *array = array_of(octree, i);
    const uint64_t bytes = array->count * array->size;
    if (bytes > own->room[i]) {
        // What has grown once is likely to grow again.
        const uint64_t room = own->room[i] > 0 ? fm_max_u64(bytes, own->room[i] + own->room[i] / 2) : bytes;
        fm_buffer_destroy(own->arrays[i]);
        own->arrays[i] = NULL;
        own->room[i] = 0;
        FM_TRY(fm_buffer_create(octree->context->gpu, FM_PURPOSE_OCTREES, room, false, &own->arrays[i]));
        own->room[i] = room;
        change = NULL;
    }
    if (!change) {
        return send(array, own->arrays[i], 0, array->count);
    }
    if (i == WORDS) {
        FM_TRY(send(array, own->arrays[i], change->low, change->high));
    }
    return send(array, own->arrays[i], change->kept[i], array->count);
}

static uint64_t address_of(const struct fm_gpu_octree *own, int i) {
    return own->arrays[i] ? fm_buffer_address(own->arrays[i]) : 0;
}

static fm_result send_head(const fm_octree *octree, struct fm_gpu_octree *own) {
    fm_octree_head head = fm_octree_host_head(octree);
    head.words = address_of(own, WORDS);
    head.values = address_of(own, VALUES);
    head.attributes = octree->attributes.count > 0 ? address_of(own, ATTRIBUTES) : 0;
    head.extra = address_of(own, EXTRA);
    if (!own->head) {
        FM_TRY(fm_buffer_create(octree->context->gpu, FM_PURPOSE_OCTREES, sizeof head, false, &own->head));
    }
    return fm_buffer_upload_at(own->head, 0, &head, sizeof head);
}

static fm_result bring(const fm_octree *octree, struct fm_gpu_octree *own, uint64_t there) {
    const fm_octree_change *known = &octree->change;
    const bool part = there != 0 && known->until == octree->version && known->since <= there;
    fm_gpu *gpu = octree->context->gpu;
    // Buffers that grow are given back, which pictures in flight may read.
    FM_TRY(fm_gpu_wait(gpu, fm_gpu_newest(gpu)));
    for (int i = 0; i < ARRAYS; i++) {
        FM_TRY(upload(octree, own, i, part ? known : NULL));
    }
    return send_head(octree, own);
}

static fm_result begin(fm_octree *octree) {
    if (!octree->gpu) {
        octree->gpu = fm_alloc_zero(&octree->context->allocator, sizeof *octree->gpu, "an octree on the device");
    }
    return octree->gpu ? FM_OK : FM_ERROR_OUT_OF_HOST_MEMORY;
}

fm_result fm_gpu_octree_head(fm_octree *octree, uint64_t *address) {
    FM_TRY(begin(octree));
    struct fm_gpu_octree *own = octree->gpu;
    if (own->version != octree->version) {
        const uint64_t there = own->version;
        own->version = 0;
        FM_TRY(bring(octree, own, there));
        own->version = octree->version;
        octree->change = (fm_octree_change){0};
    }
    *address = fm_buffer_address(own->head);
    return FM_OK;
}

fm_result fm_gpu_octree_adopt(fm_octree *octree, fm_buffer **arrays) {
    FM_TRY(begin(octree));
    struct fm_gpu_octree *own = octree->gpu;
    for (int i = WORDS; i <= ATTRIBUTES; i++) {
        own->room[i] = array_of(octree, i)->count * array_of(octree, i)->size;
        own->arrays[i] = arrays[i];
        arrays[i] = NULL;
    }
    FM_TRY(send_head(octree, own));
    own->version = octree->version;
    return FM_OK;
}

// Room for `bytes` that the device writes for the host.
static fm_result gathering_room(fm_octree *octree, uint64_t bytes) {
    FM_TRY(begin(octree));
    struct fm_gpu_octree *own = octree->gpu;
    if (bytes <= own->gathered_room) {
        return FM_OK;
    }
    fm_buffer_destroy(own->gathered);
    own->gathered = NULL;
    own->gathered_room = 0;
    FM_TRY(fm_buffer_create(octree->context->gpu, FM_PURPOSE_READBACK, bytes, false, &own->gathered));
    own->gathered_room = bytes;
    return FM_OK;
}

fm_result fm_gpu_octree_gather(fm_octree *octree, const fm_world *world, const fm_box *box, uint32_t *voxels) {
    enum { THREADS = 64 };
    fm_gpu *gpu = octree->context->gpu;
    fm_world_desc about;
    fm_world_info(world, &about);
    fm_octree_gather_push push = {.row = about.shape.x, .slice = (uint64_t)about.shape.x * about.shape.y};
    push.width = (uint32_t)(box->end[0] - box->begin[0]);
    push.rows = (uint32_t)(box->end[1] - box->begin[1]);
    push.slices = (uint32_t)(box->end[2] - box->begin[2]);
    const uint64_t count = (uint64_t)push.width * push.rows * push.slices, bytes = count * sizeof *voxels;
    const uint64_t first = (uint64_t)box->begin[0] + push.row * (uint64_t)box->begin[1] + push.slice * (uint64_t)box->begin[2];
    FM_TRY(gathering_room(octree, bytes));
    push.source = fm_gpu_world_refs(world).voxels + first * sizeof *voxels;
    push.target = fm_buffer_address(octree->gpu->gathered);
    const fm_dispatch dispatch = {
        .kernel = FM_KERNEL_OCTREE_GATHER, .push = &push, .push_bytes = sizeof push, .groups = fm_div_up(count, THREADS)};
    fm_slot *slot;
    FM_TRY(fm_commands_begin(gpu, &slot));
    FM_TRY(fm_commands_dispatch(gpu, slot, &dispatch));
    fm_commands_pass(gpu, slot, "gather", 2 * bytes);
    FM_TRY(fm_commands_submit(gpu, slot, NULL));
    memcpy(voxels, fm_buffer_mapped(octree->gpu->gathered), bytes);
    return FM_OK;
}

void fm_gpu_octree_destroy(fm_octree *octree) {
    struct fm_gpu_octree *own = octree->gpu;
    if (!own) {
        return;
    }
    fm_gpu *gpu = octree->context->gpu;
    // A device that is lost has nothing in flight.
    (void)fm_gpu_wait(gpu, fm_gpu_newest(gpu));
    for (int i = 0; i < ARRAYS; i++) {
        fm_buffer_destroy(own->arrays[i]);
    }
    fm_buffer_destroy(own->head);
    fm_buffer_destroy(own->gathered);
    fm_free(&octree->context->allocator, own, sizeof *own);
    octree->gpu = NULL;
}
