// SPDX-License-Identifier: MIT
// A mesh's memory on Vulkan.

#include "mesh/gpu_tree.h"

static uint64_t at_least_one(uint64_t bytes) {
    return bytes > 0 ? bytes : 16;
}

static uint64_t nodes_bytes(const fm_mesh *mesh) {
    return fm_max_u64(mesh->triangle_count, 1) * (FM_NODE_BYTES + FM_RECORD_BYTES);
}

static fm_result create_buffers(const fm_mesh *mesh, struct fm_gpu_mesh *own) {
    fm_gpu *gpu = own->gpu;
    const uint64_t triangles = mesh->triangle_count;
    FM_TRY(
        fm_buffer_create(gpu, FM_PURPOSE_MESHES, at_least_one(mesh->vertex_count * sizeof *mesh->vertices), false, &own->vertices));
    FM_TRY(fm_buffer_create(gpu, FM_PURPOSE_MESHES, at_least_one(triangles * sizeof *mesh->triangles), false, &own->triangles));
    FM_TRY(fm_buffer_create(gpu, FM_PURPOSE_MESHES, nodes_bytes(mesh), false, &own->nodes));
    FM_TRY(fm_buffer_create(gpu, FM_PURPOSE_MESHES, fm_gpu_tree_build_bytes(triangles), false, &own->build));
    if (triangles > 0) {
        FM_TRY(fm_buffer_upload_at(own->triangles, 0, mesh->triangles, triangles * sizeof *mesh->triangles));
    }
    return FM_OK;
}

fm_result fm_gpu_mesh_create(fm_mesh *mesh) {
    fm_context *context = mesh->context;
    mesh->gpu = fm_alloc_zero(&context->allocator, sizeof *mesh->gpu, "a mesh on the device");
    if (!mesh->gpu) {
        return FM_ERROR_OUT_OF_HOST_MEMORY;
    }
    mesh->gpu->gpu = context->gpu;
    fm_result status = create_buffers(mesh, mesh->gpu);
    if (status == FM_OK) {
        status = fm_gpu_mesh_upload(mesh);
    }
    if (status != FM_OK) {
        fm_gpu_mesh_destroy(mesh);
    }
    return status;
}

void fm_gpu_mesh_destroy(fm_mesh *mesh) {
    struct fm_gpu_mesh *own = mesh->gpu;
    if (!own) {
        return;
    }
    // A device that is lost has nothing in flight.
    (void)fm_gpu_wait(own->gpu, fm_gpu_newest(own->gpu));
    fm_buffer *buffers[] = {own->vertices, own->triangles, own->nodes,     own->build,
                            own->moments,  own->joints,    own->questions, own->answers};
    for (size_t i = 0; i < sizeof buffers / sizeof *buffers; i++) {
        fm_buffer_destroy(buffers[i]);
    }
    fm_free(&mesh->context->allocator, own, sizeof *own);
    mesh->gpu = NULL;
}

fm_result fm_gpu_mesh_upload(fm_mesh *mesh) {
    return mesh->vertex_count == 0
               ? FM_OK
               : fm_buffer_upload_at(mesh->gpu->vertices, 0, mesh->vertices, mesh->vertex_count * sizeof *mesh->vertices);
}

void fm_gpu_mesh_forget(fm_mesh *mesh) {
    struct fm_gpu_mesh *own = mesh->gpu;
    own->fitted = own->built = own->moments_of = own->normals_of = 0;
}

fm_mesh_refs fm_gpu_mesh_refs(const fm_mesh *mesh) {
    const struct fm_gpu_mesh *own = mesh->gpu;
    return (fm_mesh_refs){.vertices = fm_buffer_address(own->vertices),
                          .triangles = fm_buffer_address(own->triangles),
                          .nodes = fm_buffer_address(own->nodes),
                          .triangle_count = (uint32_t)mesh->triangle_count,
                          .vertex_count = (uint32_t)mesh->vertex_count};
}

uint64_t fm_gpu_mesh_vertices(const fm_mesh *mesh) {
    return fm_buffer_address(mesh->gpu->vertices);
}

void fm_gpu_mesh_touch(fm_mesh *mesh) {
    mesh->version++;
}
