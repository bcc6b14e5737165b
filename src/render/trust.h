// SPDX-License-Identifier: MIT
#ifndef FM_TRUST_H
#define FM_TRUST_H

// Which fields a ray may trust. Nothing but the public headers is needed here, for the painting program asks too.

#include "fathom/world.h"

// Whether distances by this method may be too great, so that a ray may pass through solid voxels. The errors and domains are those
// of world.h: all methods but the published jump flooding are exact within a domain, and only a halo takes what it does not know
// for air.
static inline bool fm_may_be_too_far(const fm_world_method *method) {
    const bool selective = method->algorithm == FM_WORLD_SELECTIVE;
    const fm_world_algorithm far = selective ? method->far_algorithm : method->algorithm;
    // SELECTIVE's EXACT stands for JFA_PUBLISHED there.
    const bool floods = far == FM_WORLD_JFA_PUBLISHED || (selective && far == FM_WORLD_EXACT);
    return floods || (method->chunk && method->border == FM_BORDER_HALO);
}

#endif
