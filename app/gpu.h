// SPDX-License-Identifier: MIT
#ifndef FM_APP_GPU_H
#define FM_APP_GPU_H

// The program's own Vulkan: an instance, a device that can present to its window, and a queue that Fathom computes on too.

#include "fathom/fathom.h"

#define GLFW_INCLUDE_VULKAN
#include <GLFW/glfw3.h>

typedef struct gpu {
    VkInstance instance;
    VkDebugUtilsMessengerEXT messenger;
    VkSurfaceKHR surface;
    VkPhysicalDevice physical;
    VkPhysicalDeviceMemoryProperties memory;
    VkDevice device;
    VkQueue queue;
    uint32_t family;
    fm_device_info info;
    bool has_external_memory_fd;
    unsigned messages;  // of the validation layer, warnings and errors
} gpu;

typedef struct gpu_desc {
    const char *device;  // as fm_context_desc.device
    bool validation;
} gpu_desc;

// The best device that Fathom can use and that can present to the window: real GPUs first. False when there is none: stderr has
// been told why. `gpu_close` frees in any case; the address of `g` must stay.
bool gpu_open(gpu *g, GLFWwindow *window, const gpu_desc *desc);
void gpu_close(gpu *g);

// What a context needs to compute on the same queue.
fm_vulkan_device gpu_adoptable(const gpu *g);

// Says on stderr which call failed, and returns whether it did not.
bool gpu_good(VkResult result, const char *call);
#define GPU_GOOD(call) gpu_good((call), #call)

// stderr is told why there is none.
bool gpu_allocate(const gpu *g, const VkMemoryRequirements *needs, VkMemoryPropertyFlags wanted, VkDeviceMemory *memory);

#endif
