// SPDX-License-Identifier: MIT
// fathom octree render: pictures of octrees, also of such as are larger than the memory for them.

#include "commands.h"
#include "octree_field.h"
#include "octree_job.h"
#include "path.h"
#include "pictures.h"
#include "words.h"

#include "fathom/octree_render.h"

#include <inttypes.h>
#include <math.h>
#include <stdlib.h>
#include <string.h>

static const char *const view_words[] = {"shaded", "normals", "reads", "levels", NULL};

typedef struct shot {
    octree_job job;
    fm_octree_render_desc desc;  // camera and octree aside
    fm_octree_stream_desc streaming;
    bool streamed;
    camera_path path;
    pictures pictures;
    // Filled as the work goes on.
    fm_octree_stream *stream;
    fm_octree_renderer *renderer;
    octree_field field;
    uint8_t *pixels;
} shot;

static int read_octree(shot *s) {
    octree_job *job = &s->job;
    if (fm_octree_read(job->context, job->in, &job->octree) != FM_OK) {
        return cli_library_failed();
    }
    fm_octree_describe(job->octree, &job->info);
    if (job->info.parts == 0 && s->streamed) {
        return cli_usage("--budget and --distance are of files with parts: %s is whole", job->in);
    }
    s->streamed = job->info.parts > 0;
    if (s->streamed) {
        fm_octree_destroy(job->octree);
        job->octree = NULL;
        return fm_octree_stream_open(job->context, job->in, &s->streaming, &s->stream) == FM_OK ? CLI_DONE : cli_library_failed();
    }
    return CLI_DONE;
}

static void place_camera(shot *s) {
    double low[3], high[3];
    for (int i = 0; i < 3; i++) {
        low[i] = (double)s->job.info.low[i];
        high[i] = (double)s->job.info.high[i];
    }
    camera_path_fit(&s->path, low, high, (double)s->desc.width / s->desc.height);
}

static int draw(void *user, uint32_t frame) {
    shot *s = user;
    s->desc.camera = camera_path_at(&s->path, (fm_shape){1, 1, 1}, (double)s->desc.width / s->desc.height, frame);
    if (s->job.field) {
        return octree_field_draw(&s->field, &s->desc, s->pixels);
    }
    fm_result result = s->stream ? fm_octree_stream_update(s->stream, &s->desc.camera, true) : FM_OK;
    result = result == FM_OK ? fm_octree_render(s->renderer, &s->desc, NULL) : result;
    result = result == FM_OK && s->pixels ? fm_octree_renderer_read(s->renderer, s->pixels) : result;
    return result == FM_OK ? CLI_DONE : cli_library_failed();
}

static double part_of(uint64_t a, uint64_t b) {
    return b > 0 ? (double)a / (double)b : 0;
}

static int print_stats(shot *s) {
    fm_octree_render_stats stats;
    const int status = pictures_print_passes(s->job.context, "the last picture");
    if (s->job.field && status == CLI_DONE) {
        return CLI_DONE;
    }
    if (status != CLI_DONE || fm_octree_renderer_stats(s->renderer, &stats) != FM_OK) {
        return status != CLI_DONE ? status : cli_library_failed();
    }
    printf("rays %" PRIu64 ", of which %.1f %% hit; reads %.2f a ray, at most %" PRIu64 "; %.2f for beams\n", stats.rays,
           100 * part_of(stats.hits, stats.rays), part_of(stats.reads, stats.rays), stats.most_reads,
           part_of(stats.beam_reads, stats.rays));
    if (stats.second_rays > 0) {
        printf("secondary rays %" PRIu64 ", reads %.2f a ray\n", stats.second_rays, part_of(stats.second_reads, stats.second_rays));
    }
    return CLI_DONE;
}

// A part that could not be read leaves a coarser picture, which is to be told, however quiet.
static void print_stream(const shot *s) {
    fm_octree_stream_info info;
    char bytes[32], budget[32];
    fm_octree_stream_describe(s->stream, &info);
    if (s->pictures.stats) {
        printf("parts %u, of which %u are seen near by and %u are loaded; %s of %s%s\n", info.parts, info.wanted, info.resident,
               cli_bytes(info.bytes, bytes), cli_bytes(info.budget, budget),
               s->streaming.distance > 0 ? "" : "; give --distance for parts farther away");
    }
    if (info.failing > 0) {
        fprintf(stderr, "fathom: %" PRIu32 " parts could not be read and stay coarse; the last: %s\n", info.failing, info.failure);
    }
}

static int work(shot *s) {
    octree_job *job = &s->job;
    int status = octree_job_begin(job);
    if (status == CLI_DONE && files_is_octree(job->in)) {
        status = read_octree(s);
    } else if (status == CLI_DONE) {
        status = octree_job_source(job);
        if (status == CLI_DONE) {
            status = job->field ? octree_field_make(job, &s->field) : octree_job_build(job);
        }
    }
    if (status != CLI_DONE) {
        return status;
    }
    place_camera(s);
    s->desc.octree = job->octree;
    s->desc.stream = s->stream;
    s->pixels = s->pictures.out ? malloc(4 * (size_t)s->desc.width * s->desc.height) : NULL;
    if (s->pictures.out && !s->pixels) {
        return cli_fail("out of memory: free some");
    }
    if (!job->field && fm_octree_renderer_create(job->context, &s->renderer) != FM_OK) {
        return cli_library_failed();
    }
    status = s->pictures.out ? pictures_write(&s->pictures, s->pixels, draw, s) : draw(s, 0);
    if (status == CLI_DONE && s->pictures.out && !job->quiet) {
        printf("%s: %u x %u pixels%s of %s\n", s->pictures.out, s->desc.width, s->desc.height,
               s->pictures.frames > 1 ? ", a path," : "", job->in);
    }
    status = status == CLI_DONE && s->pictures.stats ? print_stats(s) : status;
    if (status == CLI_DONE && s->stream) {
        print_stream(s);
    }
    return status;
}

static int run(shot *s) {
    int status = pictures_check(&s->pictures);
    if (status == CLI_DONE) {
        status = work(s);
        fm_octree_renderer_destroy(s->renderer);
        fm_octree_stream_close(s->stream);
        octree_field_end(&s->field);
        octree_job_end(&s->job);
        free(s->pixels);
    }
    return status;
}

typedef struct shot_args {
    octree_options octree;
    struct arg_str *in, *view, *epsilon, *sun, *reflection, *refraction, *budget, *distance;
    struct arg_lit *shadow;
    picture_options pictures;
} shot_args;

static void add_options(cli_args *args, shot_args *a) {
    a->in = cli_add(args, arg_str1(NULL, NULL, "FILE.fmo|MESH", "an octree, or what one is to be made of"));
    picture_options_add(args, &a->pictures, true, "print the times of the passes, and what rays read");
    a->view =
        cli_add(args, arg_str0(NULL, "view", "VIEW",
                               "shaded (default), normals, reads (of memory by each ray; 64 and more are brightest) or levels"));
    a->epsilon = cli_add(
        args, arg_str0(NULL, "epsilon", "E", "the surface's thickness in finest cells; default 0.1; below 0: rays as published"));
    a->sun = cli_add(args, arg_str0(NULL, "sun", "X,Y,Z", "the way to the sun"));
    a->shadow = cli_add(args, arg_lit0(NULL, "shadow", "rays to the sun"));
    a->reflection = cli_add(args, arg_str0(NULL, "reflection", "R", "0 to 1: part of the light that comes by a reflected ray"));
    a->refraction = cli_add(args, arg_str0(NULL, "refraction", "N", "above 1: the surface is glass of this refractive index"));
    a->budget = cli_add(args, arg_str0(NULL, "budget", "MIB", "of files with parts: memory for octrees; default 256"));
    a->distance =
        cli_add(args, arg_str0(NULL, "distance", "D",
                               "of files with parts: what is farther away is coarse, so give more for all of it; default a "
                               "quarter of the box's diagonal"));
    octree_options_add(args, &a->octree, "cells", true);
}

static bool read_light(const shot_args *a, shot *s) {
    double way[3] = {0, 0, 0}, reflection = 0, refraction = 0, epsilon = 0;
    if ((a->sun->count && !cli_triple("--sun", a->sun->sval[0], way)) ||
        !cli_double("--reflection", cli_given(a->reflection, "0"), &reflection) ||
        !cli_double("--refraction", cli_given(a->refraction, "0"), &refraction) ||
        !cli_double("--epsilon", cli_given(a->epsilon, "0"), &epsilon)) {
        return false;
    }
    if (a->sun->count && way[0] == 0 && way[1] == 0 && way[2] == 0) {
        cli_usage("--sun is \"%s\": a way is wanted, not all 0", a->sun->sval[0]);
        return false;
    }
    if (!(reflection >= 0 && reflection <= 1)) {
        cli_usage("--reflection is %g: 0 to 1 is wanted", reflection);
        return false;
    }
    if (a->refraction->count && !(refraction > 1 && refraction <= 8)) {
        cli_usage("--refraction is %g: above 1 and at most 8 is wanted", refraction);
        return false;
    }
    if (!(fabs(epsilon) <= 8)) {
        cli_usage("--epsilon is %g: at most 8 is wanted", epsilon);
        return false;
    }
    for (int i = 0; i < 3; i++) {
        s->desc.sun[i] = (float)way[i];
    }
    s->desc.shadow = a->shadow->count > 0;
    s->desc.reflection = (float)reflection;
    s->desc.refraction = (float)refraction;
    s->desc.epsilon = (float)epsilon;
    return true;
}

static bool read_stream(const shot_args *a, shot *s) {
    uint32_t budget = 0;
    double distance = 0;
    if ((a->budget->count && !cli_uint32("--budget", a->budget->sval[0], 1, &budget)) ||
        (a->distance->count && !cli_double("--distance", a->distance->sval[0], &distance))) {
        return false;
    }
    if (a->distance->count && !(distance > 0)) {
        cli_usage("--distance is %g: above 0 is wanted", distance);
        return false;
    }
    s->streamed = a->budget->count || a->distance->count;
    // Pictures are drawn when all is there.
    s->streaming = (fm_octree_stream_desc){.budget = (uint64_t)budget << 20, .distance = (float)distance, .fade_ms = -1};
    return true;
}

static bool check_combinations(const shot_args *a, const shot *s) {
    const octree_options *o = &a->octree;
    const char *wrong = NULL;
    const bool made = o->kind->count || o->cells->count || o->box->count || o->method->count || o->code->count || o->band->count ||
                      o->threshold->count || o->share->count || o->top->count || o->sign->count || o->attribute->count ||
                      o->solid->count || o->rounds->count;
    if (s->job.field && octree_field_wrong(&s->desc)) {
        wrong = octree_field_wrong(&s->desc);
    } else if (files_is_octree(s->job.in) && made) {
        wrong = "the octree in the file is as it was built: --kind, --cells and the like are for meshes and voxels";
    } else if (!files_is_octree(s->job.in) && s->streamed) {
        wrong = "--budget and --distance are of .fmo files with parts: fathom octree build --parts writes them";
    }
    if (wrong) {
        cli_usage("%s", wrong);
    }
    return !wrong;
}

static bool read_shot(const shot_args *a, shot *s) {
    int view = 0;
    *s = (shot){0};
    if (!octree_options_read(&a->octree, "cells", a->in->sval[0], &s->job) ||
        !picture_options_read(&a->pictures, &s->pictures, &s->path) ||
        !cli_word("--view", cli_given(a->view, "shaded"), view_words, &view) || !read_light(a, s) || !read_stream(a, s)) {
        return false;
    }
    s->desc.view = (fm_octree_picture_view)view;
    s->desc.width = s->pictures.width;
    s->desc.height = s->pictures.height;
    s->desc.count = s->pictures.stats;
    return check_combinations(a, s);
}

int octree_render(int argc, char **argv) {
    static const cli_help help = {
        "octree render",
        "Draws the octree in a file, or that of a mesh or of voxels. Of a file with parts it loads what the camera sees, within a\n"
        "budget of memory.",
        "fathom octree render armadillo.fmo --shadow --out armadillo.png\n"
        "fathom octree render bunny.ply --cells 512 --reflection 0.3 --out bunny.png\n"
        "fathom octree render lucy.fmo --budget 256 --path 90 --out lucy.mp4\n"
        "fathom octree render armadillo.fmo --view reads --stats --out reads.png\n"
        "fathom octree render armadillo.obj --up y --kind svo --cells 512 --out svo.png\n"
        "fathom octree render armadillo.obj --up y --kind field --cells 512 --out dense.png\n"};
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
