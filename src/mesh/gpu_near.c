// SPDX-License-Identifier: MIT
// Fields of meshes on Vulkan where sides are known from the surface alone. Triangles mark the blocks of 4^3 texels
// that they are near to; those are listed, and their texels look for the nearest triangle; all others get their side and a
// triangle from the near ones. Only where far texels are to be exact is the tree asked about places that the band does not reach.

#include "mesh/gpu_sdf.h"
#include "mesh/gpu_voxelize.h"
#include "mesh/voxel_grid.h"

#include <assert.h>
#include <string.h>

enum { THREADS = 64 };

// Where the parts of the scratch memory begin, as sdf_near.glsl finds them but for the last three.
typedef struct near_layout {
    fm_shape blocks;
    uint64_t row_words;
    uint64_t slices, slice_bits, entries, cells, lists, inside, counts, bytes;
} near_layout;

static uint64_t words(uint32_t bits) {
    return fm_div_up(bits, 32);
}

static uint32_t blocks_along(uint32_t size) {
    return (uint32_t)fm_div_up(size, FM_SDF_MIDDLE);
}

static fm_voxel_grid texel_grid(const fm_sdf_plan *plan) {
    fm_volume_desc desc = {.shape = plan->shape};
    memcpy(desc.spacing, plan->spacing, sizeof desc.spacing);
    memcpy(desc.origin, plan->origin, sizeof desc.origin);
    return fm_voxel_grid_of(&desc);
}

static fm_voxel_grid block_grid(const fm_sdf_plan *plan, fm_shape blocks) {
    fm_volume_desc desc = {.shape = blocks};
    for (int axis = 0; axis < 3; axis++) {
        desc.spacing[axis] = FM_SDF_MIDDLE * plan->spacing[axis];
        desc.origin[axis] = plan->origin[axis] + 0.5 * (FM_SDF_MIDDLE - 1) * plan->spacing[axis];
    }
    return fm_voxel_grid_of(&desc);
}

// Far texels get triangles, by which they have distances or begin to look for the nearest.
static bool is_flooded(const fm_sdf_job *j) {
    return j->plan->far_texels != FM_FAR_BAND;
}

static uint64_t cell_bytes(fm_shape blocks) {
    return fm_voxels(blocks) * FM_NEAR_CELL_BYTES;
}

static near_layout layout_of(const fm_sdf_job *j) {
    enum { STEP = 16 };
    const fm_shape shape = j->plan->shape;
    near_layout l = {.blocks = {blocks_along(shape.x), blocks_along(shape.y), blocks_along(shape.z)}};
    l.row_words = words(l.blocks.x);
    l.slices = FM_SDF_HEADER_BYTES + fm_round_up(4 * l.row_words * l.blocks.y * l.blocks.z, STEP);
    l.slice_bits = l.slices + fm_round_up(4 * words(l.blocks.y) * l.blocks.z, STEP);
    l.entries = l.slice_bits + fm_round_up(4 * words(l.blocks.z), STEP);
    l.cells = l.entries + fm_round_up(4 * fm_voxels(l.blocks), STEP);
    l.lists = l.cells + (is_flooded(j) ? 2 * cell_bytes(l.blocks) : 0);
    l.inside = l.lists + fm_voxelize_list_bytes(j->mesh->triangle_count);
    l.counts = l.bytes = l.inside;
    if (j->constants[0] == FM_SDF_CROSSINGS) {
        const fm_voxel_grid grid = texel_grid(j->plan);
        uint64_t slab_bytes;
        (void)fm_voxelize_slab(&grid, &slab_bytes);
        l.counts += fm_round_up(4 * words(shape.x) * shape.y * shape.z, STEP);
        l.bytes = l.counts + slab_bytes;
    }
    return l;
}

uint64_t fm_gpu_near_bytes(const fm_sdf_job *j) {
    return layout_of(j).bytes;
}

// How near a triangle must be to a block's texels to make it a near one. Sides are carried from texel to texel, and the widest step
// must be within it. Where all is to be exact, triangles are flooded from as few blocks.
static double mark_reach(const fm_sdf_plan *plan) {
    const double widest = fmax(plan->spacing[0], fmax(plan->spacing[1], plan->spacing[2]));
    const double band = plan->far_texels == FM_FAR_EXACT ? widest : (double)plan->band;
    return fmin(fmax(band * 1.00001, widest * 1.001), 1e18);
}

// How far texels of near blocks look: not beyond the band, or where every distance is exact as far as there are triangles. Its
// square is a float.
static float walk_reach(const fm_sdf_job *j) {
    return j->plan->far_texels == FM_FAR_EXACT ? 1.8e19f : (float)mark_reach(j->plan);
}

static void record_header(const fm_sdf_job *j, fm_slot *slot, const near_layout *l) {
    // FM_LIST_EMPTY.
    fm_commands_fill(j->gpu, slot, j->scratch, FM_NEAR_LIST, 8, 0);
    fm_commands_fill(j->gpu, slot, j->scratch, FM_NEAR_LIST + 8, 8, 1);
    uint32_t bits;
    memcpy(&bits, &j->plan->band, sizeof bits);
    fm_commands_fill(j->gpu, slot, j->scratch, FM_SDF_BAND, 4, bits);
    const float reach = walk_reach(j);
    memcpy(&bits, &reach, sizeof bits);
    fm_commands_fill(j->gpu, slot, j->scratch, FM_NEAR_REACH, 4, bits);
    static_assert(FM_NEAR_SIDE + 4 == FM_SDF_HEADER_BYTES, "the side is cleared with the bits behind it");
    fm_commands_fill(j->gpu, slot, j->scratch, FM_NEAR_SIDE, l->entries - FM_NEAR_SIDE, 0);
}

// Which texels are inside, by the crossings of rows.
static fm_result record_crossings(fm_sdf_job *j, fm_slot *slot, const near_layout *l) {
    const fm_voxelize_job job = {.mesh = j->push.mesh,
                                 .grid = texel_grid(j->plan),
                                 .bits = true,
                                 .voxels = j->scratch,
                                 .voxels_at = l->inside,
                                 .lists = j->scratch,
                                 .lists_at = l->lists};
    j->push.moments = j->push.scratch + l->inside;
    fm_commands_fill(j->gpu, slot, j->scratch, l->inside, l->counts - l->inside, 0);
    return fm_gpu_voxelize_inside(j->gpu, slot, &job, l->counts, "sign");
}

fm_result fm_gpu_near_mark(fm_gpu *gpu, fm_slot *slot, fm_near_push *push, float reach, fm_buffer *lists, uint64_t lists_at) {
    for (int axis = 0; axis < 3; axis++) {
        push->reach[axis] = reach * push->grid.scale[axis];
    }
    uint32_t constants[] = {false};
    const fm_triangle_work work = {.small = FM_KERNEL_MESH_NEAR,
                                   .large = FM_KERNEL_MESH_NEAR_LARGE,
                                   .constants = constants,
                                   .constant_count = 1,
                                   .push = push,
                                   .push_bytes = sizeof *push,
                                   .triangle_count = push->mesh.triangle_count,
                                   .lists = lists,
                                   .lists_at = lists_at};
    return fm_gpu_triangles(gpu, slot, &work);
}

static fm_result record_near(const fm_sdf_job *j, fm_slot *slot, const near_layout *l) {
    fm_near_push push = {.mesh = j->push.mesh,
                         .bits = j->push.scratch + FM_SDF_HEADER_BYTES,
                         .lists = j->push.scratch + l->lists,
                         .grid = block_grid(j->plan, l->blocks),
                         .row_words = (uint32_t)l->row_words};
    return fm_gpu_near_mark(j->gpu, slot, &push, (float)mark_reach(j->plan), j->scratch, l->lists);
}

static fm_result dispatch(const fm_sdf_job *j, fm_slot *slot, fm_kernel kernel, uint64_t groups) {
    const fm_dispatch d = {.kernel = kernel,
                           .constants = j->constants,
                           .constant_count = 3,
                           .push = &j->push,
                           .push_bytes = sizeof j->push,
                           .groups = groups,
                           .indirect = groups > 0 ? NULL : j->scratch,
                           .indirect_offset = FM_NEAR_LIST + 4};
    return fm_commands_dispatch(j->gpu, slot, &d);
}

// Groups of the kernel that fills.
static uint64_t tiles(fm_shape shape) {
    return fm_div_up(shape.x, 32) * fm_div_up(shape.y, 16) * fm_div_up(shape.z, 2);
}

// Which near blocks are left, and what is known where there are none.
static fm_result record_summary(const fm_sdf_job *j, fm_slot *slot, const near_layout *l) {
    if (j->constants[0] != FM_SDF_PSEUDONORMAL && !is_flooded(j)) {
        return FM_OK;
    }
    FM_TRY(dispatch(j, slot, FM_KERNEL_MESH_NEAR_ROWS, fm_div_up((uint64_t)l->blocks.y * l->blocks.z, THREADS)));
    fm_commands_barrier(j->gpu, slot);
    const fm_shape shape = j->plan->shape;
    const uint64_t coarse =
        fm_div_up(shape.x, FM_SDF_COARSE) * fm_div_up(shape.y, FM_SDF_COARSE) * fm_div_up(shape.z, FM_SDF_COARSE);
    FM_TRY(dispatch(j, slot, FM_KERNEL_MESH_NEAR_SIDE, is_flooded(j) ? fm_div_up(coarse, THREADS) : 1));
    fm_commands_barrier(j->gpu, slot);
    return FM_OK;
}

static fm_result record_step(const fm_sdf_job *j, fm_slot *slot, const near_layout *l, uint32_t step, uint32_t from) {
    const uint64_t cells = j->push.scratch + l->cells;
    const fm_voxel_grid grid = block_grid(j->plan, l->blocks);
    fm_near_flood_push push = {.source = cells + from * cell_bytes(l->blocks),
                               .target = cells + (1 - from) * cell_bytes(l->blocks),
                               .step = (int32_t)step};
    for (int axis = 0; axis < 3; axis++) {
        push.shape[axis] = grid.shape[axis];
        push.spacing[axis] = (float)(FM_SDF_MIDDLE * j->plan->spacing[axis]);
        push.origin[axis] = (float)(j->plan->origin[axis] + 0.5 * (FM_SDF_MIDDLE - 1) * j->plan->spacing[axis]);
    }
    const fm_dispatch d = {.kernel = FM_KERNEL_MESH_NEAR_FLOOD,
                           .push = &push,
                           .push_bytes = sizeof push,
                           .groups = fm_div_up(fm_voxels(l->blocks), THREADS)};
    FM_TRY(fm_commands_dispatch(j->gpu, slot, &d));
    fm_commands_barrier(j->gpu, slot);
    return FM_OK;
}

// From the longest step that fits down to 1, then 1 again, which mends most of what jumps over cells miss. Returns in the job's
// constants which array has the result.
static fm_result record_flood(fm_sdf_job *j, fm_slot *slot, const near_layout *l) {
    const uint32_t longest = (uint32_t)fm_max_u64(l->blocks.x, fm_max_u64(l->blocks.y, l->blocks.z));
    uint32_t from = 0, steps = 0;
    for (uint32_t step = longest > 1 ? fm_floor_power_of_two(longest - 1) : 0; step > 0; step /= 2, steps++) {
        FM_TRY(record_step(j, slot, l, step, from));
        from = 1 - from;
    }
    if (steps > 0) {
        FM_TRY(record_step(j, slot, l, 1, from));
        from = 1 - from;
    }
    j->constants[2] = from;
    fm_commands_pass(j->gpu, slot, "flood", (steps + 1) * 2 * cell_bytes(l->blocks));
    return FM_OK;
}

fm_result fm_gpu_near_record(fm_sdf_job *j, fm_slot *slot) {
    const near_layout l = layout_of(j);
    const uint64_t mesh_bytes = 12 * ((uint64_t)j->push.mesh.triangle_count + j->push.mesh.vertex_count);
    const uint64_t bit_bytes = l.slices - FM_SDF_HEADER_BYTES;
    record_header(j, slot, &l);
    if (is_flooded(j)) {
        fm_commands_fill(j->gpu, slot, j->scratch, l.cells, cell_bytes(l.blocks), FM_GPU_NONE);
    }
    if (j->constants[0] == FM_SDF_CROSSINGS) {
        FM_TRY(record_crossings(j, slot, &l));
    }
    FM_TRY(record_near(j, slot, &l));
    fm_commands_barrier(j->gpu, slot);
    FM_TRY(dispatch(j, slot, FM_KERNEL_MESH_NEAR_LIST, fm_div_up(bit_bytes / 4, THREADS)));
    fm_commands_pass(j->gpu, slot, "near", mesh_bytes + 2 * bit_bytes);
    const bool exact = j->plan->far_texels == FM_FAR_EXACT;
    FM_TRY(dispatch(j, slot,
                    exact           ? FM_KERNEL_MESH_NEAR_ALL
                    : is_flooded(j) ? FM_KERNEL_MESH_NEAR_FLOODED
                                    : FM_KERNEL_MESH_NEAR_TEXELS,
                    0));
    fm_commands_pass(j->gpu, slot, "nearest", 0);
    FM_TRY(record_summary(j, slot, &l));
    if (is_flooded(j)) {
        FM_TRY(record_flood(j, slot, &l));
    }
    FM_TRY(exact ? dispatch(j, slot, FM_KERNEL_MESH_NEAR_FAR, fm_voxels(l.blocks))
                 : dispatch(j, slot, FM_KERNEL_MESH_NEAR_FILL, tiles(j->plan->shape)));
    fm_commands_pass(j->gpu, slot, exact ? "far" : "fill", fm_voxels(j->plan->shape) * j->texel_bytes);
    return FM_OK;
}
