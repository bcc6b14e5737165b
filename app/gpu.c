// SPDX-License-Identifier: MIT
#include "gpu.h"

#include <stdio.h>
#include <stdlib.h>
#include <string.h>

enum { MAX_DEVICES = 16, MAX_FAMILIES = 32, MAX_EXTENSIONS = 16 };

bool gpu_good(VkResult result, const char *call) {
    if (result != VK_SUCCESS) {
        fprintf(stderr, "fathom: Vulkan's result is %d: %s\n", (int)result, call);
    }
    return result == VK_SUCCESS;
}

bool gpu_allocate(const gpu *g, const VkMemoryRequirements *needs, VkMemoryPropertyFlags wanted, VkDeviceMemory *memory) {
    for (uint32_t i = 0; i < g->memory.memoryTypeCount; i++) {
        if ((needs->memoryTypeBits >> i & 1) && (g->memory.memoryTypes[i].propertyFlags & wanted) == wanted) {
            const VkMemoryAllocateInfo info = {
                .sType = VK_STRUCTURE_TYPE_MEMORY_ALLOCATE_INFO, .allocationSize = needs->size, .memoryTypeIndex = i};
            return GPU_GOOD(vkAllocateMemory(g->device, &info, NULL, memory));
        }
    }
    fprintf(stderr, "fathom: the device has no memory with properties 0x%x for a picture\n", wanted);
    return false;
}

static VKAPI_ATTR VkBool32 VKAPI_CALL on_message(VkDebugUtilsMessageSeverityFlagBitsEXT severity,
                                                 VkDebugUtilsMessageTypeFlagsEXT type,
                                                 const VkDebugUtilsMessengerCallbackDataEXT *data, void *user) {
    (void)severity;
    // The loader and drivers talk through the same messenger of matters that are no fault of ours.
    if (type & VK_DEBUG_UTILS_MESSAGE_TYPE_VALIDATION_BIT_EXT) {
        ((gpu *)user)->messages++;
        fprintf(stderr, "fathom: validation: %s\n", data->pMessage);
    }
    return VK_FALSE;
}

static bool open_instance(gpu *g, bool validation) {
    const char *extensions[MAX_EXTENSIONS] = {VK_EXT_DEBUG_UTILS_EXTENSION_NAME};
    const char *const layers[] = {"VK_LAYER_KHRONOS_validation"};
    uint32_t count = validation, wanted = 0;
    const char **window = glfwGetRequiredInstanceExtensions(&wanted);
    for (uint32_t i = 0; window && i < wanted && count < MAX_EXTENSIONS; i++) {
        extensions[count++] = window[i];
    }
    const VkValidationFeatureEnableEXT enable[] = {VK_VALIDATION_FEATURE_ENABLE_SYNCHRONIZATION_VALIDATION_EXT};
    const VkValidationFeaturesEXT features = {.sType = VK_STRUCTURE_TYPE_VALIDATION_FEATURES_EXT,
                                              .enabledValidationFeatureCount = 1,
                                              .pEnabledValidationFeatures = enable};
    const VkDebugUtilsMessengerCreateInfoEXT messenger = {.sType = VK_STRUCTURE_TYPE_DEBUG_UTILS_MESSENGER_CREATE_INFO_EXT,
                                                          .pNext = &features,
                                                          .messageSeverity = VK_DEBUG_UTILS_MESSAGE_SEVERITY_WARNING_BIT_EXT |
                                                                             VK_DEBUG_UTILS_MESSAGE_SEVERITY_ERROR_BIT_EXT,
                                                          .messageType = VK_DEBUG_UTILS_MESSAGE_TYPE_VALIDATION_BIT_EXT,
                                                          .pfnUserCallback = on_message,
                                                          .pUserData = g};
    const VkApplicationInfo application = {
        .sType = VK_STRUCTURE_TYPE_APPLICATION_INFO, .pApplicationName = "fathom-paint", .apiVersion = VK_API_VERSION_1_3};
    const VkInstanceCreateInfo info = {.sType = VK_STRUCTURE_TYPE_INSTANCE_CREATE_INFO,
                                       .pNext = validation ? &messenger : NULL,
                                       .pApplicationInfo = &application,
                                       .enabledLayerCount = validation,
                                       .ppEnabledLayerNames = layers,
                                       .enabledExtensionCount = count,
                                       .ppEnabledExtensionNames = extensions};
    if (!GPU_GOOD(vkCreateInstance(&info, NULL, &g->instance))) {
        g->instance = VK_NULL_HANDLE;
        return false;
    }
    if (validation) {
        VkDebugUtilsMessengerCreateInfoEXT own = messenger;
        own.pNext = NULL;
        const PFN_vkCreateDebugUtilsMessengerEXT create =
            (PFN_vkCreateDebugUtilsMessengerEXT)vkGetInstanceProcAddr(g->instance, "vkCreateDebugUtilsMessengerEXT");
        return create && GPU_GOOD(create(g->instance, &own, NULL, &g->messenger));
    }
    return true;
}

static bool has_extension(VkPhysicalDevice physical, const char *name) {
    uint32_t count = 0;
    if (vkEnumerateDeviceExtensionProperties(physical, NULL, &count, NULL) != VK_SUCCESS) {
        return false;
    }
    VkExtensionProperties *extensions = calloc(count + 1, sizeof *extensions);
    bool found = false;
    if (extensions && vkEnumerateDeviceExtensionProperties(physical, NULL, &count, extensions) == VK_SUCCESS) {
        for (uint32_t i = 0; !found && i < count; i++) {
            found = strcmp(extensions[i].extensionName, name) == 0;
        }
    }
    free(extensions);
    return found;
}

static bool presenting_family(const gpu *g, VkPhysicalDevice physical, uint32_t *family) {
    VkQueueFamilyProperties families[MAX_FAMILIES];
    uint32_t count = MAX_FAMILIES;
    vkGetPhysicalDeviceQueueFamilyProperties(physical, &count, families);
    const VkQueueFlags wanted = VK_QUEUE_GRAPHICS_BIT | VK_QUEUE_COMPUTE_BIT;
    for (uint32_t i = 0; i < count; i++) {
        VkBool32 presents = VK_FALSE;
        if ((families[i].queueFlags & wanted) == wanted &&
            vkGetPhysicalDeviceSurfaceSupportKHR(physical, i, g->surface, &presents) == VK_SUCCESS && presents) {
            *family = i;
            return true;
        }
    }
    return false;
}

// Lower is better.
static int rank(fm_device_kind kind) {
    static const int ranks[] = {[FM_DEVICE_DISCRETE_GPU] = 0, [FM_DEVICE_INTEGRATED_GPU] = 1, [FM_DEVICE_VIRTUAL_GPU] = 2,
                                [FM_DEVICE_OTHER] = 3,        [FM_DEVICE_SOFTWARE] = 4,       [FM_DEVICE_HOST] = 5};
    return ranks[kind];
}

static bool is_named(const fm_device_info *info, const char *device) {
    char *end;
    const unsigned long index = strtoul(device, &end, 10);
    return *device && !*end ? index == info->index : strcasestr(info->name, device) != NULL;
}

static bool choose_device(gpu *g, const char *wanted) {
    fm_device_info infos[MAX_DEVICES + 1];
    VkPhysicalDevice devices[MAX_DEVICES];
    uint32_t count = MAX_DEVICES + 1, present = MAX_DEVICES;
    char note[256];
    if (fm_enumerate_devices(&count, infos, note, sizeof note) != FM_OK ||
        vkEnumeratePhysicalDevices(g->instance, &present, devices) < 0) {
        return false;
    }
    if (count == 1) {
        fprintf(stderr, "fathom: no Vulkan device: %s\n", note);
        return false;
    }
    int best = -1;
    for (uint32_t i = 1; i < count; i++) {
        const fm_device_info *info = &infos[i];
        uint32_t family;
        const char *why = NULL;
        if (wanted && !is_named(info, wanted)) {
            why = "it is not the one asked for";
        } else if (!info->usable) {
            why = info->reason;
        } else if (info->index >= present || !has_extension(devices[info->index], VK_KHR_SWAPCHAIN_EXTENSION_NAME) ||
                   !presenting_family(g, devices[info->index], &family)) {
            why = "it cannot show pictures in this window";
        }
        if (why) {
            fprintf(stderr, "fathom: %s is passed over: %s\n", info->name, why);
        } else if (best < 0 || rank(info->kind) < rank(infos[best].kind)) {
            best = (int)i;
            g->physical = devices[info->index];
            g->family = family;
            g->info = *info;
        }
    }
    if (best < 0) {
        fprintf(stderr, "fathom: no device is left: fathom devices lists them\n");
        return false;
    }
    vkGetPhysicalDeviceMemoryProperties(g->physical, &g->memory);
    return true;
}

static bool open_device(gpu *g) {
    VkPhysicalDeviceVulkan13Features v13 = {
        .sType = VK_STRUCTURE_TYPE_PHYSICAL_DEVICE_VULKAN_1_3_FEATURES, .synchronization2 = VK_TRUE, .maintenance4 = VK_TRUE};
    VkPhysicalDeviceVulkan12Features v12 = {.sType = VK_STRUCTURE_TYPE_PHYSICAL_DEVICE_VULKAN_1_2_FEATURES,
                                            .pNext = &v13,
                                            .storageBuffer8BitAccess = VK_TRUE,
                                            .shaderInt8 = VK_TRUE,
                                            .shaderFloat16 = g->info.float16,
                                            .hostQueryReset = VK_TRUE,
                                            .timelineSemaphore = VK_TRUE,
                                            .bufferDeviceAddress = VK_TRUE};
    VkPhysicalDeviceVulkan11Features v11 = {
        .sType = VK_STRUCTURE_TYPE_PHYSICAL_DEVICE_VULKAN_1_1_FEATURES, .pNext = &v12, .storageBuffer16BitAccess = VK_TRUE};
    const VkPhysicalDeviceFeatures2 features = {.sType = VK_STRUCTURE_TYPE_PHYSICAL_DEVICE_FEATURES_2,
                                                .pNext = &v11,
                                                .features = {.shaderInt64 = VK_TRUE, .shaderInt16 = VK_TRUE}};
    const float priority = 1;
    const VkDeviceQueueCreateInfo queue = {.sType = VK_STRUCTURE_TYPE_DEVICE_QUEUE_CREATE_INFO,
                                           .queueFamilyIndex = g->family,
                                           .queueCount = 1,
                                           .pQueuePriorities = &priority};
    const char *const extensions[] = {VK_KHR_SWAPCHAIN_EXTENSION_NAME, VK_KHR_EXTERNAL_MEMORY_FD_EXTENSION_NAME};
    g->has_external_memory_fd = has_extension(g->physical, VK_KHR_EXTERNAL_MEMORY_FD_EXTENSION_NAME);
    const VkDeviceCreateInfo info = {.sType = VK_STRUCTURE_TYPE_DEVICE_CREATE_INFO,
                                     .pNext = &features,
                                     .queueCreateInfoCount = 1,
                                     .pQueueCreateInfos = &queue,
                                     .enabledExtensionCount = g->has_external_memory_fd ? 2 : 1,
                                     .ppEnabledExtensionNames = extensions};
    if (!GPU_GOOD(vkCreateDevice(g->physical, &info, NULL, &g->device))) {
        return false;
    }
    vkGetDeviceQueue(g->device, g->family, 0, &g->queue);
    return true;
}

bool gpu_open(gpu *g, GLFWwindow *window, const gpu_desc *desc) {
    *g = (gpu){0};
    return open_instance(g, desc->validation) && GPU_GOOD(glfwCreateWindowSurface(g->instance, window, NULL, &g->surface)) &&
           choose_device(g, desc->device) && open_device(g);
}

void gpu_close(gpu *g) {
    if (g->device) {
        vkDestroyDevice(g->device, NULL);
    }
    if (g->surface) {
        vkDestroySurfaceKHR(g->instance, g->surface, NULL);
    }
    if (g->messenger) {
        const PFN_vkDestroyDebugUtilsMessengerEXT destroy =
            (PFN_vkDestroyDebugUtilsMessengerEXT)vkGetInstanceProcAddr(g->instance, "vkDestroyDebugUtilsMessengerEXT");
        destroy(g->instance, g->messenger, NULL);
    }
    if (g->instance) {
        vkDestroyInstance(g->instance, NULL);
    }
}

fm_vulkan_device gpu_adoptable(const gpu *g) {
    fm_vulkan_device given = {.instance = g->instance,
                              .physical_device = g->physical,
                              .device = g->device,
                              .queue = g->queue,
                              .queue_family = g->family,
                              .has_float16 = g->info.float16,
                              .has_external_memory_fd = g->has_external_memory_fd};
    const PFN_vkGetInstanceProcAddr get = vkGetInstanceProcAddr;
    memcpy(&given.get_instance_proc_addr, &get, sizeof get);
    return given;
}
