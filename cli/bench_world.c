// SPDX-License-Identifier: MIT
// fathom bench world: a seeded script of edits for each case, in the order size, format, algorithm, chunk, border, convergence,
// focus.

#include "cli.h"
#include "commands.h"
#include "files.h"
#include "method.h"
#include "table.h"
#include "words.h"
#include "world.h"

#include <inttypes.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/stat.h>

enum { MAX_LIST = 32, MAX_CASES = 1024 };
enum { TARGET_SMALL = 512, TARGET_LARGE = 1024 };  // the sizes that targets have

typedef struct world_plan {
    fm_shape shapes[MAX_LIST];
    int formats[MAX_LIST], algorithms[MAX_LIST], borders[MAX_LIST], convergences[MAX_LIST];  // numbers of their enums
    uint32_t chunks[MAX_LIST], focuses[MAX_LIST];
    int shape_count, format_count, algorithm_count, chunk_count, focus_count, border_count, convergence_count;
    fm_world_algorithm near, far;
    const fm_scene *scene;  // NULL: `input`
    fm_scene_desc scene_desc;
    const char *input;
    fm_read_desc read;
    uint32_t max_distance;
    bench_edits edits;
    bench_session_desc session;
    bench_world_limits limits;
    const char *csv, *frames, *json, *plots;
    char plots_csv[4096];
    bool targets, quiet;
} world_plan;

typedef struct world_tables {
    table csv, frames, plots;
    cJSON *results;
    bool measured, failed;
} world_tables;

static void note(const world_plan *plan, const bench_world_result *result, world_tables *out) {
    if (result->failure[0]) {
        cli_fail("bench world: %s: %s", fm_world_algorithm_words[result->what.desc.method.algorithm], result->failure);
        out->failed = true;
    }
    if (!plan->quiet && !plan->targets) {
        bench_world_print(stdout, result);
    }
    out->measured = true;
    if (out->csv.stream) {
        bench_world_csv(out->csv.stream, result);
    }
    if (out->plots.stream) {
        bench_world_csv(out->plots.stream, result);
    }
    if (out->frames.stream) {
        bench_world_frames_csv(out->frames.stream, result);
    }
    if (out->results) {
        cJSON_AddItemToArray(out->results, bench_world_json(result));
    }
}

static bool same(const fm_world_method *a, const fm_world_method *b) {
    return a->algorithm == b->algorithm && a->chunk == b->chunk && a->border == b->border && a->convergence == b->convergence &&
           a->near_algorithm == b->near_algorithm && a->far_algorithm == b->far_algorithm && a->focus_chunks == b->focus_chunks;
}

static uint32_t add_method(fm_world_method *methods, uint32_t count, const fm_world_method *method) {
    const fm_world_method added = bench_world_method(method);
    for (uint32_t i = 0; i < count; i++) {
        if (same(&methods[i], &added)) {
            return count;
        }
    }
    methods[count] = added;
    return count + 1;
}

// Every combination once: what has no effect on a method makes no other one.
static uint32_t list_methods(const world_plan *plan, fm_shape shape, fm_world_method methods[MAX_CASES]) {
    uint32_t count = 0;
    const int total = plan->algorithm_count * plan->chunk_count * plan->border_count * plan->convergence_count * plan->focus_count;
    for (int i = 0; i < total && count < MAX_CASES; i++) {
        int rest = i;
        fm_world_method method = {.near_algorithm = plan->near, .far_algorithm = plan->far};
        method.focus_chunks = plan->focuses[rest % plan->focus_count];
        rest /= plan->focus_count;
        method.convergence = (fm_world_convergence)plan->convergences[rest % plan->convergence_count];
        rest /= plan->convergence_count;
        method.border = (fm_world_border)plan->borders[rest % plan->border_count];
        rest /= plan->border_count;
        method.chunk = plan->chunks[rest % plan->chunk_count];
        method.algorithm = (fm_world_algorithm)plan->algorithms[rest / plan->chunk_count];
        method.focus[0] = (int32_t)(shape.x / 2);
        method.focus[1] = (int32_t)(shape.y / 2);
        method.focus[2] = (int32_t)(shape.z / 2);
        count = add_method(methods, count, &method);
    }
    return count;
}

static bench_world_case case_of(const world_plan *plan, fm_shape shape) {
    bench_world_case what = {.start = plan->scene ? fm_scene_name(plan->scene) : plan->input, .edits = plan->edits};
    what.scene_desc = plan->scene_desc;
    what.scene_desc.shape = shape;
    what.desc = (fm_world_desc){.shape = shape};
    return what;
}

static void measure_size(const world_plan *plan, bench_session *session, const fm_volume *start, fm_shape shape,
                         world_tables *out) {
    static bench_world_result result;
    static fm_world_method methods[MAX_CASES];
    const uint32_t count = list_methods(plan, shape, methods);
    for (int f = 0; f < plan->format_count; f++) {
        bench_world_case what = case_of(plan, shape);
        what.desc.format = (fm_field_format)plan->formats[f];
        what.desc.max_distance = what.desc.format == FM_FIELD_SQUARED_U32 ? plan->max_distance : 0;
        for (uint32_t m = 0; m < count; m++) {
            what.desc.method = methods[m];
            if (!bench_world_refuses(&what.desc)) {
                bench_world_measure(session, start, &what, &plan->limits, &result);
                note(plan, &result, out);
            }
        }
    }
}

// The world stands for those of the targets of `size`. A target without edits is told by the run before it.
static void measure_targets(const world_plan *plan, bench_session *session, const fm_volume *start, fm_shape shape, uint32_t size,
                            world_tables *out) {
    static bench_world_result result;
    bool measured = false;
    for (uint32_t i = 0; bench_world_target_at(i); i++) {
        const bench_world_target *target = bench_world_target_at(i);
        if (target->size != size) {
            continue;
        }
        if (target->edits || !measured) {
            bench_world_case what = case_of(plan, shape);
            what.edits.per_update = target->edits ? target->edits : 1;
            bench_world_measure(session, start, &what, &plan->limits, &result);
            note(plan, &result, out);
            measured = true;
        }
        if (!plan->quiet) {
            bench_world_target_print(stdout, target, &result);
        }
    }
    if (!plan->quiet && size == TARGET_LARGE) {
        bench_world_target_memory(stdout, &result);
    }
}

// The world's voxels at the start; NULL after the reason has been said.
static fm_volume *start_volume(const world_plan *plan, fm_shape *shape) {
    fm_volume *volume = NULL;
    if (plan->scene) {
        fm_scene_desc desc = plan->scene_desc;
        desc.shape = *shape;
        volume = bench_world_scene(plan->scene, &desc);
        if (!volume) {
            cli_library_failed();
        }
        return volume;
    }
    fm_file_info info;
    if (files_read(plan->input, &plan->read, plan->quiet, &volume, &info) != CLI_DONE) {
        return NULL;
    }
    *shape = info.shape;
    return volume;
}

static bool print_device(const world_plan *plan, bench_session *session) {
    fm_context *context = bench_session_context(session, FM_BACKEND_AUTO);
    const double bandwidth = context ? bench_session_bandwidth(session, FM_BACKEND_AUTO) : 0;
    if (bandwidth <= 0) {
        cli_library_failed();
        return false;
    }
    fm_device_info device;
    fm_context_device(context, &device);
    if (!plan->quiet) {
        printf("%s (%s): copy %.1f GB/s, read and written bytes counted\n", device.name, device.driver, bandwidth * 1e-9);
        printf("%s; %u updates at most, %s; a frame is an update and the wait for it: nothing is drawn\n\n",
               device.kind == FM_DEVICE_HOST ? "times of passes are by the processor's clock"
                                             : "times of passes are GPU timestamps",
               plan->limits.frames, plan->limits.interval_ms > 0 ? "at intervals" : "one after another");
        if (plan->targets) {
            bench_world_target_header(stdout);
        } else {
            bench_world_print_header(stdout);
        }
    }
    return true;
}

static int measure_all(const world_plan *plan, world_tables *out) {
    bench_session *session = bench_session_create(&plan->session);
    if (!session) {
        return cli_fail("out of memory: free some");
    }
    int status = print_device(plan, session) ? CLI_DONE : CLI_FAILED;
    for (int i = 0; status == CLI_DONE && i < plan->shape_count; i++) {
        fm_shape shape = plan->shapes[i];
        fm_volume *start = start_volume(plan, &shape);
        if (!start) {
            status = CLI_FAILED;
        } else if (plan->targets) {
            // The last size stands for the larger targets.
            measure_targets(plan, session, start, shape, i + 1 < plan->shape_count ? TARGET_SMALL : TARGET_LARGE, out);
        } else {
            measure_size(plan, session, start, shape, out);
        }
        fm_volume_destroy(start);
    }
    bench_session_destroy(session);
    return status == CLI_DONE && out->failed ? CLI_FAILED : status;
}

static int run(const world_plan *plan) {
    int status = tables_check((const char *const[]){plan->csv, plan->frames, plan->json, plan->plots ? plan->plots_csv : NULL}, 4);
    if (status != CLI_DONE) {
        return status;
    }
    if (plan->plots && !bench_world_plot(NULL, NULL)) {
        return cli_fail("--plots needs gnuplot: leave it out, write --csv and draw that later with bench/plot-world");
    }
    world_tables out = {.results = plan->json ? cJSON_CreateArray() : NULL};
    table json = {0};
    if (!table_begin(plan->csv, &out.csv) || !table_begin(plan->frames, &out.frames) || !table_begin(plan->json, &json) ||
        !table_begin(plan->plots ? plan->plots_csv : NULL, &out.plots)) {
        status = cli_fail("out of memory: free some");
    } else {
        if (out.csv.stream) {
            bench_world_csv_header(out.csv.stream);
        }
        if (out.plots.stream) {
            bench_world_csv_header(out.plots.stream);
        }
        if (out.frames.stream) {
            bench_world_frames_csv_header(out.frames.stream);
        }
        status = measure_all(plan, &out);
    }
    if (json.stream && !table_json(&json, out.results)) {
        status = CLI_FAILED;
        out.measured = false;
    }
    const bool worth = out.measured;
    status = table_end(&out.csv, worth, status);
    status = table_end(&out.frames, worth, status);
    status = table_end(&json, worth, status);
    const bool drawn = out.plots.stream && worth;
    status = table_end(&out.plots, worth, status);
    fflush(stdout);
    if (drawn && !bench_world_plot(plan->plots_csv, plan->plots)) {
        status = cli_fail("%s: the pictures could not be drawn", plan->plots);
    }
    return status;
}

static bool take_shape(const char *option, const char *word, void *user) {
    world_plan *plan = user;
    return cli_shape_word(option, word, &plan->shapes[plan->shape_count++]);
}

static bool take_chunk(const char *option, const char *word, void *user) {
    world_plan *plan = user;
    return cli_chunk(option, word, &plan->chunks[plan->chunk_count++]);
}

static bool take_focus(const char *option, const char *word, void *user) {
    world_plan *plan = user;
    return cli_uint32(option, word, 1, &plan->focuses[plan->focus_count++]);
}

typedef struct world_args {
    struct arg_str *size, *scene, *input, *algorithm, *chunk, *border, *convergence, *format, *focus, *near, *far, *max_distance,
        *edits, *radius, *brushes, *seed, *scene_seed, *interval, *frames, *seconds, *full_runs, *check, *check_every, *backend,
        *device, *threads, *copy_speed, *csv, *frames_csv, *json, *plots;
    struct arg_lit *targets, *quiet;
    files_input file;
} world_args;

static void add_case_options(cli_args *args, world_args *a) {
    a->size = cli_add(args, arg_str0(NULL, "size", "N,XxYxZ,...", "default 64,128; with --targets 512,1024"));
    a->scene = cli_add(args, arg_str0(NULL, "scene", "NAME", "what is in the world at first; default terrain"));
    a->input = cli_add(args, arg_str0(NULL, "input", "FILE", "... or a volume, which gives the size too"));
    a->algorithm = cli_add(args, arg_str0(NULL, "algorithm", "NAME,...", METHOD_ALGORITHMS));
    a->chunk = cli_add(args, arg_str0(NULL, "chunk", "EDGE,...", "8 to 256, or 0: the whole world; default 32; exact has none"));
    a->border = cli_add(args, arg_str0(NULL, "border", "padding|halo|exchange,...", "of chunks; default padding"));
    a->convergence = cli_add(args, arg_str0(NULL, "convergence", "device|host,...", "of fim and jfa-fim; default device"));
    a->format = cli_add(args, arg_str0(NULL, "format", "packed|split-u8|split-u16|squared,...", "default packed"));
    a->focus =
        cli_add(args, arg_str0(NULL, "focus", "CHUNKS,...", "selective: edge of the focus in the world's middle; default 3"));
    a->near = cli_add(args, arg_str0(NULL, "near", "NAME", "selective: in the focus; default jfa-fim"));
    a->far = cli_add(args, arg_str0(NULL, "far", "NAME", "selective: elsewhere; default jfa-published"));
    a->max_distance = cli_add(args, arg_str0(NULL, "max-distance", "D", "squared: greater distances become this; default none"));
}

static void add_script_options(cli_args *args, world_args *a) {
    a->edits = cli_add(args, arg_str0(NULL, "edits", "N", "brushes an update; default 1"));
    a->radius = cli_add(args, arg_str0(NULL, "radius", "LEAST,MOST", "of the brushes; default 1,16"));
    a->brushes = cli_add(args, arg_str0(NULL, "brushes", "sphere|box|line,...", "one of these at random; default sphere"));
    a->seed = cli_add(args, arg_str0(NULL, "seed", "S", "of the edits; default 0"));
    a->scene_seed = cli_add(args, arg_str0(NULL, "scene-seed", "S", "of the scene; default 0"));
    a->interval = cli_add(args, arg_str0(NULL, "interval", "MS", "between updates; 0: one after another; default 200"));
    a->frames = cli_add(args, arg_str0(NULL, "frames", "N", "updates, at most 1000; default 50, with --targets 500"));
    a->seconds = cli_add(args, arg_str0(NULL, "seconds", "S", "begin no update of a case after this; default 10"));
    a->full_runs = cli_add(args, arg_str0(NULL, "full-runs", "N", "regenerations of everything; default 10, with --targets 100"));
    a->check = cli_add(args, arg_str0(NULL, "check", "N", "voxels of the field compared with the exact distance; default 0"));
    a->check_every = cli_add(args, arg_str0(NULL, "check-every", "K", "check after every K updates too"));
}

static void add_options(cli_args *args, world_args *a) {
    add_case_options(args, a);
    add_script_options(args, a);
    a->targets = cli_add(args, arg_lit0(NULL, "targets", "measure what exact updates are to reach, and compare"));
    a->backend = cli_add(args, arg_str0(NULL, "backend", "auto|cpu|vulkan", "default auto: a real GPU, else the CPU"));
    a->device = cli_add(args, arg_str0(NULL, "device", "D", "Vulkan device: index or part of its name"));
    a->threads = cli_add(args, arg_str0(NULL, "threads", "N", "threads of the CPU backend; default one a processor"));
    a->copy_speed =
        cli_add(args, arg_str0(NULL, "copy-speed", "GB/S", "of the device, where it is known; default: it is measured"));
    a->csv = cli_add(args, arg_str0(NULL, "csv", "FILE", "write a row a case, when all are measured"));
    a->frames_csv = cli_add(args, arg_str0(NULL, "frames-csv", "FILE", "write a row an update"));
    a->json = cli_add(args, arg_str0(NULL, "json", "FILE", "write everything as JSON"));
    a->plots = cli_add(args, arg_str0(NULL, "plots", "DIR", "draw PNG pictures there, with gnuplot; the directory is made"));
    files_input_add(args, &a->file);
    a->quiet = cli_add(args, arg_lit0("q", "quiet", "print nothing but errors"));
}

static bool read_radius(const world_args *a, world_plan *p) {
    uint32_t *ends[2] = {&p->edits.least_radius, &p->edits.greatest_radius};
    const char *text = cli_given(a->radius, "1,16");
    char least[16] = "";
    const size_t length = strcspn(text, ",");
    snprintf(least, sizeof least, "%.*s", (int)(length < 15 ? length : 15), text);
    if (!cli_uint32("--radius", least, 0, ends[0]) ||
        !cli_uint32("--radius", text[length] ? text + length + 1 : least, 0, ends[1])) {
        return false;
    }
    if (*ends[0] > *ends[1] || *ends[1] > 4096) {
        cli_usage("--radius is %s: LEAST,MOST is wanted, from 0 to 4096 and the first not above the second", text);
        return false;
    }
    return true;
}

static bool read_numbers(const world_args *a, world_plan *p) {
    int64_t seed = 0, scene_seed = 0, check = 0;
    double copy_speed = 0;
    const char *many = p->targets ? "500" : "50", *full = p->targets ? "100" : "10", *interval = p->targets ? "0" : "200";
    if (!cli_uint32("--edits", cli_given(a->edits, "1"), 1, &p->edits.per_update) || !read_radius(a, p) ||
        !cli_int64("--seed", cli_given(a->seed, "0"), &seed) ||
        !cli_int64("--scene-seed", cli_given(a->scene_seed, "0"), &scene_seed) ||
        !cli_double("--interval", cli_given(a->interval, interval), &p->limits.interval_ms) ||
        !cli_uint32("--frames", cli_given(a->frames, many), 1, &p->limits.frames) ||
        !cli_double("--seconds", cli_given(a->seconds, "10"), &p->limits.seconds) ||
        !cli_uint32("--full-runs", cli_given(a->full_runs, full), 1, &p->limits.full_runs) ||
        !cli_int64("--check", cli_given(a->check, "0"), &check) ||
        !cli_uint32("--check-every", cli_given(a->check_every, "0"), 0, &p->limits.check_every) ||
        !cli_uint32("--max-distance", cli_given(a->max_distance, "0"), 0, &p->max_distance) ||
        !cli_double("--copy-speed", cli_given(a->copy_speed, "0"), &copy_speed) ||
        (a->threads->count && !cli_uint32("--threads", a->threads->sval[0], 1, &p->session.threads))) {
        return false;
    }
    p->edits.seed = (uint64_t)seed;
    p->scene_desc.seed = (uint64_t)scene_seed;
    p->session.bandwidth = copy_speed * 1e9;
    p->limits.check = check > 0 ? (uint64_t)check : 0;
    if (p->limits.frames > BENCH_STATS_MAX || p->limits.full_runs > BENCH_STATS_MAX) {
        cli_usage("--%s is %u: 1 to %d is wanted", p->limits.frames > BENCH_STATS_MAX ? "frames" : "full-runs",
                  p->limits.frames > BENCH_STATS_MAX ? p->limits.frames : p->limits.full_runs, BENCH_STATS_MAX);
        return false;
    }
    if (p->edits.per_update > 1 << 20 || p->limits.interval_ms < 0 || check < 0) {
        cli_usage("--edits is at most %d; --interval and --check are not below 0", 1 << 20);
        return false;
    }
    if (a->copy_speed->count && copy_speed <= 0) {
        cli_usage("--copy-speed is %s: a number above 0 is wanted, of bytes read and written", a->copy_speed->sval[0]);
        return false;
    }
    if (p->limits.check_every && !p->limits.check) {
        cli_usage("--check-every is given without --check: how many voxels shall be compared?");
        return false;
    }
    return true;
}

static bool read_brushes(const world_args *a, world_plan *p) {
    int kinds[3], count;
    const bool good = cli_words("--brushes", cli_given(a->brushes, "sphere"), fm_brush_words, 3, kinds, &count);
    for (int i = 0; good && i < count; i++) {
        p->edits.kinds[p->edits.kind_count++] = (fm_brush_kind)kinds[i];
    }
    return good;
}

static bool read_lists(const world_args *a, world_plan *p) {
    int backend = 0, near = 0, far = 0;
    if (!cli_word("--backend", cli_given(a->backend, "auto"), fm_backend_words, &backend) ||
        !cli_word("--near", cli_given(a->near, "exact"), fm_world_algorithm_words, &near) ||
        !cli_word("--far", cli_given(a->far, "exact"), fm_world_algorithm_words, &far)) {
        return false;
    }
    p->session.backend = (fm_backend)backend;
    p->session.device = cli_given(a->device, NULL);
    p->near = (fm_world_algorithm)near;
    p->far = (fm_world_algorithm)far;
    return cli_each("--size", cli_given(a->size, p->targets ? "512,1024" : "64,128"), MAX_LIST, take_shape, p) &&
           cli_words("--format", cli_given(a->format, "packed"), fm_field_format_words, MAX_LIST, p->formats, &p->format_count) &&
           cli_words("--algorithm", cli_given(a->algorithm, "exact"), fm_world_algorithm_words, MAX_LIST, p->algorithms,
                     &p->algorithm_count) &&
           cli_each("--chunk", cli_given(a->chunk, "32"), MAX_LIST, take_chunk, p) &&
           cli_words("--border", cli_given(a->border, "padding"), fm_world_border_words, MAX_LIST, p->borders, &p->border_count) &&
           cli_words("--convergence", cli_given(a->convergence, "device"), fm_world_convergence_words, MAX_LIST, p->convergences,
                     &p->convergence_count) &&
           cli_each("--focus", cli_given(a->focus, "3"), MAX_LIST, take_focus, p) && read_brushes(a, p);
}

// Whether the lists have a combination that there is.
static bool check_methods(const world_plan *p) {
    static fm_world_method methods[MAX_CASES];
    const uint32_t count = list_methods(p, (fm_shape){1, 1, 1}, methods);
    const char *refusal = NULL;
    for (int f = 0; f < p->format_count; f++) {
        for (uint32_t m = 0; m < count; m++) {
            refusal = bench_world_refuses(&(fm_world_desc){.format = (fm_field_format)p->formats[f], .method = methods[m]});
            if (!refusal) {
                return true;
            }
        }
    }
    cli_usage("bench world: the lists have nothing that can be measured: %s", refusal);
    return false;
}

static bool read_start(const world_args *a, world_plan *p) {
    const char *name = cli_given(a->scene, "terrain");
    p->input = cli_given(a->input, NULL);
    if (!files_input_desc(&a->file, &p->read)) {
        return false;
    }
    if (!p->input) {
        p->scene = cli_scene("--scene", name);
        return p->scene != NULL;
    }
    if (a->scene->count || a->size->count || a->targets->count) {
        cli_usage("--input is given with --scene, --size or --targets: the file has its own voxels and size");
        return false;
    }
    p->shape_count = 1;
    return true;
}

// What --targets says of itself: other methods have no targets.
static bool check_targets(const world_args *a, const world_plan *p) {
    if (!p->targets) {
        return true;
    }
    if (a->algorithm->count || a->edits->count || a->format->count) {
        cli_usage("--targets is given with --algorithm, --edits or --format: it is about exact updates of a packed field");
        return false;
    }
    if (p->shape_count > 2) {
        cli_usage("--targets takes one or two sizes: those that stand for 512 and 1024");
        return false;
    }
    return true;
}

static bool read_outputs(const world_args *a, world_plan *p) {
    p->csv = cli_given(a->csv, NULL);
    p->frames = cli_given(a->frames_csv, NULL);
    p->json = cli_given(a->json, NULL);
    p->plots = cli_given(a->plots, NULL);
    if (!p->plots) {
        return true;
    }
    if (snprintf(p->plots_csv, sizeof p->plots_csv, "%s/world.csv", p->plots) >= (int)sizeof p->plots_csv) {
        cli_usage("--plots has more than %zu bytes: use a shorter name", sizeof p->plots_csv - 16);
        return false;
    }
    // What cannot be made is said when the table in it is checked.
    (void)mkdir(p->plots, 0777);
    return true;
}

int command_bench_world(int argc, char **argv) {
    static const cli_help help = {
        "bench world",
        "Edits a world by a seeded script and measures what keeping its distance field costs: GPU time of each update,\n"
        "frames a second, iterations, memory, and how wrong the field is. The published measurements edit every 200 ms\n"
        "with radii from 1 to 16.",
        "fathom bench world --size 128,256 --algorithm exact,fim,jfa --chunk 16,32 --check 100000\n"
        "fathom bench world --size 256 --algorithm fim --convergence device,host --border padding,halo,exchange --csv fim.csv\n"
        "fathom bench world --size 64,128,256 --algorithm exact,jfa-fim --plots pictures\n"
        "fathom bench world --targets\n"
        "fathom bench world --targets --size 32,64 --backend cpu\n"};
    cli_args args = {0};
    world_args options;
    add_options(&args, &options);
    int status;
    if (cli_parse(&args, &help, argc, argv, &status)) {
        static world_plan plan;
        plan = (world_plan){.targets = options.targets->count > 0, .quiet = options.quiet->count > 0};
        const bool good = read_numbers(&options, &plan) && read_lists(&options, &plan) && read_start(&options, &plan) &&
                          check_methods(&plan) && check_targets(&options, &plan) && read_outputs(&options, &plan);
        status = good ? run(&plan) : CLI_USAGE;
    }
    cli_free(&args);
    return status;
}
