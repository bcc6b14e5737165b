// SPDX-License-Identifier: MIT
#ifndef FM_CLI_COMMANDS_H
#define FM_CLI_COMMANDS_H

#include <stdbool.h>

// The subcommands: each takes its own name as argv[0] and returns an exit code.

int command_devices(int argc, char **argv);
int command_info(int argc, char **argv);
int command_scene(int argc, char **argv);
int command_slice(int argc, char **argv);
int command_transform(int argc, char **argv);
int command_sdf(int argc, char **argv);
int command_voxelize(int argc, char **argv);
int command_convert(int argc, char **argv);
int command_octree(int argc, char **argv);
int command_world(int argc, char **argv);
int command_render(int argc, char **argv);
// Whether the arguments of render are those of a mesh or a field, and then this.
bool render_mesh_wanted(int argc, char **argv);
int command_render_mesh(int argc, char **argv);
int command_paint(int argc, char **argv);  // where the painting program is built
int command_bench(int argc, char **argv);
// bench hands over to these.
int command_bench_world(int argc, char **argv);
int command_bench_render(int argc, char **argv);
int command_bench_shadows(int argc, char **argv);
int command_bench_mesh(int argc, char **argv);
int command_bench_octree(int argc, char **argv);

#endif
