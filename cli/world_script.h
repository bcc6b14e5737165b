// SPDX-License-Identifier: MIT
#ifndef FM_CLI_WORLD_SCRIPT_H
#define FM_CLI_WORLD_SCRIPT_H

// Edits as people write them, one a line:
//     place sphere X,Y,Z RADIUS [VALUE]
//     place box X,Y,Z X,Y,Z [VALUE]           both corners included
//     place line X,Y,Z X,Y,Z RADIUS [VALUE]
//     place voxel X,Y,Z [VALUE]
//     delete ...                              the same, without VALUE
//     update                                  the edits so far are carried out; the end of the script does that too
// Positions are whole numbers, inside the world or not. VALUE is what the voxels become: a number from 1 to 4294967295, decimal or
// 0x..., whose lowest 8 bits are the colour, RRRGGGBB; default 0xff. Empty lines and what follows a # are passed over.

#include "fathom/world.h"

#define WORLD_SCRIPT_HELP                                                                                                          \
    "Edits, one a line, empty lines and what follows a # aside:\n"                                                                 \
    "  place sphere X,Y,Z RADIUS [VALUE]       delete sphere X,Y,Z RADIUS\n"                                                       \
    "  place box X,Y,Z X,Y,Z [VALUE]           delete box X,Y,Z X,Y,Z\n"                                                           \
    "  place line X,Y,Z X,Y,Z RADIUS [VALUE]   delete line X,Y,Z X,Y,Z RADIUS\n"                                                   \
    "  place voxel X,Y,Z [VALUE]               delete voxel X,Y,Z\n"                                                               \
    "  update                                  carry out the edits so far; the end does that too\n"                                \
    "Positions are whole numbers, inside the world or not; a box has both its corners. VALUE is a number from 1 to 4294967295,\n"  \
    "0x... too; its lowest 8 bits are the colour, RRRGGGBB; default 0xff."

typedef struct world_step {
    bool update;  // else an edit
    fm_brush brush;
} world_step;

typedef struct world_script {
    world_step *steps;
    uint32_t count, room;
} world_script;

// Adds a line. `where` begins the messages. Returns an exit code.
int world_script_line(world_script *script, const char *where, const char *line);
// Adds the lines of a file; "-" is standard input. Returns an exit code.
int world_script_file(world_script *script, const char *path);
void world_script_free(world_script *script);

#endif
