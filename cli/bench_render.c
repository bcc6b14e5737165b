// SPDX-License-Identifier: MIT
// fathom bench render: pictures along a path of cameras, in the order scene, size, format, mode, march.

#include "camera.h"
#include "cli.h"
#include "commands.h"
#include "render.h"
#include "table.h"
#include "words.h"
#include "world.h"

#include <stdio.h>
#include <stdlib.h>

enum { MAX_LIST = 16, MAX_CAMERAS = 1000 };

typedef struct render_plan {
    const fm_scene *scenes[MAX_LIST];
    fm_shape shapes[MAX_LIST], pictures[MAX_LIST];  // a picture's z is 1
    fm_field_format formats[MAX_LIST];
    bench_render_mode modes[MAX_LIST];
    fm_march marches[MAX_LIST];
    int scene_count, shape_count, picture_count, format_count, mode_count, march_count;
    uint32_t cameras;
    bench_render_limits limits;
    bench_session_desc session;
    const char *csv, *json;
    bool quiet;
} render_plan;

typedef struct render_tables {
    table csv, json;
    cJSON *results;
    bool measured, failed;
} render_tables;

static void note(const render_plan *plan, const bench_render_result *result, render_tables *out) {
    const bench_render_case *what = &result->what;
    if (result->failure[0]) {
        cli_fail("bench render: %s: %s", what->scene, result->failure);
        out->failed = true;
    }
    if (!plan->quiet) {
        bench_render_print(stdout, result);
    }
    out->measured = true;
    if (out->csv.stream) {
        bench_render_csv(out->csv.stream, result);
    }
    if (out->results) {
        cJSON_AddItemToArray(out->results, bench_render_json(result));
    }
}

static void measure_modes(const render_plan *plan, bench_session *session, fm_world *world, bench_render_case *what,
                          const fm_camera *cameras, render_tables *out) {
    static bench_render_result result;
    for (int m = 0; m < plan->mode_count; m++) {
        for (int k = 0; k < plan->march_count; k++) {
            what->mode = plan->modes[m];
            what->march = plan->marches[k];
            // The baselines are for the march itself.
            if (k == 0 || what->mode == BENCH_RENDER_FACES) {
                bench_render_measure(session, world, cameras, plan->cameras, what, &plan->limits, &result);
                note(plan, &result, out);
            }
        }
    }
}

static bool place_cameras(const render_plan *plan, fm_world *world, double aspect, fm_camera *cameras) {
    for (uint32_t i = 0; i < plan->cameras; i++) {
        if (camera_tour(world, i, plan->cameras, aspect, &cameras[i]) != FM_OK) {
            return false;
        }
    }
    return true;
}

static int measure_world(const render_plan *plan, bench_session *session, const fm_volume *start, bench_render_case *what,
                         render_tables *out) {
    static fm_camera cameras[MAX_CAMERAS];
    fm_context *context = bench_session_context(session, FM_BACKEND_AUTO);
    fm_world *world = NULL;
    bool good = context && fm_world_create(context, &what->desc, &world) == FM_OK && fm_world_load(world, start) == FM_OK &&
                fm_world_update(world, NULL) == FM_OK && place_cameras(plan, world, (double)what->width / what->height, cameras);
    if (good) {
        measure_modes(plan, session, world, what, cameras, out);
    }
    const int status = good ? CLI_DONE : cli_library_failed();
    fm_world_destroy(world);
    if (context) {
        fm_context_trim(context);
    }
    return status;
}

static int measure_scene(const render_plan *plan, bench_session *session, const fm_scene *scene, int size, render_tables *out) {
    const fm_scene_desc desc = {.shape = plan->shapes[size]};
    const fm_shape picture = plan->pictures[size < plan->picture_count ? size : plan->picture_count - 1];
    fm_volume *start = bench_world_scene(scene, &desc);
    if (!start) {
        return cli_library_failed();
    }
    int status = CLI_DONE;
    for (int f = 0; status == CLI_DONE && f < plan->format_count; f++) {
        bench_render_case what = {.scene = fm_scene_name(scene),
                                  .desc = {.shape = desc.shape, .format = plan->formats[f]},
                                  .width = picture.x,
                                  .height = picture.y};
        status = measure_world(plan, session, start, &what, out);
    }
    fm_volume_destroy(start);
    return status;
}

static bool print_device(const render_plan *plan, bench_session *session) {
    fm_context *context = bench_session_context(session, FM_BACKEND_AUTO);
    const bool timed = plan->limits.rounds > 0;
    const double bandwidth = context && timed ? bench_session_bandwidth(session, FM_BACKEND_AUTO) : 0;
    if (!context || (timed && bandwidth <= 0)) {
        return false;
    }
    if (plan->quiet) {
        return true;
    }
    fm_device_info device;
    fm_context_device(context, &device);
    printf("%s (%s)", device.name, device.driver);
    if (timed) {
        printf(": copy %.1f GB/s, read and written bytes counted\n", bandwidth * 1e-9);
        printf("times of pictures are %s; ms is the median over %u cameras\n",
               device.kind == FM_DEVICE_HOST ? "by the processor's clock" : "GPU timestamps", plan->cameras);
    } else {
        printf(": reads are counted over %u cameras, nothing is timed\n", plan->cameras);
    }
    printf(
        "steps, beam, sun, occl.: field reads a ray; MB: what a pass asks for, counted; copy: the time of a copy of so many bytes\n"
        "(no floor: caches serve many of them), and how much longer the pass took\n\n");
    bench_render_print_header(stdout);
    return true;
}

static int measure_all(const render_plan *plan, render_tables *out) {
    bench_session *session = bench_session_create(&plan->session);
    if (!session) {
        return cli_fail("out of memory: free some");
    }
    int status = print_device(plan, session) ? CLI_DONE : cli_library_failed();
    for (int s = 0; s < plan->scene_count; s++) {
        for (int i = 0; status == CLI_DONE && i < plan->shape_count; i++) {
            status = measure_scene(plan, session, plan->scenes[s], i, out);
        }
    }
    bench_session_destroy(session);
    return status == CLI_DONE && out->failed ? CLI_FAILED : status;
}

static int run(const render_plan *plan) {
    int status = tables_check((const char *const[]){plan->csv, plan->json}, 2);
    if (status != CLI_DONE) {
        return status;
    }
    render_tables out = {.results = plan->json ? cJSON_CreateArray() : NULL};
    if (!table_begin(plan->csv, &out.csv) || !table_begin(plan->json, &out.json)) {
        status = cli_fail("out of memory: free some");
    } else {
        if (out.csv.stream) {
            bench_render_csv_header(out.csv.stream);
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

static bool take_scene(const char *option, const char *word, void *user) {
    render_plan *plan = user;
    plan->scenes[plan->scene_count] = cli_scene(option, word);
    return plan->scenes[plan->scene_count++] != NULL;
}

static bool take_shape(const char *option, const char *word, void *user) {
    render_plan *plan = user;
    return cli_shape_word(option, word, &plan->shapes[plan->shape_count++]);
}

static bool take_picture(const char *option, const char *word, void *user) {
    render_plan *plan = user;
    return cli_picture(option, word, &plan->pictures[plan->picture_count++]);
}

static bool take_format(const char *option, const char *word, void *user) {
    render_plan *plan = user;
    int place = 0;
    const bool good = cli_word(option, word, fm_field_format_words, &place);
    plan->formats[plan->format_count++] = (fm_field_format)place;
    return good;
}

static bool take_mode(const char *option, const char *word, void *user) {
    render_plan *plan = user;
    int place = 0;
    const bool good = cli_word(option, word, bench_render_mode_words, &place);
    plan->modes[plan->mode_count++] = (bench_render_mode)place;
    return good;
}

static bool take_march(const char *option, const char *word, void *user) {
    render_plan *plan = user;
    int place = 0;
    const bool good = cli_word(option, word, fm_march_words, &place);
    plan->marches[plan->march_count++] = (fm_march)place;
    return good;
}

typedef struct render_args {
    struct arg_str *size, *picture, *scene, *format, *mode, *march, *cameras, *rounds, *frames, *seconds, *warm_up, *backend,
        *device, *threads, *csv, *json;
    struct arg_lit *quiet;
} render_args;

static void add_options(cli_args *args, render_args *a) {
    a->size = cli_add(args, arg_str0(NULL, "size", "N,XxYxZ,...", "of the worlds; default 512,1024"));
    a->picture = cli_add(args, arg_str0(NULL, "picture", "WxH,...", "for each size, in order; default 1280x720,1920x1080"));
    a->scene = cli_add(args, arg_str0(NULL, "scene", "NAME,...", "default terrain,city"));
    a->format = cli_add(args, arg_str0(NULL, "format", "packed|split-u8|split-u16|squared,...", "default packed,split-u8"));
    a->mode = cli_add(args, arg_str0(NULL, "mode", "faces|shaded|edited,...",
                                     "face shading; soft shadows and ambient occlusion; an edit before each; default all"));
    a->march = cli_add(args, arg_str0(NULL, "march", "skip|box|plain,...", "default all; those after the first with faces only"));
    a->cameras = cli_add(args, arg_str0(NULL, "cameras", "N", "of the path; default 64"));
    a->rounds = cli_add(
        args, arg_str0(NULL, "rounds", "N", "along it, at most 1000, 0 only counts reads, and does nothing for edited; default 7"));
    a->frames = cli_add(args, arg_str0(NULL, "frames", "N", "for frames/s, pictures asked for in a row; default 500"));
    a->seconds = cli_add(args, arg_str0(NULL, "seconds", "S", "begin nothing more of a part of a case after this; default 5"));
    a->warm_up = cli_add(args, arg_str0(NULL, "warm-up", "S", "before each case; default 1"));
    a->backend = cli_add(args, arg_str0(NULL, "backend", "auto|cpu|vulkan", "default auto: a real GPU, else the CPU"));
    a->device = cli_add(args, arg_str0(NULL, "device", "D", "Vulkan device: index or part of its name"));
    a->threads = cli_add(args, arg_str0(NULL, "threads", "N", "threads of the CPU backend; default one a processor"));
    a->csv = cli_add(args, arg_str0(NULL, "csv", "FILE", "write a row a case, when all are measured"));
    a->json = cli_add(args, arg_str0(NULL, "json", "FILE", "write everything as JSON"));
    a->quiet = cli_add(args, arg_lit0("q", "quiet", "print nothing but errors"));
}

static bool read_numbers(const render_args *a, render_plan *p) {
    double warm_up = 0;
    int backend = 0;
    if (!cli_uint32("--cameras", cli_given(a->cameras, "64"), 1, &p->cameras) ||
        !cli_uint32("--rounds", cli_given(a->rounds, "7"), 0, &p->limits.rounds) ||
        !cli_uint32("--frames", cli_given(a->frames, "500"), 1, &p->limits.frames) ||
        !cli_double("--seconds", cli_given(a->seconds, "5"), &p->limits.seconds) ||
        !cli_double("--warm-up", cli_given(a->warm_up, "1"), &warm_up) ||
        !cli_word("--backend", cli_given(a->backend, "auto"), fm_backend_words, &backend) ||
        (a->threads->count && !cli_uint32("--threads", a->threads->sval[0], 1, &p->session.threads))) {
        return false;
    }
    if (p->cameras > MAX_CAMERAS || p->limits.rounds > BENCH_STATS_MAX) {
        cli_usage("--cameras and --rounds are %u and %u: each is at most 1000", p->cameras, p->limits.rounds);
        return false;
    }
    p->limits.warm_up_ms = warm_up * 1e3;
    p->session.backend = (fm_backend)backend;
    p->session.device = cli_given(a->device, NULL);
    return true;
}

static bool read_plan(const render_args *a, render_plan *p) {
    *p = (render_plan){.csv = cli_given(a->csv, NULL), .json = cli_given(a->json, NULL), .quiet = a->quiet->count > 0};
    return read_numbers(a, p) && cli_each("--size", cli_given(a->size, "512,1024"), MAX_LIST, take_shape, p) &&
           cli_each("--picture", cli_given(a->picture, "1280x720,1920x1080"), MAX_LIST, take_picture, p) &&
           cli_each("--scene", cli_given(a->scene, "terrain,city"), MAX_LIST, take_scene, p) &&
           cli_each("--format", cli_given(a->format, "packed,split-u8"), MAX_LIST, take_format, p) &&
           cli_each("--mode", cli_given(a->mode, "faces,shaded,edited"), MAX_LIST, take_mode, p) &&
           cli_each("--march", cli_given(a->march, "skip,box,plain"), MAX_LIST, take_march, p);
}

int command_bench_render(int argc, char **argv) {
    static const cli_help help = {
        "bench render",
        "Measures pictures of worlds along a path of cameras around and inside of them: GPU time, steps of the rays, and\n"
        "frames a second, also with an edit before each. With no options: the sizes that have targets.",
        "fathom bench render\n"
        "fathom bench render --size 64 --picture 160x90 --cameras 8 --rounds 1 --frames 8 --warm-up 0\n"
        "fathom bench render --size 1024 --picture 3840x2160 --mode shaded --csv shaded.csv\n"};
    cli_args args = {0};
    render_args options;
    add_options(&args, &options);
    int status;
    if (cli_parse(&args, &help, argc, argv, &status)) {
        static render_plan plan;
        status = read_plan(&options, &plan) ? run(&plan) : CLI_USAGE;
    }
    cli_free(&args);
    return status;
}
