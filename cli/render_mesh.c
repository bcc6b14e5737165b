// SPDX-License-Identifier: MIT
// fathom render of meshes and of signed distance fields: clay, with shadows from the field.

#include "cli.h"
#include "commands.h"
#include "files.h"
#include "mesh_input.h"
#include "path.h"
#include "pictures.h"
#include "words.h"

#include "fathom/deferred.h"

#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

enum { MARGIN = 3 };

static const char *const surface_words[] = {"mesh", "field", NULL};
static const char *const shadow_words[] = {"none", "ray", "rtsdf", "cone", "rays", "map", NULL};
static const char *const view_words[] = {"color", "normal", "steps", "share", NULL};

typedef struct shot {
    mesh_input in;
    bool is_mesh, quiet;
    fm_read_desc read;  // of a field
    double spacing[3];  // of a field, instead of its own; 0: not given
    fm_sign sign;       // of a mesh's field
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

static double voxel_of(const fm_volume *field) {
    fm_volume_desc grid;
    fm_volume_info(field, &grid);
    return fmin(grid.spacing[0], fmin(grid.spacing[1], grid.spacing[2]));
}

static fm_result field_of_mesh(shot *s) {
    fm_volume_desc grid = {.type = FM_TYPE_F32};
    const fm_sdf_desc desc = {.far_texels = FM_FAR_FLOODED, .sign = s->sign};
    fm_result result = fm_mesh_fit(s->mesh, s->edge, MARGIN, &grid);
    result = result == FM_OK ? fm_volume_create(s->context, &grid, &s->field) : result;
    return result == FM_OK ? fm_mesh_sdf(s->mesh, &desc, s->field, NULL, &s->info, NULL) : result;
}

static void say_note(const shot *s, const char *note) {
    if (note[0] && !s->quiet) {
        printf("note: %s\n", note);
    }
}

static int read_mesh(shot *s) {
    const int status = mesh_input_load(&s->in, s->context, &s->mesh, NULL);
    if (status != CLI_DONE) {
        return status;
    }
    char note[MESH_NOTE] = "";
    fm_result result = field_of_mesh(s);
    if (result == FM_OK && s->desc.surface == FM_SURFACE_FIELD) {
        result = mesh_input_note(s->mesh, s->field, s->info.sign, s->level * voxel_of(s->field), note);
    }
    say_note(s, note);
    return result == FM_OK ? CLI_DONE : cli_library_failed();
}

// How fast a field in host memory grows across its surface, a unit of length, on the average: 1 where its spacing is that of its
// distances. 0 where it has no surface.
static double slope_of(fm_volume *field) {
    fm_volume_desc grid;
    fm_volume_info(field, &grid);
    const float *texels = fm_volume_data(field);
    const uint32_t axes[3] = {grid.shape.x, grid.shape.y, grid.shape.z};
    const uint64_t strides[3] = {1, axes[0], (uint64_t)axes[0] * axes[1]};
    double sum = 0, count = 0;
    for (uint32_t z = 1; z + 1 < axes[2]; z++) {
        for (uint32_t y = 1; y + 1 < axes[1]; y++) {
            for (uint32_t x = 1; x + 1 < axes[0]; x++) {
                const float *at = texels + z * strides[2] + y * strides[1] + x;
                double square = 0;
                bool beside = false;
                for (int i = 0; i < 3; i++) {
                    const float after = at[strides[i]], before = *(at - strides[i]);
                    const double change = ((double)after - (double)before) / (2 * grid.spacing[i]);
                    square += change * change;
                    beside = beside || (after < 0) != (*at < 0) || (before < 0) != (*at < 0);
                }
                if (beside && isfinite(square)) {
                    sum += sqrt(square);
                    count++;
                }
            }
        }
    }
    return count > 0 ? sum / count : 0;
}

static void warn_of_spacing(const shot *s, fm_volume *field) {
    const double slope = slope_of(field);
    fm_volume_desc grid;
    fm_volume_info(field, &grid);
    if (slope > 0 && (slope < 0.5 || slope > 2)) {
        char note[MESH_NOTE];
        snprintf(
            note, sizeof note,
            "distances grow by %.3g a unit of length, not by 1, with voxels of %.6g: shadows are wrong; give --spacing, perhaps "
            "%.2g, or a file that keeps it, such as .nrrd",
            slope, grid.spacing[0], grid.spacing[0] * slope);
        say_note(s, note);
    }
}

// The field as if it had been read with the spacing that is given.
static fm_result respace(const shot *s, fm_volume **host) {
    fm_volume_desc grid;
    fm_volume_info(*host, &grid);
    memcpy(grid.spacing, s->spacing, sizeof grid.spacing);
    fm_volume *made = NULL;
    fm_result result = fm_volume_create(NULL, &grid, &made);
    result = result == FM_OK ? fm_volume_upload(made, fm_volume_data(*host)) : result;
    fm_volume_destroy(result == FM_OK ? *host : made);
    *host = result == FM_OK ? made : *host;
    return result;
}

static int read_field(shot *s) {
    fm_volume *host = NULL;
    const int status = files_read(s->in.path, &s->read, s->quiet, &host, NULL);
    if (status != CLI_DONE) {
        return status;
    }
    fm_volume_desc grid;
    fm_volume_info(host, &grid);
    fm_result result = FM_OK;
    int wrong = CLI_DONE;
    if (grid.type != FM_TYPE_F32) {
        wrong = cli_fail("%s: its elements are %s: a signed distance field of float32 is wanted, as fathom sdf writes", s->in.path,
                         fm_type_name(grid.type));
    } else {
        result = s->spacing[0] > 0 ? respace(s, &host) : FM_OK;
        fm_volume_info(host, &grid);
        grid.storage = FM_STORAGE_DEFAULT;
        if (result == FM_OK) {
            warn_of_spacing(s, host);
            result = fm_volume_create(s->context, &grid, &s->field);
        }
        result = result == FM_OK ? fm_volume_upload(s->field, fm_volume_data(host)) : result;
    }
    fm_volume_destroy(host);
    return wrong != CLI_DONE ? wrong : result == FM_OK ? CLI_DONE : cli_library_failed();
}

static void place_camera(shot *s) {
    fm_volume_desc grid;
    fm_volume_info(s->field, &grid);
    const uint32_t axes[3] = {grid.shape.x, grid.shape.y, grid.shape.z};
    double low[3], high[3];
    for (int i = 0; i < 3; i++) {
        low[i] = grid.origin[i] - 0.5 * grid.spacing[i];
        high[i] = low[i] + grid.spacing[i] * axes[i];
    }
    if (s->in.floor && s->in.low[0] <= s->in.high[0]) {
        memcpy(low, s->in.low, sizeof low);
        memcpy(high, s->in.high, sizeof high);
    }
    camera_path_fit(&s->path, low, high, (double)s->desc.width / s->desc.height);
    s->desc.level = (float)(s->level * voxel_of(s->field));
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
    char what[64];
    snprintf(what, sizeof what, "the last of %u frames that are blended", s->blend);
    return pictures_print_passes(s->context, what);
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
    return status == CLI_DONE && s->pictures.stats ? print_stats(s) : status;
}

static int run(shot *s) {
    int status = pictures_check(&s->pictures);
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
    struct arg_str *in, *edge, *sign, *spacing, *surface, *shadow, *samples, *light, *light_size, *light_at, *light_radius, *view,
        *level, *blend;
    struct arg_lit *field, *floor, *quiet;
    cli_device device;
    mesh_input_options mesh;
    picture_options pictures;
} shot_args;

static void add_options(cli_args *args, shot_args *a) {
    a->in = cli_add(
        args, arg_str1(NULL, NULL, "MESH|FIELD", "a mesh file; with --field a volume of signed distances, float32; - is a pipe"));
    a->field = cli_add(args, arg_lit0(NULL, "field", "the file is a field"));
    picture_options_add(args, &a->pictures, true, "print the times of the passes");
    mesh_input_add(args, &a->mesh);
    a->edge = cli_add(args, arg_str0(NULL, "edge", "N", "voxels along the longest edge of a mesh's field; default 256"));
    a->sign = cli_add(args, arg_str0(NULL, "sign", "SIGN", "of a mesh's field: auto (default), pseudonormal, winding or none"));
    a->floor = cli_add(args, arg_lit0(NULL, "floor", "a floor under the mesh, for its shadow to fall on; the field covers it too"));
    a->spacing =
        cli_add(args, arg_str0(NULL, "spacing", "S|X,Y,Z", "edges of a field's voxels, where its file does not keep them"));
    a->surface = cli_add(args, arg_str0(NULL, "surface", "field|mesh", "what is seen; default field"));
    a->shadow = cli_add(args, arg_str0(NULL, "shadow", "none|ray|rtsdf|cone|rays|map",
                                       "one ray; the published march; cones, ours (default); many rays; shadow maps"));
    a->samples = cli_add(args, arg_str0(NULL, "samples", "N", "of cone (default 1) and rays (default 256)"));
    a->light = cli_add(args, arg_str0(NULL, "sun", "X,Y,Z", "the way to the sun"));
    a->light_size = cli_add(args, arg_str0(NULL, "sun-size", "DEGREES", "half the angle of the sun's disc; default 2"));
    a->light_at = cli_add(args, arg_str0(NULL, "light-at", "X,Y,Z", "a lamp there instead of the sun"));
    a->light_radius =
        cli_add(args, arg_str0(NULL, "light-radius", "R", "of the lamp's disc; default 0: a point, with hard shadows"));
    a->view =
        cli_add(args, arg_str0(NULL, "view", "color|normal|steps|share", "default color; share: how much of the sun is seen"));
    a->level = cli_add(args, arg_str0(NULL, "level", "L", "draw the surface at this distance, in voxels; default 0"));
    a->blend = cli_add(args, arg_str0(NULL, "blend", "N", "frames that are blended, to smooth edges; default 16"));
    cli_device_add(args, &a->device);
    a->quiet = cli_add(args, arg_lit0("q", "quiet", "print nothing but errors and what --stats asks for"));
}

static bool read_light(const shot_args *a, shot *s) {
    const bool lamp = a->light_at->count > 0;
    if ((lamp && (a->light->count || a->light_size->count)) || (!lamp && a->light_radius->count)) {
        cli_usage(lamp ? "--light-at is given with --sun or --sun-size: a lamp takes the sun's place"
                       : "--light-radius is given without --light-at: where is the lamp?");
        return false;
    }
    double way[3] = {0.48, -0.56, 0.6757}, size = 0;
    if ((lamp && (!cli_triple("--light-at", a->light_at->sval[0], way) ||
                  !cli_double("--light-radius", cli_given(a->light_radius, "0"), &size))) ||
        (a->light->count && !cli_triple("--sun", a->light->sval[0], way)) ||
        (!lamp && !cli_double("--sun-size", cli_given(a->light_size, "2"), &size))) {
        return false;
    }
    const double most = lamp ? 1e18 : 45;
    if (!(size >= 0 && size < most)) {
        cli_usage("%s is %g: 0 or above, and below %g", lamp ? "--light-radius" : "--sun-size", size, most);
        return false;
    }
    s->desc.light_count = 1;
    s->desc.lights[0] = (fm_light){.kind = lamp ? FM_LIGHT_AREA : FM_LIGHT_DIRECTIONAL, .size = (float)size};
    for (int i = 0; i < 3; i++) {
        s->desc.lights[0].way[i] = (float)way[i];
    }
    return true;
}

// What says how the file is read.
static bool read_input(const shot_args *a, shot *s) {
    int sign = 0;
    s->in = (mesh_input){.path = a->in->sval[0], .floor = a->floor->count > 0, .quiet = a->quiet->count > 0};
    s->is_mesh = a->field->count == 0;
    if (s->is_mesh &&
        (!mesh_input_options_read(&a->mesh, &s->in) || !cli_word("--sign", cli_given(a->sign, "auto"), mesh_sign_words, &sign))) {
        return false;
    }
    s->sign = (fm_sign)sign;
    const char *wrong = NULL;
    if (s->is_mesh && a->spacing->count) {
        wrong = "--spacing is given without --field: a mesh's field gets its own";
    } else if (!s->is_mesh && (a->mesh.up->count || a->mesh.flip->count || a->sign->count || s->in.floor)) {
        wrong = "--up, --flip, --sign and --floor are for meshes, not for fields";
    }
    if (wrong) {
        cli_usage("%s", wrong);
        return false;
    }
    if (!s->is_mesh && a->mesh.format->count && !cli_format("--input-format", a->mesh.format->sval[0], &s->read.format)) {
        return false;
    }
    if (a->spacing->count && !cli_triple("--spacing", a->spacing->sval[0], s->spacing)) {
        return false;
    }
    if (a->spacing->count && !(s->spacing[0] > 0 && s->spacing[1] > 0 && s->spacing[2] > 0)) {
        cli_usage("--spacing is \"%s\": numbers above 0 are wanted", a->spacing->sval[0]);
        return false;
    }
    return true;
}

static bool check_combinations(const shot *s) {
    const char *wrong = NULL;
    if (s->desc.shadows == FM_SHADOWS_MAP && s->desc.lights[0].kind == FM_LIGHT_AREA) {
        wrong = "--shadow map takes the sun, not --light-at";
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
    *s = (shot){0};
    int surface = 0, shadow = 0, view = 0;
    s->quiet = a->quiet->count > 0;
    if (!read_input(a, s) || !picture_options_read(&a->pictures, &s->pictures, &s->path) ||
        !cli_uint32("--edge", cli_given(a->edge, "256"), 2 * MARGIN + 1, &s->edge) ||
        !cli_word("--surface", cli_given(a->surface, "field"), surface_words, &surface) ||
        !cli_word("--shadow", cli_given(a->shadow, "cone"), shadow_words, &shadow) ||
        !cli_word("--view", cli_given(a->view, "color"), view_words, &view) || !read_light(a, s) ||
        !cli_uint32("--samples", cli_given(a->samples, shadow == FM_SHADOWS_DISTRIBUTED ? "256" : "1"), 1, &s->desc.samples) ||
        !cli_double("--level", cli_given(a->level, "0"), &s->level) ||
        !cli_uint32("--blend", cli_given(a->blend, "16"), 1, &s->blend) || !cli_device_read(&a->device, &s->wanted)) {
        return false;
    }
    if (s->desc.samples > 65536 || s->edge > 4096 || s->blend > 4096) {
        cli_usage("--samples is at most 65536, --edge and --blend at most 4096");
        return false;
    }
    s->desc.width = s->pictures.width;
    s->desc.height = s->pictures.height;
    s->desc.surface = (fm_surface)surface;
    s->desc.shadows = (fm_shadows)shadow;
    s->desc.view = (fm_deferred_view)view;
    s->desc.jitter = s->blend > 1;
    return check_combinations(s);
}

bool render_mesh_wanted(int argc, char **argv) {
    static const char option[] = "--input-format";
    fm_mesh_format format;
    for (int i = 1; i < argc; i++) {
        const char *rest = strncmp(argv[i], option, strlen(option)) == 0 ? argv[i] + strlen(option) : NULL;
        const char *word = rest && *rest == '=' ? rest + 1 : rest && !*rest && i + 1 < argc ? argv[i + 1] : NULL;
        if ((word && mesh_input_format(word, &format)) || strcmp(argv[i], "--field") == 0 ||
            (argv[i][0] != '-' && fm_mesh_format_of(argv[i]) != FM_MESH_FORMAT_AUTO)) {
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
                                  "fathom render armadillo.obj --up y --floor --sun-size 5 --out armadillo.png\n"
                                  "fathom render bunny.ply --edge 512 --shadow cone --samples 4 --sun-size 5 --out bunny.png\n"
                                  "fathom render bunny.ply --surface mesh --shadow rays --out truth.png\n"
                                  "fathom render field.nrrd --field --view normal --path 90 --out around.mp4\n"};
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
