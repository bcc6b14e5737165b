// SPDX-License-Identifier: MIT
#include "tables.h"

#include <inttypes.h>
#include <string.h>

void bench_shape_text(fm_shape shape, char text[40]) {
    snprintf(text, 40, "%" PRIu32 "x%" PRIu32 "x%" PRIu32, shape.x, shape.y, shape.z);
}

void bench_csv_text(FILE *stream, const char *text) {
    fputc('"', stream);
    for (; *text; text++) {
        if (*text == '"') {
            fputc('"', stream);
        }
        fputc(*text, stream);
    }
    fputc('"', stream);
}

void bench_csv_stats_header(FILE *stream, const char *name) {
    static const char *const columns[] = {"median_ms", "min_ms",    "mean_ms",    "stddev_ms",
                                          "p99_ms",    "ci_low_ms", "ci_high_ms", "ci_level"};
    for (size_t i = 0; i < sizeof columns / sizeof columns[0]; i++) {
        fprintf(stream, ",%s_%s", name, columns[i]);
    }
}

void bench_csv_stats(FILE *stream, const bench_stats *stats) {
    if (stats->count) {
        fprintf(stream, ",%.6g,%.6g,%.6g,%.6g,%.6g,%.6g,%.6g,%.4g", stats->median, stats->least, stats->mean, stats->deviation,
                stats->p99, stats->low, stats->high, stats->confidence);
    } else {
        fprintf(stream, ",,,,,,,,");
    }
}

cJSON *bench_stats_json(const bench_stats *stats) {
    if (!stats->count) {
        return cJSON_CreateNull();
    }
    cJSON *object = cJSON_CreateObject();
    cJSON_AddNumberToObject(object, "runs", stats->count);
    cJSON_AddNumberToObject(object, "median_ms", stats->median);
    cJSON_AddNumberToObject(object, "min_ms", stats->least);
    cJSON_AddNumberToObject(object, "mean_ms", stats->mean);
    cJSON_AddNumberToObject(object, "stddev_ms", stats->deviation);
    cJSON_AddNumberToObject(object, "p99_ms", stats->p99);
    cJSON_AddNumberToObject(object, "ci_low_ms", stats->low);
    cJSON_AddNumberToObject(object, "ci_high_ms", stats->high);
    cJSON_AddNumberToObject(object, "ci_level", stats->confidence);
    return object;
}

uint64_t bench_memory_bytes(const fm_memory *memory, uint32_t count, const char *purpose, bool device) {
    uint64_t bytes = 0;
    for (uint32_t i = 0; i < count; i++) {
        bytes += memory[i].device == device && strcmp(memory[i].purpose, purpose) == 0 ? memory[i].bytes : 0;
    }
    return bytes;
}

cJSON *bench_memory_json(const fm_memory *memory, uint32_t count) {
    cJSON *array = cJSON_CreateArray();
    for (uint32_t i = 0; i < count; i++) {
        cJSON *row = cJSON_CreateObject();
        cJSON_AddStringToObject(row, "purpose", memory[i].purpose);
        cJSON_AddBoolToObject(row, "device", memory[i].device);
        cJSON_AddNumberToObject(row, "bytes", (double)memory[i].bytes);
        cJSON_AddItemToArray(array, row);
    }
    return array;
}
