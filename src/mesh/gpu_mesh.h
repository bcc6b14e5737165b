// SPDX-License-Identifier: MIT
#ifndef FM_GPU_MESH_H
#define FM_GPU_MESH_H

// Meshes on the device: their arrays, their tree, and the queries. In a build without Vulkan gpu_none.c answers.

#include "gpu/compute.h"
#include "mesh/mesh.h"
#include "shaders/include/mesh_shared.h"

// Buffers for arrays and tree, and the arrays uploaded.
fm_result fm_gpu_mesh_create(fm_mesh *mesh);
void fm_gpu_mesh_destroy(fm_mesh *mesh);
// New positions from the host's array.
fm_result fm_gpu_mesh_upload(fm_mesh *mesh);
// Records what makes the tree fit the present positions, if it does not: a build, or with `refit` and a tree there is a refit.
// Passes "tree".
fm_result fm_gpu_mesh_tree(fm_mesh *mesh, fm_slot *slot, bool refit);
// Where kernels find the mesh, valid once the tree has been recorded.
fm_mesh_refs fm_gpu_mesh_refs(const fm_mesh *mesh);
// Host and device agree on the vertices' buffer, so that kernels may write it (scenes): call fm_gpu_mesh_touch after.
uint64_t fm_gpu_mesh_vertices(const fm_mesh *mesh);
void fm_gpu_mesh_touch(fm_mesh *mesh);

fm_result fm_gpu_mesh_closest(fm_mesh *mesh, const float (*positions)[3], uint32_t count, float bound, fm_closest *closest);
fm_result fm_gpu_mesh_cast(fm_mesh *mesh, const fm_mesh_ray *rays, uint32_t count, bool any, fm_mesh_hit *hits);
fm_result fm_gpu_mesh_winding(fm_mesh *mesh, const float (*positions)[3], uint32_t count, float accuracy, float *winding);

#endif
