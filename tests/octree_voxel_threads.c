// SPDX-License-Identifier: MIT
// Octrees of voxels built by many threads: the same bytes and the same numbers as those that one thread builds, and its errors.

#include "fathom/world.h"
#include "meshes.h"
#include "octree_voxels_common.h"

#include <stdatomic.h>

static const uint32_t threads[] = {1, 2, 3, 7};
enum { CONTEXTS = sizeof threads / sizeof *threads };

static fm_context *contexts[CONTEXTS];

static bool same_array(const fm_octree_array *a, const fm_octree_array *b) {
    return a->count == b->count && (a->count == 0 || memcmp(a->data, b->data, a->count * a->size) == 0);
}

static bool same_octree(const fm_octree *a, const fm_octree *b) {
    return same_array(&a->words, &b->words) && same_array(&a->values, &b->values) &&
           memcmp(a->info.leaves, b->info.leaves, sizeof a->info.leaves) == 0 && a->info.empty == b->info.empty &&
           a->info.internal == b->info.internal && a->info.unshared_bytes == b->info.unshared_bytes;
}

// Builds with each context, and holds all against the first.
typedef fm_result (*build_fn)(fm_context *context, const void *what, const fm_octree_desc *desc, fm_octree **octree);

static void check_build(const char *name, build_fn build, const void *what, const fm_octree_desc *desc) {
    fm_octree *octrees[CONTEXTS] = {NULL};
    for (int i = 0; i < CONTEXTS; i++) {
        if (CHECK_OK(build(contexts[i], what, desc, &octrees[i])) && octrees[0] && !CHECK(same_octree(octrees[0], octrees[i]))) {
            fprintf(stderr, "    %s, kind %d, size %u, %u threads: %llu words and not %llu\n", name, (int)desc->kind, desc->size,
                    threads[i], (unsigned long long)octrees[i]->words.count, (unsigned long long)octrees[0]->words.count);
        }
    }
    for (int i = 0; i < CONTEXTS; i++) {
        fm_octree_destroy(octrees[i]);
    }
}

static fm_result build_source(fm_context *context, const void *what, const fm_octree_desc *desc, fm_octree **octree) {
    return fm_octree_build_voxels(context, what, desc, octree);
}

static fm_result build_world(fm_context *context, const void *what, const fm_octree_desc *desc, fm_octree **octree) {
    const grid *g = what;
    const fm_world_desc described = {.shape = {g->shape[0], g->shape[1], g->shape[2]}};
    const fm_box all = {.end = {g->shape[0], g->shape[1], g->shape[2]}};
    fm_world *world = NULL;
    FM_TRY(fm_world_create(context, &described, &world));
    fm_result result = fm_world_write(world, &all, g->voxels);
    result = result == FM_OK ? fm_octree_build_world(world, desc, octree) : result;
    fm_world_destroy(world);
    return result;
}

static fm_result build_mesh(fm_context *context, const void *what, const fm_octree_desc *desc, fm_octree **octree) {
    fm_mesh *mesh = NULL;
    FM_TRY(fm_mesh_create(context, what, &mesh));
    const fm_result result = fm_octree_build_mesh(mesh, desc, octree);
    fm_mesh_destroy(mesh);
    return result;
}

// A solid block, scattered voxels of several numbers, and much air.
static void fill(grid *g, uint64_t seed) {
    for (uint32_t z = 20; z < 100 && z < g->shape[2]; z++) {
        for (uint32_t y = 30; y < 90 && y < g->shape[1]; y++) {
            for (uint32_t x = 40; x < 120 && x < g->shape[0]; x++) {
                *grid_at(g, x, y, z) = 5 + (x / 16 + z / 32) % 2;
            }
        }
    }
    for (int i = 0; i < 4000; i++) {
        const uint64_t at = test_random(&seed);
        *grid_at(g, (int64_t)(at % g->shape[0]), (int64_t)(at / 1000 % g->shape[1]), (int64_t)(at / 1000000 % g->shape[2])) =
            1 + (uint32_t)(at >> 61);
    }
}

static void check_sources(void) {
    static const uint32_t shapes[][3] = {{200, 130, 140}, {64, 64, 65}, {300, 20, 70}, {63, 10, 64}};
    static const uint64_t tops[] = {1 << 20, 0, 4};
    for (size_t s = 0; s < sizeof shapes / sizeof *shapes; s++) {
        grid g = grid_new(shapes[s][0], shapes[s][1], shapes[s][2]);
        fill(&g, s);
        for (int k = 0; k < GRID_KINDS; k++) {
            for (size_t t = 0; t < sizeof tops / sizeof *tops; t++) {
                const fm_octree_desc desc = {.kind = grid_kinds[k], .top_bytes = tops[t]};
                fm_voxel_source source = grid_source(&g, t != 1);
                source.concurrent = t != 0;
                check_build("a source", build_source, &source, &desc);
                check_build("a world", build_world, &g, &desc);
            }
        }
        free(g.voxels);
    }
}

static void check_meshes(void) {
    const float middle[3] = {0.1f, 0.2f, 0};
    scene_mesh fine = scene_mesh_torus(60, 200, middle, 0.9f, 0.35f), coarse = scene_mesh_torus(5, 7, middle, 0.9f, 0.35f);
    const scene_mesh *const meshes[] = {&fine, &coarse};
    for (int m = 0; m < 2; m++) {
        const fm_mesh_desc described = scene_mesh_describe(meshes[m]);
        for (int k = 0; k < GRID_KINDS; k++) {
            check_build("a mesh", build_mesh, &described, &(fm_octree_desc){.kind = grid_kinds[k], .size = 150});
            const bool colorless = grid_kinds[k] == FM_OCTREE_DAG;
            check_build("a mesh", build_mesh, &described,
                        &(fm_octree_desc){.kind = grid_kinds[k],
                                          .size = 260,
                                          .attribute = colorless ? FM_OCTREE_PLAIN : FM_OCTREE_TRIANGLE,
                                          .top_bytes = 64,
                                          .threshold = -1});
        }
    }
    scene_mesh_free(&fine);
    scene_mesh_free(&coarse);
}

// A read that fails, whichever thread does it.
typedef struct broken {
    atomic_int left;
} broken;

static fm_result read_broken(void *user, const fm_box *box, uint32_t *voxels) {
    broken *b = user;
    if (atomic_fetch_sub(&b->left, 1) <= 0) {
        return FM_ERROR_IO;
    }
    memset(voxels, box->begin[0] % 128 == 0,
           (size_t)((box->end[0] - box->begin[0]) * (box->end[1] - box->begin[1]) * (box->end[2] - box->begin[2]) * 4));
    return FM_OK;
}

static void check_broken(void) {
    for (int i = 0; i < CONTEXTS; i++) {
        for (int left = 0; left < 12; left += 5) {
            for (int concurrent = 0; concurrent < 2; concurrent++) {
                broken what = {left};
                const fm_voxel_source source = {
                    .user = &what, .shape = {256, 256, 64}, .read = read_broken, .concurrent = concurrent != 0};
                fm_octree *octree = NULL;
                CHECK(fm_octree_build_voxels(contexts[i], &source, &(fm_octree_desc){.kind = FM_OCTREE_DAG}, &octree) ==
                      FM_ERROR_IO);
                CHECK(octree == NULL);
            }
        }
    }
}

int main(void) {
    for (int i = 0; i < CONTEXTS; i++) {
        const fm_context_desc desc = {.backend = FM_BACKEND_CPU, .threads = threads[i]};
        if (!CHECK_OK(fm_context_create(&desc, &contexts[i]))) {
            return check_summary();
        }
    }
    check_sources();
    check_meshes();
    check_broken();
    for (int i = 0; i < CONTEXTS; i++) {
        fm_context_destroy(contexts[i]);
    }
    return check_summary();
}
