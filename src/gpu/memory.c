// SPDX-License-Identifier: MIT
// Device buffers, their transfer from and to the host, and scratch memory. A buffer has an allocation of its own: there are few
// of them and they are large.

#include "gpu/vk.h"
#include "shaders/include/shared.h"

#include <string.h>

enum {
    STAGING_HALF = 32 << 20,
    BUFFER_STEP = 16,  // kernels load and store whole pieces: the last one may reach past the elements
};

enum {
    LOCAL = VK_MEMORY_PROPERTY_DEVICE_LOCAL_BIT,
    VISIBLE = VK_MEMORY_PROPERTY_HOST_VISIBLE_BIT,
    HOST = VISIBLE | VK_MEMORY_PROPERTY_HOST_COHERENT_BIT,
    CACHED = VK_MEMORY_PROPERTY_HOST_CACHED_BIT,
    MAX_CHOICES = 3,
};

// Flags of a memory type.
typedef struct type_choice {
    VkMemoryPropertyFlags wanted, unwanted;
} type_choice;

// The memory that serves a purpose, best first. A choice without wanted flags ends the list.
static const type_choice *choices_for(const fm_gpu *gpu, fm_purpose purpose) {
    static const type_choice held[MAX_CHOICES] = {{LOCAL | HOST | CACHED, 0}, {LOCAL, VISIBLE}, {LOCAL, 0}};
    static const type_choice voxels[MAX_CHOICES] = {{LOCAL | HOST | CACHED, 0}, {LOCAL | HOST, 0}, {LOCAL, 0}};
    static const type_choice written[MAX_CHOICES] = {{LOCAL | HOST, 0}, {HOST, 0}};
    static const type_choice read[MAX_CHOICES] = {{HOST | CACHED, 0}, {HOST, 0}};
    switch (purpose) {
    case FM_PURPOSE_STAGING:
    case FM_PURPOSE_READBACK:
        return read;
    case FM_PURPOSE_UPLOAD:
        return written;
    case FM_PURPOSE_VOXELS:
        return gpu->maps_volumes && gpu->info.host_visible_memory ? voxels : held;
    default:
        return held;
    }
}

typedef enum mapping { MAPPING_NONE, MAPPING_WISHED, MAPPING_NEEDED } mapping;

static mapping mapping_of(const fm_gpu *gpu, fm_purpose purpose, VkMemoryPropertyFlags has) {
    if (purpose == FM_PURPOSE_STAGING || purpose == FM_PURPOSE_UPLOAD || purpose == FM_PURPOSE_READBACK) {
        return MAPPING_NEEDED;
    }
    const VkMemoryPropertyFlags wanted = purpose == FM_PURPOSE_VOXELS ? HOST : HOST | CACHED;
    return gpu->maps_volumes && (has & wanted) == wanted ? MAPPING_WISHED : MAPPING_NONE;
}

static bool pick_type(const fm_gpu *gpu, uint32_t allowed, type_choice choice, uint32_t *type) {
    for (uint32_t i = 0; i < gpu->memory.memoryTypeCount; i++) {
        VkMemoryPropertyFlags flags = gpu->memory.memoryTypes[i].propertyFlags;
        if ((allowed >> i & 1) && (flags & choice.wanted) == choice.wanted && !(flags & choice.unwanted)) {
            *type = i;
            return true;
        }
    }
    return false;
}

static fm_result out_of_memory(const fm_gpu *gpu, uint64_t bytes) {
    uint64_t held = 0;
    for (fm_purpose i = 0; i < FM_PURPOSE_COUNT; i++) {
        held += gpu->meters[i].bytes;
    }
    return fm_fail(FM_ERROR_OUT_OF_DEVICE_MEMORY,
                   "\"%s\" cannot give %.1f MiB more: it has %.1f MiB in all, of which this context holds %.1f MiB", gpu->info.name,
                   (double)bytes / 1048576.0, (double)gpu->info.memory / 1048576.0, (double)held / 1048576.0);
}

// Memory of the first type that serves and has room. A small heap that the host sees may be full where another is not.
static fm_result allocate_memory(fm_buffer *buffer, const VkMemoryRequirements *needs, bool exportable, uint32_t *type) {
    fm_gpu *gpu = buffer->gpu;
    VkExportMemoryAllocateInfo export_info = {.sType = VK_STRUCTURE_TYPE_EXPORT_MEMORY_ALLOCATE_INFO,
                                              .handleTypes = VK_EXTERNAL_MEMORY_HANDLE_TYPE_OPAQUE_FD_BIT};
    VkMemoryDedicatedAllocateInfo dedicated = {.sType = VK_STRUCTURE_TYPE_MEMORY_DEDICATED_ALLOCATE_INFO,
                                               .pNext = exportable ? &export_info : NULL,
                                               .buffer = buffer->buffer};
    VkMemoryAllocateFlagsInfo flags = {
        .sType = VK_STRUCTURE_TYPE_MEMORY_ALLOCATE_FLAGS_INFO, .pNext = &dedicated, .flags = VK_MEMORY_ALLOCATE_DEVICE_ADDRESS_BIT};
    VkMemoryAllocateInfo allocation = {
        .sType = VK_STRUCTURE_TYPE_MEMORY_ALLOCATE_INFO, .pNext = &flags, .allocationSize = needs->size};
    const type_choice *choices = choices_for(gpu, buffer->purpose);
    uint32_t untried = needs->memoryTypeBits;
    for (int i = 0; i < MAX_CHOICES && choices[i].wanted; i++) {
        if (!pick_type(gpu, untried, choices[i], type)) {
            continue;
        }
        untried &= ~(1u << *type);
        if (needs->size > gpu->memory.memoryHeaps[gpu->memory.memoryTypes[*type].heapIndex].size) {
            continue;
        }
        allocation.memoryTypeIndex = *type;
        VkResult result = gpu->vk.AllocateMemory(gpu->device, &allocation, NULL, &buffer->memory);
        if (result != VK_ERROR_OUT_OF_DEVICE_MEMORY && result != VK_ERROR_OUT_OF_HOST_MEMORY) {
            return result < 0 ? fm_vk_fail(gpu, result, "vkAllocateMemory") : FM_OK;
        }
    }
    return untried != needs->memoryTypeBits
               ? out_of_memory(gpu, needs->size)
               : fm_fail(FM_ERROR_INTERNAL, "\"%s\" has no memory type for a storage buffer", gpu->info.name);
}

static fm_result map(fm_buffer *buffer, VkMemoryPropertyFlags has) {
    fm_gpu *gpu = buffer->gpu;
    mapping wish = mapping_of(gpu, buffer->purpose, has);
    if (wish == MAPPING_NONE) {
        return FM_OK;
    }
    VkResult result = gpu->vk.MapMemory(gpu->device, buffer->memory, 0, VK_WHOLE_SIZE, 0, &buffer->mapped);
    if (result < 0) {
        buffer->mapped = NULL;
        return wish == MAPPING_NEEDED ? fm_vk_fail(gpu, result, "vkMapMemory") : FM_OK;
    }
    buffer->cached = (has & CACHED) != 0;
    return FM_OK;
}

static fm_result allocate(fm_buffer *buffer, uint64_t bytes, bool exportable) {
    fm_gpu *gpu = buffer->gpu;
    VkExternalMemoryBufferCreateInfo external = {.sType = VK_STRUCTURE_TYPE_EXTERNAL_MEMORY_BUFFER_CREATE_INFO,
                                                 .handleTypes = VK_EXTERNAL_MEMORY_HANDLE_TYPE_OPAQUE_FD_BIT};
    VkBufferCreateInfo info = {
        .sType = VK_STRUCTURE_TYPE_BUFFER_CREATE_INFO,
        .pNext = exportable ? &external : NULL,
        .size = fm_round_up(bytes, BUFFER_STEP),
        .usage = VK_BUFFER_USAGE_STORAGE_BUFFER_BIT | VK_BUFFER_USAGE_TRANSFER_SRC_BIT | VK_BUFFER_USAGE_TRANSFER_DST_BIT |
                 VK_BUFFER_USAGE_SHADER_DEVICE_ADDRESS_BIT | VK_BUFFER_USAGE_INDIRECT_BUFFER_BIT,
    };
    FM_VK(gpu, CreateBuffer(gpu->device, &info, NULL, &buffer->buffer));
    VkMemoryRequirements needs;
    gpu->vk.GetBufferMemoryRequirements(gpu->device, buffer->buffer, &needs);
    uint32_t type = 0;
    FM_TRY(allocate_memory(buffer, &needs, exportable, &type));
    buffer->bytes = needs.size;
    FM_VK(gpu, BindBufferMemory(gpu->device, buffer->buffer, buffer->memory, 0));
    VkBufferDeviceAddressInfo address = {.sType = VK_STRUCTURE_TYPE_BUFFER_DEVICE_ADDRESS_INFO, .buffer = buffer->buffer};
    buffer->address = gpu->vk.GetBufferDeviceAddress(gpu->device, &address);
    return map(buffer, gpu->memory.memoryTypes[type].propertyFlags);
}

fm_result fm_buffer_create(fm_gpu *gpu, fm_purpose purpose, uint64_t bytes, bool exportable, fm_buffer **result) {
    if (gpu->lost) {
        return fm_fail(FM_ERROR_DEVICE_LOST, "the device \"%s\" was lost: make a new context", gpu->info.name);
    }
    if (exportable && !gpu->vk.GetMemoryFdKHR) {
        return fm_fail(FM_ERROR_UNSUPPORTED, "exportable is set: \"%s\" has no VK_KHR_external_memory_fd", gpu->info.name);
    }
    if (bytes > gpu->info.memory) {
        return out_of_memory(gpu, bytes);
    }
    if (bytes > gpu->info.max_allocation - BUFFER_STEP) {
        return fm_fail(FM_ERROR_OUT_OF_DEVICE_MEMORY, "\"%s\" cannot give %.1f MiB at once: its largest allocation is %.1f MiB",
                       gpu->info.name, (double)bytes / 1048576.0, (double)gpu->info.max_allocation / 1048576.0);
    }
    fm_buffer *buffer = fm_alloc_zero(&gpu->allocator, sizeof *buffer, "a device buffer");
    if (!buffer) {
        return FM_ERROR_OUT_OF_HOST_MEMORY;
    }
    buffer->gpu = gpu;
    buffer->purpose = purpose;
    fm_result status = allocate(buffer, bytes, exportable);
    if (status != FM_OK) {
        buffer->bytes = 0;
        fm_buffer_destroy(buffer);
        return status;
    }
    fm_meter_add(&gpu->meters[purpose], buffer->bytes);
    *result = buffer;
    return FM_OK;
}

void fm_buffer_destroy(fm_buffer *buffer) {
    if (!buffer) {
        return;
    }
    fm_gpu *gpu = buffer->gpu;
    fm_meter_remove(&gpu->meters[buffer->purpose], buffer->bytes);
    gpu->vk.DestroyBuffer(gpu->device, buffer->buffer, NULL);
    gpu->vk.FreeMemory(gpu->device, buffer->memory, NULL);
    fm_free(&gpu->allocator, buffer, sizeof *buffer);
}

uint64_t fm_buffer_address(const fm_buffer *buffer) {
    return buffer->address;
}

void fm_buffer_describe(const fm_buffer *buffer, fm_volume_buffer *description) {
    memset(description, 0, sizeof *description);
    memcpy(&description->buffer, &buffer->buffer, sizeof description->buffer);
    memcpy(&description->memory, &buffer->memory, sizeof description->memory);
    description->device_address = buffer->address;
    description->memory_size = buffer->bytes;
}

fm_result fm_buffer_export_fd(const fm_buffer *buffer, int *fd) {
    VkMemoryGetFdInfoKHR info = {.sType = VK_STRUCTURE_TYPE_MEMORY_GET_FD_INFO_KHR,
                                 .memory = buffer->memory,
                                 .handleType = VK_EXTERNAL_MEMORY_HANDLE_TYPE_OPAQUE_FD_BIT};
    FM_VK(buffer->gpu, GetMemoryFdKHR(buffer->gpu->device, &info, fd));
    return FM_OK;
}

static fm_result staging(fm_gpu *gpu) {
    return gpu->staging ? FM_OK : fm_buffer_create(gpu, FM_PURPOSE_STAGING, 2 * (uint64_t)STAGING_HALF, false, &gpu->staging);
}

static fm_result copy_async(fm_gpu *gpu, const fm_buffer *source, uint64_t source_offset, fm_buffer *target, uint64_t target_offset,
                            uint64_t bytes, fm_ticket *ticket) {
    fm_slot *slot;
    FM_TRY(fm_commands_begin(gpu, &slot));
    fm_commands_copy(gpu, slot, source, source_offset, target, target_offset, bytes);
    return fm_commands_submit(gpu, slot, ticket);
}

void *fm_buffer_mapped(const fm_buffer *buffer) {
    return buffer->mapped;
}

fm_result fm_buffer_upload_at(fm_buffer *buffer, uint64_t offset, const void *source, uint64_t bytes) {
    fm_gpu *gpu = buffer->gpu;
    if (buffer->mapped) {
        FM_TRY(fm_gpu_wait(gpu, gpu->newest));
        memcpy((char *)buffer->mapped + offset, source, bytes);
        return FM_OK;
    }
    FM_TRY(staging(gpu));
    fm_ticket busy[2] = {gpu->newest, gpu->newest};  // the staging memory may be in use by an earlier call
    int half = 0;
    for (uint64_t done = 0; done < bytes; half ^= 1) {
        uint64_t piece = fm_min_u64(bytes - done, STAGING_HALF);
        uint64_t at = (uint64_t)half * STAGING_HALF;
        FM_TRY(fm_gpu_wait(gpu, busy[half]));
        memcpy((char *)gpu->staging->mapped + at, (const char *)source + done, piece);
        FM_TRY(copy_async(gpu, gpu->staging, at, buffer, offset + done, piece, &busy[half]));
        done += piece;
    }
    return fm_gpu_wait(gpu, gpu->newest);
}

fm_result fm_buffer_download_at(fm_buffer *buffer, uint64_t offset, void *target, uint64_t bytes) {
    fm_gpu *gpu = buffer->gpu;
    if (buffer->mapped && buffer->cached) {
        FM_TRY(fm_gpu_wait(gpu, gpu->newest));
        memcpy(target, (const char *)buffer->mapped + offset, bytes);
        return FM_OK;
    }
    FM_TRY(staging(gpu));
    FM_TRY(fm_gpu_wait(gpu, gpu->newest));
    // One half is filled by the device while the host empties the other.
    uint64_t asked = 0;
    uint64_t done = 0;
    fm_ticket filled[2] = {0, 0};
    uint64_t pieces[2] = {0, 0};
    for (int half = 0; done < bytes; half ^= 1) {
        for (int ahead = 0; ahead < 2; ahead++) {
            int which = half ^ ahead;
            if (asked < bytes && pieces[which] == 0) {
                pieces[which] = fm_min_u64(bytes - asked, STAGING_HALF);
                FM_TRY(copy_async(gpu, buffer, offset + asked, gpu->staging, (uint64_t)which * STAGING_HALF, pieces[which],
                                  &filled[which]));
                asked += pieces[which];
            }
        }
        FM_TRY(fm_gpu_wait(gpu, filled[half]));
        memcpy((char *)target + done, (char *)gpu->staging->mapped + (uint64_t)half * STAGING_HALF, pieces[half]);
        done += pieces[half];
        pieces[half] = 0;
    }
    return FM_OK;
}

fm_result fm_gpu_copy(fm_gpu *gpu, fm_buffer *source, fm_buffer *target, uint64_t bytes, fm_ticket *ticket) {
    enum { GROUP_PIECES = 1024 };
    fm_slot *slot;
    fm_copy_push push = {source->address, target->address, fm_div_up(bytes, BUFFER_STEP)};
    fm_dispatch dispatch = {
        .kernel = FM_KERNEL_COPY, .push = &push, .push_bytes = sizeof push, .groups = fm_div_up(push.pieces, GROUP_PIECES)};
    FM_TRY(fm_commands_begin(gpu, &slot));
    FM_TRY(fm_commands_dispatch(gpu, slot, &dispatch));
    fm_commands_pass(gpu, slot, "copy", 2 * bytes);
    return fm_commands_submit(gpu, slot, ticket);
}

fm_result fm_gpu_scratch(fm_gpu *gpu, uint64_t bytes, uint64_t *address) {
    if (!gpu->scratch || gpu->scratch->bytes < bytes) {
        FM_TRY(fm_gpu_wait(gpu, gpu->newest));
        fm_buffer_destroy(gpu->scratch);
        gpu->scratch = NULL;
        FM_TRY(fm_buffer_create(gpu, FM_PURPOSE_SCRATCH, bytes, false, &gpu->scratch));
    }
    *address = gpu->scratch->address;
    return FM_OK;
}

fm_buffer *fm_gpu_scratch_buffer(const fm_gpu *gpu) {
    return gpu->scratch;
}

fm_result fm_gpu_trim(fm_gpu *gpu) {
    FM_TRY(fm_gpu_wait(gpu, gpu->newest));
    fm_buffer_destroy(gpu->scratch);
    fm_buffer_destroy(gpu->staging);
    gpu->scratch = NULL;
    gpu->staging = NULL;
    return FM_OK;
}

fm_meter fm_gpu_meter(const fm_gpu *gpu, fm_purpose purpose) {
    return gpu->meters[purpose];
}
