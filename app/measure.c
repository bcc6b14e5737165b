// SPDX-License-Identifier: MIT
#include "measure.h"

enum { MAX_PASSES = 1024 };

bool measure_newest(fm_context *context, double *milliseconds) {
    static fm_pass passes[MAX_PASSES];
    uint32_t count = MAX_PASSES;
    *milliseconds = 0;
    if (fm_context_passes(context, &count, passes) != FM_OK) {
        return false;
    }
    for (uint32_t i = 0; i < count; i++) {
        *milliseconds += passes[i].milliseconds;
    }
    return true;
}

bool measure_update(fm_context *context, fm_world *world, bool edited, fm_ticket *newest, double *milliseconds) {
    fm_ticket ticket;
    *milliseconds = 0;
    if (fm_world_update(world, &ticket) != FM_OK) {
        return false;
    }
    const bool works = edited || ticket != *newest;
    *newest = ticket;
    return !works || measure_newest(context, milliseconds);
}
