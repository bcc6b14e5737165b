// SPDX-License-Identifier: MIT
// An octree's memory on Vulkan: a copy of its arrays, and its head, which holds their addresses there.

#include "gpu/compute.h"
#include "octree/octree.h"

enum { WORDS, VALUES, ATTRIBUTES, EXTRA, ARRAYS };

struct fm_gpu_octree {
    fm_buffer *arrays[ARRAYS], *head;
    uint64_t room[ARRAYS];  // bytes
    uint64_t version;       // of what is there; 0: nothing
};

static const fm_octree_array *array_of(const fm_octree *octree, int i) {
    return i == WORDS ? &octree->words : i == VALUES ? &octree->values : i == ATTRIBUTES ? &octree->attributes : &octree->extra;
}

static fm_result upload(const fm_octree *octree, struct fm_gpu_octree *own, int i) {
    const fm_octree_array *array = array_of(octree, i);
    const uint64_t bytes = array->count * array->size;
    if (bytes > own->room[i]) {
        fm_buffer_destroy(own->arrays[i]);
        own->arrays[i] = NULL;
        own->room[i] = 0;
        FM_TRY(fm_buffer_create(octree->context->gpu, FM_PURPOSE_OCTREES, bytes, false, &own->arrays[i]));
        own->room[i] = bytes;
    }
    return bytes > 0 ? fm_buffer_upload_at(own->arrays[i], 0, array->data, bytes) : FM_OK;
}

static uint64_t address_of(const struct fm_gpu_octree *own, int i) {
    return own->arrays[i] ? fm_buffer_address(own->arrays[i]) : 0;
}

static fm_result bring(const fm_octree *octree, struct fm_gpu_octree *own) {
    fm_gpu *gpu = octree->context->gpu;
    // Buffers that grow are given back, which pictures in flight may read.
    FM_TRY(fm_gpu_wait(gpu, fm_gpu_newest(gpu)));
    for (int i = 0; i < ARRAYS; i++) {
        FM_TRY(upload(octree, own, i));
    }
    fm_octree_head head = fm_octree_host_head(octree);
    head.words = address_of(own, WORDS);
    head.values = address_of(own, VALUES);
    head.attributes = octree->attributes.count > 0 ? address_of(own, ATTRIBUTES) : 0;
    head.extra = address_of(own, EXTRA);
    if (!own->head) {
        FM_TRY(fm_buffer_create(gpu, FM_PURPOSE_OCTREES, sizeof head, false, &own->head));
    }
    return fm_buffer_upload_at(own->head, 0, &head, sizeof head);
}

fm_result fm_gpu_octree_head(fm_octree *octree, uint64_t *address) {
    fm_context *context = octree->context;
    if (!octree->gpu) {
        octree->gpu = fm_alloc_zero(&context->allocator, sizeof *octree->gpu, "an octree on the device");
        if (!octree->gpu) {
            return FM_ERROR_OUT_OF_HOST_MEMORY;
        }
    }
    struct fm_gpu_octree *own = octree->gpu;
    if (own->version != octree->version) {
        own->version = 0;
        FM_TRY(bring(octree, own));
        own->version = octree->version;
    }
    *address = fm_buffer_address(own->head);
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
    fm_free(&octree->context->allocator, own, sizeof *own);
    octree->gpu = NULL;
}
