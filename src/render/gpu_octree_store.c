// SPDX-License-Identifier: MIT
#include "render/octree_store.h"

#include "gpu/compute.h"
#include "gpu/flights.h"

#include <string.h>

enum { SPARE = 1 << 16 };  // bytes of an allocation that the driver may add

struct fm_octree_store {
    fm_context *context;
    fm_buffer *room;
    fm_flights tables;
    uint64_t table_bytes;
    bool told;  // there is a table
};

fm_result fm_octree_store_create(fm_context *context, uint64_t bytes, uint64_t parts, fm_octree_store **result) {
    fm_octree_store *store = fm_alloc_zero(&context->allocator, sizeof *store, "the parts of an octree");
    if (!store) {
        return FM_ERROR_OUT_OF_HOST_MEMORY;
    }
    store->context = context;
    store->table_bytes = parts * sizeof(fm_octree_part);
    const fm_result status = bytes > 0 ? fm_buffer_create(context->gpu, FM_PURPOSE_OCTREES, bytes, false, &store->room) : FM_OK;
    if (status != FM_OK) {
        fm_octree_store_destroy(store);
        return status;
    }
    *result = store;
    return FM_OK;
}

void fm_octree_store_destroy(fm_octree_store *store) {
    if (!store) {
        return;
    }
    fm_gpu *gpu = store->context->gpu;
    // A device that is lost has nothing in flight.
    (void)fm_gpu_wait(gpu, fm_gpu_newest(gpu));
    fm_flights_destroy(&store->tables);
    fm_buffer_destroy(store->room);
    fm_free(&store->context->allocator, store, sizeof *store);
}

uint64_t fm_octree_store_tables(uint64_t parts) {
    return FM_FLIGHTS * fm_round_up(parts * sizeof(fm_octree_part), 256);
}

uint64_t fm_octree_store_most(const fm_context *context) {
    const uint64_t most = context->device.max_allocation;
    return most > SPARE ? most - SPARE : 0;
}

fm_result fm_octree_store_put(fm_octree_store *store, uint64_t offset, uint8_t *image, uint64_t bytes, const fm_octree *numbers,
                              uint64_t *address) {
    const uint64_t base = fm_buffer_address(store->room) + offset;
    fm_octree_head head = fm_octree_host_head(numbers);
    fm_address *const addresses[] = {&head.words, &head.values, &head.attributes, &head.extra};
    for (size_t i = 0; i < sizeof addresses / sizeof *addresses; i++) {
        *addresses[i] = *addresses[i] ? base + (*addresses[i] - (uintptr_t)image) : 0;
    }
    memcpy(image, &head, sizeof head);
    FM_TRY(fm_buffer_upload_at(store->room, offset, image, bytes));
    *address = base;
    return FM_OK;
}

fm_result fm_octree_store_table(fm_octree_store *store, const fm_octree_part *rows, uint64_t *address) {
    fm_gpu *gpu = store->context->gpu;
    if (store->told) {
        fm_flights_sent(&store->tables, fm_gpu_newest(gpu));
    }
    fm_flight *flight;
    FM_TRY(fm_flights_take(&store->tables, gpu, FM_PURPOSE_UPLOAD, store->table_bytes, &flight));
    store->told = true;
    memcpy(fm_buffer_mapped(flight->buffer), rows, store->table_bytes);
    *address = fm_buffer_address(flight->buffer);
    return FM_OK;
}
