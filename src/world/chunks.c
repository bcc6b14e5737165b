// SPDX-License-Identifier: MIT
// Which domains a chunked method computes anew.

#include "world/chunks.h"

#include <assert.h>
#include <string.h>

// Boxes of chunk numbers: first and one past the last along each axis. They may reach beyond the world.
typedef struct chunk_box {
    int64_t begin[3], end[3];
} chunk_box;

typedef struct fm_chunk_plan fm_chunk_plan;

struct fm_chunk_plan {
    fm_world_domain *domains;
    uint32_t capacity, count;
    chunk_box focus, planned_focus;  // SELECTIVE: the chunks near the focus, as carried out and as planned
    bool focus_known;
};

bool fm_chunk_propagates_sites(fm_world_algorithm algorithm) {
    return algorithm == FM_WORLD_JFA || algorithm == FM_WORLD_JFA_1_PLUS || algorithm == FM_WORLD_JFA_PLUS_2;
}

bool fm_chunk_relaxes(fm_world_algorithm algorithm) {
    return algorithm == FM_WORLD_FIM || algorithm == FM_WORLD_JFA_FIM;
}

uint32_t fm_chunk_steps(const fm_world *world, fm_world_algorithm algorithm, uint32_t steps[FM_MAX_STEPS]) {
    const fm_world_method *method = &world->desc.method;
    fm_shape shape = world->desc.shape;
    uint64_t longest = fm_max_u64(shape.x, fm_max_u64(shape.y, shape.z));
    if (method->chunk != 0) {
        longest = fm_min_u64(longest, (method->border == FM_BORDER_HALO ? 3 : 1) * method->chunk);
    }
    uint32_t first = 1;
    while (first * 2 < longest) {
        first *= 2;
    }
    uint32_t count = 0;
    if (algorithm == FM_WORLD_JFA_1_PLUS) {
        steps[count++] = 1;
    }
    for (uint32_t step = first; step > 0; step /= 2) {
        steps[count++] = step;
    }
    if (algorithm == FM_WORLD_JFA_PLUS_2) {
        steps[count++] = 2;
        steps[count++] = 1;
    }
    assert(count <= FM_MAX_STEPS);
    return count;
}

static bool is_inside(const chunk_box *box, const int64_t at[3]) {
    bool inside = true;
    for (int i = 0; i < 3; i++) {
        inside = inside && at[i] >= box->begin[i] && at[i] < box->end[i];
    }
    return inside;
}

static bool is_empty(const chunk_box *box) {
    return box->begin[0] >= box->end[0] || box->begin[1] >= box->end[1] || box->begin[2] >= box->end[2];
}

static int64_t floor_div(int64_t a, int64_t b) {
    return a / b - (a % b < 0 ? 1 : 0);
}

static void axes_of(const fm_world *world, int64_t size[3], int64_t edge[3]) {
    fm_shape shape = world->desc.shape;
    const uint32_t axes[3] = {shape.x, shape.y, shape.z};
    for (int i = 0; i < 3; i++) {
        size[i] = axes[i];
        edge[i] = world->desc.method.chunk ? world->desc.method.chunk : axes[i];
    }
}

// The chunks that are within `reach` voxels of a box, along each axis.
static chunk_box chunks_within(const fm_world *world, const fm_box *box, int64_t reach) {
    int64_t size[3], edge[3];
    axes_of(world, size, edge);
    chunk_box chunks;
    bool empty = false;
    for (int i = 0; i < 3; i++) {
        int64_t begin = box->begin[i] > 0 ? box->begin[i] : 0;
        int64_t end = box->end[i] < size[i] ? box->end[i] : size[i];
        empty = empty || begin >= end;
        begin = begin > reach ? begin - reach : 0;
        end = end < size[i] - reach ? end + reach : size[i];
        chunks.begin[i] = begin / edge[i];
        chunks.end[i] = (end - 1) / edge[i] + 1;
    }
    return empty ? (chunk_box){{0}, {0}} : chunks;
}

// How far an edit can be felt, beyond the chunk that it is in.
static int64_t reach_of(const fm_world *world) {
    const fm_world_method *method = &world->desc.method;
    if (method->chunk == 0 || method->border == FM_BORDER_PADDING) {
        return 0;
    }
    // A deletion raises distances as far as they are told apart.
    return method->border == FM_BORDER_HALO ? method->chunk : (int64_t)fm_world_cap(&world->desc) - 1;
}

static chunk_box focus_box(const fm_world_method *method) {
    chunk_box box;
    for (int i = 0; i < 3; i++) {
        box.begin[i] = floor_div(method->focus[i], method->chunk) - method->focus_chunks / 2;
        box.end[i] = box.begin[i] + method->focus_chunks;
    }
    return box;
}

static fm_world_domain domain_of(const fm_world *world, const int64_t chunk[3], fm_world_algorithm algorithm) {
    const fm_world_method *method = &world->desc.method;
    int64_t size[3], edge[3];
    axes_of(world, size, edge);
    fm_world_domain domain = {.algorithm = algorithm,
                              .padded = method->chunk != 0 && method->border == FM_BORDER_PADDING,
                              .linked = method->chunk != 0 && method->border == FM_BORDER_EXCHANGE};
    for (int i = 0; i < 3; i++) {
        int64_t begin = chunk[i] * edge[i];
        int64_t end = begin + edge[i] < size[i] ? begin + edge[i] : size[i];
        domain.result_begin[i] = (uint32_t)begin;
        domain.result_size[i] = (uint32_t)(end - begin);
        if (method->chunk != 0 && method->border == FM_BORDER_HALO) {
            begin = begin > edge[i] ? begin - edge[i] : 0;
            end = end < size[i] - edge[i] ? end + edge[i] : size[i];
        }
        domain.begin[i] = (uint32_t)begin;
        domain.size[i] = (uint32_t)(end - begin);
    }
    return domain;
}

static fm_result reserve(fm_world *world, uint64_t count) {
    fm_chunk_plan *plan = world->chunks;
    const fm_allocator *allocator = &world->context->allocator;
    if (count <= plan->capacity) {
        return FM_OK;
    }
    if (count > UINT32_MAX) {
        return fm_fail(FM_ERROR_UNSUPPORTED, "chunk is %u: a world of %u x %u x %u has more than 2^32 - 1 of these",
                       world->desc.method.chunk, world->desc.shape.x, world->desc.shape.y, world->desc.shape.z);
    }
    uint64_t capacity = fm_min_u64(fm_max_u64(count, 2 * (uint64_t)plan->capacity), UINT32_MAX);
    fm_world_domain *domains = fm_alloc(allocator, capacity * sizeof *domains, "the dirty chunks");
    if (!domains) {
        return FM_ERROR_OUT_OF_HOST_MEMORY;
    }
    if (plan->count > 0) {
        memcpy(domains, plan->domains, plan->count * sizeof *domains);
    }
    fm_free(allocator, plan->domains, plan->capacity * sizeof *domains);
    plan->domains = domains;
    plan->capacity = (uint32_t)capacity;
    return FM_OK;
}

// Adds the chunks of a box, less those that are in `done` already or, if a focus is given, not on another side than before.
static fm_result add_box(fm_world *world, const chunk_box *wanted, const chunk_box *done, bool moved_only) {
    fm_chunk_plan *plan = world->chunks;
    const fm_world_method *method = &world->desc.method;
    int64_t size[3], edge[3];
    axes_of(world, size, edge);
    chunk_box box = *wanted;
    for (int i = 0; i < 3; i++) {
        int64_t chunks = (size[i] + edge[i] - 1) / edge[i];
        box.begin[i] = box.begin[i] > 0 ? box.begin[i] : 0;
        box.end[i] = box.end[i] < chunks ? box.end[i] : chunks;
    }
    if (is_empty(&box)) {
        return FM_OK;
    }
    uint64_t in_slice = (uint64_t)(box.end[0] - box.begin[0]) * (uint64_t)(box.end[1] - box.begin[1]);
    FM_TRY(reserve(world, plan->count + in_slice * (uint64_t)(box.end[2] - box.begin[2])));
    int64_t at[3];
    for (at[2] = box.begin[2]; at[2] < box.end[2]; at[2]++) {
        for (at[1] = box.begin[1]; at[1] < box.end[1]; at[1]++) {
            for (at[0] = box.begin[0]; at[0] < box.end[0]; at[0]++) {
                bool selective = method->algorithm == FM_WORLD_SELECTIVE;
                bool near = selective && is_inside(&plan->planned_focus, at);
                bool skipped = (done && is_inside(done, at)) || (moved_only && near == is_inside(&plan->focus, at));
                if (!skipped) {
                    fm_world_algorithm algorithm = !selective ? method->algorithm
                                                   : near     ? method->near_algorithm
                                                              : method->far_algorithm;
                    plan->domains[plan->count++] = domain_of(world, at, algorithm);
                }
            }
        }
    }
    return FM_OK;
}

static fm_result add_moved(fm_world *world, const chunk_box *touched) {
    fm_chunk_plan *plan = world->chunks;
    // A chunk that changed sides is in one of the two boxes alone, and so is met once.
    FM_TRY(add_box(world, &plan->focus, touched, true));
    return add_box(world, &plan->planned_focus, touched, true);
}

fm_result fm_chunks_plan(fm_world *world, const fm_box *touched, fm_world_job *job) {
    const fm_world_method *method = &world->desc.method;
    assert(method->algorithm != FM_WORLD_EXACT && (method->algorithm != FM_WORLD_SELECTIVE || method->chunk != 0));
    if (!world->chunks) {
        world->chunks = fm_alloc_zero(&world->context->allocator, sizeof *world->chunks, "the dirty chunks");
        if (!world->chunks) {
            return FM_ERROR_OUT_OF_HOST_MEMORY;
        }
    }
    fm_chunk_plan *plan = world->chunks;
    plan->count = 0;
    bool selective = method->algorithm == FM_WORLD_SELECTIVE;
    if (selective) {
        plan->planned_focus = focus_box(method);
    }
    bool all = !touched || (selective && !plan->focus_known);
    const fm_box everything = {{0, 0, 0}, {world->desc.shape.x, world->desc.shape.y, world->desc.shape.z}};
    chunk_box dirty = chunks_within(world, all ? &everything : touched, reach_of(world));
    FM_TRY(add_box(world, &dirty, NULL, false));
    if (selective && !all) {
        FM_TRY(add_moved(world, &dirty));
    }
    job->domains = plan->domains;
    job->domain_count = plan->count;
    return FM_OK;
}

void fm_chunks_done(fm_world *world) {
    fm_chunk_plan *plan = world->chunks;
    if (plan) {
        plan->focus = plan->planned_focus;
        plan->focus_known = world->desc.method.algorithm == FM_WORLD_SELECTIVE;
    }
}

void fm_chunks_destroy(fm_world *world) {
    fm_chunk_plan *plan = world->chunks;
    if (plan) {
        fm_free(&world->context->allocator, plan->domains, plan->capacity * sizeof *plan->domains);
        fm_free(&world->context->allocator, plan, sizeof *plan);
        world->chunks = NULL;
    }
}
