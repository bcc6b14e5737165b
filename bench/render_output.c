// SPDX-License-Identifier: MIT
#include "render.h"
#include "tables.h"
#include "words.h"

const char *const bench_render_mode_words[] = {"faces", "shaded", "edited", NULL};

bench_render_target bench_render_target_of(uint32_t size, bench_render_mode mode, fm_march march) {
    if (march != FM_MARCH_SKIP) {
        return (bench_render_target){0, 0};
    }
    if (size == 512 && mode == BENCH_RENDER_FACES) {
        return (bench_render_target){0.4, 0.15};
    }
    static const bench_render_target large[] = {{1.0, 0.4}, {3, 1.5}, {500, 1500}};
    return size == 1024 ? large[mode] : (bench_render_target){0, 0};
}

static const char *verdict(const bench_render_result *result, bench_render_target target) {
    if (target.must <= 0 || result->failure[0]) {
        return "";
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

// Time that the bytes of the primary rays' reads would take at the speed of a copy.
static double floor_ms(const bench_render_result *result) {
    return result->bandwidth > 0 ? bench_render_bytes(result) * 1e3 / result->bandwidth : 0;
}

void bench_render_print_header(FILE *stream) {
    fprintf(stream, "%-8s %-12s %-10s %-9s %-7s %-5s %8s %8s %8s %8s %8s %8s %7s %6s %8s %8s %9s  %s\n", "scene", "world",
            "picture", "format", "mode", "march", "ms", "least", "99 %", "beam", "march", "update", "steps", "hits", "Grays/s",
            "floor ms", "frames/s", "target");
}

void bench_render_print(FILE *stream, const bench_render_result *result, bench_render_target target) {
    const bench_render_case *what = &result->what;
    char world[40], picture[32];
    bench_shape_text(what->desc.shape, world);
    snprintf(picture, sizeof picture, "%ux%u", what->width, what->height);
    fprintf(stream, "%-8s %-12s %-10s %-9s %-7s %-5s ", what->scene, world, picture, fm_field_format_words[what->desc.format],
            bench_render_mode_words[what->mode], fm_march_words[what->march]);
    if (result->failure[0]) {
        fprintf(stream, "failed: %s\n", result->failure);
        return;
    }
    fprintf(stream, "%8.3f %8.3f %8.3f %8.3f %8.3f %8.3f %7.2f %6.3f %8.2f %8.4f %9.1f  ", result->gpu.median, result->gpu.least,
            result->gpu.p99, result->beam.median, result->march.median, result->update.median, result->steps, result->hits,
            rays_per_second(result) * 1e-9, floor_ms(result), result->frames_per_second);
    if (target.must > 0) {
        fprintf(stream, "%g, goal %g %s: %s", target.must, target.goal, what->mode == BENCH_RENDER_EDITED ? "frames/s" : "ms",
                verdict(result, target));
    }
    fprintf(stream, "\n");
    fflush(stream);
}

void bench_render_csv_header(FILE *stream) {
    fprintf(stream, "scene,x,y,z,width,height,format,mode,march,device");
    bench_csv_stats_header(stream, "gpu_ms");
    bench_csv_stats_header(stream, "beam_ms");
    bench_csv_stats_header(stream, "march_ms");
    bench_csv_stats_header(stream, "update_ms");
    fprintf(stream, ",steps_per_ray,most_steps,hits_per_ray,rays_per_second,field_bytes,copy_bytes_per_second,floor_ms,"
                    "frames_per_second,must,goal,verdict,failure\n");
}

void bench_render_csv(FILE *stream, const bench_render_result *result, bench_render_target target) {
    const bench_render_case *what = &result->what;
    fprintf(stream, "%s,%u,%u,%u,%u,%u,%s,%s,%s,", what->scene, what->desc.shape.x, what->desc.shape.y, what->desc.shape.z,
            what->width, what->height, fm_field_format_words[what->desc.format], bench_render_mode_words[what->mode],
            fm_march_words[what->march]);
    bench_csv_text(stream, result->device);
    bench_csv_stats(stream, &result->gpu);
    bench_csv_stats(stream, &result->beam);
    bench_csv_stats(stream, &result->march);
    bench_csv_stats(stream, &result->update);
    fprintf(stream, ",%.4f,%.0f,%.5f,%.6g,%.6g,%.6g,%.6g,%.4f,%g,%g,%s,", result->steps, result->most_steps, result->hits,
            rays_per_second(result), bench_render_bytes(result), result->bandwidth, floor_ms(result), result->frames_per_second,
            target.must, target.goal, verdict(result, target));
    bench_csv_text(stream, result->failure);
    fprintf(stream, "\n");
}

cJSON *bench_render_json(const bench_render_result *result, bench_render_target target) {
    const bench_render_case *what = &result->what;
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
    cJSON_AddNumberToObject(row, "steps_per_ray", result->steps);
    cJSON_AddNumberToObject(row, "most_steps", result->most_steps);
    cJSON_AddNumberToObject(row, "hits_per_ray", result->hits);
    cJSON_AddNumberToObject(row, "rays_per_second", rays_per_second(result));
    cJSON_AddNumberToObject(row, "field_bytes", bench_render_bytes(result));
    cJSON_AddNumberToObject(row, "copy_bytes_per_second", result->bandwidth);
    cJSON_AddNumberToObject(row, "floor_ms", floor_ms(result));
    cJSON_AddNumberToObject(row, "frames_per_second", result->frames_per_second);
    if (target.must > 0) {
        cJSON_AddNumberToObject(row, "must", target.must);
        cJSON_AddNumberToObject(row, "goal", target.goal);
        cJSON_AddStringToObject(row, "verdict", verdict(result, target));
    }
    if (result->failure[0]) {
        cJSON_AddStringToObject(row, "failure", result->failure);
    }
    return row;
}
