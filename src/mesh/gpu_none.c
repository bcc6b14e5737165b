// SPDX-License-Identifier: MIT
// Meshes on the device of a build without Vulkan: calls that need one cannot be reached, for no fm_gpu exists.

#include "mesh/compose.h"
#include "mesh/gpu_mesh.h"
#include "mesh/gpu_scene.h"
#include "mesh/rtsdf.h"
#include "mesh/sdf.h"
#include "mesh/voxelize.h"

static fm_result unsupported(void) {
    return fm_fail(FM_ERROR_UNSUPPORTED, "this build of Fathom has no Vulkan backend (FATHOM_VULKAN=OFF)");
}

fm_result fm_gpu_mesh_create(fm_mesh *mesh) {
    (void)mesh;
    return unsupported();
}

void fm_gpu_mesh_destroy(fm_mesh *mesh) {
    (void)mesh;
}

fm_result fm_gpu_mesh_upload(fm_mesh *mesh) {
    (void)mesh;
    return unsupported();
}

uint64_t fm_gpu_mesh_vertices(const fm_mesh *mesh) {
    (void)mesh;
    return 0;
}

void fm_gpu_mesh_touch(fm_mesh *mesh) {
    (void)mesh;
}

fm_result fm_gpu_mesh_closest(fm_mesh *mesh, const float (*positions)[3], uint32_t count, float bound, fm_closest *closest) {
    (void)mesh, (void)positions, (void)count, (void)bound, (void)closest;
    return unsupported();
}

fm_result fm_gpu_mesh_cast(fm_mesh *mesh, const fm_mesh_ray *rays, uint32_t count, bool any, fm_mesh_hit *hits) {
    (void)mesh, (void)rays, (void)count, (void)any, (void)hits;
    return unsupported();
}

fm_result fm_gpu_mesh_winding(fm_mesh *mesh, const float (*positions)[3], uint32_t count, float accuracy, float *winding) {
    (void)mesh, (void)positions, (void)count, (void)accuracy, (void)winding;
    return unsupported();
}

fm_result fm_gpu_mesh_voxelize(fm_mesh *mesh, const fm_voxelize_desc *desc, fm_volume *voxels, fm_ticket *ticket) {
    (void)mesh, (void)desc, (void)voxels, (void)ticket;
    return unsupported();
}

fm_result fm_gpu_mesh_sdf(fm_mesh *mesh, const fm_sdf_plan *plan, fm_volume *distance, fm_volume *triangles, fm_ticket *ticket) {
    (void)mesh, (void)plan, (void)distance, (void)triangles, (void)ticket;
    return unsupported();
}

fm_result fm_gpu_rtsdf_create(fm_rtsdf *rtsdf) {
    (void)rtsdf;
    return unsupported();
}

void fm_gpu_rtsdf_destroy(fm_rtsdf *rtsdf) {
    (void)rtsdf;
}

fm_result fm_gpu_rtsdf_update(fm_rtsdf *rtsdf, fm_mesh *mesh, fm_ticket *ticket) {
    (void)rtsdf, (void)mesh, (void)ticket;
    return unsupported();
}

fm_result fm_gpu_scene_update(fm_scene *scene, fm_ticket *ticket) {
    (void)scene, (void)ticket;
    return unsupported();
}

void fm_gpu_scene_destroy(fm_scene *scene) {
    (void)scene;
}

fm_result fm_gpu_compose(fm_composed *composed, const fm_compose_work *work, fm_ticket *ticket) {
    (void)composed, (void)work, (void)ticket;
    return unsupported();
}

void fm_gpu_compose_destroy(fm_composed *composed) {
    (void)composed;
}
