// SPDX-License-Identifier: MIT
#ifndef FM_BENCH_SHADOWS_STAGE_H
#define FM_BENCH_SHADOWS_STAGE_H

// What is on the stage of the benchmark of shadows: things, fields of them, and who draws it.

#include "shadows.h"

enum { STAGE_MOVING = 2 };

typedef enum stage_set {
    STAGE_TABLE = 0,  // a ball and a torus that move over a table with posts, a thin bar and a grille
    STAGE_BALL,       // a ball over a plane
} stage_set;

// The radius of STAGE_BALL's ball and the height of its middle above the plane z = 0.
extern const float stage_ball_radius, stage_ball_height;

typedef struct stage_scene {
    fm_context *context;
    fm_scene *scene;
    uint32_t moving[STAGE_MOVING], moving_count;
    fm_volume *field;  // F32, of the box around all that ever is
    fm_rtsdf *rtsdf;
    fm_deferred *deferred;
} stage_scene;

// False: see fm_last_error; close it all the same.
bool stage_open(stage_scene *s, fm_context *context, const bench_shadow_case *what, stage_set set);
void stage_close(stage_scene *s);
// Where things are at a time of 0 to 1.
bool stage_move(stage_scene *s, double time);

#endif
