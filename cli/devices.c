// SPDX-License-Identifier: MIT
// fathom devices: what there is to compute on.

#include "cli.h"
#include "commands.h"
#include "report.h"

#include <stdlib.h>

static void print_size(const char *label, uint64_t bytes) {
    char text[32];
    printf("    %-22s %s\n", label, cli_bytes(bytes, text));
}

static void print_device(const fm_device_info *device) {
    const bool host = device->kind == FM_DEVICE_HOST;
    if (host) {
        printf("cpu: %s\n", device->name);
    } else {
        printf("vulkan %u: %s\n", device->index, device->name);
    }
    printf("    %-22s %s\n", "kind", report_device_kind(device->kind));
    printf("    %-22s %s%s\n", "usable", device->usable ? "yes" : "no: ", device->usable ? "" : device->reason);
    printf("    %-22s %s\n", "driver", device->driver);
    print_size("memory", device->memory);
    if (host) {
        printf("    %-22s %u\n", "threads", device->threads);
        printf("    %-22s %u of 32 bits\n", "SIMD lanes", device->subgroup_size);
        return;
    }
    printf("    %-22s %u.%u.%u\n", "Vulkan", device->api_version >> 22 & 0x7f, device->api_version >> 12 & 0x3ff,
           device->api_version & 0xfff);
    print_size("largest allocation", device->max_allocation);
    print_size("descriptor range", device->max_descriptor_range);
    print_size("shared memory", device->shared_memory);
    printf("    %-22s %u invocations\n", "workgroup", device->max_workgroup);
    printf("    %-22s %u lanes\n", "subgroup", device->subgroup_size);
    printf("    %-22s %g ns\n", "timestamp period", device->timestamp_period_ns);
    printf("    %-22s %s\n", "host-visible memory", device->host_visible_memory ? "all" : "not all");
    printf("    %-22s %s\n", "16-bit floats", device->float16 ? "yes" : "no");
}

static bool print_json(const fm_device_info *devices, uint32_t count, const char *note) {
    cJSON *root = cJSON_CreateObject();
    cJSON *array = cJSON_AddArrayToObject(root, "devices");
    for (uint32_t i = 0; i < count; i++) {
        cJSON_AddItemToArray(array, report_device_json(&devices[i]));
    }
    cJSON_AddStringToObject(root, "vulkan_note", note);
    return report_json(stdout, root);
}

static int list_devices(bool json) {
    char note[512] = "";
    uint32_t count = 0;
    if (fm_enumerate_devices(&count, NULL, note, sizeof note) != FM_OK) {
        return cli_library_failed();
    }
    fm_device_info *devices = calloc(count, sizeof *devices);
    if (!devices) {
        return cli_fail("out of memory for %u devices: free some", count);
    }
    int status = CLI_DONE;
    if (fm_enumerate_devices(&count, devices, note, sizeof note) != FM_OK) {
        status = cli_library_failed();
    } else if (json) {
        status = print_json(devices, count, note) ? CLI_DONE : cli_fail("out of memory for the list: free some");
    } else {
        for (uint32_t i = 0; i < count; i++) {
            print_device(&devices[i]);
        }
        if (note[0]) {
            printf("no Vulkan device: %s\n", note);
        }
    }
    free(devices);
    return status;
}

int command_devices(int argc, char **argv) {
    static const cli_help help = {
        "devices", "Lists the native CPU backend and every Vulkan device with its limits, and why a device is unusable.",
        "fathom devices\nfathom devices --json\n"};
    cli_args args = {0};
    struct arg_lit *json = cli_add(&args, arg_lit0(NULL, "json", "print JSON"));
    int status;
    if (cli_parse(&args, &help, argc, argv, &status)) {
        status = list_devices(json->count > 0);
    }
    cli_free(&args);
    return status;
}
