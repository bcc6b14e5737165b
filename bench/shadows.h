// SPDX-License-Identifier: MIT
#ifndef FM_BENCH_SHADOWS_H
#define FM_BENCH_SHADOWS_H

// The benchmark of soft shadows: ways to shadow a scene that moves, what each costs a frame, and how far it is from the truth,
// which is distributed ray tracing of the same frame.

#include "bench.h"
#include "fathom/deferred.h"
#include "fathom/sdf.h"

// Which field a way needs.
typedef enum bench_shadow_field {
    BENCH_SHADOW_NO_FIELD = 0,
    BENCH_SHADOW_RTSDF,  // as published
    BENCH_SHADOW_EXACT,  // signed, exact in the band and flooded beyond it
} bench_shadow_field;

typedef struct bench_shadow_way {
    const char *name;
    bench_shadow_field field;
    fm_shadows shadows;
    uint32_t samples;  // 0: the case's, for the truth
    bool blended;      // jittered, and blended with the frames before
} bench_shadow_way;

// Way number `i`, or NULL past the last one. The first one is the truth.
const bench_shadow_way *bench_shadow_way_at(uint32_t i);

typedef struct bench_shadow_case {
    uint32_t triangles;  // about so many of the two things that move
    uint32_t edge;       // texels along the field's longest edge; RTSDF's coarse field has half
    uint32_t rays;       // RTSDF: a texel and frame
    uint32_t width, height;
    uint32_t map_edge;  // texels along a cascade
    uint32_t truth;     // samples a pixel of the truth
    uint32_t frames;    // timed, and those before the pictures that are compared; at most BENCH_STATS_MAX
    float light;        // half the angle of the sun, in degrees
    double warm_up_ms;  // of each way, on a GPU
} bench_shadow_case;

typedef struct bench_shadow_result {
    const bench_shadow_way *way;
    char failure[512];                          // empty when all went well
    bench_stats update, field, surface, light;  // passes of a frame: scene and tree; field; what is seen; shadows, light, blending
    bench_stats frame;                          // all of them
    double share_error;                         // of the light's share, root mean square over the pixels, things at rest
    double picture_error, flip, ssim;           // of the picture, likewise
    double noise;                               // mean change of a pixel's share from frame to frame, things at rest
    double moving_error;                        // as share_error, in the midst of a move
    double
        width_error;  // of a sphere's penumbra on a plane: measured width / true width - 1; NAN where there is none, or noise alone
} bench_shadow_result;

// What all ways of a case share. NULL: see fm_last_error.
typedef struct bench_shadow_stage bench_shadow_stage;
bench_shadow_stage *bench_shadow_stage_create(fm_context *context, const bench_shadow_case *what);
void bench_shadow_stage_destroy(bench_shadow_stage *stage);

// Measures one way. False when it failed.
bool bench_shadow_measure(bench_shadow_stage *stage, const bench_shadow_way *way, bench_shadow_result *result);
// The newest picture of the way that was measured last, RGBA.
const uint8_t *bench_shadow_picture(const bench_shadow_stage *stage);

void bench_shadow_print_header(FILE *stream);
void bench_shadow_print(FILE *stream, const bench_shadow_result *result);
void bench_shadow_csv_header(FILE *stream);
void bench_shadow_csv(FILE *stream, const bench_shadow_case *what, const char *device, const bench_shadow_result *result);

#endif
