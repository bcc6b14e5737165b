// SPDX-License-Identifier: MIT
// fathom sdf: a signed distance field of a mesh.

#include "commands.h"
#include "files.h"
#include "mesh_job.h"
#include "words.h"

#include <math.h>
#include <string.h>

static const char *const far_words[] = {"band", "flooded", "exact", NULL};

typedef struct sdf_args {
    mesh_options mesh;
    struct arg_str *band, *sign, *far_texels, *triangles;
} sdf_args;

typedef struct sdf_request {
    mesh_job job;
    fm_sdf_desc desc;
    fm_sdf_info info;
    const char *triangles;
} sdf_request;

static bool is_npy(const mesh_job *job) {
    const char *end = strstr(job->out, ".npy");
    return job->write.format == FM_FORMAT_NPY ||
           (job->write.format == FM_FORMAT_AUTO &&
            (files_is_pipe(job->out) || (end && (strcmp(end, ".npy") == 0 || strcmp(end, ".npy.gz") == 0))));
}

static void report_text(FILE *stream, const sdf_request *r) {
    const mesh_job *job = &r->job;
    mesh_job_text(stream, job);
    fprintf(stream, "sign: %s, %s\n", mesh_sign_words[r->info.sign], r->info.sign_why);
    fprintf(stream, "%s: ", files_is_pipe(job->out) ? "standard output" : job->out);
    if (r->desc.far_texels == FM_FAR_EXACT) {
        fprintf(stream, "distances, exact everywhere\n");
    } else {
        fprintf(stream, "distances, exact within %g voxels; beyond: %s\n", (double)r->desc.band,
                r->desc.far_texels == FM_FAR_BAND ? "the band's width" : "flooded");
    }
    if (is_npy(job)) {
        fprintf(stream, "note: .npy keeps neither spacing nor origin; .nrrd does\n");
    }
    if (r->triangles) {
        fprintf(stream, "%s: nearest triangles\n", r->triangles);
    }
    if (job->slice) {
        fprintf(stream, "%s: middle slice across z, values %g to %g\n", job->slice, job->shown.min, job->shown.max);
    }
}

static int report(const sdf_request *r) {
    const mesh_job *job = &r->job;
    // What is printed must not get between the bytes of the field.
    FILE *stream = files_is_pipe(job->out) ? stderr : stdout;
    if (job->json) {
        cJSON *root = mesh_job_json(job);
        cJSON_AddStringToObject(root, "sign", mesh_sign_words[r->info.sign]);
        cJSON_AddStringToObject(root, "sign_why", r->info.sign_why);
        cJSON_AddStringToObject(root, "far", far_words[r->desc.far_texels]);
        const bool everywhere = r->desc.far_texels == FM_FAR_EXACT;
        cJSON_AddItemToObject(root, "band", everywhere ? cJSON_CreateNull() : cJSON_CreateNumber((double)r->desc.band));
        if (r->triangles) {
            cJSON_AddStringToObject(root, "triangles_output", r->triangles);
        }
        return report_json(stream, root) ? CLI_DONE : cli_fail("out of memory for the report: free some");
    }
    if (!job->quiet) {
        report_text(stream, r);
    }
    return CLI_DONE;
}

static int compute(sdf_request *r, fm_volume **distance, fm_volume **triangles) {
    mesh_job *job = &r->job;
    if (mesh_job_volume(job, FM_TYPE_F32, distance) != FM_OK ||
        (r->triangles && mesh_job_volume(job, FM_TYPE_U32, triangles) != FM_OK)) {
        return cli_library_failed();
    }
    const double started = fm_now_ms();
    if (fm_mesh_sdf(job->mesh, &r->desc, *distance, *triangles, &r->info, NULL) != FM_OK || mesh_job_timed(job, started) != FM_OK ||
        mesh_input_note(job->mesh, *distance, r->info.sign, 0, job->note) != FM_OK) {
        return cli_library_failed();
    }
    return CLI_DONE;
}

static int run(sdf_request *r) {
    mesh_job *job = &r->job;
    fm_volume *distance = NULL, *triangles = NULL;
    int status = r->triangles ? files_output_check(r->triangles) : CLI_DONE;
    status = status == CLI_DONE ? mesh_job_begin(job) : status;
    status = status == CLI_DONE ? compute(r, &distance, &triangles) : status;
    if (status == CLI_DONE) {
        mesh_output outputs[2] = {{job->out, distance, job->write}, {r->triangles, triangles, {0}}};
        if (r->desc.far_texels == FM_FAR_FLOODED) {
            outputs[0].desc.band = (double)r->desc.band * job->grid.spacing[0];
        }
        status = mesh_job_write(job, outputs, 2, r->info.sign == FM_SIGN_NONE ? FM_COLOR_AUTO : FM_COLOR_DIVERGING);
    }
    status = status == CLI_DONE ? report(r) : status;
    fm_volume_destroy(distance);
    fm_volume_destroy(triangles);
    mesh_job_end(job);
    return status;
}

static bool read_band(const sdf_args *a, sdf_request *r) {
    r->desc.band = 3;
    const bool full = a->band->count && strcmp(a->band->sval[0], "full") == 0;
    int far_texels = full ? FM_FAR_EXACT : FM_FAR_BAND;
    if (a->far_texels->count && !cli_word("--far", a->far_texels->sval[0], far_words, &far_texels)) {
        return false;
    }
    if (full && far_texels != FM_FAR_EXACT) {
        cli_usage("--far is %s with --band full: a full band leaves nothing beyond; leave one of the two out",
                  far_words[far_texels]);
        return false;
    }
    r->desc.far_texels = (fm_far)far_texels;
    if (a->band->count && !full) {
        double band;
        if (!cli_double("--band", a->band->sval[0], &band)) {
            return false;
        }
        if (!(band > 0 && band <= 16384)) {
            cli_usage("--band is %s: voxels, above 0 and at most 16384, or the word full are wanted", a->band->sval[0]);
            return false;
        }
        r->desc.band = (float)band;
    }
    return true;
}

static bool read_request(const sdf_args *a, sdf_request *r) {
    *r = (sdf_request){0};
    int sign = 0;
    if (!read_band(a, r) || (a->sign->count && !cli_word("--sign", a->sign->sval[0], mesh_sign_words, &sign)) ||
        !mesh_options_read(&a->mesh, (uint32_t)ceilf(r->desc.band) + 1, &r->job)) {
        return false;
    }
    r->desc.sign = (fm_sign)sign;
    r->triangles = a->triangles->count ? a->triangles->sval[0] : NULL;
    if (files_same(r->job.out, r->triangles) || files_same(r->triangles, r->job.slice)) {
        cli_usage("two outputs are the same file: give each its own name");
        return false;
    }
    return true;
}

int command_sdf(int argc, char **argv) {
    static const cli_help help = {
        "sdf",
        "Computes the signed distance field of a mesh: exact within a band around it, negative inside. Closed meshes tell the "
        "side\n"
        "by the normals of what is nearest, others by how often they go around a place; the report says which and why.",
        "fathom sdf bunny.ply bunny.npy --slice bunny.png\n"
        "fathom sdf armadillo.obj armadillo.nvdb --size 512 --band 3\n"
        "fathom sdf part.stl part.nrrd --band full --triangles nearest.npy\n"
        "fathom sdf room.glb room.npy --box=-4,-4,0,4,4,3 --sign none\n"};
    cli_args args = {0};
    sdf_args a;
    mesh_options_add(&args, &a.mesh, "the field, of type f32; - writes .npy to standard output",
                     "voxels left around the mesh; default the band and 1");
    a.band = cli_add(&args, arg_str0(NULL, "band", "W|full", "voxels from the surface that are exact; default 3; full: all"));
    a.far_texels = cli_add(&args, arg_str0(NULL, "far", "band|flooded|exact", "what lies beyond gets; default the band's width"));
    a.sign = cli_add(&args, arg_str0(NULL, "sign", "SIGN", "auto (default), pseudonormal, winding or none"));
    a.triangles = cli_add(&args, arg_str0(NULL, "triangles", "FILE", "write the number of the nearest triangle too"));
    int status;
    if (cli_parse(&args, &help, argc, argv, &status)) {
        sdf_request request;
        status = read_request(&a, &request) ? run(&request) : CLI_USAGE;
    }
    cli_free(&args);
    return status;
}
