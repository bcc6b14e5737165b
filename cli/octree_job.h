// SPDX-License-Identifier: MIT
#ifndef FM_CLI_OCTREE_JOB_H
#define FM_CLI_OCTREE_JOB_H

// What the commands of octrees share: how an octree is to be made, of a mesh or of voxels, and what is told of one.

#include "cli.h"
#include "files.h"
#include "mesh_input.h"
#include "report.h"

#include "fathom/mesh_io.h"
#include "fathom/octree.h"

typedef struct octree_options {
    struct arg_str *kind, *cells, *box, *method, *rounds, *code, *band, *threshold, *top, *sign, *attribute, *solid;
    struct arg_lit *share, *quiet;
    cli_device device;
    mesh_input_options mesh;
    files_input input;
    bool field;  // --kind may be field, which is no octree
} octree_options;

typedef struct octree_job {
    const char *in;
    mesh_input mesh_in;  // how `in` is read where it is a mesh
    fm_context_desc wanted;
    fm_octree_desc desc;
    fm_read_desc read;  // of voxels
    double solid;       // threshold; NaN: what is not 0
    bool quiet, boxed;
    bool field;  // not an octree but the dense field of the mesh; the rest is as for FM_OCTREE_BRICKS
    // Filled as the work goes on.
    fm_context *context;
    fm_mesh *mesh;    // or
    fm_world *world;  // where IN is no mesh
    fm_octree *octree;
    fm_octree_info info;
    fm_device_info device;
    double wall_ms;
} octree_job;

// `cells`: the name of the option for the number of cells. `field`: --kind may be field.
void octree_options_add(cli_args *args, octree_options *options, const char *cells, bool field);
// False on bad usage, which has been said.
bool octree_options_read(const octree_options *options, const char *cells, const char *in, octree_job *job);

// Each returns an exit code; octree_job_end in any case.
int octree_job_begin(octree_job *job);   // makes the context
int octree_job_source(octree_job *job);  // reads the mesh or the voxels
int octree_job_build(octree_job *job);   // from that
void octree_job_end(octree_job *job);
// Says so where the octree is empty.
void octree_job_look_for_leaves(const octree_job *job, const fm_octree_info *info);

// A description of an octree, in lines that begin with four blanks.
void octree_text(FILE *stream, const fm_octree_info *info);
void octree_json(cJSON *root, const fm_octree_info *info);
// The same of a file's parts.
void octree_parts_text(FILE *stream, const fm_octree_parts_info *info);
void octree_parts_json(cJSON *root, const fm_octree_parts_info *info);
extern const char *const octree_kind_words[];

// The subcommands of `fathom octree`.
int octree_build(int argc, char **argv);
int octree_info(int argc, char **argv);
int octree_render(int argc, char **argv);

#endif
