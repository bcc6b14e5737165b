// SPDX-License-Identifier: MIT
#include "render/gpu_frames.h"

static void destroy_room(const fm_gpu_room *room) {
    for (int i = 0; i < FM_FRAME_BUFFERS; i++) {
        fm_buffer_destroy(room->buffers[i]);
    }
}

static fm_result make_room(fm_gpu *gpu, const uint64_t bytes[FM_FRAME_BUFFERS], fm_gpu_room *made) {
    *made = (fm_gpu_room){0};
    for (int i = 0; i < FM_FRAME_BUFFERS; i++) {
        const fm_result status =
            bytes[i] > 0 ? fm_buffer_create(gpu, FM_PURPOSE_PICTURES, bytes[i], false, &made->buffers[i]) : FM_OK;
        if (status != FM_OK) {
            destroy_room(made);
            return status;
        }
        made->bytes[i] = bytes[i];
    }
    return FM_OK;
}

// What one picture needs and the next does not may stay.
static bool fits(const fm_gpu_room *room, const uint64_t bytes[FM_FRAME_BUFFERS]) {
    for (int i = 0; i < FM_FRAME_BUFFERS; i++) {
        if (bytes[i] > 0 && room->bytes[i] != bytes[i]) {
            return false;
        }
    }
    return true;
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
    if (fits(&frames->room, bytes)) {
        return send(frames, &frames->room, scene_bytes, submit, user, ticket);
    }
    fm_gpu_room made;
    FM_TRY(make_room(frames->gpu, bytes, &made));
    const fm_ticket before = fm_gpu_newest(frames->gpu);
    const fm_result status = send(frames, &made, scene_bytes, submit, user, ticket);
    if (status != FM_OK) {
        destroy_room(&made);
        return status;
    }
    (void)fm_gpu_wait(frames->gpu, before);
    destroy_room(&frames->room);
    frames->room = made;
    return FM_OK;
}

void fm_gpu_frames_destroy(fm_gpu_frames *frames) {
    // A lost device has nothing in flight.
    (void)fm_gpu_wait(frames->gpu, fm_gpu_newest(frames->gpu));
    fm_flights_destroy(&frames->scenes);
    destroy_room(&frames->room);
}
