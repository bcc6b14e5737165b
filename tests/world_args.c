// SPDX-License-Identifier: MIT
// Bad input to worlds: every refusal is a result with a message, and leaves the world as it was. Edits outside of the world, of
// zero and of huge radius, updates without waiting, memory that ends at every possible place, and (with --backend vulkan) a lost
// device.

#include "vulkan_common.h"
#include "world_common.h"

#ifdef WORLD_INTERNALS
#include "gpu/vk.h"
#include "volume/context.h"
#endif

#include <limits.h>

static void refuse_desc(fm_context *context, fm_world_desc desc, fm_result wanted, const char *word) {
    fm_world *world = NULL;
    CHECK_FAILS(fm_world_create(context, &desc, &world), wanted);
    CHECK(world == NULL);
    if (!CHECK(strstr(fm_last_error(), word) != NULL)) {
        fprintf(stderr, "    \"%s\" lacks \"%s\"\n", fm_last_error(), word);
    }
}

static fm_world_desc with_method(fm_world_method method) {
    return (fm_world_desc){.shape = {8, 8, 8}, .method = method};
}

static void test_descs(fm_context *context) {
    fm_world *world = NULL;
    const fm_world_desc fine = {.shape = {8, 8, 8}};
    CHECK_FAILS(fm_world_create(NULL, &fine, &world), FM_ERROR_INVALID_ARGUMENT);
    CHECK_FAILS(fm_world_create(context, NULL, &world), FM_ERROR_INVALID_ARGUMENT);
    CHECK_FAILS(fm_world_create(context, &fine, NULL), FM_ERROR_INVALID_ARGUMENT);
    const fm_result bad = FM_ERROR_INVALID_ARGUMENT;
    refuse_desc(context, (fm_world_desc){.shape = {0, 8, 8}}, bad, "shape is 0 x 8 x 8");
    refuse_desc(context, (fm_world_desc){.shape = {8, 16385, 8}}, bad, "16384");
    refuse_desc(context, (fm_world_desc){.shape = {8, 8, 8}, .format = (fm_field_format)9}, bad, "format is 9");
    refuse_desc(context, (fm_world_desc){.shape = {8, 8, 8}, .max_distance = 5}, bad, "max_distance is 5");
    refuse_desc(context, (fm_world_desc){.shape = {8, 8, 8}, .format = FM_FIELD_SQUARED_U32, .max_distance = 70000}, bad, "65535");
    refuse_desc(context, (fm_world_desc){.shape = {8, 8, 8}, .format = FM_FIELD_SQUARED_U32, .method.algorithm = FM_WORLD_FIM},
                FM_ERROR_UNSUPPORTED, "FM_WORLD_FIM");
    refuse_desc(context, with_method((fm_world_method){.algorithm = (fm_world_algorithm)77}), bad, "algorithm is 77");
    refuse_desc(context, with_method((fm_world_method){.border = (fm_world_border)3}), bad, "border is 3");
    refuse_desc(context, with_method((fm_world_method){.convergence = (fm_world_convergence)-1}), bad, "convergence");
    refuse_desc(context, with_method((fm_world_method){.chunk = 16}), bad, "FM_WORLD_EXACT");
    static const uint32_t chunks[] = {1, 4, 7, 24, 512, 1u << 31};
    for (size_t i = 0; i < sizeof chunks / sizeof chunks[0]; i++) {
        refuse_desc(context, with_method((fm_world_method){.algorithm = FM_WORLD_FIM, .chunk = chunks[i]}), bad,
                    "256 are accepted");
    }
    refuse_desc(context, with_method((fm_world_method){.algorithm = FM_WORLD_JFA, .chunk = 8, .border = FM_BORDER_EXCHANGE}), bad,
                "FM_BORDER_EXCHANGE");
    refuse_desc(context, with_method((fm_world_method){.algorithm = FM_WORLD_SELECTIVE}), bad, "chooses by chunk");
    refuse_desc(context,
                with_method((fm_world_method){.algorithm = FM_WORLD_SELECTIVE, .chunk = 8, .near_algorithm = FM_WORLD_JFA}), bad,
                "near_algorithm is");
    refuse_desc(context, with_method((fm_world_method){.algorithm = FM_WORLD_SELECTIVE, .chunk = 8, .far_algorithm = FM_WORLD_FIM}),
                bad, "far_algorithm is");
    fm_world_desc long_sites = with_method((fm_world_method){.algorithm = FM_WORLD_JFA});
    long_sites.shape.x = 1025;
    refuse_desc(context, long_sites, FM_ERROR_UNSUPPORTED, "1024");
    if (fm_context_backend(context) == FM_BACKEND_CPU) {
        refuse_desc(context, (fm_world_desc){.shape = {8, 8, 8}, .exportable = true}, FM_ERROR_UNSUPPORTED, "exportable");
    }
}

// More memory than any machine has: refused with what is needed and what there is, and nothing is left behind.
static void test_too_large(fm_context *context) {
    fm_world *world = NULL;
    const fm_world_desc desc = {.shape = {16384, 16384, 16384}};
    fm_result result = fm_world_create(context, &desc, &world);
    CHECK(result == FM_ERROR_OUT_OF_DEVICE_MEMORY || result == FM_ERROR_OUT_OF_HOST_MEMORY || result == FM_ERROR_UNSUPPORTED);
    CHECK(world == NULL);
    if (result == FM_ERROR_OUT_OF_DEVICE_MEMORY) {
        CHECK(strstr(fm_last_error(), "needs about") != NULL && strstr(fm_last_error(), "has ") != NULL);
    }
}

static void test_brushes(world_pair *pair) {
    const int32_t far = 1 << 30;
    const fm_brush bad[] = {
        {.kind = (fm_brush_kind)3},
        {.from = {far + 1, 0, 0}},
        {.from = {0, INT32_MIN, 0}},
        {.kind = FM_BRUSH_BOX, .to = {0, 0, INT32_MAX}},
        {.kind = FM_BRUSH_LINE, .to = {0, 0, 9000}},
        {.kind = FM_BRUSH_LINE, .from = {-8193, 0, 0}},
    };
    for (size_t i = 0; i < sizeof bad / sizeof bad[0]; i++) {
        const fm_brush pair_of[] = {{.voxel = 3, .from = {1, 1, 1}}, bad[i]};
        CHECK_FAILS(fm_world_edit(pair->world, pair_of, 2), FM_ERROR_INVALID_ARGUMENT);
        CHECK(strstr(fm_last_error(), "brush 1") != NULL);
    }
    CHECK_FAILS(fm_world_edit(NULL, bad, 1), FM_ERROR_INVALID_ARGUMENT);
    CHECK_FAILS(fm_world_edit(pair->world, NULL, 1), FM_ERROR_INVALID_ARGUMENT);
    CHECK_OK(fm_world_edit(pair->world, NULL, 0));
    CHECK_OK(fm_world_update(pair->world, NULL));
    // None of a refused call's brushes was queued.
    world_compare(pair);

    const fm_brush odd[] = {
        {.voxel = 1, .from = {far, far, far}},                                                 // far outside
        {.voxel = 2, .from = {-far, 5, 5}, .radius = (uint32_t)far + 6},                       // a ball whose rim ends at x = 6
        {.voxel = 0, .from = {2, 2, 2}},                                                       // one voxel
        {.kind = FM_BRUSH_BOX, .voxel = 4, .from = {9, far, -far}, .to = {7, -far, far}},      // a wall from corner to corner
        {.kind = FM_BRUSH_LINE, .voxel = 5, .from = {-8000, 3, 3}, .to = {8000, 3, 3}},        // a line through the world
        {.kind = FM_BRUSH_LINE, .voxel = 6, .from = {4, 4, 4}, .to = {4, 4, 4}, .radius = 2},  // no length
        {.voxel = 0, .from = {0, 0, 0}, .radius = UINT32_MAX},                                 // everything
        {.voxel = 8, .from = {5, 5, 5}, .radius = 1},
    };
    for (size_t i = 0; i < sizeof odd / sizeof odd[0]; i++) {
        world_both_edit(pair, &odd[i], 1);
        CHECK_OK(fm_world_update(pair->world, NULL));
        world_compare(pair);
    }
    world_both_edit(pair, odd, sizeof odd / sizeof odd[0]);
    CHECK_OK(fm_world_update(pair->world, NULL));
    world_compare(pair);
}

static void test_boxes(world_pair *pair) {
    uint32_t voxel = 1;
    const fm_box bad[] = {{{0, 0, 0}, {0, 1, 1}}, {{-1, 0, 0}, {1, 1, 1}}, {{0, 0, 0}, {1, 1, 1000}}, {{3, 3, 3}, {2, 4, 4}}};
    for (size_t i = 0; i < sizeof bad / sizeof bad[0]; i++) {
        CHECK_FAILS(fm_world_write(pair->world, &bad[i], &voxel), FM_ERROR_INVALID_ARGUMENT);
        CHECK_FAILS(fm_world_read(pair->world, &bad[i], &voxel), FM_ERROR_INVALID_ARGUMENT);
    }
    const fm_box outside = {{INT64_MIN, 0, 0}, {-1, 5, 5}};
    fm_world_mark(pair->world, &outside);
    const fm_box reversed = {{5, 5, 5}, {1, 1, 1}};
    fm_world_mark(pair->world, &reversed);
    const fm_box vast = {{INT64_MIN, INT64_MIN, INT64_MIN}, {INT64_MAX, INT64_MAX, INT64_MAX}};
    for (int i = 0; i < 100; i++) {
        fm_world_mark(pair->world, &vast);
    }
    CHECK_OK(fm_world_update(pair->world, NULL));
    world_compare(pair);
}

// Updates one after the other without a wait, their tickets rising, and nothing to do in some.
static void test_in_flight(world_pair *pair) {
    uint64_t state = 3;
    fm_ticket before = 0;
    for (int i = 0; i < 24; i++) {
        const fm_brush brush = world_random_brush(&state, pair->desc.shape, 4);
        world_both_edit(pair, &brush, 1);
        fm_ticket ticket, again;
        CHECK_OK(fm_world_update(pair->world, &ticket));
        CHECK(ticket >= before);
        CHECK_OK(fm_world_update(pair->world, &again));
        CHECK(again == ticket);
        before = ticket;
    }
    world_compare(pair);
}

// More edits than the memory for one update takes at a time, and a voxel that an early one makes and a late one takes away.
static void test_many(fm_context *context, fm_context *reference) {
    enum { COUNT = 700 };
    world_pair pair;
    const fm_world_desc desc = {.shape = {3, 260, 400}};
    static fm_brush brushes[COUNT];
    if (world_pair_make(&pair, context, reference, &desc)) {
        CHECK_OK(fm_world_update(pair.world, NULL));
        for (int i = 0; i < COUNT; i++) {
            brushes[i] = (fm_brush){.voxel = (uint32_t)i % 3, .from = {i % 3, 130, 200}, .radius = 150 - (uint32_t)i % 150};
        }
        brushes[COUNT - 1] = (fm_brush){.from = {1, 130, 200}, .radius = 240};
        CHECK_OK(fm_world_edit(pair.world, brushes, COUNT));
        // The last one takes all away again, so that the model has nothing to do.
        CHECK_OK(fm_world_update(pair.world, NULL));
        world_compare(&pair);
    }
    world_pair_free(&pair);
}

// Before the first update all is air, as far as can be.
static void test_untouched(fm_context *context, fm_context *reference) {
    for (int format = FM_FIELD_PACKED; format <= FM_FIELD_SQUARED_U32; format++) {
        world_pair pair;
        const fm_world_desc desc = {.shape = {5, 6, 7}, .format = (fm_field_format)format};
        if (world_pair_make(&pair, context, reference, &desc)) {
            world_compare(&pair);
        }
        world_pair_free(&pair);
    }
}

// Caps near 2^16, whose squares leave no room above them.
static void test_caps(fm_context *context, fm_context *reference) {
    static const uint32_t caps[] = {1, 7, 65000, 65534, 65535};
    for (size_t i = 0; i < sizeof caps / sizeof caps[0]; i++) {
        world_pair pair;
        const fm_world_desc desc = {.shape = {3, 2, 700}, .format = FM_FIELD_SQUARED_U32, .max_distance = caps[i]};
        const fm_brush brush = {.voxel = 1, .from = {1, 1, 690}};
        if (world_pair_make(&pair, context, reference, &desc)) {
            CHECK_OK(fm_world_update(pair.world, NULL));
            world_compare(&pair);
            world_both_edit(&pair, &brush, 1);
            CHECK_OK(fm_world_update(pair.world, NULL));
            world_compare(&pair);
        }
        world_pair_free(&pair);
    }
}

static void test_set_method(world_pair *pair) {
    const fm_world_method bad = {.algorithm = FM_WORLD_FIM, .chunk = 5};
    CHECK_FAILS(fm_world_set_method(pair->world, &bad), FM_ERROR_INVALID_ARGUMENT);
    fm_world_desc desc;
    fm_world_info(pair->world, &desc);
    CHECK(desc.method.algorithm == FM_WORLD_EXACT && desc.method.chunk == 0);
    const fm_world_method exchange = {.algorithm = FM_WORLD_FIM, .chunk = 8, .border = FM_BORDER_EXCHANGE};
    const fm_world_method exact = {0};
    for (int i = 0; i < 3; i++) {
        CHECK_OK(fm_world_set_method(pair->world, &exchange));
        CHECK_OK(fm_world_update(pair->world, NULL));
        world_compare(pair);
        const fm_brush brush = {.voxel = (uint32_t)i % 2, .from = {6, 3 * i, 5}, .radius = 3};
        world_both_edit(pair, &brush, 1);
        CHECK_OK(fm_world_update(pair->world, NULL));
        world_compare(pair);
        CHECK_OK(fm_world_set_method(pair->world, &exact));
        CHECK_OK(fm_world_update(pair->world, NULL));
        world_compare(pair);
    }
}

// Counts what is held and fails from call number `fail_at` on.
typedef struct counted {
    long long bytes;
    unsigned long calls, fail_at;
} counted;

static void *counted_alloc(void *user, size_t size, size_t alignment) {
    counted *counts = user;
    if (counts->calls++ >= counts->fail_at) {
        return NULL;
    }
    counts->bytes += (long long)size;
    return aligned_alloc(alignment, (size + alignment - 1) / alignment * alignment);
}

static void counted_free(void *user, void *memory, size_t size) {
    counted *counts = user;
    counts->bytes -= (long long)size;
    free(memory);
}

static fm_result use_world(fm_context *context) {
    fm_world *world = NULL;
    const fm_world_desc desc = {.shape = {20, 9, 12}};
    const fm_world_method method = {.algorithm = FM_WORLD_JFA_FIM, .chunk = 8, .border = FM_BORDER_HALO};
    const fm_brush brush = {.voxel = 9, .from = {4, 4, 4}, .radius = 2};
    fm_result result = fm_world_create(context, &desc, &world);
    if (result == FM_OK) {
        result = fm_world_edit(world, &brush, 1);
    }
    if (result == FM_OK) {
        result = fm_world_update(world, NULL);
    }
    if (result == FM_OK) {
        result = fm_world_set_method(world, &method);
    }
    if (result == FM_OK) {
        result = fm_world_update(world, NULL);
    }
    fm_world_destroy(world);
    return result;
}

static void test_memory_ends(const fm_context_desc *like) {
    counted counts = {.fail_at = ULONG_MAX};
    const fm_allocator allocator = {counted_alloc, counted_free, &counts};
    fm_context_desc desc = *like;
    desc.allocator = &allocator;
    desc.threads = 1;
    fm_context *context = NULL;
    if (!CHECK_OK(fm_context_create(&desc, &context))) {
        return;
    }
    long long before = counts.bytes;
    fm_result result = FM_ERROR_OUT_OF_HOST_MEMORY;
    for (unsigned long n = 0; n < 200 && result != FM_OK; n++) {
        counts.calls = 0;
        counts.fail_at = n;
        result = use_world(context);
        CHECK(result == FM_OK || result == FM_ERROR_OUT_OF_HOST_MEMORY);
        // Pipelines and scratch memory stay with the context.
        CHECK(fm_context_trim(context) == FM_OK);
    }
    CHECK(result == FM_OK);
    CHECK(like->backend == FM_BACKEND_VULKAN || counts.bytes == before);
    fm_context_destroy(context);
    CHECK(counts.bytes == 0);
}

// The driver says so when it happens; here it is said for it.
static void test_lost(const fm_context_desc *desc) {
#ifdef WORLD_INTERNALS
    fm_context *context = NULL;
    fm_world *world = NULL;
    const fm_world_desc world_desc = {.shape = {8, 8, 8}};
    const fm_brush brush = {.voxel = 9, .from = {4, 4, 4}, .radius = 2};
    if (desc->backend != FM_BACKEND_VULKAN || !CHECK_OK(fm_context_create(desc, &context)) ||
        !CHECK_OK(fm_world_create(context, &world_desc, &world)) || !CHECK_OK(fm_world_update(world, NULL))) {
        return;
    }
    uint32_t voxels[512];
    const fm_box all = {{0, 0, 0}, {8, 8, 8}};
    context->gpu->lost = true;
    CHECK_OK(fm_world_edit(world, &brush, 1));
    CHECK_FAILS(fm_world_update(world, NULL), FM_ERROR_DEVICE_LOST);
    CHECK_FAILS(fm_world_read(world, &all, voxels), FM_ERROR_DEVICE_LOST);
    context->gpu->lost = false;
    fm_world_destroy(world);
    fm_context_destroy(context);
#else
    (void)desc;
#endif
}

int main(int count, char **arguments) {
    const bool on_vulkan = count > 2 && strcmp(arguments[2], "vulkan") == 0;
    const fm_context_desc desc = {.backend = on_vulkan ? FM_BACKEND_VULKAN : FM_BACKEND_CPU,
                                  .device = count > 4 ? arguments[4] : NULL,
                                  .validation = count <= 4,
                                  .log = vulkan_log};
    const fm_context_desc reference_desc = {.backend = FM_BACKEND_CPU};
    fm_context *context, *reference;
    if (fm_context_create(&desc, &context) != FM_OK) {
        return vulkan_missing();
    }
    fm_world_destroy(NULL);
    test_descs(context);
    test_too_large(context);
    world_pair pair;
    const fm_world_desc world_desc = {.shape = {23, 12, 17}};
    if (CHECK_OK(fm_context_create(&reference_desc, &reference))) {
        if (world_pair_make(&pair, context, reference, &world_desc)) {
            test_brushes(&pair);
            test_boxes(&pair);
            test_in_flight(&pair);
            test_set_method(&pair);
        }
        world_pair_free(&pair);
        test_many(context, reference);
        test_untouched(context, reference);
        test_caps(context, reference);
        fm_context_destroy(reference);
    }
    vulkan_close(context);
    test_memory_ends(&desc);
    test_lost(&desc);
    return check_summary();
}
