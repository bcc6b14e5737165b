// SPDX-License-Identifier: MIT
// fathom voxelize: the voxels of a mesh.

#include "commands.h"
#include "files.h"
#include "mesh_job.h"
#include "words.h"

typedef struct voxelize_request {
    mesh_job job;
    fm_voxelize_desc desc;
} voxelize_request;

static int report(const voxelize_request *r) {
    const mesh_job *job = &r->job;
    FILE *stream = files_is_pipe(job->out) ? stderr : stdout;
    const char *what = r->desc.separation == FM_SEPARATION_26 ? "conservative" : "thin";
    if (job->json) {
        cJSON *root = mesh_job_json(job);
        cJSON_AddStringToObject(root, "surface", what);
        cJSON_AddBoolToObject(root, "solid", r->desc.solid);
        return report_json(stream, root) ? CLI_DONE : cli_fail("out of memory for the report: free some");
    }
    if (!job->quiet) {
        mesh_job_text(stream, job);
        fprintf(stream, "%s: %s surface%s\n", files_is_pipe(job->out) ? "standard output" : job->out, what,
                r->desc.solid ? ", filled" : "");
        if (job->slice) {
            fprintf(stream, "%s: middle slice across z\n", job->slice);
        }
    }
    return CLI_DONE;
}

static fm_result note_openness(mesh_job *job) {
    fm_mesh_info info;
    const fm_result result = fm_mesh_describe(job->mesh, &info);
    if (result == FM_OK && !info.closed && info.triangles > info.dropped) {
        snprintf(job->note, sizeof job->note,
                 "the mesh is not closed: --solid may fill too much or too little (fathom info tells)");
    }
    return result;
}

static int run(voxelize_request *r) {
    mesh_job *job = &r->job;
    fm_volume *voxels = NULL;
    int status = mesh_job_begin(job);
    if (status == CLI_DONE) {
        const double started = fm_now_ms();
        if (mesh_job_volume(job, FM_TYPE_U8, &voxels) != FM_OK || fm_mesh_voxelize(job->mesh, &r->desc, voxels, NULL) != FM_OK ||
            mesh_job_timed(job, started) != FM_OK || (r->desc.solid && note_openness(job) != FM_OK)) {
            status = cli_library_failed();
        }
    }
    if (status == CLI_DONE) {
        const mesh_output output = {job->out, voxels, job->write};
        status = mesh_job_write(job, &output, 1, FM_COLOR_AUTO);
    }
    status = status == CLI_DONE ? report(r) : status;
    fm_volume_destroy(voxels);
    mesh_job_end(job);
    return status;
}

int command_voxelize(int argc, char **argv) {
    static const cli_help help = {"voxelize",
                                  "Sets the voxels that a mesh touches: 1 there, 0 elsewhere. No path leads through the surface.",
                                  "fathom voxelize bunny.ply bunny.vox --size 126\n"
                                  "fathom voxelize part.stl part.npy --size 512 --solid\n"
                                  "fathom voxelize room.glb room.npy --thin --slice room.png\n"};
    cli_args args = {0};
    mesh_options options;
    mesh_options_add(&args, &options, "the voxels, of type u8; - writes .npy to standard output",
                     "voxels left around the mesh; default 1");
    struct arg_lit *solid = cli_add(&args, arg_lit0(NULL, "solid", "fill the inside too; for closed meshes"));
    struct arg_lit *thin = cli_add(&args, arg_lit0(NULL, "thin", "fewer voxels: paths over edges and corners may lead through"));
    int status;
    if (cli_parse(&args, &help, argc, argv, &status)) {
        voxelize_request request = {0};
        status = mesh_options_read(&options, 1, &request.job) ? CLI_DONE : CLI_USAGE;
        request.desc.solid = solid->count > 0;
        request.desc.separation = thin->count ? FM_SEPARATION_6 : FM_SEPARATION_26;
        status = status == CLI_DONE ? run(&request) : status;
    }
    cli_free(&args);
    return status;
}
