// SPDX-License-Identifier: MIT
// A context on Vulkan: which device it takes, its tickets, transfers, memory and exports.

#include "vulkan_common.h"

#include <sys/stat.h>
#include <unistd.h>

enum { HALF = 32 << 20 };  // of the staging memory

static const fm_shape small = {19, 11, 7};

static void test_choice(const vulkan_options *options, const fm_context *context) {
    fm_device_info info;
    fm_context_device(context, &info);
    char index[16], part[8], wrong[] = "no device has this name";
    snprintf(index, sizeof index, "%u", info.index);
    // The middle of the name in capitals.
    snprintf(part, sizeof part, "%.5s", info.name + 1);
    for (char *c = part; *c; c++) {
        *c = (char)(*c >= 'a' && *c <= 'z' ? *c - 'a' + 'A' : *c);
    }
    const char *const names[] = {index, part, info.name};
    for (int i = 0; i < 3; i++) {
        vulkan_options named = {.device = names[i], .no_validation = options->no_validation};
        fm_context *other = NULL;
        if (CHECK_OK(vulkan_open(&named, NULL, &other))) {
            fm_device_info got;
            fm_context_device(other, &got);
            CHECK(strcmp(got.name, info.name) == 0 && fm_context_backend(other) == FM_BACKEND_VULKAN);
        }
        vulkan_close(other);
    }
    const char *const missing[] = {wrong, "63", "-1", "0x0"};
    for (int i = 0; i < 4; i++) {
        vulkan_options named = {.device = missing[i], .no_validation = options->no_validation};
        fm_context *other = NULL;
        CHECK_FAILS(vulkan_open(&named, NULL, &other), FM_ERROR_NO_DEVICE);
        CHECK(other == NULL && strstr(fm_last_error(), info.name) && strstr(fm_last_error(), missing[i]));
    }
}

// The newest eight of these operations are known, and only they.
static void test_ticket_passes(fm_context *context, const fm_ticket *tickets, int count) {
    fm_pass passes[8];
    uint32_t listed;
    for (int i = 0; i < count; i++) {
        listed = 8;
        CHECK_OK(fm_ticket_passes(context, tickets[i], &listed, passes));
        CHECK(i < count - 8 ? listed == 0 : listed >= 2 && passes[0].bytes > 0 && passes[0].milliseconds >= 0);
    }
    CHECK_OK(fm_ticket_passes(context, 0, &listed, NULL));
    CHECK(listed == 0);
    CHECK_FAILS(fm_ticket_passes(context, tickets[count - 1] + 1, &listed, passes), FM_ERROR_INVALID_ARGUMENT);
    CHECK_FAILS(fm_ticket_passes(NULL, 0, &listed, passes), FM_ERROR_INVALID_ARGUMENT);
    CHECK_FAILS(fm_ticket_passes(context, 0, NULL, passes), FM_ERROR_INVALID_ARGUMENT);
}

static void test_tickets(fm_context *context) {
    enum { COUNT = 11 };
    fm_volume *solid[COUNT], *distance[COUNT];
    fm_ticket tickets[COUNT];
    const uint64_t voxels = (uint64_t)small.x * small.y * small.z;
    uint32_t *got = malloc(voxels * 4);
    for (uint64_t i = 0; i < COUNT; i++) {
        solid[i] = vulkan_one_voxel(context, small, i * 101 % voxels);
        distance[i] = vulkan_volume(context, small, FM_TYPE_U32);
    }
    // More in flight than there are command buffers, with no wait between.
    const fm_transform_desc desc = {.metric = FM_METRIC_L1};
    for (int i = 0; i < COUNT; i++) {
        CHECK_OK(fm_transform(context, &desc, solid[i], distance[i], NULL, &tickets[i]));
        CHECK(i == 0 || tickets[i] > tickets[i - 1]);
    }
    bool complete = false;
    CHECK_OK(fm_wait(context, tickets[COUNT - 1]));
    for (int i = 0; i < COUNT; i++) {
        CHECK_OK(fm_poll(context, tickets[i], &complete));
        CHECK(complete);
    }
    test_ticket_passes(context, tickets, COUNT);
    CHECK_OK(fm_wait(context, 0));
    CHECK_FAILS(fm_wait(context, tickets[COUNT - 1] + 1000), FM_ERROR_INVALID_ARGUMENT);
    CHECK_FAILS(fm_poll(context, UINT64_MAX, &complete), FM_ERROR_INVALID_ARGUMENT);
    for (uint64_t i = 0; i < COUNT; i++) {
        CHECK_OK(fm_volume_download(distance[i], got));
        CHECK(vulkan_wrong_l1(got, small, i * 101 % voxels) == 0);
    }
    // A copy of the result of a transform that may still run, and its pass.
    fm_ticket ticket = 0;
    CHECK_OK(fm_transform(context, &desc, solid[1], distance[0], NULL, &ticket));
    CHECK_OK(fm_volume_copy(context, distance[0], distance[2], &ticket));
    fm_pass passes[4] = {{0}};
    uint32_t count = 4;
    CHECK_OK(fm_context_passes(context, &count, passes));
    CHECK(count == 1 && strcmp(passes[0].name, "copy") == 0 && passes[0].bytes == 2 * voxels * 4);
    count = 4;
    CHECK_OK(fm_ticket_passes(context, ticket, &count, passes));
    CHECK(count == 1 && strcmp(passes[0].name, "copy") == 0 && passes[0].bytes == 2 * voxels * 4);
    CHECK_OK(fm_wait(context, ticket));
    CHECK_OK(fm_volume_download(distance[2], got));
    CHECK(vulkan_wrong_l1(got, small, 101) == 0);
    // Copies from and to the host are done on return.
    const fm_volume_desc host_desc = {.shape = small, .type = FM_TYPE_U32, .storage = FM_STORAGE_HOST};
    fm_volume *host = NULL;
    if (CHECK_OK(fm_volume_create(context, &host_desc, &host))) {
        CHECK_OK(fm_volume_copy(context, distance[3], host, &ticket));
        CHECK(ticket == 0 && vulkan_wrong_l1(fm_volume_data(host), small, 303) == 0);
        ticket = 77;
        CHECK_OK(fm_volume_copy(context, host, distance[4], &ticket));
        CHECK_OK(fm_volume_download(distance[4], got));
        CHECK(ticket == 0 && vulkan_wrong_l1(got, small, 303) == 0);
    }
    fm_volume_destroy(host);
    CHECK_FAILS(fm_volume_copy(context, distance[2], distance[2], NULL), FM_ERROR_INVALID_ARGUMENT);
    CHECK_FAILS(fm_volume_copy(context, distance[2], solid[2], NULL), FM_ERROR_INVALID_ARGUMENT);
    for (int i = 0; i < COUNT; i++) {
        fm_volume_destroy(solid[i]);
        fm_volume_destroy(distance[i]);
    }
    free(got);
}

static void test_transfer(fm_context *context, uint32_t bytes) {
    fm_volume *a = vulkan_volume(context, (fm_shape){bytes, 1, 1}, FM_TYPE_U8);
    fm_volume *b = vulkan_volume(context, (fm_shape){bytes, 1, 1}, FM_TYPE_U8);
    uint8_t *sent = malloc(bytes), *got = malloc(bytes + 1);
    if (CHECK(a && b && sent && got)) {
        for (uint32_t i = 0; i < bytes; i++) {
            sent[i] = (uint8_t)(i * 2654435761u >> 24);
        }
        memset(got, 0x5a, bytes + 1);
        CHECK_OK(fm_volume_upload(a, sent));
        fm_ticket ticket;
        CHECK_OK(fm_volume_copy(context, a, b, &ticket));
        CHECK_OK(fm_volume_download(b, got));
        CHECK(memcmp(got, sent, bytes) == 0 && got[bytes] == 0x5a);
        // The download used the command buffers; the copy's time is still to be had.
        uint32_t count = 1;
        fm_pass pass = {0};
        CHECK_OK(fm_context_passes(context, &count, &pass));
        CHECK(count == 1 && pass.bytes == 2 * (uint64_t)bytes);
    }
    free(sent);
    free(got);
    fm_volume_destroy(a);
    fm_volume_destroy(b);
}

static fm_memory memory_of(fm_context *context, const char *purpose) {
    enum { MOST = 32 };
    fm_memory rows[MOST];
    uint32_t count = MOST;
    CHECK_OK(fm_context_memory(context, &count, rows));
    for (uint32_t i = 0; i < count; i++) {
        if (rows[i].device && strcmp(rows[i].purpose, purpose) == 0) {
            return rows[i];
        }
    }
    CHECK(!"the purpose is listed");
    return (fm_memory){0};
}

static void test_memory(fm_context *context) {
    const uint64_t before = memory_of(context, "volumes").bytes;
    const fm_shape shape = {1 << 20, 3, 1};
    fm_volume *a = vulkan_volume(context, shape, FM_TYPE_U8);
    fm_volume *b = vulkan_volume(context, shape, FM_TYPE_U32);
    const uint64_t held = memory_of(context, "volumes").bytes - before;
    CHECK(held >= 15u << 20 && held < 16u << 20);
    fm_volume_destroy(b);
    CHECK(memory_of(context, "volumes").bytes - before < 4u << 20);
    CHECK(memory_of(context, "volumes").peak >= before + held);
    fm_volume_destroy(a);
    CHECK(memory_of(context, "volumes").bytes == before);
    CHECK(memory_of(context, "scratch").bytes > 0);
    CHECK_OK(fm_context_trim(context));
    CHECK(memory_of(context, "scratch").bytes == 0 && memory_of(context, "staging").bytes == 0);
    CHECK(memory_of(context, "scratch").peak > 0);
    test_tickets(context);
}

static void test_too_large(fm_context *context) {
    fm_device_info info;
    fm_context_device(context, &info);
    fm_volume *volume = NULL;
    fm_volume_desc desc = {.shape = {1 << 20, 1 << 20, 1 << 4}, .type = FM_TYPE_U32};
    CHECK_FAILS(fm_volume_create(context, &desc, &volume), FM_ERROR_OUT_OF_DEVICE_MEMORY);
    CHECK(volume == NULL && strstr(fm_last_error(), "67108864.0 MiB") && strstr(fm_last_error(), "MiB in all"));
    // One row past the largest allocation.
    const uint64_t rows = info.max_allocation / (1 << 20) + 1;
    if (rows << 20 <= info.memory && rows <= INT32_MAX) {
        desc = (fm_volume_desc){.shape = {1 << 20, (uint32_t)rows, 1}};
        CHECK_FAILS(fm_volume_create(context, &desc, &volume), FM_ERROR_OUT_OF_DEVICE_MEMORY);
        CHECK(strstr(fm_last_error(), "largest allocation") != NULL);
    }
    test_transfer(context, 1000);
}

static void test_export(fm_context *context) {
    fm_vulkan_device device;
    CHECK_OK(fm_context_vulkan(context, &device, NULL));
    fm_volume *plain = vulkan_volume(context, small, FM_TYPE_U8);
    fm_volume_desc desc = {.shape = small, .type = FM_TYPE_U32, .exportable = true};
    fm_volume *volume = NULL;
    int fd = -1;
    CHECK_FAILS(fm_volume_export_fd(plain, &fd), FM_ERROR_UNSUPPORTED);
    if (!device.has_external_memory_fd) {
        CHECK_FAILS(fm_volume_create(context, &desc, &volume), FM_ERROR_UNSUPPORTED);
    } else if (CHECK_OK(fm_volume_create(context, &desc, &volume))) {
        fm_volume_buffer buffer;
        CHECK_OK(fm_volume_vulkan(volume, &buffer));
        CHECK(buffer.size == (uint64_t)small.x * small.y * small.z * 4 && buffer.memory_size >= buffer.size + buffer.offset);
        struct stat status;
        if (CHECK_OK(fm_volume_export_fd(volume, &fd)) && CHECK(fd >= 0)) {
            CHECK(fstat(fd, &status) == 0);
            close(fd);
        }
    }
    fm_volume_destroy(plain);
    fm_volume_destroy(volume);
}

int main(int count, char **arguments) {
    vulkan_options options;
    if (!vulkan_parse(count, arguments, &options)) {
        return 2;
    }
    fm_context *context = NULL;
    fm_result result = vulkan_open(&options, NULL, &context);
    if (result == FM_ERROR_NO_DEVICE) {
        return vulkan_missing();
    }
    if (CHECK_OK(result)) {
        test_choice(&options, context);
        test_tickets(context);
        static const uint32_t sizes[] = {1, 15, 16, 17, HALF - 1, HALF, HALF + 1, 2 * HALF, 2 * HALF + 5, 4 * HALF + 3};
        for (size_t i = 0; i < sizeof sizes / sizeof sizes[0]; i++) {
            test_transfer(context, sizes[i]);
        }
        test_memory(context);
        test_too_large(context);
        test_export(context);
        vulkan_close(context);
    }
    // As on devices whose memory the host cannot map.
    setenv("FATHOM_STAGING", "1", 1);
    if (CHECK_OK(vulkan_open(&options, NULL, &context))) {
        test_tickets(context);
        for (uint32_t i = 0; i < 3; i++) {
            test_transfer(context, 2 * i * HALF + i + 1);
            test_transfer(context, (2 * i + 1) * HALF);
        }
        CHECK(memory_of(context, "staging").bytes >= 2 * HALF);
        test_memory(context);
        vulkan_close(context);
    }
    return check_summary();
}
