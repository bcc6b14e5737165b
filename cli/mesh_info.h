// SPDX-License-Identifier: MIT
#ifndef FM_CLI_MESH_INFO_H
#define FM_CLI_MESH_INFO_H

#include "fathom/mesh_io.h"

#include <stdbool.h>

// Describes the mesh in a file. Returns an exit code.
int mesh_info(const char *path, fm_mesh_format format, bool json);

#endif
