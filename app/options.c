// SPDX-License-Identifier: MIT
#include "options.h"

#include "fathom/mesh_io.h"
#include "files.h"
#include "mesh_options.h"
#include "method.h"
#include "words.h"

#include <stdlib.h>
#include <string.h>

typedef struct option_args {
    struct arg_str *in, *scene, *size, *seed, *march, *view, *shadow, *scale, *backend, *device, *threads, *window, *interval,
        *seconds, *frames, *radius, *csv, *edits, *last, *pictures, *log, *path;
    struct arg_lit *occlusion, *no_vsync, *validation, *headless;
    method_options method;
    mesh_options mesh;
} option_args;

static void add_options(cli_args *args, option_args *a) {
    a->in = cli_add(args, arg_str0(NULL, NULL, "IN", "a file of voxels, 0 is air: .vox, .npy, .nrrd, ...; or a mesh"));
    a->scene = cli_add(args, arg_str0(NULL, "scene", "NAME", "a procedural scene, or air; default terrain"));
    a->size = cli_add(args, arg_str0(NULL, "size", "N|X,Y,Z", "of the scene; default what suits the device"));
    a->seed = cli_add(args, arg_str0(NULL, "scene-seed", "S", "another scene of the same kind; default 0"));
    method_options_add(args, &a->method);
    mesh_options_add(args, &a->mesh);
    a->march = cli_add(args, arg_str0(NULL, "march", "skip|box|plain", "how rays travel; default skip"));
    a->view = cli_add(args, arg_str0(NULL, "view", "color|steps|normal|distance|slice|difference",
                                     "default color; of meshes color, normal, steps or share: how much of the sun is seen"));
    a->shadow = cli_add(args, arg_str0(NULL, "shadow", "none|hard|soft",
                                       "of the sun; default none; of meshes none, ray, rtsdf, cone (default), rays or map"));
    a->occlusion = cli_add(args, arg_lit0(NULL, "ao", "ambient occlusion"));
    a->scale = cli_add(args, arg_str0(NULL, "pixels", "1|2|4",
                                      "pixels of the window along an edge of one of the picture; default 1, "
                                      "without a GPU 2"));
    a->window = cli_add(args, arg_str0(NULL, "window", "WxH", "size of the window or picture; default 1280x720"));
    a->no_vsync = cli_add(args, arg_lit0(NULL, "no-vsync", "do not wait for the screen"));
    a->backend = cli_add(args, arg_str0(NULL, "backend", "auto|cpu|vulkan", "what computes; default auto"));
    a->device = cli_add(args, arg_str0(NULL, "device", "D", "Vulkan device: index or part of its name"));
    a->threads = cli_add(args, arg_str0(NULL, "threads", "N", "threads of the CPU backend; default one a processor"));
    a->path = cli_add(args, arg_str0(NULL, "file", "FILE", "what Ctrl+S saves to and Ctrl+O loads; default world.vox"));
    a->pictures = cli_add(args, arg_str0(NULL, "pictures", "DIRECTORY", "where F12 puts its pictures; default here"));
    a->edits = cli_add(args, arg_str0(NULL, "auto-edit", "SEED", "the benchmark: random edits, a fixed path of the camera"));
    a->interval = cli_add(args, arg_str0(NULL, "interval", "MS", "from edit to edit, 0: one a frame; default 500"));
    a->seconds = cli_add(args, arg_str0(NULL, "seconds", "S", "of the benchmark; default 30"));
    a->frames = cli_add(args, arg_str0(NULL, "frames", "N", "so many frames instead, with the same pictures every time"));
    a->radius = cli_add(args, arg_str0(NULL, "radius", "R", "of the brush, and the greatest of the benchmark's edits; default 4"));
    a->csv = cli_add(args, arg_str0(NULL, "csv", "FILE", "a line a frame of the benchmark"));
    a->headless = cli_add(args, arg_lit0(NULL, "headless", "the benchmark without a window"));
    a->last = cli_add(args, arg_str0(NULL, "last-frame", "FILE.png", "its last picture; without a window only"));
    a->validation =
        cli_add(args, arg_lit0(NULL, "validation", "with Vulkan's validation layer; its messages make the program fail"));
    a->log = cli_add(args, arg_str0(NULL, "log", "FILE", "a line for everything that happens, for programs that drive the window"));
}

static const char *given(const struct arg_str *option, const char *otherwise) {
    return option->count ? option->sval[0] : otherwise;
}

// A mesh is what the file's first bytes or name say, even without --mesh.
static bool read_input(const option_args *a, options *o) {
    static const char *const up_words[] = {"z", "y", NULL};
    int up = 0;
    const char *in = given(a->in, NULL);
    o->settings.meshes = a->mesh.meshes->count > 0 || (in && fm_mesh_format_of(in) != FM_MESH_FORMAT_AUTO);
    *(o->settings.meshes ? &o->mesh : &o->input) = in;
    if (!cli_word("--up", given(a->mesh.up, "z"), up_words, &up)) {
        return false;
    }
    o->mesh_y_up = up == 1;
    if (a->mesh.up->count && !o->mesh) {
        cli_usage("paint: --up is given without a mesh's file");
        return false;
    }
    return true;
}

static bool read_scene(const option_args *a, options *o) {
    int64_t seed = 0;
    if (o->input && (a->scene->count || a->size->count)) {
        cli_usage("paint: IN is given with --scene or --size: the file has its own voxels and size");
        return false;
    }
    const char *name = given(a->scene, "terrain");
    const fm_scene *scene = strcmp(name, "air") == 0 ? NULL : cli_scene("--scene", name);
    if (!scene && strcmp(name, "air") != 0) {
        return false;
    }
    while (fm_scene_at(o->settings.scene) && fm_scene_at(o->settings.scene) != scene) {
        o->settings.scene++;
    }
    if (!cli_int64("--scene-seed", given(a->seed, "0"), &seed)) {
        return false;
    }
    o->settings.scene_seed = (uint64_t)seed;
    return !a->size->count || cli_shape("--size", a->size->sval[0], &o->settings.shape);
}

static bool read_method(const option_args *a, options *o) {
    fm_world_desc desc = {0};
    if (!method_options_read(&a->method, &desc)) {
        return false;
    }
    o->settings.format = desc.format;
    o->settings.max_distance = desc.max_distance;
    o->settings.method = desc.method;
    o->settings.focus_stays = a->method.focus_at->count && desc.method.algorithm == FM_WORLD_SELECTIVE;
    // For when the panel chooses another algorithm.
    return cli_uint32("--focus", given(a->method.focus, "3"), 1, &o->settings.method.focus_chunks);
}

static bool read_window(const char *text, options *o) {
    fm_shape shape;
    if (!cli_picture("--window", text, &shape)) {
        return false;
    }
    if (shape.x < 64 || shape.y < 64) {
        cli_usage("--window is \"%s\": 64 pixels along each edge are the least", text);
        return false;
    }
    o->width = shape.x;
    o->height = shape.y;
    return true;
}

static bool read_picture(const option_args *a, options *o) {
    int march = 0, view = 0, shadow = 0;
    paint_settings *s = &o->settings;
    const char *words[2] = {given(a->shadow, NULL), given(a->view, NULL)};
    const bool meshes = s->meshes;
    if (!cli_word("--march", given(a->march, "skip"), fm_march_words, &march) ||
        !cli_word("--view", words[1] && !meshes ? words[1] : "color", fm_view_words, &view) ||
        !cli_word("--shadow", words[0] && !meshes ? words[0] : "none", fm_shadow_words, &shadow) ||
        !mesh_options_read(&a->mesh, meshes ? words[0] : NULL, meshes ? words[1] : NULL, &s->mesh) ||
        !cli_uint32("--pixels", given(a->scale, "0"), a->scale->count ? 1 : 0, &s->scale) ||
        !read_window(given(a->window, "1280x720"), o)) {
        return false;
    }
    if (s->scale == 3 || s->scale > 4) {
        cli_usage("--pixels is %u: 1, 2 or 4 is wanted", s->scale);
        return false;
    }
    s->march = (fm_march)march;
    s->view = (fm_view)view;
    s->shadow = (fm_shadow)shadow;
    s->ambient_occlusion = a->occlusion->count > 0;
    s->vsync = a->no_vsync->count == 0;
    s->crosshair = s->preview = true;
    s->slice_axis = 2;
    return true;
}

static bool read_benchmark(const option_args *a, options *o) {
    int64_t seed = 0;
    auto_desc *b = &o->benchmark;
    if (!cli_int64("--auto-edit", given(a->edits, "0"), &seed) ||
        !cli_double("--interval", given(a->interval, "500"), &b->interval_ms) ||
        !cli_double("--seconds", given(a->seconds, "30"), &b->seconds) ||
        !cli_uint32("--frames", given(a->frames, "0"), 0, &b->frames) ||
        !cli_uint32("--radius", given(a->radius, "4"), 0, &o->settings.radius)) {
        return false;
    }
    o->headless = a->headless->count > 0;
    b->meshes = o->settings.meshes;
    o->automatic = a->edits->count > 0 || (o->headless && b->meshes);
    o->last_frame = given(a->last, NULL);
    b->seed = (uint64_t)seed;
    b->csv = given(a->csv, NULL);
    b->radius = o->settings.radius ? o->settings.radius : 1;
    const char *wrong = NULL;
    if (b->interval_ms < 0 || b->seconds <= 0) {
        wrong = "--interval must not be below 0, and --seconds must be above";
    } else if (o->settings.radius > PAINT_MOST_RADIUS) {
        wrong = "--radius is above 64, the greatest";
    } else if (o->headless && !o->automatic) {
        wrong = "--headless is given without --auto-edit: there would be nothing to do";
    } else if (!o->automatic && (b->csv || a->interval->count || a->seconds->count || a->frames->count)) {
        wrong = "--csv, --interval, --seconds and --frames are of the benchmark: give --auto-edit too";
    } else if (o->last_frame && !o->headless) {
        wrong = "--last-frame is given without --headless: F12 takes pictures of a window";
    }
    if (wrong) {
        cli_usage("paint: %s", wrong);
    }
    return !wrong;
}

static bool read_rest(const option_args *a, options *o) {
    int backend = 0;
    if (!cli_word("--backend", given(a->backend, "auto"), fm_backend_words, &backend) ||
        (a->threads->count && !cli_uint32("--threads", a->threads->sval[0], 1, &o->threads))) {
        return false;
    }
    o->backend = (fm_backend)backend;
    o->device = given(a->device, NULL);
    o->validation = a->validation->count > 0;
    o->log = given(a->log, NULL);
    const char *broken = getenv("FATHOM_PAINT_BROKEN");
    o->broken_pictures = broken ? (uint32_t)strtoul(broken, NULL, 10) : 0;
    o->pictures = given(a->pictures, ".");
    o->history_bytes = (uint64_t)256 << 20;
    o->settings.speed = 40;
    const char *path = given(a->path, "world.vox");
    if (strlen(path) >= sizeof o->settings.path) {
        cli_usage("--file is longer than %d characters", PAINT_PATH - 1);
        return false;
    }
    snprintf(o->settings.path, sizeof o->settings.path, "%s", path);
    if (o->device && o->headless && o->backend == FM_BACKEND_CPU) {
        cli_usage("--device is given with --backend cpu: it names a Vulkan device");
        return false;
    }
    return true;
}

// Says early what would fail only after the work.
static int check_outputs(const options *o) {
    const int status = auto_check(&o->benchmark);
    return status == CLI_DONE && o->last_frame ? files_picture_check(o->last_frame) : status;
}

bool options_parse(cli_args *args, int argc, char **argv, options *o, int *status) {
    static const cli_help help = {
        "paint",
        "A window to fly through a voxel world, dig and build in it, while its distance field is kept exact. Without a GPU\n"
        "it runs on software Vulkan, in a small world. The focus of selective goes with the camera unless --focus-at says where it "
        "is.\nWith --mesh, or a mesh as IN, objects move over a floor instead, with soft shadows from their distance field.",
        "fathom paint --scene city --size 256\n"
        "fathom paint castle.vox --shadow soft --ao\n"
        "fathom paint --scene terrain --size 512 --auto-edit 1 --interval 500 --seconds 60 --csv frames.csv\n"
        "fathom paint --mesh bunny.ply --field rtsdf --shadow rtsdf\n"
        "fathom paint --headless --mesh --frames 100 --shadow cone --blend --last-frame last.png\n"
        "fathom paint --headless --auto-edit 1 --interval 0 --seconds 10 --size 1024 --window 1920x1080\n"};
    option_args a;
    *o = (options){0};
    add_options(args, &a);
    if (!cli_parse(args, &help, argc, argv, status)) {
        return false;
    }
    *status = CLI_USAGE;
    if (!read_input(&a, o) || !read_scene(&a, o) || !read_method(&a, o) || !read_picture(&a, o) || !read_benchmark(&a, o) ||
        !read_rest(&a, o)) {
        return false;
    }
    *status = check_outputs(o);
    return *status == CLI_DONE;
}

void options_suit(paint_settings *settings, const fm_device_info *device, bool window) {
    const bool processor = device->kind == FM_DEVICE_SOFTWARE || device->kind == FM_DEVICE_HOST;
    if (settings->shape.x == 0) {
        const uint32_t size = processor ? 96 : device->memory >= (uint64_t)6 << 30 ? 512 : 256;
        settings->shape = (fm_shape){size, size, size};
    }
    if (settings->mesh.edge == 0) {
        settings->mesh.edge = processor ? 48 : 256;
    }
    settings->mesh.map = processor ? 128 : 1024;
    if (settings->scale == 0) {
        settings->scale = processor && window ? 2 : 1;
    }
}
