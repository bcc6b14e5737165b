// SPDX-License-Identifier: MIT
#ifndef FM_GPU_FRAMES_H
#define FM_GPU_FRAMES_H

// What renderers on Vulkan have in common: memory of the newest picture's size, and constants of the few pictures in flight.

#include "gpu/flights.h"

enum { FM_FRAME_BUFFERS = 5 };

// Where a picture goes.
typedef struct fm_gpu_room {
    fm_buffer *buffers[FM_FRAME_BUFFERS];
    uint64_t bytes[FM_FRAME_BUFFERS];  // 0: there is none
} fm_gpu_room;

typedef struct fm_gpu_frames {
    fm_gpu *gpu;
    fm_gpu_room room;   // of the newest picture
    fm_flights scenes;  // constants
} fm_gpu_frames;

// Submits a picture that goes to `room`, with constants of the flight, which it fills.
typedef fm_result fm_gpu_frame_submit(void *user, const fm_gpu_room *room, const fm_flight *scene, fm_ticket *ticket);

// Calls `submit` with room of these bytes (0: not needed), the first of which are others where a picture has another size, and a
// flight of `scene_bytes`. The newest picture stays where it is until another one is sure to come; room of another size than it has
// then goes, for which this waits for the work before.
fm_result fm_gpu_frames_picture(fm_gpu_frames *frames, const uint64_t bytes[FM_FRAME_BUFFERS], uint64_t scene_bytes,
                                fm_gpu_frame_submit *submit, void *user, fm_ticket *ticket);
// Waits for all work.
void fm_gpu_frames_destroy(fm_gpu_frames *frames);

#endif
