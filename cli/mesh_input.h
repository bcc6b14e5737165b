// SPDX-License-Identifier: MIT
#ifndef FM_CLI_MESH_INPUT_H
#define FM_CLI_MESH_INPUT_H

// Meshes as subcommands take them: which format and which way up, a floor to stand on, and what is to be said of a mesh whose field
// may be a surprise.

#include "cli.h"

#include "fathom/mesh_io.h"
#include "fathom/sdf.h"

extern const char *const mesh_sign_words[];  // of fm_sign

typedef struct mesh_input_options {
    struct arg_str *format, *up;
    struct arg_lit *flip;
} mesh_input_options;

typedef struct mesh_input {
    const char *path;
    fm_mesh_format format;
    bool y_up, flip, floor, quiet;
    double low[3], high[3];  // once it is read with a floor: the box of the mesh alone
} mesh_input;

void mesh_input_add(cli_args *args, mesh_input_options *options);
// Without the format, which the command asks for by itself, as it reads other files too.
void mesh_input_add_turns(cli_args *args, mesh_input_options *options);
// All but path, floor and quiet; false on bad usage.
bool mesh_input_options_read(const mesh_input_options *options, mesh_input *input);

// A mesh format's name; false, and nothing said, for other words.
bool mesh_input_format(const char *word, fm_mesh_format *format);

// Reads the mesh, turns it and lays the floor under it: a box that goes around it by more than half of its longest edge. `info` may
// be NULL. Returns an exit code.
int mesh_input_load(mesh_input *input, fm_context *context, fm_mesh **mesh, fm_mesh_file_info *info);

enum { MESH_NOTE = 256 };
// What to know of the mesh's field of that sign: `note` is empty where nothing is. `level` is where its surface is wanted.
fm_result mesh_input_note(fm_mesh *mesh, fm_volume *field, fm_sign sign, double level, char note[MESH_NOTE]);

#endif
