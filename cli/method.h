// SPDX-License-Identifier: MIT
#ifndef FM_CLI_METHOD_H
#define FM_CLI_METHOD_H

// How a world's field is made, as subcommands take it.

#include "cli.h"
#include "fathom/world.h"

// What --algorithm takes.
#define METHOD_ALGORITHMS                                                                                                          \
    "exact (default), brute-force, fim, jfa-published, jfa, jfa-1+, jfa+2, jfa-fim, selective, published-final"

typedef struct method_options {
    struct arg_str *algorithm, *chunk, *border, *convergence, *format, *focus, *focus_at, *near, *far, *max_distance;
} method_options;

void method_options_add(cli_args *args, method_options *options);
// Fills in format, max_distance and method; false on bad usage.
bool method_options_read(const method_options *options, fm_world_desc *desc);
// Puts the focus into the middle of the world, whose shape is known now, unless an option says where it is.
void method_focus(const method_options *options, fm_world_desc *desc);

#endif
