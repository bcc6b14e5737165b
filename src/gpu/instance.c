// SPDX-License-Identifier: MIT
// Makes or adopts an instance and a device.

#include "gpu/vk.h"

#include <ctype.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <strings.h>

enum { MAX_DEVICES = 64 };

static const char validation_layer[] = "VK_LAYER_KHRONOS_validation";

static VKAPI_ATTR VkBool32 VKAPI_CALL on_validation(VkDebugUtilsMessageSeverityFlagBitsEXT severity,
                                                    VkDebugUtilsMessageTypeFlagsEXT type,
                                                    const VkDebugUtilsMessengerCallbackDataEXT *data, void *user) {
    fm_gpu *gpu = user;
    // What the loader says of drivers that it cannot load concerns the machine, not the calls made here.
    if (type & (VK_DEBUG_UTILS_MESSAGE_TYPE_VALIDATION_BIT_EXT | VK_DEBUG_UTILS_MESSAGE_TYPE_PERFORMANCE_BIT_EXT)) {
        atomic_fetch_add_explicit(&gpu->validation_messages, 1, memory_order_relaxed);
        bool error = severity & VK_DEBUG_UTILS_MESSAGE_SEVERITY_ERROR_BIT_EXT;
        fm_log_write(gpu->log, error ? FM_LOG_ERROR : FM_LOG_WARNING, "validation: %s", data->pMessage);
    }
    return VK_FALSE;
}

static fm_result create_instance(PFN_vkGetInstanceProcAddr get, bool validation, fm_gpu *gpu, VkInstance *instance) {
    PFN_vkCreateInstance create = (PFN_vkCreateInstance)get(NULL, "vkCreateInstance");
    PFN_vkEnumerateInstanceVersion version_of = (PFN_vkEnumerateInstanceVersion)get(NULL, "vkEnumerateInstanceVersion");
    uint32_t version = VK_API_VERSION_1_0;
    if (version_of) {
        version_of(&version);
    }
    if (version < VK_API_VERSION_1_3) {
        return fm_fail(FM_ERROR_NO_DEVICE, "the Vulkan loader is of version %u.%u: 1.3 is needed", VK_API_VERSION_MAJOR(version),
                       VK_API_VERSION_MINOR(version));
    }
    VkApplicationInfo application = {
        .sType = VK_STRUCTURE_TYPE_APPLICATION_INFO, .pEngineName = "Fathom", .apiVersion = VK_API_VERSION_1_3};
    VkDebugUtilsMessengerCreateInfoEXT messenger = {
        .sType = VK_STRUCTURE_TYPE_DEBUG_UTILS_MESSENGER_CREATE_INFO_EXT,
        .messageSeverity = VK_DEBUG_UTILS_MESSAGE_SEVERITY_WARNING_BIT_EXT | VK_DEBUG_UTILS_MESSAGE_SEVERITY_ERROR_BIT_EXT,
        .messageType = VK_DEBUG_UTILS_MESSAGE_TYPE_VALIDATION_BIT_EXT | VK_DEBUG_UTILS_MESSAGE_TYPE_PERFORMANCE_BIT_EXT,
        .pfnUserCallback = on_validation,
        .pUserData = gpu};
    const char *layers[] = {validation_layer};
    const char *extensions[] = {VK_EXT_DEBUG_UTILS_EXTENSION_NAME};
    VkInstanceCreateInfo info = {.sType = VK_STRUCTURE_TYPE_INSTANCE_CREATE_INFO,
                                 .pNext = validation ? &messenger : NULL,
                                 .pApplicationInfo = &application,
                                 .enabledLayerCount = validation,
                                 .ppEnabledLayerNames = layers,
                                 .enabledExtensionCount = validation,
                                 .ppEnabledExtensionNames = extensions};
    VkResult result = create(&info, NULL, instance);
    if (result == VK_ERROR_LAYER_NOT_PRESENT || result == VK_ERROR_EXTENSION_NOT_PRESENT) {
        return fm_fail(FM_ERROR_NO_DEVICE, "validation is set but %s is not installed: install the package vulkan-validationlayers",
                       validation_layer);
    }
    if (result == VK_ERROR_OUT_OF_HOST_MEMORY) {
        return fm_fail(FM_ERROR_OUT_OF_HOST_MEMORY, "out of memory in vkCreateInstance");
    }
    if (result != VK_SUCCESS) {
        return fm_fail(FM_ERROR_NO_DEVICE, "no Vulkan driver on this machine (vkCreateInstance gave %d)", (int)result);
    }
    if (validation) {
        PFN_vkCreateDebugUtilsMessengerEXT create_messenger =
            (PFN_vkCreateDebugUtilsMessengerEXT)get(*instance, "vkCreateDebugUtilsMessengerEXT");
        if (create_messenger) {
            create_messenger(*instance, &messenger, NULL, &gpu->messenger);
        }
    }
    return FM_OK;
}

static fm_result list_devices(const fm_vk_functions *vk, VkInstance instance, uint32_t *count, VkPhysicalDevice *devices) {
    *count = MAX_DEVICES;
    VkResult result = vk->EnumeratePhysicalDevices(instance, count, devices);
    if (result < 0) {
        return fm_fail(FM_ERROR_NO_DEVICE, "vkEnumeratePhysicalDevices gave %d", (int)result);
    }
    return FM_OK;
}

static fm_result enumerate_with(fm_vk_functions *vk, VkInstance instance, uint32_t *count, fm_device_info *devices) {
    FM_TRY(fm_vk_load_instance(vk, instance));
    VkPhysicalDevice physical[MAX_DEVICES];
    uint32_t available;
    FM_TRY(list_devices(vk, instance, &available, physical));
    uint32_t copied = fm_listing(count, available, devices != NULL);
    for (uint32_t i = 0; i < copied; i++) {
        fm_vk_inspect(vk, physical[i], i, &devices[i]);
    }
    return FM_OK;
}

fm_result fm_gpu_enumerate(uint32_t *count, fm_device_info *devices, char *note, size_t note_size) {
    if (note && note_size) {
        note[0] = 0;
    }
    fm_vk_functions vk = {0};
    VkInstance instance = VK_NULL_HANDLE;
    fm_result result = fm_vk_load_global(&vk.GetInstanceProcAddr);
    if (result == FM_OK) {
        result = create_instance(vk.GetInstanceProcAddr, false, NULL, &instance);
    }
    if (result == FM_OK) {
        result = enumerate_with(&vk, instance, count, devices);
    }
    if (vk.DestroyInstance) {
        vk.DestroyInstance(instance, NULL);
    }
    if (result == FM_ERROR_NO_DEVICE) {
        *count = 0;
        if (note && note_size) {
            snprintf(note, note_size, "%s", fm_last_error());
        }
        return FM_OK;
    }
    return result;
}

static bool contains_ignoring_case(const char *text, const char *part) {
    size_t length = strlen(part);
    for (; *text; text++) {
        if (strncasecmp(text, part, length) == 0) {
            return true;
        }
    }
    return length == 0;
}

static bool matches(const fm_device_info *info, const char *wanted) {
    if (!wanted) {
        return true;
    }
    char *end;
    unsigned long index = strtoul(wanted, &end, 10);
    if (isdigit((unsigned char)wanted[0]) && *end == 0) {
        return index == info->index;
    }
    return contains_ignoring_case(info->name, wanted);
}

// Lower is better: kinds are declared from best to worst.
static uint64_t rank(const fm_device_info *info) {
    uint64_t gibibytes = info->memory >> 30;
    return ((uint64_t)info->kind << 32) - fm_min_u64(gibibytes, 1u << 20);
}

static fm_result choose_physical(fm_gpu *gpu, const char *wanted, bool automatic) {
    VkPhysicalDevice physical[MAX_DEVICES];
    uint32_t count;
    FM_TRY(list_devices(&gpu->vk, gpu->instance, &count, physical));
    char passed[512] = "";
    size_t length = 0;
    for (uint32_t i = 0; i < count; i++) {
        fm_device_info info;
        fm_vk_inspect(&gpu->vk, physical[i], i, &info);
        const char *reason = !matches(&info, wanted)                        ? "does not match"
                             : !info.usable                                 ? info.reason
                             : automatic && info.kind == FM_DEVICE_SOFTWARE ? "a software driver, used only when asked for"
                                                                            : NULL;
        if (reason) {
            if (length < sizeof passed) {
                length += (size_t)snprintf(passed + length, sizeof passed - length, "%s%u \"%s\": %s", length ? "; " : "", i,
                                           info.name, reason);
            }
        } else if (!gpu->physical || rank(&info) < rank(&gpu->info)) {
            gpu->physical = physical[i];
            gpu->info = info;
        }
    }
    if (!gpu->physical) {
        return fm_fail(FM_ERROR_NO_DEVICE, "no Vulkan device%s%s%s is usable (%s): `fathom devices` lists what there is",
                       wanted ? " \"" : "", wanted ? wanted : "", wanted ? "\"" : "", count ? passed : "the machine has none");
    }
    return FM_OK;
}

static fm_result create_device(fm_gpu *gpu) {
    fm_vk_queue_family(&gpu->vk, gpu->physical, &gpu->queue_family);
    fm_vk_queue_computes(&gpu->vk, gpu->physical, gpu->queue_family, &gpu->timestamp_mask);
    gpu->has_external_memory = fm_vk_has_extension(&gpu->vk, gpu->physical, VK_KHR_EXTERNAL_MEMORY_FD_EXTENSION_NAME);
    fm_vk_features features;
    fm_vk_wanted_features(&features, gpu->info.float16);
    float priority = 1;
    VkDeviceQueueCreateInfo queue = {.sType = VK_STRUCTURE_TYPE_DEVICE_QUEUE_CREATE_INFO,
                                     .queueFamilyIndex = gpu->queue_family,
                                     .queueCount = 1,
                                     .pQueuePriorities = &priority};
    const char *extensions[] = {VK_KHR_EXTERNAL_MEMORY_FD_EXTENSION_NAME};
    VkDeviceCreateInfo info = {.sType = VK_STRUCTURE_TYPE_DEVICE_CREATE_INFO,
                               .pNext = &features.base,
                               .queueCreateInfoCount = 1,
                               .pQueueCreateInfos = &queue,
                               .enabledExtensionCount = gpu->has_external_memory,
                               .ppEnabledExtensionNames = extensions};
    FM_VK(gpu, CreateDevice(gpu->physical, &info, NULL, &gpu->device));
    FM_TRY(fm_vk_load_device(&gpu->vk, gpu->device, gpu->has_external_memory));
    gpu->vk.GetDeviceQueue(gpu->device, gpu->queue_family, 0, &gpu->queue);
    return FM_OK;
}

static fm_result adopt(fm_gpu *gpu, const fm_vulkan_device *given) {
    if (!given->get_instance_proc_addr || !given->instance || !given->physical_device || !given->device || !given->queue) {
        return fm_fail(FM_ERROR_INVALID_ARGUMENT,
                       "vulkan lacks a handle: get_instance_proc_addr, instance, physical_device, device and queue are all needed");
    }
    memcpy(&gpu->vk.GetInstanceProcAddr, &given->get_instance_proc_addr, sizeof given->get_instance_proc_addr);
    gpu->instance = given->instance;
    gpu->physical = given->physical_device;
    gpu->device = given->device;
    gpu->queue = given->queue;
    gpu->queue_family = given->queue_family;
    gpu->has_external_memory = given->has_external_memory_fd;
    FM_TRY(fm_vk_load_instance(&gpu->vk, gpu->instance));
    fm_vk_inspect(&gpu->vk, gpu->physical, 0, &gpu->info);
    if (!gpu->info.usable) {
        return fm_fail(FM_ERROR_NO_DEVICE, "the Vulkan device given, \"%s\", is not usable: %s", gpu->info.name, gpu->info.reason);
    }
    if (!fm_vk_queue_computes(&gpu->vk, gpu->physical, gpu->queue_family, &gpu->timestamp_mask)) {
        return fm_fail(FM_ERROR_INVALID_ARGUMENT, "vulkan.queue_family is %u: \"%s\" has no such family, or it does not compute",
                       gpu->queue_family, gpu->info.name);
    }
    gpu->info.float16 = given->has_float16;
    VkPhysicalDevice physical[MAX_DEVICES];
    uint32_t count;
    FM_TRY(list_devices(&gpu->vk, gpu->instance, &count, physical));
    for (uint32_t i = 0; i < count; i++) {
        gpu->info.index = physical[i] == gpu->physical ? i : gpu->info.index;
    }
    return fm_vk_load_device(&gpu->vk, gpu->device, gpu->has_external_memory);
}

static fm_result open_device(fm_gpu *gpu, const fm_context_desc *desc, bool automatic) {
    if (desc->vulkan) {
        if (desc->device) {
            return fm_fail(FM_ERROR_INVALID_ARGUMENT, "device is \"%s\" while vulkan is given: leave one of the two out",
                           desc->device);
        }
        return adopt(gpu, desc->vulkan);
    }
    FM_TRY(fm_vk_load_global(&gpu->vk.GetInstanceProcAddr));
    FM_TRY(create_instance(gpu->vk.GetInstanceProcAddr, desc->validation, gpu, &gpu->instance));
    gpu->owns_instance = true;
    FM_TRY(fm_vk_load_instance(&gpu->vk, gpu->instance));
    FM_TRY(choose_physical(gpu, desc->device, automatic));
    gpu->owns_device = true;
    return create_device(gpu);
}

fm_result fm_gpu_create(const fm_allocator *allocator, const fm_log *log, const fm_context_desc *desc, bool automatic,
                        fm_gpu **result) {
    fm_gpu *gpu = fm_alloc_zero(allocator, sizeof *gpu, "the Vulkan backend");
    if (!gpu) {
        return FM_ERROR_OUT_OF_HOST_MEMORY;
    }
    gpu->allocator = *allocator;
    gpu->log = log;
    fm_result status = open_device(gpu, desc, automatic);
    if (status == FM_OK) {
        gpu->loaded = true;
        // For the tests, on drivers whose memory can all be mapped.
        gpu->maps_volumes = getenv("FATHOM_STAGING") == NULL;
        gpu->vk.GetPhysicalDeviceMemoryProperties(gpu->physical, &gpu->memory);
        status = fm_commands_create(gpu);
    }
    if (status == FM_OK) {
        status = fm_pipeline_layout_create(gpu);
    }
    if (status != FM_OK) {
        fm_gpu_destroy(gpu);
        return status;
    }
    *result = gpu;
    return FM_OK;
}

void fm_gpu_destroy(fm_gpu *gpu) {
    if (!gpu) {
        return;
    }
    if (gpu->loaded) {
        gpu->vk.QueueWaitIdle(gpu->queue);
        fm_buffer_destroy(gpu->scratch);
        fm_buffer_destroy(gpu->staging);
        fm_pipelines_destroy(gpu);
        fm_commands_destroy(gpu);
    }
    if (gpu->owns_device && gpu->device && gpu->vk.DestroyDevice) {
        gpu->vk.DestroyDevice(gpu->device, NULL);
    }
    if (gpu->messenger) {
        PFN_vkDestroyDebugUtilsMessengerEXT destroy =
            (PFN_vkDestroyDebugUtilsMessengerEXT)gpu->vk.GetInstanceProcAddr(gpu->instance, "vkDestroyDebugUtilsMessengerEXT");
        destroy(gpu->instance, gpu->messenger, NULL);
    }
    if (gpu->owns_instance && gpu->vk.DestroyInstance) {
        gpu->vk.DestroyInstance(gpu->instance, NULL);
    }
    fm_allocator allocator = gpu->allocator;
    fm_free(&allocator, gpu, sizeof *gpu);
}

void fm_gpu_describe(const fm_gpu *gpu, fm_device_info *info) {
    *info = gpu->info;
}

void fm_gpu_handles(const fm_gpu *gpu, fm_vulkan_device *device, void **timeline) {
    memset(device, 0, sizeof *device);
    memcpy(&device->get_instance_proc_addr, &gpu->vk.GetInstanceProcAddr, sizeof device->get_instance_proc_addr);
    device->instance = gpu->instance;
    device->physical_device = gpu->physical;
    device->device = gpu->device;
    device->queue = gpu->queue;
    device->queue_family = gpu->queue_family;
    device->has_float16 = gpu->info.float16;
    device->has_external_memory_fd = gpu->has_external_memory;
    if (timeline) {
        memcpy(timeline, &gpu->timeline, sizeof *timeline);
    }
}

uint64_t fm_gpu_validation_messages(const fm_gpu *gpu) {
    return atomic_load_explicit(&gpu->validation_messages, memory_order_relaxed);
}

fm_result fm_vk_fail(fm_gpu *gpu, VkResult result, const char *call) {
    int length = (int)strcspn(call, "(");
    switch (result) {
    case VK_ERROR_DEVICE_LOST:
        gpu->lost = true;
        return fm_fail(FM_ERROR_DEVICE_LOST, "the device \"%s\" was lost in %.*s: make a new context", gpu->info.name, length,
                       call);
    case VK_ERROR_OUT_OF_DEVICE_MEMORY:
        return fm_fail(FM_ERROR_OUT_OF_DEVICE_MEMORY, "out of device memory in %.*s", length, call);
    case VK_ERROR_OUT_OF_HOST_MEMORY:
        return fm_fail(FM_ERROR_OUT_OF_HOST_MEMORY, "out of host memory in %.*s", length, call);
    default:
        return fm_fail(FM_ERROR_INTERNAL, "%.*s on \"%s\" gave VkResult %d", length, call, gpu->info.name, (int)result);
    }
}
