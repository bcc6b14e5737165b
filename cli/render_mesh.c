// SPDX-License-Identifier: MIT
// fathom render of meshes and of signed distance fields: clay, with shadows from the field.

#include "cli.h"
#include "commands.h"
#include "files.h"
#include "path.h"
#include "pictures.h"
#include "progress.h"
#include "words.h"

#include "fathom/deferred.h"
#include "fathom/mesh_io.h"
#include "fathom/sdf.h"

#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

enum { MARGIN = 3, MAX_PASSES = 128 };

static const char *const up_words[] = {"z", "y", NULL};
static const char *const surface_words[] = {"mesh", "field", NULL};
static const char *const shadow_words[] = {"none", "ray", "rtsdf", "cone", "rays", "map", NULL};
static const char *const view_words[] = {"color", "normal", "steps", "share", NULL};

typedef struct shot {
    const char *in;
    bool is_mesh, y_up, stats, quiet;
    fm_context_desc wanted;
    uint32_t edge, blend;
    double level;           // in voxels
    fm_deferred_desc desc;  // camera, mesh and field aside
    camera_path path;
    pictures pictures;
    // Filled as the work goes on.
    fm_context *context;
    fm_mesh *mesh;
    fm_volume *field;
    fm_deferred *deferred;
    uint8_t *pixels;
    fm_sdf_info info;
} shot;

static fm_result field_of_mesh(shot *s) {
    fm_volume_desc grid = {.type = FM_TYPE_F32};
    const fm_sdf_desc desc = {.far_texels = FM_FAR_FLOODED};
    fm_result result = fm_mesh_fit(s->mesh, s->edge, MARGIN, &grid);
    result = result == FM_OK ? fm_volume_create(s->context, &grid, &s->field) : result;
    return result == FM_OK ? fm_mesh_sdf(s->mesh, &desc, s->field, NULL, &s->info, NULL) : result;
}

// Turned so that y comes to point up.
static fm_result turn_up(fm_mesh *mesh) {
    const float(*from)[3];
    uint64_t count;
    fm_mesh_arrays(mesh, &from, &count, NULL, NULL);
    float(*to)[3] = malloc(count * sizeof *to + 1);
    if (!to) {
        return FM_ERROR_OUT_OF_HOST_MEMORY;
    }
    for (uint64_t i = 0; i < count; i++) {
        to[i][0] = from[i][0];
        to[i][1] = -from[i][2];
        to[i][2] = from[i][1];
    }
    const fm_result result = fm_mesh_deform(mesh, (const float(*)[3])to, FM_TREE_REBUILD);
    free(to);
    return result;
}

static int read_mesh(shot *s) {
    progress bar = progress_begin("reading", !s->quiet);
    const fm_mesh_read_desc desc = {.progress = progress_step, .progress_user = &bar};
    fm_result result = fm_mesh_read(s->context, s->in, &desc, &s->mesh, NULL);
    progress_end(&bar);
    result = result == FM_OK && s->y_up ? turn_up(s->mesh) : result;
    result = result == FM_OK ? field_of_mesh(s) : result;
    return result == FM_OK ? CLI_DONE : cli_library_failed();
}

static int read_field(shot *s) {
    fm_volume *host = NULL;
    fm_file_info info;
    const int status = files_read(s->in, &(fm_read_desc){0}, s->quiet, &host, &info);
    if (status != CLI_DONE) {
        return status;
    }
    fm_volume_desc grid;
    fm_volume_info(host, &grid);
    grid.storage = FM_STORAGE_DEFAULT;
    fm_result result = FM_OK;
    int wrong = CLI_DONE;
    if (grid.type != FM_TYPE_F32) {
        wrong = cli_fail("%s: its elements are %s: a signed distance field of float32 is wanted, as fathom sdf writes", s->in,
                         fm_type_name(grid.type));
    } else {
        result = fm_volume_create(s->context, &grid, &s->field);
        result = result == FM_OK ? fm_volume_upload(s->field, fm_volume_data(host)) : result;
    }
    fm_volume_destroy(host);
    return wrong != CLI_DONE ? wrong : result == FM_OK ? CLI_DONE : cli_library_failed();
}

static void place_camera(shot *s) {
    fm_volume_desc grid;
    fm_volume_info(s->field, &grid);
    const uint32_t axes[3] = {grid.shape.x, grid.shape.y, grid.shape.z};
    double low[3], high[3], voxel = INFINITY;
    for (int i = 0; i < 3; i++) {
        low[i] = grid.origin[i] - 0.5 * grid.spacing[i];
        high[i] = low[i] + grid.spacing[i] * axes[i];
        voxel = fmin(voxel, grid.spacing[i]);
    }
    camera_path_fit(&s->path, low, high, (double)s->desc.width / s->desc.height);
    s->desc.level = (float)(s->level * voxel);
}

static int draw(void *user, uint32_t frame) {
    shot *s = user;
    s->desc.camera = camera_path_at(&s->path, (fm_shape){1, 1, 1}, (double)s->desc.width / s->desc.height, frame);
    fm_result result = FM_OK;
    for (uint32_t i = 0; result == FM_OK && i < s->blend; i++) {
        s->desc.taa = s->blend > 1;
        s->desc.frame = i;
        result = fm_deferred_render(s->deferred, &s->desc, NULL);
    }
    result = result == FM_OK ? fm_deferred_read(s->deferred, s->pixels) : result;
    return result == FM_OK ? CLI_DONE : cli_library_failed();
}

static int print_stats(shot *s) {
    fm_pass passes[MAX_PASSES];
    uint32_t count = MAX_PASSES;
    fm_device_info device;
    if (fm_context_passes(s->context, &count, passes) != FM_OK) {
        return cli_library_failed();
    }
    fm_context_device(s->context, &device);
    printf("%s (%s): the last of %u frames that are blended\n", device.name, device.driver, s->blend);
    for (uint32_t i = 0; i < count; i++) {
        printf("  %-10s %9.3f ms\n", passes[i].name, passes[i].milliseconds);
    }
    return CLI_DONE;
}

static int work(shot *s) {
    if (fm_context_create(&s->wanted, &s->context) != FM_OK) {
        return cli_library_failed();
    }
    int status = s->is_mesh ? read_mesh(s) : read_field(s);
    if (status != CLI_DONE) {
        return status;
    }
    place_camera(s);
    s->desc.mesh = s->mesh;
    s->desc.field = s->field;
    s->pixels = malloc(4 * (size_t)s->desc.width * s->desc.height);
    if (!s->pixels) {
        return cli_fail("out of memory: free some");
    }
    if (fm_deferred_create(s->context, &s->deferred) != FM_OK) {
        return cli_library_failed();
    }
    status = s->pictures.out ? pictures_write(&s->pictures, s->pixels, draw, s) : draw(s, 0);
    if (status == CLI_DONE && s->pictures.out && !s->quiet) {
        fm_volume_desc grid;
        fm_volume_info(s->field, &grid);
        printf("%s: %u x %u pixels%s, field of %u x %u x %u%s%s\n", s->pictures.out, s->desc.width, s->desc.height,
               s->pictures.frames > 1 ? ", a path" : "", grid.shape.x, grid.shape.y, grid.shape.z, s->is_mesh ? ", sign: " : "",
               s->is_mesh ? s->info.sign_why : "");
    }
    return status == CLI_DONE && s->stats ? print_stats(s) : status;
}

static int run(shot *s) {
    int status = s->pictures.out ? pictures_check(&s->pictures) : CLI_DONE;
    if (status == CLI_DONE) {
        status = work(s);
        fm_deferred_destroy(s->deferred);
        fm_volume_destroy(s->field);
        fm_mesh_destroy(s->mesh);
        fm_context_destroy(s->context);
        free(s->pixels);
    }
    return status;
}

typedef struct shot_args {
    struct arg_str *in, *out, *size, *fps, *up, *edge, *surface, *shadow, *samples, *light, *light_size, *view, *level, *blend,
        *backend, *device, *threads;
    struct arg_lit *field, *stats, *quiet;
    path_options path;
} shot_args;

static void add_options(cli_args *args, shot_args *a) {
    a->in = cli_add(args, arg_str1(NULL, NULL, "MESH|FIELD", "a mesh file; with --field a volume of signed distances, float32"));
    a->field = cli_add(args, arg_lit0(NULL, "field", "the file is a field"));
    a->out = cli_add(args, arg_str0("o", "out", "FILE", "the picture, .png; a film, .mp4 or .webm, by ffmpeg"));
    a->size = cli_add(args, arg_str0(NULL, "size", "WxH", "default 1280x720"));
    path_options_add(args, &a->path);
    a->fps = cli_add(args, arg_str0(NULL, "fps", "F", "of a film; default 30"));
    a->up = cli_add(args,
                    arg_str0(NULL, "up", "y|z", "which axis of a mesh points up: y turns it, (x, y, z) to (x, -z, y); default z"));
    a->edge = cli_add(args, arg_str0(NULL, "edge", "N", "voxels along the longest edge of a mesh's field; default 256"));
    a->surface = cli_add(args, arg_str0(NULL, "surface", "field|mesh", "what is seen; default field"));
    a->shadow = cli_add(args, arg_str0(NULL, "shadow", "none|ray|rtsdf|cone|rays|map",
                                       "one ray; the published march; cones, ours (default); many rays; shadow maps"));
    a->samples = cli_add(args, arg_str0(NULL, "samples", "N", "of cone (default 1) and rays (default 256)"));
    a->light = cli_add(args, arg_str0(NULL, "sun", "X,Y,Z", "the way to the sun"));
    a->light_size = cli_add(args, arg_str0(NULL, "sun-size", "DEGREES", "half the angle of the sun's disc; default 2"));
    a->view =
        cli_add(args, arg_str0(NULL, "view", "color|normal|steps|share", "default color; share: how much of the sun is seen"));
    a->level = cli_add(args, arg_str0(NULL, "level", "L", "draw the surface at this distance, in voxels; default 0"));
    a->blend = cli_add(args, arg_str0(NULL, "blend", "N", "frames that are blended, to smooth edges; default 16"));
    a->stats = cli_add(args, arg_lit0(NULL, "stats", "print the times of the passes"));
    a->backend = cli_add(args, arg_str0(NULL, "backend", "auto|cpu|vulkan", "default auto: a real GPU, else the CPU"));
    a->device = cli_add(args, arg_str0(NULL, "device", "D", "Vulkan device: index or part of its name"));
    a->threads = cli_add(args, arg_str0(NULL, "threads", "N", "threads of the CPU backend; default one a processor"));
    a->quiet = cli_add(args, arg_lit0("q", "quiet", "print nothing but errors and what --stats asks for"));
}

static bool read_light(const shot_args *a, shot *s) {
    double way[3] = {0.48, -0.56, 0.6757}, size = 2;
    if ((a->light->count && !cli_triple("--sun", a->light->sval[0], way)) ||
        !cli_double("--sun-size", cli_given(a->light_size, "2"), &size)) {
        return false;
    }
    if (!(size >= 0 && size < 45)) {
        cli_usage("--sun-size is %g: 0 or above, and below 45", size);
        return false;
    }
    s->desc.light_count = 1;
    s->desc.lights[0].size = (float)size;
    for (int i = 0; i < 3; i++) {
        s->desc.lights[0].way[i] = (float)way[i];
    }
    return true;
}

static bool check_combinations(const shot *s) {
    const char *wrong = pictures_wrong(&s->pictures);
    if (wrong) {
        cli_usage("%s", wrong);
        return false;
    }
    if (!s->pictures.out && !s->stats) {
        wrong = "nothing to do: give --out FILE, --stats or both";
    } else if (s->pictures.frames > 1 && !s->pictures.out) {
        wrong = "--path is given without --out";
    } else if (!s->is_mesh && s->y_up) {
        wrong = "--up turns meshes, not fields";
    } else if (!s->is_mesh && (s->desc.surface == FM_SURFACE_MESH || s->desc.shadows == FM_SHADOWS_RAY ||
                               s->desc.shadows == FM_SHADOWS_DISTRIBUTED || s->desc.shadows == FM_SHADOWS_MAP)) {
        wrong = "a field has no triangles: --surface field, and --shadow none, rtsdf or cone are there for it";
    }
    if (wrong) {
        cli_usage("%s", wrong);
    }
    return !wrong;
}

static bool read_shot(const shot_args *a, shot *s) {
    *s = (shot){.in = a->in->sval[0], .is_mesh = a->field->count == 0};
    int up = 0, surface = 0, shadow = 0, view = 0, backend = 0;
    fm_shape size;
    s->stats = a->stats->count > 0;
    s->quiet = a->quiet->count > 0;
    s->pictures = (pictures){.out = cli_given(a->out, NULL), .fps = 30};
    if (!cli_picture("--size", cli_given(a->size, "1280x720"), &size) || !path_options_read(&a->path, &s->path) ||
        (a->fps->count && !cli_double("--fps", a->fps->sval[0], &s->pictures.fps)) ||
        !cli_uint32("--edge", cli_given(a->edge, "256"), 2 * MARGIN + 1, &s->edge) ||
        !cli_word("--up", cli_given(a->up, "z"), up_words, &up) ||
        !cli_word("--surface", cli_given(a->surface, "field"), surface_words, &surface) ||
        !cli_word("--shadow", cli_given(a->shadow, "cone"), shadow_words, &shadow) ||
        !cli_word("--view", cli_given(a->view, "color"), view_words, &view) || !read_light(a, s) ||
        !cli_uint32("--samples", cli_given(a->samples, shadow == FM_SHADOWS_DISTRIBUTED ? "256" : "1"), 1, &s->desc.samples) ||
        !cli_double("--level", cli_given(a->level, "0"), &s->level) ||
        !cli_uint32("--blend", cli_given(a->blend, "16"), 1, &s->blend) ||
        !cli_word("--backend", cli_given(a->backend, "auto"), fm_backend_words, &backend) ||
        (a->threads->count && !cli_uint32("--threads", a->threads->sval[0], 1, &s->wanted.threads))) {
        return false;
    }
    if (s->desc.samples > 65536 || s->edge > 4096 || s->blend > 4096) {
        cli_usage("--samples is at most 65536, --edge and --blend at most 4096");
        return false;
    }
    s->y_up = up == 1;
    s->wanted.backend = (fm_backend)backend;
    s->wanted.device = cli_given(a->device, NULL);
    s->desc.width = s->pictures.width = size.x;
    s->desc.height = s->pictures.height = size.y;
    s->pictures.frames = s->path.frames;
    s->desc.surface = (fm_surface)surface;
    s->desc.shadows = (fm_shadows)shadow;
    s->desc.view = (fm_deferred_view)view;
    s->desc.jitter = s->blend > 1;
    return check_combinations(s);
}

bool render_mesh_wanted(int argc, char **argv) {
    for (int i = 1; i < argc; i++) {
        if (strcmp(argv[i], "--field") == 0 || (argv[i][0] != '-' && fm_mesh_format_of(argv[i]) != FM_MESH_FORMAT_AUTO)) {
            return true;
        }
    }
    return false;
}

int command_render_mesh(int argc, char **argv) {
    static const cli_help help = {"render",
                                  "Draws a mesh, by the signed distance field that is made of it, or a field from a file, in clay "
                                  "with soft shadows. Lengths\n"
                                  "are in the mesh's units. (fathom render WORLD draws voxels; see fathom render --help.)",
                                  "fathom render armadillo.obj --up y --out armadillo.png\n"
                                  "fathom render bunny.ply --edge 512 --shadow cone --samples 4 --sun-size 5 --out bunny.png\n"
                                  "fathom render bunny.ply --surface mesh --shadow rays --out truth.png\n"
                                  "fathom render field.npy --field --view normal --path 90 --out around.mp4\n"};
    cli_args args = {0};
    shot_args options;
    add_options(&args, &options);
    int status;
    if (cli_parse(&args, &help, argc, argv, &status)) {
        static shot s;
        status = read_shot(&options, &s) ? run(&s) : CLI_USAGE;
    }
    cli_free(&args);
    return status;
}
