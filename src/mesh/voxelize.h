// SPDX-License-Identifier: MIT
#ifndef FM_VOXELIZE_H
#define FM_VOXELIZE_H

#include "fathom/sdf.h"
#include "mesh/mesh.h"
#include "volume/volume.h"

// The arguments have been checked: type and where the voxels lie. The volume's spacing and origin place the grid.
fm_result fm_host_voxelize(fm_mesh *mesh, const fm_voxelize_desc *desc, fm_volume *voxels);
fm_result fm_gpu_mesh_voxelize(fm_mesh *mesh, const fm_voxelize_desc *desc, fm_volume *voxels, fm_ticket *ticket);

#endif
