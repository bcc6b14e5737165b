// SPDX-License-Identifier: MIT
#include "bench.h"

#include <stdlib.h>
#include <string.h>

typedef struct fathom_state {
    fm_context *context;
    fm_transform_desc desc;
    fm_array input, output;
    fm_volume *solid, *distance;
    fm_device_info device;
} fathom_state;

static void fathom_release(void *opaque) {
    fathom_state *state = opaque;
    fm_volume_destroy(state->solid);
    fm_volume_destroy(state->distance);
    fm_context_trim(state->context);
    free(state);
}

static const char *prepare_on(bench_session *session, fm_backend backend, fm_algorithm algorithm, const bench_case *what,
                              const void *input, void *output, void **result) {
    fm_context *context = bench_session_context(session, backend);
    if (!context) {
        return fm_last_error();
    }
    fathom_state *state = calloc(1, sizeof *state);
    if (!state) {
        return "out of memory";
    }
    state->context = context;
    state->desc = bench_transform_desc(what);
    state->desc.algorithm = algorithm;
    // The input is only read; the array type serves inputs and outputs alike.
    state->input = (fm_array){(void *)(uintptr_t)input, what->input, what->scene_desc.shape};
    state->output = (fm_array){output, what->output, what->scene_desc.shape};
    fm_context_device(context, &state->device);
    fm_result status =
        fm_volume_create(context, &(fm_volume_desc){.shape = what->scene_desc.shape, .type = what->input}, &state->solid);
    if (status == FM_OK) {
        status =
            fm_volume_create(context, &(fm_volume_desc){.shape = what->scene_desc.shape, .type = what->output}, &state->distance);
    }
    if (status == FM_OK) {
        status = fm_volume_upload(state->solid, input);
    }
    if (status != FM_OK) {
        fathom_release(state);
        return fm_last_error();
    }
    *result = state;
    return NULL;
}

static const char *fathom_run(void *opaque) {
    fathom_state *state = opaque;
    fm_ticket ticket = 0;
    if (fm_transform(state->context, &state->desc, state->solid, state->distance, NULL, &ticket) != FM_OK ||
        fm_wait(state->context, ticket) != FM_OK) {
        return fm_last_error();
    }
    return NULL;
}

static const char *fathom_run_with_copies(void *opaque) {
    fathom_state *state = opaque;
    return fm_transform_host(state->context, &state->desc, &state->input, &state->output, NULL) == FM_OK ? NULL : fm_last_error();
}

static uint32_t fathom_passes(void *opaque, fm_pass passes[BENCH_MAX_PASSES]) {
    fathom_state *state = opaque;
    uint32_t count = BENCH_MAX_PASSES;
    return fm_context_passes(state->context, &count, passes) == FM_OK ? count : 0;
}

static uint32_t fathom_memory(void *opaque, fm_memory memory[BENCH_MAX_MEMORY]) {
    fathom_state *state = opaque;
    uint32_t count = BENCH_MAX_MEMORY;
    return fm_context_memory(state->context, &count, memory) == FM_OK ? count : 0;
}

static const char *fathom_device(void *opaque) {
    fathom_state *state = opaque;
    return state->device.name;
}

static const char *fathom_fetch(void *opaque) {
    fathom_state *state = opaque;
    return fm_volume_download(state->distance, state->output.data) == FM_OK ? NULL : fm_last_error();
}

const char *bench_engine_refuses(bench_session *session, const bench_engine *engine, const bench_case *what) {
    if (engine->max_voxels && bench_voxels(what) > engine->max_voxels) {
        return engine->limit;
    }
    return bench_session_context(session, engine->backend) ? NULL : fm_last_error();
}

static const char *cpu_prepare(bench_session *session, const bench_case *what, const void *input, void *output, void **state) {
    return prepare_on(session, FM_BACKEND_CPU, FM_ALGORITHM_AUTO, what, input, output, state);
}

static const char *vulkan_prepare(bench_session *session, const bench_case *what, const void *input, void *output, void **state) {
    return prepare_on(session, FM_BACKEND_VULKAN, FM_ALGORITHM_AUTO, what, input, output, state);
}

static const char *brute_prepare(bench_session *session, const bench_case *what, const void *input, void *output, void **state) {
    return prepare_on(session, FM_BACKEND_AUTO, FM_ALGORITHM_BRUTE_FORCE, what, input, output, state);
}

// The copy is of a volume of the output's type that holds a computed field.
static const char *copy_prepare(bench_session *session, const bench_case *what, const void *input, void *output, void **opaque) {
    const char *failure = prepare_on(session, FM_BACKEND_AUTO, FM_ALGORITHM_AUTO, what, input, output, opaque);
    if (failure) {
        return failure;
    }
    fathom_state *state = *opaque;
    fm_volume *copy;
    failure = fathom_run(state);
    if (failure) {
        fathom_release(state);
        return failure;
    }
    if (fm_volume_create(state->context, &(fm_volume_desc){.shape = what->scene_desc.shape, .type = what->output}, &copy) !=
        FM_OK) {
        fathom_release(state);
        return fm_last_error();
    }
    fm_volume_destroy(state->solid);
    state->solid = copy;
    fm_context_trim(state->context);
    return NULL;
}

static const char *copy_run(void *opaque) {
    fathom_state *state = opaque;
    return fm_volume_copy(state->context, state->distance, state->solid, NULL) == FM_OK ? NULL : fm_last_error();
}

static const bench_engine engines[] = {
    {"fathom-vulkan", "Fathom on a Vulkan device", FM_BACKEND_VULKAN, true, 0, NULL, vulkan_prepare, fathom_run,
     fathom_run_with_copies, fathom_passes, fathom_memory, fathom_device, fathom_fetch, fathom_release},
    {"fathom-cpu", "Fathom on the CPU", FM_BACKEND_CPU, true, 0, NULL, cpu_prepare, fathom_run, fathom_run_with_copies,
     fathom_passes, fathom_memory, fathom_device, fathom_fetch, fathom_release},
    {"brute-force", "Fathom's oracle, small grids only", FM_BACKEND_AUTO, true, 32 * 32 * 32,
     "its time is quadratic: it is measured up to 32 x 32 x 32", brute_prepare, fathom_run, fathom_run_with_copies, fathom_passes,
     fathom_memory, fathom_device, fathom_fetch, fathom_release},
    {"copy", "fm_volume_copy of a volume of the output's type", FM_BACKEND_AUTO, false, 0, NULL, copy_prepare, copy_run, NULL,
     fathom_passes, fathom_memory, fathom_device, NULL, fathom_release},
};
enum { ENGINE_COUNT = sizeof engines / sizeof engines[0] };

const bench_engine *bench_engine_at(uint32_t i) {
    return i < ENGINE_COUNT ? &engines[i] : NULL;
}

const bench_engine *bench_engine_find(const char *name) {
    for (uint32_t i = 0; i < ENGINE_COUNT; i++) {
        if (strcmp(engines[i].name, name) == 0) {
            return &engines[i];
        }
    }
    return NULL;
}

uint64_t bench_voxels(const bench_case *what) {
    const fm_shape shape = what->scene_desc.shape;
    return (uint64_t)shape.x * shape.y * shape.z;
}

fm_transform_desc bench_transform_desc(const bench_case *what) {
    return (fm_transform_desc){.metric = what->metric,
                               .squared = what->metric == FM_METRIC_L2 && what->output == FM_TYPE_U32,
                               .saturate = what->output == FM_TYPE_U8 || what->output == FM_TYPE_U16};
}
