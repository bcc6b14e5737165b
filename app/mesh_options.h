// SPDX-License-Identifier: MIT
#ifndef FM_APP_MESH_OPTIONS_H
#define FM_APP_MESH_OPTIONS_H

// The options that choose moving meshes and their field.

#include "cli.h"
#include "settings.h"

typedef struct mesh_options {
    struct arg_lit *meshes, *hold, *blend;
    struct arg_str *up, *field, *edge, *band, *sign, *rays, *flood, *surface, *samples, *light;
} mesh_options;

void mesh_options_add(cli_args *args, mesh_options *o);
// `shadow` and `view` are options that voxels have too, with other words; NULL: not given. False on bad usage, of which has been
// told.
bool mesh_options_read(const mesh_options *o, const char *shadow, const char *view, paint_mesh_settings *settings);

#endif
