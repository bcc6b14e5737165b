// SPDX-License-Identifier: MIT
// The same picture of a world by its voxels (FM_MARCH_PLAIN) and by octrees of them, pixel for pixel.

#include "fathom/render.h"
#include "octree_voxels_common.h"
#include "render/render.h"
#include "scenes.h"

enum { EDGE = 96, WIDTH = 80, HEIGHT = 60, PIXELS = WIDTH * HEIGHT };

static bool fill_world(fm_world *world, const char *name) {
    const fm_scene *scene = fm_scene_find(name);
    const fm_scene_desc desc = {.shape = {EDGE, EDGE, EDGE}, .seed = 4};
    const fm_box all = {{0, 0, 0}, {EDGE, EDGE, EDGE}};
    uint8_t *bytes = malloc(EDGE * EDGE * EDGE);
    uint32_t *voxels = malloc(EDGE * EDGE * EDGE * sizeof *voxels);
    bool good = CHECK(scene && bytes && voxels);
    if (good) {
        fm_scene_fill(scene, &desc, 0, EDGE, bytes);
        for (int i = 0; i < EDGE * EDGE * EDGE; i++) {
            voxels[i] = bytes[i];
        }
        good = CHECK_OK(fm_world_write(world, &all, voxels)) && CHECK_OK(fm_world_update(world, NULL));
    }
    free(bytes);
    free(voxels);
    return good;
}

static void make_rays(const fm_render_desc *desc, fm_mesh_ray *rays) {
    fm_march_push push;
    memset(&push, 0, sizeof push);
    fm_camera_rays(desc, &push);
    for (int i = 0; i < PIXELS; i++) {
        double way[3], square = 0;
        for (int axis = 0; axis < 3; axis++) {
            way[axis] = (double)(push.corner[axis] + push.right[axis] * (float)(i % WIDTH) + push.down[axis] * (float)(i / WIDTH));
            square += way[axis] * way[axis];
        }
        rays[i] = (fm_mesh_ray){.last = INFINITY};
        for (int axis = 0; axis < 3; axis++) {
            rays[i].origin[axis] = desc->camera.position[axis];
            rays[i].direction[axis] = (float)(way[axis] / sqrt(square));
        }
    }
}

static bool alike(const fm_pick *pick, const fm_octree_hit *hit) {
    if (!pick->hit || isinf(hit->t)) {
        return !pick->hit && isinf(hit->t);
    }
    const int axis = abs(pick->face) - 1;
    const bool face = pick->face == 0 || hit->normal[axis] == (pick->face > 0 ? 1.0f : -1.0f);
    return face && fabsf(pick->distance - hit->t) < 1e-3f * (1 + hit->t);
}

static void check_picture(fm_renderer *renderer, fm_world *world, const fm_render_desc *desc) {
    static fm_mesh_ray rays[PIXELS];
    static fm_octree_hit hits[PIXELS];
    static fm_pick picks[PIXELS];
    make_rays(desc, rays);
    int seen = 0;
    for (int i = 0; i < PIXELS; i++) {
        if (!CHECK_OK(fm_render_pick(renderer, world, desc, (float)(i % WIDTH), (float)(i / WIDTH), &picks[i]))) {
            return;
        }
        seen += picks[i].hit;
    }
    CHECK(seen > PIXELS / 4);
    for (int k = 0; k < GRID_KINDS; k++) {
        const fm_octree_desc wanted = {.kind = grid_kinds[k], .top_bytes = 2048};
        fm_octree *octree = NULL;
        int other = 0;
        if (CHECK_OK(fm_octree_build_world(world, &wanted, &octree)) && CHECK_OK(fm_octree_cast(octree, rays, PIXELS, 0, hits))) {
            for (int i = 0; i < PIXELS; i++) {
                other += !alike(&picks[i], &hits[i]);
            }
        }
        printf("kind %d: %d of %d pixels differ\n", (int)grid_kinds[k], other, PIXELS);
        CHECK(other <= PIXELS / 500);  // rays at edges
        fm_octree_destroy(octree);
    }
}

int main(void) {
    const fm_context_desc desc = {.backend = FM_BACKEND_CPU, .threads = 1};
    fm_context *context = NULL;
    fm_renderer *renderer = NULL;
    if (!CHECK_OK(fm_context_create(&desc, &context)) || !CHECK_OK(fm_renderer_create(context, &renderer))) {
        return check_summary();
    }
    static const char *const names[] = {"terrain", "city"};
    static const fm_camera cameras[] = {{{-30, -40, 90}, {1, 1.1f, -0.7f}, {0, 0, 1}, 60},
                                        {{48, 47.6f, 80.3f}, {0.3f, 1, -0.8f}, {0, 0, 1}, 80}};
    for (int i = 0; i < 2; i++) {
        const fm_world_desc made = {.shape = {EDGE, EDGE, EDGE}, .format = FM_FIELD_SPLIT_U8};
        fm_world *world = NULL;
        if (CHECK_OK(fm_world_create(context, &made, &world)) && fill_world(world, names[i])) {
            for (int c = 0; c < 2; c++) {
                const fm_render_desc view = {.camera = cameras[c], .width = WIDTH, .height = HEIGHT, .march = FM_MARCH_PLAIN};
                check_picture(renderer, world, &view);
            }
        }
        fm_world_destroy(world);
    }
    fm_renderer_destroy(renderer);
    fm_context_destroy(context);
    return check_summary();
}
