// SPDX-License-Identifier: MIT
// The Vulkan layer below the public calls: memory by purpose, transfers at an offset, fills, copies and indirect dispatch.

#include "gpu/compute.h"
#include "shaders/include/shared.h"
#include "volume/context.h"
#include "vulkan_common.h"

enum {
    GROUP_BYTES = 16384,  // that a group of the copying kernel moves
    GROUPS = 5,
    BYTES = GROUPS * GROUP_BYTES,
    HALF = 32 << 20,  // of the staging memory
};

static fm_buffer *make(fm_gpu *gpu, fm_purpose purpose, uint64_t bytes) {
    fm_buffer *buffer = NULL;
    CHECK_OK(fm_buffer_create(gpu, purpose, bytes, false, &buffer));
    return buffer;
}

static void scramble(uint8_t *bytes, uint64_t count, uint32_t seed) {
    for (uint64_t i = 0; i < count; i++) {
        bytes[i] = (uint8_t)(((uint32_t)i + seed) * 2654435761u >> 23);
    }
}

static void test_purposes(fm_context *context, bool staged) {
    fm_gpu *gpu = context->gpu;
    for (fm_purpose i = 0; i < FM_PURPOSE_COUNT; i++) {
        const fm_meter before = fm_gpu_meter(gpu, i);
        fm_buffer *buffer = make(gpu, i, BYTES);
        if (!buffer) {
            continue;
        }
        CHECK(fm_gpu_meter(gpu, i).bytes - before.bytes >= BYTES);
        uint32_t *mapped = fm_buffer_mapped(buffer);
        if (i >= FM_HOST_PURPOSES) {
            CHECK(mapped != NULL);
        } else if (staged || (i == FM_PURPOSE_VOXELS && !context->device.host_visible_memory)) {
            CHECK(mapped == NULL);
        } else if (i == FM_PURPOSE_VOXELS) {
            CHECK(mapped != NULL);
        }
        // What the host writes through the mapping the device sees, and the other way round.
        fm_slot *slot = NULL;
        fm_buffer *other = make(gpu, FM_PURPOSE_READBACK, BYTES);
        if (mapped && other && CHECK_OK(fm_commands_begin(gpu, &slot))) {
            scramble((uint8_t *)mapped, BYTES, i);
            fm_commands_copy(gpu, slot, buffer, 0, other, 0, BYTES);
            fm_commands_barrier(gpu, slot);
            fm_commands_fill(gpu, slot, buffer, 8, BYTES - 16, 0xfedcba98);
            CHECK_OK(fm_commands_submit(gpu, slot, NULL));
            uint8_t wanted[16];
            scramble(wanted, sizeof wanted, i);
            CHECK(memcmp(fm_buffer_mapped(other), wanted, sizeof wanted) == 0 && memcmp(mapped, wanted, 8) == 0);
            CHECK(mapped[2] == 0xfedcba98 && mapped[BYTES / 4 - 3] == 0xfedcba98 && mapped[BYTES / 4 - 2] != 0xfedcba98);
        }
        fm_buffer_destroy(other);
        fm_buffer_destroy(buffer);
        CHECK(fm_gpu_meter(gpu, i).bytes == before.bytes);
    }
}

// The public listing: what the host holds, then the device.
static void test_listing(fm_context *context) {
    enum { ROWS = FM_HOST_PURPOSES + FM_PURPOSE_COUNT };
    fm_memory rows[ROWS + 1];
    uint32_t count = ROWS + 1;
    fm_buffer *buffer = make(context->gpu, FM_PURPOSE_UPDATE, BYTES);
    CHECK_OK(fm_context_memory(context, &count, rows));
    CHECK(count == ROWS);
    for (uint32_t i = 0; i < count; i++) {
        const bool device = i >= FM_HOST_PURPOSES;
        const fm_purpose purpose = device ? i - FM_HOST_PURPOSES : i;
        const fm_meter meter = device ? fm_gpu_meter(context->gpu, purpose) : context->host[purpose];
        CHECK(rows[i].device == device && strcmp(rows[i].purpose, fm_purpose_name(purpose)) == 0);
        CHECK(rows[i].bytes == meter.bytes && rows[i].peak == meter.peak);
        CHECK((rows[i].bytes >= BYTES) == (device && purpose == FM_PURPOSE_UPDATE));
        for (uint32_t j = device ? FM_HOST_PURPOSES : 0; j < i; j++) {
            CHECK(strcmp(rows[i].purpose, rows[j].purpose) != 0);
        }
    }
    fm_buffer_destroy(buffer);
}

// Pieces at odd places, around the size of the staging memory's halves.
static void test_offsets(fm_gpu *gpu, fm_purpose purpose) {
    static const uint64_t offsets[] = {0, 1, 17, 4096, HALF + 3};
    static const uint64_t sizes[] = {0, 1, 15, 1000, HALF, HALF + 1};
    const uint64_t total = 2 * (uint64_t)HALF + 4;
    fm_buffer *buffer = make(gpu, purpose, total);
    uint8_t *wanted = calloc(total, 1), *got = malloc(total);
    if (CHECK(buffer && wanted && got)) {
        CHECK_OK(fm_buffer_upload_at(buffer, 0, wanted, total));
        for (uint32_t i = 0; i < sizeof offsets / sizeof offsets[0]; i++) {
            for (uint32_t j = 0; j < sizeof sizes / sizeof sizes[0]; j++) {
                scramble(got, sizes[j], 100 * i + j);
                memcpy(wanted + offsets[i], got, sizes[j]);
                CHECK_OK(fm_buffer_upload_at(buffer, offsets[i], got, sizes[j]));
                memset(got, 0x5a, sizes[j] + 1);
                CHECK_OK(fm_buffer_download_at(buffer, offsets[i], got, sizes[j]));
                CHECK(memcmp(got, wanted + offsets[i], sizes[j]) == 0 && got[sizes[j]] == 0x5a);
            }
        }
        CHECK_OK(fm_buffer_download_at(buffer, 0, got, total));
        CHECK(memcmp(got, wanted, total) == 0);
    }
    free(wanted);
    free(got);
    fm_buffer_destroy(buffer);
}

// How the counts of an indirect dispatch come to be where it reads them.
typedef enum counts_way { BY_HOST, BY_UPLOAD, BY_FILL, BY_COPY, BY_KERNEL, WAYS } counts_way;

typedef struct indirect_buffers {
    fm_buffer *source, *target, *counts, *upload;
} indirect_buffers;

static fm_result copy_kernel(fm_gpu *gpu, fm_slot *slot, const fm_buffer *source, const fm_buffer *target, uint64_t bytes,
                             const fm_buffer *indirect, uint64_t offset) {
    const fm_copy_push push = {fm_buffer_address(source), fm_buffer_address(target), bytes / 16};
    const fm_dispatch dispatch = {.kernel = FM_KERNEL_COPY,
                                  .push = &push,
                                  .push_bytes = sizeof push,
                                  .groups = fm_div_up(bytes, GROUP_BYTES),
                                  .indirect = indirect,
                                  .indirect_offset = offset};
    return fm_commands_dispatch(gpu, slot, &dispatch);
}

static void test_indirect(fm_gpu *gpu, const indirect_buffers *buffers, counts_way way, uint32_t groups) {
    enum { AT = 20 };  // of the counts, in bytes
    const uint32_t counts[8] = {7, 7, 7, 7, 7, groups, 1, 1}, stale[8] = {7, 7, 7, 7, 7, 7, 7, 7};
    uint8_t *wanted = malloc(BYTES), *got = malloc(BYTES);
    fm_slot *slot = NULL;
    if (!CHECK(wanted && got)) {
        return;
    }
    CHECK_OK(fm_buffer_upload_at(buffers->counts, 0, way == BY_UPLOAD ? counts : stale, sizeof counts));
    scramble(wanted, BYTES, groups);
    CHECK_OK(fm_buffer_upload_at(buffers->source, 0, wanted, BYTES));
    const fm_buffer *indirect = way == BY_HOST ? buffers->upload : buffers->counts;
    memcpy(fm_buffer_mapped(buffers->upload), counts, sizeof counts);
    if (CHECK_OK(fm_commands_begin(gpu, &slot))) {
        fm_commands_fill(gpu, slot, buffers->target, 0, BYTES, 0x5a5a5a5a);
        if (way == BY_FILL) {
            fm_commands_fill(gpu, slot, buffers->counts, AT, 4, groups);
            fm_commands_fill(gpu, slot, buffers->counts, AT + 4, 8, 1);
            fm_commands_fill(gpu, slot, buffers->counts, 0, 0, 9);
        } else if (way == BY_COPY) {
            fm_commands_copy(gpu, slot, buffers->upload, AT, buffers->counts, AT, 12);
            fm_commands_copy(gpu, slot, buffers->upload, 0, buffers->counts, 0, 0);
        } else if (way == BY_KERNEL) {
            CHECK_OK(copy_kernel(gpu, slot, buffers->upload, buffers->counts, sizeof counts, NULL, 0));
        }
        fm_commands_barrier(gpu, slot);
        CHECK_OK(copy_kernel(gpu, slot, buffers->source, buffers->target, BYTES, indirect, AT));
        fm_commands_pass(gpu, slot, "indirect", 2 * BYTES);
        fm_ticket ticket = 0;
        CHECK_OK(fm_commands_submit(gpu, slot, &ticket));
        CHECK(ticket == fm_gpu_newest(gpu));
        CHECK_OK(fm_gpu_wait(gpu, ticket));
    }
    CHECK_OK(fm_buffer_download_at(buffers->target, 0, got, BYTES));
    memset(wanted + (uint64_t)groups * GROUP_BYTES, 0x5a, BYTES - (uint64_t)groups * GROUP_BYTES);
    CHECK(memcmp(got, wanted, BYTES) == 0);
    free(wanted);
    free(got);
}

static void test_layer(const vulkan_options *options, bool staged) {
    fm_context *context = NULL;
    if (!CHECK_OK(vulkan_open(options, NULL, &context))) {
        return;
    }
    fm_gpu *gpu = context->gpu;
    CHECK(fm_gpu_newest(gpu) == 0);
    test_listing(context);
    test_purposes(context, staged);
    test_offsets(gpu, FM_PURPOSE_VOXELS);
    test_offsets(gpu, FM_PURPOSE_FIELD);
    test_offsets(gpu, FM_PURPOSE_UPLOAD);
    const indirect_buffers buffers = {make(gpu, FM_PURPOSE_VOXELS, BYTES), make(gpu, FM_PURPOSE_FIELD, BYTES),
                                      make(gpu, FM_PURPOSE_UPDATE, 64), make(gpu, FM_PURPOSE_UPLOAD, 64)};
    if (CHECK(buffers.source && buffers.target && buffers.counts && buffers.upload)) {
        for (counts_way way = 0; way < WAYS; way++) {
            for (uint32_t groups = 0; groups <= GROUPS; groups++) {
                test_indirect(gpu, &buffers, way, groups);
            }
        }
    }
    fm_buffer_destroy(buffers.source);
    fm_buffer_destroy(buffers.target);
    fm_buffer_destroy(buffers.counts);
    fm_buffer_destroy(buffers.upload);
    vulkan_close(context);
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
    CHECK_OK(result);
    vulkan_close(context);
    test_layer(&options, false);
    setenv("FATHOM_STAGING", "1", 1);
    test_layer(&options, true);
    return check_summary();
}
