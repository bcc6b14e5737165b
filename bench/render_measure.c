// SPDX-License-Identifier: MIT
#include "render.h"
#include "words.h"
#include "world.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

enum { MAX_PASSES = 128, IN_FLIGHT = 2 };

typedef struct run {
    fm_context *context;
    fm_world *world;
    fm_renderer *renderer;
    const fm_camera *cameras;
    uint32_t count;
    const bench_render_case *what;
    const bench_render_limits *limits;
    bench_render_result *result;
} run;

typedef struct times {
    double beam, march, update;
} times;

static fm_render_desc desc_of(const run *r, uint32_t camera) {
    const bool shaded = r->what->mode == BENCH_RENDER_SHADED;
    return (fm_render_desc){.camera = r->cameras[camera],
                            .width = r->what->width,
                            .height = r->what->height,
                            .march = r->what->march,
                            .sun = {0.48f, -0.56f, 0.6757f},
                            .shadow = shaded ? FM_SHADOW_SOFT : FM_SHADOW_NONE,
                            .ambient_occlusion = shaded};
}

static const char *passes_of(const run *r, times *t) {
    fm_pass passes[MAX_PASSES];
    uint32_t count = MAX_PASSES;
    if (fm_context_passes(r->context, &count, passes) != FM_OK) {
        return fm_last_error();
    }
    *t = (times){0};
    for (uint32_t i = 0; i < count; i++) {
        double *sum = strcmp(passes[i].name, "beam") == 0    ? &t->beam
                      : strcmp(passes[i].name, "march") == 0 ? &t->march
                                                             : &t->update;
        *sum += passes[i].milliseconds;
    }
    return NULL;
}

static const char *one_picture(const run *r, uint32_t camera, times *t) {
    const fm_render_desc desc = desc_of(r, camera);
    return fm_render(r->renderer, r->world, &desc, NULL) == FM_OK ? passes_of(r, t) : fm_last_error();
}

// Camera by camera, so that a path of short pictures is one of short pictures throughout.
static const char *time_path(const run *r) {
    const uint32_t rounds = r->limits->rounds;
    times *all = calloc((size_t)rounds * r->count, sizeof *all);
    double *gpu = calloc(r->count, sizeof *gpu), *beam = calloc(r->count, sizeof *beam), *march = calloc(r->count, sizeof *march);
    const char *failure = all && gpu && beam && march ? NULL : "out of memory";
    const double begin = fm_now_ms();
    uint32_t done = 0;
    while (!failure && done < rounds && (done == 0 || fm_now_ms() - begin < r->limits->seconds * 1e3)) {
        for (uint32_t i = 0; !failure && i < r->count; i++) {
            failure = one_picture(r, i, &all[(size_t)done * r->count + i]);
        }
        done++;
    }
    for (uint32_t i = 0; !failure && i < r->count; i++) {
        double values[3][BENCH_STATS_MAX];
        for (uint32_t k = 0; k < done; k++) {
            const times *t = &all[(size_t)k * r->count + i];
            values[0][k] = t->beam + t->march;
            values[1][k] = t->beam;
            values[2][k] = t->march;
        }
        gpu[i] = bench_stats_of(values[0], done).median;
        beam[i] = bench_stats_of(values[1], done).median;
        march[i] = bench_stats_of(values[2], done).median;
    }
    if (!failure) {
        r->result->gpu = bench_stats_of(gpu, r->count);
        r->result->beam = bench_stats_of(beam, r->count);
        r->result->march = bench_stats_of(march, r->count);
    }
    free(all);
    free(gpu);
    free(beam);
    free(march);
    return failure;
}

static const char *edit(const run *r, uint64_t frame) {
    static const bench_edits script = {
        .seed = 7, .per_update = 1, .least_radius = 1, .greatest_radius = 16, .kinds = {FM_BRUSH_SPHERE}, .kind_count = 1};
    fm_brush brush;
    fm_ticket ticket;
    bench_edits_at(&script, r->what->desc.shape, frame, &brush);
    const bool good = fm_world_edit(r->world, &brush, 1) == FM_OK && fm_world_update(r->world, &ticket) == FM_OK;
    return good ? NULL : fm_last_error();
}

// As a program does that shows its pictures: the next one is asked for while the last one is made.
static const char *time_stream(const run *r) {
    fm_ticket tickets[IN_FLIGHT] = {0};
    const uint32_t frames = r->limits->frames;
    uint32_t done = 0;
    const double begin = fm_now_ms();
    for (; done < frames && (done < 2 * IN_FLIGHT || fm_now_ms() - begin < r->limits->seconds * 1e3); done++) {
        const fm_render_desc desc = desc_of(r, done % r->count);
        const char *failure = r->what->mode == BENCH_RENDER_EDITED ? edit(r, done) : NULL;
        if (failure) {
            return failure;
        }
        if (fm_wait(r->context, tickets[done % IN_FLIGHT]) != FM_OK ||
            fm_render(r->renderer, r->world, &desc, &tickets[done % IN_FLIGHT]) != FM_OK) {
            return fm_last_error();
        }
    }
    for (int i = 0; i < IN_FLIGHT; i++) {
        if (fm_wait(r->context, tickets[i]) != FM_OK) {
            return fm_last_error();
        }
    }
    r->result->frames_per_second = done * 1e3 / (fm_now_ms() - begin);
    return NULL;
}

// The passes of updates and of the pictures after them, one at a time.
static const char *time_edits(const run *r) {
    static double values[4][BENCH_STATS_MAX];
    bench_stats *const stats[] = {&r->result->update, &r->result->gpu, &r->result->beam, &r->result->march};
    const uint32_t wanted = r->limits->rounds < BENCH_STATS_MAX / r->count ? r->limits->rounds * r->count : BENCH_STATS_MAX;
    const double begin = fm_now_ms();
    uint32_t count = 0;
    for (; count < wanted && (count == 0 || fm_now_ms() - begin < r->limits->seconds * 1e3); count++) {
        times update, picture;
        const char *failure = edit(r, r->limits->frames + count);
        failure = failure ? failure : passes_of(r, &update);
        failure = failure ? failure : one_picture(r, count % r->count, &picture);
        if (failure) {
            return failure;
        }
        values[0][count] = update.update;
        values[1][count] = picture.beam + picture.march;
        values[2][count] = picture.beam;
        values[3][count] = picture.march;
    }
    for (int i = 0; i < 4; i++) {
        *stats[i] = bench_stats_of(values[i], count);
    }
    return NULL;
}

static const char *count_reads(const run *r) {
    bench_render_result *result = r->result;
    for (uint32_t i = 0; i < r->count; i++) {
        fm_render_stats stats;
        fm_render_desc desc = desc_of(r, i);
        desc.count = true;
        if (fm_render(r->renderer, r->world, &desc, NULL) != FM_OK || fm_renderer_stats(r->renderer, &stats) != FM_OK) {
            return fm_last_error();
        }
        result->counted += stats.rays;
        result->steps += (double)stats.steps;
        result->hits += (double)stats.hits;
        result->beam_reads += (double)stats.beam_reads;
        result->sun_reads += (double)stats.sun_reads;
        result->open_reads += (double)stats.occlusion_reads;
        result->most_steps = fmax(result->most_steps, (double)stats.most_steps);
    }
    double *const means[] = {&result->steps, &result->hits, &result->beam_reads, &result->sun_reads, &result->open_reads};
    for (size_t i = 0; i < sizeof means / sizeof means[0]; i++) {
        *means[i] /= (double)result->counted;
    }
    return NULL;
}

static const char *note_memory(const run *r) {
    r->result->memory_count = BENCH_MAX_MEMORY;
    return fm_context_memory(r->context, &r->result->memory_count, r->result->memory) == FM_OK ? NULL : fm_last_error();
}

static const char *check_pictures(const run *r) {
    fm_render_desc *pictures = malloc(r->count * sizeof *pictures);
    if (!pictures) {
        return "out of memory for the check";
    }
    for (uint32_t i = 0; i < r->count; i++) {
        pictures[i] = desc_of(r, i);
    }
    const bench_render_pictures given = {
        .context = r->context, .world = r->world, .renderer = r->renderer, .pictures = pictures, .count = r->count};
    const char *failure = bench_render_check(&given, r->result);
    free(pictures);
    return failure;
}

static const char *warm_up(const run *r) {
    times t;
    const char *failure = NULL;
    const double begin = fm_now_ms();
    if (r->what->mode == BENCH_RENDER_EDITED) {
        // The first edit makes kernels.
        failure = edit(r, UINT32_MAX);
    }
    for (uint32_t i = 0; !failure && (i == 0 || fm_now_ms() - begin < r->limits->warm_up_ms); i++) {
        failure = one_picture(r, i % r->count, &t);
    }
    return failure;
}

static const char *measure(const run *r) {
    const bool edited = r->what->mode == BENCH_RENDER_EDITED;
    const char *failure = edited ? NULL : count_reads(r);
    if (r->limits->rounds == 0) {
        return failure;
    }
    failure = failure ? failure : warm_up(r);
    failure = failure ? failure : time_stream(r);
    failure = failure ? failure : edited ? time_edits(r) : time_path(r);
    failure = failure ? failure : note_memory(r);
    return failure ? failure : check_pictures(r);
}

bool bench_render_measure(bench_session *session, fm_world *world, const fm_camera *cameras, uint32_t count,
                          const bench_render_case *what, const bench_render_limits *limits, bench_render_result *result) {
    memset(result, 0, sizeof *result);
    result->what = *what;
    run r = {.world = world, .cameras = cameras, .count = count, .what = what, .limits = limits, .result = result};
    r.context = bench_session_context(session, FM_BACKEND_AUTO);
    const char *failure = r.context && fm_renderer_create(r.context, &r.renderer) == FM_OK ? NULL : fm_last_error();
    if (!failure) {
        fm_device_info device;
        fm_context_device(r.context, &device);
        snprintf(result->device, sizeof result->device, "%s", device.name);
        result->bandwidth = limits->rounds > 0 ? bench_session_bandwidth(session, FM_BACKEND_AUTO) : 0;
        failure = measure(&r);
    }
    if (failure) {
        snprintf(result->failure, sizeof result->failure, "%s", failure);
    }
    fm_renderer_destroy(r.renderer);
    return !failure;
}

// Bytes of an entry.
static double width_of(const bench_render_result *result) {
    static const double widths[] = {4, 1, 2, 4};
    return widths[result->what.desc.format];
}

static double rays_of(const bench_render_result *result) {
    return (double)result->what.width * result->what.height;
}

double bench_render_beam_bytes(const bench_render_result *result) {
    // A tile's beam is written once.
    return result->beam_reads > 0 ? rays_of(result) * (result->beam_reads * width_of(result) + 4.0 / 64) : 0;
}

double bench_render_march_bytes(const bench_render_result *result) {
    const double width = width_of(result), step = result->what.march == FM_MARCH_PLAIN ? 4 : width;
    const bool packed = result->what.desc.format == FM_FIELD_PACKED;
    // A packed entry has the colour, and has just been read, unless by bits.
    const double color = packed ? (result->what.march == FM_MARCH_PLAIN ? 4 : 0) : 1;
    const double beam = result->beam_reads > 0 ? 4.0 / 64 : 0;
    return rays_of(result) *
           (result->steps * step + (result->sun_reads + result->open_reads) * width + result->hits * color + beam + 4);
}
