// SPDX-License-Identifier: MIT
// A program's own instance, device and queue, with two contexts on them; the program reads a field with commands of its own, and
// a second device imports one.

#include "vulkan_common.h"

#include <dlfcn.h>
#include <unistd.h>

#define VK_NO_PROTOTYPES
#include <vulkan/vulkan.h>

static const fm_shape shape = {21, 6, 5};
enum { VOXEL = 137, VOXELS = 21 * 6 * 5, BYTES = 4 * VOXELS };

static unsigned messages;

static VKAPI_ATTR VkBool32 VKAPI_CALL on_message(VkDebugUtilsMessageSeverityFlagBitsEXT severity,
                                                 VkDebugUtilsMessageTypeFlagsEXT type,
                                                 const VkDebugUtilsMessengerCallbackDataEXT *data, void *user) {
    (void)severity;
    (void)user;
    if (type & VK_DEBUG_UTILS_MESSAGE_TYPE_VALIDATION_BIT_EXT) {
        messages++;
        fprintf(stderr, "validation: %s\n", data->pMessage);
    }
    return VK_FALSE;
}

// The program's own Vulkan, and the functions that it calls.
typedef struct program {
    PFN_vkGetInstanceProcAddr get;
    VkInstance instance;
    VkDebugUtilsMessengerEXT messenger;
    VkPhysicalDevice physical;
    VkDevice device;
    VkQueue queue;
    uint32_t family;
    bool external_memory;
} program;

#define INSTANCE_CALL(p, name) ((PFN_vk##name)(p)->get((p)->instance, "vk" #name))
#define GOOD(call) CHECK((call) == VK_SUCCESS)

static fm_result open_instance(program *p, bool validation) {
    void *library = dlopen("libvulkan.so.1", RTLD_NOW | RTLD_LOCAL);
    *(void **)&p->get = library ? dlsym(library, "vkGetInstanceProcAddr") : NULL;
    if (!p->get) {
        return FM_ERROR_NO_DEVICE;
    }
    const char *layers[] = {"VK_LAYER_KHRONOS_validation"};
    const char *extensions[] = {VK_EXT_DEBUG_UTILS_EXTENSION_NAME};
    const VkApplicationInfo application = {.sType = VK_STRUCTURE_TYPE_APPLICATION_INFO, .apiVersion = VK_API_VERSION_1_3};
    const VkDebugUtilsMessengerCreateInfoEXT messenger = {.sType = VK_STRUCTURE_TYPE_DEBUG_UTILS_MESSENGER_CREATE_INFO_EXT,
                                                          .messageSeverity = VK_DEBUG_UTILS_MESSAGE_SEVERITY_WARNING_BIT_EXT |
                                                                             VK_DEBUG_UTILS_MESSAGE_SEVERITY_ERROR_BIT_EXT,
                                                          .messageType = VK_DEBUG_UTILS_MESSAGE_TYPE_VALIDATION_BIT_EXT,
                                                          .pfnUserCallback = on_message};
    const VkInstanceCreateInfo info = {.sType = VK_STRUCTURE_TYPE_INSTANCE_CREATE_INFO,
                                       .pNext = validation ? &messenger : NULL,
                                       .pApplicationInfo = &application,
                                       .enabledLayerCount = validation,
                                       .ppEnabledLayerNames = layers,
                                       .enabledExtensionCount = validation,
                                       .ppEnabledExtensionNames = extensions};
    if (INSTANCE_CALL(p, CreateInstance)(&info, NULL, &p->instance) != VK_SUCCESS) {
        p->instance = VK_NULL_HANDLE;
        return FM_ERROR_NO_DEVICE;
    }
    if (validation) {
        GOOD(INSTANCE_CALL(p, CreateDebugUtilsMessengerEXT)(p->instance, &messenger, NULL, &p->messenger));
    }
    return FM_OK;
}

static VkResult make_device(const program *p, VkDevice *device) {
    VkPhysicalDeviceVulkan13Features v13 = {
        .sType = VK_STRUCTURE_TYPE_PHYSICAL_DEVICE_VULKAN_1_3_FEATURES, .synchronization2 = VK_TRUE, .maintenance4 = VK_TRUE};
    VkPhysicalDeviceVulkan12Features v12 = {.sType = VK_STRUCTURE_TYPE_PHYSICAL_DEVICE_VULKAN_1_2_FEATURES,
                                            .pNext = &v13,
                                            .storageBuffer8BitAccess = VK_TRUE,
                                            .shaderInt8 = VK_TRUE,
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
                                           .queueFamilyIndex = p->family,
                                           .queueCount = 1,
                                           .pQueuePriorities = &priority};
    const char *extensions[] = {VK_KHR_EXTERNAL_MEMORY_FD_EXTENSION_NAME};
    const VkDeviceCreateInfo info = {.sType = VK_STRUCTURE_TYPE_DEVICE_CREATE_INFO,
                                     .pNext = &features,
                                     .queueCreateInfoCount = 1,
                                     .pQueueCreateInfos = &queue,
                                     .enabledExtensionCount = p->external_memory,
                                     .ppEnabledExtensionNames = extensions};
    return INSTANCE_CALL(p, CreateDevice)(p->physical, &info, NULL, device);
}

// The device that Fathom would take, found by its index.
static bool open_device(program *p, const fm_vulkan_device *model, uint32_t index) {
    VkPhysicalDevice devices[16];
    uint32_t count = 16;
    if (INSTANCE_CALL(p, EnumeratePhysicalDevices)(p->instance, &count, devices) < 0 || !CHECK(index < count)) {
        return false;
    }
    p->physical = devices[index];
    p->family = model->queue_family;
    p->external_memory = model->has_external_memory_fd;
    if (!GOOD(make_device(p, &p->device))) {
        return false;
    }
    INSTANCE_CALL(p, GetDeviceQueue)(p->device, p->family, 0, &p->queue);
    return true;
}

static void close_program(program *p) {
    if (p->device) {
        INSTANCE_CALL(p, DestroyDevice)(p->device, NULL);
    }
    if (p->messenger) {
        INSTANCE_CALL(p, DestroyDebugUtilsMessengerEXT)(p->instance, p->messenger, NULL);
    }
    if (p->instance) {
        INSTANCE_CALL(p, DestroyInstance)(p->instance, NULL);
    }
}

// A buffer of the program's own that the host can read; `device` is one of the program's.
typedef struct readback {
    VkBuffer buffer;
    VkDeviceMemory memory;
    const uint32_t *mapped;
} readback;

static bool open_readback(const program *p, VkDevice device, readback *r) {
    const VkBufferCreateInfo info = {
        .sType = VK_STRUCTURE_TYPE_BUFFER_CREATE_INFO, .size = BYTES, .usage = VK_BUFFER_USAGE_TRANSFER_DST_BIT};
    VkMemoryRequirements needs;
    VkPhysicalDeviceMemoryProperties memory;
    GOOD(INSTANCE_CALL(p, CreateBuffer)(device, &info, NULL, &r->buffer));
    INSTANCE_CALL(p, GetBufferMemoryRequirements)(device, r->buffer, &needs);
    INSTANCE_CALL(p, GetPhysicalDeviceMemoryProperties)(p->physical, &memory);
    const VkMemoryPropertyFlags wanted = VK_MEMORY_PROPERTY_HOST_VISIBLE_BIT | VK_MEMORY_PROPERTY_HOST_COHERENT_BIT;
    uint32_t type = 0;
    while (type < memory.memoryTypeCount &&
           (!(needs.memoryTypeBits >> type & 1) || (memory.memoryTypes[type].propertyFlags & wanted) != wanted)) {
        type++;
    }
    const VkMemoryAllocateInfo allocation = {
        .sType = VK_STRUCTURE_TYPE_MEMORY_ALLOCATE_INFO, .allocationSize = needs.size, .memoryTypeIndex = type};
    void *mapped = NULL;
    const bool good = GOOD(INSTANCE_CALL(p, AllocateMemory)(device, &allocation, NULL, &r->memory)) &&
                      GOOD(INSTANCE_CALL(p, BindBufferMemory)(device, r->buffer, r->memory, 0)) &&
                      GOOD(INSTANCE_CALL(p, MapMemory)(device, r->memory, 0, VK_WHOLE_SIZE, 0, &mapped));
    r->mapped = mapped;
    return good;
}

static void close_readback(const program *p, VkDevice device, readback *r) {
    INSTANCE_CALL(p, DestroyBuffer)(device, r->buffer, NULL);
    INSTANCE_CALL(p, FreeMemory)(device, r->memory, NULL);
}

// Copies from a buffer once `timeline` (may be null) has reached `ticket`, and waits.
static void copy_out(const program *p, VkDevice device, VkQueue queue, VkBuffer source, uint64_t offset, VkBuffer target,
                     VkSemaphore timeline, fm_ticket ticket) {
    const VkCommandPoolCreateInfo pool_info = {.sType = VK_STRUCTURE_TYPE_COMMAND_POOL_CREATE_INFO, .queueFamilyIndex = p->family};
    VkCommandPool pool;
    GOOD(INSTANCE_CALL(p, CreateCommandPool)(device, &pool_info, NULL, &pool));
    const VkCommandBufferAllocateInfo allocate = {.sType = VK_STRUCTURE_TYPE_COMMAND_BUFFER_ALLOCATE_INFO,
                                                  .commandPool = pool,
                                                  .level = VK_COMMAND_BUFFER_LEVEL_PRIMARY,
                                                  .commandBufferCount = 1};
    VkCommandBuffer commands;
    GOOD(INSTANCE_CALL(p, AllocateCommandBuffers)(device, &allocate, &commands));
    const VkCommandBufferBeginInfo begin = {.sType = VK_STRUCTURE_TYPE_COMMAND_BUFFER_BEGIN_INFO};
    GOOD(INSTANCE_CALL(p, BeginCommandBuffer)(commands, &begin));
    const VkBufferCopy region = {offset, 0, BYTES};
    INSTANCE_CALL(p, CmdCopyBuffer)(commands, source, target, 1, &region);
    GOOD(INSTANCE_CALL(p, EndCommandBuffer)(commands));
    const VkSemaphoreSubmitInfo wait = {.sType = VK_STRUCTURE_TYPE_SEMAPHORE_SUBMIT_INFO,
                                        .semaphore = timeline,
                                        .value = ticket,
                                        .stageMask = VK_PIPELINE_STAGE_2_ALL_TRANSFER_BIT};
    const VkCommandBufferSubmitInfo buffer = {.sType = VK_STRUCTURE_TYPE_COMMAND_BUFFER_SUBMIT_INFO, .commandBuffer = commands};
    const VkSubmitInfo2 submit = {.sType = VK_STRUCTURE_TYPE_SUBMIT_INFO_2,
                                  .waitSemaphoreInfoCount = timeline != VK_NULL_HANDLE,
                                  .pWaitSemaphoreInfos = &wait,
                                  .commandBufferInfoCount = 1,
                                  .pCommandBufferInfos = &buffer};
    GOOD(INSTANCE_CALL(p, QueueSubmit2)(queue, 1, &submit, VK_NULL_HANDLE));
    GOOD(INSTANCE_CALL(p, QueueWaitIdle)(queue));
    INSTANCE_CALL(p, DestroyCommandPool)(device, pool, NULL);
}

// Reads a field of a context on the program's device where it lies, as soon as its ticket is complete.
static void test_read(const program *p, fm_context *context) {
    fm_volume *solid = vulkan_one_voxel(context, shape, VOXEL);
    fm_volume *distance = vulkan_volume(context, shape, FM_TYPE_U32);
    const fm_transform_desc desc = {.metric = FM_METRIC_L1};
    fm_vulkan_device handles;
    fm_volume_buffer field;
    void *timeline = NULL;
    fm_ticket ticket = 0;
    readback r = {0};
    CHECK_OK(fm_context_vulkan(context, &handles, &timeline));
    CHECK(handles.device == p->device && handles.queue == p->queue && handles.instance == p->instance && timeline);
    CHECK_OK(fm_volume_vulkan(distance, &field));
    CHECK_OK(fm_transform(context, &desc, solid, distance, NULL, &ticket));
    if (open_readback(p, p->device, &r)) {
        copy_out(p, p->device, p->queue, (VkBuffer)field.buffer, field.offset, r.buffer, (VkSemaphore)timeline, ticket);
        CHECK(vulkan_wrong_l1(r.mapped, shape, VOXEL) == 0);
        const VkBufferDeviceAddressInfo address = {.sType = VK_STRUCTURE_TYPE_BUFFER_DEVICE_ADDRESS_INFO,
                                                   .buffer = (VkBuffer)field.buffer};
        CHECK(INSTANCE_CALL(p, GetBufferDeviceAddress)(p->device, &address) + field.offset == field.device_address);
    }
    close_readback(p, p->device, &r);
    fm_volume_destroy(solid);
    fm_volume_destroy(distance);
}

// A field of one device, imported by another.
static void test_import(const program *p, fm_context *context) {
    const fm_volume_desc desc = {.shape = shape, .type = FM_TYPE_U32, .exportable = true};
    const fm_transform_desc transform = {.metric = FM_METRIC_L1};
    fm_volume *solid = vulkan_one_voxel(context, shape, VOXEL);
    fm_volume *distance = NULL;
    fm_volume_buffer field;
    int fd = -1;
    VkDevice other = VK_NULL_HANDLE;
    if (CHECK_OK(fm_volume_create(context, &desc, &distance)) && CHECK_OK(fm_volume_vulkan(distance, &field)) &&
        CHECK_OK(fm_transform(context, &transform, solid, distance, NULL, NULL)) && CHECK_OK(fm_volume_export_fd(distance, &fd)) &&
        GOOD(make_device(p, &other))) {
        const VkExternalMemoryBufferCreateInfo external = {.sType = VK_STRUCTURE_TYPE_EXTERNAL_MEMORY_BUFFER_CREATE_INFO,
                                                           .handleTypes = VK_EXTERNAL_MEMORY_HANDLE_TYPE_OPAQUE_FD_BIT};
        const VkBufferCreateInfo info = {.sType = VK_STRUCTURE_TYPE_BUFFER_CREATE_INFO,
                                         .pNext = &external,
                                         .size = fm_type_size(FM_TYPE_U32) * VOXELS,
                                         .usage = VK_BUFFER_USAGE_TRANSFER_SRC_BIT};
        VkBuffer buffer;
        VkMemoryRequirements needs;
        GOOD(INSTANCE_CALL(p, CreateBuffer)(other, &info, NULL, &buffer));
        INSTANCE_CALL(p, GetBufferMemoryRequirements)(other, buffer, &needs);
        uint32_t type = 0;
        while (!(needs.memoryTypeBits >> type & 1)) {
            type++;
        }
        const VkImportMemoryFdInfoKHR import = {.sType = VK_STRUCTURE_TYPE_IMPORT_MEMORY_FD_INFO_KHR,
                                                .handleType = VK_EXTERNAL_MEMORY_HANDLE_TYPE_OPAQUE_FD_BIT,
                                                .fd = fd};
        const VkMemoryAllocateInfo allocation = {.sType = VK_STRUCTURE_TYPE_MEMORY_ALLOCATE_INFO,
                                                 .pNext = &import,
                                                 .allocationSize = field.memory_size,
                                                 .memoryTypeIndex = type};
        VkDeviceMemory memory = VK_NULL_HANDLE;
        if (GOOD(INSTANCE_CALL(p, AllocateMemory)(other, &allocation, NULL, &memory))) {
            fd = -1;  // the import owns it now
            GOOD(INSTANCE_CALL(p, BindBufferMemory)(other, buffer, memory, field.offset));
            VkQueue queue;
            INSTANCE_CALL(p, GetDeviceQueue)(other, p->family, 0, &queue);
            readback r = {0};
            if (open_readback(p, other, &r)) {
                copy_out(p, other, queue, buffer, 0, r.buffer, VK_NULL_HANDLE, 0);
                CHECK(vulkan_wrong_l1(r.mapped, shape, VOXEL) == 0);
            }
            close_readback(p, other, &r);
        }
        INSTANCE_CALL(p, DestroyBuffer)(other, buffer, NULL);
        INSTANCE_CALL(p, FreeMemory)(other, memory, NULL);
        INSTANCE_CALL(p, DestroyDevice)(other, NULL);
    }
    if (fd >= 0) {
        close(fd);
    }
    fm_volume_destroy(solid);
    fm_volume_destroy(distance);
}

static void test_contexts(const program *p) {
    fm_vulkan_device given = {.instance = p->instance,
                              .physical_device = p->physical,
                              .device = p->device,
                              .queue = p->queue,
                              .queue_family = p->family,
                              .has_external_memory_fd = p->external_memory};
    memcpy(&given.get_instance_proc_addr, &p->get, sizeof p->get);
    fm_context_desc desc = {.vulkan = &given, .log = vulkan_log};
    fm_context *contexts[2] = {NULL, NULL};
    for (int i = 0; i < 2; i++) {
        if (!CHECK_OK(fm_context_create(&desc, &contexts[i]))) {
            return;
        }
        CHECK(fm_context_backend(contexts[i]) == FM_BACKEND_VULKAN);
    }
    test_read(p, contexts[0]);
    test_read(p, contexts[1]);
    if (p->external_memory) {
        test_import(p, contexts[0]);
    }
    // Volumes belong to their context, shared device or not.
    fm_volume *mine = vulkan_volume(contexts[0], shape, FM_TYPE_U32), *other = vulkan_volume(contexts[1], shape, FM_TYPE_U32);
    CHECK_FAILS(fm_volume_copy(contexts[0], mine, other, NULL), FM_ERROR_INVALID_ARGUMENT);
    fm_volume_destroy(mine);
    fm_volume_destroy(other);
    fm_context_destroy(contexts[0]);
    test_read(p, contexts[1]);
    fm_context_destroy(contexts[1]);
    // What is refused leaves the program's objects alone.
    fm_context *refused = NULL;
    desc.device = "0";
    CHECK_FAILS(fm_context_create(&desc, &refused), FM_ERROR_INVALID_ARGUMENT);
    desc.device = NULL;
    desc.backend = FM_BACKEND_CPU;
    CHECK_FAILS(fm_context_create(&desc, &refused), FM_ERROR_INVALID_ARGUMENT);
    desc.backend = FM_BACKEND_AUTO;
    given.queue = NULL;
    CHECK_FAILS(fm_context_create(&desc, &refused), FM_ERROR_INVALID_ARGUMENT);
    CHECK(refused == NULL);
    GOOD(INSTANCE_CALL(p, QueueWaitIdle)(p->queue));
}

int main(int count, char **arguments) {
    vulkan_options options;
    if (!vulkan_parse(count, arguments, &options)) {
        return 2;
    }
    fm_context *model = NULL;
    fm_result result = vulkan_open(&options, NULL, &model);
    if (result == FM_ERROR_NO_DEVICE) {
        return vulkan_missing();
    }
    if (CHECK_OK(result)) {
        program p = {0};
        fm_vulkan_device handles;
        fm_device_info info;
        CHECK_OK(fm_context_vulkan(model, &handles, NULL));
        fm_context_device(model, &info);
        if (CHECK_OK(open_instance(&p, !options.no_validation)) && open_device(&p, &handles, info.index)) {
            test_contexts(&p);
        }
        close_program(&p);
        vulkan_close(model);
        CHECK(messages == 0);
    }
    return check_summary();
}
