// SPDX-License-Identifier: MIT
#ifndef FM_BENCH_MESH_H
#define FM_BENCH_MESH_H

// The benchmark of meshes: a mesh that moves, and what its voxels, fields and trees cost each frame.

#include "bench.h"
#include "fathom/sdf.h"

typedef enum bench_mesh_mode {
    BENCH_MESH_RTSDF = 0,  // the published technique
    BENCH_MESH_COARSE,     // voxels, and their exact Euclidean transform
    BENCH_MESH_EXACT,      // the exact signed band
    BENCH_MESH_COMPOSE,    // of a scene, composed of the objects' own fields
    BENCH_MESH_SCENE,      // of the same scene, the exact band made anew
    BENCH_MESH_BUILD,      // the tree, made anew
    BENCH_MESH_REFIT,      // the tree, refitted
} bench_mesh_mode;

extern const char *const bench_mesh_mode_words[];   // "rtsdf", "coarse", "exact", "compose", "scene", "build", "refit"
extern const char *const bench_mesh_flood_words[];  // "jfa", "1+jfa", "jfa+2"
extern const char *const bench_mesh_sign_words[];   // "auto", "pseudonormal", "winding", "none"

enum { BENCH_MESH_POSES = 8, BENCH_MESH_OBJECTS = 8 };

// A mesh at the poses that it goes through, and a cube that holds them all.
typedef struct bench_mesh {
    char name[256];
    uint32_t (*triangles)[3];
    uint64_t triangle_count, vertex_count;
    float (*poses[BENCH_MESH_POSES])[3];
    double low[3], high[3];
} bench_mesh;

// `what`: "torus", "sphere", "tubes" or "sheet", each of about `triangles` triangles, or a file. `still`: all poses are alike.
// NULL: see fm_last_error.
bench_mesh *bench_mesh_create(const char *what, uint32_t triangles, bool still);
void bench_mesh_destroy(bench_mesh *mesh);
// The mesh on a context, in a pose. NULL: see fm_last_error.
fm_mesh *bench_mesh_on(const bench_mesh *mesh, fm_context *context, uint32_t pose);

typedef struct bench_mesh_case {
    const bench_mesh *mesh;
    bench_mesh_mode mode;
    uint32_t edge;  // of the field; RTSDF: of the coarse one
    uint32_t rays;
    float mask;
    fm_flood flood;
    fm_sign sign;
    float band;
    uint32_t moving;  // objects of a scene, at most BENCH_MESH_OBJECTS
} bench_mesh_case;

// 1, or BENCH_MESH_OBJECTS where there is a scene.
uint32_t bench_mesh_objects(const bench_mesh_case *what);
// The grid of the field: around the mesh, or around the objects.
fm_volume_desc bench_mesh_grid(const bench_mesh_case *what);
// A scene of copies of the mesh, which the caller destroys. NULL: see fm_last_error.
fm_scene *bench_mesh_scene(const bench_mesh_case *what, fm_context *context, uint32_t pose);
fm_transform3 bench_mesh_place(const bench_mesh_case *what, uint32_t object, uint32_t pose);
bool bench_mesh_scene_move(const bench_mesh_case *what, fm_scene *scene, uint32_t pose);

typedef struct bench_mesh_limits {
    uint32_t frames;  // at most BENCH_STATS_MAX
    double seconds;   // no frame begins after this, once there are three
    double warm_up_ms;
    uint32_t samples;  // texels that are checked
} bench_mesh_limits;

typedef struct bench_mesh_result {
    bench_mesh_case what;
    char device[256];
    char failure[512];    // empty when all went well
    bench_stats kernels;  // sum of the passes
    bench_stats wall;     // from the call to the answer, the move of the mesh left out
    bench_stats move;     // new positions brought to where they are used, by the clock
    uint32_t pass_count;
    struct {
        const char *name;
        bench_stats time;
        uint64_t bytes;
    } passes[BENCH_MAX_PASSES];
    uint64_t bytes;    // moved by all passes, at least
    double bandwidth;  // of a copy, bytes a second
    double floor_ms;   // `bytes` at that bandwidth
    uint32_t memory_count;
    fm_memory memory[BENCH_MAX_MEMORY];
    uint32_t samples, wrong;
} bench_mesh_result;

// Measures one case. False when it failed, the check of the sample included.
bool bench_mesh_measure(bench_session *session, const bench_mesh_case *what, const bench_mesh_limits *limits,
                        bench_mesh_result *result);

// What a case is carried out with, between prepare and release.
typedef struct bench_mesh_state {
    const bench_mesh_case *what;
    fm_context *context;
    fm_mesh *mesh;
    fm_rtsdf *rtsdf;
    fm_scene *scene;
    fm_composed *composed;
    fm_volume *voxels, *field;  // `field` is not that of `composed`
    fm_volume_desc grid;
    uint32_t pose;  // of the newest frame
} bench_mesh_state;

// Checks what the newest frame computed against a mesh on the processor. NULL, or what was wrong.
const char *bench_mesh_check(bench_session *session, bench_mesh_state *state, uint32_t samples, bench_mesh_result *result);

// Median of the passes of that name; 0 where there is none.
double bench_mesh_pass(const bench_mesh_result *result, const char *name);

void bench_mesh_print_header(FILE *stream);
void bench_mesh_print(FILE *stream, const bench_mesh_result *result);
void bench_mesh_csv_header(FILE *stream);
void bench_mesh_csv(FILE *stream, const bench_mesh_result *result);
cJSON *bench_mesh_json(const bench_mesh_result *result);

#endif
