// SPDX-License-Identifier: MIT
// Composing on Vulkan: one dispatch. The objects' table and the list of blocks go through an upload buffer.

#include "gpu/compute.h"
#include "gpu/flights.h"
#include "mesh/compose.h"

#include <string.h>

struct fm_gpu_composed {
    fm_flights flights;
};

void fm_gpu_compose_destroy(fm_composed *composed) {
    if (composed->gpu) {
        fm_flights_destroy(&composed->gpu->flights);
        fm_free(&composed->context->allocator, composed->gpu, sizeof *composed->gpu);
        composed->gpu = NULL;
    }
}

// Objects that reach no texel are left out.
static uint32_t write_objects(const fm_composed *composed, fm_compose_object *table) {
    uint32_t count = 0;
    for (uint64_t i = 0; i < composed->item_count; i++) {
        const fm_composed_item *item = &composed->items[i];
        fm_compose_object object = item->next;
        if (object.begin[0] < object.end[0] && object.begin[1] < object.end[1] && object.begin[2] < object.end[2]) {
            object.field = fm_buffer_address(item->local->volume->buffer);
            memcpy(&table[count++], &object, sizeof object);
        }
    }
    return count;
}

static fm_result record(const fm_composed *composed, const fm_compose_work *work, const fm_flight *flight, fm_slot *slot) {
    fm_gpu *gpu = composed->context->gpu;
    const fm_shape shape = composed->field->desc.shape;
    const uint64_t blocks_at = composed->item_count * sizeof(fm_compose_object);
    char *memory = fm_buffer_mapped(flight->buffer);
    fm_compose_push push = {.objects = fm_buffer_address(flight->buffer),
                            .field = fm_buffer_address(composed->field->buffer),
                            .shape = {(int)shape.x, (int)shape.y, (int)shape.z},
                            .object_count = write_objects(composed, (fm_compose_object *)(void *)memory),
                            .block_count = (uint32_t)work->count,
                            .band = composed->band};
    if (work->list) {
        memcpy(memory + blocks_at, work->list, work->count * sizeof *work->list);
        push.blocks = push.objects + blocks_at;
    }
    const fm_dispatch dispatch = {.kernel = FM_KERNEL_COMPOSE, .push = &push, .push_bytes = sizeof push, .groups = work->count};
    FM_TRY(fm_commands_dispatch(gpu, slot, &dispatch));
    fm_commands_pass(gpu, slot, "compose", work->count * (FM_COMPOSE_TEXELS + (work->list ? 1 : 0)) * UINT64_C(4));
    return FM_OK;
}

fm_result fm_gpu_compose(fm_composed *composed, const fm_compose_work *work, fm_ticket *ticket) {
    fm_gpu *gpu = composed->context->gpu;
    if (!composed->gpu) {
        composed->gpu = fm_alloc_zero(&composed->context->allocator, sizeof *composed->gpu, "a composed field on the device");
        if (!composed->gpu) {
            return FM_ERROR_OUT_OF_HOST_MEMORY;
        }
    }
    const uint64_t bytes = composed->item_count * sizeof(fm_compose_object) + (work->list ? work->count * sizeof *work->list : 0);
    fm_flight *flight;
    FM_TRY(fm_flights_take(&composed->gpu->flights, gpu, FM_PURPOSE_UPLOAD, fm_max_u64(bytes, 16), &flight));
    fm_slot *slot;
    FM_TRY(fm_commands_begin(gpu, &slot));
    FM_TRY(record(composed, work, flight, slot));
    FM_TRY(fm_commands_submit(gpu, slot, ticket));
    fm_flights_sent(&composed->gpu->flights, *ticket);
    return FM_OK;
}
