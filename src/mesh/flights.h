// SPDX-License-Identifier: MIT
#ifndef FM_MESH_FLIGHTS_H
#define FM_MESH_FLIGHTS_H

// A few upload buffers that take turns, so that the host fills one while the device reads another.

#include "gpu/gpu.h"

enum { FM_FLIGHTS = 3 };

typedef struct fm_flight {
    fm_buffer *upload;
    uint64_t bytes;
    fm_ticket ticket;
} fm_flight;

typedef struct fm_flights {
    fm_flight all[FM_FLIGHTS];
    uint32_t next;
} fm_flights;

// The next flight, with room for `bytes`, once its last use is complete. It stays the next one until it is sent.
fm_result fm_flights_take(fm_flights *flights, fm_gpu *gpu, uint64_t bytes, fm_flight **flight);
// What reads the flight that was taken is complete at `ticket`.
void fm_flights_sent(fm_flights *flights, fm_ticket ticket);
// Nothing may be in flight.
void fm_flights_destroy(fm_flights *flights);

#endif
