// SPDX-License-Identifier: MIT
#ifndef FM_APP_STAGE_H
#define FM_APP_STAGE_H

// The world that is shown, what draws it, and how it comes from scenes and files.

#include "settings.h"

typedef struct stage {
    fm_context *context;
    fm_world *world;
    fm_renderer *renderer;
    fm_renderer *judge;  // draws small pictures in which wrong pixels are counted
    fm_shape shape;
    fm_ticket newest;  // of the world's updates
    bool judging;      // wrong pixels are being counted
    fm_ticket judged;
} stage;

// All return false where fm_last_error says why; the stage is then as it was. The context is the caller's.
bool stage_open(stage *s, fm_context *context);
void stage_close(stage *s);

// A new world, filled with the settings' scene.
bool stage_build(stage *s, const paint_settings *settings);
// A new world of a file's voxels and shape. Changes shape and file of `settings`.
bool stage_load(stage *s, paint_settings *settings, const char *path);
// The same voxels in a world of another format.
bool stage_reformat(stage *s, const paint_settings *settings);
bool stage_set_method(stage *s, const paint_settings *settings);
// .vox in palette colours, other formats as 32-bit voxels.
bool stage_save(const stage *s, const char *path);

// Number of solid voxels, and a number that differs, most likely, when the voxels do. Slow.
bool stage_count(const stage *s, uint64_t *solid, uint64_t *hash);

// Lets the focus go with the camera, where it does.
void stage_focus(stage *s, const paint_settings *settings, const fm_camera *camera);
// Updates the world, without waiting for it. `works` tells whether it does anything: after edits (`edited`), and when a moved focus
// asks for it.
bool stage_update(stage *s, bool edited, fm_ticket *ticket, bool *works);

// Begins to count the pixels that the field gets wrong from here.
bool stage_judge(stage *s, const paint_settings *settings, const fm_camera *camera, double aspect);
// Their share, once, when it has been counted; does not wait. False: there is none yet.
bool stage_wrong_share(stage *s, double *share);

#endif
