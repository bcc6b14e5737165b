// SPDX-License-Identifier: MIT
#include "mesh/bvh_layout.h"
#include "mesh/triangle.h"

#include <string.h>

static void free_arrays(fm_context *context, fm_bvh *bvh) {
    fm_mesh_free(context, bvh->nodes, bvh->node_room * sizeof *bvh->nodes);
    fm_mesh_free(context, bvh->leaves, bvh->leaf_room * sizeof *bvh->leaves);
}

void fm_bvh_destroy(fm_context *context, fm_bvh *bvh) {
    if (bvh) {
        free_arrays(context, bvh);
        fm_mesh_free(context, bvh, sizeof *bvh);
    }
}

static const fm_bvh_kernels *choose_kernels(void) {
#ifdef FM_X86_KERNELS
    if (fm_simd_best() >= FM_SIMD_AVX2) {
        return &fm_bvh_kernels_avx2;
    }
#endif
    return &fm_bvh_kernels_portable;
}

fm_result fm_bvh_prepare(fm_mesh *mesh) {
    fm_context *context = mesh->context;
    fm_bvh *bvh = mesh->bvh;
    if (bvh && bvh->version == mesh->version) {
        return FM_OK;
    }
    if (bvh && bvh->built_version >= mesh->rebuild_version && fm_bvh_refit(mesh, bvh)) {
        bvh->version = mesh->version;
        return FM_OK;
    }
    fm_bvh *made = fm_mesh_alloc_zero(context, sizeof *made, "a tree");
    if (!made) {
        return FM_ERROR_OUT_OF_HOST_MEMORY;
    }
    made->kernels = choose_kernels();
    const fm_result status = fm_bvh_build(mesh, made);
    if (status != FM_OK) {
        fm_bvh_destroy(context, made);
        return status;
    }
    made->version = made->built_version = mesh->version;
    fm_bvh_destroy(context, bvh);
    mesh->bvh = made;
    return FM_OK;
}

void fm_bvh_nearest(const fm_mesh *mesh, const float position[3], fm_nearest *nearest) {
    const fm_bvh *bvh = mesh->bvh;
    if (bvh->node_count == 0 || !fm_coordinate_fits(position[0]) || !fm_coordinate_fits(position[1]) ||
        !fm_coordinate_fits(position[2])) {
        return;
    }
    float distance2 = nearest->distance2;
    uint32_t triangle = FM_NO_TRIANGLE;
    bvh->kernels->nearest(bvh, position, &distance2, &triangle);
    if (triangle != FM_NO_TRIANGLE) {
        // Floats have found it, doubles measure it.
        const fm_nearest found = fm_triangle_nearest(mesh, triangle, position);
        if (found.distance2 < nearest->distance2) {
            *nearest = found;
        }
    }
}

fm_mesh_hit fm_bvh_cast(const fm_mesh *mesh, const fm_mesh_ray *ray, bool any) {
    if (mesh->bvh->node_count == 0) {
        return (fm_mesh_hit){.t = INFINITY, .triangle = FM_NO_TRIANGLE};
    }
    return mesh->bvh->kernels->cast(mesh, ray, any);
}

static bool overlaps(const fm_bvh_node *node, int lane, const float low[3], const float high[3]) {
    for (int axis = 0; axis < 3; axis++) {
        if (node->low[axis][lane] > high[axis] || node->high[axis][lane] < low[axis]) {
            return false;
        }
    }
    return true;
}

void fm_bvh_overlaps(const fm_mesh *mesh, const float low[3], const float high[3], fm_bvh_fn fn, void *user) {
    const fm_bvh *bvh = mesh->bvh;
    uint32_t stack[FM_BVH_STACK];
    int depth = 0;
    if (bvh->node_count > 0) {
        stack[depth++] = 0;
    }
    while (depth > 0) {
        const uint32_t here = stack[--depth];
        const fm_bvh_leaf *leaf = &bvh->leaves[here & ~FM_BVH_LEAF];
        for (int lane = 0; lane < FM_BVH_WIDTH; lane++) {
            if (!(here & FM_BVH_LEAF)) {
                if (overlaps(&bvh->nodes[here], lane, low, high)) {
                    stack[depth++] = bvh->nodes[here].child[lane];
                }
            } else if (lane == 0 || leaf->triangle[lane] != leaf->triangle[lane - 1]) {
                fn(user, leaf->triangle[lane]);
            }
        }
    }
}
