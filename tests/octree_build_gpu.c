// SPDX-License-Identifier: MIT
// Octrees that the device builds, beside those of the host: cells, leaves, memory, and what rays meet.

#include "fathom/octree.h"
#include "meshes.h"
#include "octree_build_common.h"
#include "vulkan_common.h"

#include <math.h>
#include <unistd.h>

enum { RAYS = 4000 };

typedef struct tally {
    const fm_octree *other;
    uint64_t leaves, alike, values, worse;
    double bounds;  // worst: how much farther the other's empty leaf says that the surface is, in cells
} tally;

static void compare_leaf(void *user, const fm_octree *octree, const tree_node *node) {
    tally *t = user;
    const double edge = (double)(1u << node->level);
    double middle[3];
    for (int axis = 0; axis < 3; axis++) {
        middle[axis] = (node->at[axis] + 0.5) * edge;
        if (node->at[axis] * edge >= octree->info.cells[axis]) {
            return;
        }
    }
    const tree_node there = tree_find(t->other, middle);
    const bool alike = there.level == node->level && tree_is_empty(&there) == tree_is_empty(node);
    t->leaves++;
    t->alike += alike;
    if (!alike) {
        return;
    }
    if (tree_is_empty(node)) {
        t->bounds = fmax(t->bounds, (tree_bound(t->other, &there) - tree_bound(octree, node)) / octree->info.cell);
        return;
    }
    for (uint32_t corner = 0; corner < 8; corner++) {
        const fm_v3 off = fm_less(tree_vector(octree, node, corner), tree_vector(t->other, &there, corner));
        t->values++;
        t->worse += (double)fm_dot(off, off) > pow(0.04 * edge * octree->info.cell, 2);
        if (octree->attributes.count > 0) {
            const uint32_t *own = (const uint32_t *)octree->attributes.data, *others = (const uint32_t *)t->other->attributes.data;
            t->worse += own[tree_value(node, corner)] != others[tree_value(&there, corner)] &&
                        (double)fm_dot(off, off) > pow(1e-4 * octree->info.cell, 2);
        }
    }
}

static void compare_counts(const fm_octree_info *own, const fm_octree_info *other) {
    const uint64_t bytes = own->node_bytes + own->leaf_bytes, others = other->node_bytes + other->leaf_bytes;
    CHECK(memcmp(own->cells, other->cells, sizeof own->cells) == 0 && own->levels == other->levels);
    CHECK(bytes <= others + others / 100 && others <= bytes + bytes / 100);
    CHECK(own->unshared_bytes > 0);
    CHECK(fabs(own->code_error - other->code_error) <= 0.1 * other->code_error + 1e-3);
    CHECK(own->gpu_ms > 0 && other->gpu_ms == 0);
}

static float random_of(uint64_t *seed, float low, float high) {
    return low + (high - low) * (float)tree_uniform(seed);
}

// Rays to places in the box, from around it.
static void make_rays(const fm_octree_info *info, fm_mesh_ray *rays) {
    uint64_t seed = 5;
    for (int i = 0; i < RAYS; i++) {
        rays[i] = (fm_mesh_ray){.last = INFINITY};
        for (int axis = 0; axis < 3; axis++) {
            const float low = info->low[axis], high = info->high[axis], size = high - low;
            rays[i].origin[axis] = axis == i % 3 ? low - size : random_of(&seed, low - size, high + size);
            rays[i].direction[axis] = random_of(&seed, low, high) - rays[i].origin[axis];
        }
    }
}

// The same arrays where the other octree is, so that what differs is the octrees.
static fm_octree *moved(const fm_octree *octree, fm_context *context) {
    fm_octree *copy = NULL;
    char path[64];
    snprintf(path, sizeof path, "octree_build_gpu.%d.fmo", (int)getpid());
    if (CHECK_OK(fm_octree_write(octree, path))) {
        CHECK_OK(fm_octree_read(context, path, &copy));
    }
    remove(path);
    return copy;
}

static void compare_hits(const fm_octree *built, fm_octree *other) {
    fm_octree *own = moved(built, other->context);
    if (!own) {
        return;
    }
    fm_mesh_ray *rays = calloc(RAYS, sizeof *rays);
    fm_octree_hit *hits = calloc(2 * (size_t)RAYS, sizeof *hits), *others = hits + RAYS;
    make_rays(&own->info, rays);
    int differ = 0, both = 0;
    if (CHECK_OK(fm_octree_cast(own, rays, RAYS, 0, hits)) && CHECK_OK(fm_octree_cast(other, rays, RAYS, 0, others))) {
        for (int i = 0; i < RAYS; i++) {
            double length2 = 0;
            for (int axis = 0; axis < 3; axis++) {
                length2 += pow((double)rays[i].direction[axis], 2);
            }
            both += hits[i].t < INFINITY && others[i].t < INFINITY;
            const bool near = fabs((double)hits[i].t - (double)others[i].t) * sqrt(length2) <= 0.05 * own->info.cell;
            differ += isinf(hits[i].t) ? !isinf(others[i].t) : !near;
        }
    }
    printf(", %d of %d rays differ, %d meet", differ, RAYS, both);
    CHECK(differ * 100 <= RAYS && both > RAYS / 50);
    fm_octree_destroy(own);
    free(rays);
    free(hits);
}

static void compare(fm_octree *own, fm_octree *other) {
    tally t = {.other = other};
    tree_leaves(own, compare_leaf, &t);
    compare_counts(&own->info, &other->info);
    CHECK((t.leaves - t.alike) * 200 <= t.leaves);
    CHECK(t.worse * 200 <= t.values && t.values > 0);
    printf("%llu of the greatest level, %llu of %llu leaves alike, %llu of %llu values worse, bounds less by %.2f cells, %llu and "
           "%llu bytes",
           (unsigned long long)own->info.leaves[4], (unsigned long long)t.alike, (unsigned long long)t.leaves,
           (unsigned long long)t.worse, (unsigned long long)t.values, t.bounds,
           (unsigned long long)(own->info.node_bytes + own->info.leaf_bytes),
           (unsigned long long)(other->info.node_bytes + other->info.leaf_bytes));
    compare_hits(own, other);
    printf("\n");
}

static fm_octree *build(fm_context *context, const scene_mesh *mesh, const fm_octree_desc *desc, fm_mesh **made) {
    const fm_mesh_desc what = scene_mesh_describe(mesh);
    fm_octree *octree = NULL;
    if (CHECK_OK(fm_mesh_create(context, &what, made))) {
        CHECK_OK(fm_octree_build_mesh(*made, desc, &octree));
    }
    return octree;
}

static void check_scene(fm_context *device, fm_context *host, const char *name, const scene_mesh *scene,
                        const fm_octree_desc *desc) {
    fm_mesh *meshes[2] = {0};
    fm_octree *own = build(device, scene, desc, &meshes[0]), *other = build(host, scene, desc, &meshes[1]);
    printf("%s, %u cells: ", name, desc->size);
    if (own && other) {
        compare(own, other);
        // Twice the same.
        fm_octree *again = NULL;
        CHECK_OK(fm_octree_build_mesh(meshes[0], desc, &again));
        CHECK(again && again->words.count == own->words.count &&
              memcmp(again->words.data, own->words.data, own->words.count * 4) == 0 &&
              memcmp(again->values.data, own->values.data, own->values.count * own->values.size) == 0);
        fm_octree_destroy(again);
    }
    fm_octree_destroy(own);
    fm_octree_destroy(other);
    fm_mesh_destroy(meshes[0]);
    fm_mesh_destroy(meshes[1]);
}

int main(int count, char **arguments) {
    static const float centre[3] = {0.1f, -0.2f, 0.3f}, low[3] = {-1, -0.5f, -0.25f}, high[3] = {1, 0.75f, 0.5f};
    vulkan_options options;
    fm_context *device = NULL, *host = NULL;
    if (!vulkan_parse(count, arguments, &options)) {
        return 2;
    }
    if (vulkan_open(&options, NULL, &device) != FM_OK) {
        return vulkan_missing();
    }
    CHECK_OK(fm_context_create(&(fm_context_desc){.backend = FM_BACKEND_CPU, .threads = 2}, &host));
    scene_mesh ball = scene_mesh_sphere(40, 80, centre, 1), box = scene_mesh_box(low, high),
               tubes = scene_mesh_tubes(48, centre, 2);
    scene_mesh soup = scene_mesh_soup(200, 3, centre, 2, 0.3f);
    // Boxes that no symmetry of what they hold suits: which of two places is nearer would be for rounding to tell.
    check_scene(device, host, "ball", &ball,
                &(fm_octree_desc){.size = 64, .low = {-1.13f, -1.41f, -0.87f}, .high = {1.27f, 1.02f, 1.46f}});
    check_scene(device, host, "ball in a small box", &ball,
                &(fm_octree_desc){.size = 40, .low = {0.03f, 0.07f, 0}, .high = {1.5f, 1, 1.2f}, .attribute = FM_OCTREE_TRIANGLE});
    check_scene(device, host, "box", &box,
                &(fm_octree_desc){.size = 140,
                                  .low = {-1.1357f, -0.7131f, -0.3419f},
                                  .high = {1.0917f, 0.87f, 0.59f},
                                  .code = FM_OCTREE_OCTAHEDRAL,
                                  .top_bytes = 1024,
                                  .band = 1});
    check_scene(
        device, host, "tubes", &tubes,
        &(fm_octree_desc){
            .size = 72, .low = {-1.03f, -1.41f, -0.17f}, .high = {1.27f, 0.92f, 0.86f}, .code = FM_OCTREE_FLOATS, .top_bytes = 64});
    check_scene(device, host, "soup", &soup, &(fm_octree_desc){.size = 48, .threshold = 0.2f, .share = true});
    scene_mesh_free(&ball);
    scene_mesh_free(&box);
    scene_mesh_free(&tubes);
    scene_mesh_free(&soup);
    fm_context_destroy(host);
    vulkan_close(device);
    return check_summary();
}
