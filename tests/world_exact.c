// SPDX-License-Identifier: MIT
// Random edit scripts: after every update the voxels, colours and distances of an exact world equal those of a model that is
// computed anew. Small worlds of odd shapes by default; --size N or --shape X,Y,Z is one world, and --compare-every K looks at it
// less often: 256^3 on a GPU, or thousands of steps.

#include "vulkan_common.h"
#include "world_common.h"

#include <inttypes.h>

typedef struct script_options {
    fm_backend backend;
    const char *device;
    bool validation;
    fm_shape shape;          // x = 0: the table of shapes
    uint32_t steps;          // of each world
    uint32_t compare_every;  // so many steps, at most
    uint32_t stride;         // every how manieth shape of the table: a software driver takes long over each shape's kernels
    uint64_t seed;
} script_options;

static bool parse(int count, char **arguments, script_options *options) {
    *options =
        (script_options){.backend = FM_BACKEND_CPU, .validation = true, .steps = 60, .compare_every = 1, .stride = 1, .seed = 1};
    bool good = true;
    for (int i = 1; good && i < count; i++) {
        bool more = i + 1 < count;
        if (strcmp(arguments[i], "--backend") == 0 && more) {
            options->backend = strcmp(arguments[++i], "vulkan") == 0 ? FM_BACKEND_VULKAN : FM_BACKEND_CPU;
        } else if (strcmp(arguments[i], "--device") == 0 && more) {
            options->device = arguments[++i];
        } else if (strcmp(arguments[i], "--no-validation") == 0) {
            options->validation = false;
        } else if (strcmp(arguments[i], "--size") == 0 && more) {
            const uint32_t size = (uint32_t)strtoul(arguments[++i], NULL, 10);
            options->shape = (fm_shape){size, size, size};
        } else if (strcmp(arguments[i], "--shape") == 0 && more) {
            fm_shape *shape = &options->shape;
            good = sscanf(arguments[++i], "%" SCNu32 ",%" SCNu32 ",%" SCNu32, &shape->x, &shape->y, &shape->z) == 3;
        } else if (strcmp(arguments[i], "--steps") == 0 && more) {
            options->steps = (uint32_t)strtoul(arguments[++i], NULL, 10);
        } else if (strcmp(arguments[i], "--compare-every") == 0 && more) {
            options->compare_every = (uint32_t)strtoul(arguments[++i], NULL, 10);
            good = options->compare_every > 0;
        } else if (strcmp(arguments[i], "--stride") == 0 && more) {
            options->stride = (uint32_t)strtoul(arguments[++i], NULL, 10);
        } else if (strcmp(arguments[i], "--seed") == 0 && more) {
            options->seed = strtoull(arguments[++i], NULL, 10);
        } else {
            good = false;
        }
    }
    if (!good) {
        fprintf(stderr,
                "usage: %s [--backend cpu|vulkan] [--device NAME] [--no-validation] [--size N | --shape X,Y,Z] [--steps N] "
                "[--compare-every K] [--stride N] [--seed S]\n",
                arguments[0]);
    }
    return good;
}

// Writes a random box of voxels at once, as a program that streams terrain does.
static void write_box(world_pair *pair, uint64_t *state) {
    const fm_shape shape = pair->desc.shape;
    const int32_t size[3] = {(int32_t)shape.x, (int32_t)shape.y, (int32_t)shape.z};
    fm_box box;
    uint64_t voxels = 1;
    for (int i = 0; i < 3; i++) {
        box.begin[i] = test_between(state, 0, size[i] - 1);
        box.end[i] =
            test_between(state, (int32_t)box.begin[i] + 1, size[i] < box.begin[i] + 12 ? size[i] : (int32_t)box.begin[i] + 12);
        voxels *= (uint64_t)(box.end[i] - box.begin[i]);
    }
    uint32_t *values = malloc(voxels * sizeof *values);
    uint64_t n = 0;
    for (int64_t z = box.begin[2]; z < box.end[2]; z++) {
        for (int64_t y = box.begin[1]; y < box.end[1]; y++) {
            for (int64_t x = box.begin[0]; x < box.end[0]; x++) {
                uint32_t value = test_between(state, 0, 9) == 0 ? (uint32_t)test_random(state) : 0;
                values[n++] = value;
                pair->voxels[(uint64_t)x + shape.x * ((uint64_t)y + shape.y * (uint64_t)z)] = value;
            }
        }
    }
    CHECK_OK(fm_world_write(pair->world, &box, values));
    free(values);
}

// Changes a few voxels where they lie.
static void write_mapped(world_pair *pair, uint64_t *state) {
    const fm_shape shape = pair->desc.shape;
    uint32_t *voxels = fm_world_map(pair->world);
    CHECK_OK(fm_world_update(pair->world, NULL));
    for (int i = 0; voxels && i < 5; i++) {
        int64_t x = test_between(state, 0, (int32_t)shape.x - 1);
        int64_t y = test_between(state, 0, (int32_t)shape.y - 1);
        int64_t z = test_between(state, 0, (int32_t)shape.z - 1);
        uint64_t element = (uint64_t)x + shape.x * ((uint64_t)y + shape.y * (uint64_t)z);
        voxels[element] = pair->voxels[element] = test_between(state, 0, 2) ? 0 : 200;
        const fm_box box = {{x, y, z}, {x + 1, y + 1, z + 1}};
        fm_world_mark(pair->world, &box);
    }
}

static bool run_script(fm_context *context, fm_context *reference, const fm_world_desc *desc, const script_options *options,
                       uint64_t seed) {
    world_pair pair;
    uint64_t state = seed;
    bool good = world_pair_make(&pair, context, reference, desc);
    uint32_t longest = desc->shape.x > desc->shape.y ? desc->shape.x : desc->shape.y;
    longest = desc->shape.z > longest ? desc->shape.z : longest;
    uint32_t radius = longest / 4 < 16 ? longest / 4 : 16;
    for (uint32_t step = 0; good && step < options->steps; step++) {
        int32_t kind = test_between(&state, 0, 19);
        if (kind == 0) {
            write_box(&pair, &state);
        }
        fm_brush brushes[8];
        uint32_t count = (uint32_t)(kind == 1 ? 8 : kind == 2 ? 0 : test_between(&state, 1, 3));
        for (uint32_t i = 0; i < count; i++) {
            brushes[i] = world_random_brush(&state, desc->shape, kind == 3 ? longest : radius);
            // Some edits are taken back before the update.
            if (i > 0 && test_between(&state, 0, 3) == 0) {
                brushes[i] = brushes[i - 1];
                brushes[i].voxel = brushes[i].voxel ? 0 : 7;
            }
        }
        // Now and then the world is emptied or filled, so that both ends are seen.
        if (kind == 4 && count > 0) {
            brushes[0] = (fm_brush){.radius = 1u << 31, .voxel = test_between(&state, 0, 3) == 0 ? 7 : 0};
        }
        world_both_edit(&pair, brushes, count);
        if (kind == 5) {
            const fm_box all = {{-5, -5, -5}, {1 << 20, 1 << 20, 1 << 20}};
            fm_world_mark(pair.world, &all);
        } else if (kind == 6) {
            CHECK_OK(fm_world_set_method(pair.world, &desc->method));
        } else if (kind == 7) {
            write_mapped(&pair, &state);
        }
        // Several updates may be in flight before one is looked at.
        fm_ticket ticket;
        good = CHECK_OK(fm_world_update(pair.world, &ticket));
        const bool looks = test_between(&state, 0, 2) != 0 && step % options->compare_every == 0;
        good = good && (!looks || world_compare(&pair));
    }
    good = good && world_compare(&pair);
    if (!good) {
        fprintf(stderr, "    shape %ux%ux%u, format %d, cap %u, seed %llu\n", desc->shape.x, desc->shape.y, desc->shape.z,
                (int)desc->format, desc->max_distance, (unsigned long long)seed);
    }
    world_pair_free(&pair);
    return good;
}

static const fm_shape shapes[] = {{8, 8, 8},    {16, 16, 16}, {1, 1, 1},   {33, 17, 9},   {100, 5, 3}, {3, 70, 2},
                                  {2, 3, 90},   {64, 64, 64}, {65, 31, 7}, {1, 40, 40},   {40, 1, 40}, {300, 20, 4},
                                  {4, 300, 10}, {10, 4, 300}, {32, 8, 8},  {127, 63, 33}, {5, 3, 400}};

static void run_all(fm_context *context, fm_context *reference, const script_options *options) {
    const fm_shape *table = options->shape.x ? &options->shape : shapes;
    const uint32_t count = options->shape.x ? 1 : sizeof shapes / sizeof shapes[0];
    for (uint32_t i = 0; i < count; i += options->stride) {
        for (int format = FM_FIELD_PACKED; format <= FM_FIELD_SQUARED_U32; format++) {
            fm_world_desc desc = {.shape = table[i], .format = (fm_field_format)format};
            run_script(context, reference, &desc, options, options->seed + i);
            if (format == FM_FIELD_SQUARED_U32) {
                desc.max_distance = 10;
                run_script(context, reference, &desc, options, options->seed + i);
            }
        }
    }
}

int main(int count, char **arguments) {
    script_options options;
    if (!parse(count, arguments, &options)) {
        return 2;
    }
    const fm_context_desc desc = {.backend = options.backend,
                                  .device = options.device,
                                  .threads = options.backend == FM_BACKEND_CPU ? 2 : 1,
                                  .validation = options.validation,
                                  .log = vulkan_log};
    const fm_context_desc reference_desc = {.backend = FM_BACKEND_CPU};
    fm_context *context, *reference;
    if (fm_context_create(&desc, &context) != FM_OK) {
        return vulkan_missing();
    }
    if (CHECK_OK(fm_context_create(&reference_desc, &reference))) {
        run_all(context, reference, &options);
        fm_context_destroy(reference);
    }
    vulkan_close(context);
    return check_summary();
}
