// SPDX-License-Identifier: MIT
#include "present.h"

#include "panel/gui.h"

static bool open_frame(present_frame *f, const gpu *g) {
    const VkCommandPoolCreateInfo pool = {.sType = VK_STRUCTURE_TYPE_COMMAND_POOL_CREATE_INFO,
                                          .flags = VK_COMMAND_POOL_CREATE_TRANSIENT_BIT,
                                          .queueFamilyIndex = g->family};
    if (!GPU_GOOD(vkCreateCommandPool(g->device, &pool, NULL, &f->pool))) {
        return false;
    }
    const VkCommandBufferAllocateInfo commands = {.sType = VK_STRUCTURE_TYPE_COMMAND_BUFFER_ALLOCATE_INFO,
                                                  .commandPool = f->pool,
                                                  .level = VK_COMMAND_BUFFER_LEVEL_PRIMARY,
                                                  .commandBufferCount = 1};
    const VkSemaphoreCreateInfo semaphore = {.sType = VK_STRUCTURE_TYPE_SEMAPHORE_CREATE_INFO};
    const VkFenceCreateInfo fence = {.sType = VK_STRUCTURE_TYPE_FENCE_CREATE_INFO, .flags = VK_FENCE_CREATE_SIGNALED_BIT};
    return GPU_GOOD(vkAllocateCommandBuffers(g->device, &commands, &f->commands)) &&
           GPU_GOOD(vkCreateSemaphore(g->device, &semaphore, NULL, &f->acquired)) &&
           GPU_GOOD(vkCreateFence(g->device, &fence, NULL, &f->done));
}

static void free_staging(present_frame *f, const gpu *g) {
    vkDestroyBuffer(g->device, f->staging, NULL);
    vkFreeMemory(g->device, f->staging_memory, NULL);
    f->staging = VK_NULL_HANDLE;
    f->staging_memory = VK_NULL_HANDLE;
    f->staging_bytes = 0;
}

static void close_frame(present_frame *f, const gpu *g) {
    free_staging(f, g);
    vkDestroyFence(g->device, f->done, NULL);
    vkDestroySemaphore(g->device, f->acquired, NULL);
    vkDestroyCommandPool(g->device, f->pool, NULL);
}

bool present_open(present *p, const gpu *g, GLFWwindow *window) {
    *p = (present){.gpu = g, .window = window, .stale = true, .vsync = true};
    bool good = swapchain_open(&p->chain, g);
    for (int i = 0; good && i < PRESENT_FRAMES; i++) {
        good = open_frame(&p->frames[i], g);
    }
    return good;
}

static void free_canvas(present *p) {
    vkDestroyImage(p->gpu->device, p->canvas, NULL);
    vkFreeMemory(p->gpu->device, p->canvas_memory, NULL);
    p->canvas = VK_NULL_HANDLE;
    p->canvas_memory = VK_NULL_HANDLE;
    p->width = p->height = 0;
}

void present_close(present *p) {
    const gpu *g = p->gpu;
    if (!g || !g->device) {
        return;
    }
    // Presentation is no part of what fences tell.
    vkDeviceWaitIdle(g->device);
    for (int i = 0; i < PRESENT_FRAMES; i++) {
        close_frame(&p->frames[i], g);
    }
    free_canvas(p);
    swapchain_close(&p->chain, g);
}

bool present_idle(present *p) {
    VkFence fences[PRESENT_FRAMES];
    for (int i = 0; i < PRESENT_FRAMES; i++) {
        fences[i] = p->frames[i].done;
    }
    return GPU_GOOD(vkWaitForFences(p->gpu->device, PRESENT_FRAMES, fences, VK_TRUE, UINT64_MAX));
}

bool present_quiet(present *p) {
    return GPU_GOOD(vkQueueWaitIdle(p->gpu->queue));
}

static bool fit(present *p) {
    p->stale = false;
    return present_quiet(p) && swapchain_fit(&p->chain, p->gpu, p->window, p->vsync);
}

bool present_wait(present *p) {
    return GPU_GOOD(vkWaitForFences(p->gpu->device, 1, &p->frames[p->current].done, VK_TRUE, UINT64_MAX));
}

present_state present_begin(present *p, bool vsync) {
    present_frame *f = &p->frames[p->current];
    p->stale = p->stale || vsync != p->vsync || !p->chain.chain;
    p->vsync = vsync;
    // Once more when the window changes between the two calls; else the next frame sees to it.
    for (int i = 0; i < 2; i++) {
        if (p->stale && !fit(p)) {
            return PRESENT_FAILED;
        }
        if (!p->chain.chain) {
            return PRESENT_HIDDEN;
        }
        const VkResult result =
            vkAcquireNextImageKHR(p->gpu->device, p->chain.chain, UINT64_MAX, f->acquired, VK_NULL_HANDLE, &p->image);
        if (result == VK_SUCCESS || result == VK_SUBOPTIMAL_KHR) {
            p->stale = result == VK_SUBOPTIMAL_KHR;
            return PRESENT_READY;
        }
        if (result != VK_ERROR_OUT_OF_DATE_KHR) {
            gpu_good(result, "vkAcquireNextImageKHR");
            return PRESENT_FAILED;
        }
        p->stale = true;
    }
    return PRESENT_HIDDEN;
}

void *present_staging(present *p, uint32_t width, uint32_t height) {
    const gpu *g = p->gpu;
    present_frame *f = &p->frames[p->current];
    const uint64_t bytes = (uint64_t)width * height * 4;
    if (f->staging_bytes >= bytes) {
        return f->mapped;
    }
    free_staging(f, g);
    const VkBufferCreateInfo info = {
        .sType = VK_STRUCTURE_TYPE_BUFFER_CREATE_INFO, .size = bytes, .usage = VK_BUFFER_USAGE_TRANSFER_SRC_BIT};
    if (!GPU_GOOD(vkCreateBuffer(g->device, &info, NULL, &f->staging))) {
        return NULL;
    }
    VkMemoryRequirements needs;
    vkGetBufferMemoryRequirements(g->device, f->staging, &needs);
    if (!gpu_allocate(g, &needs, VK_MEMORY_PROPERTY_HOST_VISIBLE_BIT | VK_MEMORY_PROPERTY_HOST_COHERENT_BIT, &f->staging_memory) ||
        !GPU_GOOD(vkBindBufferMemory(g->device, f->staging, f->staging_memory, 0)) ||
        !GPU_GOOD(vkMapMemory(g->device, f->staging_memory, 0, VK_WHOLE_SIZE, 0, &f->mapped))) {
        return NULL;
    }
    f->staging_bytes = bytes;
    return f->mapped;
}

static bool fit_canvas(present *p, uint32_t width, uint32_t height) {
    const gpu *g = p->gpu;
    if (p->width == width && p->height == height) {
        return true;
    }
    if (!present_quiet(p)) {
        return false;
    }
    free_canvas(p);
    const VkImageCreateInfo info = {.sType = VK_STRUCTURE_TYPE_IMAGE_CREATE_INFO,
                                    .imageType = VK_IMAGE_TYPE_2D,
                                    .format = VK_FORMAT_R8G8B8A8_UNORM,
                                    .extent = {width, height, 1},
                                    .mipLevels = 1,
                                    .arrayLayers = 1,
                                    .samples = VK_SAMPLE_COUNT_1_BIT,
                                    .usage = VK_IMAGE_USAGE_TRANSFER_SRC_BIT | VK_IMAGE_USAGE_TRANSFER_DST_BIT};
    if (!GPU_GOOD(vkCreateImage(g->device, &info, NULL, &p->canvas))) {
        return false;
    }
    VkMemoryRequirements needs;
    vkGetImageMemoryRequirements(g->device, p->canvas, &needs);
    if (!gpu_allocate(g, &needs, VK_MEMORY_PROPERTY_DEVICE_LOCAL_BIT, &p->canvas_memory) ||
        !GPU_GOOD(vkBindImageMemory(g->device, p->canvas, p->canvas_memory, 0))) {
        return false;
    }
    p->width = width;
    p->height = height;
    return true;
}

static VkImageMemoryBarrier2 image_barrier(VkImage image, VkImageLayout from, VkImageLayout to, VkAccessFlags2 written,
                                           VkAccessFlags2 next) {
    return (VkImageMemoryBarrier2){.sType = VK_STRUCTURE_TYPE_IMAGE_MEMORY_BARRIER_2,
                                   .srcStageMask = VK_PIPELINE_STAGE_2_ALL_TRANSFER_BIT,
                                   .srcAccessMask = written,
                                   .dstStageMask = VK_PIPELINE_STAGE_2_ALL_TRANSFER_BIT,
                                   .dstAccessMask = next,
                                   .oldLayout = from,
                                   .newLayout = to,
                                   .srcQueueFamilyIndex = VK_QUEUE_FAMILY_IGNORED,
                                   .dstQueueFamilyIndex = VK_QUEUE_FAMILY_IGNORED,
                                   .image = image,
                                   .subresourceRange = {VK_IMAGE_ASPECT_COLOR_BIT, 0, 1, 0, 1}};
}

static void record_barriers(VkCommandBuffer commands, uint32_t count, const VkImageMemoryBarrier2 *barriers) {
    const VkDependencyInfo info = {
        .sType = VK_STRUCTURE_TYPE_DEPENDENCY_INFO, .imageMemoryBarrierCount = count, .pImageMemoryBarriers = barriers};
    vkCmdPipelineBarrier2(commands, &info);
}

static void record_copy(const present *p, VkCommandBuffer commands, const present_picture *picture) {
    const VkImage target = p->chain.images[p->image];
    const VkImageMemoryBarrier2 before[] = {
        image_barrier(p->canvas, VK_IMAGE_LAYOUT_UNDEFINED, VK_IMAGE_LAYOUT_TRANSFER_DST_OPTIMAL, 0,
                      VK_ACCESS_2_TRANSFER_WRITE_BIT),
        image_barrier(target, VK_IMAGE_LAYOUT_UNDEFINED, VK_IMAGE_LAYOUT_TRANSFER_DST_OPTIMAL, 0, VK_ACCESS_2_TRANSFER_WRITE_BIT),
    };
    record_barriers(commands, 2, before);
    if (!picture->buffer) {
        const VkClearColorValue grey = {.float32 = {0.1f, 0.1f, 0.1f, 1}};
        vkCmdClearColorImage(commands, target, VK_IMAGE_LAYOUT_TRANSFER_DST_OPTIMAL, &grey, 1, &before[1].subresourceRange);
        return;
    }
    const VkImageSubresourceLayers color = {VK_IMAGE_ASPECT_COLOR_BIT, 0, 0, 1};
    const VkBufferImageCopy region = {
        .bufferOffset = picture->offset, .imageSubresource = color, .imageExtent = {picture->width, picture->height, 1}};
    vkCmdCopyBufferToImage(commands, picture->buffer, p->canvas, VK_IMAGE_LAYOUT_TRANSFER_DST_OPTIMAL, 1, &region);
    const VkImageMemoryBarrier2 between =
        image_barrier(p->canvas, VK_IMAGE_LAYOUT_TRANSFER_DST_OPTIMAL, VK_IMAGE_LAYOUT_TRANSFER_SRC_OPTIMAL,
                      VK_ACCESS_2_TRANSFER_WRITE_BIT, VK_ACCESS_2_TRANSFER_READ_BIT);
    record_barriers(commands, 1, &between);
    const VkExtent2D extent = p->chain.extent;
    const VkImageBlit blit = {.srcSubresource = color,
                              .srcOffsets = {{0, 0, 0}, {(int32_t)picture->width, (int32_t)picture->height, 1}},
                              .dstSubresource = color,
                              .dstOffsets = {{0, 0, 0}, {(int32_t)extent.width, (int32_t)extent.height, 1}}};
    vkCmdBlitImage(commands, p->canvas, VK_IMAGE_LAYOUT_TRANSFER_SRC_OPTIMAL, target, VK_IMAGE_LAYOUT_TRANSFER_DST_OPTIMAL, 1,
                   &blit, VK_FILTER_LINEAR);
}

static void record_panel(const present *p, VkCommandBuffer commands) {
    const VkRenderPassBeginInfo pass = {.sType = VK_STRUCTURE_TYPE_RENDER_PASS_BEGIN_INFO,
                                        .renderPass = p->chain.pass,
                                        .framebuffer = p->chain.framebuffers[p->image],
                                        .renderArea = {{0, 0}, p->chain.extent}};
    vkCmdBeginRenderPass(commands, &pass, VK_SUBPASS_CONTENTS_INLINE);
    gui_draw(commands);
    vkCmdEndRenderPass(commands);
    // The next picture is written to the buffer that this frame has read.
    const VkMemoryBarrier2 release = {.sType = VK_STRUCTURE_TYPE_MEMORY_BARRIER_2,
                                      .srcStageMask = VK_PIPELINE_STAGE_2_ALL_TRANSFER_BIT,
                                      .dstStageMask =
                                          VK_PIPELINE_STAGE_2_COMPUTE_SHADER_BIT | VK_PIPELINE_STAGE_2_ALL_TRANSFER_BIT};
    const VkDependencyInfo info = {
        .sType = VK_STRUCTURE_TYPE_DEPENDENCY_INFO, .memoryBarrierCount = 1, .pMemoryBarriers = &release};
    vkCmdPipelineBarrier2(commands, &info);
}

static bool submit(present *p, const present_picture *picture) {
    present_frame *f = &p->frames[p->current];
    const VkSemaphoreSubmitInfo waits[] = {{.sType = VK_STRUCTURE_TYPE_SEMAPHORE_SUBMIT_INFO,
                                            .semaphore = f->acquired,
                                            .stageMask = VK_PIPELINE_STAGE_2_ALL_TRANSFER_BIT},
                                           {.sType = VK_STRUCTURE_TYPE_SEMAPHORE_SUBMIT_INFO,
                                            .semaphore = picture->timeline,
                                            .value = picture->ticket,
                                            .stageMask = VK_PIPELINE_STAGE_2_ALL_TRANSFER_BIT}};
    const VkSemaphoreSubmitInfo drawn = {.sType = VK_STRUCTURE_TYPE_SEMAPHORE_SUBMIT_INFO,
                                         .semaphore = p->chain.drawn[p->image],
                                         .stageMask = VK_PIPELINE_STAGE_2_ALL_COMMANDS_BIT};
    const VkCommandBufferSubmitInfo commands = {.sType = VK_STRUCTURE_TYPE_COMMAND_BUFFER_SUBMIT_INFO,
                                                .commandBuffer = f->commands};
    const VkSubmitInfo2 info = {.sType = VK_STRUCTURE_TYPE_SUBMIT_INFO_2,
                                .waitSemaphoreInfoCount = picture->timeline ? 2 : 1,
                                .pWaitSemaphoreInfos = waits,
                                .commandBufferInfoCount = 1,
                                .pCommandBufferInfos = &commands,
                                .signalSemaphoreInfoCount = 1,
                                .pSignalSemaphoreInfos = &drawn};
    return GPU_GOOD(vkResetFences(p->gpu->device, 1, &f->done)) && GPU_GOOD(vkQueueSubmit2(p->gpu->queue, 1, &info, f->done));
}

bool present_end(present *p, const present_picture *picture) {
    present_frame *f = &p->frames[p->current];
    const VkCommandBufferBeginInfo begin = {.sType = VK_STRUCTURE_TYPE_COMMAND_BUFFER_BEGIN_INFO,
                                            .flags = VK_COMMAND_BUFFER_USAGE_ONE_TIME_SUBMIT_BIT};
    if (!fit_canvas(p, picture->width, picture->height) || !GPU_GOOD(vkResetCommandPool(p->gpu->device, f->pool, 0)) ||
        !GPU_GOOD(vkBeginCommandBuffer(f->commands, &begin))) {
        return false;
    }
    record_copy(p, f->commands, picture);
    record_panel(p, f->commands);
    if (!GPU_GOOD(vkEndCommandBuffer(f->commands)) || !submit(p, picture)) {
        return false;
    }
    const VkPresentInfoKHR show = {.sType = VK_STRUCTURE_TYPE_PRESENT_INFO_KHR,
                                   .waitSemaphoreCount = 1,
                                   .pWaitSemaphores = &p->chain.drawn[p->image],
                                   .swapchainCount = 1,
                                   .pSwapchains = &p->chain.chain,
                                   .pImageIndices = &p->image};
    const VkResult result = vkQueuePresentKHR(p->gpu->queue, &show);
    p->current = (p->current + 1) % PRESENT_FRAMES;
    p->stale = p->stale || result == VK_SUBOPTIMAL_KHR || result == VK_ERROR_OUT_OF_DATE_KHR;
    return p->stale || gpu_good(result, "vkQueuePresentKHR");
}

bool present_once(present *p, bool (*record)(void *user, VkCommandBuffer commands), void *user) {
    present_frame *f = &p->frames[p->current];
    const VkCommandBufferBeginInfo begin = {.sType = VK_STRUCTURE_TYPE_COMMAND_BUFFER_BEGIN_INFO,
                                            .flags = VK_COMMAND_BUFFER_USAGE_ONE_TIME_SUBMIT_BIT};
    if (!GPU_GOOD(vkResetCommandPool(p->gpu->device, f->pool, 0)) || !GPU_GOOD(vkBeginCommandBuffer(f->commands, &begin)) ||
        !record(user, f->commands) || !GPU_GOOD(vkEndCommandBuffer(f->commands))) {
        return false;
    }
    const VkCommandBufferSubmitInfo commands = {.sType = VK_STRUCTURE_TYPE_COMMAND_BUFFER_SUBMIT_INFO,
                                                .commandBuffer = f->commands};
    const VkSubmitInfo2 info = {
        .sType = VK_STRUCTURE_TYPE_SUBMIT_INFO_2, .commandBufferInfoCount = 1, .pCommandBufferInfos = &commands};
    return GPU_GOOD(vkQueueSubmit2(p->gpu->queue, 1, &info, VK_NULL_HANDLE)) && GPU_GOOD(vkQueueWaitIdle(p->gpu->queue));
}
