// SPDX-License-Identifier: MIT
// fathom bench octree: octrees of all kinds on the same models, cameras and rays.

#include "cli.h"
#include "commands.h"
#include "files.h"
#include "octree.h"
#include "table.h"
#include "words.h"

#include "fathom/mesh_io.h"

#include <stdlib.h>
#include <string.h>

enum { MAX_LIST = 16, MOST_SIZE = 16384, STRIP_WAYS = 4 };

typedef struct octree_plan {
    const char *models[MAX_LIST];
    int ways[MAX_LIST], views[MAX_LIST], matches[MAX_LIST];
    uint32_t sizes[MAX_LIST], radii[MAX_LIST];
    int model_count, way_count, view_count, match_count, size_count, radius_count;
    int mode;
    uint32_t triangles, most;
    bench_octree_plan bench;
    bench_session_desc session;
    const char *csv, *json, *pictures, *strip;
    bool quiet;
} octree_plan;

typedef struct octree_run {
    const octree_plan *plan;
    bench_session *session;
    char device[256];
    table csv, json;
    cJSON *results;
    uint8_t *pixels;  // of the newest picture, RGB
    uint8_t *strip;   // of pictures side by side
    bool measured, failed;
} octree_run;

static void clear(const octree_run *run, const char *model, const char *way, bench_octree_result *result) {
    bench_octree_result_clear(result, (bench_octree_mode)run->plan->mode);
    result->way = way;
    const char *slash = strrchr(model, '/');
    snprintf(result->model, sizeof result->model, "%s", slash ? slash + 1 : model);
    snprintf(result->device, sizeof result->device, "%s", run->device);
}

static void tell(octree_run *run, bench_octree_result *result) {
    bench_octree_judge(result);
    if (result->failure[0]) {
        cli_fail("bench octree: %s, %s: %s", result->model, result->way, result->failure);
        run->failed = true;
    }
    if (!run->plan->quiet) {
        bench_octree_print(stdout, result);
    }
    run->measured = true;
    if (run->csv.stream) {
        bench_octree_csv(run->csv.stream, result);
    }
    if (run->results) {
        cJSON_AddItemToArray(run->results, bench_octree_json(result));
    }
}

// ---------------------------------------------------------------------------------------------------------------------------
// Pictures
// ---------------------------------------------------------------------------------------------------------------------------

// Five columns: the triangles, and four kinds; two rows: the whole, and close up.
static void put_into_strip(octree_run *run, uint32_t column, uint32_t row) {
    const uint32_t width = run->plan->bench.width, height = run->plan->bench.height;
    for (uint32_t y = 0; y < height; y++) {
        const size_t to = 3 * ((size_t)width * (1 + STRIP_WAYS) * (row * height + y) + (size_t)column * width);
        memcpy(run->strip + to, run->pixels + 3 * (size_t)width * y, 3 * (size_t)width);
    }
}

static void keep_picture(octree_run *run, const bench_octree_result *result) {
    if (run->plan->pictures) {
        char path[4096];
        snprintf(path, sizeof path, "%s/%s-%s-%.0f-%s%s%s.png", run->plan->pictures, result->model, result->way, result->size,
                 result->view, result->match ? "-" : "", result->match ? result->match : "");
        if (fm_image_write_png(path, run->plan->bench.width, run->plan->bench.height, 3, run->pixels) != FM_OK) {
            cli_library_failed();
            run->failed = true;
        }
    }
}

// All views of an octree: the first row tells of the build, too.
static void look_at(octree_run *run, bench_octree_model *model, const bench_octree_way *way, fm_octree *octree,
                    const bench_octree_result *built, int strip_column) {
    for (int v = 0; v < run->plan->view_count; v++) {
        bench_octree_result result = *built;
        const uint32_t view = (uint32_t)run->plan->views[v];
        if (bench_octree_look(run->session, model, view, octree, way->epsilon, &run->plan->bench, run->pixels, &result)) {
            keep_picture(run, &result);
            if (run->strip && strip_column > 0 && v < 2) {
                put_into_strip(run, (uint32_t)strip_column, (uint32_t)v);
            }
        }
        tell(run, &result);
    }
}

static void measure(octree_run *run, bench_octree_model *model, const bench_octree_way *way, uint32_t size, const char *match,
                    const char *note, int strip_column) {
    bench_octree_result result;
    fm_octree *octree = NULL;
    clear(run, model->name, way->name, &result);
    result.match = match;
    snprintf(result.note, sizeof result.note, "%s", note);
    if (bench_octree_build(model, way, &run->plan->bench, size, match ? 1 : run->plan->bench.frames, &octree, &result) &&
        run->plan->mode != BENCH_OCTREE_MEMORY) {
        look_at(run, model, way, octree, &result, strip_column);
    } else {
        tell(run, &result);
    }
    fm_octree_destroy(octree);
}

static void triangles_into_strip(octree_run *run, bench_octree_model *model) {
    for (int v = 0; v < run->plan->view_count && v < 2; v++) {
        const bench_octree_view *view = bench_octree_view_of(model, (uint32_t)run->plan->views[v]);
        if (view) {
            bench_octree_bytes(view->picture, 3 * (uint64_t)model->width * model->height, run->pixels);
            put_into_strip(run, 0, (uint32_t)v);
        }
    }
}

// ---------------------------------------------------------------------------------------------------------------------------
// Modes
// ---------------------------------------------------------------------------------------------------------------------------

// The first way at each size, and the others where they match it.
static void measure_matches(octree_run *run, bench_octree_model *model) {
    const octree_plan *plan = run->plan;
    for (int s = 0; s < plan->size_count; s++) {
        const bench_octree_way *first = bench_octree_way_at((uint32_t)plan->ways[0]);
        bench_octree_result to;
        fm_octree *octree = NULL;
        clear(run, model->name, first->name, &to);
        if (!bench_octree_build(model, first, &plan->bench, plan->sizes[s], 1, &octree, &to) ||
            !bench_octree_look(run->session, model, 0, octree, first->epsilon, &plan->bench, NULL, &to)) {
            tell(run, &to);
        } else {
            look_at(run, model, first, octree, &to, 1);
        }
        fm_octree_destroy(octree);
        for (int m = 0; m < plan->match_count && !to.failure[0]; m++) {
            const bench_octree_match match = (bench_octree_match)plan->matches[m];
            int column = 2;
            for (int w = 1; w < plan->way_count; w++) {
                const bench_octree_way *way = bench_octree_way_at((uint32_t)plan->ways[w]);
                bench_octree_result result;
                uint32_t size = 0;
                clear(run, model->name, way->name, &result);
                if (bench_octree_matched(run->session, model, way, match, &to, &plan->bench, plan->most, &result, &size)) {
                    measure(run, model, way, size, result.match, result.note,
                            match == BENCH_MATCH_MEMORY && column <= STRIP_WAYS ? column++ : 0);
                } else {
                    tell(run, &result);
                }
            }
        }
    }
}

static void measure_codes(octree_run *run, bench_octree_model *model) {
    for (int s = 0; s < run->plan->size_count; s++) {
        for (int code = FM_OCTREE_SPHERICAL; code < FM_OCTREE_FLOATS; code++) {
            bench_octree_result result;
            clear(run, model->name, code == FM_OCTREE_SPHERICAL ? "spherical" : "octahedral", &result);
            bench_octree_code(run->session, model, (fm_octree_code)code, &run->plan->bench, run->plan->sizes[s], &result);
            tell(run, &result);
        }
    }
}

static void measure_model(octree_run *run, bench_octree_model *model) {
    const octree_plan *plan = run->plan;
    if (plan->mode == BENCH_OCTREE_CODE) {
        measure_codes(run, model);
        return;
    }
    if (plan->mode == BENCH_OCTREE_ERROR) {
        measure_matches(run, model);
        return;
    }
    for (int s = 0; s < plan->size_count; s++) {
        for (int w = 0; w < plan->way_count; w++) {
            const bench_octree_way *way = bench_octree_way_at((uint32_t)plan->ways[w]);
            if (way->field) {
                continue;
            }
            if (plan->mode == BENCH_OCTREE_SHARE) {
                bench_octree_result result;
                clear(run, model->name, way->name, &result);
                bench_octree_share(model, way, &plan->bench, plan->sizes[s], &result);
                tell(run, &result);
            } else {
                measure(run, model, way, plan->sizes[s], NULL, "", 0);
            }
        }
    }
}

// Scenes of voxels.
static void measure_voxels(octree_run *run, const char *scene) {
    const octree_plan *plan = run->plan;
    const int radii = plan->mode == BENCH_OCTREE_UPDATE ? plan->radius_count : 1;
    for (int s = 0; s < plan->size_count; s++) {
        for (int w = 0; w < plan->way_count; w++) {
            const bench_octree_way *way = bench_octree_way_at((uint32_t)plan->ways[w]);
            for (int r = 0; way->worlds && r < radii; r++) {
                bench_octree_result result;
                clear(run, scene, way->name, &result);
                if (plan->mode == BENCH_OCTREE_UPDATE) {
                    bench_octree_update(run->session, scene, way, &plan->bench, plan->sizes[s], plan->radii[r], &result);
                } else if (plan->mode == BENCH_OCTREE_SCALE && !way->field) {
                    bench_octree_scale(run->session, way, &plan->bench, plan->sizes[s], &result);
                } else if (plan->mode != BENCH_OCTREE_SCALE) {
                    bench_octree_world(run->session, scene, way, &plan->bench, plan->sizes[s], &result);
                } else {
                    continue;
                }
                tell(run, &result);
            }
        }
    }
}

static void measure_all(octree_run *run) {
    const octree_plan *plan = run->plan;
    if (plan->mode == BENCH_OCTREE_SCALE) {
        measure_voxels(run, "shell");
        return;
    }
    for (int i = 0; i < plan->model_count; i++) {
        if (fm_scene_find(plan->models[i])) {
            measure_voxels(run, plan->models[i]);
            continue;
        }
        bench_octree_model *model = bench_octree_model_create(run->session, plan->models[i], plan->triangles, &plan->bench);
        if (!model) {
            run->failed = cli_library_failed() != CLI_DONE;
            continue;
        }
        if (run->strip) {
            triangles_into_strip(run, model);
        }
        measure_model(run, model);
        bench_octree_model_destroy(model);
    }
}

static bool begin(octree_run *run) {
    const bench_octree_plan *bench = &run->plan->bench;
    const size_t pixels = (size_t)bench->width * bench->height;
    run->session = bench_session_create(&run->plan->session);
    run->pixels = malloc(3 * pixels);
    run->strip = run->plan->strip ? calloc(6 * (1 + STRIP_WAYS), pixels) : NULL;
    if (!run->session || !run->pixels || (run->plan->strip && !run->strip)) {
        cli_fail("out of memory: free some");
        return false;
    }
    fm_context *context = bench_session_context(run->session, FM_BACKEND_AUTO);
    if (!context || bench_session_bandwidth(run->session, FM_BACKEND_AUTO) <= 0) {
        cli_library_failed();
        return false;
    }
    fm_device_info device;
    fm_context_device(context, &device);
    snprintf(run->device, sizeof run->device, "%s", device.name);
    if (!run->plan->quiet) {
        printf("%s (%s): copy %.1f GB/s, read and written bytes counted\n", device.name, device.driver,
               bench_session_bandwidth(run->session, FM_BACKEND_AUTO) * 1e-9);
        printf(
            "%u x %u pixels; pictures by %s, builds and updates by the clock, medians; GB/s: 32 bytes for each read. Vulkan does "
            "not tell how many of a device's units are occupied.\n\n",
            bench->width, bench->height, device.kind == FM_DEVICE_HOST ? "the processor's clock" : "GPU timestamps");
        bench_octree_print_header(stdout);
    }
    return true;
}

static int work(octree_run *run) {
    const octree_plan *plan = run->plan;
    if (run->csv.stream) {
        bench_octree_csv_header(run->csv.stream);
    }
    if (begin(run)) {
        measure_all(run);
    } else {
        run->failed = true;
    }
    if (run->strip && run->measured &&
        fm_image_write_png(plan->strip, plan->bench.width * (1 + STRIP_WAYS), plan->bench.height * 2, 3, run->strip) != FM_OK) {
        cli_library_failed();
        run->failed = true;
    }
    free(run->strip);
    free(run->pixels);
    bench_session_destroy(run->session);
    return run->failed ? CLI_FAILED : CLI_DONE;
}

static int run_plan(const octree_plan *plan) {
    int status = tables_check((const char *const[]){plan->csv, plan->json, plan->strip}, 3);
    if (status == CLI_DONE && plan->strip) {
        status = files_picture_check(plan->strip);
    }
    if (status != CLI_DONE) {
        return status;
    }
    octree_run run = {.plan = plan, .results = plan->json ? cJSON_CreateArray() : NULL};
    if (!table_begin(plan->csv, &run.csv) || !table_begin(plan->json, &run.json)) {
        status = cli_fail("out of memory: free some");
    } else {
        status = work(&run);
    }
    if (run.json.stream && !table_json(&run.json, run.results)) {
        status = CLI_FAILED;
        run.measured = false;
    }
    status = table_end(&run.csv, run.measured, status);
    return table_end(&run.json, run.measured, status);
}

// ---------------------------------------------------------------------------------------------------------------------------
// Options
// ---------------------------------------------------------------------------------------------------------------------------

static bool take_model(const char *option, const char *word, void *user) {
    static char names[MAX_LIST][1024];
    octree_plan *plan = user;
    if (strchr(word, '.') && fm_mesh_format_of(word) == FM_MESH_FORMAT_AUTO) {
        cli_usage(
            "%s is \"%s\": a mesh file (.ply, .obj, .stl, .gltf, .glb), a shape or a scene is wanted; files of voxels are not "
            "measured",
            option, word);
        return false;
    }
    snprintf(names[plan->model_count], sizeof names[0], "%s", word);
    plan->models[plan->model_count] = names[plan->model_count];
    plan->model_count++;
    return true;
}

static bool take_size(const char *option, const char *word, void *user) {
    octree_plan *plan = user;
    uint32_t *size = &plan->sizes[plan->size_count++];
    if (cli_uint32(option, word, 16, size) && *size > MOST_SIZE) {
        cli_usage("%s is %s: 16 to %d", option, word, MOST_SIZE);
        return false;
    }
    return *size >= 16;
}

static bool take_radius(const char *option, const char *word, void *user) {
    octree_plan *plan = user;
    return cli_uint32(option, word, 0, &plan->radii[plan->radius_count++]);
}

typedef struct octree_args {
    struct arg_str *mode, *model, *triangles, *way, *size, *view, *match, *most, *picture, *method, *code, *threshold, *band,
        *radius, *edits, *frames, *seconds, *warm_up, *check, *backend, *device, *threads, *copy, *csv, *json, *pictures, *strip;
    struct arg_lit *share, *upright, *quiet;
} octree_args;

static const char *const method_words[] = {"exact", "grown", NULL}, *const code_words[] = {"spherical", "octahedral", "floats",
                                                                                           "short", NULL};

static void add_options(cli_args *args, octree_args *a) {
    a->mode =
        cli_add(args, arg_str0(NULL, "mode", "MODE",
                               "picture (default): build, memory, rays and errors; memory: without rays; error: others at the "
                               "first way's memory, time or error; update: edits of a world; scale: a shell of voxels; share: "
                               "identical parts once; code: 32 bits against floats"));
    a->model = cli_add(args, arg_str0(NULL, "model", "NAME|FILE,...",
                                      "torus (default), sphere, box, building, tubes, sheet, files; or a scene of voxels"));
    a->triangles = cli_add(args, arg_str0(NULL, "triangles", "N", "about so many of a mesh that is no file; default 200000"));
    a->way = cli_add(args, arg_str0(NULL, "way", "WAY,...",
                                    "closest, closest-sampled, closest-near (leaves within a cell), closest-thin (leaves where the "
                                    "surface is, 16 bits a vector, merged within 0.15 cell), distance, distance-sampled, voxels, "
                                    "svo, svo-cubes, dag, tree64, bricks, field; default all"));
    a->size = cli_add(args, arg_str0(NULL, "size", "N,...", "finest cells along the longest edge; default 128,256"));
    a->view = cli_add(args, arg_str0(NULL, "view", "whole|half|close,...", "default whole,close"));
    a->match = cli_add(args, arg_str0(NULL, "match", "memory|time|surface|image,...", "error: default memory"));
    a->most = cli_add(args, arg_str0(NULL, "most", "N", "error: the largest size to try; default 1024"));
    a->picture = cli_add(args, arg_str0(NULL, "picture", "WxH", "default 480x300"));
    a->method = cli_add(args, arg_str0(NULL, "method", "exact|grown", "closest points; default exact"));
    a->code = cli_add(args, arg_str0(NULL, "code", "spherical|octahedral|floats|short", "default spherical"));
    a->threshold = cli_add(args, arg_str0(NULL, "threshold", "T", "of merging, in cells; default that of the library"));
    a->band = cli_add(args, arg_str0(NULL, "band", "B", "leaves with values this near, in cells; default that of the library"));
    a->share = cli_add(args, arg_lit0(NULL, "share", "keep identical parts once"));
    a->upright = cli_add(args, arg_lit0(NULL, "upright", "models have y up, not z"));
    a->radius = cli_add(args, arg_str0(NULL, "radius", "R,...", "update: of brushes; default 1,2,4,8,16"));
    a->edits = cli_add(args, arg_str0(NULL, "edits", "N", "update: of each radius; default 100"));
    a->frames = cli_add(args, arg_str0(NULL, "frames", "N", "pictures, and builds, of a row; default 20"));
    a->seconds = cli_add(args, arg_str0(NULL, "seconds", "S", "begin none of a row after this; default 2"));
    a->warm_up = cli_add(args, arg_str0(NULL, "warm-up", "S", "pictures before those that are timed; default 1"));
    a->check =
        cli_add(args, arg_str0(NULL, "check", "N", "pixels of each picture that are held against the surface; default 20000"));
    a->backend = cli_add(args, arg_str0(NULL, "backend", "auto|cpu|vulkan", "default auto: a real GPU, else the CPU"));
    a->device = cli_add(args, arg_str0(NULL, "device", "D", "Vulkan device: index or part of its name"));
    a->threads = cli_add(args, arg_str0(NULL, "threads", "N", "threads of the CPU backend; default one a processor"));
    a->copy = cli_add(args, arg_str0(NULL, "copy", "GB/S", "how fast the device copies, where that is known; else it is measured"));
    a->csv = cli_add(args, arg_str0(NULL, "csv", "FILE", "write a row each, when all are measured"));
    a->json = cli_add(args, arg_str0(NULL, "json", "FILE", "write everything as JSON"));
    a->pictures = cli_add(args, arg_str0(NULL, "pictures", "FOLDER", "keep what rays see"));
    a->strip = cli_add(args, arg_str0(NULL, "strip", "FILE.png",
                                      "error: the triangles and the first four ways at equal memory side by side, the second view "
                                      "below"));
    a->quiet = cli_add(args, arg_lit0("q", "quiet", "print nothing but errors"));
}

static bool read_numbers(const octree_args *a, octree_plan *p) {
    double warm_up = 0, threshold = 0, band = 0, copy = 0;
    int backend = 0, method = 0, code = 0;
    fm_shape picture;
    if (!cli_uint32("--triangles", cli_given(a->triangles, "200000"), 12, &p->triangles) ||
        !cli_uint32("--most", cli_given(a->most, "1024"), 16, &p->most) ||
        !cli_uint32("--edits", cli_given(a->edits, "100"), 1, &p->bench.edits) ||
        !cli_uint32("--frames", cli_given(a->frames, "20"), 1, &p->bench.frames) ||
        !cli_uint32("--check", cli_given(a->check, "20000"), 1, &p->bench.samples) ||
        !cli_double("--seconds", cli_given(a->seconds, "2"), &p->bench.seconds) ||
        !cli_double("--warm-up", cli_given(a->warm_up, "1"), &warm_up) ||
        !cli_double("--threshold", cli_given(a->threshold, "0"), &threshold) ||
        !cli_double("--band", cli_given(a->band, "0"), &band) || !cli_double("--copy", cli_given(a->copy, "0"), &copy) ||
        !cli_picture("--picture", cli_given(a->picture, "480x300"), &picture) ||
        !cli_word("--method", cli_given(a->method, "exact"), method_words, &method) ||
        !cli_word("--code", cli_given(a->code, "spherical"), code_words, &code) ||
        !cli_word("--backend", cli_given(a->backend, "auto"), fm_backend_words, &backend) ||
        (a->threads->count && !cli_uint32("--threads", a->threads->sval[0], 1, &p->session.threads))) {
        return false;
    }
    if (p->bench.frames > BENCH_STATS_MAX || p->bench.edits > BENCH_STATS_MAX || p->triangles > 100000000) {
        cli_usage("--frames and --edits are at most %d, --triangles at most 100 million", BENCH_STATS_MAX);
        return false;
    }
    p->bench.width = picture.x;
    p->bench.height = picture.y;
    p->bench.warm_up_ms = warm_up * 1e3;
    p->bench.method = (fm_octree_method)method;
    p->bench.code = (fm_octree_code)code;
    p->bench.threshold = (float)threshold;
    p->bench.band = (float)band;
    p->session.bandwidth = copy * 1e9;
    p->session.backend = (fm_backend)backend;
    p->session.device = cli_given(a->device, NULL);
    return true;
}

static bool read_plan(const octree_args *a, octree_plan *p) {
    *p = (octree_plan){.csv = cli_given(a->csv, NULL),
                       .json = cli_given(a->json, NULL),
                       .pictures = cli_given(a->pictures, NULL),
                       .strip = cli_given(a->strip, NULL)};
    p->quiet = a->quiet->count > 0;
    p->bench.share = a->share->count > 0;
    p->bench.upright = a->upright->count > 0;
    static const char *const all =
        "closest,closest-sampled,closest-near,closest-thin,distance,distance-sampled,voxels,svo,svo-cubes,dag,tree64,bricks,"
        "field";
    return cli_word("--mode", cli_given(a->mode, "picture"), bench_octree_mode_words, &p->mode) && read_numbers(a, p) &&
           cli_each("--model", cli_given(a->model, p->mode == BENCH_OCTREE_UPDATE ? "terrain" : "torus"), MAX_LIST, take_model,
                    p) &&
           cli_words("--way", cli_given(a->way, all), bench_octree_way_words, MAX_LIST, p->ways, &p->way_count) &&
           cli_words("--view", cli_given(a->view, "whole,close"), bench_octree_view_words, MAX_LIST, p->views, &p->view_count) &&
           cli_words("--match", cli_given(a->match, "memory"), bench_octree_match_words, MAX_LIST, p->matches, &p->match_count) &&
           cli_each("--size", cli_given(a->size, "128,256"), MAX_LIST, take_size, p) &&
           cli_each("--radius", cli_given(a->radius, "1,2,4,8,16"), MAX_LIST, take_radius, p);
}

int command_bench_octree(int argc, char **argv) {
    static const cli_help help = {
        "bench octree",
        "Builds octrees of every kind from the same models, looks at them by the same rays, and says what they cost in time and\n"
        "memory and how far what is seen is from ray-traced triangles. A sample of every picture is checked.",
        "fathom bench octree\n"
        "fathom bench octree --model bunny.ply --size 512 --picture 1920x1200 --csv pictures.csv\n"
        "fathom bench octree --mode error --match memory,time --way closest,distance,voxels,svo --size 64 --strip strip.png\n"
        "fathom bench octree --mode update --model terrain --size 256\n"
        "fathom bench octree --mode scale --way voxels,svo,dag,tree64 --size 256,1024,4096\n"
        "fathom bench octree --size 32 --triangles 600 --picture 60x40 --frames 2 --warm-up 0 --backend cpu\n"};
    cli_args args = {0};
    octree_args options;
    add_options(&args, &options);
    int status;
    if (cli_parse(&args, &help, argc, argv, &status)) {
        static octree_plan plan;
        status = read_plan(&options, &plan) ? run_plan(&plan) : CLI_USAGE;
    }
    cli_free(&args);
    return status;
}
