// SPDX-License-Identifier: MIT
// fathom bench mesh: meshes that move, in the order mesh, mode, size, rays, mask.

#include "cli.h"
#include "commands.h"
#include "mesh.h"
#include "table.h"
#include "words.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

enum { MAX_LIST = 16, MOST_RAYS = 64, MOST_COARSE = 1024, MOST_EDGE = 4096 };

typedef struct mesh_plan {
    const char *meshes[MAX_LIST];
    int modes[MAX_LIST];
    uint32_t sizes[MAX_LIST], edges[MAX_LIST], rays[MAX_LIST];
    float masks[MAX_LIST];
    int mesh_count, mode_count, size_count, edge_count, ray_count, mask_count;
    int flood, sign;
    uint32_t moving;
    double band;
    uint32_t triangles;
    bool still;
    bench_mesh_limits limits;
    bench_session_desc session;
    const char *csv, *json;
    bool quiet;
} mesh_plan;

typedef struct mesh_tables {
    table csv, json;
    cJSON *results;
    bool measured, failed;
} mesh_tables;

static void measure(const mesh_plan *plan, bench_session *session, const bench_mesh_case *what, mesh_tables *out) {
    static bench_mesh_result result;
    if (!bench_mesh_measure(session, what, &plan->limits, &result)) {
        cli_fail("bench mesh: %s, %s: %s", what->mesh->name, bench_mesh_mode_words[what->mode], result.failure);
        out->failed = true;
    }
    if (!plan->quiet) {
        bench_mesh_print(stdout, &result);
    }
    out->measured = true;
    if (out->csv.stream) {
        bench_mesh_csv(out->csv.stream, &result);
    }
    if (out->results) {
        cJSON_AddItemToArray(out->results, bench_mesh_json(&result));
    }
}

static void measure_rtsdf(const mesh_plan *plan, bench_session *session, bench_mesh_case *what, mesh_tables *out) {
    for (int s = 0; s < plan->size_count; s++) {
        for (int r = 0; r < plan->ray_count; r++) {
            for (int m = 0; m < plan->mask_count; m++) {
                what->edge = plan->sizes[s];
                what->rays = plan->rays[r];
                what->mask = plan->masks[m];
                measure(plan, session, what, out);
            }
        }
    }
}

static void measure_mode(const mesh_plan *plan, bench_session *session, const bench_mesh *mesh, int mode, mesh_tables *out) {
    bench_mesh_case what = {.mesh = mesh,
                            .mode = (bench_mesh_mode)mode,
                            .flood = (fm_flood)plan->flood,
                            .sign = (fm_sign)plan->sign,
                            .band = (float)plan->band,
                            .moving = plan->moving};
    if (what.mode == BENCH_MESH_RTSDF) {
        measure_rtsdf(plan, session, &what, out);
        return;
    }
    const int count = what.mode < BENCH_MESH_BUILD ? plan->edge_count : 1;
    for (int i = 0; i < count; i++) {
        what.edge = plan->edges[i];
        measure(plan, session, &what, out);
    }
}

static bool print_device(const mesh_plan *plan, bench_session *session) {
    fm_context *context = bench_session_context(session, FM_BACKEND_AUTO);
    const double bandwidth = context ? bench_session_bandwidth(session, FM_BACKEND_AUTO) : 0;
    if (bandwidth <= 0) {
        return false;
    }
    fm_device_info device;
    fm_context_device(context, &device);
    if (!plan->quiet) {
        printf("%s (%s): copy %.1f GB/s, read and written bytes counted\n", device.name, device.driver, bandwidth * 1e-9);
        printf("times of kernels and passes are %s, medians; wall: until the answer is there; move: new positions\n\n",
               device.kind == FM_DEVICE_HOST ? "by the processor's clock" : "GPU timestamps");
        bench_mesh_print_header(stdout);
    }
    return true;
}

static int measure_meshes(const mesh_plan *plan, bench_mesh *const *meshes, mesh_tables *out) {
    bench_session *session = bench_session_create(&plan->session);
    if (!session) {
        return cli_fail("out of memory: free some");
    }
    const int status = print_device(plan, session) ? CLI_DONE : cli_library_failed();
    for (int i = 0; status == CLI_DONE && i < plan->mesh_count; i++) {
        for (int m = 0; m < plan->mode_count; m++) {
            measure_mode(plan, session, meshes[i], plan->modes[m], out);
        }
    }
    bench_session_destroy(session);
    return status == CLI_DONE && out->failed ? CLI_FAILED : status;
}

// Files are read before anything is measured.
static int measure_all(const mesh_plan *plan, mesh_tables *out) {
    bench_mesh *meshes[MAX_LIST] = {NULL};
    int status = CLI_DONE;
    for (int i = 0; status == CLI_DONE && i < plan->mesh_count; i++) {
        meshes[i] = bench_mesh_create(plan->meshes[i], plan->triangles, plan->still);
        status = meshes[i] ? CLI_DONE : cli_library_failed();
    }
    status = status == CLI_DONE ? measure_meshes(plan, meshes, out) : status;
    for (int i = 0; i < plan->mesh_count; i++) {
        bench_mesh_destroy(meshes[i]);
    }
    return status;
}

static int run(const mesh_plan *plan) {
    int status = tables_check((const char *const[]){plan->csv, plan->json}, 2);
    if (status != CLI_DONE) {
        return status;
    }
    mesh_tables out = {.results = plan->json ? cJSON_CreateArray() : NULL};
    if (!table_begin(plan->csv, &out.csv) || !table_begin(plan->json, &out.json)) {
        status = cli_fail("out of memory: free some");
    } else {
        if (out.csv.stream) {
            bench_mesh_csv_header(out.csv.stream);
        }
        status = measure_all(plan, &out);
    }
    if (out.json.stream && !table_json(&out.json, out.results)) {
        status = CLI_FAILED;
        out.measured = false;
    }
    status = table_end(&out.csv, out.measured, status);
    return table_end(&out.json, out.measured, status);
}

static bool take_mesh(const char *option, const char *word, void *user) {
    (void)option;
    static char names[MAX_LIST][1024];
    mesh_plan *plan = user;
    snprintf(names[plan->mesh_count], sizeof names[0], "%s", word);
    plan->meshes[plan->mesh_count] = names[plan->mesh_count];
    plan->mesh_count++;
    return true;
}

// S, M and L are the published sizes.
static bool take_size(const char *option, const char *word, void *user) {
    static const char letters[] = "sml";
    mesh_plan *plan = user;
    uint32_t *size = &plan->sizes[plan->size_count++];
    const char *letter = word[0] && !word[1] ? strchr(letters, word[0] | 32) : NULL;
    if (letter) {
        *size = 64u << (letter - letters);
        return true;
    }
    if (!cli_uint32(option, word, 1, size)) {
        return false;
    }
    if (*size > MOST_COARSE) {
        cli_usage("%s is %s: S, M, L or 1 to %d", option, word, MOST_COARSE);
        return false;
    }
    return true;
}

static bool take_edge(const char *option, const char *word, void *user) {
    mesh_plan *plan = user;
    uint32_t *edge = &plan->edges[plan->edge_count++];
    if (cli_uint32(option, word, 1, edge) && *edge > MOST_EDGE) {
        cli_usage("%s is %s: 1 to %d", option, word, MOST_EDGE);
        return false;
    }
    return *edge > 0;
}

static bool take_rays(const char *option, const char *word, void *user) {
    mesh_plan *plan = user;
    uint32_t *rays = &plan->rays[plan->ray_count++];
    if (!cli_uint32(option, word, 0, rays)) {
        return false;
    }
    if (*rays > MOST_RAYS) {
        cli_usage("%s is %s: 0 to %d", option, word, MOST_RAYS);
        return false;
    }
    return true;
}

static bool take_mask(const char *option, const char *word, void *user) {
    mesh_plan *plan = user;
    float *mask = &plan->masks[plan->mask_count++];
    double value = INFINITY;
    if (strcmp(word, "inf") != 0 && !cli_double(option, word, &value)) {
        return false;
    }
    if (value <= 0) {
        cli_usage("%s is %s: above 0, or inf", option, word);
        return false;
    }
    *mask = (float)value;
    return true;
}

typedef struct mesh_args {
    struct arg_str *mesh, *triangles, *mode, *size, *edge, *rays, *mask, *flood, *moving, *band, *sign, *frames, *seconds, *warm_up,
        *check, *backend, *device, *threads, *csv, *json;
    struct arg_lit *still, *quiet;
} mesh_args;

static void add_options(cli_args *args, mesh_args *a) {
    a->mesh = cli_add(args, arg_str0(NULL, "mesh", "NAME|FILE,...", "torus (default), sphere, tubes, sheet, or files"));
    a->triangles = cli_add(args, arg_str0(NULL, "triangles", "N", "about so many of a mesh that is no file; default 86000"));
    a->still = cli_add(args, arg_lit0(NULL, "still", "the positions stay; they are given anew each frame all the same"));
    a->mode = cli_add(
        args, arg_str0(NULL, "mode", "rtsdf|coarse|exact|compose|scene|build|refit,...",
                       "the published technique; voxels with their exact transform; the exact band; the band of a scene of 8 "
                       "copies, composed of their own fields, or made anew; the tree; "
                       "default all"));
    a->size =
        cli_add(args, arg_str0(NULL, "size", "S|M|L|N,...", "rtsdf: edge of the coarse field, 64, 128, 256 or N; default all"));
    a->rays = cli_add(args, arg_str0(NULL, "rays", "X,...", "rtsdf: a texel and frame; default 0,1,5,10,15"));
    a->mask = cli_add(args, arg_str0(NULL, "mask", "D,...", "rtsdf: default .01,.05,.1,.5,inf"));
    a->flood = cli_add(args, arg_str0(NULL, "flood", "jfa|1+jfa|jfa+2", "rtsdf: default jfa"));
    a->edge = cli_add(args, arg_str0(NULL, "edge", "N,...", "of the field, but for rtsdf; default 256,512"));
    a->moving = cli_add(args, arg_str0(NULL, "moving", "N", "compose, scene: objects that turn each frame, 1 to 8; default 2"));
    a->band = cli_add(args, arg_str0(NULL, "band", "B", "exact, compose, scene: in voxels; default 3"));
    a->sign =
        cli_add(args, arg_str0(NULL, "sign", "auto|pseudonormal|winding|none", "exact, compose, scene: default pseudonormal"));
    a->frames = cli_add(args, arg_str0(NULL, "frames", "N", "of a case, at most 1000; default 100"));
    a->seconds = cli_add(args, arg_str0(NULL, "seconds", "S", "begin no frame of a case after this; default 5"));
    a->warm_up = cli_add(args, arg_str0(NULL, "warm-up", "S", "before each case; default 1"));
    a->check = cli_add(args, arg_str0(NULL, "check", "N", "texels of each result that are checked; default 400"));
    a->backend = cli_add(args, arg_str0(NULL, "backend", "auto|cpu|vulkan", "default auto: a real GPU, else the CPU"));
    a->device = cli_add(args, arg_str0(NULL, "device", "D", "Vulkan device: index or part of its name"));
    a->threads = cli_add(args, arg_str0(NULL, "threads", "N", "threads of the CPU backend; default one a processor"));
    a->csv = cli_add(args, arg_str0(NULL, "csv", "FILE", "write a row a case, when all are measured"));
    a->json = cli_add(args, arg_str0(NULL, "json", "FILE", "write everything as JSON"));
    a->quiet = cli_add(args, arg_lit0("q", "quiet", "print nothing but errors"));
}

static bool read_numbers(const mesh_args *a, mesh_plan *p) {
    double warm_up = 0;
    int backend = 0;
    if (!cli_uint32("--triangles", cli_given(a->triangles, "86000"), 12, &p->triangles) ||
        !cli_uint32("--frames", cli_given(a->frames, "100"), 1, &p->limits.frames) ||
        !cli_uint32("--moving", cli_given(a->moving, "2"), 1, &p->moving) ||
        !cli_uint32("--check", cli_given(a->check, "400"), 0, &p->limits.samples) ||
        !cli_double("--seconds", cli_given(a->seconds, "5"), &p->limits.seconds) ||
        !cli_double("--warm-up", cli_given(a->warm_up, "1"), &warm_up) ||
        !cli_double("--band", cli_given(a->band, "3"), &p->band) ||
        !cli_word("--flood", cli_given(a->flood, "jfa"), bench_mesh_flood_words, &p->flood) ||
        !cli_word("--sign", cli_given(a->sign, "pseudonormal"), bench_mesh_sign_words, &p->sign) ||
        !cli_word("--backend", cli_given(a->backend, "auto"), fm_backend_words, &backend) ||
        (a->threads->count && !cli_uint32("--threads", a->threads->sval[0], 1, &p->session.threads))) {
        return false;
    }
    if (p->limits.frames > BENCH_STATS_MAX || p->band <= 0 || p->triangles > 100000000) {
        cli_usage("--frames is at most %d, --band above 0, --triangles at most 100 million", BENCH_STATS_MAX);
        return false;
    }
    if (p->moving > BENCH_MESH_OBJECTS) {
        cli_usage("--moving is %u: 1 to %d objects", p->moving, BENCH_MESH_OBJECTS);
        return false;
    }
    p->limits.warm_up_ms = warm_up * 1e3;
    p->session.backend = (fm_backend)backend;
    p->session.device = cli_given(a->device, NULL);
    return true;
}

static bool read_plan(const mesh_args *a, mesh_plan *p) {
    *p = (mesh_plan){.csv = cli_given(a->csv, NULL), .json = cli_given(a->json, NULL)};
    p->quiet = a->quiet->count > 0;
    p->still = a->still->count > 0;
    return read_numbers(a, p) && cli_each("--mesh", cli_given(a->mesh, "torus"), MAX_LIST, take_mesh, p) &&
           cli_words("--mode", cli_given(a->mode, "rtsdf,coarse,exact,compose,scene,build,refit"), bench_mesh_mode_words, MAX_LIST,
                     p->modes, &p->mode_count) &&
           cli_each("--size", cli_given(a->size, "S,M,L"), MAX_LIST, take_size, p) &&
           cli_each("--edge", cli_given(a->edge, "256,512"), MAX_LIST, take_edge, p) &&
           cli_each("--rays", cli_given(a->rays, "0,1,5,10,15"), MAX_LIST, take_rays, p) &&
           cli_each("--mask", cli_given(a->mask, ".01,.05,.1,.5,inf"), MAX_LIST, take_mask, p);
}

int command_bench_mesh(int argc, char **argv) {
    static const cli_help help = {
        "bench mesh",
        "Measures what a mesh that moves costs each frame: the published RTSDF at its sizes, rays and masks, voxels with their\n"
        "exact distances, the exact signed band, the band of a scene of several objects, and the tree. A sample of every result is "
        "checked.",
        "fathom bench mesh\n"
        "fathom bench mesh --mode rtsdf --size M --rays 5 --mask .01,.05,.1,.5,inf --csv masks.csv\n"
        "fathom bench mesh --mode compose,scene --moving 1 --edge 256\n"
        "fathom bench mesh --mode exact,build,refit --mesh bunny.ply --edge 256\n"
        "fathom bench mesh --mode rtsdf,coarse --size 16 --edge 32 --rays 1 --mask .1 --triangles 2000 --frames 3 --warm-up 0\n"};
    cli_args args = {0};
    mesh_args options;
    add_options(&args, &options);
    int status;
    if (cli_parse(&args, &help, argc, argv, &status)) {
        static mesh_plan plan;
        status = read_plan(&options, &plan) ? run(&plan) : CLI_USAGE;
    }
    cli_free(&args);
    return status;
}
