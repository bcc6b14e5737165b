// SPDX-License-Identifier: MIT
#include "tables.h"
#include "world.h"

#include <string.h>

// On an H200, GPU timestamps, L1, packed field, edits of random radius 1 to 16 that place and delete, terrain with caves.
static const bench_world_target targets[] = {
    {"exact, one edit an update", 512, 1, 0.10, 0.30, 0.04, 0.12},
    {"exact, one edit an update", 1024, 1, 0.20, 0.60, 0.06, 0.20},
    {"exact, 100 scattered edits an update", 1024, 100, 4, 0, 1.5, 0},
    {"exact, everything regenerated", 1024, 0, 6, 0, 3.5, 0},
};
enum { MEMORY_SIZE = 1024, MEMORY_MUST = 4 };

const bench_world_target *bench_world_target_at(uint32_t i) {
    return i < sizeof targets / sizeof targets[0] ? &targets[i] : NULL;
}

static void limit_text(double median, double p99, char text[32]) {
    if (p99 > 0) {
        snprintf(text, 32, "%.2f / %.2f", median, p99);
    } else {
        snprintf(text, 32, "%.2g", median);
    }
}

static bool within(const bench_stats *stats, double median, double p99) {
    return stats->median <= median && (p99 <= 0 || stats->p99 <= p99);
}

void bench_world_target_header(FILE *stream) {
    fprintf(stream, "| target | measured at | median ms | 99th percentile | of | must | goal | verdict |\n"
                    "|---|---|---|---|---|---|---|---|\n");
}

// The targets are those of one device and size.
static bool comparable(const bench_world_result *result, uint32_t size) {
    const fm_shape shape = result->what.desc.shape;
    return shape.x == size && shape.y == size && shape.z == size && strstr(result->device, "H200");
}

void bench_world_target_print(FILE *stream, const bench_world_target *target, const bench_world_result *result) {
    const bench_stats *stats = target->edits ? &result->update : &result->full;
    char shape[40], must[32], goal[32];
    bench_shape_text(result->what.desc.shape, shape);
    limit_text(target->must, target->must_p99, must);
    limit_text(target->goal, target->goal_p99, goal);
    fprintf(stream, "| %s, %u^3 | %s | ", target->name, target->size, shape);
    if (result->failure[0]) {
        fprintf(stream, "- | - | - | %s | %s | failed: %s |\n", must, goal, result->failure);
        return;
    }
    const char *verdict = !comparable(result, target->size)               ? "another device or size"
                          : within(stats, target->goal, target->goal_p99) ? "goal met"
                          : within(stats, target->must, target->must_p99) ? "must met"
                                                                          : "missed";
    fprintf(stream, "%.4f | %.4f | %u | %s | %s | %s |\n", stats->median, stats->p99, stats->count, must, goal, verdict);
    fflush(stream);
}

void bench_world_target_memory(FILE *stream, const bench_world_result *result) {
    char shape[40];
    bench_shape_text(result->what.desc.shape, shape);
    if (result->failure[0]) {
        return;
    }
    const double bytes = bench_world_per_voxel(result, result->rest_bytes);
    const bool known = comparable(result, MEMORY_SIZE);
    fprintf(stream, "| memory beside voxels and field, %d^3, bytes a voxel | %s | %.3f | - | 1 | %d | - | %s |\n", MEMORY_SIZE,
            shape, bytes, MEMORY_MUST,
            !known                 ? "another device or size"
            : bytes <= MEMORY_MUST ? "must met"
                                   : "missed");
}
