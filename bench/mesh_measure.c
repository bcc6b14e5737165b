// SPDX-License-Identifier: MIT
#include "mesh.h"
#include "words.h"

#include <stdlib.h>
#include <string.h>

enum { LEAST_FRAMES = 3, PASSES_AT_ONCE = 32 };

typedef struct timings {
    double wall[BENCH_STATS_MAX], kernels[BENCH_STATS_MAX], move[BENCH_STATS_MAX];
    double passes[BENCH_MAX_PASSES * BENCH_STATS_MAX];
} timings;

// The passes of a frame, which may take several operations.
typedef struct frame_passes {
    fm_pass all[BENCH_MAX_PASSES];
    uint32_t count;
} frame_passes;

static bool add_passes(const bench_mesh_state *state, const char *only, frame_passes *passes) {
    fm_pass found[PASSES_AT_ONCE];
    uint32_t count = PASSES_AT_ONCE;
    if (fm_context_passes(state->context, &count, found) != FM_OK) {
        return false;
    }
    for (uint32_t i = 0; i < count && passes->count < BENCH_MAX_PASSES; i++) {
        if (!only || strcmp(found[i].name, only) == 0) {
            passes->all[passes->count++] = found[i];
        }
    }
    return true;
}

static bool coarse_frame(bench_mesh_state *state, frame_passes *passes) {
    const fm_transform_desc transform = {.spacing = {state->grid.spacing[0], state->grid.spacing[1], state->grid.spacing[2]}};
    return fm_mesh_voxelize(state->mesh, NULL, state->voxels, NULL) == FM_OK && add_passes(state, NULL, passes) &&
           fm_transform(state->context, &transform, state->voxels, state->field, NULL, NULL) == FM_OK &&
           add_passes(state, NULL, passes);
}

static bool exact_frame(bench_mesh_state *state, frame_passes *passes) {
    const fm_sdf_desc desc = {.band = state->what->band, .sign = state->what->sign};
    fm_mesh *mesh = state->scene ? fm_scene_mesh(state->scene) : state->mesh;
    return fm_mesh_sdf(mesh, &desc, state->field, NULL, NULL, NULL) == FM_OK && add_passes(state, NULL, passes);
}

// On the processor vertices move without a pass.
static bool scene_frame(bench_mesh_state *state, frame_passes *passes) {
    const bool device = fm_context_backend(state->context) == FM_BACKEND_VULKAN;
    return fm_scene_update(state->scene, FM_TREE_REFIT, NULL) == FM_OK && (!device || add_passes(state, NULL, passes)) &&
           exact_frame(state, passes);
}

// A ray that hits nothing much makes the tree follow the mesh.
static bool tree_frame(bench_mesh_state *state, frame_passes *passes) {
    const fm_mesh_ray ray = {.direction = {1, 0, 0}, .last = 1e-6f};
    fm_mesh_hit hit;
    const double start = fm_now_ms();
    if (fm_mesh_cast(state->mesh, &ray, 1, true, &hit) != FM_OK || !add_passes(state, "tree", passes)) {
        return false;
    }
    if (fm_context_backend(state->context) == FM_BACKEND_CPU) {
        // Queries have no passes there, and the ray takes next to nothing.
        passes->all[0] = (fm_pass){.name = "tree", .milliseconds = fm_now_ms() - start};
        passes->count = 1;
    }
    return true;
}

static bool frame(bench_mesh_state *state, frame_passes *passes) {
    passes->count = 0;
    switch (state->what->mode) {
    case BENCH_MESH_RTSDF:
        return fm_rtsdf_update(state->rtsdf, state->mesh, NULL) == FM_OK && add_passes(state, NULL, passes);
    case BENCH_MESH_COARSE:
        return coarse_frame(state, passes);
    case BENCH_MESH_EXACT:
        return exact_frame(state, passes);
    case BENCH_MESH_COMPOSE:
        return fm_composed_update(state->composed, NULL) == FM_OK && add_passes(state, NULL, passes);
    case BENCH_MESH_SCENE:
        return scene_frame(state, passes);
    default:
        return tree_frame(state, passes);
    }
}

static bool move(bench_mesh_state *state, uint32_t pose) {
    const fm_tree tree = state->what->mode == BENCH_MESH_BUILD ? FM_TREE_REBUILD : FM_TREE_REFIT;
    state->pose = pose % BENCH_MESH_POSES;
    if (state->scene) {
        return bench_mesh_scene_move(state->what, state->scene, state->pose);
    }
    return fm_mesh_deform(state->mesh, (const float(*)[3])state->what->mesh->poses[state->pose], tree) == FM_OK;
}

static const char *note(bench_mesh_result *result, const frame_passes *passes, uint32_t run, timings *times) {
    if (run > 0 && passes->count != result->pass_count) {
        return "the passes differ from frame to frame";
    }
    times->kernels[run] = 0;
    result->pass_count = passes->count;
    result->bytes = 0;
    for (uint32_t p = 0; p < passes->count; p++) {
        result->passes[p].name = passes->all[p].name;
        result->passes[p].bytes = passes->all[p].bytes;
        result->bytes += passes->all[p].bytes;
        times->passes[p * BENCH_STATS_MAX + run] = passes->all[p].milliseconds;
        times->kernels[run] += passes->all[p].milliseconds;
    }
    return NULL;
}

static const char *time_frames(bench_mesh_state *state, const bench_mesh_limits *limits, timings *times,
                               bench_mesh_result *result) {
    frame_passes passes;
    uint32_t pose = 0;
    const double begin = fm_now_ms();
    for (int i = 0; i < 2 || fm_now_ms() - begin < limits->warm_up_ms; i++) {
        if (!move(state, ++pose) || !frame(state, &passes)) {
            return fm_last_error();
        }
    }
    const double first = fm_now_ms();
    uint32_t run = 0;
    const char *failure = NULL;
    while (!failure && run < limits->frames && (run < LEAST_FRAMES || fm_now_ms() - first < limits->seconds * 1e3)) {
        const double start = fm_now_ms();
        const bool moved = move(state, ++pose);
        const double middle = fm_now_ms();
        if (!moved || !frame(state, &passes)) {
            return fm_last_error();
        }
        times->wall[run] = fm_now_ms() - middle;
        times->move[run] = middle - start;
        failure = note(result, &passes, run++, times);
    }
    if (!failure) {
        result->wall = bench_stats_of(times->wall, run);
        result->move = bench_stats_of(times->move, run);
        result->kernels = bench_stats_of(times->kernels, run);
        for (uint32_t p = 0; p < result->pass_count; p++) {
            result->passes[p].time = bench_stats_of(times->passes + p * BENCH_STATS_MAX, run);
        }
    }
    return failure;
}

static bool prepare_rtsdf(bench_mesh_state *state) {
    const bench_mesh_case *what = state->what;
    fm_rtsdf_desc desc = {
        .coarse = {what->edge, what->edge, what->edge}, .flood = what->flood, .mask = what->mask, .rays = what->rays};
    memcpy(desc.low, what->mesh->low, sizeof desc.low);
    memcpy(desc.high, what->mesh->high, sizeof desc.high);
    return fm_rtsdf_create(state->context, &desc, &state->rtsdf) == FM_OK;
}

static bool prepare_scene(bench_mesh_state *state) {
    const bench_mesh_case *what = state->what;
    state->grid = bench_mesh_grid(what);
    state->scene = bench_mesh_scene(what, state->context, 0);
    if (!state->scene || what->mode == BENCH_MESH_SCENE) {
        return state->scene && fm_volume_create(state->context, &state->grid, &state->field) == FM_OK;
    }
    fm_composed_desc desc = {.shape = state->grid.shape, .band = what->band, .sign = what->sign};
    memcpy(desc.spacing, state->grid.spacing, sizeof desc.spacing);
    memcpy(desc.origin, state->grid.origin, sizeof desc.origin);
    return fm_composed_create(state->scene, &desc, &state->composed) == FM_OK;
}

static bool prepare(bench_mesh_state *state) {
    const bench_mesh_case *what = state->what;
    if (bench_mesh_objects(what) > 1) {
        return prepare_scene(state);
    }
    state->mesh = bench_mesh_on(what->mesh, state->context, 0);
    if (!state->mesh || what->mode >= BENCH_MESH_BUILD) {
        return state->mesh != NULL;
    }
    if (what->mode == BENCH_MESH_RTSDF) {
        return prepare_rtsdf(state);
    }
    state->grid = bench_mesh_grid(what);
    fm_volume_desc voxels = state->grid;
    voxels.type = FM_TYPE_BITS;
    return fm_volume_create(state->context, &state->grid, &state->field) == FM_OK &&
           (what->mode == BENCH_MESH_EXACT || fm_volume_create(state->context, &voxels, &state->voxels) == FM_OK);
}

static const char *measure(bench_session *session, bench_mesh_state *state, const bench_mesh_limits *limits, timings *times,
                           bench_mesh_result *result) {
    const char *failure = time_frames(state, limits, times, result);
    if (failure) {
        return failure;
    }
    result->bandwidth = bench_session_bandwidth(session, FM_BACKEND_AUTO);
    if (result->bandwidth <= 0) {
        return fm_last_error();
    }
    result->floor_ms = (double)result->bytes / result->bandwidth * 1e3;
    result->memory_count = BENCH_MAX_MEMORY;
    if (fm_context_memory(state->context, &result->memory_count, result->memory) != FM_OK) {
        return fm_last_error();
    }
    return bench_mesh_check(session, state, limits->samples, result);
}

bool bench_mesh_measure(bench_session *session, const bench_mesh_case *what, const bench_mesh_limits *limits,
                        bench_mesh_result *result) {
    memset(result, 0, sizeof *result);
    result->what = *what;
    bench_mesh_state state = {.what = what, .context = bench_session_context(session, FM_BACKEND_AUTO)};
    timings *times = malloc(sizeof *times);
    const char *failure = times ? NULL : "out of memory";
    if (!failure && state.context) {
        fm_device_info device;
        fm_context_device(state.context, &device);
        snprintf(result->device, sizeof result->device, "%s", device.name);
    }
    if (!failure) {
        failure = state.context && prepare(&state) ? measure(session, &state, limits, times, result) : fm_last_error();
    }
    if (failure) {
        snprintf(result->failure, sizeof result->failure, "%s", failure);
    }
    fm_rtsdf_destroy(state.rtsdf);
    fm_volume_destroy(state.voxels);
    fm_volume_destroy(state.field);
    fm_composed_destroy(state.composed);
    fm_scene_destroy(state.scene);
    fm_mesh_destroy(state.mesh);
    if (state.context) {
        fm_context_trim(state.context);
    }
    free(times);
    return !failure;
}

double bench_mesh_pass(const bench_mesh_result *result, const char *name) {
    double sum = 0;
    for (uint32_t p = 0; p < result->pass_count; p++) {
        sum += strcmp(result->passes[p].name, name) == 0 ? result->passes[p].time.median : 0;
    }
    return sum;
}
