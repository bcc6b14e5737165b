// SPDX-License-Identifier: MIT
// Which chunks an update computes anew, what its passes are called, and what the field holds before the first one.

#include "vulkan_common.h"
#include "world/chunks.h"
#include "world_common.h"

static fm_world *make(fm_context *context, fm_shape shape, fm_field_format format, fm_world_method method) {
    const fm_world_desc desc = {.shape = shape, .format = format, .method = method};
    fm_world *world = NULL;
    CHECK_OK(fm_world_create(context, &desc, &world));
    return world;
}

// Chunks of a world, and for each which algorithm a plan should give it; 0: none.
typedef struct chunk_map {
    uint32_t chunks[3];
    uint32_t count;
    uint8_t *wanted;
    bool (*near)[2];  // the focus, before and now
} chunk_map;

static bool is_near(const fm_world_method *method, const int64_t chunk[3]) {
    bool near = true;
    for (int i = 0; i < 3; i++) {
        int64_t edge = method->chunk,
                center = method->focus[i] >= 0 ? method->focus[i] / edge : -((-method->focus[i] + edge - 1) / edge);
        int64_t first = center - method->focus_chunks / 2;
        near = near && chunk[i] >= first && chunk[i] < first + method->focus_chunks;
    }
    return near;
}

// Whether an edit in a box can be felt in a chunk: it is no farther away, along any axis.
static bool is_felt(const fm_world_desc *desc, const int64_t chunk[3], const fm_box *box) {
    const uint32_t shape[3] = {desc->shape.x, desc->shape.y, desc->shape.z};
    int64_t reach = desc->method.border == FM_BORDER_HALO       ? desc->method.chunk
                    : desc->method.border == FM_BORDER_EXCHANGE ? (desc->format == FM_FIELD_SPLIT_U16 ? 65534 : 254)
                                                                : 0;
    for (int i = 0; i < 3; i++) {
        int64_t begin = chunk[i] * desc->method.chunk, end = begin + desc->method.chunk;
        int64_t low = box->begin[i] < 0 ? 0 : box->begin[i], high = box->end[i] > shape[i] ? shape[i] : box->end[i];
        if (low >= high || begin >= high + reach || end <= low - reach) {
            return false;
        }
    }
    return true;
}

static void fill_map(chunk_map *map, const fm_world *world, const fm_box *boxes, uint32_t count, bool first) {
    const fm_world_method *method = &world->desc.method;
    const bool selective = method->algorithm == FM_WORLD_SELECTIVE;
    for (uint32_t i = 0; i < map->count; i++) {
        const int64_t at[3] = {i % map->chunks[0], i / map->chunks[0] % map->chunks[1], i / map->chunks[0] / map->chunks[1]};
        map->near[i][0] = map->near[i][1];
        map->near[i][1] = selective && is_near(method, at);
        bool dirty = selective && (first || map->near[i][0] != map->near[i][1]);
        for (uint32_t k = 0; k < count && !dirty; k++) {
            dirty = is_felt(&world->desc, at, &boxes[k]);
        }
        fm_world_algorithm algorithm = !selective        ? method->algorithm
                                       : map->near[i][1] ? method->near_algorithm
                                                         : method->far_algorithm;
        map->wanted[i] = dirty ? (uint8_t)algorithm : 0;
    }
}

static bool same_chunks(const chunk_map *map, uint32_t chunk, const fm_world_job *job) {
    uint32_t wanted = 0;
    for (uint32_t i = 0; i < map->count; i++) {
        wanted += map->wanted[i] != 0;
    }
    bool same = wanted == job->domain_count;
    for (uint32_t i = 0; i < job->domain_count; i++) {
        const uint32_t *begin = job->domains[i].result_begin;
        uint32_t at = (begin[2] / chunk * map->chunks[1] + begin[1] / chunk) * map->chunks[0] + begin[0] / chunk;
        same = same && map->wanted[at] == job->domains[i].algorithm;
        map->wanted[at] = 0;
    }
    return same;
}

static fm_box random_box(uint64_t *seed, fm_shape shape) {
    const int32_t size[3] = {(int32_t)shape.x, (int32_t)shape.y, (int32_t)shape.z};
    fm_box box;
    for (int i = 0; i < 3; i++) {
        box.begin[i] = test_between(seed, -5, size[i] + 5);
        box.end[i] = box.begin[i] + test_between(seed, 0, 9);
    }
    return box;
}

static void check_plans(fm_context *cpu, fm_shape shape, fm_field_format format, fm_world_method method, uint64_t *seed) {
    enum { MOST = 300 };
    static const uint32_t counts[] = {0, 1, 2, MOST, 3, MOST, 0, 20};
    const uint32_t axes[3] = {shape.x, shape.y, shape.z};
    fm_world *world = make(cpu, shape, format, method);
    chunk_map map = {.count = 1};
    for (int i = 0; i < 3; i++) {
        map.chunks[i] = (axes[i] + method.chunk - 1) / method.chunk;
        map.count *= map.chunks[i];
    }
    map.wanted = calloc(map.count, 1);
    map.near = calloc(map.count, sizeof *map.near);
    for (uint32_t i = 0; world && CHECK(map.wanted && map.near) && i < sizeof counts / sizeof counts[0]; i++) {
        fm_box boxes[MOST];
        for (uint32_t k = 0; k < counts[i]; k++) {
            boxes[k] = random_box(seed, shape);
        }
        const int32_t focus[3] = {test_between(seed, -30, 90), test_between(seed, 0, 60), test_between(seed, 0, 40)};
        fm_world_set_focus(world, focus);
        fm_world_job job = {0};
        fill_map(&map, world, boxes, counts[i], i == 0);
        if (CHECK_OK(fm_chunks_plan(world, counts[i] ? boxes : NULL, counts[i], &job)) &&
            !CHECK(same_chunks(&map, method.chunk, &job))) {
            fprintf(stderr, "    %u x %u x %u, chunk %u, border %d, algorithm %d: plan %u, of %u boxes, has %u chunks\n", shape.x,
                    shape.y, shape.z, method.chunk, method.border, method.algorithm, i, counts[i], job.domain_count);
        }
        fm_chunks_done(world);
    }
    free(map.wanted);
    free(map.near);
    fm_world_destroy(world);
}

static void test_plans(fm_context *cpu) {
    static const fm_shape shapes[] = {{100, 70, 50}, {700, 9, 33}, {8, 8, 8}};
    uint64_t seed = 11;
    for (uint32_t i = 0; i < 3 * 3 * 2; i++) {
        const fm_world_border border = (fm_world_border)(i % 3);
        const fm_world_method method = {.algorithm = FM_WORLD_FIM, .chunk = i / 9 ? 16 : 8, .border = border};
        check_plans(cpu, shapes[i / 3 % 3], i & 1 ? FM_FIELD_SPLIT_U16 : FM_FIELD_PACKED, method, &seed);
        const fm_world_method selective = {.algorithm = FM_WORLD_SELECTIVE,
                                           .chunk = method.chunk,
                                           .border = i % 2 ? FM_BORDER_HALO : FM_BORDER_PADDING,
                                           .focus_chunks = 1 + i % 4};
        check_plans(cpu, shapes[i / 3 % 3], FM_FIELD_PACKED, selective, &seed);
    }
}

// Edits far from each other, and a focus that moves where nothing else happens, leave what is between them alone.
static void test_apart(fm_context *context) {
    const fm_world_method methods[] = {{.algorithm = FM_WORLD_FIM, .chunk = 8},
                                       {.algorithm = FM_WORLD_SELECTIVE, .chunk = 8, .focus_chunks = 1}};
    for (int i = 0; i < 2; i++) {
        fm_world *world = make(context, (fm_shape){80, 80, 80}, FM_FIELD_PACKED, methods[i]);
        const fm_brush far[] = {{.voxel = 1, .from = {1, 1, 1}}, {.voxel = 1, .from = {78, 78, 78}}};
        const int32_t focus[3] = {70, 3, 3};
        fm_world_stats stats = {0};
        CHECK_OK(fm_world_update(world, NULL));
        CHECK_OK(fm_world_stats_get(world, &stats));
        CHECK(stats.full && stats.chunks == 1000);
        if (i == 1) {
            fm_world_set_focus(world, focus);
            CHECK_OK(fm_world_update(world, NULL));
            CHECK_OK(fm_world_stats_get(world, &stats));
            CHECK(!stats.full && stats.chunks == 2);
        }
        CHECK_OK(fm_world_edit(world, far, 2));
        CHECK_OK(fm_world_update(world, NULL));
        CHECK_OK(fm_world_stats_get(world, &stats));
        CHECK(!stats.full && stats.chunks == 2);
        const fm_box marked[] = {{{0, 70, 0}, {3, 71, 1}}, {{30, 30, 30}, {40, 31, 31}}};
        fm_world_mark(world, &marked[0]);
        fm_world_mark(world, &marked[1]);
        CHECK_OK(fm_world_update(world, NULL));
        CHECK_OK(fm_world_stats_get(world, &stats));
        CHECK(!stats.full && stats.chunks == 3);
        fm_world_destroy(world);
    }
}

enum { MOST_PASSES = 8 };

static uint32_t passes_of(fm_context *context, fm_world_method method, fm_pass passes[MOST_PASSES]) {
    fm_world *world = make(context, (fm_shape){48, 48, 48}, FM_FIELD_PACKED, method);
    uint32_t count = 0;
    CHECK_OK(fm_world_update(world, NULL));
    CHECK_OK(fm_context_passes(context, &count, NULL));
    if (CHECK(count <= MOST_PASSES)) {
        CHECK_OK(fm_context_passes(context, &count, passes));
    }
    fm_world_destroy(world);
    return count;
}

static bool is_called(const fm_pass *pass, const char *name) {
    return strcmp(pass->name, name) == 0;
}

// More batches than passes that can be told apart: none of their work is lost.
static void test_many_batches(fm_context *gpu) {
    static const struct {
        fm_world_method method;
        const char *names[2];  // behind the rows
    } cases[] = {{{.algorithm = FM_WORLD_JFA, .chunk = 8}, {"jfa"}},
                 {{.algorithm = FM_WORLD_JFA_FIM, .chunk = 8, .border = FM_BORDER_EXCHANGE}, {"jfa", "relax"}},
                 {{.algorithm = FM_WORLD_FIM, .chunk = 8, .border = FM_BORDER_HALO}, {"chunks"}}};
    for (uint32_t i = 0; i < sizeof cases / sizeof cases[0]; i++) {
        const uint32_t wanted = cases[i].names[1] ? 3 : 2;
        fm_pass whole[MOST_PASSES] = {0}, parts[MOST_PASSES] = {0};
        uint64_t bytes[2] = {0};
        const uint32_t in_whole = passes_of(gpu, cases[i].method, whole);
        setenv("FATHOM_SCRATCH", "1", 1);
        const uint32_t in_parts = passes_of(gpu, cases[i].method, parts);
        unsetenv("FATHOM_SCRATCH");
        if (CHECK(in_parts == wanted) && CHECK(is_called(&parts[0], "rows"))) {
            for (uint32_t k = 1; k < wanted; k++) {
                CHECK(is_called(&parts[k], cases[i].names[k - 1]));
            }
        }
        for (uint32_t k = 1; k < MOST_PASSES; k++) {
            bytes[0] += k < in_whole ? whole[k].bytes : 0;
            bytes[1] += k < in_parts ? parts[k].bytes : 0;
        }
        CHECK(bytes[0] > 0 && bytes[1] == bytes[0]);
    }
}

static void test_host_passes(fm_context *cpu) {
    fm_pass passes[MOST_PASSES] = {0};
    const fm_world_method chunked = {.algorithm = FM_WORLD_FIM, .chunk = 16};
    CHECK(passes_of(cpu, chunked, passes) == 2 && is_called(&passes[0], "rows") && is_called(&passes[1], "chunks"));
    CHECK(passes[1].bytes > 0);
    const fm_world_method linked = {.algorithm = FM_WORLD_FIM, .chunk = 16, .border = FM_BORDER_EXCHANGE};
    CHECK(passes_of(cpu, linked, passes) == 3 && is_called(&passes[1], "chunks") && is_called(&passes[2], "exchange"));
}

// Before the first update all is air, as far from a solid voxel as can be told.
static void test_fresh(fm_context *context) {
    static const uint32_t farthest[] = {
        [FM_FIELD_PACKED] = 255, [FM_FIELD_SPLIT_U8] = 255, [FM_FIELD_SPLIT_U16] = 65535, [FM_FIELD_SQUARED_U32] = UINT32_MAX};
    const fm_shape shape = {37, 5, 3};
    enum { VOXELS = 37 * 5 * 3 };
    for (int format = 0; format <= FM_FIELD_SQUARED_U32 + 1; format++) {
        const bool capped = format > FM_FIELD_SQUARED_U32;
        const fm_world_desc desc = {
            .shape = shape, .format = capped ? FM_FIELD_SQUARED_U32 : (fm_field_format)format, .max_distance = capped ? 9 : 0};
        const uint32_t wanted = capped ? 81 : farthest[format];
        fm_world *world = NULL;
        uint32_t distances[VOXELS] = {0};
        uint8_t colors[VOXELS];
        memset(colors, 1, sizeof colors);
        const fm_array distance = {distances, FM_TYPE_U32, shape}, color = {colors, FM_TYPE_U8, shape};
        for (int updated = 0; updated < 2; updated++) {
            if (!updated ? CHECK_OK(fm_world_create(context, &desc, &world)) : CHECK_OK(fm_world_update(world, NULL))) {
                uint32_t wrong = 0;
                CHECK_OK(fm_world_read_field(world, NULL, &distance, &color));
                for (uint32_t i = 0; i < VOXELS; i++) {
                    wrong += distances[i] != wanted || colors[i] != 0;
                }
                CHECK(wrong == 0);
            }
        }
        fm_world_destroy(world);
    }
}

int main(int count, char **arguments) {
    vulkan_options options;
    if (!vulkan_parse(count, arguments, &options)) {
        return 2;
    }
    const fm_context_desc desc = {.backend = FM_BACKEND_CPU, .threads = 2};
    fm_context *context = NULL;
    fm_result result = count > 1 ? vulkan_open(&options, NULL, &context) : fm_context_create(&desc, &context);
    if (count > 1 && result == FM_ERROR_NO_DEVICE) {
        return vulkan_missing();
    }
    if (!CHECK_OK(result)) {
        return check_summary();
    }
    if (count > 1) {
        test_many_batches(context);
    } else {
        test_plans(context);
        test_host_passes(context);
    }
    test_apart(context);
    test_fresh(context);
    vulkan_close(context);
    return check_summary();
}
