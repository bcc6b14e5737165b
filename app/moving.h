// SPDX-License-Identifier: MIT
#ifndef FM_APP_MOVING_H
#define FM_APP_MOVING_H

// A floor with objects that move over it, their field, and what draws them. The scene is as large as a world of `moving_shape`
// voxels, so that the same camera goes around it.

#include "settings.h"

enum { MOVING_OBJECTS = 3 };

typedef struct moving_stage {
    fm_context *context;
    fm_scene *scene;
    uint32_t objects[MOVING_OBJECTS];
    uint64_t triangles;
    fm_deferred *deferred;
    fm_volume *field;         // EXACT
    fm_rtsdf *rtsdf;          // RTSDF and COARSE
    paint_mesh_settings has;  // what the field was made for
    double seconds;           // where the objects are; NAN: nowhere yet
    bool fresh;               // the exact field is that of the objects where they are
    fm_sdf_info sign;         // of the exact field; `sign_why` NULL: not known yet
    fm_ticket field_ticket, picture_ticket;
    uint32_t pictures;
} moving_stage;

extern const fm_shape moving_shape;

// A mesh of the file (NULL: a torus) stands in the middle, scaled to fit. A file without triangles leaves
// that place empty. `y_up`: the file's axis y points up, as (x, y, z) becomes (x, -z, y). All that return bool return false where
// fm_last_error says why. `moving_close` frees in any case, and takes what was never opened.
bool moving_open(moving_stage *s, fm_context *context, const char *file, bool y_up);
void moving_close(moving_stage *s);

// Where an object is after so many seconds.
fm_transform3 moving_place(uint32_t object, double seconds);

// Places what moves, and brings the field up to date where the settings need one. Waits for nothing, unless the field becomes
// another one. `works` tells whether a field is made, whose ticket `field_ticket` is then.
bool moving_update(moving_stage *s, const paint_mesh_settings *settings, double seconds, bool *works);
// Draws what was updated; complete at `picture_ticket`.
bool moving_draw(moving_stage *s, const paint_mesh_settings *settings, const fm_camera *camera, uint32_t width, uint32_t height);

#endif
