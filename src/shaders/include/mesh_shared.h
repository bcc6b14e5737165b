// SPDX-License-Identifier: MIT
#ifndef FM_MESH_SHARED_H
#define FM_MESH_SHARED_H

// What C and GLSL both know of meshes, by the rules of shared.h.

#include "shared.h"

// Where a mesh lies: vertices of three floats, triangles of three indices, the nodes of its tree.
FM_PUSH_STRUCT(fm_mesh_refs) {
    fm_address vertices;
    fm_address triangles;
    fm_address nodes;
    fm_uint triangle_count;
    fm_uint vertex_count;
};

#endif
