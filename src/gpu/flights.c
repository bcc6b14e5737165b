// SPDX-License-Identifier: MIT
#include "gpu/flights.h"

fm_result fm_flights_take(fm_flights *flights, fm_gpu *gpu, fm_purpose purpose, uint64_t bytes, fm_flight **result) {
    fm_flight *flight = &flights->all[flights->next];
    FM_TRY(fm_gpu_wait(gpu, flight->ticket));
    if (flight->bytes < bytes) {
        // What has grown once is likely to grow again.
        const uint64_t room = flight->bytes > 0 ? 2 * bytes : bytes;
        fm_buffer_destroy(flight->buffer);
        flight->buffer = NULL;
        flight->bytes = 0;
        FM_TRY(fm_buffer_create(gpu, purpose, room, false, &flight->buffer));
        flight->bytes = room;
    }
    *result = flight;
    return FM_OK;
}

void fm_flights_sent(fm_flights *flights, fm_ticket ticket) {
    flights->all[flights->next].ticket = ticket;
    flights->next = (flights->next + 1) % FM_FLIGHTS;
}

const fm_flight *fm_flights_newest(const fm_flights *flights) {
    return &flights->all[(flights->next + FM_FLIGHTS - 1) % FM_FLIGHTS];
}

void fm_flights_destroy(fm_flights *flights) {
    for (int i = 0; i < FM_FLIGHTS; i++) {
        fm_buffer_destroy(flights->all[i].buffer);
    }
    *flights = (fm_flights){0};
}
