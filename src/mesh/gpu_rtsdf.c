// SPDX-License-Identifier: MIT
// RTSDF on Vulkan: a frame is one submission.

#include "mesh/gpu_mesh.h"
#include "mesh/gpu_voxelize.h"
#include "mesh/rtsdf.h"

#include <string.h>

struct fm_gpu_rtsdf {
    fm_gpu *gpu;
    fm_buffer *bits;
    fm_buffer *seeds;
    fm_buffer *lists;  // for meshes of up to `triangles`
    uint64_t triangles;
};

// Texels of a work group.
static const int flood_tile[3] = {32, 2, 2}, trace_tile[3] = {8, 4, 2};

fm_result fm_gpu_rtsdf_create(fm_rtsdf *rtsdf) {
    fm_gpu *gpu = rtsdf->context->gpu;
    rtsdf->gpu = fm_alloc_zero(&rtsdf->context->allocator, sizeof *rtsdf->gpu, "an RTSDF on the device");
    if (!rtsdf->gpu) {
        return FM_ERROR_OUT_OF_HOST_MEMORY;
    }
    rtsdf->gpu->gpu = gpu;
    FM_TRY(fm_buffer_create(gpu, FM_PURPOSE_UPDATE, fm_rtsdf_bits_bytes(rtsdf), false, &rtsdf->gpu->bits));
    return fm_buffer_create(gpu, FM_PURPOSE_UPDATE, fm_rtsdf_seed_bytes(rtsdf), false, &rtsdf->gpu->seeds);
}

void fm_gpu_rtsdf_destroy(fm_rtsdf *rtsdf) {
    fm_gpu_rtsdf *own = rtsdf->gpu;
    if (!own) {
        return;
    }
    // A device that is lost has nothing in flight.
    (void)fm_gpu_wait(own->gpu, fm_gpu_newest(own->gpu));
    fm_buffer_destroy(own->bits);
    fm_buffer_destroy(own->seeds);
    fm_buffer_destroy(own->lists);
    fm_free(&rtsdf->context->allocator, own, sizeof *own);
    rtsdf->gpu = NULL;
}

// Work lists for the mesh.
static fm_result reserve(fm_gpu_rtsdf *own, uint64_t triangles) {
    if (own->lists && triangles <= own->triangles) {
        return FM_OK;
    }
    fm_buffer *lists;
    FM_TRY(fm_buffer_create(own->gpu, FM_PURPOSE_UPDATE, fm_voxelize_list_bytes(triangles), false, &lists));
    const fm_result status = fm_gpu_wait(own->gpu, fm_gpu_newest(own->gpu));
    if (status != FM_OK) {
        fm_buffer_destroy(lists);
        return status;
    }
    fm_buffer_destroy(own->lists);
    own->lists = lists;
    own->triangles = triangles;
    return FM_OK;
}

static uint64_t groups_of(fm_shape shape, const int tile[3]) {
    return fm_div_up(shape.x, (uint64_t)tile[0]) * fm_div_up(shape.y, (uint64_t)tile[1]) * fm_div_up(shape.z, (uint64_t)tile[2]);
}

// Seeds go to and fro between their own memory and the coarse field's, so that the last step, which writes that, reads the other.
static fm_result record_flood(const fm_rtsdf *rtsdf, fm_slot *slot) {
    const fm_gpu_rtsdf *own = rtsdf->gpu;
    const fm_shape shape = rtsdf->coarse->desc.shape;
    const fm_address places[2] = {fm_buffer_address(rtsdf->coarse->buffer), fm_buffer_address(own->seeds)};
    fm_flood_push push = {.bits = fm_buffer_address(own->bits),
                          .shape = {(int)shape.x, (int)shape.y, (int)shape.z},
                          .row_words = fm_bits_row_words(shape),
                          .unit = rtsdf->unit,
                          .beta = rtsdf->beta};
    memcpy(push.weight, rtsdf->weight, sizeof push.weight);
    const bool cubes = push.weight[0] == 1 && push.weight[1] == 1 && push.weight[2] == 1;
    for (int i = 0; i < rtsdf->step_count; i++) {
        const int left = rtsdf->step_count - 1 - i;
        const uint32_t constants[] = {i == 0, left == 0, cubes};
        push.step = rtsdf->steps[i];
        push.source = push.target;
        push.target = places[left % 2];
        const fm_dispatch dispatch = {.kernel = FM_KERNEL_RTSDF_FLOOD,
                                      .constants = constants,
                                      .constant_count = 3,
                                      .push = &push,
                                      .push_bytes = sizeof push,
                                      .groups = groups_of(shape, flood_tile)};
        if (i > 0) {
            fm_commands_barrier(own->gpu, slot);
        }
        FM_TRY(fm_commands_dispatch(own->gpu, slot, &dispatch));
    }
    fm_commands_pass(own->gpu, slot, "flood", fm_rtsdf_flood_bytes(rtsdf));
    return FM_OK;
}

static fm_result record_trace(const fm_rtsdf *rtsdf, const fm_mesh *mesh, fm_slot *slot) {
    const fm_shape shape = rtsdf->coarse->desc.shape;
    fm_trace_push push = {.mesh = fm_gpu_mesh_refs(mesh),
                          .coarse = fm_buffer_address(rtsdf->coarse->buffer),
                          .fine = fm_buffer_address(rtsdf->fine->buffer),
                          .shape = {(int)shape.x, (int)shape.y, (int)shape.z},
                          .mask = rtsdf->mask,
                          .alpha = rtsdf->alpha,
                          .bias = rtsdf->bias,
                          .frame = rtsdf->frame,
                          .seed = rtsdf->seed,
                          .rays = rtsdf->rays,
                          .first = rtsdf->frame == 0};
    memcpy(push.origin, rtsdf->origin, sizeof push.origin);
    memcpy(push.spacing, rtsdf->spacing, sizeof push.spacing);
    const fm_dispatch dispatch = {.kernel = FM_KERNEL_RTSDF_TRACE,
                                  .push = &push,
                                  .push_bytes = sizeof push,
                                  .groups = groups_of(rtsdf->fine->desc.shape, trace_tile)};
    FM_TRY(fm_commands_dispatch(rtsdf->gpu->gpu, slot, &dispatch));
    fm_commands_pass(rtsdf->gpu->gpu, slot, "trace", fm_rtsdf_trace_bytes(rtsdf));
    return FM_OK;
}

static fm_result record(const fm_rtsdf *rtsdf, fm_mesh *mesh, fm_slot *slot) {
    const fm_gpu_rtsdf *own = rtsdf->gpu;
    if (rtsdf->rays > 0) {
        FM_TRY(fm_gpu_mesh_tree(mesh, slot, true));
    }
    const fm_voxelize_job voxels = {
        .mesh = fm_gpu_mesh_refs(mesh), .grid = rtsdf->grid, .thin = true, .bits = true, .voxels = own->bits, .lists = own->lists};
    FM_TRY(fm_gpu_voxelize_surface(own->gpu, slot, &voxels));
    fm_commands_pass(own->gpu, slot, "voxelize", fm_voxelize_bytes(&voxels));
    FM_TRY(record_flood(rtsdf, slot));
    return record_trace(rtsdf, mesh, slot);
}

fm_result fm_gpu_rtsdf_update(fm_rtsdf *rtsdf, fm_mesh *mesh, fm_ticket *ticket) {
    fm_gpu *gpu = rtsdf->gpu->gpu;
    fm_slot *slot;
    FM_TRY(reserve(rtsdf->gpu, mesh->triangle_count));
    FM_TRY(fm_commands_begin(gpu, &slot));
    fm_result status = record(rtsdf, mesh, slot);
    if (status == FM_OK) {
        status = fm_commands_submit(gpu, slot, ticket);
    }
    if (status != FM_OK) {
        fm_gpu_mesh_forget(mesh);
    }
    return status;
}
