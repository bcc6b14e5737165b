// SPDX-License-Identifier: MIT
// Grids that brute force takes in several dispatches, and axes too long for the kernels that keep whole columns, against the CPU.
// `--slow` adds an axis of more turns than llvmpipe grants the loops of one invocation (65,535).

#include "vulkan_common.h"

typedef struct large_case {
    fm_shape shape;
    uint32_t one_in;  // a voxel is solid; 0: only the last one
    fm_algorithm algorithm;
} large_case;

static const large_case cases[] = {
    {{2, 100, 10}, 3, FM_ALGORITHM_BRUTE_FORCE},   {{1, 1, 2000}, 40, FM_ALGORITHM_BRUTE_FORCE},
    {{33, 3, 331}, 200, FM_ALGORITHM_BRUTE_FORCE}, {{7, 11, 400}, 0, FM_ALGORITHM_BRUTE_FORCE},
    {{3, 9000, 2}, 50, FM_ALGORITHM_SEPARABLE},    {{2, 3, 9000}, 50, FM_ALGORITHM_SEPARABLE},
    {{1, 9000, 1}, 900, FM_ALGORITHM_SEPARABLE},   {{33, 9000, 1}, 2, FM_ALGORITHM_SEPARABLE},
};
static const large_case slow_cases[] = {
    {{1, 66000, 1}, 0, FM_ALGORITHM_SEPARABLE},
    {{1, 1, 66000}, 0, FM_ALGORITHM_SEPARABLE},
};

typedef struct large_test {
    fm_context *host, *device;
    uint8_t *solid;
    void *distance[2];
    uint64_t *indices[2];
} large_test;

static fm_result run(large_test *test, int which, fm_transform_desc desc, const large_case *at, bool want_index) {
    const fm_array solid = {test->solid, FM_TYPE_U8, at->shape};
    const fm_array distance = {test->distance[which], FM_TYPE_F32, at->shape};
    const fm_array indices = {test->indices[which], FM_TYPE_U64, at->shape};
    desc.algorithm = which ? at->algorithm : FM_ALGORITHM_SEPARABLE;
    return fm_transform_host(which ? test->device : test->host, &desc, &solid, &distance, want_index ? &indices : NULL);
}

static void compare(large_test *test, const fm_transform_desc *desc, const large_case *at, bool want_index) {
    const uint64_t voxels = (uint64_t)at->shape.x * at->shape.y * at->shape.z;
    for (int i = 0; i < 2; i++) {
        memset(test->distance[i], 0x11 * (i + 1), voxels * 4);
        memset(test->indices[i], 0x11 * (i + 1), voxels * 8);
        CHECK_OK(run(test, i, *desc, at, want_index));
    }
    const bool same = CHECK(memcmp(test->distance[0], test->distance[1], voxels * 4) == 0);
    const bool same_sites = !want_index || CHECK(memcmp(test->indices[0], test->indices[1], voxels * 8) == 0);
    if (!same || !same_sites) {
        fprintf(stderr, "    %u x %u x %u, one in %u, metric %d%s%s\n", at->shape.x, at->shape.y, at->shape.z, at->one_in,
                (int)desc->metric, desc->is_signed ? ", signed" : "", want_index ? ", indices" : "");
    }
}

static bool prepare(large_test *test, const large_case *at) {
    const uint64_t voxels = (uint64_t)at->shape.x * at->shape.y * at->shape.z;
    test->solid = calloc(voxels, 1);
    for (int i = 0; i < 2; i++) {
        test->distance[i] = malloc(voxels * 4);
        test->indices[i] = malloc(voxels * 8);
        if (!test->distance[i] || !test->indices[i]) {
            return false;
        }
    }
    if (!test->solid) {
        return false;
    }
    uint32_t random = 1;
    for (uint64_t i = 0; i < voxels; i++) {
        random = random * 1664525u + 1013904223u;
        test->solid[i] = at->one_in ? (random >> 8) % at->one_in == 0 : i + 1 == voxels;
    }
    return true;
}

static void finish(large_test *test) {
    free(test->solid);
    for (int i = 0; i < 2; i++) {
        free(test->distance[i]);
        free(test->indices[i]);
    }
}

static void run_case(large_test *test, const large_case *at) {
    if (CHECK(prepare(test, at))) {
        for (int metric = FM_METRIC_L2; metric <= FM_METRIC_LINF; metric++) {
            compare(test, &(fm_transform_desc){.metric = (fm_metric)metric, .is_signed = true}, at, true);
            compare(test, &(fm_transform_desc){.metric = (fm_metric)metric, .outside = FM_OUTSIDE_SOLID}, at, false);
        }
    }
    finish(test);
}

static void run_slow(large_test *test, const large_case *at) {
    if (CHECK(prepare(test, at))) {
        compare(test, &(fm_transform_desc){.metric = FM_METRIC_L1}, at, false);
    }
    finish(test);
}

int main(int count, char **arguments) {
    vulkan_options options;
    const bool slow = count > 1 && strcmp(arguments[1], "--slow") == 0;
    if (!vulkan_parse(count - slow, arguments + slow, &options)) {
        return 2;
    }
    large_test test = {0};
    fm_result result = vulkan_open(&options, NULL, &test.device);
    if (result == FM_ERROR_NO_DEVICE) {
        return vulkan_missing();
    }
    const fm_context_desc host = {.backend = FM_BACKEND_CPU};
    if (CHECK_OK(result) && CHECK_OK(fm_context_create(&host, &test.host))) {
        for (size_t i = 0; i < sizeof cases / sizeof cases[0]; i++) {
            run_case(&test, &cases[i]);
        }
        for (size_t i = 0; slow && i < sizeof slow_cases / sizeof slow_cases[0]; i++) {
            run_slow(&test, &slow_cases[i]);
        }
    }
    vulkan_close(test.device);
    fm_context_destroy(test.host);
    return check_summary();
}
