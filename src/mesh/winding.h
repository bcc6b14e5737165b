// SPDX-License-Identifier: MIT
#ifndef FM_WINDING_H
#define FM_WINDING_H

// Generalised winding numbers by moments of groups of triangles (Barill et al. 2018).

#include "mesh/mesh.h"

// Makes the moments for the present positions.
fm_result fm_winding_prepare(fm_mesh *mesh);
void fm_winding_destroy(fm_context *context, fm_winding *winding);
// `accuracy` as in fm_mesh_winding, resolved. May run on many threads at once.
float fm_winding_at(const fm_mesh *mesh, const float position[3], float accuracy);

#endif
