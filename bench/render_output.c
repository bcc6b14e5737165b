// SPDX-License-Identifier: MIT
#include "render.h"
#include "tables.h"
#include "words.h"

#include <inttypes.h>
#include <string.h>

const char *const bench_render_mode_words[] = {"faces", "shaded", "edited", NULL};

// On an H200, GPU timestamps, distance-skip march, cubes of terrain and city.
static const struct {
    uint32_t size, width, height;
    bench_render_mode mode;
    bench_render_target target;
} targets[] = {
    {512, 1280, 720, BENCH_RENDER_FACES, {0.4, 0.15}},
    {1024, 1920, 1080, BENCH_RENDER_FACES, {1.0, 0.4}},
    {1024, 1920, 1080, BENCH_RENDER_SHADED, {3, 1.5}},
    {1024, 1920, 1080, BENCH_RENDER_EDITED, {500, 1500}},
};

bench_render_target bench_render_target_of(const bench_render_case *what) {
    const fm_shape shape = what->desc.shape;
    const bool scene = strcmp(what->scene, "terrain") == 0 || strcmp(what->scene, "city") == 0;
    for (size_t i = 0; scene && what->march == FM_MARCH_SKIP && i < sizeof targets / sizeof targets[0]; i++) {
        const uint32_t size = targets[i].size;
        if (shape.x == size && shape.y == size && shape.z == size && what->width == targets[i].width &&
            what->height == targets[i].height && what->mode == targets[i].mode) {
            return targets[i].target;
        }
    }
    return (bench_render_target){0, 0};
}

static bool is_timed(const bench_render_result *result) {
    return result->gpu.count > 0;
}

static const char *verdict(const bench_render_result *result) {
    const bench_render_target target = bench_render_target_of(&result->what);
    if (target.must <= 0 || result->failure[0] || !is_timed(result)) {
        return "";
    }
    if (!strstr(result->device, "H200")) {
        return "another device";
    }
    const bool edited = result->what.mode == BENCH_RENDER_EDITED;
    const double value = edited ? result->frames_per_second : result->gpu.median;
    const bool must = edited ? value >= target.must : value <= target.must;
    const bool goal = edited ? value >= target.goal : value <= target.goal;
    return goal ? "goal" : must ? "must" : "missed";
}

static double rays_per_second(const bench_render_result *result) {
    const double rays = (double)result->what.width * result->what.height;
    return result->gpu.median > 0 ? rays * 1e3 / result->gpu.median : 0;
}

// Time that a copy of as many bytes as a pass asks for would take, and how much longer the pass took. No floor: caches serve many
// of the bytes.
static double copy_ms(const bench_render_result *result, double bytes) {
    return result->bandwidth > 0 ? bytes * 1e3 / result->bandwidth : 0;
}

static double over_copy(const bench_render_result *result, const bench_stats *time, double bytes) {
    const double least = copy_ms(result, bytes);
    return least > 0 ? time->median / least : 0;
}

static void print_memory(FILE *stream, const bench_render_result *result) {
    fprintf(stream, "    memory:");
    const char *between = "";
    for (uint32_t i = 0; i < result->memory_count; i++) {
        const fm_memory *memory = &result->memory[i];
        if (memory->bytes > 0) {
            fprintf(stream, "%s %s%s %.1f MiB", between, memory->purpose, memory->device ? " (device)" : "",
                    (double)memory->bytes / (1 << 20));
            between = ",";
        }
    }
    fprintf(stream, "\n");
}

void bench_render_print_header(FILE *stream) {
    fprintf(
        stream,
        "%-8s %-12s %-10s %-9s %-7s %-5s %8s %8s %8s %7s %6s %6s %7s %6s | %8s %9s %8s %6s | %8s %9s %8s %6s | %9s %8s %6s  %s\n",
        "scene", "world", "picture", "format", "mode", "march", "ms", "99 %", "update", "steps", "beam", "sun", "occl.", "hits",
        "beam ms", "MB", "copy ms", "/copy", "march ms", "MB", "copy ms", "/copy", "frames/s", "checked", "wrong", "target");
}

// A number in a column, or that there is none.
static void print_value(FILE *stream, bool known, int width, int digits, double value) {
    if (known) {
        fprintf(stream, " %*.*f", width, digits, value);
    } else {
        fprintf(stream, " %*s", width, "-");
    }
}

static void print_pass(FILE *stream, const bench_render_result *result, const bench_stats *time, double bytes) {
    const bool both = time->count > 0 && result->counted > 0;
    print_value(stream, time->count > 0, 8, 3, time->median);
    print_value(stream, result->counted > 0, 9, 2, bytes * 1e-6);
    print_value(stream, both, 8, 4, copy_ms(result, bytes));
    print_value(stream, both, 6, 1, over_copy(result, time, bytes));
    fprintf(stream, " |");
}

static void print_counts(FILE *stream, const bench_render_result *result) {
    const bool counted = result->counted > 0;
    print_value(stream, counted, 7, 2, result->steps);
    print_value(stream, counted, 6, 3, result->beam_reads);
    print_value(stream, counted, 6, 2, result->sun_reads);
    print_value(stream, counted, 7, 2, result->open_reads);
    print_value(stream, counted, 6, 3, result->hits);
    fprintf(stream, " |");
}

void bench_render_print(FILE *stream, const bench_render_result *result) {
    const bench_render_case *what = &result->what;
    const bench_render_target target = bench_render_target_of(what);
    char world[40], picture[32];
    bench_shape_text(what->desc.shape, world);
    snprintf(picture, sizeof picture, "%ux%u", what->width, what->height);
    fprintf(stream, "%-8s %-12s %-10s %-9s %-7s %-5s", what->scene, world, picture, fm_field_format_words[what->desc.format],
            bench_render_mode_words[what->mode], fm_march_words[what->march]);
    if (result->failure[0]) {
        fprintf(stream, " failed: %s\n", result->failure);
        return;
    }
    print_value(stream, is_timed(result), 8, 3, result->gpu.median);
    print_value(stream, is_timed(result), 8, 3, result->gpu.p99);
    print_value(stream, result->update.count > 0, 8, 3, result->update.median);
    print_counts(stream, result);
    print_pass(stream, result, &result->beam, bench_render_beam_bytes(result));
    print_pass(stream, result, &result->march, bench_render_march_bytes(result));
    print_value(stream, is_timed(result), 9, 1, result->frames_per_second);
    fprintf(stream, " %8" PRIu64 " %6" PRIu64 "  ", result->checked, result->wrong);
    if (!is_timed(result)) {
        fprintf(stream, "nothing is timed");
    } else if (target.must > 0) {
        fprintf(stream, "%g, goal %g %s: %s", target.must, target.goal, what->mode == BENCH_RENDER_EDITED ? "frames/s" : "ms",
                verdict(result));
    }
    fprintf(stream, "\n");
    if (result->memory_count > 0) {
        print_memory(stream, result);
    }
    fflush(stream);
}

void bench_render_csv_header(FILE *stream) {
    fprintf(stream, "scene,x,y,z,width,height,format,mode,march,device");
    bench_csv_stats_header(stream, "gpu_ms");
    bench_csv_stats_header(stream, "beam_ms");
    bench_csv_stats_header(stream, "march_ms");
    bench_csv_stats_header(stream, "update_ms");
    fprintf(stream, ",steps_per_ray,most_steps,hits_per_ray,beam_reads_per_ray,sun_reads_per_ray,occlusion_reads_per_ray,"
                    "rays_per_second,beam_bytes,march_bytes,copy_bytes_per_second,beam_copy_ms,march_copy_ms,frames_per_second,"
                    "checked,wrong,memory,must,goal,verdict,failure\n");
}

// "voxels 4096; field 4096 on the device", in quotes.
static void csv_memory(FILE *stream, const bench_render_result *result) {
    const char *between = "";
    fputc('"', stream);
    for (uint32_t i = 0; i < result->memory_count; i++) {
        const fm_memory *memory = &result->memory[i];
        if (memory->bytes > 0) {
            fprintf(stream, "%s%s %" PRIu64 "%s", between, memory->purpose, memory->bytes, memory->device ? " on the device" : "");
            between = "; ";
        }
    }
    fputc('"', stream);
}

// A number, or nothing.
static void csv_value(FILE *stream, bool known, double value) {
    if (known) {
        fprintf(stream, ",%.7g", value);
    } else {
        fputc(',', stream);
    }
}

void bench_render_csv(FILE *stream, const bench_render_result *result) {
    const bench_render_case *what = &result->what;
    const bench_render_target target = bench_render_target_of(what);
    const double beam = bench_render_beam_bytes(result), march = bench_render_march_bytes(result);
    fprintf(stream, "%s,%u,%u,%u,%u,%u,%s,%s,%s,", what->scene, what->desc.shape.x, what->desc.shape.y, what->desc.shape.z,
            what->width, what->height, fm_field_format_words[what->desc.format], bench_render_mode_words[what->mode],
            fm_march_words[what->march]);
    bench_csv_text(stream, result->device);
    bench_csv_stats(stream, &result->gpu);
    bench_csv_stats(stream, &result->beam);
    bench_csv_stats(stream, &result->march);
    bench_csv_stats(stream, &result->update);
    const bool timed = is_timed(result), counted = result->counted > 0;
    const double counts[] = {result->steps,      result->most_steps, result->hits,
                             result->beam_reads, result->sun_reads,  result->open_reads};
    for (size_t i = 0; i < sizeof counts / sizeof counts[0]; i++) {
        csv_value(stream, counted, counts[i]);
    }
    csv_value(stream, timed, rays_per_second(result));
    csv_value(stream, counted, beam);
    csv_value(stream, counted, march);
    csv_value(stream, timed, result->bandwidth);
    csv_value(stream, timed && counted, copy_ms(result, beam));
    csv_value(stream, timed && counted, copy_ms(result, march));
    csv_value(stream, timed, result->frames_per_second);
    fprintf(stream, ",%" PRIu64 ",%" PRIu64 ",", result->checked, result->wrong);
    csv_memory(stream, result);
    fprintf(stream, ",%g,%g,%s,", target.must, target.goal, verdict(result));
    bench_csv_text(stream, result->failure);
    fprintf(stream, "\n");
}

// A number, or null.
static void json_value(cJSON *row, const char *name, bool known, double value) {
    cJSON_AddItemToObject(row, name, known ? cJSON_CreateNumber(value) : cJSON_CreateNull());
}

// A pass's bytes, and the time of a copy of as many.
static void json_pass(cJSON *row, const bench_render_result *result, const char *name, const bench_stats *time, double bytes) {
    const bool counted = result->counted > 0, both = counted && time->count > 0;
    cJSON *pass = cJSON_AddObjectToObject(row, name);
    json_value(pass, "bytes", counted, bytes);
    json_value(pass, "copy_ms", both, copy_ms(result, bytes));
    json_value(pass, "over_copy", both, over_copy(result, time, bytes));
}

cJSON *bench_render_json(const bench_render_result *result) {
    const bench_render_case *what = &result->what;
    const bench_render_target target = bench_render_target_of(what);
    const bool timed = is_timed(result), counted = result->counted > 0;
    cJSON *row = cJSON_CreateObject();
    cJSON_AddStringToObject(row, "scene", what->scene);
    cJSON_AddItemToObject(
        row, "shape",
        cJSON_CreateIntArray((const int[]){(int)what->desc.shape.x, (int)what->desc.shape.y, (int)what->desc.shape.z}, 3));
    cJSON_AddNumberToObject(row, "width", what->width);
    cJSON_AddNumberToObject(row, "height", what->height);
    cJSON_AddStringToObject(row, "format", fm_field_format_words[what->desc.format]);
    cJSON_AddStringToObject(row, "mode", bench_render_mode_words[what->mode]);
    cJSON_AddStringToObject(row, "march", fm_march_words[what->march]);
    cJSON_AddStringToObject(row, "device", result->device);
    cJSON_AddItemToObject(row, "gpu_ms", bench_stats_json(&result->gpu));
    cJSON_AddItemToObject(row, "beam_ms", bench_stats_json(&result->beam));
    cJSON_AddItemToObject(row, "march_ms", bench_stats_json(&result->march));
    cJSON_AddItemToObject(row, "update_ms", bench_stats_json(&result->update));
    json_value(row, "steps_per_ray", counted, result->steps);
    json_value(row, "most_steps", counted, result->most_steps);
    json_value(row, "hits_per_ray", counted, result->hits);
    json_value(row, "rays_per_second", timed, rays_per_second(result));
    json_value(row, "beam_reads_per_ray", counted, result->beam_reads);
    json_value(row, "sun_reads_per_ray", counted, result->sun_reads);
    json_value(row, "occlusion_reads_per_ray", counted, result->open_reads);
    json_value(row, "copy_bytes_per_second", timed, result->bandwidth);
    json_pass(row, result, "beam", &result->beam, bench_render_beam_bytes(result));
    json_pass(row, result, "march_pass", &result->march, bench_render_march_bytes(result));
    cJSON_AddNumberToObject(row, "checked", (double)result->checked);
    cJSON_AddNumberToObject(row, "wrong", (double)result->wrong);
    cJSON_AddItemToObject(row, "memory", bench_memory_json(result->memory, result->memory_count));
    json_value(row, "frames_per_second", timed, result->frames_per_second);
    if (target.must > 0) {
        cJSON_AddNumberToObject(row, "must", target.must);
        cJSON_AddNumberToObject(row, "goal", target.goal);
        if (timed) {
            cJSON_AddStringToObject(row, "verdict", verdict(result));
        }
    }
    if (result->failure[0]) {
        cJSON_AddStringToObject(row, "failure", result->failure);
    }
    return row;
}
