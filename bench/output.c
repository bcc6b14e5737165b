// SPDX-License-Identifier: MIT
#include "bench.h"
#include "tables.h"
#include "words.h"

#include <inttypes.h>
#include <string.h>

const char *bench_type_name(const bench_case *what) {
    return bench_transform_desc(what).squared ? "squared u32" : fm_type_words[what->output];
}

const char *bench_input_name(const bench_case *what) {
    return fm_type_words[what->input];
}

static double per_voxel(const bench_result *result, uint64_t bytes) {
    return (double)bytes / (double)bench_voxels(&result->what);
}

// Millions of voxels a second, by the time of the kernels.
static double rate(const bench_result *result) {
    return (double)bench_voxels(&result->what) * 1e-3 / result->kernels.median;
}

void bench_print_header(FILE *stream) {
    fprintf(stream, "%-8s %-14s %-4s %-17s %-13s %10s %8s %10s %10s %10s %7s %7s %7s\n", "scene", "size", "", "types", "engine",
            "kernels ms", "+- 95 %", "wall ms", "copies ms", "Mvoxel/s", "B/voxel", "/ floor", "scratch");
}

void bench_print(FILE *stream, const bench_result *result) {
    const bench_case *what = &result->what;
    char shape[40], types[32];
    bench_shape_text(what->scene_desc.shape, shape);
    snprintf(types, sizeof types, "%s>%s", bench_input_name(what), bench_type_name(what));
    fprintf(stream, "%-8s %-14s %-4s %-17s %-13s ", fm_scene_name(what->scene), shape, fm_metric_words[what->metric], types,
            result->engine->name);
    if (result->failure[0]) {
        fprintf(stream, "FAILED: %s\n", result->failure);
        return;
    }
    fprintf(stream, "%10.4f %8.4f %10.4f ", result->kernels.median, (result->kernels.high - result->kernels.low) / 2,
            result->wall.median);
    if (result->copies.count) {
        fprintf(stream, "%10.3f ", result->copies.median);
    } else {
        fprintf(stream, "%10s ", "-");
    }
    fprintf(stream, "%10.0f %7.2f %7.2f %7.2f\n", rate(result), per_voxel(result, result->bytes),
            result->kernels.median / result->floor_ms, per_voxel(result, result->scratch));
    fflush(stream);
}

static void csv_case_header(FILE *stream) {
    fprintf(stream, "engine,device,scene,seed,x,y,z,metric,input,output");
}

static void csv_case(FILE *stream, const bench_result *result) {
    const bench_case *what = &result->what;
    const fm_shape shape = what->scene_desc.shape;
    fprintf(stream, "%s,", result->engine->name);
    bench_csv_text(stream, result->device);
    fprintf(stream, ",%s,%" PRIu64 ",%" PRIu32 ",%" PRIu32 ",%" PRIu32 ",%s,%s,%s", fm_scene_name(what->scene),
            what->scene_desc.seed, shape.x, shape.y, shape.z, fm_metric_words[what->metric], bench_input_name(what),
            bench_type_name(what));
}

void bench_csv_header(FILE *stream) {
    csv_case_header(stream);
    fprintf(stream, ",solid_fraction,runs");
    bench_csv_stats_header(stream, "kernels");
    bench_csv_stats_header(stream, "wall");
    fprintf(stream, ",copy_runs");
    bench_csv_stats_header(stream, "with_copies");
    fprintf(stream, ",mvoxel_per_s,bytes_per_voxel,copy_gb_per_s,floor_ms,ratio_to_floor,io_floor_ms,ratio_to_io_floor,"
                    "scratch_bytes_per_voxel,device_volumes_bytes,device_scratch_bytes,device_staging_bytes,host_volumes_bytes,"
                    "host_scratch_bytes,host_staging_bytes,samples,wrong,failure\n");
}

void bench_csv(FILE *stream, const bench_result *result) {
    static const char *const purposes[] = {"volumes", "scratch", "staging"};
    csv_case(stream, result);
    fprintf(stream, ",%.6g,%" PRIu32, result->solid, result->kernels.count);
    bench_csv_stats(stream, &result->kernels);
    bench_csv_stats(stream, &result->wall);
    fprintf(stream, ",%" PRIu32, result->copies.count);
    bench_csv_stats(stream, &result->copies);
    if (result->failure[0]) {
        fprintf(stream, ",,,,,,,");
    } else {
        fprintf(stream, ",%.6g,%.6g,%.6g,%.6g,%.4g,%.6g,%.4g", rate(result), per_voxel(result, result->bytes),
                result->bandwidth * 1e-9, result->floor_ms, result->kernels.median / result->floor_ms, result->io_floor_ms,
                result->kernels.median / result->io_floor_ms);
    }
    fprintf(stream, ",%.4g", per_voxel(result, result->scratch));
    for (int device = 1; device >= 0; device--) {
        for (int i = 0; i < 3; i++) {
            fprintf(stream, ",%" PRIu64, bench_memory_bytes(result->memory, result->memory_count, purposes[i], device));
        }
    }
    fprintf(stream, ",%" PRIu32 ",%" PRIu32 ",", result->samples, result->wrong);
    bench_csv_text(stream, result->failure);
    fprintf(stream, "\n");
    fflush(stream);
}

void bench_passes_csv_header(FILE *stream) {
    csv_case_header(stream);
    fprintf(stream, ",pass,name,bytes,runs");
    bench_csv_stats_header(stream, "pass");
    fprintf(stream, ",gb_per_s,floor_ms,ratio_to_floor\n");
}

void bench_passes_csv(FILE *stream, const bench_result *result) {
    for (uint32_t p = 0; !result->failure[0] && p < result->pass_count; p++) {
        const uint64_t bytes = result->passes[p].bytes;
        const bench_stats *time = &result->passes[p].time;
        const double floor_ms = (double)bytes / result->bandwidth * 1e3;
        csv_case(stream, result);
        fprintf(stream, ",%" PRIu32 ",", p);
        bench_csv_text(stream, result->passes[p].name);
        fprintf(stream, ",%" PRIu64 ",%" PRIu32, bytes, time->count);
        bench_csv_stats(stream, time);
        fprintf(stream, ",%.6g,%.6g,%.4g\n", (double)bytes * 1e-6 / time->median, floor_ms, time->median / floor_ms);
    }
    fflush(stream);
}

static void add_case(cJSON *object, const bench_result *result) {
    const bench_case *what = &result->what;
    const fm_shape shape = what->scene_desc.shape;
    cJSON_AddStringToObject(object, "engine", result->engine->name);
    cJSON_AddStringToObject(object, "device", result->device);
    cJSON_AddStringToObject(object, "scene", fm_scene_name(what->scene));
    cJSON_AddNumberToObject(object, "seed", (double)what->scene_desc.seed);
    cJSON_AddItemToObject(object, "shape", cJSON_CreateIntArray((const int[]){(int)shape.x, (int)shape.y, (int)shape.z}, 3));
    cJSON_AddNumberToObject(object, "solid_fraction", result->solid);
    cJSON_AddStringToObject(object, "metric", fm_metric_words[what->metric]);
    cJSON_AddStringToObject(object, "input", bench_input_name(what));
    cJSON_AddStringToObject(object, "output", bench_type_name(what));
}

static void add_passes(cJSON *object, const bench_result *result) {
    cJSON *passes = cJSON_AddArrayToObject(object, "passes");
    for (uint32_t p = 0; p < result->pass_count; p++) {
        cJSON *pass = cJSON_CreateObject();
        cJSON_AddStringToObject(pass, "name", result->passes[p].name);
        cJSON_AddNumberToObject(pass, "bytes", (double)result->passes[p].bytes);
        cJSON_AddItemToObject(pass, "time", bench_stats_json(&result->passes[p].time));
        cJSON_AddItemToArray(passes, pass);
    }
}

cJSON *bench_json(const bench_result *result) {
    cJSON *object = cJSON_CreateObject();
    add_case(object, result);
    cJSON_AddStringToObject(object, "failure", result->failure);
    cJSON_AddNumberToObject(object, "samples", result->samples);
    cJSON_AddNumberToObject(object, "wrong", result->wrong);
    if (result->failure[0]) {
        return object;
    }
    cJSON_AddItemToObject(object, "kernels", bench_stats_json(&result->kernels));
    cJSON_AddItemToObject(object, "wall", bench_stats_json(&result->wall));
    cJSON_AddItemToObject(object, "with_copies", bench_stats_json(&result->copies));
    cJSON_AddNumberToObject(object, "mvoxel_per_s", rate(result));
    cJSON_AddNumberToObject(object, "bytes_per_voxel", per_voxel(result, result->bytes));
    cJSON_AddNumberToObject(object, "copy_gb_per_s", result->bandwidth * 1e-9);
    cJSON_AddNumberToObject(object, "floor_ms", result->floor_ms);
    cJSON_AddNumberToObject(object, "ratio_to_floor", result->kernels.median / result->floor_ms);
    cJSON_AddNumberToObject(object, "io_floor_ms", result->io_floor_ms);
    cJSON_AddNumberToObject(object, "ratio_to_io_floor", result->kernels.median / result->io_floor_ms);
    add_passes(object, result);
    cJSON_AddItemToObject(object, "memory", bench_memory_json(result->memory, result->memory_count));
    cJSON_AddNumberToObject(object, "scratch_bytes_per_voxel", per_voxel(result, result->scratch));
    return object;
}
