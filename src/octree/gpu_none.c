// SPDX-License-Identifier: MIT
// Octrees on the device of a build without Vulkan: calls that need one cannot be reached, for no fm_gpu exists.

#include "octree/octree.h"

fm_result fm_gpu_octree_head(fm_octree *octree, uint64_t *address) {
    (void)octree;
    *address = 0;
    return fm_fail(FM_ERROR_UNSUPPORTED, "this build has no Vulkan");
}

bool fm_gpu_octree_builds(const fm_mesh *mesh, const fm_octree_desc *desc) {
    (void)mesh;
    (void)desc;
    return false;
}

fm_result fm_gpu_octree_build(fm_mesh *mesh, const fm_octree_desc *desc, const double low[3], const double high[3],
                              fm_octree **octree) {
    (void)mesh;
    (void)desc;
    (void)low;
    (void)high;
    *octree = NULL;
    return fm_fail(FM_ERROR_UNSUPPORTED, "this build has no Vulkan");
}

fm_result fm_gpu_octree_gather(fm_octree *octree, const fm_world *world, const fm_box *box, uint32_t *voxels) {
    (void)octree;
    (void)world;
    (void)box;
    (void)voxels;
    return fm_fail(FM_ERROR_UNSUPPORTED, "this build has no Vulkan");
}

void fm_gpu_octree_destroy(fm_octree *octree) {
    (void)octree;
}

fm_result fm_gpu_octree_cast(fm_octree *octree, const fm_mesh_ray *rays, uint32_t count, float epsilon, bool stepped,
                             fm_octree_hit *hits) {
    (void)octree;
    (void)rays;
    (void)count;
    (void)epsilon;
    (void)stepped;
    (void)hits;
    return fm_fail(FM_ERROR_UNSUPPORTED, "this build has no Vulkan");
}
