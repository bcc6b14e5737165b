// SPDX-License-Identifier: MIT
#ifndef FM_GPU_H
#define FM_GPU_H

// The device as the rest of the library sees it. No type of Vulkan leaves this folder; without Vulkan in the build every call that
// needs a device fails with FM_ERROR_UNSUPPORTED (none.c).

#include "base/meter.h"

typedef struct fm_gpu fm_gpu;
typedef struct fm_buffer fm_buffer;

fm_result fm_gpu_enumerate(uint32_t *count, fm_device_info *devices, char *note, size_t note_size);

// The allocator is copied; the log must outlive the device. Of `desc` what concerns the device is read. `automatic`: software
// drivers are passed over.
fm_result fm_gpu_create(const fm_allocator *allocator, const fm_log *log, const fm_context_desc *desc, bool automatic,
                        fm_gpu **gpu);
void fm_gpu_destroy(fm_gpu *gpu);
void fm_gpu_describe(const fm_gpu *gpu, fm_device_info *info);
void fm_gpu_handles(const fm_gpu *gpu, fm_vulkan_device *device, void **timeline);
uint64_t fm_gpu_validation_messages(const fm_gpu *gpu);
// The ticket of the newest submission.
fm_ticket fm_gpu_newest(const fm_gpu *gpu);
fm_result fm_gpu_wait(fm_gpu *gpu, fm_ticket ticket);
fm_result fm_gpu_poll(fm_gpu *gpu, fm_ticket ticket, bool *complete);
fm_result fm_gpu_passes(fm_gpu *gpu, uint32_t *count, fm_pass *passes);
fm_result fm_gpu_ticket_passes(fm_gpu *gpu, fm_ticket ticket, uint32_t *count, fm_pass *passes);
fm_meter fm_gpu_meter(const fm_gpu *gpu, fm_purpose purpose);
fm_result fm_gpu_trim(fm_gpu *gpu);

// Device memory with its buffer. Contents are undefined.
fm_result fm_buffer_create(fm_gpu *gpu, fm_purpose purpose, uint64_t bytes, bool exportable, fm_buffer **buffer);
void fm_buffer_destroy(fm_buffer *buffer);
void fm_buffer_describe(const fm_buffer *buffer, fm_volume_buffer *description);
fm_result fm_buffer_export_fd(const fm_buffer *buffer, int *fd);
// Where the host reaches the memory, else NULL; what fm_purpose says of mapping holds. Reading may be slow but for
// FM_PURPOSE_READBACK. The host's writes are visible to work that is submitted after them, the device's to the host after a wait.
void *fm_buffer_mapped(const fm_buffer *buffer);
// Both wait for all work and until the bytes are there.
fm_result fm_buffer_upload_at(fm_buffer *buffer, uint64_t offset, const void *source, uint64_t bytes);
fm_result fm_buffer_download_at(fm_buffer *buffer, uint64_t offset, void *target, uint64_t bytes);
fm_result fm_gpu_copy(fm_gpu *gpu, fm_buffer *source, fm_buffer *target, uint64_t bytes, fm_ticket *ticket);

#endif
