// SPDX-License-Identifier: MIT
#ifndef FM_APP_READINGS_H
#define FM_APP_READINGS_H

// What the program knows and the panel shows.

#include "message.h"

#include "fathom/render.h"
#include "fathom/sdf.h"

enum { READINGS_GRAPH = 240, READINGS_MEMORY = 32 };

// The newest values, in a ring.
typedef struct readings_graph {
    float values[READINGS_GRAPH];
    uint32_t next, count;
} readings_graph;

static inline void readings_add(readings_graph *graph, double value) {
    graph->values[graph->next] = (float)value;
    graph->next = (graph->next + 1) % READINGS_GRAPH;
    graph->count += graph->count < READINGS_GRAPH;
}

static inline void readings_clear(readings_graph *graph) {
    graph->next = graph->count = 0;
}

typedef struct readings {
    readings_graph frame_ms, march_ms;
    readings_graph field_ms;  // by update
    readings_graph edits;     // a second, by frame
    readings_graph wrong;     // percent of the pixels, whenever they are counted
    double frame_mean_ms;     // of about the last ten; 0: not known
    double edits_per_second;
    bool may_be_wrong;   // the method is approximate
    double wrong_share;  // of pixels; -1: not known
    uint64_t triangles;  // of the meshes
    fm_sdf_info sign;    // of their exact field; `sign_why` NULL: there is none
    fm_memory memory[READINGS_MEMORY];
    uint32_t memory_count;
    fm_device_info device;
    fm_backend backend;
    uint32_t width, height;  // of the picture
    uint32_t undo, redo;     // steps there are
    uint64_t history_bytes;
    bool captured;
    bool automatic;  // the benchmark is in control
    message news;
    double message_seconds;  // since it was said
} readings;

#endif
