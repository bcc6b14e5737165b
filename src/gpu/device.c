// SPDX-License-Identifier: MIT
// What a Vulkan device must have for Fathom, and what it offers beyond that.

#include "gpu/vk.h"

#include <stdio.h>
#include <string.h>

typedef struct needed_feature {
    const char *name;
    size_t offset;
} needed_feature;

#define FEATURE(part, member)                                                                                                      \
    { #member, offsetof(fm_vk_features, part) + offsetof(__typeof__(((fm_vk_features *)0)->part), member) }
static const needed_feature needed[] = {
    {"shaderInt64", offsetof(fm_vk_features, base) + offsetof(VkPhysicalDeviceFeatures2, features.shaderInt64)},
    {"shaderInt16", offsetof(fm_vk_features, base) + offsetof(VkPhysicalDeviceFeatures2, features.shaderInt16)},
    FEATURE(v11, storageBuffer16BitAccess),
    FEATURE(v12, storageBuffer8BitAccess),
    FEATURE(v12, shaderInt8),
    FEATURE(v12, bufferDeviceAddress),
    FEATURE(v12, timelineSemaphore),
    FEATURE(v12, hostQueryReset),
    FEATURE(v13, synchronization2),
    FEATURE(v13, maintenance4),
};
enum { NEEDED_COUNT = sizeof needed / sizeof needed[0] };

static VkBool32 *feature_at(fm_vk_features *features, size_t offset) {
    return (VkBool32 *)((char *)features + offset);
}

static void chain_features(fm_vk_features *features) {
    memset(features, 0, sizeof *features);
    features->base.sType = VK_STRUCTURE_TYPE_PHYSICAL_DEVICE_FEATURES_2;
    features->base.pNext = &features->v11;
    features->v11.sType = VK_STRUCTURE_TYPE_PHYSICAL_DEVICE_VULKAN_1_1_FEATURES;
    features->v11.pNext = &features->v12;
    features->v12.sType = VK_STRUCTURE_TYPE_PHYSICAL_DEVICE_VULKAN_1_2_FEATURES;
    features->v12.pNext = &features->v13;
    features->v13.sType = VK_STRUCTURE_TYPE_PHYSICAL_DEVICE_VULKAN_1_3_FEATURES;
}

void fm_vk_wanted_features(fm_vk_features *features, bool float16) {
    chain_features(features);
    for (int i = 0; i < NEEDED_COUNT; i++) {
        *feature_at(features, needed[i].offset) = VK_TRUE;
    }
    features->v12.shaderFloat16 = float16;
}

enum { MAX_FAMILIES = 32 };

bool fm_vk_queue_computes(const fm_vk_functions *vk, VkPhysicalDevice physical, uint32_t family, uint64_t *timestamp_mask) {
    VkQueueFamilyProperties families[MAX_FAMILIES];
    uint32_t count = MAX_FAMILIES;
    vk->GetPhysicalDeviceQueueFamilyProperties(physical, &count, families);
    if (family >= count || !(families[family].queueFlags & VK_QUEUE_COMPUTE_BIT)) {
        return false;
    }
    uint32_t bits = families[family].timestampValidBits;
    *timestamp_mask = bits == 0 ? 0 : UINT64_MAX >> (64 - bits);
    return true;
}

bool fm_vk_queue_family(const fm_vk_functions *vk, VkPhysicalDevice physical, uint32_t *family) {
    VkQueueFamilyProperties families[MAX_FAMILIES];
    uint32_t count = MAX_FAMILIES;
    vk->GetPhysicalDeviceQueueFamilyProperties(physical, &count, families);
    bool found = false;
    for (uint32_t i = 0; i < count; i++) {
        VkQueueFlags flags = families[i].queueFlags;
        // The first family with compute and graphics is the one that every driver runs at full rate and that a window can share.
        if ((flags & VK_QUEUE_COMPUTE_BIT) && (!found || (flags & VK_QUEUE_GRAPHICS_BIT))) {
            *family = i;
            found = true;
            if (flags & VK_QUEUE_GRAPHICS_BIT) {
                break;
            }
        }
    }
    return found;
}

bool fm_vk_has_extension(const fm_vk_functions *vk, VkPhysicalDevice physical, const char *name) {
    VkExtensionProperties extensions[512];
    uint32_t count = 512;
    if (vk->EnumerateDeviceExtensionProperties(physical, NULL, &count, extensions) < 0) {
        return false;
    }
    for (uint32_t i = 0; i < count; i++) {
        if (strcmp(extensions[i].extensionName, name) == 0) {
            return true;
        }
    }
    return false;
}

static fm_device_kind device_kind(VkPhysicalDeviceType type) {
    switch (type) {
    case VK_PHYSICAL_DEVICE_TYPE_DISCRETE_GPU:
        return FM_DEVICE_DISCRETE_GPU;
    case VK_PHYSICAL_DEVICE_TYPE_INTEGRATED_GPU:
        return FM_DEVICE_INTEGRATED_GPU;
    case VK_PHYSICAL_DEVICE_TYPE_VIRTUAL_GPU:
        return FM_DEVICE_VIRTUAL_GPU;
    case VK_PHYSICAL_DEVICE_TYPE_CPU:
        return FM_DEVICE_SOFTWARE;
    default:
        return FM_DEVICE_OTHER;
    }
}

static void describe_memory(const fm_vk_functions *vk, VkPhysicalDevice physical, fm_device_info *info) {
    VkPhysicalDeviceMemoryProperties memory;
    vk->GetPhysicalDeviceMemoryProperties(physical, &memory);
    uint32_t largest = 0;
    for (uint32_t i = 0; i < memory.memoryHeapCount; i++) {
        if ((memory.memoryHeaps[i].flags & VK_MEMORY_HEAP_DEVICE_LOCAL_BIT) && memory.memoryHeaps[i].size > info->memory) {
            info->memory = memory.memoryHeaps[i].size;
            largest = i;
        }
    }
    VkMemoryPropertyFlags mapped = VK_MEMORY_PROPERTY_DEVICE_LOCAL_BIT | VK_MEMORY_PROPERTY_HOST_VISIBLE_BIT;
    for (uint32_t i = 0; i < memory.memoryTypeCount; i++) {
        if (memory.memoryTypes[i].heapIndex == largest && (memory.memoryTypes[i].propertyFlags & mapped) == mapped) {
            info->host_visible_memory = true;
        }
    }
}

void fm_vk_inspect(const fm_vk_functions *vk, VkPhysicalDevice physical, uint32_t index, fm_device_info *info) {
    memset(info, 0, sizeof *info);
    VkPhysicalDeviceVulkan13Properties v13 = {.sType = VK_STRUCTURE_TYPE_PHYSICAL_DEVICE_VULKAN_1_3_PROPERTIES};
    VkPhysicalDeviceVulkan12Properties v12 = {.sType = VK_STRUCTURE_TYPE_PHYSICAL_DEVICE_VULKAN_1_2_PROPERTIES, .pNext = &v13};
    VkPhysicalDeviceVulkan11Properties v11 = {.sType = VK_STRUCTURE_TYPE_PHYSICAL_DEVICE_VULKAN_1_1_PROPERTIES, .pNext = &v12};
    VkPhysicalDeviceProperties2 properties = {.sType = VK_STRUCTURE_TYPE_PHYSICAL_DEVICE_PROPERTIES_2};
    vk->GetPhysicalDeviceProperties(physical, &properties.properties);
    const VkPhysicalDeviceLimits *limits = &properties.properties.limits;
    info->index = index;
    info->api_version = properties.properties.apiVersion;
    info->kind = device_kind(properties.properties.deviceType);
    snprintf(info->name, sizeof info->name, "%s", properties.properties.deviceName);
    describe_memory(vk, physical, info);
    info->max_workgroup = limits->maxComputeWorkGroupInvocations;
    info->shared_memory = limits->maxComputeSharedMemorySize;
    info->max_descriptor_range = limits->maxStorageBufferRange;
    info->timestamp_period_ns = limits->timestampPeriod;
    if (info->api_version < VK_API_VERSION_1_3) {
        snprintf(info->reason, sizeof info->reason, "it offers Vulkan %u.%u; 1.3 is needed",
                 VK_API_VERSION_MAJOR(info->api_version), VK_API_VERSION_MINOR(info->api_version));
        return;
    }
    properties.pNext = &v11;
    vk->GetPhysicalDeviceProperties2(physical, &properties);
    snprintf(info->driver, sizeof info->driver, "%.120s %.120s", v12.driverName, v12.driverInfo);
    info->subgroup_size = v11.subgroupSize;
    // Not maxMemoryAllocationSize: drivers state less than they give (4 GiB where 8 GiB are had), so that is left to the attempt.
    info->max_allocation = v13.maxBufferSize;

    fm_vk_features features;
    chain_features(&features);
    vk->GetPhysicalDeviceFeatures2(physical, &features.base);
    info->float16 = features.v12.shaderFloat16;
    uint32_t family;
    if (!fm_vk_queue_family(vk, physical, &family)) {
        snprintf(info->reason, sizeof info->reason, "it has no queue for compute");
        return;
    }
    const VkSubgroupFeatureFlags votes = VK_SUBGROUP_FEATURE_VOTE_BIT | VK_SUBGROUP_FEATURE_BALLOT_BIT;
    if (!(v11.subgroupSupportedStages & VK_SHADER_STAGE_COMPUTE_BIT) || (v11.subgroupSupportedOperations & votes) != votes) {
        snprintf(info->reason, sizeof info->reason, "its subgroups cannot vote or ballot in compute shaders");
        return;
    }
    size_t length = 0;
    for (int i = 0; i < NEEDED_COUNT; i++) {
        if (!*feature_at(&features, needed[i].offset) && length < sizeof info->reason) {
            length += (size_t)snprintf(info->reason + length, sizeof info->reason - length, "%s%s",
                                       length ? ", " : "it lacks the feature ", needed[i].name);
        }
    }
    info->usable = length == 0;
}
