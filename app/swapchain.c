// SPDX-License-Identifier: MIT
#include "swapchain.h"

#include <stdio.h>
#include <string.h>

enum { MAX_FORMATS = 64, MAX_MODES = 16 };

// The picture is sRGB already: a format that converts would do it twice.
static bool choose_format(swapchain *s, const gpu *g) {
    VkSurfaceFormatKHR formats[MAX_FORMATS];
    uint32_t count = MAX_FORMATS;
    if (vkGetPhysicalDeviceSurfaceFormatsKHR(g->physical, g->surface, &count, formats) < 0) {
        return false;
    }
    for (uint32_t i = 0; i < count; i++) {
        VkFormatProperties properties;
        vkGetPhysicalDeviceFormatProperties(g->physical, formats[i].format, &properties);
        if ((formats[i].format == VK_FORMAT_B8G8R8A8_UNORM || formats[i].format == VK_FORMAT_R8G8B8A8_UNORM) &&
            (properties.optimalTilingFeatures & VK_FORMAT_FEATURE_BLIT_DST_BIT)) {
            s->format = formats[i];
            return true;
        }
    }
    fprintf(stderr, "fathom: the window offers no 8-bit RGBA format that can be copied to\n");
    return false;
}

static bool make_pass(swapchain *s, const gpu *g) {
    const VkAttachmentDescription attachment = {.format = s->format.format,
                                                .samples = VK_SAMPLE_COUNT_1_BIT,
                                                .loadOp = VK_ATTACHMENT_LOAD_OP_LOAD,
                                                .storeOp = VK_ATTACHMENT_STORE_OP_STORE,
                                                .stencilLoadOp = VK_ATTACHMENT_LOAD_OP_DONT_CARE,
                                                .stencilStoreOp = VK_ATTACHMENT_STORE_OP_DONT_CARE,
                                                .initialLayout = VK_IMAGE_LAYOUT_TRANSFER_DST_OPTIMAL,
                                                .finalLayout = VK_IMAGE_LAYOUT_PRESENT_SRC_KHR};
    const VkAttachmentReference color = {0, VK_IMAGE_LAYOUT_COLOR_ATTACHMENT_OPTIMAL};
    const VkSubpassDescription subpass = {
        .pipelineBindPoint = VK_PIPELINE_BIND_POINT_GRAPHICS, .colorAttachmentCount = 1, .pColorAttachments = &color};
    const VkSubpassDependency after_copy = {.srcSubpass = VK_SUBPASS_EXTERNAL,
                                            .dstSubpass = 0,
                                            .srcStageMask = VK_PIPELINE_STAGE_TRANSFER_BIT,
                                            .dstStageMask = VK_PIPELINE_STAGE_COLOR_ATTACHMENT_OUTPUT_BIT,
                                            .srcAccessMask = VK_ACCESS_TRANSFER_WRITE_BIT,
                                            .dstAccessMask =
                                                VK_ACCESS_COLOR_ATTACHMENT_READ_BIT | VK_ACCESS_COLOR_ATTACHMENT_WRITE_BIT};
    const VkRenderPassCreateInfo info = {.sType = VK_STRUCTURE_TYPE_RENDER_PASS_CREATE_INFO,
                                         .attachmentCount = 1,
                                         .pAttachments = &attachment,
                                         .subpassCount = 1,
                                         .pSubpasses = &subpass,
                                         .dependencyCount = 1,
                                         .pDependencies = &after_copy};
    return GPU_GOOD(vkCreateRenderPass(g->device, &info, NULL, &s->pass));
}

bool swapchain_open(swapchain *s, const gpu *g) {
    *s = (swapchain){0};
    return choose_format(s, g) && make_pass(s, g);
}

static void free_images(swapchain *s, const gpu *g) {
    for (uint32_t i = 0; i < s->count; i++) {
        vkDestroySemaphore(g->device, s->drawn[i], NULL);
        vkDestroyFramebuffer(g->device, s->framebuffers[i], NULL);
        vkDestroyImageView(g->device, s->views[i], NULL);
    }
    memset(s->drawn, 0, sizeof s->drawn);
    memset(s->framebuffers, 0, sizeof s->framebuffers);
    memset(s->views, 0, sizeof s->views);
    s->count = 0;
}

void swapchain_close(swapchain *s, const gpu *g) {
    if (g->device) {
        free_images(s, g);
        vkDestroySwapchainKHR(g->device, s->chain, NULL);
        vkDestroyRenderPass(g->device, s->pass, NULL);
    }
}

static VkPresentModeKHR choose_mode(const gpu *g, bool vsync) {
    VkPresentModeKHR modes[MAX_MODES];
    uint32_t count = MAX_MODES;
    VkPresentModeKHR best = VK_PRESENT_MODE_FIFO_KHR;
    if (vsync || vkGetPhysicalDeviceSurfacePresentModesKHR(g->physical, g->surface, &count, modes) < 0) {
        return best;
    }
    for (uint32_t i = 0; i < count; i++) {
        if (modes[i] == VK_PRESENT_MODE_MAILBOX_KHR) {
            return modes[i];
        }
        best = modes[i] == VK_PRESENT_MODE_IMMEDIATE_KHR ? modes[i] : best;
    }
    return best;
}

static VkExtent2D choose_extent(const VkSurfaceCapabilitiesKHR *surface, GLFWwindow *window) {
    if (surface->currentExtent.width != UINT32_MAX) {
        return surface->currentExtent;
    }
    int width, height;
    glfwGetFramebufferSize(window, &width, &height);
    VkExtent2D extent = {(uint32_t)width, (uint32_t)height};
    const VkExtent2D least = surface->minImageExtent, most = surface->maxImageExtent;
    extent.width = extent.width < least.width ? least.width : extent.width > most.width ? most.width : extent.width;
    extent.height = extent.height < least.height ? least.height : extent.height > most.height ? most.height : extent.height;
    return width && height ? extent : (VkExtent2D){0, 0};
}

static bool make_image(swapchain *s, const gpu *g, uint32_t i) {
    const VkImageViewCreateInfo view = {.sType = VK_STRUCTURE_TYPE_IMAGE_VIEW_CREATE_INFO,
                                        .image = s->images[i],
                                        .viewType = VK_IMAGE_VIEW_TYPE_2D,
                                        .format = s->format.format,
                                        .subresourceRange = {VK_IMAGE_ASPECT_COLOR_BIT, 0, 1, 0, 1}};
    if (!GPU_GOOD(vkCreateImageView(g->device, &view, NULL, &s->views[i]))) {
        return false;
    }
    const VkFramebufferCreateInfo framebuffer = {.sType = VK_STRUCTURE_TYPE_FRAMEBUFFER_CREATE_INFO,
                                                 .renderPass = s->pass,
                                                 .attachmentCount = 1,
                                                 .pAttachments = &s->views[i],
                                                 .width = s->extent.width,
                                                 .height = s->extent.height,
                                                 .layers = 1};
    const VkSemaphoreCreateInfo semaphore = {.sType = VK_STRUCTURE_TYPE_SEMAPHORE_CREATE_INFO};
    return GPU_GOOD(vkCreateFramebuffer(g->device, &framebuffer, NULL, &s->framebuffers[i])) &&
           GPU_GOOD(vkCreateSemaphore(g->device, &semaphore, NULL, &s->drawn[i]));
}

static bool make_chain(swapchain *s, const gpu *g, const VkSurfaceCapabilitiesKHR *surface, bool vsync) {
    uint32_t images = surface->minImageCount + 1 > 3 ? surface->minImageCount + 1 : 3;
    images = surface->maxImageCount && images > surface->maxImageCount ? surface->maxImageCount : images;
    const VkCompositeAlphaFlagsKHR opaque = surface->supportedCompositeAlpha & VK_COMPOSITE_ALPHA_OPAQUE_BIT_KHR;
    const VkSwapchainCreateInfoKHR info = {
        .sType = VK_STRUCTURE_TYPE_SWAPCHAIN_CREATE_INFO_KHR,
        .surface = g->surface,
        .minImageCount = images,
        .imageFormat = s->format.format,
        .imageColorSpace = s->format.colorSpace,
        .imageExtent = s->extent,
        .imageArrayLayers = 1,
        .imageUsage = VK_IMAGE_USAGE_COLOR_ATTACHMENT_BIT | VK_IMAGE_USAGE_TRANSFER_DST_BIT,
        .imageSharingMode = VK_SHARING_MODE_EXCLUSIVE,
        .preTransform = surface->currentTransform,
        .compositeAlpha = opaque ? VK_COMPOSITE_ALPHA_OPAQUE_BIT_KHR : VK_COMPOSITE_ALPHA_INHERIT_BIT_KHR,
        .presentMode = choose_mode(g, vsync),
        .clipped = VK_TRUE,
        .oldSwapchain = s->chain,
    };
    VkSwapchainKHR made = VK_NULL_HANDLE;
    const bool good = GPU_GOOD(vkCreateSwapchainKHR(g->device, &info, NULL, &made));
    vkDestroySwapchainKHR(g->device, s->chain, NULL);
    s->chain = made;
    return good;
}

bool swapchain_fit(swapchain *s, const gpu *g, GLFWwindow *window, bool vsync) {
    VkSurfaceCapabilitiesKHR surface;
    free_images(s, g);
    if (!GPU_GOOD(vkGetPhysicalDeviceSurfaceCapabilitiesKHR(g->physical, g->surface, &surface))) {
        return false;
    }
    if (!(surface.supportedUsageFlags & VK_IMAGE_USAGE_TRANSFER_DST_BIT)) {
        fprintf(stderr, "fathom: the window's images cannot be copied to\n");
        return false;
    }
    s->extent = choose_extent(&surface, window);
    if (s->extent.width == 0 || s->extent.height == 0) {
        vkDestroySwapchainKHR(g->device, s->chain, NULL);
        s->chain = VK_NULL_HANDLE;
        return true;
    }
    if (!make_chain(s, g, &surface, vsync)) {
        return false;
    }
    uint32_t count = SWAPCHAIN_MAX_IMAGES;
    if (!GPU_GOOD(vkGetSwapchainImagesKHR(g->device, s->chain, &count, s->images))) {
        return false;
    }
    s->count = count;
    for (uint32_t i = 0; i < count; i++) {
        if (!make_image(s, g, i)) {
            return false;
        }
    }
    return true;
}
