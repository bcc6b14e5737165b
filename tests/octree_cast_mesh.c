// SPDX-License-Identifier: MIT
// Rays through octrees that the library has built, against the triangles that they were built from.

#include "fathom/octree.h"
#include "meshes.h"
#include "random.h"
#include "vulkan_common.h"

#include <math.h>

// Rays come in groups: one, and four beside it, which tell whether it meets the surface near an outline.
enum { GROUPS = 1500, BESIDE = 4, RAYS = GROUPS * (1 + BESIDE) };

static fm_mesh_ray rays[RAYS];
static fm_mesh_hit truth[RAYS];
static fm_octree_hit hits[RAYS];

static float random_of(uint64_t *seed, float low, float high) {
    return low + (high - low) * (float)(test_random(seed) >> 40) / (float)(1 << 24);
}

static void make_rays(double cell) {
    uint64_t seed = 11;
    for (int i = 0; i < GROUPS; i++) {
        fm_mesh_ray *ray = &rays[i * (1 + BESIDE)];
        float length = 0;
        *ray = (fm_mesh_ray){.last = 1e30f};
        for (int k = 0; k < 3; k++) {
            ray->origin[k] = random_of(&seed, -1, 1) + (k == i % 3 ? 3.0f : 0.0f);
            ray->direction[k] = random_of(&seed, -0.8f, 0.8f) - ray->origin[k];
            length += ray->direction[k] * ray->direction[k];
        }
        for (int k = 0; k < 3; k++) {
            ray->direction[k] /= sqrtf(length);
        }
        for (int b = 1; b <= BESIDE; b++) {
            ray[b] = *ray;
            const int axis = (i + 1 + b % 2) % 3;
            ray[b].origin[axis] += (b < 3 ? 1.5f : -1.5f) * (float)cell;
        }
    }
}

typedef struct outcome {
    int both, holes, imagined, smooth;
    double off, turned;  // sums
} outcome;

static double cosine_of(const fm_mesh *mesh, uint32_t triangle, const float way[3]) {
    const float(*v)[3];
    const uint32_t(*t)[3];
    fm_mesh_arrays(mesh, &v, NULL, &t, NULL);
    double a[3], b[3], along = 0, square = 0;
    for (int k = 0; k < 3; k++) {
        a[k] = (double)v[t[triangle][1]][k] - (double)v[t[triangle][0]][k];
        b[k] = (double)v[t[triangle][2]][k] - (double)v[t[triangle][0]][k];
    }
    for (int k = 0; k < 3; k++) {
        const int x = (k + 1) % 3, y = (k + 2) % 3;
        const double n = a[x] * b[y] - a[y] * b[x];
        along += n * (double)way[k];
        square += n * n;
    }
    return fabs(along) / sqrt(square);
}

static outcome compare(const fm_mesh *mesh, double cell) {
    outcome sum = {0};
    for (int i = 0; i < GROUPS; i++) {
        const int at = i * (1 + BESIDE);
        const double t = (double)truth[at].t, mine = (double)hits[at].t;
        bool smooth = isfinite(t), free_of_all = isinf(t);
        for (int b = 1; b <= BESIDE; b++) {
            smooth = smooth && fabs((double)truth[at + b].t - t) < 4 * cell;
            free_of_all = free_of_all && isinf((double)truth[at + b].t);
        }
        sum.imagined += free_of_all && isfinite(mine);
        if (!smooth) {
            continue;
        }
        const double cosine = cosine_of(mesh, truth[at].triangle, rays[at].direction);
        if (cosine < 0.3) {
            continue;
        }
        sum.smooth++;
        sum.holes += !(mine - t < 3 * cell);
        if (isfinite(mine) && fabs(mine - t) < 3 * cell) {
            double along = 0;
            for (int k = 0; k < 3; k++) {
                along -= (double)hits[at].normal[k] * (double)rays[at].direction[k];
            }
            sum.both++;
            sum.off += fabs(mine - t) * cosine / cell;
            sum.turned += fabs(along - cosine);
        }
    }
    return sum;
}

// `threshold`: of merging a thin octree of vectors; 0: it is none.
static void check_octree(const char *name, fm_mesh *mesh, fm_octree *octree, bool coarse, bool thin, double threshold) {
    fm_octree_info info;
    fm_octree_describe(octree, &info);
    make_rays(info.cell);
    if (!CHECK_OK(fm_mesh_cast(mesh, rays, RAYS, false, truth))) {
        return;
    }
    for (int sampled = 0; sampled < (thin ? 1 : 2); sampled++) {
        if (!CHECK_OK(fm_octree_cast(octree, rays, RAYS, sampled ? -0.1f : 0, hits))) {
            return;
        }
        const outcome sum = compare(mesh, info.cell);
        printf("%-8s kind %d%s: %d holes and %d rays that met nothing of %d; off %.4f cells, cosine %.4f\n", name, (int)info.kind,
               sampled ? ", sampled" : "", sum.holes, sum.imagined, sum.smooth, sum.off / sum.both, sum.turned / sum.both);
        CHECK(sum.smooth > GROUPS / 10);
        CHECK(threshold == 0 || sum.off / sum.both < 0.6 * threshold);
        CHECK(sum.imagined <= (coarse ? 1 : 0));
        // Along edges that are few cells apart samples slip through; looking at cells as a whole does not.
        if (!coarse || (!sampled && info.kind == FM_OCTREE_CLOSEST)) {
            CHECK(sum.holes <= sum.smooth / (sampled || coarse ? 100 : 400));
            CHECK(sum.off / sum.both < (sampled || coarse ? 0.2 : 0.06));
            CHECK(sum.turned / sum.both < (sampled || coarse ? 0.2 : 0.03));
        }
    }
}

static void check_mesh(fm_context *context, const char *name, scene_mesh *scene, uint32_t size) {
    const fm_octree_desc descs[] = {{.size = size},
                                    {.size = size, .code = FM_OCTREE_OCTAHEDRAL, .method = FM_OCTREE_GROWN},
                                    {.size = size, .band = 0.1f},
                                    {.size = size, .band = 0.1f, .threshold = 0.2f, .share = true},
                                    {.size = size, .band = 0.1f, .threshold = 0.15f, .code = FM_OCTREE_SHORT},
                                    {.kind = FM_OCTREE_DISTANCE, .size = size},
                                    {.kind = FM_OCTREE_DISTANCE, .size = size, .band = 0.1f},
                                    {.kind = FM_OCTREE_BRICKS, .size = size}};
    const fm_mesh_desc desc = scene_mesh_describe(scene);
    fm_mesh *mesh = NULL;
    if (!CHECK_OK(fm_mesh_create(context, &desc, &mesh))) {
        return;
    }
    for (size_t i = 0; i < sizeof descs / sizeof *descs; i++) {
        fm_octree *octree = NULL;
        if (CHECK_OK(fm_octree_build_mesh(mesh, &descs[i], &octree))) {
            const bool thin = descs[i].band > 0, merged = thin && descs[i].kind == FM_OCTREE_CLOSEST;
            const double threshold = descs[i].threshold > 0 ? (double)descs[i].threshold : 0.05;
            check_octree(name, mesh, octree, size < 60, thin, merged ? threshold : 0);
        }
        fm_octree_destroy(octree);
    }
    fm_mesh_destroy(mesh);
}

int main(int count, char **arguments) {
    fm_context *context = NULL;
    int status;
    if (!vulkan_or_cpu(count, arguments, &context, &status)) {
        return status;
    }
    const float centre[3] = {0, 0, 0};
    scene_mesh ball = scene_mesh_sphere(40, 80, centre, 0.8f), tubes = scene_mesh_tubes(48, centre, 1.6f);
    scene_mesh ring = scene_mesh_torus(64, 32, centre, 0.6f, 0.2f);
    scene_mesh edges = scene_mesh_torus(12, 6, centre, 0.6f, 0.2f), waves = scene_mesh_sheet(12, centre, 1.6f, 0.5f);
    check_mesh(context, "ball", &ball, 90);
    check_mesh(context, "tubes", &tubes, 90);
    check_mesh(context, "ring", &ring, 90);
    check_mesh(context, "edges", &edges, 30);
    check_mesh(context, "waves", &waves, 30);
    scene_mesh_free(&ball);
    scene_mesh_free(&tubes);
    scene_mesh_free(&ring);
    scene_mesh_free(&edges);
    scene_mesh_free(&waves);
    vulkan_close(context);
    return check_summary();
}
