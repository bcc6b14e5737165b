// SPDX-License-Identifier: MIT
// Rows of the benchmark of octrees, and what the issue asks for beside them.

#include "octree.h"
#include "tables.h"

#include <math.h>
#include <stddef.h>
#include <string.h>

// Columns, in the order of CSV and JSON.
static const struct {
    const char *name;
    size_t at;
} texts[] = {{"mode", offsetof(bench_octree_result, mode)},
             {"way", offsetof(bench_octree_result, way)},
             {"view", offsetof(bench_octree_result, view)},
             {"match", offsetof(bench_octree_result, match)}},
  numbers[] = {{"triangles", offsetof(bench_octree_result, triangles)},
               {"size", offsetof(bench_octree_result, size)},
               {"width", offsetof(bench_octree_result, width)},
               {"height", offsetof(bench_octree_result, height)},
               {"radius", offsetof(bench_octree_result, radius)},
               {"build_gpu_ms", offsetof(bench_octree_result, build_gpu_ms)},
               {"first_ms", offsetof(bench_octree_result, first_ms)},
               {"node_bytes", offsetof(bench_octree_result, node_bytes)},
               {"leaf_bytes", offsetof(bench_octree_result, leaf_bytes)},
               {"attribute_bytes", offsetof(bench_octree_result, attribute_bytes)},
               {"bytes", offsetof(bench_octree_result, bytes)},
               {"unshared_bytes", offsetof(bench_octree_result, unshared_bytes)},
               {"share_ratio", offsetof(bench_octree_result, share_ratio)},
               {"leaves", offsetof(bench_octree_result, leaves)},
               {"voxels", offsetof(bench_octree_result, voxels)},
               {"bytes_a_leaf", offsetof(bench_octree_result, bytes_a_leaf)},
               {"bytes_a_voxel", offsetof(bench_octree_result, bytes_a_voxel)},
               {"primary_rays_a_second", offsetof(bench_octree_result, primary_rays)},
               {"second_rays_a_second", offsetof(bench_octree_result, second_rays)},
               {"reads_a_ray", offsetof(bench_octree_result, reads)},
               {"most_reads", offsetof(bench_octree_result, most_reads)},
               {"second_reads_a_ray", offsetof(bench_octree_result, second_reads)},
               {"touched_bytes_a_second", offsetof(bench_octree_result, touched)},
               {"copy_bytes_a_second", offsetof(bench_octree_result, copy)},
               {"rmse", offsetof(bench_octree_result, rmse)},
               {"flip", offsetof(bench_octree_result, flip)},
               {"silhouette", offsetof(bench_octree_result, silhouette)},
               {"depth_mean_cells", offsetof(bench_octree_result, depth_mean)},
               {"depth_p99_cells", offsetof(bench_octree_result, depth_p99)},
               {"surface_mean_cells", offsetof(bench_octree_result, surface_mean)},
               {"surface_p99_cells", offsetof(bench_octree_result, surface_p99)},
               {"surface_p99_of_edge", offsetof(bench_octree_result, surface_relative)},
               {"code_vector_p99", offsetof(bench_octree_result, code_vector)},
               {"code_surface_p99_cells", offsetof(bench_octree_result, code_surface)},
               {"value", offsetof(bench_octree_result, value)},
               {"must", offsetof(bench_octree_result, must)},
               {"goal", offsetof(bench_octree_result, goal)},
               {"samples", offsetof(bench_octree_result, samples)},
               {"wrong", offsetof(bench_octree_result, wrong)}},
  timings[] = {{"build", offsetof(bench_octree_result, build)},
               {"primary", offsetof(bench_octree_result, primary)},
               {"second", offsetof(bench_octree_result, second)},
               {"update", offsetof(bench_octree_result, update)}};
enum {
    TEXTS = sizeof texts / sizeof texts[0],
    NUMBERS = sizeof numbers / sizeof numbers[0],
    TIMINGS = sizeof timings / sizeof timings[0]
};

static const char *text_at(const bench_octree_result *result, int i) {
    const char *text;
    memcpy(&text, (const char *)result + texts[i].at, sizeof text);
    return text ? text : "";
}

static double number_at(const bench_octree_result *result, int i) {
    double number;
    memcpy(&number, (const char *)result + numbers[i].at, sizeof number);
    return number;
}

static const bench_stats *timing_at(const bench_octree_result *result, int i) {
    return (const bench_stats *)(const void *)((const char *)result + timings[i].at);
}

void bench_octree_result_clear(bench_octree_result *result, bench_octree_mode mode) {
    *result = (bench_octree_result){.mode = bench_octree_mode_words[mode]};
    for (int i = 0; i < NUMBERS; i++) {
        const double none = NAN;
        memcpy((char *)result + numbers[i].at, &none, sizeof none);
    }
}

// ---------------------------------------------------------------------------------------------------------------------------
// Targets
// ---------------------------------------------------------------------------------------------------------------------------

static void judge(bench_octree_result *result, const char *target, double value, double must, double goal, bool comparable) {
    result->target = target;
    result->value = value;
    result->must = must;
    result->goal = goal;
    result->verdict = result->failure[0] || isnan(value) ? "failed"
                      : !comparable                      ? "another device, size or model"
                      : !isnan(goal) && value <= goal    ? "goal met"
                      : value <= must                    ? "must met"
                                                         : "missed";
}

void bench_octree_judge(bench_octree_result *r) {
    const bool big = strstr(r->device, "H200") && r->size >= 2048 && r->triangles >= 1e6;
    const bool closest = strcmp(r->way, "closest") == 0, picture = strcmp(r->mode, "picture") == 0;
    const bool share = strcmp(r->mode, "share") == 0, whole = r->view && strcmp(r->view, "whole") == 0;
    if (closest && picture && whole) {
        judge(r, "1920x1200 primary rays, 2048 cells, a million triangles, H200: ms", r->primary.median, 0.5, 0.25,
              big && r->width == 1920 && r->height == 1200);
    } else if (closest && strcmp(r->mode, "memory") == 0) {
        judge(r, "build, 2048 cells, 1.4 million triangles, H200: ms", r->build.median, 1000, 200, big);
    } else if (strcmp(r->mode, "code") == 0) {
        judge(r, "what 32 bits cost, 99th percentile: cells of surface", r->code_surface, 0.05, NAN, true);
    } else if (share && closest) {
        judge(r, "bytes of what identical parts leave, of all: architecture", 1 / r->share_ratio, 1 / 1.5, NAN, true);
    }
}

// ---------------------------------------------------------------------------------------------------------------------------
// Rows
// ---------------------------------------------------------------------------------------------------------------------------

void bench_octree_csv_header(FILE *stream) {
    fputs("model,device", stream);
    for (int i = 0; i < TEXTS; i++) {
        fprintf(stream, ",%s", texts[i].name);
    }
    for (int i = 0; i < NUMBERS; i++) {
        fprintf(stream, ",%s", numbers[i].name);
    }
    for (int i = 0; i < TIMINGS; i++) {
        bench_csv_stats_header(stream, timings[i].name);
    }
    fputs(",target,verdict,note,failure\n", stream);
}

void bench_octree_csv(FILE *stream, const bench_octree_result *result) {
    bench_csv_text(stream, result->model);
    fputc(',', stream);
    bench_csv_text(stream, result->device);
    for (int i = 0; i < TEXTS; i++) {
        fprintf(stream, ",%s", text_at(result, i));
    }
    for (int i = 0; i < NUMBERS; i++) {
        const double number = number_at(result, i);
        fputc(',', stream);
        if (isfinite(number)) {
            fprintf(stream, "%.9g", number);
        }
    }
    for (int i = 0; i < TIMINGS; i++) {
        bench_csv_stats(stream, timing_at(result, i));
    }
    const char *last[] = {result->target, result->verdict, result->note, result->failure};
    for (int i = 0; i < 4; i++) {
        fputc(',', stream);
        bench_csv_text(stream, last[i] ? last[i] : "");
    }
    fputc('\n', stream);
}

cJSON *bench_octree_json(const bench_octree_result *result) {
    cJSON *row = cJSON_CreateObject();
    cJSON_AddStringToObject(row, "model", result->model);
    cJSON_AddStringToObject(row, "device", result->device);
    for (int i = 0; i < TEXTS; i++) {
        if (text_at(result, i)[0]) {
            cJSON_AddStringToObject(row, texts[i].name, text_at(result, i));
        }
    }
    for (int i = 0; i < NUMBERS; i++) {
        if (isfinite(number_at(result, i))) {
            cJSON_AddNumberToObject(row, numbers[i].name, number_at(result, i));
        }
    }
    for (int i = 0; i < TIMINGS; i++) {
        if (timing_at(result, i)->count) {
            cJSON_AddItemToObject(row, timings[i].name, bench_stats_json(timing_at(result, i)));
        }
    }
    if (result->target) {
        cJSON_AddStringToObject(row, "target", result->target);
        cJSON_AddStringToObject(row, "verdict", result->verdict);
    }
    cJSON_AddStringToObject(row, "note", result->note);
    cJSON_AddStringToObject(row, "failure", result->failure);
    return row;
}

// A number in at most seven places; a dash where there is none.
static const char *cell(double number, char text[16]) {
    if (!isfinite(number)) {
        return "-";
    }
    snprintf(text, 16, "%.4g", number);
    return text;
}

static double median(const bench_stats *stats) {
    return stats->count ? stats->median : NAN;
}

static const char *const heads[] = {"size", "build", "MiB",  "B/leaf",  "B/voxel", "primary", "Mrays", "shadow", "reads",  "most",
                                    "GB/s", "RMSE",  "FLIP", "outline", "surface", "99 %",    "depth", "share",  "update", "99 %"};
static const char *const units[] = {"cells", "ms", "", "",      "",      "ms",    "/s",    "Mrays/s", "a ray", "",
                                    "",      "",   "", "share", "cells", "cells", "cells", "ratio",   "ms",    "ms"};
enum { HEADS = sizeof heads / sizeof heads[0] };

void bench_octree_print_header(FILE *stream) {
    for (int line = 0; line < 2; line++) {
        fprintf(stream, "%-12s %-17s %-6s", line ? "" : "model", line ? "" : "way", line ? "" : "view");
        for (int i = 0; i < HEADS; i++) {
            fprintf(stream, " %8s", line ? units[i] : heads[i]);
        }
        fputc('\n', stream);
    }
}

void bench_octree_print(FILE *stream, const bench_octree_result *r) {
    fprintf(stream, "%-12.12s %-17s %-6s", r->model, r->way, r->view ? r->view : "");
    const double shown[HEADS] = {
        r->size,          median(&r->build),   r->bytes / 1048576,     r->bytes_a_leaf,
        r->bytes_a_voxel, median(&r->primary), r->primary_rays * 1e-6, r->second_rays * 1e-6,
        r->reads,         r->most_reads,       r->touched * 1e-9,      r->rmse,
        r->flip,          r->silhouette,       r->surface_mean,        r->surface_p99,
        r->depth_p99,     r->share_ratio,      median(&r->update),     r->update.count ? r->update.p99 : NAN};
    for (int i = 0; i < HEADS; i++) {
        char text[16];
        fprintf(stream, " %8s", cell(shown[i], text));
    }
    if (isfinite(r->radius)) {
        fprintf(stream, "  radius %g", r->radius);
    }
    if (isfinite(r->code_surface)) {
        fprintf(stream, "  code: vectors %.3g of their cells, surface %.3g cells", r->code_vector, r->code_surface);
    }
    if (r->note[0]) {
        fprintf(stream, "  %s", r->note);
    }
    if (r->target) {
        fprintf(stream, "  [%.4g, must %.4g: %s]", r->value, r->must, r->verdict);
    }
    fputs(r->failure[0] ? "  FAILED: " : "", stream);
    fprintf(stream, "%s\n", r->failure);
    fflush(stream);
}
