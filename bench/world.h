// SPDX-License-Identifier: MIT
#ifndef FM_BENCH_WORLD_H
#define FM_BENCH_WORLD_H

// The benchmark of editable worlds: a seeded script of edits, and what each update of it costs.

#include "bench.h"
#include "fathom/world.h"

// A script: update number u brings the same brushes everywhere.
typedef struct bench_edits {
    uint64_t seed;
    uint32_t per_update;  // at least 1
    uint32_t least_radius, greatest_radius;
    fm_brush_kind kinds[3];  // one of these at random
    uint32_t kind_count;
} bench_edits;

// Writes `per_update` brushes: half of them place, half delete, at random positions of the world.
void bench_edits_at(const bench_edits *edits, fm_shape shape, uint64_t update, fm_brush *brushes);

typedef struct bench_world_case {
    const char *start;  // what the world is filled with: name of a scene or file
    fm_scene_desc scene_desc;
    fm_world_desc desc;
    bench_edits edits;
} bench_world_case;

typedef struct bench_world_limits {
    uint32_t frames;       // timed updates, at most BENCH_STATS_MAX
    uint32_t full_runs;    // timed regenerations of everything, at most BENCH_STATS_MAX
    double seconds;        // no update begins after this, once there is one; nor a regeneration after half of it
    double interval_ms;    // from the start of an update to the start of the next; 0: one after another
    uint64_t check;        // voxels of the field that are compared with the exact one; 0: none
    uint32_t check_every;  // ... after each so many updates too; 0: at the end only
} bench_world_limits;

// One frame: edits are queued, the world is updated, the update has been waited for.
typedef struct bench_world_frame {
    double gpu_ms;    // sum of the update's passes
    double delta_ms;  // wall time of the frame
    double call_ms;   // of it, until fm_world_update returned
    fm_world_stats stats;
} bench_world_frame;

// A field against another one, in voxels.
typedef struct bench_world_errors {
    uint64_t compared;
    uint64_t above, below;  // voxels whose distance is too great: a ray that trusts it may pass through solid voxels; too small
    double most_above, most_below;
    double sum;  // of the absolute errors
} bench_world_errors;

typedef struct bench_world_result {
    bench_world_case what;
    char device[256];
    char failure[512];  // empty when all went well
    double bandwidth;   // of a copy, bytes a second
    bool gpu;           // times are GPU timestamps, else of the CPU backend's passes
    double solid;       // share of solid voxels at the start
    uint32_t frame_count;
    bench_world_frame frames[BENCH_STATS_MAX];
    bench_stats update, frame, call;                // of the frames' gpu_ms, delta_ms, call_ms
    bench_stats full, full_wall;                    // regeneration of everything
    double iterations, most_iterations;             // a frame: mean and most
    double host_wait_ms;                            // a frame: mean
    double rows, tiles_y, tiles_z, chunks;          // a frame: mean
    uint64_t field_bytes, voxel_bytes, rest_bytes;  // memory of the world, and all else that its context holds
    uint32_t memory_count;
    fm_memory memory[BENCH_MAX_MEMORY];
    bench_world_errors whole;   // against the exact field of the world
    bench_world_errors domain;  // against that of each chunk with what its border lets it see; compared 0: the same
} bench_world_result;

// Median frames a second, 1000 / delta.
double bench_world_fps(const bench_world_result *result);
double bench_world_per_voxel(const bench_world_result *result, uint64_t bytes);

// A scene as a volume that worlds are filled with; NULL: see fm_last_error.
fm_volume *bench_world_scene(const fm_scene *scene, const fm_scene_desc *desc);

// A method as it stands when what has no effect is left at 0, and `near` and `far` of SELECTIVE are what they stand for.
fm_world_method bench_world_method(const fm_world_method *method);
// NULL, or why there is no such world, in the words of the programs' options: formats and borders are not for every algorithm.
const char *bench_world_refuses(const fm_world_desc *desc);

// Runs one case. False when it failed; `result->failure` says why. A field that is wrong is no failure unless the method is exact.
bool bench_world_measure(bench_session *session, const fm_volume *start, const bench_world_case *what,
                         const bench_world_limits *limits, bench_world_result *result);

// Compares the field of a world with the exact one, at `samples` voxels or all: the counts are added to `whole` and, where chunks
// do not see the whole world, to `domain`. Returns NULL or what failed.
const char *bench_world_check(bench_session *session, fm_world *world, uint64_t samples, bench_world_errors *whole,
                              bench_world_errors *domain);

// The speed that exact updates are to reach.
typedef struct bench_world_target {
    const char *name;
    uint32_t size;                          // edge of the world
    uint32_t edits;                         // an update; 0: everything is regenerated
    double must, must_p99, goal, goal_p99;  // ms; 0: none
} bench_world_target;

// Target number `i`, or NULL past the last one.
const bench_world_target *bench_world_target_at(uint32_t i);
void bench_world_target_header(FILE *stream);
// Prints what was measured beside the target, and whether it is met where that can be said.
void bench_world_target_print(FILE *stream, const bench_world_target *target, const bench_world_result *result);
// The same for the memory that the largest world may take.
void bench_world_target_memory(FILE *stream, const bench_world_result *result);

void bench_world_print_header(FILE *stream);
void bench_world_print(FILE *stream, const bench_world_result *result);
void bench_world_csv_header(FILE *stream);
void bench_world_csv(FILE *stream, const bench_world_result *result);
// One line a frame.
void bench_world_frames_csv_header(FILE *stream);
void bench_world_frames_csv(FILE *stream, const bench_world_result *result);
cJSON *bench_world_json(const bench_world_result *result);

// Draws the table `csv` as pictures in `directory`, with bench/plot-world; NULL, NULL only asks whether that can be. False when it
// failed; the script has said why on stderr.
bool bench_world_plot(const char *csv, const char *directory);

#endif
