// SPDX-License-Identifier: MIT
#include "mesh/sdf.h"

fm_result fm_host_sdf(fm_mesh *mesh, const fm_sdf_plan *plan, fm_volume *distance, fm_volume *triangles) {
    (void)mesh, (void)plan, (void)distance, (void)triangles;
    return fm_fail(FM_ERROR_UNSUPPORTED, "fields of meshes are not computed on the CPU yet");
}
