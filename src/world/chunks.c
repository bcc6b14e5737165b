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
    uint8_t *marks;       // a chunk each: it is among the domains; all 0 between plans
    uint64_t mark_count;  // of the method that was planned last
    int64_t size[3], edge[3], chunks[3];
    chunk_box focus, planned_focus;  // SELECTIVE: the chunks near the focus, as carried out and as planned
    bool focus_known;
};

// Chunks that may be visited for each one in reach of any edit, before all of those are counted through instead.
static const uint64_t most_visits = 4;

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

static chunk_box joined(const chunk_box *a, const chunk_box *b) {
    chunk_box box;
    for (int i = 0; i < 3; i++) {
        box.begin[i] = a->begin[i] < b->begin[i] ? a->begin[i] : b->begin[i];
        box.end[i] = a->end[i] > b->end[i] ? a->end[i] : b->end[i];
    }
    return box;
}

static int64_t floor_div(int64_t a, int64_t b) {
    return a / b - (a % b < 0 ? 1 : 0);
}

static void set_axes(const fm_world *world, fm_chunk_plan *plan) {
    fm_shape shape = world->desc.shape;
    const uint32_t axes[3] = {shape.x, shape.y, shape.z};
    for (int i = 0; i < 3; i++) {
        plan->size[i] = axes[i];
        plan->edge[i] = world->desc.method.chunk ? world->desc.method.chunk : axes[i];
        plan->chunks[i] = (plan->size[i] + plan->edge[i] - 1) / plan->edge[i];
    }
}

static const chunk_box no_chunks = {{0}, {0}};

// The chunks that are within `reach` voxels of a box, along each axis.
static chunk_box chunks_within(const fm_chunk_plan *plan, const fm_box *box, int64_t reach) {
    chunk_box chunks;
    for (int i = 0; i < 3; i++) {
        int64_t begin = box->begin[i] > 0 ? box->begin[i] : 0;
        int64_t end = box->end[i] < plan->size[i] ? box->end[i] : plan->size[i];
        if (begin >= end) {
            return no_chunks;
        }
        begin = begin > reach ? begin - reach : 0;
        end = end < plan->size[i] - reach ? end + reach : plan->size[i];
        chunks.begin[i] = begin / plan->edge[i];
        chunks.end[i] = (end - 1) / plan->edge[i] + 1;
    }
    return chunks;
}

static uint64_t count_of(const chunk_box *box) {
    return (uint64_t)(box->end[0] - box->begin[0]) * (uint64_t)(box->end[1] - box->begin[1]) *
           (uint64_t)(box->end[2] - box->begin[2]);
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
    const int64_t *size = world->chunks->size, *edge = world->chunks->edge;
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

// Memory for so many domains more.
static fm_result reserve(fm_world *world, uint64_t more) {
    fm_chunk_plan *plan = world->chunks;
    const fm_allocator *allocator = &world->context->allocator;
    uint64_t count = plan->count + more;
    if (count <= plan->capacity) {
        return FM_OK;
    }
    uint64_t capacity = fm_min_u64(fm_max_u64(count, 2 * (uint64_t)plan->capacity), plan->mark_count);
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

static uint8_t *mark_of(const fm_chunk_plan *plan, const int64_t at[3]) {
    return &plan->marks[(at[2] * plan->chunks[1] + at[1]) * plan->chunks[0] + at[0]];
}

// Adds a chunk, once.
static void add_chunk(fm_world *world, const int64_t at[3]) {
    fm_chunk_plan *plan = world->chunks;
    const fm_world_method *method = &world->desc.method;
    uint8_t *mark = mark_of(plan, at);
    if (*mark) {
        return;
    }
    fm_world_algorithm algorithm = method->algorithm;
    if (algorithm == FM_WORLD_SELECTIVE) {
        algorithm = is_inside(&plan->planned_focus, at) ? method->near_algorithm : method->far_algorithm;
    }
    *mark = 1;
    assert(plan->count < plan->capacity);
    plan->domains[plan->count++] = domain_of(world, at, algorithm);
}

// Adds the chunks of a box that lies in the world: all of them, those that `counts` (one a chunk of the box) has, or those that are
// on another side of the focus than before.
static void add_box(fm_world *world, const chunk_box *box, const uint32_t *counts, bool moved_only) {
    fm_chunk_plan *plan = world->chunks;
    int64_t at[3];
    for (at[2] = box->begin[2]; at[2] < box->end[2]; at[2]++) {
        for (at[1] = box->begin[1]; at[1] < box->end[1]; at[1]++) {
            for (at[0] = box->begin[0]; at[0] < box->end[0]; at[0]++) {
                bool unmoved = moved_only && is_inside(&plan->planned_focus, at) == is_inside(&plan->focus, at);
                if (!unmoved && (!counts || *counts++ != 0)) {
                    add_chunk(world, at);
                }
            }
        }
    }
}

// Adds `value` to an element of the differences that a box of chunks gives, if it lies within those.
static void add_corner(uint32_t *differences, const int64_t size[3], const int64_t at[3], uint32_t value) {
    if (at[0] < size[0] && at[1] < size[1] && at[2] < size[2]) {
        differences[(at[2] * size[1] + at[1]) * size[0] + at[0]] += value;
    }
}

// Sums up along an axis: elements of a line are `stride` apart. Sums wrap around on the way, not at its end.
static void sum_up(uint32_t *counts, const int64_t size[3], int axis) {
    uint64_t stride = axis == 0 ? 1 : (uint64_t)(axis == 1 ? size[0] : size[0] * size[1]);
    uint64_t all = (uint64_t)(size[0] * size[1] * size[2]), line = stride * (uint64_t)size[axis];
    for (uint64_t begin = 0; begin < all; begin += line) {
        for (uint64_t i = begin + stride; i < begin + line; i++) {
            counts[i] += counts[i - stride];
        }
    }
}

// How many of the edits are felt in each chunk of `around`, in a time that does not depend on how far they reach: differences at
// the corners of the boxes, summed up along each axis.
static void count_boxes(const fm_chunk_plan *plan, const fm_box *boxes, uint32_t box_count, int64_t reach, const chunk_box *around,
                        uint32_t *counts) {
    int64_t size[3];
    for (int k = 0; k < 3; k++) {
        size[k] = around->end[k] - around->begin[k];
    }
    for (uint32_t i = 0; i < box_count; i++) {
        chunk_box box = chunks_within(plan, &boxes[i], reach);
        for (uint32_t corner = 0; corner < 8 && !is_empty(&box); corner++) {
            int64_t at[3];
            uint32_t value = 1;
            for (int k = 0; k < 3; k++) {
                bool end = corner >> k & 1;
                at[k] = (end ? box.end[k] : box.begin[k]) - around->begin[k];
                value = end ? 0 - value : value;
            }
            add_corner(counts, size, at, value);
        }
    }
    for (int axis = 0; axis < 3; axis++) {
        sum_up(counts, size, axis);
    }
}

// Adds the chunks that any of the boxes is felt in.
static fm_result add_boxes(fm_world *world, const fm_box *boxes, uint32_t box_count) {
    fm_chunk_plan *plan = world->chunks;
    const fm_allocator *allocator = &world->context->allocator;
    const int64_t reach = reach_of(world);
    chunk_box around = no_chunks;
    uint64_t visits = 0;
    for (uint32_t i = 0; i < box_count; i++) {
        chunk_box box = chunks_within(plan, &boxes[i], reach);
        around = visits == 0 ? box : is_empty(&box) ? around : joined(&around, &box);
        visits += count_of(&box);
    }
    uint64_t all = count_of(&around);
    FM_TRY(reserve(world, fm_min_u64(visits, all)));
    if (visits <= most_visits * all) {
        for (uint32_t i = 0; i < box_count; i++) {
            chunk_box box = chunks_within(plan, &boxes[i], reach);
            add_box(world, &box, NULL, false);
        }
        return FM_OK;
    }
    uint32_t *counts = fm_alloc_zero(allocator, all * sizeof *counts, "the dirty chunks");
    if (!counts) {
        return FM_ERROR_OUT_OF_HOST_MEMORY;
    }
    count_boxes(plan, boxes, box_count, reach, &around, counts);
    add_box(world, &around, counts, false);
    fm_free(allocator, counts, all * sizeof *counts);
    return FM_OK;
}

// Adds the chunks that are on another side of the focus than before: each is in one of the two boxes alone.
static fm_result add_moved(fm_world *world) {
    fm_chunk_plan *plan = world->chunks;
    const chunk_box sides[] = {plan->focus, plan->planned_focus};
    for (int i = 0; i < 2; i++) {
        chunk_box box = sides[i];
        for (int k = 0; k < 3; k++) {
            box.begin[k] = box.begin[k] > 0 ? box.begin[k] : 0;
            box.end[k] = box.end[k] < plan->chunks[k] ? box.end[k] : plan->chunks[k];
        }
        if (!is_empty(&box)) {
            FM_TRY(reserve(world, fm_min_u64(count_of(&box), plan->mark_count - plan->count)));
            add_box(world, &box, NULL, true);
        }
    }
    return FM_OK;
}

static fm_result create_plan(fm_world *world) {
    if (!world->chunks) {
        world->chunks = fm_alloc_zero(&world->context->allocator, sizeof *world->chunks, "the dirty chunks");
    }
    return world->chunks ? FM_OK : FM_ERROR_OUT_OF_HOST_MEMORY;
}

// Marks for the chunks of the method, all 0.
static fm_result prepare_marks(fm_world *world) {
    fm_chunk_plan *plan = world->chunks;
    const fm_allocator *allocator = &world->context->allocator;
    set_axes(world, plan);
    uint64_t count = (uint64_t)(plan->chunks[0] * plan->chunks[1] * plan->chunks[2]);
    if (count > UINT32_MAX) {
        return fm_fail(FM_ERROR_UNSUPPORTED, "chunk is %u: a world of %u x %u x %u has more than 2^32 - 1 of these",
                       world->desc.method.chunk, world->desc.shape.x, world->desc.shape.y, world->desc.shape.z);
    }
    if (count == plan->mark_count) {
        return FM_OK;
    }
    uint8_t *marks = fm_alloc_zero(allocator, count, "the dirty chunks");
    if (!marks) {
        return FM_ERROR_OUT_OF_HOST_MEMORY;
    }
    fm_free(allocator, plan->marks, plan->mark_count);
    plan->marks = marks;
    plan->mark_count = count;
    return FM_OK;
}

static void clear_marks(fm_chunk_plan *plan) {
    for (uint32_t i = 0; i < plan->count; i++) {
        int64_t at[3];
        for (int k = 0; k < 3; k++) {
            at[k] = plan->domains[i].result_begin[k] / plan->edge[k];
        }
        *mark_of(plan, at) = 0;
    }
}

fm_result fm_chunks_plan(fm_world *world, const fm_box *touched, uint32_t touched_count, fm_world_job *job) {
    const fm_world_method *method = &world->desc.method;
    assert(method->algorithm != FM_WORLD_EXACT && (method->algorithm != FM_WORLD_SELECTIVE || method->chunk != 0));
    FM_TRY(create_plan(world));
    fm_chunk_plan *plan = world->chunks;
    plan->count = 0;
    FM_TRY(prepare_marks(world));
    bool selective = method->algorithm == FM_WORLD_SELECTIVE;
    if (selective) {
        plan->planned_focus = focus_box(method);
    }
    bool all = job->full || (selective && !plan->focus_known);
    const fm_box everything = {{0, 0, 0}, {world->desc.shape.x, world->desc.shape.y, world->desc.shape.z}};
    fm_result status = all ? add_boxes(world, &everything, 1) : add_boxes(world, touched, touched_count);
    if (status == FM_OK && selective && !all) {
        status = add_moved(world);
    }
    clear_marks(plan);
    FM_TRY(status);
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
    const fm_allocator *allocator = &world->context->allocator;
    if (plan) {
        fm_free(allocator, plan->domains, plan->capacity * sizeof *plan->domains);
        fm_free(allocator, plan->marks, plan->mark_count);
        fm_free(allocator, plan, sizeof *plan);
        world->chunks = NULL;
    }
}
