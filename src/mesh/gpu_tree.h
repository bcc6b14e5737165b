// SPDX-License-Identifier: MIT
#ifndef FM_GPU_TREE_H
#define FM_GPU_TREE_H

// What the device keeps of a mesh, for the drivers of its kernels (gpu_mesh.c, gpu_tree.c, gpu_query.c, gpu_normals.c).

#include "mesh/gpu_mesh.h"

struct fm_gpu_mesh {
    fm_gpu *gpu;
    fm_buffer *vertices, *triangles;
    fm_buffer *nodes;  // with the records behind them
    fm_buffer *build;  // what building and refitting need; laid out in gpu_tree.c
    // Versions of the mesh, each plus 1 so that 0 says that there is none, which the tree was last fitted to and last built for.
    uint64_t fitted, built;
    fm_buffer *moments;   // of the nodes, for winding numbers; made when first wanted
    uint64_t moments_of;  // version of the mesh, plus 1
    fm_buffer *joints;    // what is joined to what, and the corners' normals; made when first wanted
    uint64_t joints_of;   // edition of the topology
    uint64_t normals_of;  // version of the mesh, plus 1
    uint32_t positions;
    fm_buffer *questions;  // of the queries, which all wait; they grow with the longest
    fm_buffer *answers;
    uint64_t question_bytes, answer_bytes;
};

// Size of `build` for so many triangles.
uint64_t fm_gpu_tree_build_bytes(uint64_t triangles);

// Records the moments of the tree's nodes for the present positions, which the tree fits; ends passes "moments".
fm_result fm_gpu_mesh_moments(fm_mesh *mesh, fm_slot *slot);

// What is joined to what, for the device; worked out on the host, which waits, and again when other triangles are dropped.
fm_result fm_gpu_mesh_joints(fm_mesh *mesh);
// Records the normals of the joints' positions for the present vertices; ends passes "normals".
fm_result fm_gpu_mesh_normals(fm_mesh *mesh, fm_slot *slot);

#endif
