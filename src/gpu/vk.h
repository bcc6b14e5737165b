// SPDX-License-Identifier: MIT
#ifndef FM_VK_H
#define FM_VK_H

// The Vulkan side of a context, for the files of this folder alone.
//
// Kernels get device addresses through push constants; there are no descriptors.

#include "gpu/compute.h"

#include <stdatomic.h>

#define VK_NO_PROTOTYPES
#include <vulkan/vulkan.h>

// Entry points by level. They are kept by context, not globally: a caller's device may come from another loader.
#define FM_VK_INSTANCE_FUNCTIONS(X)                                                                                                \
    X(CreateDevice)                                                                                                                \
    X(DestroyInstance)                                                                                                             \
    X(EnumerateDeviceExtensionProperties)                                                                                          \
    X(EnumeratePhysicalDevices)                                                                                                    \
    X(GetDeviceProcAddr)                                                                                                           \
    X(GetPhysicalDeviceFeatures2)                                                                                                  \
    X(GetPhysicalDeviceMemoryProperties)                                                                                           \
    X(GetPhysicalDeviceProperties)                                                                                                 \
    X(GetPhysicalDeviceProperties2)                                                                                                \
    X(GetPhysicalDeviceQueueFamilyProperties)

#define FM_VK_DEVICE_FUNCTIONS(X)                                                                                                  \
    X(AllocateCommandBuffers)                                                                                                      \
    X(AllocateMemory)                                                                                                              \
    X(BeginCommandBuffer)                                                                                                          \
    X(BindBufferMemory)                                                                                                            \
    X(CmdBindPipeline)                                                                                                             \
    X(CmdCopyBuffer)                                                                                                               \
    X(CmdDispatch)                                                                                                                 \
    X(CmdDispatchIndirect)                                                                                                         \
    X(CmdFillBuffer)                                                                                                               \
    X(CmdPipelineBarrier2)                                                                                                         \
    X(CmdPushConstants)                                                                                                            \
    X(CmdResetQueryPool)                                                                                                           \
    X(CmdWriteTimestamp2)                                                                                                          \
    X(CreateBuffer)                                                                                                                \
    X(CreateCommandPool)                                                                                                           \
    X(CreateComputePipelines)                                                                                                      \
    X(CreatePipelineLayout)                                                                                                        \
    X(CreateQueryPool)                                                                                                             \
    X(CreateSemaphore)                                                                                                             \
    X(CreateShaderModule)                                                                                                          \
    X(DestroyBuffer)                                                                                                               \
    X(DestroyCommandPool)                                                                                                          \
    X(DestroyDevice)                                                                                                               \
    X(DestroyPipeline)                                                                                                             \
    X(DestroyPipelineLayout)                                                                                                       \
    X(DestroyQueryPool)                                                                                                            \
    X(DestroySemaphore)                                                                                                            \
    X(DestroyShaderModule)                                                                                                         \
    X(EndCommandBuffer)                                                                                                            \
    X(FreeMemory)                                                                                                                  \
    X(GetBufferDeviceAddress)                                                                                                      \
    X(GetBufferMemoryRequirements)                                                                                                 \
    X(GetDeviceQueue)                                                                                                              \
    X(GetQueryPoolResults)                                                                                                         \
    X(GetSemaphoreCounterValue)                                                                                                    \
    X(MapMemory)                                                                                                                   \
    X(QueueSubmit2)                                                                                                                \
    X(QueueWaitIdle)                                                                                                               \
    X(ResetCommandPool)                                                                                                            \
    X(WaitSemaphores)

typedef struct fm_vk_functions {
#define FM_VK_MEMBER(name) PFN_vk##name name;
    FM_VK_INSTANCE_FUNCTIONS(FM_VK_MEMBER)
    FM_VK_DEVICE_FUNCTIONS(FM_VK_MEMBER)
#undef FM_VK_MEMBER
    PFN_vkGetInstanceProcAddr GetInstanceProcAddr;
    PFN_vkGetMemoryFdKHR GetMemoryFdKHR;  // NULL without the extension
} fm_vk_functions;

enum {
    FM_SLOTS = 8,         // submissions in flight; also of so many the times are known
    FM_PUSH_BYTES = 128,  // what every device has
};

typedef struct fm_pipeline {
    struct fm_pipeline *next;
    VkPipeline pipeline;
    fm_kernel kernel;
    uint32_t count;
    uint32_t constants[FM_MAX_SPECIALIZATION];
} fm_pipeline;

struct fm_slot {
    VkCommandPool pool;
    VkCommandBuffer commands;
    VkQueryPool queries;
    fm_ticket ticket;        // of the newest submission
    uint32_t earlier_count;  // passes of the same operation that were flushed before, with their times
    fm_pass earlier[FM_MAX_PASSES];
    uint32_t pass_count;
    fm_pass passes[FM_MAX_PASSES];
};

struct fm_buffer {
    fm_gpu *gpu;
    fm_purpose purpose;
    VkBuffer buffer;
    VkDeviceMemory memory;
    uint64_t bytes;  // of the allocation
    VkDeviceAddress address;
    void *mapped;  // where the host reaches it, else NULL
    bool cached;   // and the host reads it through its caches: fast
};

struct fm_gpu {
    fm_allocator allocator;
    const fm_log *log;
    fm_vk_functions vk;
    VkInstance instance;
    VkDebugUtilsMessengerEXT messenger;
    VkPhysicalDevice physical;
    VkDevice device;
    VkQueue queue;
    uint32_t queue_family;
    uint64_t timestamp_mask;  // the bits that the queue family counts; 0: it takes no times
    bool owns_instance;
    bool owns_device;
    bool has_external_memory;
    bool maps_volumes;
    bool loaded;  // all functions of the device are there
    bool lost;
    fm_device_info info;
    VkPhysicalDeviceMemoryProperties memory;
    atomic_uint_fast64_t validation_messages;

    VkSemaphore timeline;
    fm_ticket newest;
    VkPipelineLayout layout;
    fm_pipeline *pipelines;
    fm_slot slots[FM_SLOTS];
    uint32_t slot;
    const fm_slot *measured;  // the slot of the newest operation that has passes, until they are read
    uint32_t pass_count;
    fm_pass passes[FM_MAX_PASSES];  // those that were read last

    fm_buffer *scratch;
    fm_buffer *staging;
    fm_meter meters[FM_PURPOSE_COUNT];
};

// Reports a failed driver call by its name and code; marks the device lost where that is the reason.
fm_result fm_vk_fail(fm_gpu *gpu, VkResult result, const char *call);

#define FM_VK(gpu, call)                                                                                                           \
    do {                                                                                                                           \
        VkResult fm_vk_result = (gpu)->vk.call;                                                                                    \
        if (fm_vk_result < 0) {                                                                                                    \
            return fm_vk_fail(gpu, fm_vk_result, "vk" #call);                                                                      \
        }                                                                                                                          \
    } while (0)

// loader.c
fm_result fm_vk_load_global(PFN_vkGetInstanceProcAddr *get_instance_proc_addr);
fm_result fm_vk_load_instance(fm_vk_functions *vk, VkInstance instance);
fm_result fm_vk_load_device(fm_vk_functions *vk, VkDevice device, bool external_memory);

// device.c
typedef struct fm_vk_features {
    VkPhysicalDeviceFeatures2 base;
    VkPhysicalDeviceVulkan11Features v11;
    VkPhysicalDeviceVulkan12Features v12;
    VkPhysicalDeviceVulkan13Features v13;
} fm_vk_features;

// Describes a device and says in `info->reason` why it cannot be used, if so.
void fm_vk_inspect(const fm_vk_functions *vk, VkPhysicalDevice physical, uint32_t index, fm_device_info *info);
// The queue family for compute: one without graphics if there is none better to share; false when there is none.
bool fm_vk_queue_family(const fm_vk_functions *vk, VkPhysicalDevice physical, uint32_t *family);
// Whether that family exists and computes; then its timestamps' bits.
bool fm_vk_queue_computes(const fm_vk_functions *vk, VkPhysicalDevice physical, uint32_t family, uint64_t *timestamp_mask);
bool fm_vk_has_extension(const fm_vk_functions *vk, VkPhysicalDevice physical, const char *name);
// Chains the structures of `features` and sets what Fathom needs.
void fm_vk_wanted_features(fm_vk_features *features, bool float16);

// commands.c
fm_result fm_commands_create(fm_gpu *gpu);
void fm_commands_destroy(fm_gpu *gpu);

// pipeline.c
// The pipeline of a kernel with these specialisation constants (ids 0, 1, ...), made at the first call.
fm_result fm_pipeline_get(fm_gpu *gpu, fm_kernel kernel, const uint32_t *constants, uint32_t count, VkPipeline *pipeline);
void fm_pipelines_destroy(fm_gpu *gpu);
fm_result fm_pipeline_layout_create(fm_gpu *gpu);

#endif
