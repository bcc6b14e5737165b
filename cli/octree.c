// SPDX-License-Identifier: MIT
// fathom octree: octrees are built into files, described, and drawn.

#include "commands.h"
#include "octree_job.h"
#include "progress.h"

#include <string.h>
#include <sys/stat.h>

static const struct {
    const char *name, *summary;
    int (*run)(int argc, char **argv);
} subcommands[] = {
    {"build", "build an octree of a mesh or of voxels into a file", octree_build},
    {"info", "describe an octree file", octree_info},
    {"render", "draw an octree file, or a mesh by its octree", octree_render},
};
enum { SUBCOMMANDS = sizeof subcommands / sizeof subcommands[0] };

static int print_subcommands(void) {
    printf("usage: fathom octree build|info|render [ARGUMENTS]\n\n"
           "Octrees of surfaces: vectors to closest points, signed distances, and voxels in several structures.\n\n");
    for (int i = 0; i < SUBCOMMANDS; i++) {
        printf("  %-8s %s\n", subcommands[i].name, subcommands[i].summary);
    }
    printf("\nfathom octree build --help has its arguments and examples, and so on.\n");
    return CLI_DONE;
}

int command_octree(int argc, char **argv) {
    if (argc < 2) {
        return cli_usage("octree: missing argument build, info or render: see fathom octree --help");
    }
    if (strcmp(argv[1], "--help") == 0 || strcmp(argv[1], "-h") == 0) {
        return print_subcommands();
    }
    for (int i = 0; i < SUBCOMMANDS; i++) {
        if (strcmp(argv[1], subcommands[i].name) == 0) {
            return subcommands[i].run(argc - 1, argv + 1);
        }
    }
    return cli_usage("octree: no command \"%s\": build, info and render are there", argv[1]);
}

// ---------------------------------------------------------------------------------------------------------------------------
// build
// ---------------------------------------------------------------------------------------------------------------------------

typedef struct build_request {
    octree_job job;
    const char *out;
    fm_octree_parts parts;
    fm_octree_parts_info written;
    bool divided, json;
} build_request;

static int write_parts(build_request *r) {
    if (!r->job.mesh) {
        return cli_usage("%s: is no mesh: --parts divides the octree of a mesh", r->job.in);
    }
    progress line = progress_wait("building parts", !r->job.quiet);
    const fm_result written = fm_octree_write_parts(r->job.mesh, &r->job.desc, &r->parts, r->out);
    progress_end(&line);
    if (written != FM_OK || fm_octree_read(r->job.context, r->out, &r->job.octree) != FM_OK ||
        fm_octree_describe_parts(r->job.context, r->out, false, &r->written) != FM_OK) {
        return cli_library_failed();
    }
    fm_octree_describe(r->job.octree, &r->job.info);
    octree_job_look_for_leaves(&r->job, &r->job.info);
    return CLI_DONE;
}

static int write_whole(build_request *r) {
    const int status = octree_job_build(&r->job);
    if (status != CLI_DONE) {
        return status;
    }
    return fm_octree_write(r->job.octree, r->out) == FM_OK ? CLI_DONE : cli_library_failed();
}

static int report(const build_request *r) {
    const octree_job *job = &r->job;
    FILE *stream = files_is_pipe(r->out) ? stderr : stdout;
    if (r->json) {
        cJSON *root = cJSON_CreateObject();
        cJSON_AddStringToObject(root, "input", job->in);
        cJSON_AddStringToObject(root, "output", r->out);
        octree_json(root, &job->info);
        if (r->divided) {
            octree_parts_json(root, &r->written);
        }
        cJSON_AddItemToObject(root, "device", report_device_json(&job->device));
        cJSON_AddNumberToObject(root, "build_milliseconds", job->info.build_ms);
        cJSON_AddNumberToObject(root, "gpu_milliseconds", job->info.gpu_ms);
        cJSON_AddNumberToObject(root, "wall_milliseconds", job->wall_ms);
        return report_json(stream, root) ? CLI_DONE : cli_fail("out of memory for the report: free some");
    }
    if (!job->quiet) {
        fprintf(stream, "%s\n", files_is_pipe(r->out) ? "standard output" : r->out);
        octree_text(stream, &job->info);
        if (r->divided) {
            octree_parts_text(stream, &r->written);
        } else {
            fprintf(stream, "    built in    %.1f ms, of which kernels %.1f ms, on %s (%s)\n", job->info.build_ms, job->info.gpu_ms,
                    job->device.name, job->device.driver);
        }
    }
    return CLI_DONE;
}

static int check_output(const char *path) {
    struct stat status;
    const size_t length = strlen(path);
    const bool special = files_is_pipe(path) || (stat(path, &status) == 0 && !S_ISREG(status.st_mode));
    if (!special && (length < 4 || strcmp(path + length - 4, ".fmo") != 0)) {
        return cli_usage("%s: octrees are .fmo files: end the name in .fmo", path);
    }
    return files_output_check(path);
}

static int build(build_request *r) {
    int status = check_output(r->out);
    if (status == CLI_DONE) {
        status = octree_job_begin(&r->job);
        status = status == CLI_DONE ? octree_job_source(&r->job) : status;
        status = status != CLI_DONE ? status : r->divided ? write_parts(r) : write_whole(r);
        status = status == CLI_DONE ? report(r) : status;
        octree_job_end(&r->job);
    }
    return status;
}

int octree_build(int argc, char **argv) {
    static const cli_help help = {
        "octree build",
        "Builds an octree of a mesh, or of voxels (kinds voxels, svo, dag, tree64), into an .fmo file. With --parts, the file\n"
        "holds a coarse octree and finer ones of the parts of the box, of which fathom octree render loads what it sees.",
        "fathom octree build armadillo.obj armadillo.fmo --size 1024\n"
        "fathom octree build hall.glb hall.fmo --size 2048 --code octahedral --share\n"
        "fathom octree build terrain.vox terrain.fmo --kind dag\n"
        "fathom octree build lucy.ply lucy.fmo --size 8192 --parts 16\n"};
    cli_args args = {0};
    octree_options options;
    struct arg_str *in = cli_add(
        &args, arg_str1(NULL, NULL, "MESH|VOXELS",
                        "a mesh file, or a volume of voxels; - reads voxels from standard input, .npy unless told otherwise"));
    struct arg_str *out = cli_add(&args, arg_str1(NULL, NULL, "OUT.fmo", "the octree; - writes to standard output"));
    octree_options_add(&args, &options, "size", false);
    struct arg_str *parts = cli_add(&args, arg_str0(NULL, "parts", "N", "divide the box into parts, N along its longest edge"));
    struct arg_str *coarse =
        cli_add(&args, arg_str0(NULL, "coarse", "N", "with --parts: cells of the coarse octree; default an eighth of --size"));
    struct arg_lit *json = cli_add(&args, arg_lit0(NULL, "json", "print the report as JSON"));
    int status;
    if (cli_parse(&args, &help, argc, argv, &status)) {
        build_request r = {.out = out->sval[0], .divided = parts->count > 0, .json = json->count > 0};
        status = CLI_USAGE;
        if (coarse->count && !parts->count) {
            cli_usage("--coarse is given without --parts");
        } else if (r.divided && files_is_pipe(r.out)) {
            cli_usage("--parts needs a file: OUT.fmo is -");
        } else if (octree_options_read(&options, "size", in->sval[0], &r.job) &&
                   (!parts->count || cli_uint32("--parts", parts->sval[0], 1, &r.parts.parts)) &&
                   (!coarse->count || cli_uint32("--coarse", coarse->sval[0], 1, &r.parts.coarse))) {
            status = build(&r);
        }
    }
    cli_free(&args);
    return status;
}

// ---------------------------------------------------------------------------------------------------------------------------
// info
// ---------------------------------------------------------------------------------------------------------------------------

typedef struct description {
    const char *path;
    fm_octree_info info;
    bool parts;  // there are some and they have been checked
    fm_octree_parts_info about;
} description;

static bool can_read_parts(const char *path) {
    return !files_begins(path, "\x1f\x8b", 2) && files_begins(path, "", 0);
}

static fm_result look(fm_context *context, description *d) {
    fm_octree *octree = NULL;
    const fm_result result = fm_octree_read(context, d->path, &octree);
    if (result == FM_OK) {
        fm_octree_describe(octree, &d->info);
        fm_octree_destroy(octree);
        d->parts = d->info.parts > 0 && can_read_parts(d->path);
    }
    return result == FM_OK && d->parts ? fm_octree_describe_parts(context, d->path, true, &d->about) : result;
}

static int print_json(const description *d) {
    cJSON *root = cJSON_CreateObject();
    cJSON_AddStringToObject(root, "path", d->path);
    octree_json(root, &d->info);
    if (d->info.parts > 0) {
        cJSON_AddBoolToObject(root, "parts_checked", d->parts);
    }
    if (d->parts) {
        octree_parts_json(root, &d->about);
    }
    return report_json(stdout, root) ? CLI_DONE : cli_fail("out of memory for the description: free some");
}

static void print_text(const description *d) {
    printf("%s\n", d->path);
    octree_text(stdout, &d->info);
    if (d->parts) {
        octree_parts_text(stdout, &d->about);
    } else if (d->info.parts > 0) {
        printf("    parts       %u, not checked: that takes a file by its name, not gzipped\n", d->info.parts);
    }
}

static int describe(const char *path, bool json) {
    const fm_context_desc cpu = {.backend = FM_BACKEND_CPU, .threads = 1};
    fm_context *context = NULL;
    description d = {.path = path};
    int status = CLI_DONE;
    if (fm_context_create(&cpu, &context) != FM_OK || look(context, &d) != FM_OK) {
        status = cli_library_failed();
    } else if (json) {
        status = print_json(&d);
    } else {
        print_text(&d);
    }
    fm_context_destroy(context);
    return status;
}

int octree_info(int argc, char **argv) {
    static const cli_help help = {
        "octree info",
        "Describes an octree file. All of it is checked: checksums, and that rays find their way; of files with parts\n"
        "the coarse octree and every part, unless the file is gzipped or comes through a pipe.",
        "fathom octree info armadillo.fmo\n"
        "fathom octree info --json lucy.fmo\n"};
    cli_args args = {0};
    struct arg_str *in = cli_add(&args, arg_str1(NULL, NULL, "FILE.fmo", "an octree; - reads standard input"));
    struct arg_lit *json = cli_add(&args, arg_lit0(NULL, "json", "print the description as JSON"));
    int status;
    if (cli_parse(&args, &help, argc, argv, &status)) {
        status = describe(in->sval[0], json->count > 0);
    }
    cli_free(&args);
    return status;
}
