// SPDX-License-Identifier: MIT
// What the real meshes of others are, against the figures of their README, which other programs computed.

#include "fathom/mesh_io.h"
#include "io_common.h"

typedef struct figures {
    const char *name;
    uint64_t distinct, unused, boundary, non_manifold, misoriented, components;
    uint64_t degenerate, duplicate;
    bool closed;
    // The README counts pairs of triangles with an area. Those with a triangle without are more, and are ours.
    uint64_t pairs, flat_pairs;
} figures;

static const figures meshes[] = {
    {"stanford_bunny_zipper.ply", 34834, 1113, 223, 0, 0, 1, 0, 0, false, 0, 0},
    {"armadillo.obj", 43243, 0, 0, 0, 0, 1, 0, 0, true, 0, 0},
    {"spot.obj", 2930, 0, 0, 0, 0, 1, 0, 0, true, 0, 0},
    {"scorpion.obj", 49997, 0, 0, 0, 0, 1, 0, 0, true, 4, 0},
    {"cloth_open_sheet.ply", 58081, 0, 960, 0, 0, 1, 0, 0, false, 0, 0},
    {"dungeon_open.obj", 5101, 0, 432, 138, 0, 9, 0, 0, false, 655, 0},
    {"self_intersect.obj", 8582, 0, 0, 0, 0, 1, 0, 0, true, 338, 0},
    {"nonmanifold_small.obj", 657, 0, 0, 18, 0, 1, 1, 3, false, 6593, 7},
    {"pine_tree_thin.ply", 1397, 0, 980, 0, 0, 82, 0, 0, false, 984, 0},
    // 214 of the triangles without area name a corner twice, as the README counts; five have three corners on a line.
    {"country_kitchen_1m.ply", 517499, 0, 12758, 256, 90, 459, 219, 6, false, 28265, 29},
};

static const char *folder;

static void check_mesh(fm_context *context, const figures *expected) {
    char path[512];
    fm_mesh *mesh = NULL;
    fm_mesh_info info = {0};
    uint64_t pairs = 0;
    snprintf(path, sizeof path, "%s/meshes/%s", folder, expected->name);
    if (!CHECK_OK(fm_mesh_read(context, path, NULL, &mesh, NULL))) {
        return;
    }
    CHECK_OK(fm_mesh_describe(mesh, &info));
    CHECK_OK(fm_mesh_intersections(mesh, 0, &pairs));
    const bool good = CHECK(info.distinct == expected->distinct) && CHECK(info.unused == expected->unused) &&
                      CHECK(info.boundary == expected->boundary) && CHECK(info.non_manifold == expected->non_manifold) &&
                      CHECK(info.misoriented == expected->misoriented) && CHECK(info.components == expected->components) &&
                      CHECK(info.degenerate == expected->degenerate) && CHECK(info.duplicate == expected->duplicate) &&
                      CHECK(info.closed == expected->closed) && CHECK(info.dropped == 0) &&
                      CHECK((info.volume != 0) == expected->closed) && CHECK(pairs == expected->pairs + expected->flat_pairs);
    if (!good) {
        fprintf(stderr, "    %s\n", expected->name);
    }
    fm_mesh_destroy(mesh);
}

int main(void) {
    folder = getenv("FATHOM_DATA");
    if (!folder || !folder[0]) {
        folder = io_exists("data") ? "data" : "../shared/data";
    }
    char path[512];
    snprintf(path, sizeof path, "%s/meshes/spot.obj", folder);
    if (!io_exists(path)) {
        return check_skip("the meshes of other people are not here (to test with them, name their folder in the environment "
                          "variable FATHOM_DATA)");
    }
    fm_context *context = NULL;
    if (CHECK_OK(fm_context_create(&(fm_context_desc){.backend = FM_BACKEND_CPU}, &context))) {
        for (size_t i = 0; i < sizeof meshes / sizeof meshes[0]; i++) {
            check_mesh(context, &meshes[i]);
        }
    }
    fm_context_destroy(context);
    return check_summary();
}
