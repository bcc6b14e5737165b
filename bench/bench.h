// SPDX-License-Identifier: MIT
#ifndef FM_BENCH_H
#define FM_BENCH_H

// The benchmark of transforms: cases, engines and what is measured. An engine is one row of a table, so that another library is
// added by writing its functions and a row for it.

#include "scenes.h"
#include "stats.h"

#include <cjson/cJSON.h>
#include <stdio.h>

enum { BENCH_MAX_PASSES = 64, BENCH_MAX_MEMORY = 32 };

// One thing to compute. L1 and Linf distances saturate at the largest value of their type; L2 in U32 is the square.
typedef struct bench_case {
    const fm_scene *scene;
    fm_scene_desc scene_desc;
    fm_metric metric;
    fm_type input;   // U8 or BITS
    fm_type output;  // U8, U16, F32, U32
} bench_case;

uint64_t bench_voxels(const bench_case *what);
fm_transform_desc bench_transform_desc(const bench_case *what);

// What the engines of one run share: contexts are made when first wanted.
typedef struct bench_session bench_session;

typedef struct bench_session_desc {
    fm_backend backend;  // of engines that can run on either
    const char *device;  // as fm_context_desc.device
    uint32_t threads;
    double bandwidth;  // of a copy on that backend, where it is known: bytes a second; 0: measured
} bench_session_desc;

bench_session *bench_session_create(const bench_session_desc *desc);
void bench_session_destroy(bench_session *session);
// FM_BACKEND_AUTO stands for what the session was made with. NULL: see fm_last_error.
fm_context *bench_session_context(bench_session *session, fm_backend backend);
// Bytes read and written in a second by a copy of a big volume, measured when first asked for; 0: see fm_last_error.
double bench_session_bandwidth(bench_session *session, fm_backend backend);

// The functions return NULL, or why they failed: a text that lives until the thread's next call of the engine.
typedef struct bench_engine {
    const char *name, *description;
    fm_backend backend;       // where it runs
    bool computes_distances;  // else its result is not checked
    uint64_t max_voxels;      // bigger cases are left out; 0: none are
    const char *limit;        // why
    // What is not timed: memory, and the input brought to where the engine computes. `input` and `output` are host arrays that
    // outlive the state.
    const char *(*prepare)(bench_session *session, const bench_case *what, const void *input, void *output, void **state);
    // Computes once, from and to where prepare put the arrays, and waits.
    const char *(*run)(void *state);
    // Computes once from the host input to the host output.
    const char *(*run_with_copies)(void *state);
    // The passes of the newest run, and how many.
    uint32_t (*passes)(void *state, fm_pass passes[BENCH_MAX_PASSES]);
    uint32_t (*memory)(void *state, fm_memory memory[BENCH_MAX_MEMORY]);
    // Name of what it runs on.
    const char *(*device)(void *state);
    // Brings the result of the newest `run` into the host output.
    const char *(*fetch)(void *state);
    void (*release)(void *state);
} bench_engine;

// Engine number `i`, or NULL past the last one.
const bench_engine *bench_engine_at(uint32_t i);
const bench_engine *bench_engine_find(const char *name);
// NULL, or why the engine cannot do the case.
const char *bench_engine_refuses(bench_session *session, const bench_engine *engine, const bench_case *what);

typedef struct bench_limits {
    uint32_t runs;     // timed runs of a case, at most BENCH_STATS_MAX
    double seconds;    // no new run begins after this, once there are three
    uint32_t samples;  // voxels that are checked
} bench_limits;

typedef struct bench_result {
    bench_case what;
    const bench_engine *engine;
    char device[256];
    char failure[512];    // empty when all went well
    bench_stats kernels;  // sum of the passes
    bench_stats wall;     // with the data in place
    bench_stats copies;   // from host array to host array
    uint32_t pass_count;
    struct {
        const char *name;
        bench_stats time;
        uint64_t bytes;
    } passes[BENCH_MAX_PASSES];
    uint64_t bytes;      // moved by all passes, at least
    double bandwidth;    // of a copy, bytes a second
    double floor_ms;     // `bytes` at that bandwidth
    double io_floor_ms;  // reading the input and writing the output once at that bandwidth
    uint32_t memory_count;
    fm_memory memory[BENCH_MAX_MEMORY];
    uint64_t scratch;  // bytes of scratch memory held
    double solid;      // share of solid voxels
    uint32_t samples, wrong;
} bench_result;

// A scene in memory, and what checks its distances.
typedef struct bench_scene bench_scene;

// NULL when out of memory.
bench_scene *bench_scene_create(const fm_scene *scene, const fm_scene_desc *desc);
void bench_scene_destroy(bench_scene *scene);
double bench_scene_solid(const bench_scene *scene);
// The scene's voxels as the case wants them, in memory of the scene; NULL when out of memory.
const void *bench_scene_input(bench_scene *scene, fm_type type);
// Checks `samples` voxels of a result, corners included, against a search of the scene's own voxels. Returns how many are wrong and
// says the first in `message`.
uint32_t bench_scene_check(const bench_scene *scene, const bench_case *what, const void *output, uint32_t samples, char *message,
                           size_t message_size);

// Measures one case on one engine. False when it failed, the check of the sample included; `result->failure` says why.
bool bench_measure(bench_session *session, bench_scene *scene, const bench_engine *engine, const bench_case *what,
                   const bench_limits *limits, bench_result *result);

// Names as options and tables have them.
const char *bench_type_name(const bench_case *what);   // of the output: "u8", "f32", "squared u32"
const char *bench_input_name(const bench_case *what);  // "u8", "bits"

void bench_print_header(FILE *stream);
void bench_print(FILE *stream, const bench_result *result);
void bench_csv_header(FILE *stream);
void bench_csv(FILE *stream, const bench_result *result);
// One line a pass.
void bench_passes_csv_header(FILE *stream);
void bench_passes_csv(FILE *stream, const bench_result *result);
cJSON *bench_json(const bench_result *result);

#endif
