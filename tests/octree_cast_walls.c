// SPDX-License-Identifier: MIT
// Rays through octrees that end before the surface meet nothing, and rays do not go through thin walls.

#include "fathom/octree.h"
#include "meshes.h"
#include "random.h"
#include "vulkan_common.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

enum { RAYS = 2000 };

static fm_mesh_ray rays[RAYS];
static fm_mesh_hit truth[RAYS];
static fm_octree_hit hits[RAYS], later[RAYS];

static float random_of(uint64_t *seed, float low, float high) {
    return low + (high - low) * (float)(test_random(seed) >> 40) / (float)(1 << 24);
}

static void make_rays(void) {
    uint64_t seed = 29;
    for (int i = 0; i < RAYS; i++) {
        float length = 0;
        rays[i] = (fm_mesh_ray){.last = INFINITY};
        for (int k = 0; k < 3; k++) {
            rays[i].origin[k] = random_of(&seed, -1, 1) + (k == i % 3 ? 3.0f : 0.0f);
            rays[i].direction[k] = random_of(&seed, -0.6f, 0.6f) - rays[i].origin[k];
            length += rays[i].direction[k] * rays[i].direction[k];
        }
        for (int k = 0; k < 3; k++) {
            rays[i].direction[k] /= sqrtf(length);
        }
    }
}

// Two meshes as one.
static scene_mesh joined(scene_mesh *a, scene_mesh *b) {
    scene_mesh sum = {.vertices = malloc((a->vertex_count + b->vertex_count) * sizeof *sum.vertices),
                      .triangles = malloc((a->triangle_count + b->triangle_count) * sizeof *sum.triangles)};
    if (sum.vertices && sum.triangles) {
        memcpy(sum.vertices, a->vertices, a->vertex_count * sizeof *a->vertices);
        memcpy(sum.vertices + a->vertex_count, b->vertices, b->vertex_count * sizeof *b->vertices);
        memcpy(sum.triangles, a->triangles, a->triangle_count * sizeof *a->triangles);
        for (uint64_t i = 0; i < b->triangle_count; i++) {
            for (int k = 0; k < 3; k++) {
                sum.triangles[a->triangle_count + i][k] = b->triangles[i][k] + (uint32_t)a->vertex_count;
            }
        }
        sum.vertex_count = a->vertex_count + b->vertex_count;
        sum.triangle_count = a->triangle_count + b->triangle_count;
    }
    scene_mesh_free(a);
    scene_mesh_free(b);
    return sum;
}

static fm_mesh *mesh_of(fm_context *context, scene_mesh *scene) {
    const fm_mesh_desc desc = scene_mesh_describe(scene);
    fm_mesh *mesh = NULL;
    CHECK_OK(fm_mesh_create(context, &desc, &mesh));
    scene_mesh_free(scene);
    return mesh;
}

// A shell `wall` cells thick: behind it there is another wall, at a hit of which a ray has gone through the first.
static void check_wall(fm_context *context, double wall) {
    const float centre[3] = {0, 0, 0};
    const double cell = 1.8 / 60;
    scene_mesh outer = scene_mesh_sphere(60, 120, centre, 0.8f);
    scene_mesh inner = scene_mesh_sphere(60, 120, centre, (float)(0.8 - wall * cell));
    scene_mesh both = joined(&outer, &inner);
    fm_mesh *mesh = mesh_of(context, &both);
    const fm_octree_desc desc = {.size = 60, .low = {-0.9f, -0.9f, -0.9f}, .high = {0.9f, 0.9f, 0.9f}};
    fm_octree *octree = NULL;
    int met = 0, through = 0;
    if (mesh && CHECK_OK(fm_octree_build_mesh(mesh, &desc, &octree)) && CHECK_OK(fm_mesh_cast(mesh, rays, RAYS, false, truth)) &&
        CHECK_OK(fm_octree_cast(octree, rays, RAYS, 0, hits))) {
        for (int i = 0; i < RAYS; i++) {
            met += isfinite(truth[i].t);
            through += isfinite(truth[i].t) && !((double)hits[i].t - (double)truth[i].t < 0.45 * wall * cell + 0.2 * cell);
        }
    }
    printf("wall of %.2f cells: %d of %d rays go through\n", wall, through, met);
    CHECK(met > RAYS / 4 && through * 200 <= met);
    fm_octree_destroy(octree);
    fm_mesh_destroy(mesh);
}

static void check_ends(fm_mesh *mesh, fm_octree_kind kind) {
    const fm_octree_desc desc = {.kind = kind, .size = 60, .low = {-0.9f, -0.9f, -0.9f}, .high = {0.9f, 0.9f, 0.9f}};
    fm_octree *octree = NULL;
    int met = 0, beyond = 0;
    if (!CHECK_OK(fm_octree_build_mesh(mesh, &desc, &octree))) {
        return;
    }
    make_rays();
    if (CHECK_OK(fm_octree_cast(octree, rays, RAYS, 0, hits))) {
        for (int i = 0; i < RAYS; i++) {
            rays[i].last = isfinite(hits[i].t) ? hits[i].t - 1.8f / 60 : 1;
            met += isfinite(hits[i].t);
        }
        if (CHECK_OK(fm_octree_cast(octree, rays, RAYS, 0, later))) {
            for (int i = 0; i < RAYS; i++) {
                beyond += isfinite(hits[i].t) && isfinite(later[i].t);
            }
        }
    }
    printf("kind %d: %d of %d rays that end a cell before the surface meet it\n", (int)kind, beyond, met);
    // A ray that goes along the surface may end within epsilon of it.
    CHECK(met > RAYS / 4 && beyond * 200 <= met);
    fm_octree_destroy(octree);
    make_rays();
}

int main(int count, char **arguments) {
    fm_context *context = NULL;
    int status;
    if (!vulkan_or_cpu(count, arguments, &context, &status)) {
        return status;
    }
    make_rays();
    static const double walls[] = {0.6, 0.75, 1, 1.5, 2.5};
    for (int i = 0; i < 5; i++) {
        check_wall(context, walls[i]);
    }
    const float low[3] = {-0.61f, -0.52f, -0.43f}, high[3] = {0.57f, 0.48f, 0.66f};
    scene_mesh box = scene_mesh_box(low, high);
    fm_mesh *mesh = mesh_of(context, &box);
    for (int kind = FM_OCTREE_CLOSEST; mesh && kind <= FM_OCTREE_BRICKS; kind++) {
        check_ends(mesh, (fm_octree_kind)kind);
    }
    fm_mesh_destroy(mesh);
    vulkan_close(context);
    return check_summary();
}
