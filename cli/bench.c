// SPDX-License-Identifier: MIT
// fathom bench transform: the cases, in the order scene, size, metric, types, engine.

#include "bench.h"
#include "cli.h"
#include "commands.h"
#include "table.h"
#include "words.h"

#include <stdio.h>
#include <stdlib.h>
#include <string.h>

enum { MAX_LIST = 32 };

typedef struct bench_plan {
    fm_shape shapes[MAX_LIST];
    const fm_scene *scenes[MAX_LIST];
    const bench_engine *engines[MAX_LIST];
    fm_metric metrics[MAX_LIST];
    fm_type types[MAX_LIST], inputs[MAX_LIST];
    int shape_count, scene_count, engine_count, metric_count, type_count, input_count;
    fm_scene_desc scene;  // shape aside
    bench_session_desc session;
    bench_limits limits;
    const char *csv, *passes, *json;
    bool quiet;
} bench_plan;

typedef struct reports {
    table csv, passes;
    cJSON *results;
    bool measured, failed;
} reports;

// L1 and Linf are measured as whole numbers that saturate, L2 as floats and as whole squares.
static bool fits(fm_metric metric, fm_type type) {
    const bool small = type == FM_TYPE_U8 || type == FM_TYPE_U16;
    return metric == FM_METRIC_L2 ? !small : small;
}

static void measure(const bench_plan *plan, bench_session *session, bench_scene *scene, const bench_engine *engine,
                    const bench_case *what, reports *out) {
    const char *refusal = bench_engine_refuses(session, engine, what);
    if (refusal) {
        if (!plan->quiet) {
            fprintf(stderr, "fathom: %s is left out at %u x %u x %u: %s\n", engine->name, what->scene_desc.shape.x,
                    what->scene_desc.shape.y, what->scene_desc.shape.z, refusal);
        }
        return;
    }
    static bench_result result;
    if (!bench_measure(session, scene, engine, what, &plan->limits, &result)) {
        cli_fail("bench: %s: %s", engine->name, result.failure);
        out->failed = true;
    }
    if (!plan->quiet) {
        bench_print(stdout, &result);
    }
    out->measured = true;
    if (out->csv.stream) {
        bench_csv(out->csv.stream, &result);
    }
    if (out->passes.stream) {
        bench_passes_csv(out->passes.stream, &result);
    }
    if (out->results) {
        cJSON_AddItemToArray(out->results, bench_json(&result));
    }
}

static bool measure_scene(const bench_plan *plan, bench_session *session, const fm_scene *which, fm_shape shape, reports *out) {
    bench_case what = {.scene = which, .scene_desc = plan->scene};
    what.scene_desc.shape = shape;
    bench_scene *scene = bench_scene_create(which, &what.scene_desc);
    if (!scene) {
        cli_fail("bench: out of memory for %u x %u x %u voxels: ask for smaller --sizes", shape.x, shape.y, shape.z);
        return false;
    }
    for (int m = 0; m < plan->metric_count; m++) {
        for (int t = 0; t < plan->type_count; t++) {
            for (int i = 0; fits(plan->metrics[m], plan->types[t]) && i < plan->input_count; i++) {
                what.metric = plan->metrics[m];
                what.output = plan->types[t];
                what.input = plan->inputs[i];
                for (int e = 0; e < plan->engine_count; e++) {
                    measure(plan, session, scene, plan->engines[e], &what, out);
                }
            }
        }
    }
    bench_scene_destroy(scene);
    return true;
}

static bool print_setting(const bench_plan *plan, bench_session *session) {
    for (int e = 0; e < plan->engine_count; e++) {
        fm_context *context = bench_session_context(session, plan->engines[e]->backend);
        if (!context) {
            continue;
        }
        bool said = false;
        for (int before = 0; before < e; before++) {
            said = said || bench_session_context(session, plan->engines[before]->backend) == context;
        }
        if (!said) {
            fm_device_info device;
            fm_context_device(context, &device);
            const double bandwidth = bench_session_bandwidth(session, plan->engines[e]->backend);
            if (bandwidth <= 0) {
                return false;
            }
            if (!plan->quiet) {
                printf("%s (%s): copy %.1f GB/s, read and written bytes counted\n", device.name, device.driver, bandwidth * 1e-9);
            }
        }
    }
    if (!plan->quiet) {
        printf("\n");
        bench_print_header(stdout);
    }
    return true;
}

static int measure_all(const bench_plan *plan, reports *out) {
    bench_session *session = bench_session_create(&plan->session);
    if (!session) {
        return cli_fail("out of memory: free some");
    }
    int status = CLI_DONE;
    // An engine that was asked for by name must be had at all.
    for (int e = 0; status == CLI_DONE && e < plan->engine_count; e++) {
        if (!bench_session_context(session, plan->engines[e]->backend)) {
            status = cli_fail("bench: %s: %s", plan->engines[e]->name, fm_last_error());
        }
    }
    if (status == CLI_DONE && !print_setting(plan, session)) {
        status = cli_library_failed();
    }
    for (int s = 0; s < plan->scene_count; s++) {
        for (int i = 0; status == CLI_DONE && i < plan->shape_count; i++) {
            status = measure_scene(plan, session, plan->scenes[s], plan->shapes[i], out) ? CLI_DONE : CLI_FAILED;
        }
    }
    bench_session_destroy(session);
    return status == CLI_DONE && out->failed ? CLI_FAILED : status;
}

static int run(const bench_plan *plan) {
    int status = tables_check((const char *const[]){plan->csv, plan->passes, plan->json}, 3);
    if (status != CLI_DONE) {
        return status;
    }
    reports out = {.results = plan->json ? cJSON_CreateArray() : NULL};
    table json = {0};
    if (!table_begin(plan->csv, &out.csv) || !table_begin(plan->passes, &out.passes) || !table_begin(plan->json, &json)) {
        status = cli_fail("out of memory: free some");
    } else {
        if (out.csv.stream) {
            bench_csv_header(out.csv.stream);
        }
        if (out.passes.stream) {
            bench_passes_csv_header(out.passes.stream);
        }
        status = measure_all(plan, &out);
    }
    if (json.stream && !table_json(&json, out.results)) {
        status = CLI_FAILED;
        out.measured = false;
    }
    // A case that failed is a row like others.
    const bool worth = status == CLI_DONE || out.measured;
    status = table_end(&out.csv, worth, status);
    status = table_end(&out.passes, worth, status);
    return table_end(&json, worth, status);
}

static bool take_shape(const char *option, const char *word, void *user) {
    bench_plan *plan = user;
    return cli_shape_word(option, word, &plan->shapes[plan->shape_count++]);
}

static bool take_scene(const char *option, const char *word, void *user) {
    bench_plan *plan = user;
    const fm_scene *scene = fm_scene_find(word);
    if (!scene) {
        cli_usage("%s has \"%s\": fathom scene --list has the names", option, word);
    }
    plan->scenes[plan->scene_count++] = scene;
    return scene != NULL;
}

static bool take_engine(const char *option, const char *word, void *user) {
    bench_plan *plan = user;
    const bench_engine *engine = bench_engine_find(word);
    if (!engine) {
        cli_usage("%s has \"%s\": fathom bench transform --list-engines has the names", option, word);
    }
    plan->engines[plan->engine_count++] = engine;
    return engine != NULL;
}

static bool take_metric(const char *option, const char *word, void *user) {
    bench_plan *plan = user;
    int place = 0;
    bool good = cli_word(option, word, fm_metric_words, &place);
    plan->metrics[plan->metric_count++] = (fm_metric)place;
    return good;
}

static bool take_type(const char *option, const char *word, void *user) {
    bench_plan *plan = user;
    fm_type *type = &plan->types[plan->type_count++];
    if (!cli_type(option, word, type)) {
        return false;
    }
    if (*type != FM_TYPE_U8 && *type != FM_TYPE_U16 && *type != FM_TYPE_U32 && *type != FM_TYPE_F32) {
        cli_usage("%s has \"%s\": fields of u8, u16, u32 and f32 are measured", option, word);
        return false;
    }
    return true;
}

static bool take_input(const char *option, const char *word, void *user) {
    bench_plan *plan = user;
    fm_type *type = &plan->inputs[plan->input_count++];
    if (!cli_type(option, word, type)) {
        return false;
    }
    if (*type != FM_TYPE_U8 && *type != FM_TYPE_BITS) {
        cli_usage("%s has \"%s\": voxels of u8 and bits are measured", option, word);
        return false;
    }
    return true;
}

// What this machine has: a real GPU is measured without being asked for, a software driver is not.
static const char *default_engines(const bench_session_desc *desc) {
    fm_context *context;
    if (desc->backend == FM_BACKEND_CPU || fm_context_create(&(fm_context_desc){.device = desc->device}, &context) != FM_OK) {
        return "fathom-cpu";
    }
    const bool gpu = fm_context_backend(context) == FM_BACKEND_VULKAN;
    fm_context_destroy(context);
    return gpu ? "fathom-vulkan" : "fathom-cpu";
}

typedef struct bench_args {
    struct arg_str *what, *sizes, *scenes, *engines, *metrics, *types, *inputs, *backend, *device, *threads, *runs, *seconds,
        *samples, *seed, *density, *csv, *passes, *json;
    struct arg_lit *list, *quiet;
} bench_args;

static void add_options(cli_args *args, bench_args *a) {
    a->what = cli_add(args, arg_str1(NULL, NULL, "transform", "what to measure"));
    a->sizes = cli_add(args, arg_str0(NULL, "sizes", "N,XxYxZ,...", "default 128,256"));
    a->scenes = cli_add(args, arg_str0(NULL, "scenes", "NAME,...", "default terrain,sparse,shell"));
    a->engines = cli_add(args, arg_str0(NULL, "engines", "NAME,...", "default fathom-vulkan on a real GPU, else fathom-cpu"));
    a->metrics = cli_add(args, arg_str0(NULL, "metrics", "l1,l2,linf", "default l1,l2"));
    a->types =
        cli_add(args, arg_str0(NULL, "types", "u8,u16,f32,u32", "of the field: l1 and linf in the first two, l2 in the others"));
    a->inputs = cli_add(args, arg_str0(NULL, "inputs", "u8,bits", "of the voxels; default u8"));
    a->backend = cli_add(args, arg_str0(NULL, "backend", "auto|cpu|vulkan", "of brute-force and copy"));
    a->device = cli_add(args, arg_str0(NULL, "device", "D", "Vulkan device: index or part of its name"));
    a->threads = cli_add(args, arg_str0(NULL, "threads", "N", "threads of fathom-cpu; default one a processor"));
    a->runs = cli_add(args, arg_str0(NULL, "runs", "N", "timed runs of a case, at most 1000; default 25"));
    a->seconds = cli_add(args, arg_str0(NULL, "seconds", "S", "begin no run of a case after this, from the third on; default 10"));
    a->samples = cli_add(args, arg_str0(NULL, "samples", "N", "voxels of each result that are checked; default 4000"));
    a->seed = cli_add(args, arg_str0(NULL, "seed", "S", "of the scenes; default 0"));
    a->density = cli_add(args, arg_str0(NULL, "density", "D", "of the sparse scene; default 0.001"));
    a->csv = cli_add(args, arg_str0(NULL, "csv", "FILE", "write a row a case and engine, when all are measured"));
    a->passes = cli_add(args, arg_str0(NULL, "passes", "FILE", "write a CSV row a pass"));
    a->json = cli_add(args, arg_str0(NULL, "json", "FILE", "write everything as JSON"));
    a->list = cli_add(args, arg_lit0(NULL, "list-engines", "list the engines"));
    a->quiet = cli_add(args, arg_lit0("q", "quiet", "print nothing but errors"));
}

static bool read_limits(const bench_args *a, bench_plan *p) {
    int64_t seed = 0;
    if (!cli_uint32("--runs", cli_given(a->runs, "25"), 3, &p->limits.runs) ||
        !cli_double("--seconds", cli_given(a->seconds, "10"), &p->limits.seconds) ||
        !cli_uint32("--samples", cli_given(a->samples, "4000"), 8, &p->limits.samples) ||
        !cli_int64("--seed", cli_given(a->seed, "0"), &seed) ||
        !cli_double("--density", cli_given(a->density, "0.001"), &p->scene.density) ||
        (a->threads->count && !cli_uint32("--threads", a->threads->sval[0], 1, &p->session.threads))) {
        return false;
    }
    p->scene.seed = (uint64_t)seed;
    if (p->limits.runs > BENCH_STATS_MAX) {
        cli_usage("--runs is %u: 3 to %d is wanted", p->limits.runs, BENCH_STATS_MAX);
        return false;
    }
    if (!(p->scene.density > 0 && p->scene.density <= 1)) {
        cli_usage("--density is %g: above 0 and at most 1 is wanted", p->scene.density);
        return false;
    }
    return true;
}

static bool read_plan(const bench_args *a, bench_plan *p) {
    int backend = 0;
    *p = (bench_plan){.csv = cli_given(a->csv, NULL),
                      .passes = cli_given(a->passes, NULL),
                      .json = cli_given(a->json, NULL),
                      .quiet = a->quiet->count > 0};
    if (strcmp(a->what->sval[0], "transform") != 0) {
        cli_usage("bench: no benchmark \"%s\": transform, world, render, mesh and octree are there", a->what->sval[0]);
        return false;
    }
    if (!cli_word("--backend", cli_given(a->backend, "auto"), fm_backend_words, &backend) || !read_limits(a, p)) {
        return false;
    }
    p->session.backend = (fm_backend)backend;
    p->session.device = cli_given(a->device, NULL);
    return cli_each("--sizes", cli_given(a->sizes, "128,256"), MAX_LIST, take_shape, p) &&
           cli_each("--scenes", cli_given(a->scenes, "terrain,sparse,shell"), MAX_LIST, take_scene, p) &&
           cli_each("--metrics", cli_given(a->metrics, "l1,l2"), MAX_LIST, take_metric, p) &&
           cli_each("--types", cli_given(a->types, "u8,u16,f32,u32"), MAX_LIST, take_type, p) &&
           cli_each("--inputs", cli_given(a->inputs, "u8"), MAX_LIST, take_input, p) &&
           cli_each("--engines", cli_given(a->engines, default_engines(&p->session)), MAX_LIST, take_engine, p);
}

int command_bench(int argc, char **argv) {
    if (argc > 1 && strcmp(argv[1], "world") == 0) {
        return command_bench_world(argc - 1, argv + 1);
    }
    if (argc > 1 && strcmp(argv[1], "mesh") == 0) {
        return command_bench_mesh(argc - 1, argv + 1);
    }
    if (argc > 1 && strcmp(argv[1], "octree") == 0) {
        return command_bench_octree(argc - 1, argv + 1);
    }
    if (argc > 1 && strcmp(argv[1], "render") == 0) {
        return command_bench_render(argc - 1, argv + 1);
    }
    if (argc > 1 && strcmp(argv[1], "shadows") == 0) {
        return command_bench_shadows(argc - 1, argv + 1);
    }
    static const cli_help help = {
        "bench",
        "Measures exact transforms (for editable worlds, pictures of them, meshes and octrees see fathom bench world --help,\n"
        "render --help, mesh --help and octree --help): GPU time of each pass, wall time, throughput, memory, and the ratio to the "
        "time that a copy of as many\n"
        "bytes takes. A sample of each result is checked; a wrong one fails.",
        "fathom bench transform --sizes 128,256,512 --csv results.csv\n"
        "fathom bench transform --sizes 512 --scenes terrain --engines fathom-vulkan,fathom-cpu,copy\n"
        "fathom bench transform --metrics l1 --types u8 --inputs u8,bits --passes passes.csv\n"};
    cli_args args = {0};
    bench_args options;
    add_options(&args, &options);
    int status;
    if (cli_parse(&args, &help, argc, argv, &status)) {
        bench_plan plan;
        if (options.list->count) {
            for (uint32_t i = 0; bench_engine_at(i); i++) {
                printf("%-14s %s\n", bench_engine_at(i)->name, bench_engine_at(i)->description);
            }
            status = CLI_DONE;
        } else {
            status = read_plan(&options, &plan) ? run(&plan) : CLI_USAGE;
        }
    }
    cli_free(&args);
    return status;
}
