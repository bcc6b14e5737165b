// SPDX-License-Identifier: MIT
// Nearest triangles as published: each proposes itself to the corners around it, then corners take over their neighbours' triangles
// where these are nearer. Source: Demir and Westermann 2015, section 3.1.

#include "octree/build.h"

fm_result fm_octree_fields_grown(fm_octree_build *build) {
    (void)build;
    return fm_fail(FM_ERROR_UNSUPPORTED, "FM_OCTREE_GROWN is not built yet: choose FM_OCTREE_EXACT");
}
