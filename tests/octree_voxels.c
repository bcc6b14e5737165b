// SPDX-License-Identifier: MIT
// Octrees of voxels: every voxel read back, rays against the plainest march, arguments that are refused, memory that runs out.

#include "faulty.h"
#include "octree_voxels_common.h"
#include "vulkan_common.h"

enum { MOST_RAYS = 1000 };

static fm_context *context;
static bool device;

static fm_octree *build(grid *g, fm_octree_kind kind, bool air, uint64_t top_bytes) {
    const fm_voxel_source source = grid_source(g, air);
    const fm_octree_desc desc = {.kind = kind, .top_bytes = top_bytes};
    fm_octree *octree = NULL;
    CHECK_OK(fm_octree_build_voxels(context, &source, &desc, &octree));
    return octree;
}

static bool same_hit(const fm_octree *octree, const grid_hit *wanted, const fm_octree_hit *hit) {
    if (isinf(wanted->t) || isinf(hit->t)) {
        return isinf(wanted->t) && isinf(hit->t);
    }
    const double off = fabs((double)hit->t - wanted->t);
    const bool number = octree->info.kind == FM_OCTREE_DAG || hit->attribute == wanted->number;
    const bool face = wanted->axis == 3 || fabsf(hit->normal[wanted->axis]) == 1;
    return off <= 1e-4 * (1 + wanted->t) && number && face;
}

static void check_hits(const grid *g, const fm_octree *octree, const fm_mesh_ray *rays, const fm_octree_hit *hits, int count) {
    int doubtful = 0;
    for (int i = 0; i < count; i++) {
        const grid_hit wanted = grid_cast(g, rays[i].origin, rays[i].direction);
        if (same_hit(octree, &wanted, &hits[i])) {
            continue;
        }
        doubtful++;
        if (!CHECK(wanted.doubt < 1e-4)) {
            fprintf(stderr, "    kind %d, %u x %u x %u, ray %d: %g after %g (axis %d, number %u, %g from an edge)\n",
                    (int)octree->info.kind, g->shape[0], g->shape[1], g->shape[2], i, (double)hits[i].t, wanted.t, wanted.axis,
                    wanted.number, wanted.doubt);
            return;
        }
    }
    CHECK(doubtful <= 1 + count / 100);
}

// The reads of all rays.
static uint64_t check_rays(const grid *g, fm_octree *octree, int most, uint64_t seed) {
    static fm_mesh_ray rays[MOST_RAYS];
    static fm_octree_hit hits[MOST_RAYS];
    const bool air = grid_air((void *)g, &(fm_box){{0}, {g->shape[0], g->shape[1], g->shape[2]}});
    const int count = air && most > 20 ? 20 : most;
    for (int i = 0; i < count; i++) {
        rays[i] = (fm_mesh_ray){.last = INFINITY};
        grid_ray(g, &seed, rays[i].origin, rays[i].direction);
    }
    if (!CHECK_OK(fm_octree_cast(octree, rays, (uint32_t)count, 0, hits))) {
        return 0;
    }
    check_hits(g, octree, rays, hits, count);
    int met = 0;
    uint64_t reads = 0;
    for (int i = 0; i < count; i++) {
        met += !isinf(hits[i].t);
        reads += hits[i].reads;
    }
    CHECK(met > 0 || count < 100 || air);
    return reads;
}

static void check_all(grid *g, uint64_t top_bytes, int rays, uint64_t seed) {
    for (int k = 0; k < GRID_KINDS; k++) {
        for (int air = 0; air < 2; air++) {
            // A top grid as fine as it may be, and a coarse one.
            fm_octree *octree = build(g, grid_kinds[k], air, air ? top_bytes : 1 << 20);
            if (!octree) {
                continue;
            }
            if (!CHECK(grid_equal(g, octree))) {
                fprintf(stderr, "    kind %d, %u x %u x %u\n", (int)grid_kinds[k], g->shape[0], g->shape[1], g->shape[2]);
            }
            check_rays(g, octree, rays, seed);
            fm_octree_destroy(octree);
        }
    }
}

static void check_sizes(void) {
    for (uint32_t i = 0; i < 9 * 9 * 9; i += device ? 19 : 1) {
        grid g = grid_new(1 + i % 9, 1 + i / 9 % 9, 1 + i / 81);
        grid_random(&g, 0.3, 3, i);
        check_all(&g, 64, 8, i);
        free(g.voxels);
    }
}

static void check_shapes(void) {
    static const uint32_t shapes[][3] = {{70, 5, 3}, {1, 1, 200}, {33, 65, 17}, {64, 64, 64}, {100, 40, 70}, {16, 130, 9}};
    static const double densities[] = {0, 0.001, 0.02, 0.5, 1};
    for (size_t s = 0; s < sizeof shapes / sizeof *shapes; s++) {
        for (size_t d = 0; d < sizeof densities / sizeof *densities; d++) {
            grid g = grid_new(shapes[s][0], shapes[s][1], shapes[s][2]);
            grid_random(&g, densities[d], d == 4 ? 1 : 2, s + 10 * d);
            check_all(&g, d == 1 ? 1 : 256, 500, s);
            free(g.voxels);
        }
    }
}

static void check_walls(void) {
    grid g = grid_new(80, 72, 64);
    for (uint32_t i = 0; i < 64; i++) {
        for (uint32_t j = 0; j < 64; j++) {
            *grid_at(&g, i, j, 33) = 1 + (i + j) % 2;
        }
    }
    check_all(&g, 64, 1000, 5);
    memset(g.voxels, 0, grid_count(&g) * sizeof *g.voxels);
    for (int corner = 0; corner < 8; corner++) {
        *grid_at(&g, corner & 1 ? 79 : 0, corner & 2 ? 71 : 0, corner & 4 ? 63 : 0) = 1 + (uint32_t)corner;
    }
    check_all(&g, 64, 1000, 6);
    free(g.voxels);
}

// Planes that cut cells change what rays read and not what they meet.
static void check_contours(void) {
    grid g = grid_new(100, 90, 64);
    for (uint32_t i = 0; i < 100; i++) {
        for (uint32_t j = 0; j < 90; j++) {
            *grid_at(&g, i, j, 33) = 1 + (i + j) % 2;
        }
    }
    const fm_voxel_source source = grid_source(&g, false);
    uint64_t reads[2] = {0}, bytes[2] = {0};
    for (int without = 0; without < 2; without++) {
        const fm_octree_desc desc = {.kind = FM_OCTREE_CONTOURS, .threshold = without ? -1 : 0, .top_bytes = 64};
        fm_octree *octree = NULL;
        if (!CHECK_OK(fm_octree_build_voxels(context, &source, &desc, &octree))) {
            break;
        }
        reads[without] = check_rays(&g, octree, MOST_RAYS, 3);
        bytes[without] = octree->info.node_bytes;
        fm_octree_destroy(octree);
    }
    CHECK(reads[0] < reads[1] && bytes[0] > bytes[1]);
    free(g.voxels);
}

static void check_counts(void) {
    grid g = grid_new(64, 64, 64);
    for (uint64_t i = 0; i < grid_count(&g); i++) {
        g.voxels[i] = 5;
    }
    *grid_at(&g, 0, 0, 0) = 0;
    for (int k = 0; k < GRID_KINDS; k++) {
        fm_octree *octree = build(&g, grid_kinds[k], false, 1);
        if (octree) {
            uint64_t voxels = 0;
            for (int level = 0; level <= 20; level++) {
                voxels += octree->info.leaves[level] << 3 * level;
            }
            CHECK(voxels == 64 * 64 * 64 - 1);
            CHECK(octree->info.node_bytes > 0 && octree->info.node_bytes < 4096);
            fm_octree_destroy(octree);
        }
    }
    free(g.voxels);
}

static void check_arguments(void) {
    grid g = grid_new(4, 4, 4);
    fm_voxel_source source = grid_source(&g, false);
    fm_octree_desc desc = {.kind = FM_OCTREE_VOXELS};
    fm_octree *octree = NULL;
    CHECK_FAILS(fm_octree_build_voxels(NULL, &source, &desc, &octree), FM_ERROR_INVALID_ARGUMENT);
    CHECK_FAILS(fm_octree_build_voxels(context, NULL, &desc, &octree), FM_ERROR_INVALID_ARGUMENT);
    CHECK_FAILS(fm_octree_build_voxels(context, &source, &desc, NULL), FM_ERROR_INVALID_ARGUMENT);
    CHECK_FAILS(fm_octree_build_voxels(context, &source, NULL, &octree), FM_ERROR_UNSUPPORTED);
    CHECK(strstr(fm_last_error(), "kind is FM_OCTREE_CLOSEST") != NULL);
    source.shape[1] = 0;
    CHECK_FAILS(fm_octree_build_voxels(context, &source, &desc, &octree), FM_ERROR_INVALID_ARGUMENT);
    source.shape[1] = (1 << 20) + 1;
    CHECK_FAILS(fm_octree_build_voxels(context, &source, &desc, &octree), FM_ERROR_INVALID_ARGUMENT);
    source.shape[1] = 4;
    g.reads_left = 0;
    CHECK_FAILS(fm_octree_build_voxels(context, &source, &desc, &octree), FM_ERROR_IO);
    CHECK(octree == NULL);
    free(g.voxels);
}

static fm_result attempt_build(fm_context *faulty_context, void *user) {
    const fm_voxel_source source = grid_source(user, false);
    for (int k = 0; k < GRID_KINDS; k++) {
        fm_octree *octree = NULL;
        FM_TRY(fm_octree_build_voxels(faulty_context, &source, &(fm_octree_desc){.kind = grid_kinds[k]}, &octree));
        fm_octree_destroy(octree);
    }
    return FM_OK;
}

static bool open_context(const vulkan_options *options) {
    const fm_context_desc desc = {.backend = FM_BACKEND_CPU, .threads = 1};
    return (device ? vulkan_open(options, NULL, &context) : fm_context_create(&desc, &context)) == FM_OK;
}

int main(int count, char **arguments) {
    vulkan_options options;
    if (!vulkan_parse(count, arguments, &options)) {
        return 2;
    }
    device = count > 1;
    if (!open_context(&options)) {
        return device ? vulkan_missing() : 1;
    }
    check_sizes();
    check_shapes();
    check_walls();
    check_contours();
    check_counts();
    check_arguments();
    if (!device) {
        grid g = grid_new(40, 40, 40);
        grid_random(&g, 0.2, 9, 1);
        exhaust("octrees of voxels", attempt_build, &g, -1);
        free(g.voxels);
    }
    vulkan_close(context);
    return check_summary();
}
