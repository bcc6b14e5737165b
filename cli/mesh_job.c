// SPDX-License-Identifier: MIT
#include "mesh_job.h"

#include "files.h"
#include "words.h"

#include <inttypes.h>
#include <math.h>
#include <stdlib.h>
#include <string.h>

void mesh_options_add(cli_args *args, mesh_options *o, const char *out, const char *margin) {
    o->in = cli_add(
        args, arg_str1(NULL, NULL, "MESH",
                       "a mesh: PLY, OBJ, STL, glTF; - reads standard input, by --input-format where its first bytes do not tell"));
    o->out = cli_add(args, arg_str1(NULL, NULL, "OUT", out));
    mesh_input_add(args, &o->mesh);
    o->size = cli_add(args, arg_str0(NULL, "size", "N", "voxels along the longest edge; default 256"));
    o->margin = cli_add(args, arg_str0(NULL, "margin", "N", margin));
    o->box = cli_add(args, arg_str0(NULL, "box", "X0,Y0,Z0,X1,Y1,Z1", "what the grid covers; default: the mesh and the margin"));
    cli_device_add(args, &o->device);
    o->slice = cli_add(args, arg_str0(NULL, "slice", "FILE.png", "write a picture of the middle slice too"));
    o->format = cli_add(args, arg_str0(NULL, "format", "FORMAT", "format to write; default by name"));
    o->compress = cli_add(args, arg_lit0(NULL, "compress", "gzip; a name that ends in .gz asks for it too"));
    o->quiet = cli_add(args, arg_lit0("q", "quiet", "print nothing but errors"));
    o->json = cli_add(args, arg_lit0(NULL, "json", "print the report as JSON"));
}

static bool check_combinations(const mesh_options *o, const mesh_job *job) {
    const char *wrong = NULL;
    if (o->box->count && o->margin->count) {
        wrong = "--box and --margin are both given: the margin lies around the mesh, a box is taken as it is";
    } else if (!job->boxed && job->margin > (job->size - 1) / 2) {
        cli_usage("--margin is %u: at most %u of %u voxels, so that one is left for the mesh", job->margin, (job->size - 1) / 2,
                  job->size);
        return false;
    } else if (files_same(job->out, job->slice)) {
        wrong = "two outputs are the same file: give each its own name";
    } else if (job->slice && files_is_pipe(job->slice)) {
        wrong = "--slice is -: a picture needs a file name";
    }
    if (wrong) {
        cli_usage("%s", wrong);
    }
    return !wrong;
}

bool mesh_options_read(const mesh_options *o, uint32_t margin, mesh_job *job) {
    *job = (mesh_job){
        .in = {.path = o->in->sval[0], .quiet = o->quiet->count > 0}, .out = o->out->sval[0], .size = 256, .margin = margin};
    job->slice = o->slice->count ? o->slice->sval[0] : NULL;
    job->write.compress = o->compress->count > 0;
    job->quiet = o->quiet->count > 0;
    job->json = o->json->count > 0;
    job->boxed = o->box->count > 0;
    if (!mesh_input_options_read(&o->mesh, &job->in) ||
        (o->size->count && !cli_uint32("--size", o->size->sval[0], 1, &job->size)) ||
        (o->margin->count && !cli_uint32("--margin", o->margin->sval[0], 0, &job->margin)) ||
        !cli_device_read(&o->device, &job->wanted) ||
        (o->format->count && !cli_format("--format", o->format->sval[0], &job->write.format)) ||
        (job->boxed && !cli_box("--box", o->box->sval[0], job->box))) {
        return false;
    }
    if (job->size > 16384) {
        cli_usage("--size is %u: at most 16384 is wanted", job->size);
        return false;
    }
    // A mesh small in voxels needs no more room than it has.
    if (!o->margin->count && job->margin > (job->size - 1) / 2) {
        job->margin = (job->size - 1) / 2;
    }
    return check_combinations(o, job);
}

void mesh_job_fit_box(const double box[6], uint32_t size, fm_volume_desc *grid) {
    const double *low = box, *high = box + 3;
    const double longest = fmax(high[0] - low[0], fmax(high[1] - low[1], high[2] - low[2]));
    const double spacing = longest / size;
    uint32_t *const counts[3] = {&grid->shape.x, &grid->shape.y, &grid->shape.z};
    for (int axis = 0; axis < 3; axis++) {
        *counts[axis] = (uint32_t)fmax(1, ceil((high[axis] - low[axis]) / spacing * (1 - 1e-12)));
        grid->spacing[axis] = spacing;
        grid->origin[axis] = low[axis] + spacing / 2;
    }
}

int mesh_job_begin(mesh_job *job) {
    int checked = files_output_check(job->out);
    if (checked == CLI_DONE && job->slice) {
        checked = files_picture_check(job->slice);
    }
    if (checked != CLI_DONE) {
        return checked;
    }
    if (fm_context_create(&job->wanted, &job->context) != FM_OK) {
        return cli_library_failed();
    }
    fm_context_device(job->context, &job->device);
    const int status = mesh_input_load(&job->in, job->context, &job->mesh, &job->file);
    if (status != CLI_DONE) {
        return status;
    }
    if (job->boxed) {
        mesh_job_fit_box(job->box, job->size, &job->grid);
    } else if (fm_mesh_fit(job->mesh, job->size, job->margin, &job->grid) != FM_OK) {
        return cli_library_failed();
    }
    return CLI_DONE;
}

void mesh_job_end(mesh_job *job) {
    fm_mesh_destroy(job->mesh);
    fm_context_destroy(job->context);
}

fm_result mesh_job_volume(const mesh_job *job, fm_type type, fm_volume **volume) {
    fm_volume_desc desc = job->grid;
    desc.type = type;
    return fm_volume_create(job->context, &desc, volume);
}

fm_result mesh_job_timed(mesh_job *job, double started_ms) {
    job->pass_count = REPORT_MAX_PASSES;
    const fm_result result = fm_context_passes(job->context, &job->pass_count, job->passes);
    job->wall_ms = fm_now_ms() - started_ms;
    return result;
}

static int write_one(mesh_job *job, const mesh_output *output, const char *slice, fm_color_map map, fm_file_batch *batch) {
    fm_volume_desc about;
    fm_volume_info(output->volume, &about);
    const fm_slice_desc picture = {.map = map, .batch = batch};
    if (slice && fm_slice_png(output->volume, 2, about.shape.z / 2, &picture, slice, &job->shown) != FM_OK) {
        return cli_library_failed();
    }
    fm_write_desc desc = output->desc;
    desc.batch = batch;
    return files_write(output->path, output->volume, &desc, job->quiet);
}

int mesh_job_write(mesh_job *job, const mesh_output *outputs, int count, fm_color_map map) {
    fm_file_batch *batch;
    if (fm_file_batch_create(NULL, &batch) != FM_OK) {
        return cli_library_failed();
    }
    int status = CLI_DONE;
    // The first, which may go to standard output, comes last.
    for (int i = count; status == CLI_DONE && i-- > 0;) {
        if (outputs[i].path) {
            status = write_one(job, &outputs[i], i == 0 ? job->slice : NULL, map, batch);
        }
    }
    if (status == CLI_DONE && fm_file_batch_commit(batch) != FM_OK) {
        status = cli_library_failed();
    }
    fm_file_batch_destroy(batch);
    return status;
}

void mesh_job_text(FILE *stream, const mesh_job *job) {
    const fm_shape shape = job->grid.shape;
    fprintf(stream, "%s: %" PRIu64 " vertices, %" PRIu64 " triangles\n", job->in.path, job->file.vertices, job->file.triangles);
    if (job->file.note[0]) {
        fprintf(stream, "note: %s\n", job->file.note);
    }
    if (job->note[0]) {
        fprintf(stream, "note: %s\n", job->note);
    }
    fprintf(stream, "grid: %u x %u x %u voxels of %.6g, from %.6g, %.6g, %.6g\n", shape.x, shape.y, shape.z, job->grid.spacing[0],
            job->grid.origin[0], job->grid.origin[1], job->grid.origin[2]);
    fprintf(stream, "backend: %s, %s (%s)\n\n", fm_backend_words[fm_context_backend(job->context)], job->device.name,
            job->device.driver);
    report_passes(stream, job->passes, job->pass_count);
    fprintf(stream, "\nwall time, first use included: %.1f ms\n", job->wall_ms);
}

cJSON *mesh_job_json(const mesh_job *job) {
    cJSON *root = cJSON_CreateObject();
    cJSON_AddStringToObject(root, "input", job->in.path);
    cJSON_AddNumberToObject(root, "vertices", (double)job->file.vertices);
    cJSON_AddNumberToObject(root, "triangles", (double)job->file.triangles);
    cJSON_AddStringToObject(root, "note", job->file.note);
    cJSON_AddStringToObject(root, "mesh_note", job->note);
    cJSON_AddItemToObject(root, "shape", report_shape_json(job->grid.shape));
    cJSON_AddItemToObject(root, "spacing", cJSON_CreateDoubleArray(job->grid.spacing, 3));
    cJSON_AddItemToObject(root, "origin", cJSON_CreateDoubleArray(job->grid.origin, 3));
    cJSON_AddStringToObject(root, "backend", fm_backend_words[fm_context_backend(job->context)]);
    cJSON_AddItemToObject(root, "device", report_device_json(&job->device));
    cJSON_AddItemToObject(root, "passes", report_passes_json(job->passes, job->pass_count));
    cJSON_AddNumberToObject(root, "wall_milliseconds", job->wall_ms);
    cJSON_AddStringToObject(root, "output", job->out);
    if (job->slice) {
        cJSON_AddStringToObject(root, "slice", job->slice);
    }
    return root;
}
