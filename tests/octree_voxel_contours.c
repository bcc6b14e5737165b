// SPDX-License-Identifier: MIT
// Contours of voxels that many small triangles touch: they hold all of the surface that is in them, and are as near to it as those
// of few triangles.

#include "meshes.h"
#include "octree_voxels_common.h"
#include "shaders/include/octree_contours_rule.h"

enum { RAYS = 2000, POINTS = 20000 };

static fm_context *context;

// How far from the surface a place is, and the way to it from there.
typedef double (*distance_fn)(const double at[3]);

static double sphere_distance(const double at[3]) {
    return fabs(sqrt(at[0] * at[0] + at[1] * at[1] + at[2] * at[2]) - 1);
}

static double torus_distance(const double at[3]) {
    const double around = hypot(at[0], at[1]) - 0.8;
    return fabs(hypot(around, at[2]) - 0.3);
}

typedef struct place {
    fm_voxel_ref cell;
    double at[3];  // in the cell, from -1 to 1
} place;

// The leaf around a place.
static place find_leaf(const fm_octree *octree, const double at[3]) {
    const fm_voxel_trees trees = {.octree = (fm_octree *)(uintptr_t)octree, .kind = &fm_kind_contours};
    const fm_octree_info *info = &octree->info;
    uint32_t finest[3], level = info->levels;
    place found;
    for (int i = 0; i < 3; i++) {
        found.at[i] = (at[i] - info->origin[i]) / info->cell;
        finest[i] = (uint32_t)found.at[i];
    }
    const uint64_t row = (finest[1] >> level) + (uint64_t)info->top[1] * (finest[2] >> level);
    const uint64_t index = (finest[0] >> level) + info->top[0] * row;
    found.cell = trees.kind->placed(&trees, fm_voxel_words(&trees)[index]);
    while (found.cell.type == FM_REF_NODE) {
        fm_voxel_ref children[FM_BRANCHES];
        trees.kind->split(&trees, level, &found.cell, children);
        level--;
        found.cell = children[(finest[0] >> level & 1) | (finest[1] >> level & 1) << 1 | (finest[2] >> level & 1) << 2];
    }
    for (int i = 0; i < 3; i++) {
        found.at[i] = 2 * (found.at[i] - finest[i]) - 1;
    }
    return found;
}

// Random places on triangles: each is in a leaf that is there and between its planes.
static void check_inside(const fm_octree *octree, const fm_mesh_desc *mesh) {
    uint64_t seed = 7;
    int outside = 0, cubes = 0;
    for (int k = 0; k < POINTS; k++) {
        const uint32_t *corners = mesh->triangles[test_random(&seed) % mesh->triangle_count];
        const double u = (double)test_between(&seed, 0, 1000) * 0.001, v = (1 - u) * (double)test_between(&seed, 0, 1000) * 0.001;
        double at[3], along = 0;
        for (int i = 0; i < 3; i++) {
            const double a = (double)mesh->vertices[corners[0]][i];
            at[i] = a + u * ((double)mesh->vertices[corners[1]][i] - a) + v * ((double)mesh->vertices[corners[2]][i] - a);
        }
        const place found = find_leaf(octree, at);
        if (!CHECK(found.cell.type == FM_REF_SOLID)) {
            return;
        }
        for (int i = 0; i < 3; i++) {
            along += (double)fm_contour_normal(found.cell.contour, i) / 31 * found.at[i];
        }
        cubes += found.cell.contour == 0;
        outside += found.cell.contour != 0 && fabs(along - (double)fm_contour_position(found.cell.contour)) >
                                                  (double)fm_contour_thickness(found.cell.contour) + 1e-5;
    }
    printf("of %d places %d are outside of the contour, %d in a cube\n", POINTS, outside, cubes);
    CHECK(outside == 0);
    CHECK(cubes < POINTS / 50);
}

// Rays towards the origin's surroundings, where a torus has its hole, from all around.
static void check_rays(fm_octree *octree, distance_fn distance, double worst) {
    static fm_mesh_ray rays[RAYS];
    static fm_octree_hit hits[RAYS];
    uint64_t seed = 5;
    double sum = 0, most = 0;
    int met = 0;
    for (int k = 0; k < RAYS; k++) {
        double way[3], square = 0;
        for (int i = 0; i < 3; i++) {
            rays[k].origin[i] = (float)test_between(&seed, -3000, 3000) * 0.001f;
        }
        rays[k].origin[k % 3] = k % 2 ? 3 : -3;
        for (int i = 0; i < 3; i++) {
            way[i] = (double)test_between(&seed, -700, 700) * 0.001 - (double)rays[k].origin[i];
            square += way[i] * way[i];
        }
        for (int i = 0; i < 3; i++) {
            rays[k].direction[i] = (float)(way[i] / sqrt(square));
        }
        rays[k].last = INFINITY;
    }
    CHECK_OK(fm_octree_cast(octree, rays, RAYS, 0, hits));
    for (int k = 0; k < RAYS; k++) {
        if (isinf(hits[k].t)) {
            continue;
        }
        double at[3];
        for (int i = 0; i < 3; i++) {
            at[i] = (double)rays[k].origin[i] + (double)hits[k].t * (double)rays[k].direction[i];
        }
        const double off = distance(at) / octree->info.cell;
        sum += off;
        most = off > most ? off : most;
        met++;
    }
    printf("%d rays meet it, %.4f cells off on the average, %.3f at most\n", met, sum / (met > 0 ? met : 1), most);
    CHECK(met > RAYS / 2);
    CHECK(sum < worst * met);
}

static void check_mesh(const scene_mesh *scene, distance_fn distance, uint32_t size, double worst) {
    const fm_mesh_desc described = scene_mesh_describe(scene);
    const fm_octree_desc desc = {.kind = FM_OCTREE_CONTOURS, .size = size};
    fm_mesh *mesh = NULL;
    fm_octree *octree = NULL;
    if (CHECK_OK(fm_mesh_create(context, &described, &mesh)) && CHECK_OK(fm_octree_build_mesh(mesh, &desc, &octree))) {
        printf("%llu triangles, %u cells: ", (unsigned long long)described.triangle_count, size);
        check_inside(octree, &described);
        check_rays(octree, distance, worst);
    }
    fm_octree_destroy(octree);
    fm_mesh_destroy(mesh);
}

int main(void) {
    const fm_context_desc desc = {.backend = FM_BACKEND_CPU, .threads = 1};
    const float middle[3] = {0, 0, 0};
    if (!CHECK_OK(fm_context_create(&desc, &context))) {
        return check_summary();
    }
    scene_mesh ball = scene_mesh_sphere(250, 500, middle, 1), torus = scene_mesh_torus(200, 500, middle, 0.8f, 0.3f);
    check_mesh(&ball, sphere_distance, 128, 0.02);
    check_mesh(&ball, sphere_distance, 24, 0.05);
    check_mesh(&torus, torus_distance, 24, 0.08);
    check_mesh(&torus, torus_distance, 9, 0.25);
    scene_mesh_free(&ball);
    scene_mesh_free(&torus);
    fm_context_destroy(context);
    return check_summary();
}
