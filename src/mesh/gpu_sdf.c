// SPDX-License-Identifier: MIT
// Fields of meshes on Vulkan: what they all need, and those with winding numbers of an open mesh, where the surface alone does not
// tell the side. Blocks of 16^3 texels, blocks of 4^3 within those that matter, texels within those that do, and all others at
// once. The lists lie on the device; the host waits for nothing. The other fields are those of gpu_near.c.

#include "mesh/gpu_sdf.h"

#include <string.h>

enum { THREADS = 64, PIECE = 256 };

static void place_grid(const fm_sdf_plan *plan, fm_sdf_push *push) {
    for (int axis = 0; axis < 3; axis++) {
        push->origin[axis] = (float)plan->origin[axis];
        push->origin_rest[axis] = (float)(plan->origin[axis] - (double)push->origin[axis]);
        push->spacing[axis] = (float)plan->spacing[axis];
        push->spacing_rest[axis] = (float)(plan->spacing[axis] - (double)push->spacing[axis]);
    }
    push->size_xy = plan->shape.x | plan->shape.y << 16;
    push->size_z = plan->shape.z;
}

static uint64_t blocks_along(uint32_t size) {
    return fm_div_up(size, FM_SDF_COARSE);
}

static uint64_t coarse_blocks(fm_shape shape) {
    return blocks_along(shape.x) * blocks_along(shape.y) * blocks_along(shape.z);
}

static fm_result record_level(const fm_sdf_job *j, fm_slot *slot, fm_kernel kernel, uint32_t edge, uint64_t groups, uint32_t list) {
    const uint32_t constants[] = {j->constants[0], j->constants[1], edge};
    const fm_dispatch dispatch = {.kernel = kernel,
                                  .constants = constants,
                                  .constant_count = 3,
                                  .push = &j->push,
                                  .push_bytes = sizeof j->push,
                                  .groups = groups,
                                  .indirect = groups > 0 ? NULL : j->scratch,
                                  .indirect_offset = list + 4};
    return fm_commands_dispatch(j->gpu, slot, &dispatch);
}

static void record_header(const fm_sdf_job *j, fm_slot *slot) {
    static const uint32_t empty[] = {FM_LIST_EMPTY};
    for (uint32_t i = 0; i < 8; i++) {
        fm_commands_fill(j->gpu, slot, j->scratch, FM_SDF_LIST_COARSE + 4 * i, 4, empty[i % 4]);
    }
    uint32_t band;
    memcpy(&band, &j->plan->band, sizeof band);
    fm_commands_fill(j->gpu, slot, j->scratch, FM_SDF_BAND, 4, band);
    fm_commands_barrier(j->gpu, slot);
}

static fm_result record(const fm_sdf_job *j, fm_slot *slot) {
    const fm_shape shape = j->plan->shape;
    const uint64_t coarse = coarse_blocks(shape);
    record_header(j, slot);
    FM_TRY(record_level(j, slot, FM_KERNEL_MESH_SDF_BLOCKS, FM_SDF_COARSE, fm_div_up(coarse, THREADS), 0));
    fm_commands_barrier(j->gpu, slot);
    FM_TRY(record_level(j, slot, FM_KERNEL_MESH_SDF_BLOCKS, FM_SDF_MIDDLE, 0, FM_SDF_LIST_COARSE));
    fm_commands_pass(j->gpu, slot, "blocks", coarse * 16);
    // These two write different texels.
    FM_TRY(
        record_level(j, slot, FM_KERNEL_MESH_SDF_FILL, FM_SDF_COARSE, fm_div_up(shape.x, PIECE) * (uint64_t)shape.y * shape.z, 0));
    FM_TRY(record_level(j, slot, FM_KERNEL_MESH_SDF_TEXELS, FM_SDF_COARSE, 0, FM_SDF_LIST_MIDDLE));
    fm_commands_pass(j->gpu, slot, "nearest", fm_voxels(shape) * j->texel_bytes);
    return FM_OK;
}

// What the kernels look at besides the tree.
static fm_result prepare_sign(fm_sdf_job *j) {
    if (j->plan->sign == FM_SIGN_NONE) {
        return FM_OK;
    }
    FM_TRY(fm_gpu_mesh_joints(j->mesh));
    const fm_mesh_info *info = &j->mesh->topology->info;
    if (j->plan->sign == FM_SIGN_PSEUDONORMAL) {
        j->constants[0] = FM_SDF_PSEUDONORMAL;
        return FM_OK;
    }
    // Closed meshes have whole winding numbers, which crossings count.
    j->constants[0] = info->closed && info->dropped == 0 ? FM_SDF_CROSSINGS : FM_SDF_WINDING;
    return FM_OK;
}

static fm_result record_mesh(fm_sdf_job *j, fm_slot *slot, bool near) {
    fm_mesh *mesh = j->mesh;
    FM_TRY(fm_gpu_mesh_tree(mesh, slot, true));
    if (j->constants[0] == FM_SDF_PSEUDONORMAL) {
        FM_TRY(fm_gpu_mesh_normals(mesh, slot));
    } else if (j->constants[0] == FM_SDF_WINDING) {
        FM_TRY(fm_gpu_mesh_moments(mesh, slot));
        j->push.moments = fm_buffer_address(mesh->gpu->moments);
    }
    j->push.mesh = fm_gpu_mesh_refs(mesh);
    j->push.joints = mesh->gpu->joints ? fm_buffer_address(mesh->gpu->joints) : 0;
    return near ? fm_gpu_near_record(j, slot) : record(j, slot);
}

fm_result fm_gpu_mesh_sdf(fm_mesh *mesh, const fm_sdf_plan *plan, fm_volume *distance, fm_volume *triangles, fm_ticket *ticket) {
    fm_sdf_job j = {.mesh = mesh,
                    .plan = plan,
                    .gpu = mesh->gpu->gpu,
                    .texel_bytes = triangles ? 8 : 4,
                    .constants = {FM_SDF_UNSIGNED, (uint32_t)plan->far_texels, 0}};
    FM_TRY(prepare_sign(&j));
    const bool near = j.constants[0] != FM_SDF_WINDING;
    // A state for each block, a list entry likewise.
    const uint64_t bytes = near ? fm_gpu_near_bytes(&j) : FM_SDF_HEADER_BYTES + coarse_blocks(plan->shape) * (65 * 16 + 65 * 4);
    FM_TRY(fm_gpu_scratch(j.gpu, bytes, &j.push.scratch));
    j.scratch = fm_gpu_scratch_buffer(j.gpu);
    j.push.distance = fm_buffer_address(distance->buffer);
    j.push.triangles = triangles ? fm_buffer_address(triangles->buffer) : 0;
    place_grid(plan, &j.push);
    fm_slot *slot;
    FM_TRY(fm_commands_begin(j.gpu, &slot));
    fm_result status = record_mesh(&j, slot, near);
    if (status == FM_OK) {
        status = fm_commands_submit(j.gpu, slot, ticket);
    }
    if (status != FM_OK) {
        fm_gpu_mesh_forget(mesh);
    }
    return status;
}
