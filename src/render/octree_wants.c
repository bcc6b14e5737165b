// SPDX-License-Identifier: MIT
#include "render/octree_wants.h"

#include "render/render.h"
#include "shaders/include/octree_cast_rule.h"

#include <string.h>

enum { GRAIN = 16 };

// How many times as wide as high a picture may be that is all seen.
static const float WIDEST = 2;
static const float EPSILON = 0.1f;  // in coarse cells

typedef struct pass {
    const fm_octree_wants *wants;
    fm_v3 origin, corner, right, down;
    float until[FM_WANT_RAYS];  // until where each ray goes
} pass;

static fm_v3 way_of(const pass *p, uint32_t ray) {
    const fm_v3 across = fm_times(p->right, (float)(ray % FM_WANT_WIDTH)), down = fm_times(p->down, (float)(ray / FM_WANT_WIDTH));
    return fm_unit(fm_add(p->corner, fm_add(across, down)));
}

static void cast(void *user, uint64_t begin, uint64_t end, uint32_t worker) {
    (void)worker;
    pass *p = user;
    const fm_octree_head head = p->wants->head;
    const float distance = p->wants->grid.distance;
    for (uint64_t ray = begin; ray < end; ray++) {
        const fm_octree_met met = fm_cast_ray(head, p->origin, way_of(p, (uint32_t)ray), 0, distance, EPSILON * head.cell);
        // The finer surface may be somewhat behind the coarse one.
        p->until[ray] = fminf(distance, met.t + 2 * head.cell);
    }
}

static void count_ray(const pass *p, uint32_t ray, float *scores) {
    const fm_octree_grid *grid = &p->wants->grid;
    const float origin[3] = {p->origin.x, p->origin.y, p->origin.z};
    const fm_v3 unit = way_of(p, ray);
    const float way[3] = {unit.x, unit.y, unit.z};
    float first = 0, last = p->until[ray];
    for (int axis = 0; axis < 3; axis++) {
        const float low = grid->origin[axis], high = low + (float)grid->count[axis] * grid->size;
        const float a = (low - origin[axis]) / way[axis], b = (high - origin[axis]) / way[axis];
        if (way[axis] != 0) {
            first = fmaxf(first, fminf(a, b));
            last = fminf(last, fmaxf(a, b));
        } else if (origin[axis] < low || origin[axis] > high) {
            return;
        }
    }
    int at[3], steps = 1;
    for (int axis = 0; axis < 3; axis++) {
        const float place = (origin[axis] + first * way[axis] - grid->origin[axis]) / grid->size;
        at[axis] = place >= 0 ? (int)fminf(place, (float)(grid->count[axis] - 1)) : 0;
        steps += grid->count[axis];
    }
    for (float t = first; t <= last && steps-- > 0;) {
        const size_t part = (size_t)at[0] + (size_t)grid->count[0] * ((size_t)at[1] + (size_t)grid->count[1] * (size_t)at[2]);
        scores[part] += 1 / (t + p->wants->head.cell);
        int next = 0;
        float leave = INFINITY;
        for (int axis = 0; axis < 3; axis++) {
            const float face = grid->origin[axis] + grid->size * (float)(at[axis] + (way[axis] > 0));
            const float time = way[axis] != 0 ? (face - origin[axis]) / way[axis] : INFINITY;
            next = time < leave ? axis : next;
            leave = fminf(leave, time);
        }
        at[next] += way[next] > 0 ? 1 : -1;
        if (at[next] < 0 || at[next] >= grid->count[next]) {
            return;
        }
        t = fmaxf(t, leave);
    }
}

void fm_octree_want(fm_pool *pool, const fm_octree_wants *wants, const fm_camera *camera, uint32_t turn, float *scores) {
    // Rays stand farther apart across than down, so that wide pictures are covered.
    const fm_render_desc desc = {.camera = *camera, .width = FM_WANT_WIDTH, .height = FM_WANT_HEIGHT};
    const float wider = WIDEST * FM_WANT_HEIGHT / FM_WANT_WIDTH;
    fm_march_push push;
    pass p = {.wants = wants};
    fm_camera_rays(&desc, &push);
    p.origin = (fm_v3){camera->position[0], camera->position[1], camera->position[2]};
    p.right = fm_times((fm_v3){push.right[0], push.right[1], push.right[2]}, wider);
    p.down = (fm_v3){push.down[0], push.down[1], push.down[2]};
    const fm_v3 corner = {push.corner[0], push.corner[1], push.corner[2]};
    // Turns that follow each other are far apart.
    const float across = (float)(turn * 5 % 4) / 4 - 0.375f, along = (float)(turn * 7 % FM_WANT_TURNS / 4) / 4 - 0.375f;
    p.corner = fm_less(corner, fm_times(p.right, (1 - 1 / wider) * 0.5f * (FM_WANT_WIDTH - 1)));
    p.corner = fm_add(p.corner, fm_add(fm_times(p.right, across), fm_times(p.down, along)));
    fm_pool_run(pool, FM_WANT_RAYS, GRAIN, cast, &p);
    memset(scores, 0, (size_t)wants->grid.count[0] * (size_t)wants->grid.count[1] * (size_t)wants->grid.count[2] * sizeof *scores);
    for (uint32_t ray = 0; ray < FM_WANT_RAYS; ray++) {
        count_ray(&p, ray, scores);
    }
}
