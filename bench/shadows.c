// SPDX-License-Identifier: MIT
#include "shadows.h"

#include "image_error.h"
#include "shadows_stage.h"
#include "words.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

static const bench_shadow_way ways[] = {
    {"truth", BENCH_SHADOW_NO_FIELD, FM_SHADOWS_DISTRIBUTED, 0, false},
    {"one ray", BENCH_SHADOW_NO_FIELD, FM_SHADOWS_RAY, 0, false},
    {"shadow map", BENCH_SHADOW_NO_FIELD, FM_SHADOWS_MAP, 0, false},
    {"1 ray, blended", BENCH_SHADOW_NO_FIELD, FM_SHADOWS_DISTRIBUTED, 1, true},
    {"RTSDF", BENCH_SHADOW_RTSDF, FM_SHADOWS_RTSDF, 0, true},
    {"RTSDF's march, exact field", BENCH_SHADOW_EXACT, FM_SHADOWS_RTSDF, 0, true},
    {"cone", BENCH_SHADOW_EXACT, FM_SHADOWS_FIELD, 1, false},
    {"4 cones", BENCH_SHADOW_EXACT, FM_SHADOWS_FIELD, 4, false},
};

// The times of the pictures that are compared: things at rest there, and moving until there.
static const double compared_time = 0.3, step = 0.01;

enum { NOISE_FRAMES = 3, MAX_PASSES = 128 };

struct bench_shadow_stage {
    bench_shadow_case what;
    stage_scene table, ball;
    float *true_shares, *moving_shares, *shares, *before, *depths;
    float *true_picture, *blended_picture, *picture;  // sRGB, 0 to 1
    uint8_t *pixels;
    bool has_truth;
};

const bench_shadow_way *bench_shadow_way_at(uint32_t i) {
    return i < sizeof ways / sizeof ways[0] ? &ways[i] : NULL;
}

const uint8_t *bench_shadow_picture(const bench_shadow_stage *stage) {
    return stage->pixels;
}

static size_t pixel_count(const bench_shadow_case *what) {
    return (size_t)what->width * what->height;
}

bench_shadow_stage *bench_shadow_stage_create(fm_context *context, const bench_shadow_case *what) {
    bench_shadow_stage *stage = calloc(1, sizeof *stage);
    if (!stage) {
        return NULL;
    }
    stage->what = *what;
    const size_t count = pixel_count(what);
    float **planes[] = {&stage->true_shares, &stage->moving_shares, &stage->shares, &stage->before, &stage->depths};
    float **pictures[] = {&stage->true_picture, &stage->blended_picture, &stage->picture};
    bool good = (stage->pixels = malloc(4 * count)) != NULL;
    for (int i = 0; i < 5; i++) {
        good = (*planes[i] = malloc(count * sizeof(float))) != NULL && good;
    }
    for (int i = 0; i < 3; i++) {
        good = (*pictures[i] = malloc(3 * count * sizeof(float))) != NULL && good;
    }
    if (!good || !stage_open(&stage->table, context, what, STAGE_TABLE) || !stage_open(&stage->ball, context, what, STAGE_BALL)) {
        bench_shadow_stage_destroy(stage);
        return NULL;
    }
    return stage;
}

void bench_shadow_stage_destroy(bench_shadow_stage *stage) {
    if (!stage) {
        return;
    }
    stage_close(&stage->table);
    stage_close(&stage->ball);
    float *all[] = {stage->true_shares, stage->moving_shares, stage->shares,          stage->before,
                    stage->depths,      stage->true_picture,  stage->blended_picture, stage->picture};
    for (size_t i = 0; i < sizeof all / sizeof all[0]; i++) {
        free(all[i]);
    }
    free(stage->pixels);
    free(stage);
}

// ---------------------------------------------------------------------------------------------------------------------------
// A frame
// ---------------------------------------------------------------------------------------------------------------------------

// Milliseconds of a frame's parts.
typedef struct times {
    double update, field, surface, light;
} times;

// Of the newest operation: of the passes of one name, or of all.
static double passes_of(fm_context *context, const char *only) {
    fm_pass passes[MAX_PASSES];
    uint32_t count = MAX_PASSES;
    double sum = 0;
    if (fm_context_passes(context, &count, passes) == FM_OK) {
        for (uint32_t i = 0; i < count; i++) {
            sum += !only || strcmp(passes[i].name, only) == 0 ? passes[i].milliseconds : 0;
        }
    }
    return sum;
}

static fm_deferred_desc picture_of(const bench_shadow_case *what, const stage_scene *s, const bench_shadow_way *way,
                                   uint32_t frame) {
    fm_volume *fine = NULL;
    if (way->field == BENCH_SHADOW_RTSDF) {
        fm_rtsdf_fields(s->rtsdf, NULL, &fine);
    }
    return (fm_deferred_desc){
        .camera = {.position = {-1.3f, -1.9f, 1.5f}, .forward = {1.25f, 1.9f, -1.35f}, .up = {0, 0, 1}, .fov_y = 45},
        .width = what->width,
        .height = what->height,
        .mesh = fm_scene_mesh(s->scene),
        .field = way->field == BENCH_SHADOW_EXACT ? s->field : fine,
        .shadows = way->shadows,
        .samples = way->samples                             ? way->samples
                   : way->shadows == FM_SHADOWS_DISTRIBUTED ? what->truth
                                                            : 0,
        .jitter = way->blended,
        .taa = way->blended,
        .frame = frame,
        .map_edge = what->map_edge,
        .light_count = 1,
        .lights = {{.way = {0.55f, -0.35f, 0.9f}, .size = what->light}}};
}

static bool make_field(const stage_scene *s, bench_shadow_field field) {
    static const fm_sdf_desc exact = {.band = 3, .far_texels = FM_FAR_FLOODED};
    fm_mesh *mesh = fm_scene_mesh(s->scene);
    return field == BENCH_SHADOW_NO_FIELD ||
           (field == BENCH_SHADOW_RTSDF ? fm_rtsdf_update(s->rtsdf, mesh, NULL) == FM_OK
                                        : fm_mesh_sdf(mesh, &exact, s->field, NULL, NULL, NULL) == FM_OK);
}

static bool draw_frame(const bench_shadow_case *what, stage_scene *s, const bench_shadow_way *way, double time, uint32_t frame,
                       times *spent) {
    if (!stage_move(s, time) || fm_scene_update(s->scene, FM_TREE_REFIT, NULL) != FM_OK) {
        return false;
    }
    spent->update = passes_of(s->context, "scene");
    if (!make_field(s, way->field)) {
        return false;
    }
    // Whoever needs the tree first refits it.
    const double field = way->field ? passes_of(s->context, NULL) : 0, tree = way->field ? passes_of(s->context, "tree") : 0;
    const fm_deferred_desc desc = picture_of(what, s, way, frame);
    if (fm_deferred_render(s->deferred, &desc, NULL) != FM_OK) {
        return false;
    }
    spent->surface = passes_of(s->context, "surface");
    spent->light = passes_of(s->context, NULL) - spent->surface - passes_of(s->context, "tree");
    spent->update += tree + passes_of(s->context, "tree");
    spent->field = field - tree;
    return true;
}

static bool read_picture(const bench_shadow_case *what, const stage_scene *s, float *shares, uint8_t *pixels, float *picture) {
    if (fm_deferred_shares(s->deferred, shares) != FM_OK || fm_deferred_read(s->deferred, pixels) != FM_OK) {
        return false;
    }
    for (size_t i = 0; i < pixel_count(what); i++) {
        for (int k = 0; k < 3; k++) {
            picture[3 * i + (size_t)k] = (float)pixels[4 * i + (size_t)k] / 255;
        }
    }
    return true;
}

static double share_error(const bench_shadow_case *what, const float *shares, const float *reference) {
    double sum = 0, count = 0;
    for (size_t i = 0; i < pixel_count(what); i++) {
        if (shares[i] >= 0 && reference[i] >= 0) {
            const double error = (double)shares[i] - (double)reference[i];
            sum += error * error;
            count++;
        }
    }
    return count > 0 ? sqrt(sum / count) : 0;
}

// ---------------------------------------------------------------------------------------------------------------------------
// A sphere's penumbra
// ---------------------------------------------------------------------------------------------------------------------------

// How far apart along x values pass 1/10 and 9/10 of the light; NAN where they never do, and where they pass one of them again and
// again, so that the first place says more of the noise than of a penumbra.
static double width_of(const double *x, const double *share, uint32_t count) {
    double first[2] = {NAN, NAN}, last[2] = {NAN, NAN};
    for (int which = 0; which < 2; which++) {
        const double level = which ? 0.9 : 0.1;
        for (uint32_t i = 0; i + 1 < count; i++) {
            if (share[i] < level && share[i + 1] >= level) {
                last[which] = x[i] + (x[i + 1] - x[i]) * (level - share[i]) / (share[i + 1] - share[i]);
                first[which] = isnan(first[which]) ? last[which] : first[which];
            }
        }
    }
    const double width = 0.5 * (first[1] + last[1] - first[0] - last[0]), again = last[0] - first[0] + last[1] - first[1];
    return again <= 0.2 * width ? width : (double)NAN;
}

static double true_ball_share(double x, double spread) {
    enum { RAYS = 8192 };
    const double radius = (double)stage_ball_radius, height = (double)stage_ball_height;
    uint32_t seen = 0;
    for (int i = 0; i < RAYS; i++) {
        const double r = spread * sqrt((i + 0.5) / RAYS), a = 2.39996323 * i, way[3] = {r * cos(a), r * sin(a), 1};
        const double length2 = r * r + 1, along = x * way[0] - height;
        seen += x * x + height * height - along * along / length2 > radius * radius;
    }
    return (double)seen / RAYS;
}

// A row of pixels under the ball, which hides nothing from there, from under its middle outwards.
static bool penumbra_error(bench_shadow_stage *stage, const bench_shadow_way *way, double *error) {
    enum { COUNT = 512, FRAMES = 4 };
    static double x[COUNT], measured[COUNT], truth[COUNT];
    static float shares[COUNT], depths[COUNT];
    const bench_shadow_case *what = &stage->what;
    for (uint32_t frame = 0; frame < FRAMES; frame++) {
        if (!make_field(&stage->ball, way->field)) {
            return false;
        }
        fm_deferred_desc desc = picture_of(what, &stage->ball, way, frame);
        desc.camera = (fm_camera){.position = {0.5f, 0, 0.3f}, .forward = {0, 0, -1}, .up = {0, 1, 0}};
        desc.width = COUNT;
        desc.height = 1;
        desc.camera.fov_y = (float)(2 * atan(0.5 * 0.9 / COUNT / 0.3) * 180 / 3.14159265358979);
        desc.taa = false;
        desc.lights[0] = (fm_light){.way = {0, 0, 1}, .size = what->light};
        if (fm_deferred_render(stage->ball.deferred, &desc, NULL) != FM_OK ||
            fm_deferred_shares(stage->ball.deferred, shares) != FM_OK ||
            fm_deferred_depths(stage->ball.deferred, depths) != FM_OK) {
            return false;
        }
        for (int i = 0; i < COUNT; i++) {
            measured[i] += ((double)shares[i] - measured[i]) / (frame + 1);
        }
    }
    const double spread = tan((double)what->light * 3.14159265358979 / 180);
    for (int i = 0; i < COUNT; i++) {
        x[i] = 0.5 + (i + 0.5 - 0.5 * COUNT) * 0.9 / COUNT;
        truth[i] = true_ball_share(x[i], spread);
    }
    const double wide = width_of(x, truth, COUNT);
    *error = wide > 0 ? width_of(x, measured, COUNT) / wide - 1 : 0;
    return true;
}

// ---------------------------------------------------------------------------------------------------------------------------
// Measuring
// ---------------------------------------------------------------------------------------------------------------------------

// Draws `count` frames that end at the compared time, things moving until there or at rest.
static bool draw_frames(bench_shadow_stage *stage, const bench_shadow_way *way, bool moving, uint32_t count, times *spent) {
    bool good = true;
    for (uint32_t i = 0; good && i < count; i++) {
        const double time = compared_time - (moving ? step * (count - 1 - i) : 0);
        times one = {0};
        good = draw_frame(&stage->what, &stage->table, way, time, i, &one);
        if (spent) {
            spent[i] = one;
        }
    }
    return good;
}

// An idle device is a slow one: it works for a moment before frames are timed.
static bool wake(bench_shadow_stage *stage, const bench_shadow_way *way) {
    const double end = fm_now_ms() + (fm_context_backend(stage->table.context) == FM_BACKEND_VULKAN ? stage->what.warm_up_ms : 0);
    bool good = true;
    while (good && fm_now_ms() < end) {
        good = draw_frames(stage, way, true, 1, NULL);
    }
    return good;
}

// The truth of both comparisons is the same place in time; blended ways are compared to a truth whose pixels are as smooth.
static bool make_truth(bench_shadow_stage *stage) {
    if (stage->has_truth) {
        return true;
    }
    const bench_shadow_way smooth = {ways[0].name, ways[0].field, ways[0].shadows, stage->what.truth / 16 + 1, true};
    stage->has_truth = draw_frames(stage, &smooth, false, 24, NULL) &&
                       read_picture(&stage->what, &stage->table, stage->shares, stage->pixels, stage->blended_picture) &&
                       draw_frames(stage, &ways[0], false, 1, NULL) &&
                       read_picture(&stage->what, &stage->table, stage->true_shares, stage->pixels, stage->true_picture);
    return stage->has_truth;
}

// Jitter moves a pixel's ray: what blended ways are compared with is the truth of the very same rays.
static bool truth_of_frame(bench_shadow_stage *stage, const bench_shadow_way *way, uint32_t frame, float *shares) {
    if (!way->blended) {
        memcpy(shares, stage->true_shares, pixel_count(&stage->what) * sizeof *shares);
        return true;
    }
    times unused;
    const bench_shadow_way jittered = {ways[0].name, ways[0].field, ways[0].shadows, 0, true};
    return draw_frame(&stage->what, &stage->table, &jittered, compared_time, frame, &unused) &&
           fm_deferred_shares(stage->table.deferred, shares) == FM_OK;
}

static bool compare(bench_shadow_stage *stage, const bench_shadow_way *way, bench_shadow_result *result) {
    const bench_shadow_case *what = &stage->what;
    const uint32_t frames = what->frames;
    const image test = {stage->picture, what->width, what->height};
    const image reference = {way->blended ? stage->blended_picture : stage->true_picture, what->width, what->height};
    // At rest.
    if (fm_rtsdf_reset(stage->table.rtsdf) != FM_OK || !draw_frames(stage, way, false, frames, NULL) ||
        !read_picture(what, &stage->table, stage->shares, stage->pixels, stage->picture)) {
        return false;
    }
    result->picture_error = image_rmse(&test, &reference);
    result->flip = image_flip(&test, &reference, 0, NULL);
    result->ssim = image_ssim(&test, &reference);
    memcpy(stage->before, stage->shares, pixel_count(what) * sizeof *stage->before);
    times unused;
    for (uint32_t i = 0; i < NOISE_FRAMES; i++) {
        // Sixteen frames later the pixels' rays are the same again.
        if (!draw_frame(what, &stage->table, way, compared_time, frames - 1 + 16 * (i + 1), &unused) ||
            fm_deferred_shares(stage->table.deferred, stage->shares) != FM_OK) {
            return false;
        }
        double change = 0, seen = 0;
        for (size_t k = 0; k < pixel_count(what); k++) {
            if (stage->shares[k] >= 0 && stage->before[k] >= 0) {
                change += fabs((double)stage->shares[k] - (double)stage->before[k]);
                seen++;
            }
        }
        result->noise += seen > 0 ? change / seen / NOISE_FRAMES : 0;
        memcpy(stage->before, stage->shares, pixel_count(what) * sizeof *stage->before);
    }
    if (!truth_of_frame(stage, way, frames - 1, stage->moving_shares)) {
        return false;
    }
    result->share_error = share_error(what, stage->before, stage->moving_shares);
    return true;
}

bool bench_shadow_measure(bench_shadow_stage *stage, const bench_shadow_way *way, bench_shadow_result *result) {
    static times spent[BENCH_STATS_MAX];
    static double values[5][BENCH_STATS_MAX];
    const uint32_t frames = stage->what.frames;
    *result = (bench_shadow_result){.way = way};
    bool good = make_truth(stage) && wake(stage, way) && fm_rtsdf_reset(stage->table.rtsdf) == FM_OK &&
                draw_frames(stage, way, true, frames, spent) &&
                read_picture(&stage->what, &stage->table, stage->before, stage->pixels, stage->picture) &&
                truth_of_frame(stage, way, frames - 1, stage->moving_shares);
    if (good) {
        result->moving_error = share_error(&stage->what, stage->before, stage->moving_shares);
        for (uint32_t i = 0; i < frames; i++) {
            const double parts[4] = {spent[i].update, spent[i].field, spent[i].surface, spent[i].light};
            values[4][i] = 0;
            for (int k = 0; k < 4; k++) {
                values[k][i] = parts[k];
                values[4][i] += parts[k];
            }
        }
        bench_stats *stats[] = {&result->update, &result->field, &result->surface, &result->light, &result->frame};
        for (int k = 0; k < 5; k++) {
            *stats[k] = bench_stats_of(values[k], frames);
        }
        good = compare(stage, way, result) && penumbra_error(stage, way, &result->width_error);
    }
    if (!good) {
        snprintf(result->failure, sizeof result->failure, "%s", fm_last_error());
    }
    return good;
}
