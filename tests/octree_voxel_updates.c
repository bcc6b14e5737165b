// SPDX-License-Identifier: MIT
// Octrees of voxels that change: after every edit they are what a build from scratch would be. Worlds, too.

#include "faulty.h"
#include "octree_voxels_common.h"
#include "vulkan_common.h"
#include "world_common.h"

#include <unistd.h>

enum { RAYS = 200 };

static fm_context *context;
static bool device;

static fm_octree *build(grid *g, fm_octree_kind kind) {
    const fm_voxel_source source = grid_source(g, false);
    const fm_octree_desc desc = {.kind = kind, .top_bytes = 256};
    fm_octree *octree = NULL;
    CHECK_OK(fm_octree_build_voxels(context, &source, &desc, &octree));
    return octree;
}

// The counts are those of a fresh build; the arrays may hold more.
static void check_counts(const fm_octree *octree, const fm_octree *fresh) {
    CHECK(memcmp(octree->info.leaves, fresh->info.leaves, sizeof fresh->info.leaves) == 0);
    CHECK(octree->info.empty == fresh->info.empty);
    CHECK(octree->info.kind == FM_OCTREE_DAG || octree->info.internal == fresh->info.internal);
    CHECK(octree->info.kind != FM_OCTREE_DAG || octree->info.unshared_bytes == fresh->info.unshared_bytes);
    CHECK(octree->info.node_bytes >= fresh->info.node_bytes);
}

static void check_rays(const grid *g, fm_octree *octree, fm_octree *fresh, uint64_t seed) {
    fm_mesh_ray rays[RAYS];
    fm_octree_hit hits[2][RAYS];
    for (int i = 0; i < RAYS; i++) {
        rays[i] = (fm_mesh_ray){.last = INFINITY};
        grid_ray(g, &seed, rays[i].origin, rays[i].direction);
    }
    if (CHECK_OK(fm_octree_cast(octree, rays, RAYS, 0, hits[0])) && CHECK_OK(fm_octree_cast(fresh, rays, RAYS, 0, hits[1]))) {
        for (int i = 0; i < RAYS; i++) {
            CHECK(hits[0][i].t == hits[1][i].t && hits[0][i].attribute == hits[1][i].attribute);
        }
    }
}

// What a fresh build of the same voxels says.
static void check_same(grid *g, fm_octree *octree, uint64_t seed) {
    fm_octree *fresh = build(g, octree->info.kind);
    if (fresh) {
        CHECK(grid_equal(g, octree));
        check_counts(octree, fresh);
        check_rays(g, octree, fresh, seed);
    }
    fm_octree_destroy(fresh);
}

// A ball or a box of air or of solid voxels; the box that it touches.
static fm_box edit(grid *g, uint64_t *seed) {
    const fm_shape shape = {g->shape[0], g->shape[1], g->shape[2]};
    fm_brush brush = {.kind = test_random(seed) % 3 == 0 ? FM_BRUSH_BOX : FM_BRUSH_SPHERE,
                      .voxel = (uint32_t)(test_random(seed) % 3),
                      .radius = (uint32_t)(test_random(seed) % 17)};
    int32_t begin[3], end[3];
    fm_box box;
    for (int i = 0; i < 3; i++) {
        brush.from[i] = test_between(seed, -4, (int32_t)g->shape[i] + 4);
        brush.to[i] = brush.from[i] + test_between(seed, 0, 20);
    }
    world_brush_edit(&brush, shape, g->voxels);
    world_brush_box(&brush, shape, begin, end);
    for (int i = 0; i < 3; i++) {
        box.begin[i] = begin[i];
        box.end[i] = end[i];
    }
    return box;
}

static void check_edits(fm_octree_kind kind, uint32_t x, uint32_t y, uint32_t z, int edits) {
    grid g = grid_new(x, y, z);
    grid_random(&g, 0.2, 3, 3);
    fm_octree *octree = build(&g, kind);
    const fm_voxel_source source = grid_source(&g, false);
    uint64_t seed = kind;
    uint64_t most = 0;
    bool shrunk = false;
    for (int i = 0; i < edits && octree; i++) {
        fm_box boxes[3];
        const uint32_t count = 1 + (uint32_t)(test_random(&seed) % 3);
        for (uint32_t k = 0; k < count; k++) {
            boxes[k] = edit(&g, &seed);
        }
        if (!CHECK_OK(fm_octree_update_voxels(octree, &source, boxes, count))) {
            break;
        }
        const uint64_t bytes = octree->info.node_bytes + octree->info.leaf_bytes;
        shrunk = shrunk || bytes < most / 3 * 2;
        most = most > bytes ? most : bytes;
        if (i % (device ? 3 : 32) == 2 || i < 4) {
            check_same(&g, octree, seed);
        }
    }
    CHECK(shrunk || edits < 100);
    fm_octree_destroy(octree);
    free(g.voxels);
}

static void check_failing(fm_octree_kind kind) {
    grid g = grid_new(50, 60, 70);
    grid_random(&g, 0.3, 3, 3);
    grid before = grid_new(50, 60, 70);
    memcpy(before.voxels, g.voxels, grid_count(&g) * sizeof *g.voxels);
    fm_octree *octree = build(&g, kind);
    const fm_voxel_source source = grid_source(&g, false);
    // Nowhere all of a cell of the top grid, which would be read at once.
    const fm_box all = {{-5, 0, 0}, {50, 60, 90}}, most = {{-5, 1, 0}, {50, 60, 90}};
    uint64_t seed = 7;
    edit(&g, &seed);
    for (int reads = 0; reads < 8 && octree; reads++) {
        g.reads_left = reads;
        CHECK_FAILS(fm_octree_update_voxels(octree, &source, &most, 1), FM_ERROR_IO);
        CHECK(grid_equal(&before, octree));
    }
    if (octree) {
        check_same(&before, octree, 1);
        g.reads_left = -1;
        CHECK_OK(fm_octree_update_voxels(octree, &source, &all, 1));
        check_same(&g, octree, 2);
        const fm_box none = {{5, 5, 5}, {5, 9, 9}};
        CHECK_OK(fm_octree_update_voxels(octree, &source, &none, 1));
        CHECK_OK(fm_octree_update_voxels(octree, &source, NULL, 0));
        CHECK_FAILS(fm_octree_update_voxels(octree, &source, NULL, 1), FM_ERROR_INVALID_ARGUMENT);
        fm_voxel_source other = source;
        other.shape[2]++;
        CHECK_FAILS(fm_octree_update_voxels(octree, &other, &all, 1), FM_ERROR_INVALID_ARGUMENT);
    }
    fm_octree_destroy(octree);
    free(before.voxels);
    free(g.voxels);
}

// Of cells that a box holds as a whole `air` is asked, and they are read as those of a build are.
static void check_whole(fm_octree_kind kind) {
    enum { EDGE = 128, TOPS = 64 };
    grid g = grid_new(EDGE, EDGE, EDGE);
    grid_random(&g, 0.01, 3, 3);
    fm_octree *octree = build(&g, kind);
    const fm_voxel_source asked = grid_source(&g, true), read = grid_source(&g, false);
    const fm_box all = {{0, 0, 0}, {EDGE, EDGE, EDGE}};
    memset(g.voxels, 0, grid_count(&g) * sizeof *g.voxels);
    g.reads_left = 0;
    if (octree && CHECK_OK(fm_octree_update_voxels(octree, &asked, &all, 1))) {
        g.reads_left = -1;
        check_same(&g, octree, 1);
    }
    for (uint64_t i = 0; i < grid_count(&g); i++) {
        g.voxels[i] = 5;
    }
    g.reads_left = TOPS;
    if (octree && CHECK_OK(fm_octree_update_voxels(octree, &read, &all, 1))) {
        g.reads_left = -1;
        check_same(&g, octree, 2);
    }
    fm_octree_destroy(octree);
    free(g.voxels);
}

// One from a file takes updates, too, and leaves the file alone.
static void check_file(fm_octree_kind kind) {
    char path[] = "/tmp/fathom_octree_XXXXXX";
    const int file = mkstemp(path);
    grid g = grid_new(40, 50, 60);
    grid_random(&g, 0.2, 3, 9);
    fm_octree *octree = build(&g, kind), *read = NULL, *again = NULL;
    uint64_t seed = 5;
    if (CHECK(file >= 0) && octree && CHECK_OK(fm_octree_write(octree, path)) && CHECK_OK(fm_octree_read(context, path, &read))) {
        grid before = grid_new(40, 50, 60);
        memcpy(before.voxels, g.voxels, grid_count(&g) * sizeof *g.voxels);
        const fm_voxel_source source = grid_source(&g, false);
        for (int i = 0; i < 3; i++) {
            const fm_box box = edit(&g, &seed);
            CHECK_OK(fm_octree_update_voxels(read, &source, &box, 1));
            check_same(&g, read, seed);
        }
        CHECK(CHECK_OK(fm_octree_read(context, path, &again)) && grid_equal(&before, again));
        free(before.voxels);
    }
    fm_octree_destroy(again);
    fm_octree_destroy(read);
    fm_octree_destroy(octree);
    free(g.voxels);
    if (file >= 0) {
        close(file);
        unlink(path);
    }
}

static void set_leaf(grid *g, uint32_t x, uint32_t y, uint32_t z, uint32_t low, uint32_t high) {
    for (uint32_t i = 0; i < 64; i++) {
        *grid_at(g, x + i % 4, y + i / 4 % 4, z + i / 16) = (i < 32 ? low >> i : high >> (i - 32)) & 1;
    }
}

// A leaf of a DAG whose words are those of a node with one child, which begins where the leaf's upper voxels say. The copy that the
// first update of what was read makes moves the child, but not the voxels.
static void check_alike(void) {
    char path[] = "/tmp/fathom_octree_XXXXXX";
    const int file = mkstemp(path);
    grid g = grid_new(64, 64, 64);
    const fm_voxel_source source = grid_source(&g, false);
    for (uint32_t i = 0; i < 8; i++) {
        set_leaf(&g, 8 * i, 32, 32, 0x1234567u * (i + 1), 0x7654321u * (i + 3));
    }
    fm_octree *octree = build(&g, FM_OCTREE_DAG), *read = NULL;
    const uint32_t next = octree ? (uint32_t)octree->words.count : 0;
    const fm_box boxes[] = {{{0, 0, 0}, {8, 8, 8}}, {{16, 0, 0}, {24, 8, 8}}, {{40, 40, 0}, {41, 41, 1}}};
    set_leaf(&g, 0, 0, 0, 0xdeadbeef, 0x600df00d);
    bool good = octree && CHECK(file >= 0) && CHECK_OK(fm_octree_update_voxels(octree, &source, &boxes[0], 1));
    set_leaf(&g, 16, 0, 0, 1, next);
    good = good && CHECK_OK(fm_octree_update_voxels(octree, &source, &boxes[1], 1)) && CHECK(grid_equal(&g, octree));
    if (good && CHECK_OK(fm_octree_write(octree, path)) && CHECK_OK(fm_octree_read(context, path, &read))) {
        CHECK_OK(fm_octree_update_voxels(read, &source, &boxes[2], 1));
        CHECK(grid_equal(&g, read));
    }
    fm_octree_destroy(read);
    fm_octree_destroy(octree);
    free(g.voxels);
    close(file);
    unlink(path);
}

// Memory that runs out in an update leaves the octree as it was.
static fm_result attempt_update(fm_context *faulty_context, void *user) {
    static const fm_box all = {{0, 0, 0}, {40, 40, 40}};
    grid *g = user;
    const fm_voxel_source source = grid_source(g, false);
    for (int k = 0; k < GRID_KINDS; k++) {
        grid_random(g, 0.1, 3, 1);
        fm_octree *octree = NULL;
        FM_TRY(fm_octree_build_voxels(faulty_context, &source, &(fm_octree_desc){.kind = grid_kinds[k]}, &octree));
        grid after = grid_new(40, 40, 40);
        grid_random(&after, 0.3, 3, 2);
        const fm_voxel_source other = grid_source(&after, false);
        const fm_result result = fm_octree_update_voxels(octree, &other, &all, 1);
        CHECK(grid_equal(result == FM_OK ? &after : g, octree));
        fm_octree_destroy(octree);
        free(after.voxels);
        FM_TRY(result);
    }
    return FM_OK;
}

// A world and an octree of it; what is edited is read back.
static void check_world(fm_octree_kind kind) {
    const fm_world_desc desc = {.shape = {90, 70, 75}, .format = FM_FIELD_SPLIT_U16};
    grid g = grid_new(desc.shape.x, desc.shape.y, desc.shape.z);
    fm_world *world = NULL;
    fm_octree *octree = NULL;
    const fm_octree_desc wanted = {.kind = kind};
    uint64_t seed = 11;
    bool good = CHECK_OK(fm_world_create(context, &desc, &world)) && CHECK_OK(fm_octree_build_world(world, &wanted, &octree));
    for (int i = 0; i < 6 && good; i++) {
        const fm_brush brush = {.voxel = i % 3 == 2 ? 0 : 40 + (uint32_t)i,
                                .radius = 1u << (i % 5),
                                .from = {test_between(&seed, 0, 89), test_between(&seed, 0, 69), test_between(&seed, 0, 74)}};
        int32_t begin[3], end[3];
        world_brush_edit(&brush, desc.shape, g.voxels);
        world_brush_box(&brush, desc.shape, begin, end);
        const fm_box box = {{begin[0], begin[1], begin[2]}, {end[0], end[1], end[2]}};
        good = CHECK_OK(fm_world_edit(world, &brush, 1)) && CHECK_OK(fm_world_update(world, NULL)) &&
               CHECK_OK(fm_octree_update_world(octree, world, &box, 1));
        CHECK(good && grid_equal(&g, octree));
    }
    fm_octree *fresh = NULL;
    if (good && CHECK_OK(fm_octree_build_world(world, &wanted, &fresh))) {
        CHECK(grid_equal(&g, fresh));
        check_counts(octree, fresh);
        check_rays(&g, octree, fresh, 5);
    }
    CHECK_FAILS(fm_octree_update_world(octree, NULL, NULL, 0), FM_ERROR_INVALID_ARGUMENT);
    CHECK_FAILS(fm_octree_build_world(NULL, &wanted, &fresh), FM_ERROR_INVALID_ARGUMENT);
    fm_octree_destroy(fresh);
    fm_octree_destroy(octree);
    fm_world_destroy(world);
    free(g.voxels);
}

int main(int count, char **arguments) {
    const fm_context_desc desc = {.backend = FM_BACKEND_CPU, .threads = 1};
    vulkan_options options;
    if (!vulkan_parse(count, arguments, &options)) {
        return 2;
    }
    device = count > 1;
    if ((device ? vulkan_open(&options, NULL, &context) : fm_context_create(&desc, &context)) != FM_OK) {
        return device ? vulkan_missing() : 1;
    }
    for (int k = 0; k < GRID_KINDS; k++) {
        check_edits(grid_kinds[k], 64, 48, 80, device ? 20 : 500);
        check_edits(grid_kinds[k], 5, 130, 9, device ? 4 : 20);
        check_failing(grid_kinds[k]);
        check_whole(grid_kinds[k]);
        check_world(grid_kinds[k]);
        check_file(grid_kinds[k]);
    }
    check_alike();
    if (!device) {
        grid g = grid_new(40, 40, 40);
        exhaust("updates of octrees", attempt_update, &g, -1);
        free(g.voxels);
    }
    vulkan_close(context);
    return check_summary();
}
