// SPDX-License-Identifier: MIT
#include "tables.h"
#include "words.h"
#include "world.h"

#include <inttypes.h>
#include <math.h>
#include <string.h>

// "selective(fim,jfa) 32 halo host focus 3".
static void method_text(const fm_world_method *method, char text[96]) {
    int used = snprintf(text, 96, "%s", fm_world_algorithm_words[method->algorithm]);
    if (method->algorithm == FM_WORLD_SELECTIVE &&
        (method->near_algorithm != FM_WORLD_JFA_FIM || method->far_algorithm != FM_WORLD_JFA_PUBLISHED)) {
        used += snprintf(text + used, 96 - (size_t)used, "(%s,%s)", fm_world_algorithm_words[method->near_algorithm],
                         fm_world_algorithm_words[method->far_algorithm]);
    }
    if (method->chunk) {
        used += snprintf(text + used, 96 - (size_t)used, " %" PRIu32 " %s", method->chunk, fm_world_border_words[method->border]);
    }
    if (method->convergence == FM_CONVERGE_HOST) {
        used += snprintf(text + used, 96 - (size_t)used, " host");
    }
    if (method->algorithm == FM_WORLD_SELECTIVE) {
        snprintf(text + used, 96 - (size_t)used, " focus %" PRIu32, method->focus_chunks);
    }
}

static double share(const bench_world_errors *errors, uint64_t count) {
    return errors->compared ? (double)count / (double)errors->compared : 0;
}

static double mean_error(const bench_world_errors *errors) {
    return errors->compared ? errors->sum / (double)errors->compared : 0;
}

static double most_error(const bench_world_errors *errors) {
    return fmax(errors->most_above, errors->most_below);
}

void bench_world_print_header(FILE *stream) {
    fprintf(stream, "%-8s %-14s %-9s %-38s %10s %10s %10s %9s %7s %10s %7s %8s %8s %7s\n", "start", "size", "format", "method",
            "update ms", "p99", "frame ms", "FPS", "iter.", "full ms", "B/voxel", "above %", "below %", "worst");
}

void bench_world_print(FILE *stream, const bench_world_result *result) {
    const bench_world_case *what = &result->what;
    char shape[40], method[96];
    bench_shape_text(what->desc.shape, shape);
    method_text(&what->desc.method, method);
    fprintf(stream, "%-8s %-14s %-9s %-38s ", what->start, shape, fm_field_format_words[what->desc.format], method);
    if (result->failure[0]) {
        fprintf(stream, "FAILED: %s\n", result->failure);
        return;
    }
    const uint64_t bytes = result->voxel_bytes + result->field_bytes + result->rest_bytes;
    fprintf(stream, "%10.4f %10.4f %10.4f %9.1f %7.2f %10.4f %7.2f ", result->update.median, result->update.p99,
            result->frame.median, bench_world_fps(result), result->iterations, result->full.median,
            bench_world_per_voxel(result, bytes));
    if (result->whole.compared) {
        fprintf(stream, "%8.3f %8.3f %7.4g\n", 100 * share(&result->whole, result->whole.above),
                100 * share(&result->whole, result->whole.below), most_error(&result->whole));
    } else {
        fprintf(stream, "%8s %8s %7s\n", "-", "-", "-");
    }
    fflush(stream);
}

static void csv_case_header(FILE *stream) {
    fprintf(stream, "device,start,scene_seed,x,y,z,format,algorithm,near,far,chunk,border,convergence,focus,edits,least_radius,"
                    "greatest_radius,seed");
}

static const char *part_of(const fm_world_method *method, fm_world_algorithm part) {
    return method->algorithm == FM_WORLD_SELECTIVE ? fm_world_algorithm_words[part] : "";
}

static void csv_case(FILE *stream, const bench_world_result *result) {
    const bench_world_case *what = &result->what;
    const fm_world_method *method = &what->desc.method;
    const fm_shape shape = what->desc.shape;
    bench_csv_text(stream, result->device);
    fprintf(stream, ",");
    bench_csv_text(stream, what->start);
    fprintf(stream, ",%" PRIu64 ",%" PRIu32 ",%" PRIu32 ",%" PRIu32 ",%s,%s,%s,%s,%" PRIu32 ",%s,%s,%" PRIu32,
            what->scene_desc.seed, shape.x, shape.y, shape.z, fm_field_format_words[what->desc.format],
            fm_world_algorithm_words[method->algorithm], part_of(method, method->near_algorithm),
            part_of(method, method->far_algorithm), method->chunk, fm_world_border_words[method->border],
            fm_world_convergence_words[method->convergence], method->focus_chunks);
    fprintf(stream, ",%" PRIu32 ",%" PRIu32 ",%" PRIu32 ",%" PRIu64, what->edits.per_update, what->edits.least_radius,
            what->edits.greatest_radius, what->edits.seed);
}

static void csv_errors_header(FILE *stream, const char *name) {
    static const char *const columns[] = {"compared", "above_share", "below_share", "max_above", "max_below", "mean_error"};
    for (size_t i = 0; i < sizeof columns / sizeof columns[0]; i++) {
        fprintf(stream, ",%s_%s", name, columns[i]);
    }
}

static void csv_errors(FILE *stream, const bench_world_errors *errors) {
    if (!errors->compared) {
        fprintf(stream, ",0,,,,,");
        return;
    }
    fprintf(stream, ",%" PRIu64 ",%.6g,%.6g,%.6g,%.6g,%.6g", errors->compared, share(errors, errors->above),
            share(errors, errors->below), errors->most_above, errors->most_below, mean_error(errors));
}

// Where memory lies and what it is for, in the order of the columns.
static const struct {
    bool device;
    const char *purpose;
} memories[] = {{true, "voxels"},  {true, "field"},         {true, "update state"}, {true, "scratch"},
                {true, "staging"}, {true, "upload"},        {true, "readback"},     {false, "voxels"},
                {false, "field"},  {false, "update state"}, {false, "scratch"}};
enum { MEMORY_COUNT = sizeof memories / sizeof memories[0] };

void bench_world_csv_header(FILE *stream) {
    csv_case_header(stream);
    fprintf(stream, ",solid_fraction,copy_gb_per_s,frames");
    bench_csv_stats_header(stream, "update");
    bench_csv_stats_header(stream, "frame");
    bench_csv_stats_header(stream, "call");
    fprintf(stream, ",fps,full_runs");
    bench_csv_stats_header(stream, "full");
    bench_csv_stats_header(stream, "full_wall");
    fprintf(stream, ",iterations_mean,iterations_max,host_wait_ms,rows,tiles_y,tiles_z,chunks,voxel_bytes_per_voxel,"
                    "field_bytes_per_voxel,rest_bytes_per_voxel");
    for (int i = 0; i < MEMORY_COUNT; i++) {
        const char *purpose = memories[i].purpose;
        fprintf(stream, ",%s_%s_bytes", memories[i].device ? "device" : "host",
                strcmp(purpose, "update state") == 0 ? "update_state" : purpose);
    }
    csv_errors_header(stream, "whole");
    csv_errors_header(stream, "domain");
    fprintf(stream, ",failure\n");
}

void bench_world_csv(FILE *stream, const bench_world_result *result) {
    csv_case(stream, result);
    fprintf(stream, ",%.6g,%.6g,%" PRIu32, result->solid, result->bandwidth * 1e-9, result->frame_count);
    bench_csv_stats(stream, &result->update);
    bench_csv_stats(stream, &result->frame);
    bench_csv_stats(stream, &result->call);
    fprintf(stream, ",%.6g,%" PRIu32, bench_world_fps(result), result->full.count);
    bench_csv_stats(stream, &result->full);
    bench_csv_stats(stream, &result->full_wall);
    fprintf(stream, ",%.6g,%.6g,%.6g,%.6g,%.6g,%.6g,%.6g", result->iterations, result->most_iterations, result->host_wait_ms,
            result->rows, result->tiles_y, result->tiles_z, result->chunks);
    fprintf(stream, ",%.6g,%.6g,%.6g", bench_world_per_voxel(result, result->voxel_bytes),
            bench_world_per_voxel(result, result->field_bytes), bench_world_per_voxel(result, result->rest_bytes));
    for (int i = 0; i < MEMORY_COUNT; i++) {
        fprintf(stream, ",%" PRIu64,
                bench_memory_bytes(result->memory, result->memory_count, memories[i].purpose, memories[i].device));
    }
    csv_errors(stream, &result->whole);
    csv_errors(stream, &result->domain);
    fprintf(stream, ",");
    bench_csv_text(stream, result->failure);
    fprintf(stream, "\n");
    fflush(stream);
}

void bench_world_frames_csv_header(FILE *stream) {
    csv_case_header(stream);
    fprintf(stream, ",update,gpu_ms,delta_ms,call_ms,fps,iterations,host_wait_ms,rows,tiles_y,tiles_z,chunks,full\n");
}

void bench_world_frames_csv(FILE *stream, const bench_world_result *result) {
    for (uint32_t i = 0; i < result->frame_count; i++) {
        const bench_world_frame *frame = &result->frames[i];
        const fm_world_stats *stats = &frame->stats;
        csv_case(stream, result);
        fprintf(stream, ",%" PRIu32 ",%.6g,%.6g,%.6g,%.6g,%" PRIu64 ",%.6g,%" PRIu64 ",%" PRIu64 ",%" PRIu64 ",%" PRIu64 ",%d\n", i,
                frame->gpu_ms, frame->delta_ms, frame->call_ms, frame->delta_ms > 0 ? 1e3 / frame->delta_ms : 0, stats->iterations,
                stats->host_wait_ms, stats->rows, stats->tiles_y, stats->tiles_z, stats->chunks, stats->full);
    }
    fflush(stream);
}

static cJSON *errors_json(const bench_world_errors *errors) {
    if (!errors->compared) {
        return cJSON_CreateNull();
    }
    cJSON *object = cJSON_CreateObject();
    cJSON_AddNumberToObject(object, "compared", (double)errors->compared);
    cJSON_AddNumberToObject(object, "wrong_share", share(errors, errors->above + errors->below));
    cJSON_AddNumberToObject(object, "above_share", share(errors, errors->above));
    cJSON_AddNumberToObject(object, "below_share", share(errors, errors->below));
    cJSON_AddNumberToObject(object, "max_above", errors->most_above);
    cJSON_AddNumberToObject(object, "max_below", errors->most_below);
    cJSON_AddNumberToObject(object, "mean_error", mean_error(errors));
    return object;
}

static void add_case(cJSON *object, const bench_world_result *result) {
    const bench_world_case *what = &result->what;
    const fm_world_method *method = &what->desc.method;
    const fm_shape shape = what->desc.shape;
    cJSON_AddStringToObject(object, "device", result->device);
    cJSON_AddNumberToObject(object, "copy_gb_per_s", result->bandwidth * 1e-9);
    cJSON_AddStringToObject(object, "start", what->start);
    cJSON_AddNumberToObject(object, "scene_seed", (double)what->scene_desc.seed);
    cJSON_AddItemToObject(object, "shape", cJSON_CreateIntArray((const int[]){(int)shape.x, (int)shape.y, (int)shape.z}, 3));
    cJSON_AddStringToObject(object, "format", fm_field_format_words[what->desc.format]);
    cJSON_AddStringToObject(object, "algorithm", fm_world_algorithm_words[method->algorithm]);
    cJSON_AddStringToObject(object, "near", part_of(method, method->near_algorithm));
    cJSON_AddStringToObject(object, "far", part_of(method, method->far_algorithm));
    cJSON_AddNumberToObject(object, "chunk", method->chunk);
    cJSON_AddStringToObject(object, "border", fm_world_border_words[method->border]);
    cJSON_AddStringToObject(object, "convergence", fm_world_convergence_words[method->convergence]);
    cJSON_AddNumberToObject(object, "focus", method->focus_chunks);
    cJSON_AddNumberToObject(object, "edits", what->edits.per_update);
    cJSON_AddNumberToObject(object, "least_radius", what->edits.least_radius);
    cJSON_AddNumberToObject(object, "greatest_radius", what->edits.greatest_radius);
    cJSON_AddNumberToObject(object, "seed", (double)what->edits.seed);
}

static void add_memory(cJSON *object, const bench_world_result *result) {
    cJSON_AddItemToObject(object, "memory", bench_memory_json(result->memory, result->memory_count));
    cJSON_AddNumberToObject(object, "voxel_bytes_per_voxel", bench_world_per_voxel(result, result->voxel_bytes));
    cJSON_AddNumberToObject(object, "field_bytes_per_voxel", bench_world_per_voxel(result, result->field_bytes));
    cJSON_AddNumberToObject(object, "rest_bytes_per_voxel", bench_world_per_voxel(result, result->rest_bytes));
}

cJSON *bench_world_json(const bench_world_result *result) {
    cJSON *object = cJSON_CreateObject();
    add_case(object, result);
    cJSON_AddStringToObject(object, "failure", result->failure);
    cJSON_AddItemToObject(object, "whole", errors_json(&result->whole));
    cJSON_AddItemToObject(object, "domain", errors_json(&result->domain));
    if (result->frame_count == 0 || !result->update.count) {
        return object;
    }
    cJSON_AddNumberToObject(object, "frames", result->frame_count);
    cJSON_AddNumberToObject(object, "solid_fraction", result->solid);
    cJSON_AddItemToObject(object, "update", bench_stats_json(&result->update));
    cJSON_AddItemToObject(object, "frame", bench_stats_json(&result->frame));
    cJSON_AddItemToObject(object, "call", bench_stats_json(&result->call));
    cJSON_AddItemToObject(object, "full", bench_stats_json(&result->full));
    cJSON_AddItemToObject(object, "full_wall", bench_stats_json(&result->full_wall));
    cJSON_AddNumberToObject(object, "fps", bench_world_fps(result));
    cJSON_AddNumberToObject(object, "iterations_mean", result->iterations);
    cJSON_AddNumberToObject(object, "iterations_max", result->most_iterations);
    cJSON_AddNumberToObject(object, "host_wait_ms", result->host_wait_ms);
    cJSON_AddNumberToObject(object, "rows", result->rows);
    cJSON_AddNumberToObject(object, "tiles_y", result->tiles_y);
    cJSON_AddNumberToObject(object, "tiles_z", result->tiles_z);
    cJSON_AddNumberToObject(object, "chunks", result->chunks);
    add_memory(object, result);
    return object;
}
