// SPDX-License-Identifier: MIT
#include "noise.h"
#include "words.h"
#include "world.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>
#include <time.h>

// A GPU found idle runs its passes three times as long for up to half a second. Warming up takes at most half of the case's time.
enum { WARM_UP_MS = 1000, WARM_UP_EDITS = 20, WARM_UP_EDITS_MS = 250 };
enum { MAX_PASSES = 1024 };
// Numbers of updates that no script reaches.
#define WARM_UP_UPDATE ((uint64_t)1 << 32)

typedef struct run {
    bench_session *session;
    fm_context *context;
    fm_world *world;
    const bench_world_case *what;
    const bench_world_limits *limits;
    bench_world_result *result;
    fm_brush *brushes;
    fm_volume *awake[2];  // copied while waiting for the next update, so that the GPU does not fall asleep
} run;

fm_volume *bench_world_scene(const fm_scene *scene, const fm_scene_desc *desc) {
    fm_volume *volume;
    if (fm_volume_create(NULL, &(fm_volume_desc){.shape = desc->shape, .type = FM_TYPE_U8}, &volume) != FM_OK) {
        return NULL;
    }
    fm_scene_fill_threads(scene, desc, 0, desc->shape.z, 0, fm_volume_data(volume));
    if (fm_volume_set_palette(volume, fm_scene_palette()) != FM_OK) {
        fm_volume_destroy(volume);
        return NULL;
    }
    return volume;
}

static bool iterates(fm_world_algorithm algorithm) {
    return algorithm == FM_WORLD_FIM || algorithm == FM_WORLD_JFA_FIM;
}

fm_world_method bench_world_method(const fm_world_method *method) {
    fm_world_method m = *method;
    const bool selective = m.algorithm == FM_WORLD_SELECTIVE;
    if (m.algorithm == FM_WORLD_EXACT) {
        m.chunk = 0;
    }
    if (m.chunk == 0) {
        m.border = FM_BORDER_PADDING;
    }
    if (selective) {
        m.near_algorithm = m.near_algorithm ? m.near_algorithm : FM_WORLD_JFA_FIM;
        m.far_algorithm = m.far_algorithm ? m.far_algorithm : FM_WORLD_JFA_PUBLISHED;
    } else {
        m.near_algorithm = m.far_algorithm = FM_WORLD_EXACT;
        m.focus_chunks = 0;
        memset(m.focus, 0, sizeof m.focus);
    }
    if (!iterates(m.algorithm) && !(selective && iterates(m.near_algorithm))) {
        m.convergence = FM_CONVERGE_DEVICE;
    }
    return m;
}

const char *bench_world_refuses(const fm_world_desc *desc) {
    const fm_world_method m = bench_world_method(&desc->method);
    if (desc->format == FM_FIELD_SQUARED_U32 && m.algorithm != FM_WORLD_EXACT) {
        return "--format squared is for --algorithm exact";
    }
    if (m.chunk && m.border == FM_BORDER_EXCHANGE && !iterates(m.algorithm)) {
        return "--border exchange is for --algorithm fim and jfa-fim";
    }
    if (m.algorithm != FM_WORLD_SELECTIVE) {
        return NULL;
    }
    if (m.chunk == 0) {
        return "--algorithm selective needs --chunk: it chooses by chunk";
    }
    if (!iterates(m.near_algorithm)) {
        return "--near takes fim and jfa-fim";
    }
    const bool jumps = m.far_algorithm >= FM_WORLD_JFA_PUBLISHED && m.far_algorithm <= FM_WORLD_JFA_PLUS_2;
    return jumps ? NULL : "--far takes jfa-published, jfa, jfa-1+ and jfa+2";
}

double bench_world_fps(const bench_world_result *result) {
    return result->frame.median > 0 ? 1e3 / result->frame.median : 0;
}

double bench_world_per_voxel(const bench_world_result *result, uint64_t bytes) {
    const fm_shape shape = result->what.desc.shape;
    return (double)bytes / ((double)shape.x * shape.y * shape.z);
}

static const char *passes_ms(fm_context *context, double *sum) {
    fm_pass passes[MAX_PASSES];
    uint32_t count = MAX_PASSES;
    *sum = 0;
    if (fm_context_passes(context, &count, passes) != FM_OK) {
        return fm_last_error();
    }
    for (uint32_t i = 0; i < count; i++) {
        *sum += passes[i].milliseconds;
    }
    return NULL;
}

static const char *one_update(const run *r, bench_world_frame *frame) {
    const double start = fm_now_ms();
    fm_ticket ticket = 0;
    if (fm_world_update(r->world, &ticket) != FM_OK) {
        return fm_last_error();
    }
    frame->call_ms = fm_now_ms() - start;
    if (fm_wait(r->context, ticket) != FM_OK) {
        return fm_last_error();
    }
    frame->delta_ms = fm_now_ms() - start;
    const char *failure = passes_ms(r->context, &frame->gpu_ms);
    return failure || fm_world_stats_get(r->world, &frame->stats) == FM_OK ? failure : fm_last_error();
}

static const char *one_edit(const run *r, uint64_t update, bench_world_frame *frame) {
    bench_edits_at(&r->what->edits, r->what->desc.shape, update, r->brushes);
    const double start = fm_now_ms();
    if (fm_world_edit(r->world, r->brushes, r->what->edits.per_update) != FM_OK) {
        return fm_last_error();
    }
    const double edited = fm_now_ms() - start;
    const char *failure = one_update(r, frame);
    frame->call_ms += edited;
    frame->delta_ms += edited;
    return failure;
}

static const char *one_full(const run *r, bench_world_frame *frame) {
    if (fm_world_set_method(r->world, &r->what->desc.method) != FM_OK) {
        return fm_last_error();
    }
    const char *failure = one_update(r, frame);
    return failure || frame->stats.full ? failure : "the update after a change of the method did not regenerate everything";
}

static double warm_up_ms(const run *r, double most) {
    return fmin(most, r->limits->seconds * 500);
}

static const char *time_full(const run *r) {
    bench_world_frame frame;
    double gpu[BENCH_STATS_MAX], wall[BENCH_STATS_MAX];
    const double begin = fm_now_ms();
    const char *failure = NULL;
    for (int i = 0; !failure && (i < 1 || fm_now_ms() - begin < warm_up_ms(r, WARM_UP_MS)); i++) {
        failure = one_full(r, &frame);
    }
    const double first = fm_now_ms();
    uint32_t count = 0;
    while (!failure && count < r->limits->full_runs && (count < 1 || fm_now_ms() - first < r->limits->seconds * 500)) {
        failure = one_full(r, &frame);
        gpu[count] = frame.gpu_ms;
        wall[count++] = frame.delta_ms;
    }
    if (!failure) {
        r->result->full = bench_stats_of(gpu, count);
        r->result->full_wall = bench_stats_of(wall, count);
    }
    return failure;
}

// Sleeps on the CPU; keeps a GPU awake with copies, for drawing would.
static const char *wait_until(const run *r, double when) {
    while (fm_now_ms() < when) {
        if (r->awake[0]) {
            if (fm_volume_copy(r->context, r->awake[0], r->awake[1], NULL) != FM_OK) {
                return fm_last_error();
            }
        } else {
            const double left = fmax(when - fm_now_ms(), 0);
            const struct timespec time = {(time_t)(left / 1e3), (long)(fmod(left, 1e3) * 1e6)};
            nanosleep(&time, NULL);
        }
    }
    return NULL;
}

static const char *time_frames(const run *r) {
    const double first = fm_now_ms();
    double next = first;
    const char *failure = NULL;
    uint32_t count = 0;
    while (!failure && count < r->limits->frames && (count < 1 || fm_now_ms() - first < r->limits->seconds * 1e3)) {
        failure = one_edit(r, count, &r->result->frames[count]);
        r->result->frame_count = ++count;
        if (!failure && r->limits->check && r->limits->check_every && count % r->limits->check_every == 0) {
            failure = bench_world_check(r->session, r->world, r->limits->check, &r->result->whole, &r->result->domain);
        }
        next += r->limits->interval_ms;
        failure = failure || count == r->limits->frames ? failure : wait_until(r, next);
    }
    return failure;
}

static bench_stats stats_of(const bench_world_result *result, size_t member) {
    double values[BENCH_STATS_MAX];
    for (uint32_t i = 0; i < result->frame_count; i++) {
        memcpy(&values[i], (const char *)&result->frames[i] + member, sizeof values[i]);
    }
    return bench_stats_of(values, result->frame_count);
}

static void sum_up(bench_world_result *result) {
    result->update = stats_of(result, offsetof(bench_world_frame, gpu_ms));
    result->frame = stats_of(result, offsetof(bench_world_frame, delta_ms));
    result->call = stats_of(result, offsetof(bench_world_frame, call_ms));
    const double part = 1.0 / result->frame_count;
    for (uint32_t i = 0; i < result->frame_count; i++) {
        const fm_world_stats *stats = &result->frames[i].stats;
        result->iterations += (double)stats->iterations * part;
        result->most_iterations = fmax(result->most_iterations, (double)stats->iterations);
        result->host_wait_ms += stats->host_wait_ms * part;
        result->rows += (double)stats->rows * part;
        result->tiles_y += (double)stats->tiles_y * part;
        result->tiles_z += (double)stats->tiles_z * part;
        result->chunks += (double)stats->chunks * part;
    }
}

static void note_memory(const run *r) {
    bench_world_result *result = r->result;
    result->memory_count = BENCH_MAX_MEMORY;
    if (fm_context_memory(r->context, &result->memory_count, result->memory) != FM_OK) {
        result->memory_count = 0;
    }
    for (uint32_t i = 0; i < result->memory_count; i++) {
        const fm_memory *memory = &result->memory[i];
        uint64_t *sum = strcmp(memory->purpose, "voxels") == 0  ? &result->voxel_bytes
                        : strcmp(memory->purpose, "field") == 0 ? &result->field_bytes
                                                                : &result->rest_bytes;
        *sum += memory->bytes;
    }
}

static const char *make_awake(run *r) {
    enum { BYTES = 16 << 20 };
    const fm_volume_desc desc = {.shape = {BYTES / 8, 1, 1}, .type = FM_TYPE_U64};
    if (r->limits->interval_ms <= 0 || fm_context_backend(r->context) != FM_BACKEND_VULKAN) {
        return NULL;
    }
    uint64_t *noise = malloc(BYTES);
    if (!noise) {
        return "out of memory";
    }
    for (uint64_t i = 0; i < BYTES / 8; i++) {
        noise[i] = fm_mix(i);
    }
    fm_result result = fm_volume_create(r->context, &desc, &r->awake[0]);
    result = result == FM_OK ? fm_volume_create(r->context, &desc, &r->awake[1]) : result;
    result = result == FM_OK ? fm_volume_upload(r->awake[0], noise) : result;
    free(noise);
    return result == FM_OK ? NULL : fm_last_error();
}

static void drop_awake(run *r) {
    for (int i = 0; i < 2; i++) {
        fm_volume_destroy(r->awake[i]);
        r->awake[i] = NULL;
    }
}

static const char *warm_up_edits(const run *r) {
    bench_world_frame frame;
    const double begin = fm_now_ms();
    const char *failure = one_full(r, &frame);
    for (uint64_t i = 0; !failure && i < WARM_UP_EDITS && fm_now_ms() - begin < warm_up_ms(r, WARM_UP_EDITS_MS); i++) {
        failure = one_edit(r, WARM_UP_UPDATE + i, &frame);
    }
    return failure;
}

static double solid_share(const fm_volume *start) {
    fm_volume_desc desc;
    fm_volume_info(start, &desc);
    const uint64_t count = (uint64_t)desc.shape.x * desc.shape.y * desc.shape.z;
    // Volumes are read through a pointer that could write.
    const uint8_t *voxels = fm_volume_data((fm_volume *)(uintptr_t)start);
    uint64_t solid = 0;
    for (uint64_t i = 0; desc.type == FM_TYPE_U8 && i < count; i++) {
        solid += voxels[i] != 0;
    }
    return desc.type == FM_TYPE_U8 ? (double)solid / (double)count : NAN;
}

static const char *measure(run *r, const fm_volume *start) {
    const char *failure = make_awake(r);
    failure = failure || fm_world_create(r->context, &r->what->desc, &r->world) == FM_OK ? failure : fm_last_error();
    failure = failure || fm_world_load(r->world, start) == FM_OK ? failure : fm_last_error();
    failure = failure ? failure : warm_up_edits(r);
    // The script begins at the same voxels for every method, however long it warmed up.
    failure = failure || fm_world_load(r->world, start) == FM_OK ? failure : fm_last_error();
    failure = failure ? failure : time_full(r);
    failure = failure ? failure : time_frames(r);
    drop_awake(r);
    if (failure) {
        return failure;
    }
    sum_up(r->result);
    note_memory(r);
    const bool end_checked = r->limits->check_every && r->result->frame_count % r->limits->check_every == 0;
    if (r->limits->check && !end_checked) {
        failure = bench_world_check(r->session, r->world, r->limits->check, &r->result->whole, &r->result->domain);
    }
    const bench_world_errors *errors = &r->result->whole;
    const bool wrong = r->what->desc.method.algorithm == FM_WORLD_EXACT && errors->above + errors->below > 0;
    return failure || !wrong ? failure : "the field of an exact method is wrong";
}

bool bench_world_measure(bench_session *session, const fm_volume *start, const bench_world_case *what,
                         const bench_world_limits *limits, bench_world_result *result) {
    memset(result, 0, sizeof *result);
    result->what = *what;
    run r = {.session = session, .what = &result->what, .limits = limits, .result = result};
    r.context = bench_session_context(session, FM_BACKEND_AUTO);
    r.brushes = calloc(what->edits.per_update, sizeof *r.brushes);
    const char *failure = r.context ? r.brushes ? NULL : "out of memory" : fm_last_error();
    if (!failure) {
        fm_device_info device;
        fm_context_device(r.context, &device);
        snprintf(result->device, sizeof result->device, "%s", device.name);
        result->gpu = device.kind != FM_DEVICE_HOST;
        result->solid = solid_share(start);
        result->bandwidth = bench_session_bandwidth(session, FM_BACKEND_AUTO);
        failure = measure(&r, start);
    }
    if (failure) {
        snprintf(result->failure, sizeof result->failure, "%s", failure);
    }
    drop_awake(&r);
    fm_world_destroy(r.world);
    free(r.brushes);
    if (r.context) {
        fm_context_trim(r.context);
    }
    return !failure;
}
