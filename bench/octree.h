// SPDX-License-Identifier: MIT
#ifndef FM_BENCH_OCTREE_H
#define FM_BENCH_OCTREE_H

// The benchmark of octrees: every kind on the same models, cameras and rays; what each costs in time and memory and how far its
// pictures are from ray-traced triangles.

#include "bench.h"
#include "fathom/octree_render.h"
#include "mesh.h"

typedef enum bench_octree_mode {
    BENCH_OCTREE_PICTURE = 0,  // of each kind at each size: build, memory, rays, errors
    BENCH_OCTREE_MEMORY,       // build and memory only
    BENCH_OCTREE_ERROR,        // sizes of the other kinds so that they match the first one's memory, time or error
    BENCH_OCTREE_UPDATE,       // octrees of a world that is edited
    BENCH_OCTREE_SCALE,        // octrees of a thin shell of voxels, size by size
    BENCH_OCTREE_SHARE,        // identical subtrees and leaves kept once
    BENCH_OCTREE_CODE,         // vectors in 32 bits against floats
} bench_octree_mode;

extern const char *const bench_octree_mode_words[];  // "picture", "memory", "error", "update", "scale", "share", "code"

typedef enum bench_octree_match {
    BENCH_MATCH_MEMORY = 0,  // bytes that a device reads
    BENCH_MATCH_TIME,        // primary rays
    BENCH_MATCH_SURFACE,     // 99th percentile of the distance between what rays hit and the triangles, in world units
    BENCH_MATCH_IMAGE,       // FLIP of the shaded picture
} bench_octree_match;

extern const char *const bench_octree_match_words[];  // "memory", "time", "surface", "image"

// A kind, and how its rays go.
typedef struct bench_octree_way {
    const char *name;
    fm_octree_kind kind;
    float epsilon;        // as fm_octree_cast
    fm_octree_code code;  // as fm_octree_desc; 0: the plan's
    float threshold;      // likewise
    float band;           // likewise
    bool field;           // no octree: the dense field of a world
    bool worlds;          // made from worlds, too
} bench_octree_way;

// Number `i`, or NULL past the last one. The first is "closest".
const bench_octree_way *bench_octree_way_at(uint32_t i);
extern const char *const bench_octree_way_words[];
extern const char *const bench_octree_view_words[];  // "whole", "half", "close"
enum { BENCH_OCTREE_VIEWS = 3 };

// What is measured, and how long.
typedef struct bench_octree_plan {
    uint32_t width, height;
    uint32_t frames;  // timed of a picture, and builds, at most BENCH_STATS_MAX
    double seconds;   // no further one begins after this
    double warm_up_ms;
    uint32_t samples;  // pixels whose hit is held against the triangles
    fm_octree_method method;
    fm_octree_code code;
    float threshold, band;  // of CLOSEST and DISTANCE, as fm_octree_desc
    bool share;
    bool upright;    // models have y up, not z
    uint32_t edits;  // of each radius
} bench_octree_plan;

// What a row tells. Numbers that were not measured are NaN, lists of timings without values empty.
typedef struct bench_octree_result {
    const char *mode, *way, *view, *match;
    char model[256], device[256];
    char failure[512];  // empty when all went well
    char note[256];
    double triangles, size, width, height, radius;
    bench_stats build, primary, second,
        update;                     // by the clock; GPU timestamps on devices, by the clock on processors; by the clock
    double build_gpu_ms, first_ms;  // kernels of the build; the first picture, with what is brought to the device
    double node_bytes, leaf_bytes, attribute_bytes, bytes, unshared_bytes, share_ratio;
    double leaves, voxels, bytes_a_leaf, bytes_a_voxel;
    double primary_rays, second_rays;        // a second
    double reads, most_reads, second_reads;  // a ray; primary ones with what their beams read
    double touched;                          // bytes a second, 32 for each read of a primary ray
    double copy;                             // bytes a second
    double rmse, flip, silhouette;           // of shaded pictures; share of pixels that one hits and the other does not
    double depth_mean, depth_p99;            // finest cells
    double surface_mean, surface_p99;        // finest cells
    double surface_relative;                 // 99th percentile, of the model's longest edge
    double code_vector, code_surface;  // 99th percentile: of vectors, cells of their leaf; of hits against floats', finest cells
    double value, must, goal;          // what the issue asks for
    const char *target, *verdict;      // NULL: nothing
    double samples, wrong;
} bench_octree_result;

void bench_octree_result_clear(bench_octree_result *result, bench_octree_mode mode);
// Keeps a message, or the library's where it is NULL. Returns false.
bool bench_octree_failed(bench_octree_result *result, const char *message);

// ---------------------------------------------------------------------------------------------------------------------------
// Models and what is seen of them
// ---------------------------------------------------------------------------------------------------------------------------

// A place that a pixel's ray hit.
typedef struct bench_octree_seen {
    float t;  // +infinity: nothing
    float normal[3];
} bench_octree_seen;

typedef struct bench_octree_view {
    fm_camera camera;
    bench_octree_seen *truth;  // of ray-traced triangles, NULL until wanted
    float *picture;            // the same, shaded: three floats a pixel
} bench_octree_view;

typedef struct bench_octree_model {
    char name[256];
    fm_context *context;
    fm_mesh *mesh;
    double triangles;
    bool upright;
    float low[3], high[3];  // the box of octrees; all 0: the mesh's own
    double middle[3], radius, longest;
    // The true distance of a place to the surface, where there is a formula.
    double (*distance)(const float place[3]);
    uint32_t width, height;
    bench_octree_view views[BENCH_OCTREE_VIEWS];
} bench_octree_model;

// "sphere", "torus", "box" (with formulas), "building", or a mesh that bench_mesh_create knows. NULL: see fm_last_error.
bench_octree_model *bench_octree_model_create(bench_session *session, const char *name, uint32_t triangles,
                                              const bench_octree_plan *plan);
void bench_octree_model_destroy(bench_octree_model *model);
// The view with its truth; NULL: see fm_last_error.
const bench_octree_view *bench_octree_view_of(bench_octree_model *model, uint32_t view);

// A camera that sees a ball of `radius` from the side and above.
fm_camera bench_octree_camera(const double middle[3], double radius, double aspect, bool upright);
// Rays through the middles of the pixels, of length 1, row by row from above; `step` (NULL allowed) is the angle between pixels.
void bench_octree_rays(const fm_camera *camera, uint32_t width, uint32_t height, fm_mesh_ray *rays, double *step);
// Shades what rays hit, all kinds and the triangles alike: the sun is behind the camera, above and to the left.
void bench_octree_shade(const fm_camera *camera, const bench_octree_seen *seen, const fm_mesh_ray *rays, uint64_t count,
                        float *picture);
void bench_octree_bytes(const float *picture, uint64_t numbers, uint8_t *bytes);

// ---------------------------------------------------------------------------------------------------------------------------
// Measuring. Each returns false when it failed, the check of the sample included; the result says why
// ---------------------------------------------------------------------------------------------------------------------------

// Builds, often enough to say how long it takes: with the mesh's tree, of positions in host memory. The caller destroys the octree.
bool bench_octree_build(bench_octree_model *model, const bench_octree_way *way, const bench_octree_plan *plan, uint32_t size,
                        uint32_t runs, fm_octree **octree, bench_octree_result *result);
void bench_octree_tell_memory(const fm_octree *octree, bench_octree_result *result);
// Times pictures, and leaves what the last one's pixels hit in `hits`.
bool bench_octree_frames(bench_session *session, fm_octree *octree, const fm_camera *camera, float epsilon,
                         const bench_octree_plan *plan, fm_octree_hit *hits, bench_octree_result *result);
// Times, errors and the check of a picture. `pixels` (NULL allowed) gets RGB bytes.
bool bench_octree_look(bench_session *session, bench_octree_model *model, uint32_t view, fm_octree *octree, float epsilon,
                       const bench_octree_plan *plan, uint8_t *pixels, bench_octree_result *result);
// Finds the size at which a way matches what `to` measured, and measures it there.
bool bench_octree_matched(bench_session *session, bench_octree_model *model, const bench_octree_way *way, bench_octree_match match,
                          const bench_octree_result *to, const bench_octree_plan *plan, uint32_t most, bench_octree_result *result,
                          uint32_t *size);
bool bench_octree_code(bench_session *session, bench_octree_model *model, fm_octree_code code, const bench_octree_plan *plan,
                       uint32_t size, bench_octree_result *result);
bool bench_octree_share(bench_octree_model *model, const bench_octree_way *way, const bench_octree_plan *plan, uint32_t size,
                        bench_octree_result *result);
// Edits a world with brushes of a radius and takes them over, edit by edit.
bool bench_octree_update(bench_session *session, const char *scene, const bench_octree_way *way, const bench_octree_plan *plan,
                         uint32_t size, uint32_t radius, bench_octree_result *result);
// An octree, or the field, of a world of a scene.
bool bench_octree_world(bench_session *session, const char *scene, const bench_octree_way *way, const bench_octree_plan *plan,
                        uint32_t size, bench_octree_result *result);
// An octree of a thin shell of voxels that is never in memory as a whole.
bool bench_octree_scale(bench_session *session, const bench_octree_way *way, const bench_octree_plan *plan, uint32_t size,
                        bench_octree_result *result);

// Voxels as a function, for checking what rays hit by going from voxel to voxel.
typedef bool (*bench_octree_solid)(const void *user, const int64_t at[3]);
void bench_octree_check_voxels(bench_octree_solid solid, const void *user, uint32_t size, const fm_camera *camera,
                               const bench_octree_plan *plan, const fm_octree_hit *hits, bench_octree_result *result);

// Median and the others of `runs` calls, after a warm-up. `one` does it once and says how long it took; false: see fm_last_error.
typedef bool (*bench_octree_once)(void *user, double *milliseconds);
bool bench_octree_time(bench_octree_once once, void *user, uint32_t runs, double seconds, double warm_up_ms, bench_stats *stats);
// The context's passes of the newest operation, summed but for those of a name that is left out (NULL: none).
double bench_octree_passes(fm_context *context, const char *but);

// Fills target, value, must, goal and verdict from what has been measured.
void bench_octree_judge(bench_octree_result *result);

void bench_octree_print_header(FILE *stream);
void bench_octree_print(FILE *stream, const bench_octree_result *result);
void bench_octree_csv_header(FILE *stream);
void bench_octree_csv(FILE *stream, const bench_octree_result *result);
cJSON *bench_octree_json(const bench_octree_result *result);

#endif
