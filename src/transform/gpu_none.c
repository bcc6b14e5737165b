// SPDX-License-Identifier: MIT
// The Vulkan driver of transforms in a build without Vulkan. It cannot be reached, for no fm_gpu exists.

#include "transform/plan.h"

fm_result fm_gpu_transform(fm_context *context, const fm_plan *plan, const fm_volume *solid, fm_volume *distance, fm_volume *index,
                           fm_ticket *ticket) {
    (void)context, (void)plan, (void)solid, (void)distance, (void)index, (void)ticket;
    return fm_fail(FM_ERROR_UNSUPPORTED, "this build of Fathom has no Vulkan backend (FATHOM_VULKAN=OFF)");
}
