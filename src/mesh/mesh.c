// SPDX-License-Identifier: MIT
#include "mesh/mesh.h"

#include "mesh/bvh.h"
#include "mesh/gpu_mesh.h"
#include "mesh/topology.h"
#include "mesh/winding.h"

#include <inttypes.h>
#include <string.h>

static const uint64_t MOST_TRIANGLES = (UINT64_C(1) << 31) - 1;

void *fm_mesh_alloc(fm_context *context, uint64_t bytes, const char *what) {
    void *memory = fm_alloc(&context->allocator, bytes, what);
    if (memory) {
        fm_meter_add(&context->host[FM_PURPOSE_MESHES], bytes);
    }
    return memory;
}

void *fm_mesh_alloc_zero(fm_context *context, uint64_t bytes, const char *what) {
    void *memory = fm_mesh_alloc(context, bytes, what);
    if (memory) {
        memset(memory, 0, bytes);
    }
    return memory;
}

void fm_mesh_free(fm_context *context, void *memory, uint64_t bytes) {
    if (memory) {
        fm_free(&context->allocator, memory, bytes);
        fm_meter_remove(&context->host[FM_PURPOSE_MESHES], bytes);
    }
}

static fm_result check_desc(const fm_mesh_desc *desc) {
    if (desc->vertex_count > UINT32_MAX) {
        return fm_fail(FM_ERROR_INVALID_ARGUMENT, "vertex_count is %" PRIu64 ": at most %u", desc->vertex_count, UINT32_MAX);
    }
    if (desc->triangle_count > MOST_TRIANGLES) {
        return fm_fail(FM_ERROR_INVALID_ARGUMENT, "triangle_count is %" PRIu64 ": at most %" PRIu64, desc->triangle_count,
                       MOST_TRIANGLES);
    }
    if (desc->vertex_count > 0 && !desc->vertices) {
        return fm_fail(FM_ERROR_INVALID_ARGUMENT, "vertices is NULL with a vertex_count of %" PRIu64, desc->vertex_count);
    }
    if (desc->triangle_count > 0 && !desc->triangles) {
        return fm_fail(FM_ERROR_INVALID_ARGUMENT, "triangles is NULL with a triangle_count of %" PRIu64, desc->triangle_count);
    }
    for (uint64_t i = 0; i < desc->triangle_count; i++) {
        const uint32_t *corners = desc->triangles[i];
        for (int k = 0; k < 3; k++) {
            if (corners[k] >= desc->vertex_count) {
                return fm_fail(FM_ERROR_INVALID_ARGUMENT,
                               "corner %d of triangle %" PRIu64 " is vertex %u: there are %" PRIu64 " vertices", k, i, corners[k],
                               desc->vertex_count);
            }
        }
    }
    return FM_OK;
}

fm_result fm_mesh_create(fm_context *context, const fm_mesh_desc *desc, fm_mesh **result) {
    static const fm_mesh_desc empty = {0};
    desc = desc ? desc : &empty;
    if (!context || !result) {
        return fm_fail(FM_ERROR_INVALID_ARGUMENT, "%s is NULL", context ? "mesh" : "context");
    }
    FM_TRY(check_desc(desc));
    fm_mesh *mesh = fm_mesh_alloc_zero(context, sizeof *mesh, "a mesh");
    if (!mesh) {
        return FM_ERROR_OUT_OF_HOST_MEMORY;
    }
    mesh->context = context;
    mesh->vertex_count = desc->vertex_count;
    mesh->triangle_count = desc->triangle_count;
    mesh->vertices = fm_mesh_alloc(context, desc->vertex_count * sizeof *mesh->vertices, "a mesh's vertices");
    mesh->triangles = fm_mesh_alloc(context, desc->triangle_count * sizeof *mesh->triangles, "a mesh's triangles");
    if (!mesh->vertices || !mesh->triangles) {
        fm_mesh_destroy(mesh);
        return FM_ERROR_OUT_OF_HOST_MEMORY;
    }
    if (desc->vertex_count > 0) {
        memcpy(mesh->vertices, desc->vertices, desc->vertex_count * sizeof *mesh->vertices);
    }
    if (desc->triangle_count > 0) {
        memcpy(mesh->triangles, desc->triangles, desc->triangle_count * sizeof *mesh->triangles);
    }
    if (context->gpu) {
        const fm_result status = fm_gpu_mesh_create(mesh);
        if (status != FM_OK) {
            fm_mesh_destroy(mesh);
            return status;
        }
    }
    *result = mesh;
    return FM_OK;
}

void fm_mesh_destroy(fm_mesh *mesh) {
    if (!mesh) {
        return;
    }
    fm_context *context = mesh->context;
    fm_gpu_mesh_destroy(mesh);
    fm_bvh_destroy(context, mesh->bvh);
    fm_topology_destroy(mesh);
    fm_winding_destroy(context, mesh->winding);
    fm_mesh_free(context, mesh->vertices, mesh->vertex_count * sizeof *mesh->vertices);
    fm_mesh_free(context, mesh->triangles, mesh->triangle_count * sizeof *mesh->triangles);
    fm_mesh_free(context, mesh, sizeof *mesh);
}

// Another array takes the place of the old one, which is put back if the device does not take it.
static fm_result deform_device(fm_mesh *mesh, const float (*vertices)[3]) {
    fm_context *context = mesh->context;
    const uint64_t bytes = mesh->vertex_count * sizeof *mesh->vertices;
    float(*before)[3] = mesh->vertices;
    float(*after)[3] = fm_mesh_alloc(context, bytes, "a mesh's vertices");
    if (!after) {
        return FM_ERROR_OUT_OF_HOST_MEMORY;
    }
    memcpy(after, vertices, bytes);
    mesh->vertices = after;
    const fm_result status = fm_gpu_mesh_upload(mesh);
    mesh->vertices = status == FM_OK ? after : before;
    fm_mesh_free(context, status == FM_OK ? before : after, bytes);
    return status;
}

fm_result fm_mesh_deform(fm_mesh *mesh, const float (*vertices)[3], fm_tree tree) {
    if (!mesh) {
        return fm_fail(FM_ERROR_INVALID_ARGUMENT, "mesh is NULL");
    }
    if (!vertices && mesh->vertex_count > 0) {
        return fm_fail(FM_ERROR_INVALID_ARGUMENT, "vertices is NULL: %" PRIu64 " positions are needed", mesh->vertex_count);
    }
    if ((unsigned)tree > FM_TREE_REBUILD) {
        return fm_fail(FM_ERROR_INVALID_ARGUMENT, "tree is %d: one of FM_TREE_REFIT, FM_TREE_REBUILD", (int)tree);
    }
    if (mesh->vertex_count == 0) {
        return FM_OK;
    }
    if (mesh->gpu) {
        FM_TRY(deform_device(mesh, vertices));
    } else {
        memmove(mesh->vertices, vertices, mesh->vertex_count * sizeof *mesh->vertices);
    }
    mesh->version++;
    mesh->host_version++;
    if (tree == FM_TREE_REBUILD) {
        mesh->rebuild_version = mesh->version;
    }
    return FM_OK;
}

void fm_mesh_arrays(const fm_mesh *mesh, const float (**vertices)[3], uint64_t *vertex_count, const uint32_t (**triangles)[3],
                    uint64_t *triangle_count) {
    if (vertices) {
        *vertices = (const float(*)[3])mesh->vertices;
    }
    if (vertex_count) {
        *vertex_count = mesh->vertex_count;
    }
    if (triangles) {
        *triangles = (const uint32_t(*)[3])mesh->triangles;
    }
    if (triangle_count) {
        *triangle_count = mesh->triangle_count;
    }
}
