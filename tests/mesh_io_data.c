// SPDX-License-Identifier: MIT

// Real meshes against the figures that come with them.

#include "io_common.h"
#include "mesh_io_common.h"

enum { UNTOLD = -1 };

static const struct {
    const char *name;
    fm_mesh_format format;
    int64_t vertices, distinct, unused, triangles;
    int64_t boundary, non_manifold, misoriented, degenerate, duplicate, components;
    bool closed;
    uint64_t pairs;
} rows[] = {
    {"stanford_bunny_zipper.ply", FM_MESH_FORMAT_PLY, 35947, 35947 - 1113, 1113, 69451, 223, 0, 0, UNTOLD, 0, UNTOLD, false, 0},
    {"armadillo.obj", FM_MESH_FORMAT_OBJ, 43243, 43243, 0, 86482, 0, 0, 0, UNTOLD, 0, 1, true, 0},
    {"spot.obj", FM_MESH_FORMAT_OBJ, 2930, 2930, 0, 5856, 0, 0, 0, UNTOLD, 0, UNTOLD, true, 0},
    {"scorpion.obj", FM_MESH_FORMAT_OBJ, 49997, 49997, 0, 99990, 0, 0, 0, UNTOLD, 0, UNTOLD, true, 4},
    {"cloth_open_sheet.ply", FM_MESH_FORMAT_PLY, 58081, 58081, 0, 115200, 960, 0, 0, UNTOLD, 0, 1, false, 0},
    {"country_kitchen_1m.ply", FM_MESH_FORMAT_PLY, 517499, UNTOLD, UNTOLD, 1021813, 12758, 256, 90, 214, 6, 459, false, 28265},
    {"dungeon_open.obj", FM_MESH_FORMAT_OBJ, 5101, UNTOLD, UNTOLD, 10133, 432, 138, UNTOLD, UNTOLD, UNTOLD, 9, false, 655},
    {"self_intersect.obj", FM_MESH_FORMAT_OBJ, 8582, 8582, 0, 17160, 0, 0, 0, UNTOLD, 0, UNTOLD, true, 338},
    {"nonmanifold_small.obj", FM_MESH_FORMAT_OBJ, 717, 657, UNTOLD, 1442, UNTOLD, 18, UNTOLD, UNTOLD, 3, UNTOLD, false, 6593},
    {"pine_tree_thin.ply", FM_MESH_FORMAT_PLY, UNTOLD, UNTOLD, UNTOLD, 1650, 980, UNTOLD, UNTOLD, UNTOLD, UNTOLD, 82, false, 984},
};

// Whether a triangle has no area: in double, which is enough to tell for these meshes.
static bool is_flat(const float (*v)[3], const uint32_t t[3]) {
    double a[3], b[3];
    for (int k = 0; k < 3; k++) {
        a[k] = (double)v[t[1]][k] - (double)v[t[0]][k];
        b[k] = (double)v[t[2]][k] - (double)v[t[0]][k];
    }
    return a[1] * b[2] == a[2] * b[1] && a[2] * b[0] == a[0] * b[2] && a[0] * b[1] == a[1] * b[0];
}

static bool has_equal_corners(const float (*v)[3], const uint32_t t[3]) {
    return memcmp(v[t[0]], v[t[1]], 12) == 0 || memcmp(v[t[1]], v[t[2]], 12) == 0 || memcmp(v[t[2]], v[t[0]], 12) == 0;
}

// The figures count pairs of triangles that have area, and as degenerate those with two equal corners.
static void count_as_told(fm_context *context, const fm_mesh *mesh, uint64_t *pairs, uint64_t *degenerate, uint64_t *flat) {
    const float(*v)[3];
    const uint32_t(*t)[3];
    uint64_t vertices, triangles, kept = 0;
    fm_mesh_arrays(mesh, &v, &vertices, &t, &triangles);
    uint32_t(*solid)[3] = malloc((size_t)(triangles + 1) * sizeof *solid);
    *degenerate = *pairs = 0;
    for (uint64_t i = 0; solid && i < triangles; i++) {
        *degenerate += has_equal_corners(v, t[i]);
        if (!is_flat(v, t[i])) {
            memcpy(solid[kept++], t[i], sizeof *solid);
        }
    }
    *flat = triangles - kept;
    const fm_mesh_desc desc = {v, vertices, (const uint32_t(*)[3])solid, kept};
    fm_mesh *part = NULL;
    if (CHECK_OK(fm_mesh_create(context, &desc, &part))) {
        CHECK_OK(fm_mesh_intersections(part, 0, pairs));
    }
    fm_mesh_destroy(part);
    free(solid);
}

static bool figure(const char *name, const char *what, int64_t wanted, uint64_t got) {
    const bool good = CHECK(wanted == UNTOLD || (uint64_t)wanted == got);
    if (!good) {
        fprintf(stderr, "    %s: %s is %llu, not %lld\n", name, what, (unsigned long long)got, (long long)wanted);
    }
    return good;
}

static void check_mesh(fm_context *context, size_t i, const char *path) {
    const char *name = rows[i].name;
    fm_mesh *mesh = NULL;
    fm_mesh_file_info file;
    fm_mesh_info info;
    uint64_t pairs, degenerate, flat;
    if (!CHECK_OK(fm_mesh_read(context, path, NULL, &mesh, &file)) || !CHECK_OK(fm_mesh_describe(mesh, &info))) {
        fm_mesh_destroy(mesh);
        return;
    }
    count_as_told(context, mesh, &pairs, &degenerate, &flat);
    CHECK(file.format == rows[i].format && file.note[0] == 0);
    figure(name, "vertices", rows[i].vertices, info.vertices);
    figure(name, "distinct", rows[i].distinct, info.distinct);
    figure(name, "unused", rows[i].unused, info.unused);
    figure(name, "triangles", rows[i].triangles, info.triangles);
    figure(name, "boundary", rows[i].boundary, info.boundary);
    figure(name, "non_manifold", rows[i].non_manifold, info.non_manifold);
    figure(name, "misoriented", rows[i].misoriented, info.misoriented);
    figure(name, "degenerate", rows[i].degenerate, degenerate);
    figure(name, "flat", (int64_t)flat, info.degenerate);
    figure(name, "duplicate", rows[i].duplicate, info.duplicate);
    figure(name, "components", rows[i].components, info.components);
    figure(name, "closed", rows[i].closed, info.closed);
    figure(name, "pairs", (int64_t)rows[i].pairs, pairs);
    CHECK(info.dropped == 0);
    fm_mesh_destroy(mesh);
}

int main(void) {
    const char *root = getenv("FATHOM_DATA");
    char path[1024];
    if (!root || !root[0]) {
        root = io_exists("data") ? "data" : "../shared/data";
    }
    snprintf(path, sizeof path, "%s/meshes/spot.obj", root);
    if (!io_exists(path)) {
        return check_skip(
            "the data of other people is not here (to test with it, name its folder in the environment variable FATHOM_DATA)");
    }
    fm_context *context = NULL;
    const fm_context_desc desc = {.backend = FM_BACKEND_CPU};
    if (!CHECK_OK(fm_context_create(&desc, &context))) {
        return check_summary();
    }
    for (size_t i = 0; i < sizeof rows / sizeof rows[0]; i++) {
        snprintf(path, sizeof path, "%s/meshes/%s", root, rows[i].name);
        check_mesh(context, i, path);
    }
    fm_context_destroy(context);
    return check_summary();
}
