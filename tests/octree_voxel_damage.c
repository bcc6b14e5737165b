// SPDX-License-Identifier: MIT
// Octrees of voxels with words that are wrong: they are refused, or rays go through them without leaving their arrays (which
// sanitizers see: the arrays end where the octree does).

#include "octree/file.h"
#include "octree_voxels_common.h"

enum { TRIES = 3000, RAYS = 30 };

// As from a file: the arrays are exactly as long as they say.
static bool fit(fm_octree_array *array, void **memory) {
    *memory = malloc(array->count > 0 ? array->count * array->size : 1);
    if (!*memory) {
        return CHECK(false);
    }
    if (array->count > 0) {
        memcpy(*memory, array->data, array->count * array->size);
    }
    array->data = *memory;
    array->room = 0;
    return true;
}

// Another number, one near by, or another bit.
static uint32_t wrong(uint32_t word, uint64_t *seed) {
    switch (test_random(seed) % 4) {
    case 0:
        return (uint32_t)test_random(seed);
    case 1:
        return word + (uint32_t)test_between(seed, -9, 9);
    case 2:
        return (uint32_t)(test_random(seed) % 4096);
    default:
        return word ^ 1u << test_random(seed) % 32;
    }
}

static void cast_some(fm_octree *octree, const grid *g, uint64_t *seed) {
    fm_mesh_ray rays[RAYS];
    fm_octree_hit hits[RAYS];
    for (int i = 0; i < RAYS; i++) {
        rays[i] = (fm_mesh_ray){.last = INFINITY};
        grid_ray(g, seed, rays[i].origin, rays[i].direction);
    }
    CHECK_OK(fm_octree_cast(octree, rays, RAYS, 0, hits));
    for (int i = 0; i < RAYS; i++) {
        CHECK(!isnan(hits[i].t));
    }
}

static void check_kind(fm_context *context, grid *g, fm_octree_kind kind) {
    const fm_voxel_source source = grid_source(g, false);
    const fm_octree_desc desc = {.kind = kind, .top_bytes = 64};
    fm_octree *octree = NULL;
    if (!CHECK_OK(fm_octree_build_voxels(context, &source, &desc, &octree))) {
        return;
    }
    fm_octree copy = *octree;
    void *words = NULL, *values = NULL;
    uint64_t seed = kind;
    int taken = 0;
    if (fit(&copy.words, &words) && fit(&copy.values, &values)) {
        uint8_t *marks = calloc(fm_octree_marks(&copy), 1);
        CHECK_OK(fm_octree_validate(&copy, marks));
        cast_some(&copy, g, &seed);
        for (int i = 0; i < TRIES; i++) {
            uint32_t *word = (uint32_t *)words + test_random(&seed) % copy.words.count;
            const uint32_t was = *word;
            *word = wrong(was, &seed);
            memset(marks, 0, fm_octree_marks(&copy));
            if (fm_octree_validate(&copy, marks) == FM_OK) {
                cast_some(&copy, g, &seed);
                taken++;
            }
            *word = was;
        }
        free(marks);
    }
    printf("kind %d: %d of %d were taken\n", (int)kind, taken, TRIES);
    CHECK(taken > 0 && taken < TRIES);
    free(words);
    free(values);
    fm_octree_destroy(octree);
}

int main(void) {
    const fm_context_desc desc = {.backend = FM_BACKEND_CPU, .threads = 1};
    fm_context *context = NULL;
    if (!CHECK_OK(fm_context_create(&desc, &context))) {
        return check_summary();
    }
    grid g = grid_new(48, 40, 33);
    grid_random(&g, 0.02, 5, 2);
    for (int k = 0; k < GRID_KINDS; k++) {
        check_kind(context, &g, grid_kinds[k]);
    }
    free(g.voxels);
    fm_context_destroy(context);
    return check_summary();
}
