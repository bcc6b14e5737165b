// SPDX-License-Identifier: MIT
#ifndef FM_CLI_PICTURES_H
#define FM_CLI_PICTURES_H

// What the commands share that draw: the options that say how large pictures are, where they go and where cameras are; pictures as
// PNG, numbered PNGs or a film; the times of their passes.

#include "cli.h"
#include "path.h"

typedef struct pictures {
    const char *out;  // a name that ends in .png, or that of a film; NULL: none is wanted
    uint32_t width, height, frames;
    double fps;
    bool stats;
} pictures;

typedef struct picture_options {
    struct arg_str *out, *size, *fps;
    struct arg_lit *stats;
    path_options path;
} picture_options;

// `mesh`: cameras are in a mesh's units, not in voxels. `stats`: what --stats prints.
void picture_options_add(cli_args *args, picture_options *options, bool mesh, const char *stats);
// False on bad usage, which has been said.
bool picture_options_read(const picture_options *options, pictures *p, camera_path *path);

// Says early what would fail only after the work. Returns an exit code.
int pictures_check(const pictures *p);
// Calls `draw` for each frame, which puts RGBA pixels into its memory and returns an exit code. Returns an exit code.
int pictures_write(const pictures *p, const uint8_t *pixels, int (*draw)(void *user, uint32_t frame), void *user);
// Prints the device and the passes of the newest operation, which is `what`. Returns an exit code.
int pictures_print_passes(fm_context *context, const char *what);

#endif
