// SPDX-License-Identifier: MIT
#include "volume/context.h"

#include "base/cpu.h"
#include "gpu/gpu.h"

#include <stdio.h>
#include <string.h>
#include <unistd.h>

static void describe_host(fm_device_info *info, uint32_t threads) {
    memset(info, 0, sizeof *info);
    info->kind = FM_DEVICE_HOST;
    info->usable = true;
    info->threads = threads;
    info->host_visible_memory = true;
    fm_cpu_name(info->name, sizeof info->name);
    fm_simd simd = fm_simd_best();
    snprintf(info->driver, sizeof info->driver, "native, %s", fm_simd_name(simd));
    info->subgroup_size = fm_simd_lanes(simd);
    info->max_workgroup = 1;
    long pages = sysconf(_SC_PHYS_PAGES);
    long page = sysconf(_SC_PAGESIZE);
    info->memory = pages > 0 && page > 0 ? (uint64_t)pages * (uint64_t)page : 0;
    info->max_allocation = info->memory;
}

fm_result fm_enumerate_devices(uint32_t *count, fm_device_info *devices, char *vulkan_note, size_t note_size) {
    if (!count) {
        return fm_fail(FM_ERROR_INVALID_ARGUMENT, "count is NULL");
    }
    uint32_t capacity = devices ? *count : 0;
    if (devices && capacity > 0) {
        describe_host(&devices[0], (uint32_t)fm_max_u64(1, (uint64_t)sysconf(_SC_NPROCESSORS_ONLN)));
    }
    uint32_t gpus = capacity > 0 ? capacity - 1 : 0;
    FM_TRY(fm_gpu_enumerate(&gpus, devices && capacity > 0 ? devices + 1 : NULL, vulkan_note, note_size));
    *count = devices ? (uint32_t)fm_min_u64(capacity, (uint64_t)gpus + 1) : gpus + 1;
    return FM_OK;
}

static fm_result choose_backend(fm_context *context, const fm_context_desc *desc) {
    if (desc->backend == FM_BACKEND_CPU) {
        if (desc->vulkan) {
            return fm_fail(FM_ERROR_INVALID_ARGUMENT, "vulkan is given while backend is FM_BACKEND_CPU: leave one of the two out");
        }
        if (desc->device) {
            return fm_fail(FM_ERROR_INVALID_ARGUMENT, "device is \"%s\" while backend is FM_BACKEND_CPU: it names a Vulkan device",
                           desc->device);
        }
        context->backend = FM_BACKEND_CPU;
        return FM_OK;
    }
    // A device or handles that were asked for by name must be had; only a plain AUTO falls back to the CPU.
    bool automatic = desc->backend == FM_BACKEND_AUTO && !desc->vulkan && !desc->device;
    fm_result result = fm_gpu_create(&context->allocator, &context->log, desc, automatic, &context->gpu);
    if (result == FM_OK) {
        context->backend = FM_BACKEND_VULKAN;
        return FM_OK;
    }
    // A driver that fails is as good as none.
    if (!automatic || (result != FM_ERROR_NO_DEVICE && result != FM_ERROR_UNSUPPORTED && result != FM_ERROR_INTERNAL)) {
        return result;
    }
    fm_log_write(&context->log, FM_LOG_INFO, "running on the CPU: %s", fm_last_error());
    context->backend = FM_BACKEND_CPU;
    return FM_OK;
}

fm_result fm_context_create(const fm_context_desc *desc, fm_context **result) {
    static const fm_context_desc defaults = {0};
    desc = desc ? desc : &defaults;
    if (!result) {
        return fm_fail(FM_ERROR_INVALID_ARGUMENT, "context is NULL");
    }
    if ((unsigned)desc->backend > FM_BACKEND_VULKAN) {
        return fm_fail(FM_ERROR_INVALID_ARGUMENT, "backend is %d: one of FM_BACKEND_AUTO, _CPU, _VULKAN", (int)desc->backend);
    }
    const fm_allocator *allocator = desc->allocator ? desc->allocator : &fm_default_allocator;
    if (!allocator->alloc || !allocator->free) {
        return fm_fail(FM_ERROR_INVALID_ARGUMENT, "allocator lacks a function: alloc and free are both needed");
    }
    fm_context *context = fm_alloc_zero(allocator, sizeof *context, "a context");
    if (!context) {
        return FM_ERROR_OUT_OF_HOST_MEMORY;
    }
    context->allocator = *allocator;
    context->log = (fm_log){desc->log, desc->log_user};
    fm_result status = fm_pool_create(&context->allocator, desc->threads, &context->pool);
    if (status == FM_OK) {
        status = choose_backend(context, desc);
    }
    if (status != FM_OK) {
        fm_context_destroy(context);
        return status;
    }
    if (context->backend == FM_BACKEND_CPU) {
        describe_host(&context->device, fm_pool_threads(context->pool));
    } else {
        fm_gpu_describe(context->gpu, &context->device);
    }
    *result = context;
    return FM_OK;
}

void fm_context_destroy(fm_context *context) {
    if (!context) {
        return;
    }
    fm_gpu_destroy(context->gpu);
    fm_pool_destroy(context->pool);
    fm_free(&context->allocator, context->scratch, context->scratch_bytes);
    fm_allocator allocator = context->allocator;
    fm_free(&allocator, context, sizeof *context);
}

fm_backend fm_context_backend(const fm_context *context) {
    return context->backend;
}

void fm_context_device(const fm_context *context, fm_device_info *info) {
    *info = context->device;
}

fm_result fm_context_vulkan(const fm_context *context, fm_vulkan_device *device, void **timeline) {
    if (!context || !device) {
        return fm_fail(FM_ERROR_INVALID_ARGUMENT, "%s is NULL", context ? "device" : "context");
    }
    if (!context->gpu) {
        return fm_fail(FM_ERROR_UNSUPPORTED, "the context runs on the CPU backend: it has no Vulkan objects");
    }
    fm_gpu_handles(context->gpu, device, timeline);
    return FM_OK;
}

uint64_t fm_context_validation_messages(const fm_context *context) {
    return context->gpu ? fm_gpu_validation_messages(context->gpu) : 0;
}

fm_result fm_wait(fm_context *context, fm_ticket ticket) {
    if (!context) {
        return fm_fail(FM_ERROR_INVALID_ARGUMENT, "context is NULL");
    }
    return context->gpu ? fm_gpu_wait(context->gpu, ticket) : FM_OK;
}

fm_result fm_poll(fm_context *context, fm_ticket ticket, bool *complete) {
    if (!context || !complete) {
        return fm_fail(FM_ERROR_INVALID_ARGUMENT, "%s is NULL", context ? "complete" : "context");
    }
    *complete = true;
    return context->gpu ? fm_gpu_poll(context->gpu, ticket, complete) : FM_OK;
}

static void list_host_passes(const fm_context *context, uint32_t *count, fm_pass *passes) {
    const uint32_t copied = fm_listing(count, context->pass_count, passes != NULL);
    for (uint32_t i = 0; i < copied; i++) {
        passes[i] = context->passes[i];
    }
}

fm_result fm_context_passes(fm_context *context, uint32_t *count, fm_pass *passes) {
    if (!context || !count) {
        return fm_fail(FM_ERROR_INVALID_ARGUMENT, "%s is NULL", context ? "count" : "context");
    }
    if (context->gpu) {
        return fm_gpu_passes(context->gpu, count, passes);
    }
    list_host_passes(context, count, passes);
    return FM_OK;
}

fm_result fm_ticket_passes(fm_context *context, fm_ticket ticket, uint32_t *count, fm_pass *passes) {
    if (!context || !count) {
        return fm_fail(FM_ERROR_INVALID_ARGUMENT, "%s is NULL", context ? "count" : "context");
    }
    if (context->gpu) {
        return fm_gpu_ticket_passes(context->gpu, ticket, count, passes);
    }
    list_host_passes(context, count, passes);
    return FM_OK;
}

fm_result fm_context_memory(fm_context *context, uint32_t *count, fm_memory *memory) {
    if (!context || !count) {
        return fm_fail(FM_ERROR_INVALID_ARGUMENT, "%s is NULL", context ? "count" : "context");
    }
    fm_memory all[FM_HOST_PURPOSES + FM_PURPOSE_COUNT];
    uint32_t available = 0;
    for (fm_purpose i = 0; i < FM_HOST_PURPOSES; i++) {
        all[available++] = (fm_memory){fm_purpose_name(i), false, context->host[i].bytes, context->host[i].peak};
    }
    for (fm_purpose i = 0; context->gpu && i < FM_PURPOSE_COUNT; i++) {
        fm_meter meter = fm_gpu_meter(context->gpu, i);
        all[available++] = (fm_memory){fm_purpose_name(i), true, meter.bytes, meter.peak};
    }
    uint32_t copied = fm_listing(count, available, memory != NULL);
    for (uint32_t i = 0; i < copied; i++) {
        memory[i] = all[i];
    }
    return FM_OK;
}

fm_result fm_context_trim(fm_context *context) {
    if (!context) {
        return fm_fail(FM_ERROR_INVALID_ARGUMENT, "context is NULL");
    }
    fm_free(&context->allocator, context->scratch, context->scratch_bytes);
    fm_meter_remove(&context->host[FM_PURPOSE_SCRATCH], context->scratch_bytes);
    context->scratch = NULL;
    context->scratch_bytes = 0;
    return context->gpu ? fm_gpu_trim(context->gpu) : FM_OK;
}

fm_result fm_context_scratch(fm_context *context, uint64_t bytes, void **memory) {
    if (context->scratch_bytes < bytes) {
        // The old block goes first: its contents are not wanted, and both together may not fit.
        fm_free(&context->allocator, context->scratch, context->scratch_bytes);
        fm_meter_remove(&context->host[FM_PURPOSE_SCRATCH], context->scratch_bytes);
        context->scratch_bytes = 0;
        context->scratch = fm_alloc(&context->allocator, bytes, "scratch memory");
        if (!context->scratch) {
            return FM_ERROR_OUT_OF_HOST_MEMORY;
        }
        context->scratch_bytes = bytes;
        fm_meter_add(&context->host[FM_PURPOSE_SCRATCH], bytes);
    }
    *memory = context->scratch;
    return FM_OK;
}

void fm_passes_begin(fm_context *context) {
    context->pass_count = 0;
    context->pass_start = fm_now_ns();
}

void fm_passes_end(fm_context *context, const char *name, uint64_t bytes) {
    uint64_t now = fm_now_ns();
    if (context->pass_count < FM_MAX_PASSES) {
        context->passes[context->pass_count++] = (fm_pass){name, (double)(now - context->pass_start) * 1e-6, bytes};
    }
    context->pass_start = now;
}
