// SPDX-License-Identifier: MIT
#include "mesh.h"
#include "tables.h"

#include <inttypes.h>
#include <math.h>
#include <string.h>

const char *const bench_mesh_mode_words[] = {"rtsdf", "coarse", "exact", "compose", "scene", "build", "refit", NULL};
const char *const bench_mesh_flood_words[] = {"jfa", "1+jfa", "jfa+2", NULL};
const char *const bench_mesh_sign_words[] = {"auto", "pseudonormal", "winding", "none", NULL};

// The passes that have columns of their own in CSV; all are in JSON.
static const char *const pass_names[] = {"tree", "voxelize", "flood",  "trace",   "normals", "moments",
                                         "sign", "near",     "blocks", "nearest", "far",     "fill"};
enum { PASS_NAMES = sizeof pass_names / sizeof pass_names[0] };
static const char *const purposes[] = {"volumes", "meshes", "update state", "scratch", "staging", "upload", "readback"};
enum { PURPOSES = sizeof purposes / sizeof purposes[0] };

static bool is_rtsdf(const bench_mesh_result *result) {
    return result->what.mode == BENCH_MESH_RTSDF;
}

static bool has_field(const bench_mesh_result *result) {
    return result->what.mode < BENCH_MESH_BUILD;
}

static bool has_band(const bench_mesh_result *result) {
    return result->what.mode == BENCH_MESH_EXACT || bench_mesh_objects(&result->what) > 1;
}

// Of all objects.
static uint64_t triangles(const bench_mesh_result *result) {
    return result->what.mesh->triangle_count * bench_mesh_objects(&result->what);
}

static uint64_t vertices(const bench_mesh_result *result) {
    return result->what.mesh->vertex_count * bench_mesh_objects(&result->what);
}

static double ratio(const bench_mesh_result *result) {
    return result->floor_ms > 0 ? result->kernels.median / result->floor_ms : 0;
}

void bench_mesh_print_header(FILE *stream) {
    fprintf(stream, "%-16s %9s %-7s %5s %5s %6s %10s %8s %10s %10s %9s %9s %7s %8s  passes\n", "mesh", "triangles", "mode", "edge",
            "rays", "mask", "kernels ms", "+- 95 %", "99 %", "wall ms", "move ms", "floor ms", "/ floor", "MiB");
}

static double device_mib(const bench_mesh_result *result) {
    double bytes[2] = {0, 0};
    for (uint32_t i = 0; i < result->memory_count; i++) {
        bytes[result->memory[i].device] += (double)result->memory[i].bytes;
    }
    return (bytes[1] > 0 ? bytes[1] : bytes[0]) / 1048576;
}

void bench_mesh_print(FILE *stream, const bench_mesh_result *result) {
    const bench_mesh_case *what = &result->what;
    char edge[16] = "-", rays[16] = "-", mask[16] = "-";
    if (has_field(result)) {
        snprintf(edge, sizeof edge, "%u", what->edge);
    }
    if (is_rtsdf(result)) {
        snprintf(rays, sizeof rays, "%u", what->rays);
        snprintf(mask, sizeof mask, "%g", (double)what->mask);
    }
    const char *name = strrchr(what->mesh->name, '/') ? strrchr(what->mesh->name, '/') + 1 : what->mesh->name;
    fprintf(stream, "%-16.16s %9" PRIu64 " %-7s %5s %5s %6s ", name, triangles(result), bench_mesh_mode_words[what->mode], edge,
            rays, mask);
    if (result->failure[0]) {
        fprintf(stream, "FAILED: %s\n", result->failure);
        return;
    }
    char move[32] = "-", bound[32] = "-", over[32] = "-";
    if (result->move.median > 0) {
        snprintf(move, sizeof move, "%.4f", result->move.median);
    }
    if (result->floor_ms > 0) {
        snprintf(bound, sizeof bound, "%.4f", result->floor_ms);
        snprintf(over, sizeof over, "%.1f", ratio(result));
    }
    fprintf(stream, "%10.4f %8.4f %10.4f %10.4f %9s", result->kernels.median, (result->kernels.high - result->kernels.low) / 2,
            result->kernels.p99, result->wall.median, move);
    fprintf(stream, " %9s %7s %8.1f ", bound, over, device_mib(result));
    for (uint32_t p = 0; p < result->pass_count; p++) {
        fprintf(stream, " %s %.4f", result->passes[p].name, result->passes[p].time.median);
    }
    fprintf(stream, "\n");
    fflush(stream);
}

void bench_mesh_csv_header(FILE *stream) {
    fprintf(stream, "mesh,triangles,vertices,mode,edge,rays,mask,flood,sign,band,objects,moving,device,frames");
    bench_csv_stats_header(stream, "kernels");
    bench_csv_stats_header(stream, "wall");
    bench_csv_stats_header(stream, "move");
    for (int i = 0; i < PASS_NAMES; i++) {
        fprintf(stream, ",%s_median_ms", pass_names[i]);
    }
    fprintf(stream, ",bytes,copy_gb_per_s,floor_ms,ratio_to_floor");
    for (int device = 1; device >= 0; device--) {
        for (int i = 0; i < PURPOSES; i++) {
            fprintf(stream, ",%s_%s_bytes", device ? "device" : "host",
                    strcmp(purposes[i], "update state") ? purposes[i] : "update");
        }
    }
    fprintf(stream, ",samples,wrong,failure\n");
}

static void csv_case(FILE *stream, const bench_mesh_result *result) {
    const bench_mesh_case *what = &result->what;
    bench_csv_text(stream, what->mesh->name);
    fprintf(stream, ",%" PRIu64 ",%" PRIu64 ",%s", triangles(result), vertices(result), bench_mesh_mode_words[what->mode]);
    fprintf(stream, has_field(result) ? ",%u" : ",", what->edge);
    if (is_rtsdf(result)) {
        fprintf(stream, ",%u,%g,%s", what->rays, (double)what->mask, bench_mesh_flood_words[what->flood]);
    } else {
        fprintf(stream, ",,,");
    }
    if (has_band(result)) {
        fprintf(stream, ",%s,%g", bench_mesh_sign_words[what->sign], (double)what->band);
    } else {
        fprintf(stream, ",,");
    }
    if (bench_mesh_objects(what) > 1) {
        fprintf(stream, ",%u,%u,", bench_mesh_objects(what), what->moving);
    } else {
        fprintf(stream, ",,,");
    }
}

void bench_mesh_csv(FILE *stream, const bench_mesh_result *result) {
    csv_case(stream, result);
    bench_csv_text(stream, result->device);
    fprintf(stream, ",%u", result->kernels.count);
    bench_csv_stats(stream, &result->kernels);
    bench_csv_stats(stream, &result->wall);
    bench_csv_stats(stream, &result->move);
    for (int i = 0; i < PASS_NAMES; i++) {
        fprintf(stream, ",%.6g", bench_mesh_pass(result, pass_names[i]));
    }
    fprintf(stream, ",%" PRIu64 ",%.6g,%.6g,%.4g", result->bytes, result->bandwidth * 1e-9, result->floor_ms, ratio(result));
    for (int device = 1; device >= 0; device--) {
        for (int i = 0; i < PURPOSES; i++) {
            fprintf(stream, ",%" PRIu64, bench_memory_bytes(result->memory, result->memory_count, purposes[i], device));
        }
    }
    fprintf(stream, ",%u,%u,", result->samples, result->wrong);
    bench_csv_text(stream, result->failure);
    fprintf(stream, "\n");
    fflush(stream);
}

static cJSON *passes_json(const bench_mesh_result *result) {
    cJSON *array = cJSON_CreateArray();
    for (uint32_t p = 0; p < result->pass_count; p++) {
        const double floor_ms = result->bandwidth > 0 ? (double)result->passes[p].bytes / result->bandwidth * 1e3 : 0;
        cJSON *row = cJSON_CreateObject();
        cJSON_AddStringToObject(row, "name", result->passes[p].name);
        cJSON_AddNumberToObject(row, "bytes", (double)result->passes[p].bytes);
        cJSON_AddNumberToObject(row, "floor_ms", floor_ms);
        cJSON_AddItemToObject(row, "time", bench_stats_json(&result->passes[p].time));
        cJSON_AddItemToArray(array, row);
    }
    return array;
}

cJSON *bench_mesh_json(const bench_mesh_result *result) {
    const bench_mesh_case *what = &result->what;
    cJSON *row = cJSON_CreateObject();
    cJSON_AddStringToObject(row, "mesh", what->mesh->name);
    cJSON_AddNumberToObject(row, "triangles", (double)triangles(result));
    cJSON_AddNumberToObject(row, "vertices", (double)vertices(result));
    cJSON_AddStringToObject(row, "mode", bench_mesh_mode_words[what->mode]);
    if (has_field(result)) {
        cJSON_AddNumberToObject(row, "edge", what->edge);
    }
    if (is_rtsdf(result)) {
        cJSON_AddNumberToObject(row, "rays", what->rays);
        // JSON has no infinity.
        cJSON_AddItemToObject(row, "mask", isinf(what->mask) ? cJSON_CreateString("inf") : cJSON_CreateNumber((double)what->mask));
        cJSON_AddStringToObject(row, "flood", bench_mesh_flood_words[what->flood]);
    }
    if (bench_mesh_objects(what) > 1) {
        cJSON_AddNumberToObject(row, "objects", bench_mesh_objects(what));
        cJSON_AddNumberToObject(row, "moving", what->moving);
    }
    if (has_band(result)) {
        cJSON_AddStringToObject(row, "sign", bench_mesh_sign_words[what->sign]);
        cJSON_AddNumberToObject(row, "band", (double)what->band);
    }
    cJSON_AddStringToObject(row, "device", result->device);
    cJSON_AddItemToObject(row, "kernels", bench_stats_json(&result->kernels));
    cJSON_AddItemToObject(row, "wall", bench_stats_json(&result->wall));
    cJSON_AddItemToObject(row, "move", bench_stats_json(&result->move));
    cJSON_AddItemToObject(row, "passes", passes_json(result));
    cJSON_AddNumberToObject(row, "bytes", (double)result->bytes);
    cJSON_AddNumberToObject(row, "copy_bytes_per_second", result->bandwidth);
    cJSON_AddNumberToObject(row, "floor_ms", result->floor_ms);
    cJSON_AddNumberToObject(row, "ratio_to_floor", ratio(result));
    cJSON_AddItemToObject(row, "memory", bench_memory_json(result->memory, result->memory_count));
    cJSON_AddNumberToObject(row, "samples", result->samples);
    cJSON_AddNumberToObject(row, "wrong", result->wrong);
    cJSON_AddStringToObject(row, "failure", result->failure);
    return row;
}
