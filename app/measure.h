// SPDX-License-Identifier: MIT
#ifndef FM_APP_MEASURE_H
#define FM_APP_MEASURE_H

#include "fathom/world.h"

// What one run of passes took. False when something failed: see fm_last_error.

// Time of all passes of the context's newest operation, for which it waits.
bool measure_newest(fm_context *context, double *milliseconds);

// Updates a world, and waits and measures when that does something: always after edits, and when a moved focus asks for it.
// `newest` keeps the ticket of the world's newest update; 0 at first.
bool measure_update(fm_context *context, fm_world *world, bool edited, fm_ticket *newest, double *milliseconds);

#endif
