// SPDX-License-Identifier: MIT
#ifndef FM_CLI_OCTREE_FIELD_H
#define FM_CLI_OCTREE_FIELD_H

// The dense distance field that octrees are compared with, drawn where an octree would be: --kind field of fathom octree render.

#include "octree_job.h"

#include "fathom/deferred.h"
#include "fathom/octree_render.h"

typedef struct octree_field {
    fm_volume *volume;
    fm_deferred *deferred;
} octree_field;

// From the job's mesh, with as many texels along the longest edge as an octree would have cells, in the same box, which
// job->info tells then. Returns an exit code; octree_field_end in any case.
int octree_field_make(octree_job *job, octree_field *field);
// `pixels` may be NULL. Returns an exit code.
int octree_field_draw(const octree_field *field, const fm_octree_render_desc *desc, uint8_t *pixels);
void octree_field_end(octree_field *field);

// NULL, or what of `desc` it does not draw, as a message of bad usage.
const char *octree_field_wrong(const fm_octree_render_desc *desc);

#endif
