// SPDX-License-Identifier: MIT
// fathom bench shadows: ways to shadow a scene that moves, their times and their errors.

#include "cli.h"
#include "commands.h"
#include "files.h"
#include "shadows.h"
#include "table.h"
#include "words.h"

#include <errno.h>
#include <stdio.h>
#include <string.h>
#include <sys/stat.h>
#include <unistd.h>

typedef struct shadow_plan {
    bench_shadow_case what;
    bench_session_desc session;
    const char *csv, *pictures;
    bool quiet;
} shadow_plan;

// "1 ray, blended" becomes "1_ray__blended.png".
static void picture_name(const char *folder, const char *way, char *path, size_t size) {
    const int stem = snprintf(path, size, "%s/", folder);
    for (size_t i = 0; way[i] && (size_t)stem + i + 5 < size; i++) {
        const bool plain = (way[i] >= 'a' && way[i] <= 'z') || (way[i] >= 'A' && way[i] <= 'Z') || (way[i] >= '0' && way[i] <= '9');
        path[(size_t)stem + i] = plain ? way[i] : '_';
        path[(size_t)stem + i + 1] = 0;
    }
    strncat(path, ".png", size - strlen(path) - 1);
}

static int keep_picture(const shadow_plan *plan, const bench_shadow_stage *stage, const bench_shadow_way *way) {
    char path[4096];
    picture_name(plan->pictures, way->name, path, sizeof path);
    return fm_image_write_png(path, plan->what.width, plan->what.height, 4, bench_shadow_picture(stage)) == FM_OK
               ? CLI_DONE
               : cli_library_failed();
}

// On a processor a way can take minutes.
static void say_progress(const shadow_plan *plan, const char *way) {
    if (!plan->quiet && isatty(STDERR_FILENO)) {
        fprintf(stderr, "\r\033[K%s%s", way ? "measuring: " : "", way ? way : "");
        fflush(stderr);
    }
}

static int measure_all(const shadow_plan *plan, bench_shadow_stage *stage, const char *device, table *csv, bool *measured) {
    int status = CLI_DONE;
    for (uint32_t i = 0; bench_shadow_way_at(i); i++) {
        bench_shadow_result result;
        say_progress(plan, bench_shadow_way_at(i)->name);
        const bool good = bench_shadow_measure(stage, bench_shadow_way_at(i), &result);
        say_progress(plan, NULL);
        if (!good) {
            status = cli_fail("bench shadows: %s: %s", result.way->name, result.failure);
        } else if (plan->pictures && keep_picture(plan, stage, result.way) != CLI_DONE) {
            return CLI_FAILED;
        }
        if (!plan->quiet) {
            bench_shadow_print(stdout, &result);
            fflush(stdout);
        }
        if (csv->stream) {
            bench_shadow_csv(csv->stream, &plan->what, device, &result);
        }
        *measured = true;
    }
    return status;
}

static int measure(const shadow_plan *plan, table *csv, bool *measured) {
    bench_session *session = bench_session_create(&plan->session);
    fm_context *context = session ? bench_session_context(session, FM_BACKEND_AUTO) : NULL;
    bench_shadow_stage *stage = context ? bench_shadow_stage_create(context, &plan->what) : NULL;
    int status = CLI_FAILED;
    if (!stage) {
        status = cli_library_failed();
    } else {
        fm_device_info device;
        fm_context_device(context, &device);
        if (!plan->quiet) {
            printf("%s (%s)\n%u x %u pixels, field of %u, about %u triangles that move, a sun of %g degrees, truth by %u rays a "
                   "pixel; times are %s\n\n",
                   device.name, device.driver, plan->what.width, plan->what.height, plan->what.edge, plan->what.triangles,
                   2 * (double)plan->what.light, plan->what.truth,
                   device.kind == FM_DEVICE_HOST ? "by the processor's clock" : "GPU timestamps");
            bench_shadow_print_header(stdout);
        }
        status = measure_all(plan, stage, device.name, csv, measured);
    }
    bench_shadow_stage_destroy(stage);
    bench_session_destroy(session);
    return status;
}

// Before anything is measured, for that takes long.
static int make_folder(const char *folder) {
    struct stat status;
    (void)mkdir(folder, 0777);
    if (stat(folder, &status) == 0 && !S_ISDIR(status.st_mode)) {
        return cli_fail("%s: it is no directory: name one for the pictures", folder);
    }
    return access(folder, W_OK | X_OK) == 0 ? CLI_DONE
                                            : cli_fail("%s: %s: name a directory that can be written", folder, strerror(errno));
}

static int run(const shadow_plan *plan) {
    int status = tables_check((const char *const[]){plan->csv}, 1);
    status = status == CLI_DONE && plan->pictures ? make_folder(plan->pictures) : status;
    if (status != CLI_DONE) {
        return status;
    }
    table csv = {0};
    bool measured = false;
    if (!table_begin(plan->csv, &csv)) {
        return cli_fail("out of memory: free some");
    }
    if (csv.stream) {
        bench_shadow_csv_header(csv.stream);
    }
    status = measure(plan, &csv, &measured);
    return table_end(&csv, measured, status);
}

typedef struct shadow_args {
    struct arg_str *picture, *edge, *triangles, *rays, *map_edge, *truth, *frames, *warm_up, *light, *backend, *device, *threads,
        *csv, *pictures;
    struct arg_lit *quiet;
} shadow_args;

static void add_options(cli_args *args, shadow_args *a) {
    a->picture = cli_add(args, arg_str0(NULL, "picture", "WxH", "default 1920x1080"));
    a->edge = cli_add(args, arg_str0(NULL, "edge", "N", "texels along the fields; RTSDF's coarse one has half; default 256"));
    a->triangles = cli_add(args, arg_str0(NULL, "triangles", "N", "about so many that move; default 86000"));
    a->rays = cli_add(args, arg_str0(NULL, "rays", "X", "RTSDF: a texel and frame; default 5"));
    a->map_edge = cli_add(args, arg_str0(NULL, "map-edge", "N", "texels along each of four cascades; default 1024"));
    a->truth = cli_add(args, arg_str0(NULL, "truth", "N", "rays a pixel of the truth; default 1024"));
    a->frames = cli_add(args, arg_str0(NULL, "frames", "N", "timed, and before each comparison; default 32"));
    a->warm_up = cli_add(args, arg_str0(NULL, "warm-up", "S", "of each way, on a GPU; default 1"));
    a->light = cli_add(args, arg_str0(NULL, "light", "DEGREES", "half the angle of the sun; default 3"));
    a->backend = cli_add(args, arg_str0(NULL, "backend", "auto|cpu|vulkan", "default auto: a real GPU, else the CPU"));
    a->device = cli_add(args, arg_str0(NULL, "device", "D", "Vulkan device: index or part of its name"));
    a->threads = cli_add(args, arg_str0(NULL, "threads", "N", "threads of the CPU backend; default one a processor"));
    a->csv = cli_add(args, arg_str0(NULL, "csv", "FILE", "write a row for each way, when all are measured"));
    a->pictures = cli_add(
        args, arg_str0(NULL, "pictures", "FOLDER", "keep each way's last picture there, as a PNG; made where it is missing"));
    a->quiet = cli_add(args, arg_lit0("q", "quiet", "print nothing but errors"));
}

static bool read_plan(const shadow_args *a, shadow_plan *p) {
    *p = (shadow_plan){.csv = cli_given(a->csv, NULL), .pictures = cli_given(a->pictures, NULL), .quiet = a->quiet->count > 0};
    fm_shape picture;
    double light = 0, warm_up = 0;
    int backend = 0;
    if (!cli_picture("--picture", cli_given(a->picture, "1920x1080"), &picture) ||
        !cli_uint32("--edge", cli_given(a->edge, "256"), 8, &p->what.edge) ||
        !cli_uint32("--triangles", cli_given(a->triangles, "86000"), 100, &p->what.triangles) ||
        !cli_uint32("--rays", cli_given(a->rays, "5"), 0, &p->what.rays) ||
        !cli_uint32("--map-edge", cli_given(a->map_edge, "1024"), 16, &p->what.map_edge) ||
        !cli_uint32("--truth", cli_given(a->truth, "1024"), 1, &p->what.truth) ||
        !cli_uint32("--frames", cli_given(a->frames, "32"), 1, &p->what.frames) ||
        !cli_double("--warm-up", cli_given(a->warm_up, "1"), &warm_up) ||
        !cli_double("--light", cli_given(a->light, "3"), &light) ||
        !cli_word("--backend", cli_given(a->backend, "auto"), fm_backend_words, &backend) ||
        (a->threads->count && !cli_uint32("--threads", a->threads->sval[0], 1, &p->session.threads))) {
        return false;
    }
    if (p->what.frames > BENCH_STATS_MAX || p->what.edge > 1024 || p->what.truth > 65536 || p->what.map_edge > 8192 || light <= 0 ||
        light >= 45) {
        cli_usage("--frames is at most %d, --edge at most 1024, --truth at most 65536, --map-edge at most 8192, --light above 0 "
                  "and below 45",
                  BENCH_STATS_MAX);
        return false;
    }
    p->what.width = picture.x;
    p->what.height = picture.y;
    p->what.light = (float)light;
    p->what.warm_up_ms = 1e3 * warm_up;
    p->session.backend = (fm_backend)backend;
    p->session.device = cli_given(a->device, NULL);
    return true;
}

int command_bench_shadows(int argc, char **argv) {
    static const cli_help help = {
        "bench shadows",
        "Shadows a scene in which things move in each way that Fathom knows, and says what a frame costs and how far the light's\n"
        "share at each pixel (0 to 1), the picture, and the width of a sphere's penumbra are from distributed ray tracing.",
        "fathom bench shadows\n"
        "fathom bench shadows --edge 512 --light 5 --csv shadows.csv --pictures shadows\n"
        "fathom bench shadows --picture 160x100 --edge 48 --triangles 2000 --truth 64 --frames 4 --backend cpu\n"};
    cli_args args = {0};
    shadow_args options;
    add_options(&args, &options);
    int status;
    if (cli_parse(&args, &help, argc, argv, &status)) {
        shadow_plan plan;
        status = read_plan(&options, &plan) ? run(&plan) : CLI_USAGE;
    }
    cli_free(&args);
    return status;
}
