// SPDX-License-Identifier: MIT
#include "report.h"

#include <string.h>

const char *report_device_kind(fm_device_kind kind) {
    switch (kind) {
    case FM_DEVICE_DISCRETE_GPU:
        return "discrete GPU";
    case FM_DEVICE_INTEGRATED_GPU:
        return "integrated GPU";
    case FM_DEVICE_VIRTUAL_GPU:
        return "virtual GPU";
    case FM_DEVICE_SOFTWARE:
        return "software driver";
    case FM_DEVICE_HOST:
        return "host";
    case FM_DEVICE_OTHER:
        break;
    }
    return "other";
}

void report_passes(FILE *stream, const fm_pass *passes, uint32_t count) {
    fm_pass total = {"total", 0, 0};
    size_t width = strlen(total.name);
    for (uint32_t i = 0; i < count; i++) {
        total.milliseconds += passes[i].milliseconds;
        total.bytes += passes[i].bytes;
        width = strlen(passes[i].name) > width ? strlen(passes[i].name) : width;
    }
    const bool large = total.bytes >= 1000000000;
    fprintf(stream, "%-*s %12s %10s %10s\n", (int)width, "pass", "ms", large ? "GB moved" : "MB moved", "GB/s");
    for (uint32_t i = 0; i <= count; i++) {
        const fm_pass *pass = i < count ? &passes[i] : &total;
        fprintf(stream, "%-*s %12.3f %10.4g ", (int)width, pass->name, pass->milliseconds,
                (double)pass->bytes * (large ? 1e-9 : 1e-6));
        if (pass->milliseconds > 0) {
            fprintf(stream, "%10.1f\n", (double)pass->bytes * 1e-6 / pass->milliseconds);
        } else {
            fprintf(stream, "%10s\n", "-");
        }
    }
}

cJSON *report_shape_json(fm_shape shape) {
    return cJSON_CreateIntArray((const int[]){(int)shape.x, (int)shape.y, (int)shape.z}, 3);
}

static void add_version(cJSON *object, uint32_t version) {
    char text[32];
    snprintf(text, sizeof text, "%u.%u.%u", version >> 22 & 0x7f, version >> 12 & 0x3ff, version & 0xfff);
    cJSON_AddStringToObject(object, "api_version", text);
}

cJSON *report_device_json(const fm_device_info *device) {
    cJSON *object = cJSON_CreateObject();
    const bool host = device->kind == FM_DEVICE_HOST;
    cJSON_AddStringToObject(object, "backend", host ? "cpu" : "vulkan");
    if (!host) {
        cJSON_AddNumberToObject(object, "index", device->index);
    }
    cJSON_AddStringToObject(object, "name", device->name);
    cJSON_AddStringToObject(object, "driver", device->driver);
    cJSON_AddStringToObject(object, "kind", report_device_kind(device->kind));
    cJSON_AddBoolToObject(object, "usable", device->usable);
    cJSON_AddStringToObject(object, "reason", device->reason);
    if (host) {
        cJSON_AddNumberToObject(object, "threads", device->threads);
    } else {
        add_version(object, device->api_version);
    }
    cJSON_AddNumberToObject(object, "subgroup_size", device->subgroup_size);
    cJSON_AddNumberToObject(object, "memory_bytes", (double)device->memory);
    cJSON_AddNumberToObject(object, "max_allocation_bytes", (double)device->max_allocation);
    if (!host) {
        cJSON_AddNumberToObject(object, "max_workgroup", device->max_workgroup);
        cJSON_AddNumberToObject(object, "shared_memory_bytes", (double)device->shared_memory);
        cJSON_AddNumberToObject(object, "max_descriptor_range_bytes", (double)device->max_descriptor_range);
        cJSON_AddNumberToObject(object, "timestamp_period_ns", device->timestamp_period_ns);
        cJSON_AddBoolToObject(object, "host_visible_memory", device->host_visible_memory);
        cJSON_AddBoolToObject(object, "float16", device->float16);
    }
    return object;
}

cJSON *report_passes_json(const fm_pass *passes, uint32_t count) {
    cJSON *array = cJSON_CreateArray();
    for (uint32_t i = 0; i < count; i++) {
        cJSON *pass = cJSON_CreateObject();
        cJSON_AddStringToObject(pass, "name", passes[i].name);
        cJSON_AddNumberToObject(pass, "milliseconds", passes[i].milliseconds);
        cJSON_AddNumberToObject(pass, "bytes", (double)passes[i].bytes);
        cJSON_AddItemToArray(array, pass);
    }
    return array;
}

bool report_json(FILE *stream, cJSON *value) {
    char *text = value ? cJSON_Print(value) : NULL;
    if (text) {
        fprintf(stream, "%s\n", text);
    }
    cJSON_free(text);
    cJSON_Delete(value);
    return text != NULL;
}
