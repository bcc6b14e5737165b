// SPDX-License-Identifier: MIT
#ifndef FM_CLI_WORLD_REPORT_H
#define FM_CLI_WORLD_REPORT_H

// What `fathom world` was asked for, what came of it, and what it prints of both.

#include "method.h"
#include "world.h"
#include "world_script.h"

enum { WORLD_MAX_PASSES = 1024 };

typedef struct world_request {
    const char *in;  // NULL: `scene`, or air
    const fm_scene *scene;
    fm_scene_desc scene_desc;
    fm_read_desc read;
    bench_session_desc session;
    fm_world_desc desc;
    const method_options *method;
    world_script script;
    const char *voxels, *field, *slice;
    fm_type voxel_type, field_type;
    fm_write_desc write;
    float (*places)[3];
    uint32_t place_count;
    double threshold;
    fm_volume_desc start;  // of the file: its spacing and origin are those of what is written
    bool has_threshold, check, quiet, json;
} world_request;

// What was made.
typedef struct world_outcome {
    fm_device_info device;
    fm_backend backend;
    fm_world_stats stats;
    fm_pass passes[WORLD_MAX_PASSES];
    uint32_t pass_count;
    fm_memory memory[BENCH_MAX_MEMORY];
    uint32_t memory_count;
    uint32_t updates, edits;
    double wall_ms;  // of the updates
    bench_world_errors whole, domain;
    fm_world_sample *samples;
    fm_slice_info slice;
} world_outcome;

// Text or JSON, to standard output, or to stderr where a file goes there. Returns an exit code.
int world_report(const world_request *request, const world_outcome *outcome);

#endif
