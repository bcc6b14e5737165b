// SPDX-License-Identifier: MIT
#include "mesh/flights.h"

fm_result fm_flights_take(fm_flights *flights, fm_gpu *gpu, uint64_t bytes, fm_flight **result) {
    fm_flight *flight = &flights->all[flights->next];
    FM_TRY(fm_gpu_wait(gpu, flight->ticket));
    if (flight->bytes < bytes) {
        fm_buffer_destroy(flight->upload);
        flight->upload = NULL;
        flight->bytes = 0;
        FM_TRY(fm_buffer_create(gpu, FM_PURPOSE_UPLOAD, 2 * bytes, false, &flight->upload));
        flight->bytes = 2 * bytes;
    }
    *result = flight;
    return FM_OK;
}

void fm_flights_sent(fm_flights *flights, fm_ticket ticket) {
    flights->all[flights->next].ticket = ticket;
    flights->next = (flights->next + 1) % FM_FLIGHTS;
}

void fm_flights_destroy(fm_flights *flights) {
    for (int i = 0; i < FM_FLIGHTS; i++) {
        fm_buffer_destroy(flights->all[i].upload);
    }
}
