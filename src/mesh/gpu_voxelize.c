// SPDX-License-Identifier: MIT
// Voxels of meshes on Vulkan: small triangles are done by an invocation each, which lists the others for a group or many each, in
// indirect dispatches. What is inside is counted in scratch memory, some slices of the grid at a time.

#include "mesh/gpu_voxelize.h"

#include "mesh/gpu_mesh.h"
#include "mesh/voxel_grid.h"
#include "mesh/voxelize.h"

#include <stdlib.h>

enum { THREADS = 64, LIST_STEP = 256 };

static const uint64_t count_budget = (uint64_t)1 << 30;

uint64_t fm_voxelize_list_bytes(uint64_t triangles) {
    return fm_round_up(FM_VOXELIZE_ENTRIES + 4 * triangles, LIST_STEP);
}

static uint64_t row_words(const fm_voxel_grid *grid) {
    return fm_div_up((uint64_t)grid->shape[0], 32);
}

static uint64_t rows(const fm_voxel_grid *grid) {
    return (uint64_t)grid->shape[1] * (uint64_t)grid->shape[2];
}

static uint64_t voxel_bytes(const fm_voxelize_job *job) {
    return rows(&job->grid) * (job->bits ? row_words(&job->grid) * 4 : (uint64_t)job->grid.shape[0]);
}

static uint64_t mesh_bytes(const fm_voxelize_job *job) {
    return 12 * (uint64_t)job->mesh.triangle_count + 12 * (uint64_t)job->mesh.vertex_count;
}

uint64_t fm_voxelize_bytes(const fm_voxelize_job *job) {
    return mesh_bytes(job) + voxel_bytes(job);
}

static fm_voxelize_push push_of(const fm_voxelize_job *job) {
    return (fm_voxelize_push){.mesh = job->mesh,
                              .voxels = fm_buffer_address(job->voxels) + job->voxels_at,
                              .lists = fm_buffer_address(job->lists) + job->lists_at,
                              .grid = job->grid,
                              .row_words = (uint32_t)row_words(&job->grid),
                              .z_end = (uint32_t)job->grid.shape[2]};
}

static void clear_lists(fm_gpu *gpu, fm_slot *slot, fm_buffer *lists, uint64_t at) {
    fm_commands_fill(gpu, slot, lists, at, FM_VOXELIZE_LARGE_GROUPS + 4, 0);
    fm_commands_fill(gpu, slot, lists, at + FM_VOXELIZE_LARGE_GROUPS + 4, 8, 1);
    fm_commands_fill(gpu, slot, lists, at + FM_VOXELIZE_HUGE_GROUPS, 4, 0);
    fm_commands_fill(gpu, slot, lists, at + FM_VOXELIZE_HUGE_GROUPS + 4, 8, 1);
}

fm_result fm_gpu_triangles(fm_gpu *gpu, fm_slot *slot, const fm_triangle_work *work) {
    uint32_t *parted = &work->constants[work->constant_count - 1];
    *parted = false;
    clear_lists(gpu, slot, work->lists, work->lists_at);
    fm_commands_barrier(gpu, slot);
    fm_dispatch next = {.kernel = work->small,
                        .constants = work->constants,
                        .constant_count = work->constant_count,
                        .push = work->push,
                        .push_bytes = work->push_bytes,
                        .groups = fm_div_up(work->triangle_count, THREADS)};
    if (next.groups == 0) {
        return FM_OK;
    }
    FM_TRY(fm_commands_dispatch(gpu, slot, &next));
    fm_commands_barrier(gpu, slot);
    next.kernel = work->large;
    next.indirect = work->lists;
    next.indirect_offset = work->lists_at + FM_VOXELIZE_LARGE_GROUPS;
    FM_TRY(fm_commands_dispatch(gpu, slot, &next));
    *parted = true;
    next.indirect_offset = work->lists_at + FM_VOXELIZE_HUGE_GROUPS;
    return fm_commands_dispatch(gpu, slot, &next);
}

// The triangles, whatever is asked of them: what they write to has been cleared.
static fm_result dispatch(fm_gpu *gpu, fm_slot *slot, const fm_voxelize_job *job, bool solid, const fm_voxelize_push *push) {
    uint32_t constants[] = {job->thin, job->bits, solid, false};
    const fm_triangle_work work = {.small = FM_KERNEL_VOXELIZE,
                                   .large = FM_KERNEL_VOXELIZE_LARGE,
                                   .constants = constants,
                                   .constant_count = 4,
                                   .push = push,
                                   .push_bytes = sizeof *push,
                                   .triangle_count = push->mesh.triangle_count,
                                   .lists = job->lists,
                                   .lists_at = job->lists_at};
    return fm_gpu_triangles(gpu, slot, &work);
}

fm_result fm_gpu_voxelize_surface(fm_gpu *gpu, fm_slot *slot, const fm_voxelize_job *job) {
    const fm_voxelize_push push = push_of(job);
    fm_commands_fill(gpu, slot, job->voxels, job->voxels_at, fm_round_up(voxel_bytes(job), 4), 0);
    return dispatch(gpu, slot, job, false, &push);
}

// Sets the voxels inside of slices z_begin ... z_end; counts of crossings take the lists' buffer from `counts_at` on.
static fm_result fill_slices(fm_gpu *gpu, fm_slot *slot, const fm_voxelize_job *job, uint64_t counts_at, uint32_t z_begin,
                             uint32_t z_end, const char *pass) {
    const uint32_t x = (uint32_t)job->grid.shape[0], y = (uint32_t)job->grid.shape[1];
    const uint64_t slab_rows = (uint64_t)y * (z_end - z_begin);
    const uint64_t counts = fm_buffer_address(job->lists) + counts_at;
    fm_voxelize_push push = push_of(job);
    push.voxels = counts;
    push.z_begin = z_begin;
    push.z_end = z_end;
    fm_commands_fill(gpu, slot, job->lists, counts_at, slab_rows * x * 4, 0);
    FM_TRY(dispatch(gpu, slot, job, true, &push));
    fm_commands_barrier(gpu, slot);
    const uint64_t voxels = fm_buffer_address(job->voxels) + job->voxels_at;
    const fm_voxel_fill_push fill = {counts, voxels, x, y, z_begin, z_end - z_begin, (uint32_t)row_words(&job->grid)};
    const uint32_t words = (uint32_t)fm_min_u64(row_words(&job->grid), THREADS);
    const uint32_t row_threads = fm_floor_power_of_two(words) * (fm_floor_power_of_two(words) < words ? 2 : 1);
    const uint32_t constants[] = {row_threads, job->bits};
    const fm_dispatch last = {.kernel = FM_KERNEL_VOXELIZE_FILL,
                              .constants = constants,
                              .constant_count = 2,
                              .push = &fill,
                              .push_bytes = sizeof fill,
                              .groups = fm_div_up(slab_rows, THREADS / row_threads)};
    FM_TRY(fm_commands_dispatch(gpu, slot, &last));
    fm_commands_pass(gpu, slot, pass,
                     mesh_bytes(job) + slab_rows * x * 8 + voxel_bytes(job) * (z_end - z_begin) / (uint64_t)job->grid.shape[2]);
    return FM_OK;
}

static uint64_t budget(void) {
    const char *wish = getenv("FATHOM_SCRATCH");
    return wish ? strtoull(wish, NULL, 10) : count_budget;
}

uint32_t fm_voxelize_slab(const fm_voxel_grid *grid, uint64_t *bytes) {
    const uint64_t slice_bytes = (uint64_t)grid->shape[0] * (uint64_t)grid->shape[1] * 4;
    const uint64_t slab = fm_max_u64(1, fm_min_u64(budget() / slice_bytes, (uint64_t)grid->shape[2]));
    *bytes = slab * slice_bytes;
    return (uint32_t)slab;
}

fm_result fm_gpu_voxelize_inside(fm_gpu *gpu, fm_slot *slot, const fm_voxelize_job *job, uint64_t counts_at, const char *pass) {
    const uint32_t depth = (uint32_t)job->grid.shape[2];
    uint64_t bytes;
    const uint32_t slab = fm_voxelize_slab(&job->grid, &bytes);
    for (uint32_t z = 0; z < depth; z += slab) {
        FM_TRY(fill_slices(gpu, slot, job, counts_at, z, (uint32_t)fm_min_u64((uint64_t)z + slab, depth), pass));
    }
    return FM_OK;
}

fm_result fm_gpu_mesh_voxelize(fm_mesh *mesh, const fm_voxelize_desc *desc, fm_volume *voxels, fm_ticket *ticket) {
    fm_gpu *gpu = mesh->context->gpu;
    const fm_shape shape = voxels->desc.shape;
    if (shape.x > FM_VOXEL_MOST || shape.y > FM_VOXEL_MOST || shape.z > FM_VOXEL_MOST) {
        return fm_fail(FM_ERROR_UNSUPPORTED, "voxels are %u x %u x %u: at most %d an axis on Vulkan", shape.x, shape.y, shape.z,
                       FM_VOXEL_MOST);
    }
    fm_voxelize_job job = {.grid = fm_voxel_grid_of(&voxels->desc),
                           .thin = desc->separation == FM_SEPARATION_6,
                           .bits = voxels->desc.type == FM_TYPE_BITS,
                           .voxels = voxels->buffer,
                           .mesh = fm_gpu_mesh_refs(mesh)};
    uint64_t slab_bytes;
    (void)fm_voxelize_slab(&job.grid, &slab_bytes);
    const uint64_t counts_at = fm_voxelize_list_bytes(job.mesh.triangle_count);
    uint64_t address;
    FM_TRY(fm_gpu_scratch(gpu, counts_at + (desc->solid ? slab_bytes : 0), &address));
    job.lists = fm_gpu_scratch_buffer(gpu);
    fm_slot *slot;
    FM_TRY(fm_commands_begin(gpu, &slot));
    FM_TRY(fm_gpu_voxelize_surface(gpu, slot, &job));
    fm_commands_pass(gpu, slot, "voxelize", fm_voxelize_bytes(&job));
    if (desc->solid) {
        FM_TRY(fm_gpu_voxelize_inside(gpu, slot, &job, counts_at, "fill"));
    }
    return fm_commands_submit(gpu, slot, ticket);
}
