// SPDX-License-Identifier: MIT
#ifndef FM_CLI_MESH_JOB_H
#define FM_CLI_MESH_JOB_H

// What the commands share that lay a grid around a mesh: their options, the mesh and the grid, and the report.

#include "cli.h"
#include "mesh_input.h"
#include "report.h"

typedef struct mesh_options {
    struct arg_str *in, *out, *size, *margin, *box, *slice, *format;
    cli_device device;
    struct arg_lit *compress, *quiet, *json;
    mesh_input_options mesh;
} mesh_options;

typedef struct mesh_job {
    mesh_input in;
    const char *out, *slice;
    fm_context_desc wanted;
    fm_write_desc write;
    uint32_t size, margin;
    bool boxed, quiet, json;
    double box[6];  // low and high corner
    // Filled as the work goes on.
    fm_context *context;
    fm_mesh *mesh;
    fm_mesh_file_info file;
    char note[MESH_NOTE];  // what to know of the mesh; the command's to fill
    fm_volume_desc grid;
    fm_device_info device;
    fm_pass passes[REPORT_MAX_PASSES];
    uint32_t pass_count;
    double wall_ms;
    fm_slice_info shown;
} mesh_job;

// `margin`: the default's words.
void mesh_options_add(cli_args *args, mesh_options *options, const char *out, const char *margin);
bool mesh_options_read(const mesh_options *options, uint32_t margin, mesh_job *job);

// Makes the context, reads the mesh and lays the grid. Returns an exit code; mesh_job_end in any case.
int mesh_job_begin(mesh_job *job);
void mesh_job_end(mesh_job *job);

// A grid of cubic voxels, `size` of them along the box's longest edge. The rest of `grid` stays.
void mesh_job_fit_box(const double box[6], uint32_t size, fm_volume_desc *grid);

// A volume of the grid, where the context computes.
fm_result mesh_job_volume(const mesh_job *job, fm_type type, fm_volume **volume);
// Notes passes and wall time after the work.
fm_result mesh_job_timed(mesh_job *job, double started_ms);

typedef struct mesh_output {
    const char *path;  // NULL: not wanted
    const fm_volume *volume;
    fm_write_desc desc;
} mesh_output;

// Writes the outputs, and a picture of the middle slice of the first, all or none. Returns an exit code.
int mesh_job_write(mesh_job *job, const mesh_output *outputs, int count, fm_color_map map);

// The beginning of the report, up to the passes and the wall time.
void mesh_job_text(FILE *stream, const mesh_job *job);
cJSON *mesh_job_json(const mesh_job *job);

#endif
