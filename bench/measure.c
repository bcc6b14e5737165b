// SPDX-License-Identifier: MIT
#include "bench.h"
#include "words.h"

#include <stdlib.h>
#include <string.h>

// Warming up lasts until both are reached, so that clocks have risen (a GPU found idle ran its passes three times as long for up to
// half a second) and pages have been touched; but no more than half of the time that a case has.
enum { WARM_UP_RUNS = 2, WARM_UP_MS = 1000 };
enum { LEAST_RUNS = 3, MOST_COPY_RUNS = 7 };

// The timings of one case, a value a run; those of pass p begin at p * BENCH_STATS_MAX.
typedef struct timings {
    double wall[BENCH_STATS_MAX], kernels[BENCH_STATS_MAX];
    double passes[BENCH_MAX_PASSES * BENCH_STATS_MAX];
} timings;

static void note_passes(bench_result *result, const fm_pass *passes, uint32_t count, uint32_t run, timings *times) {
    times->kernels[run] = 0;
    result->pass_count = count;
    result->bytes = 0;
    for (uint32_t p = 0; p < count; p++) {
        result->passes[p].name = passes[p].name;
        result->passes[p].bytes = passes[p].bytes;
        result->bytes += passes[p].bytes;
        times->passes[p * BENCH_STATS_MAX + run] = passes[p].milliseconds;
        times->kernels[run] += passes[p].milliseconds;
    }
}

static const char *time_runs(const bench_engine *engine, void *state, const bench_limits *limits, timings *times,
                             bench_result *result) {
    const double begin = fm_now_ms();
    const char *failure = NULL;
    const double warm_up = limits->seconds * 500 < WARM_UP_MS ? limits->seconds * 500 : WARM_UP_MS;
    for (int i = 0; !failure && (i < WARM_UP_RUNS || fm_now_ms() - begin < warm_up); i++) {
        failure = engine->run(state);
    }
    const double first = fm_now_ms();
    uint32_t run = 0;
    while (!failure && run < limits->runs && (run < LEAST_RUNS || fm_now_ms() - first < limits->seconds * 1e3)) {
        const double start = fm_now_ms();
        failure = engine->run(state);
        times->wall[run] = fm_now_ms() - start;
        fm_pass passes[BENCH_MAX_PASSES];
        const uint32_t count = failure ? 0 : engine->passes(state, passes);
        if (!failure && run > 0 && count != result->pass_count) {
            failure = "the passes differ from run to run";
        }
        note_passes(result, passes, count, run, times);
        run++;
    }
    if (failure) {
        return failure;
    }
    result->wall = bench_stats_of(times->wall, run);
    result->kernels = bench_stats_of(times->kernels, run);
    for (uint32_t p = 0; p < result->pass_count; p++) {
        result->passes[p].time = bench_stats_of(times->passes + p * BENCH_STATS_MAX, run);
    }
    return NULL;
}

static const char *time_copies(const bench_engine *engine, void *state, const bench_limits *limits, bench_result *result) {
    double times[MOST_COPY_RUNS];
    const double begin = fm_now_ms();
    uint32_t run = 0;
    for (int i = 0; i <= MOST_COPY_RUNS && (run < 1 || fm_now_ms() - begin < limits->seconds * 1e3); i++) {
        const double start = fm_now_ms();
        const char *failure = engine->run_with_copies(state);
        if (failure) {
            return failure;
        }
        if (i > 0) {
            times[run++] = fm_now_ms() - start;
        }
    }
    result->copies = bench_stats_of(times, run);
    return NULL;
}

static const char *measure(bench_scene *scene, const bench_engine *engine, void *state, const bench_case *what, void *output,
                           uint64_t output_bytes, const bench_limits *limits, timings *times, bench_result *result) {
    const char *failure = time_runs(engine, state, limits, times, result);
    if (failure) {
        return failure;
    }
    result->memory_count = engine->memory(state, result->memory);
    for (uint32_t i = 0; i < result->memory_count; i++) {
        result->scratch += strcmp(result->memory[i].purpose, "scratch") == 0 ? result->memory[i].bytes : 0;
    }
    if (engine->computes_distances) {
        // What is checked must come from the engine, not from a run before it.
        memset(output, 0xa5, output_bytes);
        failure = engine->fetch(state);
        if (failure) {
            return failure;
        }
        static _Thread_local char message[256];
        result->samples = limits->samples;
        result->wrong = bench_scene_check(scene, what, output, limits->samples, message, sizeof message);
        if (result->wrong) {
            return message;
        }
    }
    return engine->run_with_copies ? time_copies(engine, state, limits, result) : NULL;
}

static const char *fill_floors(bench_session *session, const bench_case *what, uint64_t output_bytes, bench_result *result) {
    uint64_t input_bytes = 0;
    result->bandwidth = bench_session_bandwidth(session, result->engine->backend);
    if (result->bandwidth <= 0 || fm_array_bytes(what->scene_desc.shape, what->input, &input_bytes) != FM_OK) {
        return fm_last_error();
    }
    result->floor_ms = (double)result->bytes / result->bandwidth * 1e3;
    result->io_floor_ms = (double)(input_bytes + output_bytes) / result->bandwidth * 1e3;
    return NULL;
}

bool bench_measure(bench_session *session, bench_scene *scene, const bench_engine *engine, const bench_case *what,
                   const bench_limits *limits, bench_result *result) {
    memset(result, 0, sizeof *result);
    result->what = *what;
    result->engine = engine;
    result->solid = bench_scene_solid(scene);
    uint64_t output_bytes = 0;
    const char *failure = NULL;
    const void *input = bench_scene_input(scene, what->input);
    timings *times = malloc(sizeof *times);
    void *output = NULL, *state = NULL;
    if (fm_array_bytes(what->scene_desc.shape, what->output, &output_bytes) != FM_OK) {
        failure = fm_last_error();
    } else {
        output = malloc(output_bytes);
        failure = input && times && output ? NULL : "out of host memory";
    }
    failure = failure ? failure : engine->prepare(session, what, input, output, &state);
    if (!failure) {
        snprintf(result->device, sizeof result->device, "%s", engine->device(state));
        failure = measure(scene, engine, state, what, output, output_bytes, limits, times, result);
    }
    if (failure) {
        snprintf(result->failure, sizeof result->failure, "%s", failure);
    }
    if (state) {
        engine->release(state);
    }
    free(output);
    free(times);
    if (!failure && fill_floors(session, what, output_bytes, result)) {
        snprintf(result->failure, sizeof result->failure, "%s", fm_last_error());
    }
    return !result->failure[0];
}
