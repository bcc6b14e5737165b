// SPDX-License-Identifier: MIT
#include "render/gpu_frames.h"

#include <string.h>

// Whether a buffer does for the next picture. One that this does not need may be for the one after it, if that has the same size.
static bool stays(const fm_gpu_room *room, const uint64_t bytes[FM_FRAME_BUFFERS], int i) {
    return room->bytes[0] == bytes[0] && (bytes[i] == 0 || room->bytes[i] == bytes[i]);
}

// Buffers that are not those of another room.
static void destroy_others(const fm_gpu_room *room, const fm_gpu_room *other) {
    for (int i = 0; i < FM_FRAME_BUFFERS; i++) {
        if (room->buffers[i] != other->buffers[i]) {
            fm_buffer_destroy(room->buffers[i]);
        }
    }
}

static bool is_other(const fm_gpu_room *room, const fm_gpu_room *other) {
    return memcmp(room->buffers, other->buffers, sizeof room->buffers) != 0;
}

// What of the newest picture's room does, and new buffers for the rest.
static fm_result make_room(const fm_gpu_frames *frames, const uint64_t bytes[FM_FRAME_BUFFERS], fm_gpu_room *made) {
    *made = (fm_gpu_room){0};
    for (int i = 0; i < FM_FRAME_BUFFERS; i++) {
        fm_result status = FM_OK;
        if (stays(&frames->room, bytes, i)) {
            made->buffers[i] = frames->room.buffers[i];
            made->bytes[i] = frames->room.bytes[i];
        } else if (bytes[i] > 0) {
            status = fm_buffer_create(frames->gpu, FM_PURPOSE_PICTURES, bytes[i], false, &made->buffers[i]);
            made->bytes[i] = bytes[i];
        }
        if (status != FM_OK) {
            destroy_others(made, &frames->room);
            return status;
        }
    }
    return FM_OK;
}

static fm_result send(fm_gpu_frames *frames, const fm_gpu_room *room, uint64_t scene_bytes, fm_gpu_frame_submit *submit, void *user,
                      fm_ticket *ticket) {
    fm_flight *scene;
    FM_TRY(fm_flights_take(&frames->scenes, frames->gpu, FM_PURPOSE_UPLOAD, scene_bytes, &scene));
    FM_TRY(submit(user, room, scene, ticket));
    fm_flights_sent(&frames->scenes, *ticket);
    return FM_OK;
}

fm_result fm_gpu_frames_picture(fm_gpu_frames *frames, const uint64_t bytes[FM_FRAME_BUFFERS], uint64_t scene_bytes,
                                fm_gpu_frame_submit *submit, void *user, fm_ticket *ticket) {
    fm_gpu_room made;
    FM_TRY(make_room(frames, bytes, &made));
    const fm_ticket before = fm_gpu_newest(frames->gpu);
    const fm_result status = send(frames, &made, scene_bytes, submit, user, ticket);
    if (status != FM_OK) {
        destroy_others(&made, &frames->room);
        return status;
    }
    if (is_other(&made, &frames->room)) {
        (void)fm_gpu_wait(frames->gpu, before);
        destroy_others(&frames->room, &made);
        frames->room = made;
    }
    return FM_OK;
}

void fm_gpu_frames_destroy(fm_gpu_frames *frames) {
    // A lost device has nothing in flight.
    (void)fm_gpu_wait(frames->gpu, fm_gpu_newest(frames->gpu));
    fm_flights_destroy(&frames->scenes);
    destroy_others(&frames->room, &(fm_gpu_room){0});
}
