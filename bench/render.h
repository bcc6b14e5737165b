// SPDX-License-Identifier: MIT
#ifndef FM_BENCH_RENDER_H
#define FM_BENCH_RENDER_H

// The benchmark of pictures: a path of cameras through a world, and what its pictures cost.

#include "bench.h"
#include "fathom/render.h"

typedef enum bench_render_mode {
    BENCH_RENDER_FACES = 0,  // the first voxel of each ray, shaded by its face
    BENCH_RENDER_SHADED,     // every pixel with soft shadow and ambient occlusion
    BENCH_RENDER_EDITED,     // faces; before each picture a random edit and the exact update of the field
} bench_render_mode;

typedef struct bench_render_case {
    const char *scene;
    fm_world_desc desc;
    uint32_t width, height;
    bench_render_mode mode;
    fm_march march;
} bench_render_case;

typedef struct bench_render_limits {
    uint32_t rounds;  // along the path; 0: reads are counted, nothing is timed or checked
    uint32_t frames;  // asked for in a row for frames_per_second
    double seconds;   // nothing more of a part of the measurement begins after this, once there is some
    double warm_up_ms;
} bench_render_limits;

typedef struct bench_render_result {
    bench_render_case what;
    char device[256];
    char failure[512];  // empty when all went well
    // A camera: median over the rounds of the sum of its passes. EDITED: pictures, each after an edit. Without values: not timed.
    bench_stats gpu;
    bench_stats beam, march;
    bench_stats update;  // EDITED: passes of an update
    uint64_t counted;    // primary rays whose reads were counted, by which follow ...; EDITED: none, for each edit changes them
    double frames_per_second;  // pictures asked for one after the other, at most two in flight
    double steps, hits;        // a primary ray
    double most_steps;
    double beam_reads, sun_reads, open_reads;  // field reads for each primary ray
    double bandwidth;                          // of a copy, bytes a second; 0 where nothing is timed
    uint64_t checked, wrong;                   // pixels of the timed pictures, made again
    uint32_t memory_count;
    fm_memory memory[BENCH_MAX_MEMORY];
} bench_render_result;

// Runs one case over `count` cameras. The world is up to date, and is edited by EDITED. False when it failed.
bool bench_render_measure(bench_session *session, fm_world *world, const fm_camera *cameras, uint32_t count,
                          const bench_render_case *what, const bench_render_limits *limits, bench_render_result *result);

// Bytes that a pass of a picture reads and writes: its reads times the width of an entry, colours, pixels. Caches serve many of
// them.
double bench_render_beam_bytes(const bench_render_result *result);
double bench_render_march_bytes(const bench_render_result *result);

// Pictures that were timed.
typedef struct bench_render_pictures {
    fm_context *context;
    fm_world *world;
    fm_renderer *renderer;
    const fm_render_desc *pictures;  // all of one size and shading; their cameras have z up
    uint32_t count;
} bench_render_pictures;

// Makes the pictures again and checks a sample of the pixels of each against rays through the world's voxels: adds to `checked` and
// `wrong` of the result. Returns NULL, or what failed; a wrong pixel is a failure.
const char *bench_render_check(const bench_render_pictures *given, bench_render_result *result);

// What is to be reached by pictures of such a case on the device that the targets are for; 0: nothing is.
typedef struct bench_render_target {
    double must, goal;  // ms a picture; EDITED: frames a second
} bench_render_target;
bench_render_target bench_render_target_of(const bench_render_case *what);

extern const char *const bench_render_mode_words[];  // "faces", "shaded", "edited"

void bench_render_print_header(FILE *stream);
void bench_render_print(FILE *stream, const bench_render_result *result);
void bench_render_csv_header(FILE *stream);
void bench_render_csv(FILE *stream, const bench_render_result *result);
cJSON *bench_render_json(const bench_render_result *result);

#endif
