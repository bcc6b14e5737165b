// SPDX-License-Identifier: MIT
#ifndef FM_GPU_MESH_H
#define FM_GPU_MESH_H

// Meshes on the device: their arrays, their tree, and the queries. In a build without Vulkan gpu_none.c answers.

#include "gpu/compute.h"
#include "mesh/mesh.h"
#include "shaders/include/mesh_shared.h"

// Buffers for arrays and tree, and the arrays uploaded.
fm_result fm_gpu_mesh_create(fm_mesh *mesh);
// Waits for work in flight that reads it.
void fm_gpu_mesh_destroy(fm_mesh *mesh);
// New positions from the host's array. The caller raises the mesh's version.
fm_result fm_gpu_mesh_upload(fm_mesh *mesh);

// Records what makes the tree fit the present positions, if it does not: a build, or with `refit` and a tree that is not older than
// the mesh's `rebuild_version` a refit. Ends passes "tree". What is recorded afterwards may walk the tree. When the slot is not
// submitted after all, call fm_gpu_mesh_forget.
fm_result fm_gpu_mesh_tree(fm_mesh *mesh, fm_slot *slot, bool refit);
// What was recorded for the mesh never ran: its tree and whatever follows from it is to be made anew.
void fm_gpu_mesh_forget(fm_mesh *mesh);
// Where kernels find the mesh. Its vertices and triangles are valid always, its tree once it has been recorded.
fm_mesh_refs fm_gpu_mesh_refs(const fm_mesh *mesh);

// Address of the vertices, which kernels may write (scenes): call fm_gpu_mesh_touch when that has been recorded.
uint64_t fm_gpu_mesh_vertices(const fm_mesh *mesh);
// The positions on the device have changed, and no longer are those of the host.
void fm_gpu_mesh_touch(fm_mesh *mesh);

fm_result fm_gpu_mesh_closest(fm_mesh *mesh, const float (*positions)[3], uint32_t count, float bound, fm_closest *closest);
fm_result fm_gpu_mesh_cast(fm_mesh *mesh, const fm_mesh_ray *rays, uint32_t count, bool any, fm_mesh_hit *hits);
fm_result fm_gpu_mesh_winding(fm_mesh *mesh, const float (*positions)[3], uint32_t count, float accuracy, float *winding);

#endif
