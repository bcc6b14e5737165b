// SPDX-License-Identifier: MIT
// What a deferred picture's camera sees, in numbers: the rays of pixels, where the picture before had them, and the boxes that its
// shadow map covers.

#include "render/deferred.h"
#include "render/render.h"

#include <math.h>
#include <string.h>

// A number of 0 to 1 that covers the interval evenly. Source: Halton 1960.
static double halton(uint32_t index, uint32_t base) {
    double part = 1, sum = 0;
    for (; index > 0; index /= base) {
        part /= base;
        sum += part * (index % base);
    }
    return sum;
}

static double length(const float v[3]) {
    return sqrt((double)v[0] * (double)v[0] + (double)v[1] * (double)v[1] + (double)v[2] * (double)v[2]);
}

static void scale(const float v[3], double by, float out[3]) {
    for (int i = 0; i < 3; i++) {
        out[i] = (float)((double)v[i] * by);
    }
}

// The camera of the picture before, to find what it showed of a place.
static void set_past(const fm_defer_scene *old, fm_defer_scene *scene) {
    const double right = length(old->right), down = length(old->down);
    float forward[3];
    for (int i = 0; i < 3; i++) {
        forward[i] =
            old->corner[i] + old->right[i] * 0.5f * (float)(old->width - 1) + old->down[i] * 0.5f * (float)(old->height - 1);
    }
    memcpy(scene->old_origin, old->origin, sizeof scene->old_origin);
    scale(forward, 1 / length(forward), scene->old_forward);
    scale(old->right, 1 / (right * right), scene->old_right);
    scale(old->down, 1 / (down * down), scene->old_down);
    scene->old_middle[0] = 0.5f * (float)(old->width - 1);
    scene->old_middle[1] = 0.5f * (float)(old->height - 1);
}

void fm_deferred_camera(const fm_deferred *deferred, fm_deferred_picture *picture) {
    fm_defer_scene *scene = &picture->scene;
    const fm_deferred_desc *desc = &picture->desc;
    const fm_render_desc rays = {.camera = desc->camera, .width = desc->width, .height = desc->height};
    fm_march_push push;
    fm_camera_rays(&rays, &push);
    memcpy(scene->origin, desc->camera.position, sizeof scene->origin);
    memcpy(scene->corner, push.corner, sizeof scene->corner);
    memcpy(scene->right, push.right, sizeof scene->right);
    memcpy(scene->down, push.down, sizeof scene->down);
    scene->blend = desc->taa && deferred->has_history && deferred->width == desc->width && deferred->height == desc->height;
    if (scene->blend) {
        set_past(&deferred->newest, scene);
    }
    if (desc->taa) {
        scene->shift[0] = (float)(halton(desc->frame % 16 + 1, 2) - 0.5);
        scene->shift[1] = (float)(halton(desc->frame % 16 + 1, 3) - 0.5);
        for (int i = 0; i < 3; i++) {
            scene->corner[i] += scene->right[i] * scene->shift[0] + scene->down[i] * scene->shift[1];
        }
    }
}

// Unit vectors at right angles: right and down in the map, and towards the light.
typedef struct basis {
    double v[3][3];
} basis;

typedef struct box {
    double low[3], high[3];
} box;

static void include(box *b, const basis *axes, const double at[3]) {
    for (int i = 0; i < 3; i++) {
        const double along = axes->v[i][0] * at[0] + axes->v[i][1] * at[1] + axes->v[i][2] * at[2];
        b->low[i] = fmin(b->low[i], along);
        b->high[i] = fmax(b->high[i], along);
    }
}

static const box nothing = {{INFINITY, INFINITY, INFINITY}, {-INFINITY, -INFINITY, -INFINITY}};

// What the camera sees from `first` to `last` ahead.
static box slice_box(const fm_defer_scene *scene, const basis *axes, double first, double last) {
    box b = nothing;
    for (int corner = 0; corner < 8; corner++) {
        const double x = corner & 1 ? scene->width : 0, y = corner >> 1 & 1 ? scene->height : 0, far = corner >> 2 ? last : first;
        double at[3];
        for (int i = 0; i < 3; i++) {
            at[i] = (double)scene->origin[i] +
                    ((double)scene->corner[i] + (double)scene->right[i] * x + (double)scene->down[i] * y) * far;
        }
        include(&b, axes, at);
    }
    return b;
}

static void set_cascade(fm_defer_cascade *cascade, const basis *axes, const box *seen, const box *mesh, uint32_t edge) {
    const double size = fmax(seen->high[0] - seen->low[0], seen->high[1] - seen->low[1]);
    // A blur reads beyond the edge of what is seen.
    const double texel = size / fmax(edge - 2.0 * (FM_MAP_BLUR + 2), 1),
                 low[2] = {seen->low[0] - (FM_MAP_BLUR + 2) * texel, seen->low[1] - (FM_MAP_BLUR + 2) * texel};
    const double high = fmax(mesh->high[2], seen->high[2]), deep = fmin(mesh->low[2], seen->low[2]);
    const double margin = 1e-3 * (high - deep) + 1e-30;
    for (int i = 0; i < 3; i++) {
        cascade->corner[i] = (float)(axes->v[0][i] * low[0] + axes->v[1][i] * low[1] + axes->v[2][i] * (high + margin));
        cascade->right[i] = (float)(axes->v[0][i] * texel);
        cascade->down[i] = (float)(axes->v[1][i] * texel);
    }
    cascade->depth = (float)(high - deep + 2 * margin);
}

static basis light_basis(const float way[3]) {
    basis axes = {{{0}, {0}, {(double)way[0], (double)way[1], (double)way[2]}}};
    const double other[3] = {fabs(axes.v[2][0]) < 0.6, fabs(axes.v[2][0]) >= 0.6, 0};
    fm_cross_product(axes.v[2], other, axes.v[0]);
    const double size = sqrt(axes.v[0][0] * axes.v[0][0] + axes.v[0][1] * axes.v[0][1] + axes.v[0][2] * axes.v[0][2]);
    for (int i = 0; i < 3; i++) {
        axes.v[0][i] /= size;
    }
    fm_cross_product(axes.v[2], axes.v[0], axes.v[1]);
    return axes;
}

void fm_deferred_cascades(fm_deferred_picture *picture, const float low[3], const float high[3]) {
    fm_defer_scene *scene = &picture->scene;
    if (picture->desc.shadows != FM_SHADOWS_MAP) {
        return;
    }
    const basis axes = light_basis(scene->lights[0].way);
    box mesh = nothing;
    double far = 0;
    for (int corner = 0; corner < 8; corner++) {
        double at[3], away = 0;
        for (int i = 0; i < 3; i++) {
            at[i] = (double)(corner >> i & 1 ? high[i] : low[i]);
            away += (at[i] - (double)scene->origin[i]) * (at[i] - (double)scene->origin[i]);
        }
        include(&mesh, &axes, at);
        far = fmax(far, sqrt(away));
    }
    far = picture->desc.extent > 0 ? (double)picture->desc.extent : far;
    // Between a logarithmic and an even split (Zhang et al. 2006, "Parallel-split shadow maps").
    const double near = 0.01 * far;
    double first = 0;
    for (int i = 0; i < FM_CASCADES; i++) {
        const double part = (i + 1.0) / FM_CASCADES, last = 0.5 * near * pow(far / near, part) + 0.5 * (near + (far - near) * part);
        const box seen = slice_box(scene, &axes, first, last);
        set_cascade(&scene->cascades[i], &axes, &seen, &mesh, scene->map_edge);
        first = last;
    }
}
