// SPDX-License-Identifier: MIT
#include "bench.h"
#include "noise.h"
#include "parallel.h"
#include "words.h"

#include <stdlib.h>
#include <string.h>

enum { COPY_RUNS = 15, COPY_WARM_UP = 2 };

struct bench_session {
    bench_session_desc desc;  // backend is no longer AUTO once a context has been made
    fm_context *contexts[FM_BACKEND_VULKAN + 1];
    double bandwidths[FM_BACKEND_VULKAN + 1];
};

bench_session *bench_session_create(const bench_session_desc *desc) {
    bench_session *session = calloc(1, sizeof *session);
    if (session) {
        session->desc = *desc;
    }
    return session;
}

void bench_session_destroy(bench_session *session) {
    for (int i = 0; session && i <= FM_BACKEND_VULKAN; i++) {
        fm_context_destroy(session->contexts[i]);
    }
    free(session);
}

fm_context *bench_session_context(bench_session *session, fm_backend backend) {
    backend = backend == FM_BACKEND_AUTO ? session->desc.backend : backend;
    if (session->contexts[backend]) {
        return session->contexts[backend];
    }
    fm_context_desc desc = {.backend = backend, .threads = session->desc.threads};
    desc.device = backend == FM_BACKEND_CPU ? NULL : session->desc.device;
    fm_context *context;
    if (fm_context_create(&desc, &context) != FM_OK) {
        return NULL;
    }
    if (backend == FM_BACKEND_AUTO) {
        backend = fm_context_backend(context);
        session->desc.backend = backend;
        if (session->contexts[backend]) {
            fm_context_destroy(context);
            return session->contexts[backend];
        }
    }
    session->contexts[backend] = context;
    return context;
}

typedef struct copy_job {
    const uint8_t *source;
    uint8_t *target;
    uint64_t part;
} copy_job;

static void fill_part(void *user, uint64_t i) {
    const copy_job *job = user;
    uint64_t *words = (uint64_t *)(void *)(job->target + i * job->part);
    for (uint64_t k = 0; k < job->part / sizeof *words; k++) {
        words[k] = fm_mix(i * job->part + k);
    }
}

static void copy_part(void *user, uint64_t i) {
    const copy_job *job = user;
    memcpy(job->target + i * job->part, job->source + i * job->part, job->part);
}

// fm_volume_copy between host volumes runs on one thread, which a transform on several is not bounded by.
static double host_copy(uint32_t threads, const uint8_t *source, uint8_t *target, uint64_t bytes) {
    const uint64_t parts = 64;
    copy_job job = {source, target, bytes / parts};
    double times[COPY_RUNS];
    for (int i = -COPY_WARM_UP; i < COPY_RUNS; i++) {
        const double start = fm_now_ms();
        fm_parallel(threads, parts, copy_part, &job);
        if (i >= 0) {
            times[i] = fm_now_ms() - start;
        }
    }
    return 2 * (double)bytes * 1e3 / bench_stats_of(times, COPY_RUNS).median;
}

static double device_copy(fm_context *context, const fm_volume_desc *desc, const void *data, uint64_t bytes) {
    fm_volume *source = NULL, *target = NULL;
    double times[COPY_RUNS];
    fm_result result = fm_volume_create(context, desc, &source);
    result = result == FM_OK ? fm_volume_create(context, desc, &target) : result;
    result = result == FM_OK ? fm_volume_upload(source, data) : result;
    for (int i = -COPY_WARM_UP; result == FM_OK && i < COPY_RUNS; i++) {
        fm_pass pass;
        uint32_t count = 1;
        result = fm_volume_copy(context, source, target, NULL);
        result = result == FM_OK ? fm_context_passes(context, &count, &pass) : result;
        if (result == FM_OK && i >= 0) {
            times[i] = pass.milliseconds;
        }
    }
    fm_volume_destroy(target);
    fm_volume_destroy(source);
    return result == FM_OK ? 2 * (double)bytes * 1e3 / bench_stats_of(times, COPY_RUNS).median : 0;
}

double bench_session_bandwidth(bench_session *session, fm_backend backend) {
    fm_context *context = bench_session_context(session, backend);
    if (!context) {
        return 0;
    }
    backend = fm_context_backend(context);
    if (session->desc.bandwidth > 0 && backend == session->desc.backend) {
        return session->desc.bandwidth;
    }
    if (session->bandwidths[backend] > 0) {
        return session->bandwidths[backend];
    }
    fm_device_info device;
    fm_context_device(context, &device);
    // Beyond any cache, within any memory.
    const bool small = device.kind == FM_DEVICE_HOST || device.kind == FM_DEVICE_SOFTWARE || device.memory < (uint64_t)16 << 30;
    const uint64_t bytes = (uint64_t)(small ? 256 : 1024) << 20;
    const fm_volume_desc desc = {.shape = {1024, 1024, (uint32_t)(bytes >> 20)}, .type = FM_TYPE_U8};
    const fm_volume_desc host = {.shape = desc.shape, .type = desc.type, .storage = FM_STORAGE_HOST};
    fm_volume *source = NULL, *target = NULL;
    double bandwidth = 0;
    if (fm_volume_create(NULL, &host, &source) == FM_OK) {
        fm_parallel(session->desc.threads, 64, fill_part, &(copy_job){NULL, fm_volume_data(source), bytes / 64});
        if (backend == FM_BACKEND_VULKAN) {
            bandwidth = device_copy(context, &desc, fm_volume_data(source), bytes);
        } else if (fm_volume_create(NULL, &host, &target) == FM_OK) {
            bandwidth = host_copy(session->desc.threads, fm_volume_data(source), fm_volume_data(target), bytes);
        }
    }
    fm_volume_destroy(source);
    fm_volume_destroy(target);
    session->bandwidths[backend] = bandwidth;
    return bandwidth;
}
