// SPDX-License-Identifier: MIT
#include "measure.h"

#include "words.h"

enum { MAX_PASSES = 128 };

bool measure_ticket(fm_context *context, fm_ticket ticket, double *milliseconds) {
    fm_pass passes[MAX_PASSES];
    uint32_t count = MAX_PASSES;
    *milliseconds = 0;
    if (fm_ticket_passes(context, ticket, &count, passes) != FM_OK) {
        return false;
    }
    for (uint32_t i = 0; i < count; i++) {
        *milliseconds += passes[i].milliseconds;
    }
    return count > 0;
}

void measure_begin(measure *m) {
    m->begun_ms = fm_now_ms();
}

// Whether its time is known at once.
static bool time_now(const measure *m, fm_context *context, fm_ticket ticket, double *milliseconds) {
    if (!m->by_clock) {
        return measure_ticket(context, ticket, milliseconds);
    }
    const bool good = fm_wait(context, ticket) == FM_OK;
    *milliseconds = fm_now_ms() - m->begun_ms;
    return good;
}

void measure_forget(measure *m) {
    m->count = 0;
}

void measure_expect(measure *m, fm_context *context, measure_kind kind, uint64_t frame, fm_ticket ticket) {
    if (m->count == MEASURE_IN_FLIGHT) {
        m->first = (m->first + 1) % MEASURE_IN_FLIGHT;
        m->count--;
    }
    const uint32_t i = (m->first + m->count++) % MEASURE_IN_FLIGHT;
    m->waiting[i].what = (measured){.kind = kind, .frame = frame};
    m->waiting[i].ticket = ticket;
    // The CPU is done, and will know the times of its newest operation only.
    m->waiting[i].known = m->by_clock || fm_context_backend(context) == FM_BACKEND_CPU;
    if (m->waiting[i].known && !time_now(m, context, ticket, &m->waiting[i].what.milliseconds)) {
        m->count--;
    }
}

bool measure_next(measure *m, fm_context *context, bool wait, measured *result) {
    while (m->count > 0) {
        const uint32_t i = m->first;
        bool complete = m->waiting[i].known || wait;
        if (!complete && (fm_poll(context, m->waiting[i].ticket, &complete) != FM_OK || !complete)) {
            return false;
        }
        *result = m->waiting[i].what;
        m->first = (m->first + 1) % MEASURE_IN_FLIGHT;
        m->count--;
        if (m->waiting[i].known || measure_ticket(context, m->waiting[i].ticket, &result->milliseconds)) {
            return true;
        }
    }
    return false;
}
