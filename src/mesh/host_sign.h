// SPDX-License-Identifier: MIT
#ifndef FM_HOST_SIGN_H
#define FM_HOST_SIGN_H

// Which texels of a field lie inside. The fields hold distances within the band and +infinity, without meaning, beyond; inner
// texels become negative.

#include "mesh/grid.h"

// Texels beyond the band get the sign of those within whose region they are in: no two neighbours on both sides of the band's
// edge have the surface between them, for the band is at least a voxel wide. False where no texel was within the band.
fm_result fm_sign_spread(fm_context *context, const fm_grid *grid, float *distance, bool *known);

// Negative where the winding number is above 1/2. `band` in world units.
fm_result fm_sign_winding(fm_mesh *mesh, const fm_grid *grid, double band, float *distance);

#endif
