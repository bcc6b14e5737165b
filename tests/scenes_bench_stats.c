// SPDX-License-Identifier: MIT
// The benchmark's statistics and its check of results, which must be able to tell a wrong field.

#include "bench.h"
#include "check.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

static void test_stats(void) {
    double one[] = {4};
    bench_stats stats = bench_stats_of(one, 1);
    CHECK(stats.median == 4 && stats.least == 4 && stats.deviation == 0 && stats.low == 4 && stats.high == 4);

    double eight[] = {9, 7, 2, 4, 5, 4, 5, 4};
    stats = bench_stats_of(eight, 8);
    CHECK(stats.median == 4.5 && stats.least == 2 && stats.mean == 5);
    CHECK(fabs(stats.deviation - 2.1380899352993950) < 1e-12);
    // For 8 values the interval of at least 0.95 runs from the smallest to the greatest: 1 - 2 / 2^8.
    CHECK(stats.p99 == 9);
    CHECK(stats.low == 2 && stats.high == 9 && fabs(stats.confidence - (1 - 2.0 / 256)) < 1e-12);

    // For 20 values it is from the 6th to the 15th, level 0.9586 (the table of the sign test).
    double twenty[20];
    for (int i = 0; i < 20; i++) {
        twenty[i] = (i * 7) % 20;
    }
    stats = bench_stats_of(twenty, 20);
    CHECK(stats.low == 5 && stats.high == 14 && fabs(stats.confidence - 0.95861) < 1e-5);

    // Of 100 values the 99th, of 101 the 100th: one value may lie above.
    double many[BENCH_STATS_MAX];
    for (int i = 0; i < BENCH_STATS_MAX; i++) {
        many[i] = BENCH_STATS_MAX - i;
    }
    stats = bench_stats_of(many, BENCH_STATS_MAX);
    CHECK(stats.p99 == 990 && many[0] == 1);
    CHECK(bench_stats_of(many, 100).p99 == 99 && bench_stats_of(many, 101).p99 == 100 && bench_stats_of(many, 99).p99 == 99);

    double five[] = {1, 2, 3, 4, 5};
    stats = bench_stats_of(five, 5);
    CHECK(stats.low == 1 && stats.high == 5 && fabs(stats.confidence - 0.9375) < 1e-12);
}

// Every voxel against every solid one: what the check's own search must agree with.
static uint64_t nearest(const uint8_t *voxels, fm_shape shape, fm_metric metric, uint32_t i) {
    uint64_t best = UINT64_MAX;
    for (uint32_t k = 0; k < shape.x * shape.y * shape.z; k++) {
        if (voxels[k]) {
            const int64_t dx = llabs((int64_t)(k % shape.x) - i % shape.x),
                          dy = llabs((int64_t)(k / shape.x % shape.y) - i / shape.x % shape.y),
                          dz = llabs((int64_t)(k / shape.x / shape.y) - i / shape.x / shape.y);
            const int64_t longest = dx > dy ? (dx > dz ? dx : dz) : (dy > dz ? dy : dz);
            const int64_t all = metric == FM_METRIC_L1     ? dx + dy + dz
                                : metric == FM_METRIC_LINF ? longest
                                                           : dx * dx + dy * dy + dz * dz;
            best = (uint64_t)all < best ? (uint64_t)all : best;
        }
    }
    return best;
}

static void test_check(const char *name, fm_metric metric) {
    enum { SAMPLES = 3000 };
    bench_case what = {.scene = fm_scene_find(name),
                       .scene_desc = {.shape = {19, 14, 9}, .density = 0.01},
                       .metric = metric,
                       .output = FM_TYPE_U32};
    bench_scene *scene = bench_scene_create(what.scene, &what.scene_desc);
    const uint8_t *voxels = bench_scene_input(scene, FM_TYPE_U8);
    const uint32_t count = (uint32_t)bench_voxels(&what);
    uint32_t *field = malloc(count * sizeof *field);
    char message[256] = "";
    for (uint32_t i = 0; i < count; i++) {
        const uint64_t raw = nearest(voxels, what.scene_desc.shape, metric, i);
        field[i] = raw == UINT64_MAX ? UINT32_MAX : (uint32_t)raw;
    }
    CHECK(bench_scene_check(scene, &what, field, SAMPLES, message, sizeof message) == 0);
    for (uint32_t i = 0; i < count; i++) {
        field[i]++;
    }
    CHECK(bench_scene_check(scene, &what, field, SAMPLES, message, sizeof message) == SAMPLES);
    CHECK(strstr(message, "should be") != NULL);
    // One corner off by one is seen too: corners are always among the samples.
    for (uint32_t i = 0; i < count - 1; i++) {
        field[i]--;
    }
    CHECK(bench_scene_check(scene, &what, field, SAMPLES, message, sizeof message) >= 1);
    free(field);
    bench_scene_destroy(scene);
}

int main(void) {
    test_stats();
    const char *const names[] = {"terrain", "sparse", "shell", "single", "empty", "full", "checker"};
    for (int i = 0; i < 7; i++) {
        for (fm_metric metric = FM_METRIC_L2; metric <= FM_METRIC_LINF; metric++) {
            test_check(names[i], metric);
        }
    }
    return check_summary();
}
