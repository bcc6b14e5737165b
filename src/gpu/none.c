// SPDX-License-Identifier: MIT
// The device of a build without Vulkan: there is none. Calls that need one cannot be reached, for no fm_gpu exists.
// The calls of compute.h are left out: the drivers of kernels are not built.

#include "gpu/gpu.h"

#include <assert.h>
#include <stdio.h>

static const char reason[] = "this build of Fathom has no Vulkan backend (FATHOM_VULKAN=OFF)";

static fm_result unsupported(void) {
    return fm_fail(FM_ERROR_UNSUPPORTED, "%s", reason);
}

fm_result fm_gpu_enumerate(uint32_t *count, fm_device_info *devices, char *note, size_t note_size) {
    (void)devices;
    *count = 0;
    if (note && note_size) {
        snprintf(note, note_size, "%s", reason);
    }
    return FM_OK;
}

fm_result fm_gpu_create(const fm_allocator *allocator, const fm_log *log, const fm_context_desc *desc, bool automatic,
                        fm_gpu **gpu) {
    (void)allocator, (void)log, (void)desc, (void)automatic, (void)gpu;
    return unsupported();
}

void fm_gpu_destroy(fm_gpu *gpu) {
    assert(!gpu);
    (void)gpu;
}

void fm_gpu_describe(const fm_gpu *gpu, fm_device_info *info) {
    (void)gpu, (void)info;
}

void fm_gpu_handles(const fm_gpu *gpu, fm_vulkan_device *device, void **timeline) {
    (void)gpu, (void)device, (void)timeline;
}

uint64_t fm_gpu_validation_messages(const fm_gpu *gpu) {
    (void)gpu;
    return 0;
}

fm_ticket fm_gpu_newest(const fm_gpu *gpu) {
    (void)gpu;
    return 0;
}

fm_result fm_gpu_wait(fm_gpu *gpu, fm_ticket ticket) {
    (void)gpu, (void)ticket;
    return unsupported();
}

fm_result fm_gpu_poll(fm_gpu *gpu, fm_ticket ticket, bool *complete) {
    (void)gpu, (void)ticket, (void)complete;
    return unsupported();
}

fm_result fm_gpu_passes(fm_gpu *gpu, uint32_t *count, fm_pass *passes) {
    (void)gpu, (void)count, (void)passes;
    return unsupported();
}

fm_result fm_gpu_ticket_passes(fm_gpu *gpu, fm_ticket ticket, uint32_t *count, fm_pass *passes) {
    (void)gpu, (void)ticket, (void)count, (void)passes;
    return unsupported();
}

fm_meter fm_gpu_meter(const fm_gpu *gpu, fm_purpose purpose) {
    (void)gpu, (void)purpose;
    return (fm_meter){0, 0};
}

fm_result fm_gpu_trim(fm_gpu *gpu) {
    (void)gpu;
    return unsupported();
}

fm_result fm_buffer_create(fm_gpu *gpu, fm_purpose purpose, uint64_t bytes, bool exportable, fm_buffer **buffer) {
    (void)gpu, (void)purpose, (void)bytes, (void)exportable, (void)buffer;
    return unsupported();
}

void fm_buffer_destroy(fm_buffer *buffer) {
    assert(!buffer);
    (void)buffer;
}

void fm_buffer_describe(const fm_buffer *buffer, fm_volume_buffer *description) {
    (void)buffer, (void)description;
}

fm_result fm_buffer_export_fd(const fm_buffer *buffer, int *fd) {
    (void)buffer, (void)fd;
    return unsupported();
}

void *fm_buffer_mapped(const fm_buffer *buffer) {
    (void)buffer;
    return NULL;
}

fm_result fm_buffer_upload_at(fm_buffer *buffer, uint64_t offset, const void *source, uint64_t bytes) {
    (void)buffer, (void)offset, (void)source, (void)bytes;
    return unsupported();
}

fm_result fm_buffer_download_at(fm_buffer *buffer, uint64_t offset, void *target, uint64_t bytes) {
    (void)buffer, (void)offset, (void)target, (void)bytes;
    return unsupported();
}

fm_result fm_gpu_copy(fm_gpu *gpu, fm_buffer *source, fm_buffer *target, uint64_t bytes, fm_ticket *ticket) {
    (void)gpu, (void)source, (void)target, (void)bytes, (void)ticket;
    return unsupported();
}
