// SPDX-License-Identifier: MIT
#include "auto.h"

#include "cli.h"
#include "fly.h"
#include "table.h"
#include "world.h"

#include <inttypes.h>
#include <math.h>
#include <stdlib.h>
#include <string.h>

void auto_begin(auto_run *run, const auto_desc *desc, fm_shape shape, double now_ms) {
    *run = (auto_run){.desc = *desc, .shape = shape, .begin_ms = now_ms};
}

void auto_free(auto_run *run) {
    free(run->frames);
    run->frames = NULL;
}

void auto_pause(auto_run *run, double ms) {
    run->begin_ms += ms;
    run->paused_ms += ms;
}

bool auto_over(const auto_run *run, double now_ms) {
    return run->desc.frames ? run->count >= run->desc.frames : now_ms - run->begin_ms >= run->desc.seconds * 1e3;
}

double auto_seconds(const auto_run *run, double now_ms) {
    // With a fixed number of frames the clock has no say in what is in the picture: a frame stands for a 60th of a second.
    return run->desc.frames ? (double)run->count / 60 : fmin((now_ms - run->begin_ms) / 1e3, run->desc.seconds);
}

uint32_t auto_edits(auto_run *run, double now_ms, fm_brush *brushes, uint32_t capacity) {
    const bench_edits edits = {.seed = run->desc.seed,
                               .per_update = 1,
                               .least_radius = 1,
                               .greatest_radius = run->desc.radius,
                               .kinds = {FM_BRUSH_SPHERE},
                               .kind_count = 1};
    const double interval = run->desc.interval_ms;
    const uint64_t due = interval > 0 ? (uint64_t)(1e3 * auto_seconds(run, now_ms) / interval) + 1 : run->edits + 1;
    uint32_t count = 0;
    for (; run->edits < due && count < capacity; run->edits++) {
        bench_edits_at(&edits, run->shape, run->edits, &brushes[count++]);
    }
    return count;
}

fm_camera auto_camera(const auto_run *run, double now_ms) {
    const double t =
        run->desc.frames ? (double)run->count / run->desc.frames : (now_ms - run->begin_ms) / (run->desc.seconds * 1e3);
    return fly_path(run->shape, t);
}

bool auto_record(auto_run *run, const auto_frame *frame) {
    if (run->count == run->capacity) {
        const uint64_t capacity = run->capacity ? 2 * run->capacity : 4096;
        auto_frame *frames = realloc(run->frames, capacity * sizeof *frames);
        if (!frames) {
            fprintf(stderr, "fathom: out of memory for %" PRIu64 " frames: free some, or measure for less time\n", capacity);
            return false;
        }
        run->frames = frames;
        run->capacity = capacity;
    }
    auto_frame *added = &run->frames[run->count++];
    *added = *frame;
    added->field_ms += run->early.field_ms;
    added->march_ms += run->early.march_ms;
    run->early = (auto_frame){0};
    return true;
}

void auto_add(auto_run *run, uint64_t frame, double field_ms, double march_ms) {
    auto_frame *to = frame < run->count ? &run->frames[frame] : &run->early;
    to->field_ms += field_ms;
    to->march_ms += march_ms;
}

int auto_check(const auto_desc *desc) {
    return tables_check(&desc->csv, 1);
}

static int write_csv(const auto_run *run) {
    table t;
    if (!table_begin(run->desc.csv, &t)) {
        return cli_fail("%s: out of memory for it: free some", run->desc.csv);
    }
    fprintf(t.stream, "frame,start_ms,delta_ms,fps,field_ms,march_ms,edits\n");
    for (uint64_t i = 0; i < run->count; i++) {
        const auto_frame *f = &run->frames[i];
        fprintf(t.stream, "%" PRIu64 ",%.4f,%.4f,%.2f,%.4f,%.4f,%u\n", i, f->start_ms, f->delta_ms,
                f->delta_ms > 0 ? 1e3 / f->delta_ms : 0, f->field_ms, f->march_ms, f->edits);
    }
    return table_end(&t, true, CLI_DONE);
}

static int compare(const void *a, const void *b) {
    const double x = *(const double *)a, y = *(const double *)b;
    return (x > y) - (x < y);
}

// The least value that at least 99 % of them do not exceed.
static double p99(const double *sorted, uint64_t count) {
    return sorted[(99 * count + 99) / 100 - 1];
}

// The interval is that of the mean, as if frames were independent of each other.
static void print_row(FILE *stream, const char *name, double *values, uint64_t count) {
    if (count == 0) {
        fprintf(stream, "%-12s %8s\n", name, "none");
        return;
    }
    double mean = 0, squares = 0;
    for (uint64_t i = 0; i < count; i++) {
        const double delta = values[i] - mean;
        mean += delta / (double)(i + 1);
        squares += delta * (values[i] - mean);
    }
    const double deviation = count > 1 ? sqrt(squares / (double)(count - 1)) : 0, half = 1.96 * deviation / sqrt((double)count);
    qsort(values, count, sizeof *values, compare);
    fprintf(stream, "%-12s %8" PRIu64 " %10.4f %10.4f   %10.4f to %10.4f %10.4f %10.4f %10.4f\n", name, count, mean, deviation,
            mean - half, mean + half, values[count / 2], p99(values, count), values[count - 1]);
}

static void print_head(const auto_run *run, FILE *stream) {
    if (run->desc.meshes) {
        fprintf(stream, "%" PRIu64 " frames\n", run->count);
        return;
    }
    fprintf(stream, "%" PRIu64 " frames, %" PRIu64 " edits, seed %" PRIu64 ", an edit ", run->count, run->edits, run->desc.seed);
    fprintf(stream, run->desc.interval_ms > 0 ? "every %g ms\n" : "a frame\n", run->desc.interval_ms);
}

static void print_notes(const auto_run *run, FILE *stream) {
    if (run->paused_ms > 0) {
        fprintf(stream, "hidden for %.1f s, which count for nothing here\n", run->paused_ms / 1e3);
    }
    if (run->by_clock) {
        fprintf(stream, "march and field by the clock, around each call and a wait: no GPU, whose timestamps would tell\n");
    }
}

int auto_finish(auto_run *run, FILE *stream) {
    double *values = calloc(run->count + 1, sizeof *values);
    if (!values) {
        return cli_fail("out of memory for the summary: free some");
    }
    print_head(run, stream);
    print_notes(run, stream);
    fprintf(stream, "%-12s %8s %10s %10s   %24s %10s %10s %10s\n", "", "count", "mean", "sd", "95 % interval of mean", "median",
            "p99", "most");
    static const struct {
        const char *name;
        size_t offset;
        bool edited;  // only frames with edits, where there are some
    } rows[] = {{"delta ms", offsetof(auto_frame, delta_ms), false},
                {"march ms", offsetof(auto_frame, march_ms), false},
                {"field ms", offsetof(auto_frame, field_ms), true}};
    for (int row = 0; row < 3; row++) {
        uint64_t count = 0;
        for (uint64_t i = 0; i < run->count; i++) {
            if (!rows[row].edited || run->frames[i].edits || run->desc.meshes) {
                memcpy(&values[count++], (const char *)&run->frames[i] + rows[row].offset, sizeof *values);
            }
        }
        print_row(stream, rows[row].name, values, count);
    }
    // Over the time that all took: a mean of rates would count short frames for more than they are.
    double total_ms = 0;
    for (uint64_t i = 0; i < run->count; i++) {
        total_ms += run->frames[i].delta_ms;
    }
    fprintf(stream, "%-12s %8" PRIu64 " %10.4f\n", "frames/s", run->count, total_ms > 0 ? (double)run->count * 1e3 / total_ms : 0);
    free(values);
    return run->desc.csv ? write_csv(run) : CLI_DONE;
}
