// SPDX-License-Identifier: MIT
// Recording, submission, tickets and the passes' timestamps.

#include "gpu/vk.h"

#include <assert.h>
#include <string.h>

enum { GROUPS_PER_AXIS = 65535 };  // what every device has

fm_result fm_commands_create(fm_gpu *gpu) {
    VkSemaphoreTypeCreateInfo type = {.sType = VK_STRUCTURE_TYPE_SEMAPHORE_TYPE_CREATE_INFO,
                                      .semaphoreType = VK_SEMAPHORE_TYPE_TIMELINE};
    VkSemaphoreCreateInfo semaphore = {.sType = VK_STRUCTURE_TYPE_SEMAPHORE_CREATE_INFO, .pNext = &type};
    FM_VK(gpu, CreateSemaphore(gpu->device, &semaphore, NULL, &gpu->timeline));
    for (uint32_t i = 0; i < FM_SLOTS; i++) {
        fm_slot *slot = &gpu->slots[i];
        VkCommandPoolCreateInfo pool = {.sType = VK_STRUCTURE_TYPE_COMMAND_POOL_CREATE_INFO,
                                        .flags = VK_COMMAND_POOL_CREATE_TRANSIENT_BIT,
                                        .queueFamilyIndex = gpu->queue_family};
        FM_VK(gpu, CreateCommandPool(gpu->device, &pool, NULL, &slot->pool));
        VkCommandBufferAllocateInfo buffer = {.sType = VK_STRUCTURE_TYPE_COMMAND_BUFFER_ALLOCATE_INFO,
                                              .commandPool = slot->pool,
                                              .level = VK_COMMAND_BUFFER_LEVEL_PRIMARY,
                                              .commandBufferCount = 1};
        FM_VK(gpu, AllocateCommandBuffers(gpu->device, &buffer, &slot->commands));
        VkQueryPoolCreateInfo queries = {.sType = VK_STRUCTURE_TYPE_QUERY_POOL_CREATE_INFO,
                                         .queryType = VK_QUERY_TYPE_TIMESTAMP,
                                         .queryCount = FM_MAX_PASSES + 1};
        FM_VK(gpu, CreateQueryPool(gpu->device, &queries, NULL, &slot->queries));
    }
    return FM_OK;
}

void fm_commands_destroy(fm_gpu *gpu) {
    for (uint32_t i = 0; i < FM_SLOTS; i++) {
        gpu->vk.DestroyQueryPool(gpu->device, gpu->slots[i].queries, NULL);
        gpu->vk.DestroyCommandPool(gpu->device, gpu->slots[i].pool, NULL);
    }
    gpu->vk.DestroySemaphore(gpu->device, gpu->timeline, NULL);
}

static void timestamp(fm_gpu *gpu, fm_slot *slot) {
    if (gpu->timestamp_mask == 0) {
        return;
    }
    gpu->vk.CmdWriteTimestamp2(slot->commands, VK_PIPELINE_STAGE_2_ALL_COMMANDS_BIT, slot->queries, slot->pass_count);
}

static void add_pass(uint32_t *count, fm_pass *passes, const fm_pass *pass) {
    uint32_t same = 0;
    while (same < *count && strcmp(passes[same].name, pass->name) != 0) {
        same++;
    }
    if (same < *count) {
        passes[same].milliseconds += pass->milliseconds;
        passes[same].bytes += pass->bytes;
    } else if (*count < FM_MAX_PASSES) {
        passes[(*count)++] = *pass;
    }
}

// The passes of a slot's operation, at most FM_MAX_PASSES, equal names added up. Waits for it.
static fm_result read_passes(fm_gpu *gpu, const fm_slot *slot, uint32_t *count, fm_pass *passes) {
    FM_TRY(fm_gpu_wait(gpu, slot->ticket));
    uint64_t times[FM_MAX_PASSES + 1] = {0};
    if (gpu->timestamp_mask != 0) {
        FM_VK(gpu, GetQueryPoolResults(gpu->device, slot->queries, 0, slot->pass_count + 1, sizeof times, times, sizeof times[0],
                                       VK_QUERY_RESULT_64_BIT | VK_QUERY_RESULT_WAIT_BIT));
    }
    *count = slot->earlier_count;
    memcpy(passes, slot->earlier, slot->earlier_count * sizeof *passes);
    for (uint32_t i = 0; i < slot->pass_count; i++) {
        fm_pass pass = slot->passes[i];
        pass.milliseconds = (double)((times[i + 1] - times[i]) & gpu->timestamp_mask) * gpu->info.timestamp_period_ns * 1e-6;
        add_pass(count, passes, &pass);
    }
    return FM_OK;
}

// Reads the times of the newest operation that has passes, whose slot may be wanted for other work.
static fm_result keep_passes(fm_gpu *gpu) {
    if (gpu->measured) {
        FM_TRY(read_passes(gpu, gpu->measured, &gpu->pass_count, gpu->passes));
        gpu->measured = NULL;
    }
    return FM_OK;
}

fm_result fm_commands_begin(fm_gpu *gpu, fm_slot **result) {
    fm_slot *slot = &gpu->slots[gpu->slot];
    FM_TRY(fm_gpu_wait(gpu, slot->ticket));
    if (gpu->measured == slot) {
        FM_TRY(keep_passes(gpu));
    }
    // Complete, and its times are gone.
    slot->ticket = 0;
    FM_VK(gpu, ResetCommandPool(gpu->device, slot->pool, 0));
    VkCommandBufferBeginInfo begin = {.sType = VK_STRUCTURE_TYPE_COMMAND_BUFFER_BEGIN_INFO,
                                      .flags = VK_COMMAND_BUFFER_USAGE_ONE_TIME_SUBMIT_BIT};
    FM_VK(gpu, BeginCommandBuffer(slot->commands, &begin));
    slot->pass_count = 0;
    slot->earlier_count = 0;
    gpu->vk.CmdResetQueryPool(slot->commands, slot->queries, 0, FM_MAX_PASSES + 1);
    // Work of earlier submissions must be visible; it is not so by their mere order.
    fm_commands_barrier(gpu, slot);
    timestamp(gpu, slot);
    *result = slot;
    return FM_OK;
}

void fm_commands_barrier(fm_gpu *gpu, fm_slot *slot) {
    VkMemoryBarrier2 barrier = {
        .sType = VK_STRUCTURE_TYPE_MEMORY_BARRIER_2,
        .srcStageMask = VK_PIPELINE_STAGE_2_COMPUTE_SHADER_BIT | VK_PIPELINE_STAGE_2_ALL_TRANSFER_BIT,
        .srcAccessMask = VK_ACCESS_2_SHADER_STORAGE_WRITE_BIT | VK_ACCESS_2_TRANSFER_WRITE_BIT,
        .dstStageMask =
            VK_PIPELINE_STAGE_2_COMPUTE_SHADER_BIT | VK_PIPELINE_STAGE_2_ALL_TRANSFER_BIT | VK_PIPELINE_STAGE_2_DRAW_INDIRECT_BIT,
        .dstAccessMask = VK_ACCESS_2_SHADER_STORAGE_READ_BIT | VK_ACCESS_2_SHADER_STORAGE_WRITE_BIT |
                         VK_ACCESS_2_TRANSFER_READ_BIT | VK_ACCESS_2_TRANSFER_WRITE_BIT | VK_ACCESS_2_INDIRECT_COMMAND_READ_BIT,
    };
    VkDependencyInfo dependency = {
        .sType = VK_STRUCTURE_TYPE_DEPENDENCY_INFO, .memoryBarrierCount = 1, .pMemoryBarriers = &barrier};
    gpu->vk.CmdPipelineBarrier2(slot->commands, &dependency);
}

void fm_commands_fill(fm_gpu *gpu, fm_slot *slot, fm_buffer *buffer, uint64_t offset, uint64_t bytes, uint32_t value) {
    assert(offset % 4 == 0 && bytes % 4 == 0);
    if (bytes > 0) {
        gpu->vk.CmdFillBuffer(slot->commands, buffer->buffer, offset, bytes, value);
    }
}

void fm_commands_copy(fm_gpu *gpu, fm_slot *slot, const fm_buffer *source, uint64_t source_offset, fm_buffer *target,
                      uint64_t target_offset, uint64_t bytes) {
    if (bytes > 0) {
        VkBufferCopy region = {source_offset, target_offset, bytes};
        gpu->vk.CmdCopyBuffer(slot->commands, source->buffer, target->buffer, 1, &region);
    }
}

void fm_commands_pass(fm_gpu *gpu, fm_slot *slot, const char *name, uint64_t bytes) {
    fm_commands_barrier(gpu, slot);
    if (slot->pass_count < FM_MAX_PASSES) {
        slot->passes[slot->pass_count++] = (fm_pass){.name = name, .bytes = bytes};
        timestamp(gpu, slot);
    }
}

fm_result fm_commands_dispatch(fm_gpu *gpu, fm_slot *slot, const fm_dispatch *dispatch) {
    uint64_t along_x = fm_min_u64(dispatch->groups, GROUPS_PER_AXIS);
    uint64_t along_y = fm_div_up(dispatch->groups, GROUPS_PER_AXIS);
    if (!dispatch->indirect && along_y > GROUPS_PER_AXIS) {
        return fm_fail(FM_ERROR_UNSUPPORTED, "the grid needs %llu work groups: a dispatch has at most 65535 x 65535",
                       (unsigned long long)dispatch->groups);
    }
    VkPipeline pipeline;
    FM_TRY(fm_pipeline_get(gpu, dispatch->kernel, dispatch->constants, dispatch->constant_count, &pipeline));
    gpu->vk.CmdBindPipeline(slot->commands, VK_PIPELINE_BIND_POINT_COMPUTE, pipeline);
    gpu->vk.CmdPushConstants(slot->commands, gpu->layout, VK_SHADER_STAGE_COMPUTE_BIT, 0, dispatch->push_bytes, dispatch->push);
    if (dispatch->indirect) {
        gpu->vk.CmdDispatchIndirect(slot->commands, dispatch->indirect->buffer, dispatch->indirect_offset);
    } else {
        gpu->vk.CmdDispatch(slot->commands, (uint32_t)along_x, (uint32_t)along_y, 1);
    }
    return FM_OK;
}

fm_result fm_commands_submit(fm_gpu *gpu, fm_slot *slot, fm_ticket *ticket) {
    // The host reads mapped memory after a wait.
    VkMemoryBarrier2 to_host = {.sType = VK_STRUCTURE_TYPE_MEMORY_BARRIER_2,
                                .srcStageMask = VK_PIPELINE_STAGE_2_COMPUTE_SHADER_BIT | VK_PIPELINE_STAGE_2_ALL_TRANSFER_BIT,
                                .srcAccessMask = VK_ACCESS_2_SHADER_STORAGE_WRITE_BIT | VK_ACCESS_2_TRANSFER_WRITE_BIT,
                                .dstStageMask = VK_PIPELINE_STAGE_2_HOST_BIT,
                                .dstAccessMask = VK_ACCESS_2_HOST_READ_BIT};
    VkDependencyInfo dependency = {
        .sType = VK_STRUCTURE_TYPE_DEPENDENCY_INFO, .memoryBarrierCount = 1, .pMemoryBarriers = &to_host};
    gpu->vk.CmdPipelineBarrier2(slot->commands, &dependency);
    FM_VK(gpu, EndCommandBuffer(slot->commands));
    VkCommandBufferSubmitInfo commands = {.sType = VK_STRUCTURE_TYPE_COMMAND_BUFFER_SUBMIT_INFO, .commandBuffer = slot->commands};
    VkSemaphoreSubmitInfo signal = {.sType = VK_STRUCTURE_TYPE_SEMAPHORE_SUBMIT_INFO,
                                    .semaphore = gpu->timeline,
                                    .value = gpu->newest + 1,
                                    .stageMask = VK_PIPELINE_STAGE_2_ALL_COMMANDS_BIT};
    VkSubmitInfo2 submit = {.sType = VK_STRUCTURE_TYPE_SUBMIT_INFO_2,
                            .commandBufferInfoCount = 1,
                            .pCommandBufferInfos = &commands,
                            .signalSemaphoreInfoCount = 1,
                            .pSignalSemaphoreInfos = &signal};
    FM_VK(gpu, QueueSubmit2(gpu->queue, 1, &submit, VK_NULL_HANDLE));
    slot->ticket = ++gpu->newest;
    if (slot->earlier_count + slot->pass_count > 0) {
        gpu->measured = slot;
    }
    gpu->slot = (gpu->slot + 1) % FM_SLOTS;
    if (!ticket) {
        return fm_gpu_wait(gpu, slot->ticket);
    }
    *ticket = slot->ticket;
    return FM_OK;
}

fm_result fm_commands_flush(fm_gpu *gpu, fm_slot **slot) {
    const bool continued = (*slot)->earlier_count + (*slot)->pass_count > 0;
    FM_TRY(fm_commands_submit(gpu, *slot, NULL));
    FM_TRY(keep_passes(gpu));
    FM_TRY(fm_commands_begin(gpu, slot));
    if (continued) {
        (*slot)->earlier_count = gpu->pass_count;
        memcpy((*slot)->earlier, gpu->passes, gpu->pass_count * sizeof *gpu->passes);
    }
    return FM_OK;
}

static fm_result check_ticket(const fm_gpu *gpu, fm_ticket ticket) {
    if (gpu->lost) {
        return fm_fail(FM_ERROR_DEVICE_LOST, "the device \"%s\" was lost: make a new context", gpu->info.name);
    }
    if (ticket > gpu->newest) {
        return fm_fail(FM_ERROR_INVALID_ARGUMENT, "ticket is %llu: the newest one given out is %llu", (unsigned long long)ticket,
                       (unsigned long long)gpu->newest);
    }
    return FM_OK;
}

fm_ticket fm_gpu_newest(const fm_gpu *gpu) {
    return gpu->newest;
}

fm_result fm_gpu_wait(fm_gpu *gpu, fm_ticket ticket) {
    FM_TRY(check_ticket(gpu, ticket));
    VkSemaphoreWaitInfo wait = {
        .sType = VK_STRUCTURE_TYPE_SEMAPHORE_WAIT_INFO, .semaphoreCount = 1, .pSemaphores = &gpu->timeline, .pValues = &ticket};
    FM_VK(gpu, WaitSemaphores(gpu->device, &wait, UINT64_MAX));
    return FM_OK;
}

fm_result fm_gpu_poll(fm_gpu *gpu, fm_ticket ticket, bool *complete) {
    FM_TRY(check_ticket(gpu, ticket));
    uint64_t value;
    FM_VK(gpu, GetSemaphoreCounterValue(gpu->device, gpu->timeline, &value));
    *complete = value >= ticket;
    return FM_OK;
}

static void list_passes(uint32_t available, const fm_pass *from, uint32_t *count, fm_pass *passes) {
    const uint32_t copied = fm_listing(count, available, passes != NULL);
    for (uint32_t i = 0; i < copied; i++) {
        passes[i] = from[i];
    }
}

fm_result fm_gpu_passes(fm_gpu *gpu, uint32_t *count, fm_pass *passes) {
    FM_TRY(keep_passes(gpu));
    list_passes(gpu->pass_count, gpu->passes, count, passes);
    return FM_OK;
}

fm_result fm_gpu_ticket_passes(fm_gpu *gpu, fm_ticket ticket, uint32_t *count, fm_pass *passes) {
    FM_TRY(check_ticket(gpu, ticket));
    fm_pass found[FM_MAX_PASSES];
    uint32_t found_count = 0;
    for (uint32_t i = 0; i < FM_SLOTS && ticket != 0; i++) {
        if (gpu->slots[i].ticket == ticket) {
            FM_TRY(read_passes(gpu, &gpu->slots[i], &found_count, found));
        }
    }
    list_passes(found_count, found, count, passes);
    return FM_OK;
}
