// SPDX-License-Identifier: MIT
#ifndef FM_APP_MEASURE_H
#define FM_APP_MEASURE_H

// What operations take: by the times of their passes, had without waiting for them, or by the clock.

#include "fathom/fathom.h"

enum { MEASURE_IN_FLIGHT = 8 };

typedef enum measure_kind { MEASURE_FIELD = 0, MEASURE_MARCH } measure_kind;

typedef struct measured {
    measure_kind kind;
    uint64_t frame;
    double milliseconds;
} measured;

typedef struct measure {
    struct {
        measured what;
        fm_ticket ticket;
        bool known;
    } waiting[MEASURE_IN_FLIGHT];
    uint32_t first, count;
    // Set where timestamps cannot be believed: Mesa's software driver takes them before the work where graphics shares the queue.
    bool by_clock;
    double begun_ms;  // ... by that clock
} measure;

// Measured by the clock, what is expected next begins now.
void measure_begin(measure *m);

// An operation has just been asked for; by the clock, it is waited for. Of more than MEASURE_IN_FLIGHT the oldest are forgotten.
void measure_expect(measure *m, fm_context *context, measure_kind kind, uint64_t frame, fm_ticket ticket);
// The oldest one that is complete, each once. `wait`: waits for the oldest. False when there is none.
bool measure_next(measure *m, fm_context *context, bool wait, measured *result);
void measure_forget(measure *m);

// Time of all passes of an operation, for which it waits. False when something failed, see fm_last_error, or its passes are not
// known any longer.
bool measure_ticket(fm_context *context, fm_ticket ticket, double *milliseconds);

#endif
