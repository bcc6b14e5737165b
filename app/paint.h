// SPDX-License-Identifier: MIT
#ifndef FM_APP_PAINT_H
#define FM_APP_PAINT_H

// The program with its window, as its parts see it.

#include "aim.h"
#include "edit.h"
#include "fly.h"
#include "measure.h"
#include "message.h"
#include "moving.h"
#include "panel/gui.h"
#include "present.h"
#include "run.h"
#include "stage.h"
#include "window.h"

enum { EDITS_A_FRAME = 64, EDIT_TIMES = 256 };

typedef struct paint {
    const options *options;
    window window;
    gpu gpu;
    present present;
    fm_context *context;
    VkSemaphore timeline;  // null on the CPU backend
    stage stage;           // without a world until voxels are shown
    moving_stage moving;   // without a scene until meshes are
    double moved;          // seconds that the meshes have been moving
    edit_history history;
    paint_settings settings;  // as chosen
    paint_settings active;    // as the stage has them
    paint_settings logged;    // as the log has them
    gui_request slow;         // what waits until a frame has said that it will take a while
    int slow_frames;
    readings readings;
    measure measure;
    aim aim;
    fm_pick aim_logged;
    fly flies[2];  // over voxels, over meshes
    fm_camera camera;
    bool panel;
    auto_run run;
    bool begun;        // the benchmark, with the second picture: the first pays for pipelines and memory
    bool drawn;        // the last frame showed a picture
    bool edited;       // since the newest update
    uint32_t edits;    // ... since a frame of the benchmark was recorded
    double now, last;  // seconds
    double edit_times[EDIT_TIMES];
    uint64_t edit_count;
    const char *told[EDITS_A_FRAME];  // what the log is to tell the voxels after, once the world is up to date
    uint32_t told_count;
    double judged;
    bool hidden;
    uint32_t screenshots, pictures;  // taken, asked for
    bool over;
    int status;
} paint;

// frame.c: from input to picture.
void paint_frame(paint *p);
// What is known of the operations in flight; `wait`: of all of them.
void paint_collect(paint *p, bool wait);
// Carries out what is queued, waiting for it only where it is measured by the clock.
void paint_update(paint *p);
// The picture that is chosen, without a brush.
fm_render_desc paint_picture_desc(const paint *p);

// Copies the newest picture.
fm_result paint_read_picture(paint *p, uint8_t *pixels);
// The edges of what is shown, in which cameras fly.
fm_shape paint_shape(const paint *p);

// act.c: what keys, mouse and buttons ask for.
void paint_edits(paint *p, const window_input *input);
void paint_obey(paint *p, const window_input *input, const gui_request *asked);
void paint_count_edit(paint *p);

// follow.c: the stage follows what is chosen.
void paint_follow(paint *p);
// Worlds are made between frames, which takes a while when they are big: a frame says so first.
void paint_ask_slow(paint *p, bool load);
void paint_do_slow(paint *p);
// A new world begins: what belonged to the old one is forgotten.
void paint_world_changed(paint *p, const char *event);
void paint_log_settings(paint *p);

// What cannot be gone on from.
static inline void paint_end_failed(paint *p) {
    p->over = true;
    p->status = CLI_FAILED;
}

static inline void paint_failed(paint *p, const char *what) {
    message_fail_library(&p->readings.news, p->now, what);
}

#endif
