// SPDX-License-Identifier: MIT
#ifndef FM_APP_AUTO_H
#define FM_APP_AUTO_H

// The published benchmark: random edits at a fixed interval while the camera flies a fixed path, every frame measured.

#include "fathom/render.h"

#include <stdio.h>

typedef struct auto_desc {
    uint64_t seed;
    double interval_ms;  // from edit to edit; 0: one a frame
    double seconds;      // of measuring
    uint32_t frames;     // instead of `seconds`, when above 0: the camera's path takes so many
    uint32_t radius;     // edits have radii from 1 to this
    const char *csv;     // NULL: none
    bool meshes;         // that move, and no edits
} auto_desc;

typedef struct auto_frame {
    double start_ms;  // since the first frame, pauses left out
    double delta_ms;  // to the start of the next
    double field_ms, march_ms;
    uint32_t edits;
} auto_frame;

typedef struct auto_run {
    auto_desc desc;
    fm_shape shape;
    double begin_ms;
    double paused_ms;
    bool by_clock;     // what times are by, for the summary: not by timestamps
    uint64_t edits;    // so far
    auto_frame early;  // times of frames that are not recorded yet
    auto_frame *frames;
    uint64_t count, capacity;
} auto_run;

void auto_begin(auto_run *run, const auto_desc *desc, fm_shape shape, double now_ms);
void auto_free(auto_run *run);
// What follows is as if so much time had not passed. Between frames.
void auto_pause(auto_run *run, double ms);
// Whether what was asked for has been measured.
bool auto_over(const auto_run *run, double now_ms);
// The edits due, at most `capacity`; they are taken.
uint32_t auto_edits(auto_run *run, double now_ms, fm_brush *brushes, uint32_t capacity);
// How long what moves has been moving.
double auto_seconds(const auto_run *run, double now_ms);
fm_camera auto_camera(const auto_run *run, double now_ms);
// False when out of memory.
bool auto_record(auto_run *run, const auto_frame *frame);
// Adds what has become known of frame number `frame`; of one that is not recorded yet, it is added to the next.
void auto_add(auto_run *run, uint64_t frame, double field_ms, double march_ms);
// Says early what would fail only after the run: a table that cannot be written. Returns an exit code.
int auto_check(const auto_desc *desc);
// Writes the table of frames where one is wanted, and prints the summary. Returns an exit code; stderr has been told why it failed.
int auto_finish(auto_run *run, FILE *stream);

#endif
