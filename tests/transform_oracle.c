// SPDX-License-Identifier: MIT
// Every transform against brute force on the CPU, over the table of cases.
// Arguments: --backend cpu|vulkan, --device NAME, --quick, --stride N (CPU: every N-th variant of each grid; Vulkan: every N-th
// variant, on a handful of grids each), --no-validation.

#include "cases.h"
#include "check.h"
#include "vulkan_common.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

enum { MOST_BYTES = 1 << 17, ULPS = 4 };

typedef struct test_options {
    fm_backend backend;
    const char *device;
    uint32_t stride;  // 0: the default
    bool no_validation;
} test_options;

typedef struct outputs {
    uint64_t distance[MOST_BYTES / 8];
    uint64_t indices[MOST_BYTES / 8];
} outputs;

// Instruction sets of the CPU backend, as FATHOM_SIMD names them.
enum { SETS = 3 };
static const char *const sets[SETS] = {"portable", "avx2", "avx512"};

typedef struct test_runner {
    fm_context *reference;
    bool has_set[SETS];
    fm_context *subjects[3];  // CPU: 1, 2 and 5 threads; Vulkan: one
    uint32_t subject_count;
    uint8_t solid[MOST_BYTES];
    uint64_t encoded[MOST_BYTES / 8];
    outputs wanted, got;
} test_runner;

// One comparison: what ran, for the message.
typedef struct context_of_check {
    const test_grid *grid;
    const test_variant *variant;
    const test_encoding *encoding;
    const char *how;
} context_of_check;

static void describe(const context_of_check *at, int64_t voxel) {
    const fm_transform_desc *desc = &at->variant->desc;
    if (check_failures > 50) {
        return;
    }
    fprintf(
        stderr,
        "    %s: %u x %u x %u %s, %s in (select %d), metric %d%s%s, outside %d, limit %g, spacing %g %g %g, %s%s%s, voxel %lld\n",
        at->how, at->grid->shape.x, at->grid->shape.y, at->grid->shape.z, test_pattern_name(at->grid->pattern),
        fm_type_name(at->encoding->type), (int)at->encoding->select, (int)desc->metric, desc->is_signed ? ", signed" : "",
        desc->squared ? ", squared" : "", (int)desc->outside, desc->max_distance, desc->spacing[0], desc->spacing[1],
        desc->spacing[2], at->variant->want_distance ? fm_type_name(at->variant->distance) : "no distance",
        at->variant->want_index ? ", indices " : "", at->variant->want_index ? fm_type_name(at->variant->index) : "",
        (long long)voxel);
}

static uint64_t bytes_of(fm_shape shape, fm_type type) {
    uint64_t bytes = 0;
    CHECK_OK(fm_array_bytes(shape, type, &bytes));
    return bytes;
}

static int64_t float_order(float value) {
    int32_t bits;
    memcpy(&bits, &value, sizeof bits);
    return bits < 0 ? -(int64_t)(bits & INT32_MAX) : bits;
}

// Where axes differ the raw distances are sums of floats, which a device may round otherwise.
static bool may_round(const test_runner *runner, const test_variant *variant) {
    const double *spacing = variant->desc.spacing;
    const bool sums_round = spacing[0] != spacing[1] || spacing[0] != spacing[2];
    return sums_round && fm_context_backend(runner->subjects[0]) == FM_BACKEND_VULKAN;
}

// Element at which the distances differ, or -1.
static int64_t first_difference(const test_runner *runner, const test_variant *variant, uint64_t voxels) {
    const void *a = runner->wanted.distance;
    const void *b = runner->got.distance;
    const bool rounded = variant->distance == FM_TYPE_F32 && may_round(runner, variant);
    const size_t size = fm_type_size(variant->distance);
    for (uint64_t i = 0; i < voxels; i++) {
        if (memcmp((const uint8_t *)a + i * size, (const uint8_t *)b + i * size, size) == 0) {
            continue;
        }
        if (!rounded) {
            return (int64_t)i;
        }
        const float wanted = ((const float *)a)[i];
        const float got = ((const float *)b)[i];
        if (isinf(wanted) || isinf(got) || llabs(float_order(wanted) - float_order(got)) > ULPS) {
            return (int64_t)i;
        }
    }
    return -1;
}

static uint64_t index_at(const outputs *out, fm_type type, uint64_t voxel) {
    if (type == FM_TYPE_U64) {
        return out->indices[voxel];
    }
    uint32_t index = ((const uint32_t *)out->indices)[voxel];
    return index == FM_NO_INDEX_32 ? FM_NO_INDEX_64 : index;
}

static double way(const context_of_check *at, uint64_t from, uint64_t to) {
    const fm_shape shape = at->grid->shape;
    const double *spacing = at->variant->desc.spacing;
    const double x = spacing[0] * fabs((double)(from % shape.x) - (double)(to % shape.x));
    const double y = spacing[1] * fabs((double)(from / shape.x % shape.y) - (double)(to / shape.x % shape.y));
    const double z = spacing[2] * fabs((double)(from / shape.x / shape.y) - (double)(to / shape.x / shape.y));
    switch (at->variant->desc.metric) {
    case FM_METRIC_L2:
        return sqrt(x * x + y * y + z * z);
    case FM_METRIC_L1:
        return x + y + z;
    default:
        return fmax(x, fmax(y, z));
    }
}

// The true distance beyond which a voxel has no site: the limit, or the way out of a grid in a solid world.
static double reach(const context_of_check *at, uint64_t from) {
    const fm_transform_desc *desc = &at->variant->desc;
    const fm_shape shape = at->grid->shape;
    const uint64_t position[3] = {from % shape.x, from / shape.x % shape.y, from / shape.x / shape.y};
    const uint64_t size[3] = {shape.x, shape.y, shape.z};
    double least = desc->max_distance > 0 ? desc->max_distance : INFINITY;
    for (int i = 0; desc->outside == FM_OUTSIDE_SOLID && i < 3; i++) {
        const double out = (double)(position[i] + 1 < size[i] - position[i] ? position[i] + 1 : size[i] - position[i]);
        least = fmin(least, desc->spacing[i] * out);
    }
    return least;
}

static bool nearly(double a, double b) {
    return fabs(a - b) <= ULPS * 0x1p-23 * b;
}

// Voxel whose index differs, or -1. On a device a site may stand for another where only the rounding of sums of floats tells which
// is nearer.
static int64_t first_other_site(const test_runner *runner, const context_of_check *at) {
    const fm_shape shape = at->grid->shape;
    const uint64_t voxels = (uint64_t)shape.x * shape.y * shape.z;
    const bool rounded = may_round(runner, at->variant);
    for (uint64_t i = 0; i < voxels; i++) {
        const uint64_t wanted = index_at(&runner->wanted, at->variant->index, i);
        const uint64_t got = index_at(&runner->got, at->variant->index, i);
        if (wanted == got) {
            continue;
        }
        if (!rounded || (got < voxels && !runner->solid[got])) {
            return (int64_t)i;
        }
        // Rounding may also tell whether a site is within reach.
        const double wanted_way = wanted < voxels ? way(at, i, wanted) : reach(at, i);
        const double got_way = got < voxels ? way(at, i, got) : reach(at, i);
        if (!nearly(got_way, wanted_way)) {
            return (int64_t)i;
        }
    }
    return -1;
}

static void compare(const test_runner *runner, const context_of_check *at) {
    const fm_shape shape = at->grid->shape;
    const uint64_t voxels = (uint64_t)shape.x * shape.y * shape.z;
    if (at->variant->want_distance) {
        int64_t difference = first_difference(runner, at->variant, voxels);
        if (!CHECK(difference < 0)) {
            describe(at, difference);
        }
    }
    if (at->variant->want_index) {
        int64_t difference = first_other_site(runner, at);
        if (!CHECK(difference < 0)) {
            describe(at, difference);
        }
    }
}

static fm_result run_host(fm_context *context, const fm_transform_desc *desc, const test_grid *grid, const test_variant *variant,
                          fm_type type, void *solid, outputs *out) {
    memset(out->distance, 0xa5, variant->want_distance ? bytes_of(grid->shape, variant->distance) : 0);
    memset(out->indices, 0xa5, variant->want_index ? bytes_of(grid->shape, variant->index) : 0);
    fm_array array = {solid, type, grid->shape};
    fm_array distance = {out->distance, variant->distance, grid->shape};
    fm_array indices = {out->indices, variant->index, grid->shape};
    return fm_transform_host(context, desc, &array, variant->want_distance ? &distance : NULL,
                             variant->want_index ? &indices : NULL);
}

static fm_transform_desc described(const test_variant *variant, const test_encoding *encoding, fm_algorithm algorithm) {
    fm_transform_desc desc = variant->desc;
    desc.algorithm = algorithm;
    desc.select = encoding->select;
    desc.threshold = encoding->threshold;
    desc.label = encoding->label;
    return desc;
}

// The same through volumes where the context computes.
static void run_volumes(test_runner *runner, fm_context *context, const fm_transform_desc *desc, const context_of_check *at) {
    fm_volume *solid = NULL, *distance = NULL, *indices = NULL;
    fm_volume_desc volume = {.shape = at->grid->shape, .type = at->encoding->type, .spacing = {2, 3, 4}, .origin = {5, 6, 7}};
    CHECK_OK(fm_volume_create(context, &volume, &solid));
    CHECK_OK(fm_volume_upload(solid, runner->encoded));
    fm_volume_desc result = {.shape = at->grid->shape};
    if (at->variant->want_distance) {
        result.type = at->variant->distance;
        CHECK_OK(fm_volume_create(context, &result, &distance));
    }
    if (at->variant->want_index) {
        result.type = at->variant->index;
        CHECK_OK(fm_volume_create(context, &result, &indices));
    }
    fm_ticket ticket = UINT64_MAX;
    bool asynchronous = at->grid->seed % 2;
    if (CHECK_OK(fm_transform(context, desc, solid, distance, indices, asynchronous ? &ticket : NULL))) {
        CHECK_OK(asynchronous ? fm_wait(context, ticket) : FM_OK);
        memset(runner->got.distance, 0x5a, at->variant->want_distance ? bytes_of(volume.shape, at->variant->distance) : 0);
        memset(runner->got.indices, 0x5a, at->variant->want_index ? bytes_of(volume.shape, at->variant->index) : 0);
        if (distance) {
            CHECK_OK(fm_volume_download(distance, runner->got.distance));
            fm_volume_info(distance, &result);
            CHECK(memcmp(result.spacing, volume.spacing, sizeof volume.spacing) == 0);
            CHECK(memcmp(result.origin, volume.origin, sizeof volume.origin) == 0);
        }
        if (indices) {
            CHECK_OK(fm_volume_download(indices, runner->got.indices));
        }
        compare(runner, at);
    } else {
        describe(at, -1);
    }
    fm_volume_destroy(solid);
    fm_volume_destroy(distance);
    fm_volume_destroy(indices);
}

static void run_one(test_runner *runner, fm_context *context, const fm_transform_desc *desc, const context_of_check *at) {
    fm_result result = run_host(context, desc, at->grid, at->variant, at->encoding->type, runner->encoded, &runner->got);
    if (CHECK_OK(result)) {
        compare(runner, at);
    } else {
        describe(at, -1);
    }
}

static void run_case(test_runner *runner, const test_grid *grid, const test_variant *variant, const test_encoding *encoding,
                     uint32_t number) {
    context_of_check at = {grid, variant, encoding, "brute force"};
    fm_transform_desc desc = variant->desc;
    desc.algorithm = FM_ALGORITHM_BRUTE_FORCE;
    if (!CHECK_OK(run_host(runner->reference, &desc, grid, variant, FM_TYPE_U8, runner->solid, &runner->wanted))) {
        describe(&at, -1);
        return;
    }
    test_encode(encoding, grid->shape, runner->solid, runner->encoded);
    fm_context *context = runner->subjects[number % runner->subject_count];
    desc = described(variant, encoding, FM_ALGORITHM_AUTO);
    if (fm_context_backend(context) == FM_BACKEND_CPU) {
        for (int i = 0; i < SETS; i++) {
            if (runner->has_set[i]) {
                setenv("FATHOM_SIMD", sets[i], 1);
                at.how = sets[i];
                run_one(runner, context, &desc, &at);
            }
        }
        unsetenv("FATHOM_SIMD");
    } else {
        at.how = "Vulkan, separable, host arrays";
        run_one(runner, context, &desc, &at);
    }
    const bool on_cpu = fm_context_backend(context) == FM_BACKEND_CPU;
    if (on_cpu || encoding->on_device) {
        at.how = "volumes, separable";
        run_volumes(runner, context, &desc, &at);
    }
    if (!on_cpu && encoding->on_device) {
        desc.algorithm = FM_ALGORITHM_BRUTE_FORCE;
        at.how = "volumes, brute force";
        run_volumes(runner, context, &desc, &at);
    }
}

static bool parse(int count, char **arguments, test_options *options) {
    bool quick = false;
    *options = (test_options){.backend = FM_BACKEND_CPU};
    for (int i = 1; i < count; i++) {
        const char *next = i + 1 < count ? arguments[i + 1] : "";
        if (strcmp(arguments[i], "--quick") == 0) {
            quick = true;
        } else if (strcmp(arguments[i], "--no-validation") == 0) {
            options->no_validation = true;
        } else if (strcmp(arguments[i], "--backend") == 0) {
            options->backend = strcmp(next, "vulkan") == 0 ? FM_BACKEND_VULKAN : FM_BACKEND_CPU;
            i++;
        } else if (strcmp(arguments[i], "--device") == 0) {
            options->device = next;
            i++;
        } else if (strcmp(arguments[i], "--stride") == 0 && atoi(next) > 0) {
            options->stride = (uint32_t)atoi(next);
            i++;
        } else {
            fprintf(stderr, "usage: %s [--backend cpu|vulkan] [--device NAME] [--quick] [--stride N] [--no-validation]\n",
                    arguments[0]);
            return false;
        }
    }
    if (options->stride == 0) {
        const bool on_cpu = options->backend == FM_BACKEND_CPU;
        options->stride = on_cpu ? (quick ? 401 : 67) : (quick ? 29 : 1);
    }
    return true;
}

static void print_log(void *user, fm_log_level level, const char *message) {
    (void)user;
    if (level >= FM_LOG_WARNING) {
        fprintf(stderr, "log: %s\n", message);
    }
}

// Which sets this processor has: the library takes its best one in place of one that is missing, and its context says which.
static void find_sets(test_runner *runner) {
    for (int i = 0; i < SETS; i++) {
        const fm_context_desc desc = {.backend = FM_BACKEND_CPU, .threads = 1};
        fm_context *context = NULL;
        setenv("FATHOM_SIMD", sets[i], 1);
        if (CHECK_OK(fm_context_create(&desc, &context))) {
            fm_device_info info;
            fm_context_device(context, &info);
            const char *set = strrchr(info.driver, ' ');
            runner->has_set[i] = set && strcmp(set + 1, sets[i]) == 0;
        }
        fm_context_destroy(context);
        printf("%s kernels: %s\n", sets[i], runner->has_set[i] ? "tested" : "skipped, this processor has none");
    }
    unsetenv("FATHOM_SIMD");
    CHECK(runner->has_set[0]);
}

static fm_result create_subjects(test_runner *runner, const test_options *options) {
    static const uint32_t threads[] = {1, 2, 5};
    runner->subject_count = options->backend == FM_BACKEND_CPU ? 3 : 1;
    for (uint32_t i = 0; i < runner->subject_count; i++) {
        fm_context_desc desc = {.backend = options->backend, .device = options->device, .threads = threads[i], .log = print_log};
        desc.validation = options->backend == FM_BACKEND_VULKAN && !options->no_validation;
        fm_result result = fm_context_create(&desc, &runner->subjects[i]);
        if (result != FM_OK) {
            return result;
        }
    }
    return FM_OK;
}

static uint32_t run_by_grid(test_runner *runner, const test_variant *variants, uint32_t variant_count, uint32_t stride) {
    uint32_t number = 0;
    for (uint32_t g = 0; g < test_grid_count(); g++) {
        const test_grid grid = test_grid_at(g);
        test_grid_fill(&grid, runner->solid);
        // Brute force takes the square of the size.
        const uint64_t voxels = (uint64_t)grid.shape.x * grid.shape.y * grid.shape.z;
        const uint32_t step = voxels > 600 ? 9 * stride : stride;
        for (uint32_t v = g * 7 % step; v < variant_count; v += step, number++) {
            const test_encoding encoding = test_encoding_at(number % test_encoding_count());
            run_case(runner, &grid, &variants[v], &encoding, number);
        }
    }
    return number;
}

// Whether the kernels of this grid are those of every other such grid: columns of one segment, along both axes.
static bool is_common(const test_grid *grid) {
    return grid->shape.y <= 16 && grid->shape.z <= 16 && grid->shape.z > 1;
}

// The next grid after *at, round and round, that is common or not.
static test_grid next_grid(uint32_t *at, bool common) {
    test_grid grid;
    do {
        // 7 divides neither the number of shapes nor that of patterns: the walk meets every grid.
        *at = (*at + 7) % test_grid_count();
        grid = test_grid_at(*at);
    } while (is_common(&grid) != common);
    return grid;
}

// Every variant needs pipelines of its own, which take most of the time on a software driver: each gets many grids at once, of
// which all but one share the pipelines.
static uint32_t run_by_variant(test_runner *runner, const test_variant *variants, uint32_t variant_count, uint32_t stride) {
    enum { COMMON_GRIDS = 19 };
    uint32_t number = 0, common = 0, rare = 0;
    for (uint32_t v = stride / 2; v < variant_count; v += stride) {
        for (uint32_t i = 0; i <= COMMON_GRIDS; i++, number++) {
            const test_grid grid = i < COMMON_GRIDS ? next_grid(&common, true) : next_grid(&rare, false);
            test_grid_fill(&grid, runner->solid);
            const test_encoding encoding = test_encoding_at(number % test_encoding_count());
            run_case(runner, &grid, &variants[v], &encoding, number);
        }
    }
    return number;
}

static void run_table(test_runner *runner, uint32_t stride) {
    const uint32_t variant_count = test_variant_count();
    test_variant *variants = malloc(variant_count * sizeof *variants);
    if (!CHECK(variants != NULL)) {
        return;
    }
    for (uint32_t i = 0; i < variant_count; i++) {
        variants[i] = test_variant_at(i);
    }
    const bool on_cpu = fm_context_backend(runner->subjects[0]) == FM_BACKEND_CPU;
    const uint32_t number = (on_cpu ? run_by_grid : run_by_variant)(runner, variants, variant_count, stride);
    printf("%u cases of %u grids and %u variants\n", number, test_grid_count(), variant_count);
    free(variants);
}

int main(int count, char **arguments) {
    static test_runner runner;
    test_options options;
    if (!parse(count, arguments, &options)) {
        return 2;
    }
    fm_result result = create_subjects(&runner, &options);
    if (result == FM_ERROR_NO_DEVICE || result == FM_ERROR_UNSUPPORTED) {
        return vulkan_missing();
    }
    const fm_context_desc host = {.backend = FM_BACKEND_CPU};
    if (CHECK_OK(result) && CHECK_OK(fm_context_create(&host, &runner.reference))) {
        if (options.backend == FM_BACKEND_CPU) {
            find_sets(&runner);
        }
        run_table(&runner, options.stride);
    }
    for (uint32_t i = 0; i < runner.subject_count; i++) {
        CHECK(!runner.subjects[i] || fm_context_validation_messages(runner.subjects[i]) == 0);
        fm_context_destroy(runner.subjects[i]);
    }
    fm_context_destroy(runner.reference);
    return check_summary();
}
