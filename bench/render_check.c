// SPDX-License-Identifier: MIT
// Whether the pictures that were timed are right: at a sample of their pixels, against rays that walk voxel by voxel, in double
// precision, through the world's own voxels, by no field and no code of the renderer.
//
// The pictures are made again for this, each in more views: faces by direction must be those of the walk, as must what a pick says.
// What a face looks like is taken from the first pixel that shows one of its colour and direction, and other colours and directions
// must look different; the sky is that of a picture of air. Shadows are checked on a picture with hard ones; soft ones are the same
// in the shadow and far from all that could make a penumbra. Occlusion may only darken, and leaves the sun's light.

#include "render.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

enum { SAMPLES = 64, FACES = 7, NO_FACE = 6, CONE = 64 };

typedef struct walk {
    bool hit;
    int32_t voxel[3];
    int face;  // 2 * axis, 1 more where it looks up that axis; NO_FACE: the ray begins in the voxel
    double at[3];
} walk;

typedef struct checker {
    const bench_render_pictures *given;
    fm_shape shape;
    uint64_t *solid;  // a bit a voxel
    fm_world *air;
    int32_t top;  // the highest solid voxel
    uint8_t *timed, *sky, *faces, *hard, *soft;
    uint32_t seen[2][256][FACES];  // what a face looks like in the shadow and in the sun; 0: not known yet
} checker;

static bool is_solid(const checker *c, const int32_t at[3]) {
    const uint64_t i = (uint64_t)at[0] + c->shape.x * ((uint64_t)at[1] + (uint64_t)c->shape.y * (uint64_t)at[2]);
    return c->solid[i / 64] >> (i % 64) & 1;
}

// Sets when the ray is inside the world; false: never.
static bool clip(const checker *c, const double from[3], const double way[3], double *enter, int *axis) {
    const double size[3] = {c->shape.x, c->shape.y, c->shape.z};
    double leave = INFINITY;
    *enter = 0;
    *axis = -1;
    for (int i = 0; i < 3; i++) {
        const double low = (-0.5 - from[i]) / way[i], high = (size[i] - 0.5 - from[i]) / way[i];
        if (fmin(low, high) > *enter) {
            *enter = fmin(low, high);
            *axis = i;
        }
        leave = fmin(leave, fmax(low, high));
    }
    return *enter < leave;
}

static walk follow(const checker *c, const double from[3], const double way[3]) {
    const int32_t size[3] = {(int32_t)c->shape.x, (int32_t)c->shape.y, (int32_t)c->shape.z};
    walk w = {.face = NO_FACE};
    double time, next[3];
    int axis;
    if (!clip(c, from, way, &time, &axis)) {
        return w;
    }
    for (int i = 0; i < 3; i++) {
        const double place = floor(from[i] + way[i] * time + 0.5);
        w.voxel[i] = (int32_t)fmin(fmax(place, 0), size[i] - 1);
        if (i == axis) {
            w.voxel[i] = way[i] > 0 ? 0 : size[i] - 1;
        }
        next[i] = (w.voxel[i] + (way[i] > 0 ? 0.5 : -0.5) - from[i]) / way[i];
    }
    while (!is_solid(c, w.voxel)) {
        axis = next[0] < next[1] ? (next[0] < next[2] ? 0 : 2) : next[1] < next[2] ? 1 : 2;
        time = next[axis];
        next[axis] += 1 / fabs(way[axis]);
        w.voxel[axis] += way[axis] > 0 ? 1 : -1;
        if (w.voxel[axis] < 0 || w.voxel[axis] >= size[axis]) {
            return w;
        }
    }
    w.hit = true;
    w.face = axis < 0 ? NO_FACE : 2 * axis + (way[axis] < 0);
    for (int i = 0; i < 3; i++) {
        w.at[i] = from[i] + way[i] * time;
    }
    return w;
}

static bool same(const walk *a, const walk *b) {
    return a->hit == b->hit && (!a->hit || (a->face == b->face && memcmp(a->voxel, b->voxel, sizeof a->voxel) == 0));
}

// The ray of a place in the picture, moved by `off` voxels to the right and down.
static void ray_of(const fm_render_desc *desc, double x, double y, const double off[2], double from[3], double way[3]) {
    const fm_camera *camera = &desc->camera;
    const double f[3] = {(double)camera->forward[0], (double)camera->forward[1], (double)camera->forward[2]};
    const double length = sqrt(f[0] * f[0] + f[1] * f[1] + f[2] * f[2]), across = hypot(f[0], f[1]);
    // With z up, as cameras of tours are.
    const double right[3] = {f[1] / across, -f[0] / across, 0};
    const double down[3] = {f[0] * f[2] / (across * length), f[1] * f[2] / (across * length), -across / length};
    const double pixel = 2 * tan((double)camera->fov_y * 3.14159265358979323846 / 360) / desc->height;
    for (int i = 0; i < 3; i++) {
        from[i] = (double)camera->position[i] + right[i] * off[0] + down[i] * off[1];
        way[i] =
            f[i] / length + right[i] * pixel * (x + 0.5 - 0.5 * desc->width) + down[i] * pixel * (y + 0.5 - 0.5 * desc->height);
        way[i] = fabs(way[i]) > 1e-12 ? way[i] : 1e-12;
    }
}

// False where rays right beside it, for floats are coarser, meet something else.
static bool sure_walk(const checker *c, const fm_render_desc *desc, uint32_t x, uint32_t y, walk *w) {
    for (int i = 0; i < 5; i++) {
        const double side = i % 2 ? 1 : -1, right = i == 1 || i == 2 ? side : 0, down = i > 2 ? side : 0;
        double from[3], way[3];
        ray_of(desc, x + 0.02 * right, y + 0.02 * down, (const double[2]){3e-3 * right, 3e-3 * down}, from, way);
        const walk other = follow(c, from, way);
        if (i == 0) {
            *w = other;
        } else if (!same(w, &other)) {
            return false;
        }
    }
    return true;
}

// Whether the face looks away from the sun or something is before it; false where that is not sure.
static bool sure_shadow(const checker *c, const fm_render_desc *desc, const walk *w, bool *shadow) {
    const double sun[3] = {(double)desc->sun[0], (double)desc->sun[1], (double)desc->sun[2]};
    const int axis = w->face / 2;
    const double out = w->face % 2 ? 1 : -1;
    *shadow = w->face == NO_FACE || sun[axis] * out <= 0;
    for (int i = 0; i < 5 && !(w->face == NO_FACE || sun[axis] * out <= 0); i++) {
        const double side = i % 2 ? 0.02 : -0.02;
        double from[3] = {w->at[0], w->at[1], w->at[2]};
        from[axis] += 1e-3 * out;
        from[(axis + 1) % 3] += i == 1 || i == 2 ? side : 0;
        from[(axis + 2) % 3] += i > 2 ? side : 0;
        const bool blocked = follow(c, from, sun).hit;
        if (i > 0 && blocked != *shadow) {
            return false;
        }
        *shadow = blocked;
    }
    return true;
}

static uint32_t pixel_at(const uint8_t *pixels, uint64_t i) {
    return (uint32_t)pixels[4 * i] | (uint32_t)pixels[4 * i + 1] << 8 | (uint32_t)pixels[4 * i + 2] << 16 | 0xff000000u;
}

static bool no_lighter(const uint8_t *pixel, const uint8_t *than) {
    return pixel[0] <= than[0] + 1 && pixel[1] <= than[1] + 1 && pixel[2] <= than[2] + 1;
}

static bool alike(const uint8_t *a, const uint8_t *b) {
    return no_lighter(a, b) && no_lighter(b, a);
}

// As fm_pick has it.
static int face_number(const walk *w) {
    return !w->hit || w->face == NO_FACE ? 0 : (w->face / 2 + 1) * (w->face % 2 ? 1 : -1);
}

// FM_VIEW_NORMAL: from 13, against an axis, over 128 to 242.
static bool shows_face(const uint8_t *pixel, const walk *w) {
    bool good = true;
    for (int i = 0; i < 3; i++) {
        const int face = face_number(w), wanted = !w->hit ? 26 : face == i + 1 ? 242 : face == -(i + 1) ? 13 : 128;
        good = good && abs((int)pixel[i] - wanted) <= 2;
    }
    return good;
}

static const char *check_pick(const checker *c, const fm_render_desc *desc, uint32_t x, uint32_t y, const walk *w, bool *good) {
    fm_pick pick;
    if (fm_render_pick(c->given->renderer, c->given->world, desc, (float)x, (float)y, &pick) != FM_OK) {
        return fm_last_error();
    }
    double far = 0;
    for (int i = 0; i < 3; i++) {
        const double way = w->at[i] - (double)desc->camera.position[i];
        far += way * way;
    }
    *good = pick.hit == w->hit;
    if (w->hit) {
        *good = *good && memcmp(pick.voxel, w->voxel, sizeof pick.voxel) == 0 && pick.face == face_number(w) &&
                fabs((double)pick.distance - sqrt(far)) < 0.05 + 1e-4 * sqrt(far);
    }
    return NULL;
}

// Whether a solid voxel, before the face, is within `reach` of a place.
static bool something_near(const checker *c, const walk *w, const double at[3], double reach) {
    const int axis = w->face / 2;
    const double size[3] = {c->shape.x, c->shape.y, c->shape.z};
    int32_t low[3], high[3], v[3];
    for (int i = 0; i < 3; i++) {
        low[i] = (int32_t)fmax(at[i] - reach, 0);
        high[i] = (int32_t)fmin(at[i] + reach, size[i] - 1);
    }
    if (w->face % 2) {
        low[axis] = low[axis] > w->voxel[axis] ? low[axis] : w->voxel[axis] + 1;
    } else {
        high[axis] = high[axis] < w->voxel[axis] ? high[axis] : w->voxel[axis] - 1;
    }
    for (v[2] = low[2]; v[2] <= high[2]; v[2]++) {
        for (v[1] = low[1]; v[1] <= high[1]; v[1]++) {
            for (v[0] = low[0]; v[0] <= high[0]; v[0]++) {
                if (is_solid(c, v)) {
                    return true;
                }
            }
        }
    }
    return false;
}

// Whether the way to the sun is free of all that could make a penumbra; false also where that is far to look for. A penumbra is a
// twelfth of the way wide (render_shared.h); the rest is for the cells that the field is taken from.
static bool far_from_shadows(const checker *c, const fm_render_desc *desc, const walk *w) {
    const double sun[3] = {(double)desc->sun[0], (double)desc->sun[1], (double)desc->sun[2]};
    for (double time = 0; time < CONE; time++) {
        const double at[3] = {w->at[0] + sun[0] * time, w->at[1] + sun[1] * time, w->at[2] + sun[2] * time};
        const double reach = 4 + time / 8;
        if (at[2] - reach > c->top && sun[2] > 0.125) {
            return true;
        }
        if (something_near(c, w, at, reach)) {
            return false;
        }
    }
    return false;
}

// The sun gives more than a half of the light of a face that it shines on; occlusion leaves that.
static bool keeps_sun(const uint8_t *pixel, const uint8_t *open) {
    return 4 * pixel[0] + 8 >= 3 * open[0];
}

static bool right_light(const checker *c, const fm_render_desc *desc, const walk *w, uint64_t i, bool shadow) {
    const uint8_t *timed = c->timed + 4 * i, *soft = c->soft + 4 * i, *hard = c->hard + 4 * i;
    bool good = no_lighter(soft, hard) && no_lighter(timed, soft);
    if (desc->shadow == FM_SHADOW_NONE || shadow) {
        good = good && alike(soft, hard);
    } else if (far_from_shadows(c, desc, w)) {
        good = good && alike(soft, hard) && keeps_sun(timed, hard);
    }
    return good && (desc->ambient_occlusion || alike(timed, soft));
}

static const char *check_pixel(checker *c, const fm_render_desc *desc, uint32_t x, uint32_t y, bench_render_result *result) {
    const uint64_t i = (uint64_t)y * desc->width + x;
    walk w;
    bool shadow = false, good = true;
    if (!sure_walk(c, desc, x, y, &w)) {
        return NULL;
    }
    const char *failure = check_pick(c, desc, x, y, &w, &good);
    good = good && shows_face(c->faces + 4 * i, &w);
    if (!failure && !w.hit) {
        result->checked++;
        result->wrong += !good || pixel_at(c->timed, i) != pixel_at(c->sky, i);
    }
    if (failure || !w.hit || (good && desc->shadow != FM_SHADOW_NONE && !sure_shadow(c, desc, &w, &shadow))) {
        return failure;
    }
    const fm_box box = {{(uint32_t)w.voxel[0], (uint32_t)w.voxel[1], (uint32_t)w.voxel[2]},
                        {(uint32_t)w.voxel[0] + 1, (uint32_t)w.voxel[1] + 1, (uint32_t)w.voxel[2] + 1}};
    uint32_t voxel;
    if (fm_world_read(c->given->world, &box, &voxel) != FM_OK) {
        return fm_last_error();
    }
    uint32_t *seen = &c->seen[!shadow][voxel & 0xff][w.face];
    const uint32_t shown = pixel_at(c->hard, i);
    result->checked++;
    result->wrong += !good || (*seen && *seen != shown) || !right_light(c, desc, &w, i, shadow);
    *seen = *seen ? *seen : shown;
    return NULL;
}

// Colours with some red in them look different from each axis, and never black.
static uint64_t wrong_faces(const uint32_t seen[FACES], uint32_t color) {
    uint64_t wrong = 0;
    for (int f = 0; color >> 5 >= 3 && f < NO_FACE; f++) {
        wrong += seen[f] && (seen[f] & 0xff) < 40;
        for (int g = 0; seen[f] && g < 2 * (f / 2); g++) {
            wrong += seen[f] == seen[g];
        }
    }
    return wrong;
}

// What looks the same and must not.
static uint64_t wrong_looks(const checker *c) {
    uint64_t wrong = 0;
    for (int lit = 0; lit < 2; lit++) {
        for (uint32_t a = 0; a < 256; a++) {
            wrong += wrong_faces(c->seen[lit][a], a);
            for (uint32_t i = 0; i < a * FACES; i++) {
                const uint32_t b = i / FACES, face = i % FACES;
                wrong += c->seen[lit][a][face] && c->seen[lit][a][face] == c->seen[lit][b][face];
            }
        }
    }
    return wrong;
}

static bool picture(const checker *c, fm_world *world, const fm_render_desc *desc, uint8_t *pixels) {
    return fm_render(c->given->renderer, world, desc, NULL) == FM_OK && fm_renderer_read(c->given->renderer, pixels) == FM_OK;
}

static const char *check_picture(checker *c, const fm_render_desc *desc, uint32_t number, bench_render_result *result) {
    fm_world *world = c->given->world;
    fm_render_desc faces = *desc, soft = *desc, hard = *desc;
    faces.view = FM_VIEW_NORMAL;
    hard.shadow = desc->shadow == FM_SHADOW_NONE ? FM_SHADOW_NONE : FM_SHADOW_HARD;
    soft.ambient_occlusion = hard.ambient_occlusion = false;
    if (!picture(c, world, desc, c->timed) || !picture(c, c->air, desc, c->sky) || !picture(c, world, &faces, c->faces) ||
        !picture(c, world, &soft, c->soft) || !picture(c, world, &hard, c->hard)) {
        return fm_last_error();
    }
    const char *failure = NULL;
    for (uint32_t i = 0; !failure && i < SAMPLES; i++) {
        // Places that spread evenly over the picture, others in each (Roberts 2018, "The unreasonable effectiveness of
        // quasirandom sequences").
        const double n = number * (double)SAMPLES + i + 0.5;
        const double x = fmod(n * 0.7548776662466927, 1), y = fmod(n * 0.5698402909980532, 1);
        failure = check_pixel(c, desc, (uint32_t)(x * desc->width), (uint32_t)(y * desc->height), result);
    }
    return failure;
}

static const char *read_solid(checker *c) {
    const fm_shape shape = c->shape;
    const uint64_t slice = (uint64_t)shape.x * shape.y;
    uint32_t *voxels = malloc(slice * sizeof *voxels);
    fm_result result = voxels ? FM_OK : FM_ERROR_OUT_OF_HOST_MEMORY;
    for (uint32_t z = 0; result == FM_OK && z < shape.z; z++) {
        result = fm_world_read(c->given->world, &(fm_box){{0, 0, z}, {shape.x, shape.y, z + 1}}, voxels);
        for (uint64_t i = 0; result == FM_OK && i < slice; i++) {
            const uint64_t at = slice * z + i;
            c->solid[at / 64] |= (uint64_t)(voxels[i] != 0) << (at % 64);
            c->top = voxels[i] ? (int32_t)z : c->top;
        }
    }
    free(voxels);
    return result == FM_OK ? NULL : voxels ? fm_last_error() : "out of memory for the check";
}

static const char *check(checker *c, bench_render_result *result) {
    if (!c->solid || !c->timed || !c->sky || !c->faces || !c->hard || !c->soft) {
        return "out of memory for the check";
    }
    if (fm_world_create(c->given->context, &(fm_world_desc){.shape = {1, 1, 1}}, &c->air) != FM_OK) {
        return fm_last_error();
    }
    const char *failure = read_solid(c);
    for (uint32_t i = 0; !failure && i < c->given->count; i++) {
        failure = check_picture(c, &c->given->pictures[i], i, result);
    }
    result->wrong += failure ? 0 : wrong_looks(c);
    return failure ? failure : result->wrong ? "pixels are wrong" : NULL;
}

const char *bench_render_check(const bench_render_pictures *given, bench_render_result *result) {
    checker *c = calloc(1, sizeof *c);
    if (!c) {
        return "out of memory for the check";
    }
    fm_world_desc desc;
    fm_world_info(given->world, &desc);
    c->given = given;
    c->shape = desc.shape;
    const size_t bytes = 4 * (size_t)given->pictures->width * given->pictures->height;
    const uint64_t voxels = (uint64_t)c->shape.x * c->shape.y * c->shape.z;
    c->solid = calloc(voxels / 64 + 1, sizeof *c->solid);
    c->timed = malloc(bytes);
    c->sky = malloc(bytes);
    c->faces = malloc(bytes);
    c->hard = malloc(bytes);
    c->soft = malloc(bytes);
    const char *failure = check(c, result);
    fm_world_destroy(c->air);
    free(c->solid);
    free(c->timed);
    free(c->sky);
    free(c->faces);
    free(c->hard);
    free(c->soft);
    free(c);
    return failure;
}
