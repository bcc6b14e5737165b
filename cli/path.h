// SPDX-License-Identifier: MIT
#ifndef FM_CLI_PATH_H
#define FM_CLI_PATH_H

// Where the cameras of a picture, or of a path of them, are: the options that say it, and files of keys.

#include "cli.h"
#include "fathom/render.h"

enum { PATH_MAX_KEYS = 1024 };

// Position, yaw, pitch, field of view.
typedef struct camera_key {
    double v[6];
} camera_key;

typedef struct path_options {
    struct arg_str *camera, *look_at, *path, *keys;
    double farthest;  // from 0 along each axis that a camera may be
} path_options;

typedef struct camera_path {
    bool camera_given, around_given;
    camera_key camera;
    double around[6];  // target, distance (0: one that suits), yaw, pitch
    camera_key keys[PATH_MAX_KEYS];
    uint32_t key_count, frames;
} camera_path;

void path_options_add(cli_args *args, path_options *options);
// The same where places are in a mesh's units, not in voxels.
void path_options_add_mesh(cli_args *args, path_options *options);
// False on bad usage, which has been said.
bool path_options_read(const path_options *options, camera_path *path);
// Where no camera is given: around the middle of a box, or --look-at's place, from where all of the box is seen.
void camera_path_fit(camera_path *path, const double low[3], const double high[3], double aspect);
// The camera of a frame, in a world of that shape; `aspect` is width over height.
fm_camera camera_path_at(const camera_path *path, fm_shape shape, double aspect, uint32_t frame);

// Numbers with commas between them; false unless all of the text is `least` to `most` of them. The others stay.
bool path_numbers(const char *text, int least, int most, double *values);

#endif
