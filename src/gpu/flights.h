// SPDX-License-Identifier: MIT
#ifndef FM_FLIGHTS_H
#define FM_FLIGHTS_H

// A few buffers that the host reaches, which take turns: it fills one while the device reads another, or reads one while the device
// fills another.

#include "gpu/gpu.h"

enum { FM_FLIGHTS = 3 };

typedef struct fm_flight {
    fm_buffer *buffer;
    uint64_t bytes;
    fm_ticket ticket;
} fm_flight;

// All 0: there is none yet.
typedef struct fm_flights {
    fm_flight all[FM_FLIGHTS];
    uint32_t next;
} fm_flights;

// The next flight, with room for `bytes`, once its last use is complete. It stays the next one until it is sent. `purpose`, the
// same each time, is FM_PURPOSE_UPLOAD or FM_PURPOSE_READBACK. What was in its memory is lost where it grows.
fm_result fm_flights_take(fm_flights *flights, fm_gpu *gpu, fm_purpose purpose, uint64_t bytes, fm_flight **flight);
// What uses the flight that was taken is complete at `ticket`.
void fm_flights_sent(fm_flights *flights, fm_ticket ticket);
// The one that was sent last; its buffer is NULL where none was.
const fm_flight *fm_flights_newest(const fm_flights *flights);
// Nothing may be in flight.
void fm_flights_destroy(fm_flights *flights);

#endif
