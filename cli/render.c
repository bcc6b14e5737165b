// SPDX-License-Identifier: MIT
// fathom render: pictures and films of a world.

#include "cli.h"
#include "commands.h"
#include "files.h"
#include "method.h"
#include "path.h"
#include "pictures.h"
#include "video.h"
#include "words.h"
#include "world.h"

#include <inttypes.h>
#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

enum { MAX_PASSES = 128, TIMED_RUNS = 5, WARM_UP_MS = 300 };

typedef struct render_request {
    const char *in;
    const fm_scene *scene;
    fm_read_desc read;
    bench_session_desc session;
    fm_world_desc world;
    const method_options *method;
    fm_render_desc desc;  // camera aside
    bool slice_middle, quiet;
    camera_path path;
    pictures pictures;
} render_request;

typedef struct stage {
    const render_request *request;
    fm_context *context;
    fm_world *world;
    fm_renderer *renderer;
    uint8_t *pixels;
} stage;

static fm_camera camera_of(const render_request *request, uint32_t frame) {
    const double aspect = (double)request->desc.width / request->desc.height;
    return camera_path_at(&request->path, request->world.shape, aspect, frame);
}

static int draw(void *user, uint32_t frame) {
    const stage *s = user;
    fm_render_desc desc = s->request->desc;
    desc.camera = camera_of(s->request, frame);
    const bool good = fm_render(s->renderer, s->world, &desc, NULL) == FM_OK && fm_renderer_read(s->renderer, s->pixels) == FM_OK;
    return good ? CLI_DONE : cli_library_failed();
}

// GPU time of a picture, or the CPU's: the median of a few.
static fm_result time_picture(const stage *s, const fm_render_desc *desc, double *ms) {
    double values[TIMED_RUNS];
    const double begin = fm_now_ms();
    for (int i = 0; i < TIMED_RUNS; i++) {
        fm_pass passes[MAX_PASSES];
        uint32_t count = MAX_PASSES;
        fm_result result = fm_render(s->renderer, s->world, desc, NULL);
        result = result == FM_OK ? fm_context_passes(s->context, &count, passes) : result;
        if (result != FM_OK) {
            return result;
        }
        values[i] = 0;
        for (uint32_t k = 0; k < count; k++) {
            values[i] += passes[k].milliseconds;
        }
        // An idle GPU takes a moment to run at full speed.
        if (i == 0 && fm_context_backend(s->context) == FM_BACKEND_VULKAN && fm_now_ms() - begin < WARM_UP_MS) {
            i = -1;
        }
    }
    *ms = bench_stats_of(values, TIMED_RUNS).median;
    return FM_OK;
}

static int print_stats(const stage *s) {
    fm_render_desc desc = s->request->desc;
    desc.camera = camera_of(s->request, 0);
    double ms = 0;
    fm_render_stats stats, wrong;
    fm_result result = time_picture(s, &desc, &ms);
    desc.count = true;
    result = result == FM_OK ? fm_render(s->renderer, s->world, &desc, NULL) : result;
    result = result == FM_OK ? fm_renderer_stats(s->renderer, &stats) : result;
    desc.view = FM_VIEW_DIFFERENCE;
    result = result == FM_OK ? fm_render(s->renderer, s->world, &desc, NULL) : result;
    result = result == FM_OK ? fm_renderer_stats(s->renderer, &wrong) : result;
    if (result != FM_OK) {
        return cli_library_failed();
    }
    fm_device_info device;
    fm_context_device(s->context, &device);
    const double rays = (double)stats.rays > 0 ? (double)stats.rays : 1;
    printf("%s (%s): %.3f ms, %.3g primary rays/s\n", device.name, device.driver, ms, ms > 0 ? rays * 1e3 / ms : 0);
    printf("%" PRIu64 " rays, %" PRIu64 " meet a solid voxel; %.2f steps a ray, at most %" PRIu64 "\n", stats.rays, stats.hits,
           (double)stats.steps / rays, stats.most_steps);
    printf("field reads a ray: %.3f by beams, %.3f towards the sun, %.3f for occlusion\n", (double)stats.beam_reads / rays,
           (double)stats.sun_reads / rays, (double)stats.occlusion_reads / rays);
    printf("wrong pixels against the march voxel by voxel: %" PRIu64 " (%.4f %%)\n", wrong.wrong, 100 * (double)wrong.wrong / rays);
    return CLI_DONE;
}

static int start_volume(render_request *request, fm_volume **volume) {
    if (request->scene) {
        const fm_scene_desc desc = {.shape = request->world.shape};
        *volume = bench_world_scene(request->scene, &desc);
        return *volume ? CLI_DONE : cli_library_failed();
    }
    fm_file_info info;
    const int status = files_read(request->in, &request->read, request->quiet, volume, &info);
    request->world.shape = info.shape;
    if (status == CLI_DONE && !request->quiet && info.note[0]) {
        printf("%s: %s\n", request->in, info.note);
    }
    return status;
}

static int work(render_request *request, stage *s, const fm_volume *start) {
    method_focus(request->method, &request->world);
    if (request->slice_middle) {
        const fm_shape shape = request->world.shape;
        const uint32_t axes[3] = {shape.x, shape.y, shape.z};
        request->desc.slice_index = (int32_t)(axes[request->desc.slice_axis] / 2);
    }
    s->pixels = malloc(4 * (size_t)request->desc.width * request->desc.height);
    if (!s->pixels) {
        return cli_fail("out of memory: free some");
    }
    if (!s->context || fm_world_create(s->context, &request->world, &s->world) != FM_OK ||
        fm_world_load(s->world, start) != FM_OK || fm_world_update(s->world, NULL) != FM_OK ||
        fm_renderer_create(s->context, &s->renderer) != FM_OK) {
        return cli_library_failed();
    }
    const char *out = request->pictures.out;
    const int status = out ? pictures_write(&request->pictures, s->pixels, draw, s) : CLI_DONE;
    if (status == CLI_DONE && out && !request->quiet) {
        printf("%s: %u x %u pixels%s\n", out, request->desc.width, request->desc.height,
               request->path.frames > 1 ? ", a path" : "");
    }
    return status == CLI_DONE && request->pictures.stats ? print_stats(s) : status;
}

static int run(render_request *request) {
    int status = pictures_check(&request->pictures);
    if (status != CLI_DONE) {
        return status;
    }
    fm_volume *start = NULL;
    bench_session *session = bench_session_create(&request->session);
    status = session ? start_volume(request, &start) : cli_fail("out of memory: free some");
    if (status == CLI_DONE) {
        stage s = {.request = request, .context = bench_session_context(session, FM_BACKEND_AUTO)};
        status = work(request, &s, start);
        fm_renderer_destroy(s.renderer);
        fm_world_destroy(s.world);
        free(s.pixels);
        fm_volume_destroy(start);
    }
    bench_session_destroy(session);
    return status;
}

typedef struct render_args {
    struct arg_str *in, *march, *view, *shadow, *sun, *slice, *occlusion;
    struct arg_lit *crosshair, *quiet;
    picture_options pictures;
    cli_device device;
    files_input input;
    method_options method;
} render_args;

static void add_options(cli_args *args, render_args *a) {
    a->in = cli_add(args, arg_str1(NULL, NULL, "WORLD", "a volume file, or scene:NAME:SIZE"));
    picture_options_add(args, &a->pictures, false, "print time, steps a ray and wrong pixels of the first picture");
    a->march = cli_add(args, arg_str0(NULL, "march", "skip|box|plain", "how rays use the field; default skip"));
    a->view = cli_add(args, arg_str0(NULL, "view", "color|steps|normal|distance|slice|difference", "default color"));
    a->shadow = cli_add(args, arg_str0(NULL, "shadow", "none|hard|soft", "default soft"));
    a->occlusion = cli_add(args, arg_str0(NULL, "ao", "on|off", "ambient occlusion; default on"));
    a->sun = cli_add(args, arg_str0(NULL, "sun", "X,Y,Z", "the way to the sun"));
    a->slice = cli_add(args, arg_str0(NULL, "slice", "x|y|z[,INDEX]", "with --view slice; default z, the middle"));
    a->crosshair = cli_add(args, arg_lit0(NULL, "crosshair", "mark the middle"));
    method_options_add(args, &a->method);
    cli_device_add(args, &a->device);
    files_input_add(args, &a->input);
    a->quiet = cli_add(args, arg_lit0("q", "quiet", "print nothing but errors and what --stats asks for"));
}

static bool read_slice(const render_args *a, render_request *r) {
    const char *text = cli_given(a->slice, "z");
    const char *axis = strchr("xyz", text[0]);
    double index = 0;
    r->slice_middle = text[0] && text[1] == '\0';
    if (!text[0] || !axis ||
        (!r->slice_middle && (text[1] != ',' || !path_numbers(text + 2, 1, 1, &index) || index < 0 || index > 16383))) {
        cli_usage("--slice is \"%s\": x, y or z is wanted, or one of them with a slice: z,10", text);
        return false;
    }
    r->desc.slice_axis = (uint32_t)(axis - "xyz");
    r->desc.slice_index = (int32_t)index;
    return true;
}

static bool read_look(const render_args *a, render_request *r) {
    static const char *const switches[] = {"on", "off", NULL};
    int march = 0, view = 0, shadow = 0, occlusion = 0;
    double sun[3] = {0};
    if (!cli_word("--march", cli_given(a->march, "skip"), fm_march_words, &march) ||
        !cli_word("--view", cli_given(a->view, "color"), fm_view_words, &view) ||
        !cli_word("--shadow", cli_given(a->shadow, "soft"), fm_shadow_words, &shadow) ||
        !cli_word("--ao", cli_given(a->occlusion, "on"), switches, &occlusion) || !read_slice(a, r) ||
        (a->sun->count && !cli_triple("--sun", a->sun->sval[0], sun))) {
        return false;
    }
    r->desc.width = r->pictures.width;
    r->desc.height = r->pictures.height;
    r->desc.march = (fm_march)march;
    r->desc.view = (fm_view)view;
    r->desc.shadow = (fm_shadow)shadow;
    r->desc.ambient_occlusion = occlusion == 0;
    r->desc.crosshair = a->crosshair->count > 0;
    for (int i = 0; i < 3; i++) {
        r->desc.sun[i] = (float)sun[i];
    }
    return true;
}

static bool read_world(const render_args *a, render_request *r) {
    static const char prefix[] = "scene:";
    r->in = a->in->sval[0];
    if (!files_input_desc(&a->input, &r->read) || !method_options_read(&a->method, &r->world)) {
        return false;
    }
    if (strncmp(r->in, prefix, sizeof prefix - 1) != 0) {
        return true;
    }
    char name[64];
    const char *text = r->in + sizeof prefix - 1, *colon = strchr(text, ':');
    snprintf(name, sizeof name, "%.*s", (int)(colon ? colon - text : 0), text);
    if (!colon) {
        cli_usage("WORLD is \"%s\": scene:NAME:SIZE is wanted, such as scene:terrain:256", r->in);
        return false;
    }
    r->scene = cli_scene("WORLD", name);
    return r->scene && cli_shape_word("WORLD", colon + 1, &r->world.shape);
}

static bool read_device(const render_args *a, render_request *r) {
    fm_context_desc wanted = {0};
    if (!cli_device_read(&a->device, &wanted)) {
        return false;
    }
    r->session.backend = wanted.backend;
    r->session.device = wanted.device;
    r->session.threads = wanted.threads;
    r->quiet = a->quiet->count > 0;
    return true;
}

int command_render(int argc, char **argv) {
    if (render_mesh_wanted(argc, argv)) {
        return command_render_mesh(argc, argv);
    }
    static const cli_help help = {
        "render", "Makes pictures of a world by marching rays through its distance field.",
        "fathom render scene:terrain:256 --out terrain.png\n"
        "fathom render castle.vox --size 1920x1080 --camera 20,-40,60,70,-30 --out castle.png\n"
        "fathom render scene:city:256 --path 120 --out around.mp4\n"
        "fathom render scene:terrain:128 --view slice --slice y --out field.png\n"
        "fathom render scene:terrain:128 --algorithm jfa-published --chunk 16 --view difference --out wrong.png --stats\n"};
    cli_args args = {0};
    render_args options;
    add_options(&args, &options);
    int status;
    if (cli_parse(&args, &help, argc, argv, &status)) {
        static render_request request;
        request = (render_request){.method = &options.method};
        const bool good = read_world(&options, &request) &&
                          picture_options_read(&options.pictures, &request.pictures, &request.path) &&
                          read_look(&options, &request) && read_device(&options, &request);
        status = good ? run(&request) : CLI_USAGE;
    }
    cli_free(&args);
    return status;
}
