// SPDX-License-Identifier: MIT
// Vulkan when the host's memory ends at every possible place, in two threads at once, and on a machine without a driver
// (`--no-driver`: the caller has hidden it).

#include "vulkan_common.h"

#include <limits.h>
#include <pthread.h>
#include <stdatomic.h>

static const fm_shape shape = {21, 6, 5};
enum { VOXEL = 137 };

// Counts what is held and fails from call number `fail_at` on.
typedef struct counted {
    atomic_llong blocks, bytes;
    atomic_ulong calls;
    unsigned long fail_at;
} counted;

static void *counted_alloc(void *user, size_t size, size_t alignment) {
    counted *counts = user;
    if (atomic_fetch_add(&counts->calls, 1) >= counts->fail_at) {
        return NULL;
    }
    atomic_fetch_add(&counts->blocks, 1);
    atomic_fetch_add(&counts->bytes, (long long)size);
    return aligned_alloc(alignment, (size + alignment - 1) / alignment * alignment);
}

static void counted_free(void *user, void *memory, size_t size) {
    counted *counts = user;
    atomic_fetch_sub(&counts->blocks, 1);
    atomic_fetch_sub(&counts->bytes, (long long)size);
    free(memory);
}

static void check_l1(fm_context *context, fm_volume *solid, fm_volume *distance) {
    uint32_t got[21 * 6 * 5];
    const fm_transform_desc desc = {.metric = FM_METRIC_L1};
    CHECK_OK(fm_transform(context, &desc, solid, distance, NULL, NULL));
    CHECK_OK(fm_volume_download(distance, got));
    CHECK(vulkan_wrong_l1(got, shape, VOXEL) == 0);
}

static void test_context_fails(const vulkan_options *options) {
    counted counts = {0};
    const fm_allocator allocator = {counted_alloc, counted_free, &counts};
    fm_result result = FM_ERROR_OUT_OF_HOST_MEMORY;
    for (unsigned long n = 0; n < 100 && result != FM_OK; n++) {
        fm_context *context = NULL;
        counts.fail_at = n;
        atomic_store(&counts.calls, 0);
        result = vulkan_open(options, &allocator, &context);
        CHECK(n > 0 || result != FM_OK);
        if (result != FM_OK) {
            CHECK_FAILS(result, FM_ERROR_OUT_OF_HOST_MEMORY);
            CHECK(context == NULL);
        }
        vulkan_close(context);
        CHECK(counts.blocks == 0 && counts.bytes == 0);
    }
    CHECK(result == FM_OK);
}

// Each transform here needs pipelines that are not there yet, so that its recording stops half-way.
static void test_transform_fails(const vulkan_options *options) {
    static const fm_transform_desc descs[] = {
        {.metric = FM_METRIC_L2, .is_signed = true},
        {.metric = FM_METRIC_LINF, .outside = FM_OUTSIDE_SOLID},
        {.metric = FM_METRIC_L2, .algorithm = FM_ALGORITHM_BRUTE_FORCE, .is_signed = true},
    };
    counted counts = {.fail_at = ULONG_MAX};
    const fm_allocator allocator = {counted_alloc, counted_free, &counts};
    fm_context *context = NULL;
    if (!CHECK_OK(vulkan_open(options, &allocator, &context))) {
        return;
    }
    fm_volume *solid = vulkan_one_voxel(context, shape, VOXEL);
    fm_volume *distance = vulkan_volume(context, shape, FM_TYPE_U32);
    fm_volume *field = vulkan_volume(context, shape, FM_TYPE_F32);
    fm_volume *sites = vulkan_volume(context, shape, FM_TYPE_U32);
    unsigned long failures = 0;
    for (size_t i = 0; i < sizeof descs / sizeof descs[0]; i++) {
        CHECK_OK(fm_context_trim(context));
        fm_result result = FM_ERROR_OUT_OF_HOST_MEMORY;
        // Pipelines that were made are kept: each round gets one further.
        for (int round = 0; round < 30 && result != FM_OK; round++) {
            fm_ticket before = 0, ticket = 0;
            CHECK_OK(fm_volume_copy(context, distance, sites, &before));
            const long long blocks = counts.blocks;
            atomic_store(&counts.calls, 0);
            counts.fail_at = (unsigned long)round % 2;
            result = fm_transform(context, &descs[i], solid, field, sites, &ticket);
            counts.fail_at = ULONG_MAX;
            if (result != FM_OK) {
                failures++;
                CHECK_FAILS(result, FM_ERROR_OUT_OF_HOST_MEMORY);
                CHECK(counts.blocks - blocks <= round % 2 && ticket == 0);
                CHECK_FAILS(fm_wait(context, before + 1), FM_ERROR_INVALID_ARGUMENT);
                check_l1(context, solid, distance);
            }
        }
        CHECK_OK(result);
    }
    CHECK(failures >= 6);
    check_l1(context, solid, distance);
    // Host arrays, failing at every call.
    uint8_t bytes[21 * 6 * 5] = {[VOXEL] = 1};
    uint32_t got[21 * 6 * 5];
    const fm_array array = {bytes, FM_TYPE_U8, shape}, out = {got, FM_TYPE_U32, shape};
    const fm_transform_desc desc = {.metric = FM_METRIC_L1};
    CHECK_OK(fm_context_trim(context));
    fm_result result = FM_ERROR_OUT_OF_HOST_MEMORY;
    for (unsigned long n = 0; n < 30 && result != FM_OK; n++) {
        memset(got, 0x5a, sizeof got);
        atomic_store(&counts.calls, 0);
        counts.fail_at = n;
        result = fm_transform_host(context, &desc, &array, &out, NULL);
        counts.fail_at = ULONG_MAX;
        CHECK(result == FM_OK || got[3] == 0x5a5a5a5a);
        CHECK(result == FM_OK || result == FM_ERROR_OUT_OF_HOST_MEMORY);
    }
    CHECK(result == FM_OK && vulkan_wrong_l1(got, shape, VOXEL) == 0);
    fm_volume_destroy(solid);
    fm_volume_destroy(distance);
    fm_volume_destroy(field);
    fm_volume_destroy(sites);
    vulkan_close(context);
    CHECK(counts.blocks == 0 && counts.bytes == 0);
}

typedef struct thread_job {
    const vulkan_options *options;
    uint64_t wrong;
    fm_result result;
    uint64_t messages;
} thread_job;

static fm_result thread_work(thread_job *job, fm_context *context) {
    uint8_t bytes[21 * 6 * 5] = {[VOXEL] = 1};
    uint32_t got[21 * 6 * 5];
    const fm_array array = {bytes, FM_TYPE_U8, shape}, out = {got, FM_TYPE_U32, shape};
    const fm_transform_desc desc = {.metric = FM_METRIC_L1};
    for (int i = 0; i < 20; i++) {
        memset(got, 0, sizeof got);
        fm_result result = fm_transform_host(context, &desc, &array, &out, NULL);
        if (result != FM_OK) {
            return result;
        }
        job->wrong += vulkan_wrong_l1(got, shape, VOXEL);
    }
    job->messages = fm_context_validation_messages(context);
    return FM_OK;
}

static void *thread_main(void *user) {
    thread_job *job = user;
    fm_context *context = NULL;
    job->result = vulkan_open(job->options, NULL, &context);
    if (job->result == FM_OK) {
        job->result = thread_work(job, context);
    }
    fm_context_destroy(context);
    return NULL;
}

static void test_threads(const vulkan_options *options) {
    thread_job jobs[2] = {{.options = options}, {.options = options}};
    pthread_t threads[2];
    for (int i = 0; i < 2; i++) {
        if (!CHECK(pthread_create(&threads[i], NULL, thread_main, &jobs[i]) == 0)) {
            return;
        }
    }
    for (int i = 0; i < 2; i++) {
        pthread_join(threads[i], NULL);
        CHECK(jobs[i].result == FM_OK && jobs[i].wrong == 0 && jobs[i].messages == 0);
    }
}

static void test_no_driver(void) {
    fm_context *context = NULL;
    fm_context_desc desc = {.backend = FM_BACKEND_VULKAN};
    CHECK_FAILS(fm_context_create(&desc, &context), FM_ERROR_NO_DEVICE);
    CHECK(context == NULL && strstr(fm_last_error(), "Vulkan") != NULL);
    // Left to itself the library runs on the CPU.
    desc.backend = FM_BACKEND_AUTO;
    if (CHECK_OK(fm_context_create(&desc, &context))) {
        CHECK(fm_context_backend(context) == FM_BACKEND_CPU);
    }
    fm_context_destroy(context);
    char note[256] = "";
    uint32_t count = 0;
    CHECK_OK(fm_enumerate_devices(&count, NULL, note, sizeof note));
    CHECK(count == 1 && note[0] != 0);
}

int main(int count, char **arguments) {
    vulkan_options options;
    if (count == 2 && strcmp(arguments[1], "--no-driver") == 0) {
        test_no_driver();
        return check_summary();
    }
    if (!vulkan_parse(count, arguments, &options)) {
        return 2;
    }
    fm_context *context = NULL;
    fm_result result = vulkan_open(&options, NULL, &context);
    if (result == FM_ERROR_NO_DEVICE) {
        return vulkan_missing();
    }
    if (CHECK_OK(result)) {
        vulkan_close(context);
        test_context_fails(&options);
        test_transform_fails(&options);
        test_threads(&options);
    }
    return check_summary();
}
