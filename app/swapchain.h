// SPDX-License-Identifier: MIT
#ifndef FM_APP_SWAPCHAIN_H
#define FM_APP_SWAPCHAIN_H

#include "gpu.h"

enum { SWAPCHAIN_MAX_IMAGES = 16 };

// The images of the window, and what the panel is drawn into them with.
typedef struct swapchain {
    VkSurfaceFormatKHR format;  // chosen once
    VkRenderPass pass;          // draws over what is in an image and makes it ready to present
    VkSwapchainKHR chain;       // null while the window has no area
    VkExtent2D extent;
    uint32_t count;
    VkImage images[SWAPCHAIN_MAX_IMAGES];
    VkImageView views[SWAPCHAIN_MAX_IMAGES];
    VkFramebuffer framebuffers[SWAPCHAIN_MAX_IMAGES];
    VkSemaphore drawn[SWAPCHAIN_MAX_IMAGES];  // by image: presentation may still wait on one when its frame's turn comes again
} swapchain;

bool swapchain_open(swapchain *s, const gpu *g);
void swapchain_close(swapchain *s, const gpu *g);

// Makes the images anew for the window's size, when no frame is in flight. A window without area leaves `chain` null, which is no
// failure.
bool swapchain_fit(swapchain *s, const gpu *g, GLFWwindow *window, bool vsync);

#endif
