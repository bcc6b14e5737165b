// SPDX-License-Identifier: MIT
// Octrees of vectors built on Vulkan: blocks of corners near the surface are listed, their nearest points found, cells and nodes
// made leaves from the finest upwards, leaves and nodes numbered by sums, and written. The host waits twice for sizes: for how many
// blocks are near, and for how many nodes and leaves there are.

#include "octree/gpu_build.h"
#include "gpu/compute.h"
#include "mesh/gpu_mesh.h"
#include "mesh/gpu_voxelize.h"
#include "mesh/voxel_grid.h"
#include "octree/build.h"

#include <assert.h>
#include <math.h>
#include <string.h>

_Static_assert(FM_BUILD_BINS == (int)FM_ERROR_BINS && (int)FM_BUILD_CHUNK == (int)FM_CHUNK, "as the host has them");

enum { THREADS = 64, STEP = 256, MOST_SLOTS = 1 << 25, SAMPLED_FROM = 1 << 20 };

static uint64_t pad(uint64_t bytes) {
    return fm_round_up(fm_max_u64(bytes, 4), STEP);
}

static uint64_t product(const uint32_t shape[3]) {
    return (uint64_t)shape[0] * shape[1] * shape[2];
}

static uint64_t level_nodes(const fm_gpu_build *b, uint32_t level) {
    uint64_t count = 1;
    for (int axis = 0; axis < 3; axis++) {
        count *= (uint64_t)b->plan.top[axis] << (b->plan.levels - level);
    }
    return count;
}

// --- The plan ---

static void fill_plan(fm_gpu_build *b) {
    fm_build_plan *plan = &b->plan;
    const fm_octree *octree = b->octree;
    const fm_octree_info *info = &octree->info;
    double largest = 0;
    for (int axis = 0; axis < 3; axis++) {
        plan->cells[axis] = info->cells[axis];
        plan->top[axis] = info->top[axis];
        plan->chunks[axis] = (uint32_t)fm_div_up(info->cells[axis], FM_CHUNK);
        b->blocks[axis] = (uint32_t)fm_div_up(info->cells[axis], FM_BUILD_BLOCK) + 1;
        largest = fmax(largest, fabs(info->origin[axis]) + info->cells[axis] * info->cell);
    }
    plan->cell = (float)info->cell;
    plan->levels = info->levels;
    plan->leaf_most = (uint32_t)fm_min_u64(info->levels, FM_LEAF_MOST);
    plan->band = b->desc->band;
    plan->threshold = b->desc->threshold;
    plan->reach = (float)(((double)b->desc->band + 2 * sqrt(3)) * 1.0001);
    plan->cutoff = octree->head.cutoff;
    plan->slack = (float)(1e-4 + 4e-7 * largest / info->cell);
    plan->share = b->desc->share;
    uint64_t nodes = 0;
    for (uint32_t level = plan->levels; level >= 3; level--) {
        b->above = level == plan->leaf_most ? nodes : b->above;
        plan->first[level] = (uint32_t)nodes;
        nodes += level_nodes(b, level);
    }
    plan->above = (uint32_t)b->above;
    b->nodes = nodes;
    b->items = b->above + level_nodes(b, plan->leaf_most) * (plan->leaf_most == 4 ? 73 : 9);
    b->rows = product(plan->chunks) * FM_BUILD_ROWS;
}

// Whether numbers of 32 bits tell all apart.
static bool numbers_fit(const fm_gpu_build *b) {
    bool fits = level_nodes(b, 2) <= UINT32_MAX && b->items <= UINT32_MAX && b->rows <= UINT32_MAX;
    for (int axis = 0; axis < 3; axis++) {
        fits = fits && b->blocks[axis] < 16384;
    }
    return fits;
}

// --- Memory ---

// Parts of a buffer are laid out by asking for them: an offset, then room behind it.
static uint64_t take(uint64_t *used, uint64_t bytes) {
    const uint64_t at = *used;
    *used += pad(bytes);
    return at;
}

// As sdf_near.glsl finds them: bits of blocks, of rows, of slices; then the list.
static uint64_t near_entries(const fm_gpu_build *b) {
    const uint64_t words = fm_div_up(b->blocks[0], 32), y_words = fm_div_up(b->blocks[1], 32),
                   z_words = fm_div_up(b->blocks[2], 32);
    return FM_SDF_HEADER_BYTES + fm_round_up(4 * words * b->blocks[1] * b->blocks[2], 16) +
           fm_round_up(4 * y_words * b->blocks[2], 16) + fm_round_up(4 * z_words, 16);
}

static fm_result make(fm_gpu_build *b, int which, uint64_t bytes) {
    fm_purpose purpose = which == FM_BUILD_ANSWERS                                 ? FM_PURPOSE_READBACK
                         : which == FM_BUILD_SENT                                  ? FM_PURPOSE_UPLOAD
                         : which >= FM_BUILD_WORDS && which <= FM_BUILD_ATTRIBUTES ? FM_PURPOSE_OCTREES
                                                                                   : FM_PURPOSE_SCRATCH;
    b->bytes += bytes;
    if (b->bytes > b->most_bytes) {
        return fm_fail(FM_ERROR_OUT_OF_DEVICE_MEMORY, "the build of an octree needs more than half of the device's memory");
    }
    return fm_buffer_create(b->gpu, purpose, pad(bytes), false, &b->buffers[which]);
}

static uint64_t address(const fm_gpu_build *b, int which) {
    return fm_buffer_address(b->buffers[which]);
}

static fm_result make_near(fm_gpu_build *b) {
    const uint64_t blocks = product(b->blocks);
    uint64_t used = 0;
    b->entries_at = near_entries(b);
    (void)take(&used, b->entries_at + 4 * blocks);
    b->lists_at = take(&used, fm_voxelize_list_bytes(b->mesh->triangle_count));
    b->slots_at = take(&used, 4 * blocks);
    b->plan_at = take(&used, sizeof b->plan);
    FM_TRY(make(b, FM_BUILD_NEAR, used));
    FM_TRY(make(b, FM_BUILD_ANSWERS, FM_BUILD_TOTALS * 4));
    FM_TRY(make(b, FM_BUILD_SENT, sizeof b->plan));
    const uint64_t near = address(b, FM_BUILD_NEAR);
    b->plan.near = near + FM_NEAR_LIST;
    b->plan.entries = near + b->entries_at;
    b->plan.slots = near + b->slots_at;
    return FM_OK;
}

static fm_result make_nodes(fm_gpu_build *b) {
    const uint64_t most[2] = {fm_min_u64(b->slots, level_nodes(b, 3)),
                              b->plan.leaf_most < 4 ? 0 : fm_min_u64(b->slots, level_nodes(b, 4))};
    uint64_t used = 0, lists[2], coarse[3];
    const uint64_t bricks = take(&used, b->slots * FM_BUILD_BRICK_BYTES);
    coarse[0] = take(&used, b->slots * FM_BUILD_COARSE_BYTES);
    for (int i = 0; i < 2; i++) {
        lists[i] = take(&used, FM_LIST_HEADER_BYTES + 4 * most[i]);
        coarse[i + 1] = take(&used, most[i] * FM_BUILD_COARSE_BYTES);
    }
    const uint64_t nodes = take(&used, 4 * b->nodes);
    b->items_at = take(&used, 4 * b->items);
    const uint64_t columns = take(&used, 4 * b->rows);
    const uint64_t sums = take(&used, 4 * fm_div_up(fm_max_u64(b->items, b->rows), FM_BUILD_SCAN_TILE));
    b->totals_at = take(&used, FM_BUILD_TOTALS * 4);
    FM_TRY(make(b, FM_BUILD_CORNER_STORE, b->slots * FM_BUILD_CORNERS * FM_BUILD_CORNER_BYTES));
    FM_TRY(make(b, FM_BUILD_NODES, used));
    FM_TRY(make(b, FM_BUILD_ROW_STORE, b->rows * FM_BUILD_ROW_BYTES));
    const uint64_t base = address(b, FM_BUILD_NODES);
    fm_build_plan *plan = &b->plan;
    plan->corners = address(b, FM_BUILD_CORNER_STORE);
    plan->rows = address(b, FM_BUILD_ROW_STORE);
    plan->bricks = base + bricks;
    for (int i = 0; i < 3; i++) {
        plan->coarse[i] = base + coarse[i];
    }
    for (int i = 0; i < 2; i++) {
        b->list_at[i] = lists[i];
        plan->lists[i] = base + lists[i];
    }
    plan->nodes = base + nodes;
    plan->items = base + b->items_at;
    plan->columns = base + columns;
    plan->totals = base + b->totals_at;
    b->sums = base + sums;
    return FM_OK;
}

static fm_result make_arrays(fm_gpu_build *b) {
    const uint64_t value = b->octree->values.size, count = FM_COLUMN_VALUES * (uint64_t)b->columns;
    b->words = product(b->plan.top) + 8 * (uint64_t)b->groups;
    if (b->words > FM_NODE_EMPTY) {
        return fm_fail(FM_ERROR_UNSUPPORTED, "nodes need more than 2^30 words: choose a smaller size");
    }
    if (b->columns >= INT32_MAX) {
        return fm_fail(FM_ERROR_UNSUPPORTED, "leaves need more than 2^31 columns of values: choose a smaller size");
    }
    FM_TRY(make(b, FM_BUILD_WORDS, 4 * b->words));
    FM_TRY(make(b, FM_BUILD_VALUES, value * count));
    b->plan.words = address(b, FM_BUILD_WORDS);
    b->plan.values = address(b, FM_BUILD_VALUES);
    if (b->desc->attribute != FM_OCTREE_PLAIN) {
        FM_TRY(make(b, FM_BUILD_ATTRIBUTES, 4 * count));
        b->plan.attributes = address(b, FM_BUILD_ATTRIBUTES);
    }
    b->plan.sampled = 1;
    while (count / b->plan.sampled > SAMPLED_FROM) {
        b->plan.sampled *= 2;
    }
    return FM_OK;
}

// --- Commands ---

static void send_plan(fm_gpu_build *b) {
    memcpy(fm_buffer_mapped(b->buffers[FM_BUILD_SENT]), &b->plan, sizeof b->plan);
    fm_commands_copy(b->gpu, b->slot, b->buffers[FM_BUILD_SENT], 0, b->buffers[FM_BUILD_NEAR], b->plan_at, sizeof b->plan);
    fm_commands_barrier(b->gpu, b->slot);
}

// `groups` 0: as many as the list at an offset of a buffer has entries.
static fm_result run(fm_gpu_build *b, fm_kernel kernel, uint32_t level, uint64_t groups, const fm_buffer *list, uint64_t list_at) {
    const fm_build_push push = {.plan = address(b, FM_BUILD_NEAR) + b->plan_at, .level = level};
    const uint32_t constants[] = {(uint32_t)b->desc->code};
    const bool coded = kernel == FM_KERNEL_OCTREE_BUILD_WORDS || kernel == FM_KERNEL_OCTREE_BUILD_EMIT;
    const fm_dispatch dispatch = {.kernel = kernel,
                                  .constants = constants,
                                  .constant_count = coded ? 1 : 0,
                                  .push = &push,
                                  .push_bytes = sizeof push,
                                  .groups = groups,
                                  .indirect = list,
                                  .indirect_offset = list_at + 4};
    FM_TRY(fm_commands_dispatch(b->gpu, b->slot, &dispatch));
    fm_commands_barrier(b->gpu, b->slot);
    return FM_OK;
}

static fm_result run_nodes(fm_gpu_build *b, fm_kernel kernel, uint32_t level) {
    return run(b, kernel, level, fm_div_up(level_nodes(b, level), THREADS), NULL, 0);
}

static fm_result run_bricks(fm_gpu_build *b, fm_kernel kernel) {
    return run(b, kernel, 2, 0, b->buffers[FM_BUILD_NEAR], FM_NEAR_LIST);
}

static fm_result run_scan(fm_gpu_build *b, uint64_t counts, uint64_t count, uint32_t total) {
    const fm_scan_push push = {.counts = counts, .sums = b->sums, .total = b->plan.totals + 4 * total, .count = (uint32_t)count};
    for (uint32_t phase = 0; phase < 3; phase++) {
        const fm_dispatch dispatch = {.kernel = FM_KERNEL_OCTREE_BUILD_SCAN,
                                      .constants = &phase,
                                      .constant_count = 1,
                                      .push = &push,
                                      .push_bytes = sizeof push,
                                      .groups = phase == 1 ? 1 : fm_div_up(count, FM_BUILD_SCAN_TILE)};
        FM_TRY(fm_commands_dispatch(b->gpu, b->slot, &dispatch));
        fm_commands_barrier(b->gpu, b->slot);
    }
    return FM_OK;
}

// Marks the blocks whose corners may know something of the surface.
static fm_result mark_blocks(fm_gpu_build *b) {
    fm_volume_desc desc = {.shape = {b->blocks[0], b->blocks[1], b->blocks[2]}};
    for (int axis = 0; axis < 3; axis++) {
        desc.spacing[axis] = FM_BUILD_BLOCK;
        desc.origin[axis] = 0.5 * (FM_BUILD_BLOCK - 1);
    }
    fm_near_push push = {.mesh = b->plan.mesh,
                         .bits = address(b, FM_BUILD_NEAR) + FM_SDF_HEADER_BYTES,
                         .lists = address(b, FM_BUILD_NEAR) + b->lists_at,
                         .grid = fm_voxel_grid_of(&desc),
                         .row_words = (uint32_t)fm_div_up(b->blocks[0], 32)};
    FM_TRY(fm_gpu_near_mark(b->gpu, b->slot, &push, b->plan.reach, b->buffers[FM_BUILD_NEAR], b->lists_at));
    fm_commands_barrier(b->gpu, b->slot);
    return FM_OK;
}

static fm_result list_blocks(fm_gpu_build *b) {
    const uint32_t x = b->blocks[0] * FM_BUILD_BLOCK, y = b->blocks[1] * FM_BUILD_BLOCK, z = b->blocks[2] * FM_BUILD_BLOCK;
    const fm_sdf_push push = {.mesh = b->plan.mesh, .scratch = address(b, FM_BUILD_NEAR), .size_xy = x | y << 16, .size_z = z};
    const uint32_t constants[] = {FM_SDF_UNSIGNED, 0, 0};
    const fm_dispatch dispatch = {.kernel = FM_KERNEL_MESH_NEAR_LIST,
                                  .constants = constants,
                                  .constant_count = 3,
                                  .push = &push,
                                  .push_bytes = sizeof push,
                                  .groups = fm_div_up(fm_div_up(b->blocks[0], 32) * b->blocks[1] * b->blocks[2], THREADS)};
    FM_TRY(fm_commands_dispatch(b->gpu, b->slot, &dispatch));
    fm_commands_barrier(b->gpu, b->slot);
    return FM_OK;
}

static void clear_list(fm_gpu_build *b, int which, uint64_t at) {
    fm_commands_fill(b->gpu, b->slot, b->buffers[which], at, 8, 0);
    fm_commands_fill(b->gpu, b->slot, b->buffers[which], at + 8, 8, 1);
}

static fm_result record_near(fm_gpu_build *b) {
    fm_buffer *near = b->buffers[FM_BUILD_NEAR];
    FM_TRY(fm_gpu_mesh_tree(b->mesh, b->slot, true));
    b->plan.mesh = fm_gpu_mesh_refs(b->mesh);
    clear_list(b, FM_BUILD_NEAR, FM_NEAR_LIST);
    fm_commands_fill(b->gpu, b->slot, near, FM_SDF_HEADER_BYTES, b->entries_at - FM_SDF_HEADER_BYTES, 0);
    fm_commands_fill(b->gpu, b->slot, near, b->slots_at, 4 * product(b->blocks), FM_GPU_NONE);
    FM_TRY(mark_blocks(b));
    FM_TRY(list_blocks(b));
    fm_commands_copy(b->gpu, b->slot, near, FM_NEAR_LIST, b->buffers[FM_BUILD_ANSWERS], 0, 4);
    fm_commands_pass(b->gpu, b->slot, "near", 24 * (uint64_t)b->mesh->triangle_count + 4 * product(b->blocks));
    return FM_OK;
}

static fm_result record_levels(fm_gpu_build *b) {
    for (uint32_t level = 3; level <= b->plan.levels; level++) {
        FM_TRY(run_nodes(b, FM_KERNEL_OCTREE_BUILD_NODES, level));
        if (level <= b->plan.leaf_most) {
            FM_TRY(run(b, FM_KERNEL_OCTREE_BUILD_MERGE, level, 0, b->buffers[FM_BUILD_NODES], b->list_at[level - 3]));
        }
    }
    fm_commands_pass(b->gpu, b->slot, "merge", 12 * b->nodes);
    return FM_OK;
}

static fm_result record_leaves(fm_gpu_build *b) {
    fm_buffer *nodes = b->buffers[FM_BUILD_NODES];
    fm_commands_fill(b->gpu, b->slot, nodes, b->items_at, 4 * b->items, 0);
    fm_commands_fill(b->gpu, b->slot, nodes, b->totals_at, FM_BUILD_TOTALS * 4, 0);
    clear_list(b, FM_BUILD_NODES, b->list_at[0]);
    clear_list(b, FM_BUILD_NODES, b->list_at[1]);
    send_plan(b);
    FM_TRY(run_bricks(b, FM_KERNEL_OCTREE_BUILD_CORNERS));
    fm_commands_pass(b->gpu, b->slot, "nearest", b->slots * FM_BUILD_CORNERS * FM_BUILD_CORNER_BYTES);
    FM_TRY(run_bricks(b, FM_KERNEL_OCTREE_BUILD_BRICKS));
    fm_commands_pass(b->gpu, b->slot, "cells", b->slots * (FM_BUILD_CORNERS * FM_BUILD_CORNER_BYTES + FM_BUILD_BRICK_BYTES));
    FM_TRY(record_levels(b));
    FM_TRY(run(b, FM_KERNEL_OCTREE_BUILD_ROWS, 0, fm_div_up(b->rows, THREADS), NULL, 0));
    fm_commands_pass(b->gpu, b->slot, "rows", b->rows * (FM_BUILD_ROW_BYTES + 4));
    FM_TRY(run_scan(b, b->plan.columns, b->rows, FM_BUILD_COLUMNS));
    FM_TRY(run_scan(b, b->plan.items, b->items, FM_BUILD_GROUPS));
    fm_commands_copy(b->gpu, b->slot, nodes, b->totals_at, b->buffers[FM_BUILD_ANSWERS], 0, 8);
    fm_commands_pass(b->gpu, b->slot, "number", 12 * (b->rows + b->items));
    return FM_OK;
}

static fm_result record_arrays(fm_gpu_build *b) {
    send_plan(b);
    for (uint32_t level = b->plan.levels; level >= 2; level--) {
        FM_TRY(run_nodes(b, FM_KERNEL_OCTREE_BUILD_WORDS, level));
    }
    fm_commands_pass(b->gpu, b->slot, "words", 4 * (b->nodes + b->words));
    FM_TRY(run_bricks(b, FM_KERNEL_OCTREE_BUILD_EMIT));
    fm_commands_copy(b->gpu, b->slot, b->buffers[FM_BUILD_NODES], b->totals_at, b->buffers[FM_BUILD_ANSWERS], 0,
                     FM_BUILD_TOTALS * 4);
    fm_commands_pass(b->gpu, b->slot, "leaves", b->columns * FM_COLUMN_VALUES * (uint64_t)b->octree->values.size);
    return FM_OK;
}

// --- What comes back ---

static fm_result fetch(fm_gpu_build *b, fm_octree_array *array, uint64_t count, int which) {
    if (!fm_octree_reserve(b->octree, array, count)) {
        return FM_ERROR_OUT_OF_HOST_MEMORY;
    }
    array->count = count;
    return count > 0 ? fm_buffer_download_at(b->buffers[which], 0, array->data, count * array->size) : FM_OK;
}

static fm_result take_times(fm_gpu_build *b) {
    fm_pass passes[FM_MAX_PASSES];
    uint32_t count = FM_MAX_PASSES;
    FM_TRY(fm_gpu_passes(b->gpu, &count, passes));
    for (uint32_t i = 0; i < fm_min_u64(count, FM_MAX_PASSES); i++) {
        b->octree->info.gpu_ms += passes[i].milliseconds;
    }
    return FM_OK;
}

static fm_result take_arrays(fm_gpu_build *b) {
    fm_octree *octree = b->octree;
    const uint32_t *totals = fm_buffer_mapped(b->buffers[FM_BUILD_ANSWERS]);
    const uint64_t values = FM_COLUMN_VALUES * (uint64_t)b->columns;
    uint64_t bins[FM_ERROR_BINS];
    octree->info.internal = b->groups;
    octree->info.empty = totals[FM_BUILD_EMPTY];
    for (uint32_t level = 0; level <= FM_LEAF_MOST; level++) {
        octree->info.leaves[level] = totals[FM_BUILD_LEAVES + level];
    }
    for (uint32_t i = 0; i < FM_ERROR_BINS; i++) {
        bins[i] = totals[FM_BUILD_ERRORS + i];
    }
    fm_octree_tell_errors(octree, bins);
    FM_TRY(take_times(b));
    FM_TRY(fetch(b, &octree->words, b->words, FM_BUILD_WORDS));
    FM_TRY(fetch(b, &octree->values, values, FM_BUILD_VALUES));
    if (b->desc->attribute != FM_OCTREE_PLAIN) {
        FM_TRY(fetch(b, &octree->attributes, values, FM_BUILD_ATTRIBUTES));
    }
    FM_TRY(fm_octree_finish(octree));
    return b->desc->share ? FM_OK : fm_gpu_octree_adopt(octree, &b->buffers[FM_BUILD_WORDS]);
}

// --- The build ---

// A copy of the mesh in finest cells from the box's origin, so that corners are whole numbers, and places that are equally far in
// the world are so here.
static fm_result make_mesh(fm_gpu_build *b, const fm_mesh *mesh) {
    const fm_octree_info *info = &b->octree->info;
    fm_context *context = mesh->context;
    const uint64_t bytes = fm_max_u64(1, mesh->vertex_count) * sizeof *mesh->vertices;
    float(*vertices)[3] = fm_octree_alloc(context, bytes, "vertices in cells");
    if (!vertices) {
        return FM_ERROR_OUT_OF_HOST_MEMORY;
    }
    for (uint64_t i = 0; i < mesh->vertex_count; i++) {
        for (int axis = 0; axis < 3; axis++) {
            const float x = mesh->vertices[i][axis];
            vertices[i][axis] = fm_coordinate_fits(x) ? (float)(((double)x - info->origin[axis]) / info->cell) : NAN;
        }
    }
    const fm_mesh_desc desc = {.vertices = (const float(*)[3])vertices,
                               .triangles = (const uint32_t(*)[3])mesh->triangles,
                               .vertex_count = mesh->vertex_count,
                               .triangle_count = mesh->triangle_count};
    const fm_result result = fm_mesh_create(mesh->context, &desc, &b->mesh);
    fm_octree_free(context, vertices, bytes);
    return result;
}

static const uint32_t *answers(const fm_gpu_build *b) {
    return fm_buffer_mapped(b->buffers[FM_BUILD_ANSWERS]);
}

static fm_result build(fm_gpu_build *b, const fm_mesh *mesh) {
    FM_TRY(make_mesh(b, mesh));
    FM_TRY(make_near(b));
    FM_TRY(fm_commands_begin(b->gpu, &b->slot));
    FM_TRY(record_near(b));
    FM_TRY(fm_commands_flush(b->gpu, &b->slot));
    b->slots = answers(b)[0];
    if (b->slots > MOST_SLOTS) {
        return fm_fail(FM_ERROR_UNSUPPORTED, "too much is near the surface for one build on the device");
    }
    FM_TRY(make_nodes(b));
    FM_TRY(record_leaves(b));
    FM_TRY(fm_commands_flush(b->gpu, &b->slot));
    b->groups = answers(b)[FM_BUILD_GROUPS];
    b->columns = answers(b)[FM_BUILD_COLUMNS];
    FM_TRY(make_arrays(b));
    FM_TRY(record_arrays(b));
    FM_TRY(fm_commands_submit(b->gpu, b->slot, NULL));
    return take_arrays(b);
}

bool fm_gpu_octree_builds(const fm_mesh *mesh, const fm_octree_desc *desc) {
    return mesh->gpu && mesh->triangle_count > 0 && desc->kind == FM_OCTREE_CLOSEST && desc->method == FM_OCTREE_EXACT &&
           desc->band >= 1 && desc->attribute <= FM_OCTREE_TRIANGLE;
}

fm_result fm_gpu_octree_build(fm_mesh *mesh, const fm_octree_desc *desc, const double low[3], const double high[3],
                              fm_octree **octree) {
    fm_gpu_build b = {.gpu = mesh->context->gpu, .desc = desc};
    fm_device_info device;
    fm_gpu_describe(b.gpu, &device);
    b.most_bytes = device.memory / 2;
    FM_TRY(fm_octree_new(mesh->context, desc, low, high, &b.octree));
    fill_plan(&b);
    fm_result result =
        numbers_fit(&b) ? build(&b, mesh) : fm_fail(FM_ERROR_UNSUPPORTED, "the box has too many cells for the device");
    if (result == FM_OK) {
        *octree = b.octree;
    } else {
        fm_octree_destroy(b.octree);
    }
    for (int i = 0; i < FM_BUILD_BUFFERS; i++) {
        fm_buffer_destroy(b.buffers[i]);
    }
    fm_mesh_destroy(b.mesh);
    return result;
}
