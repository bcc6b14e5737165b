// SPDX-License-Identifier: MIT
// What a mesh is: edges, parts, area and volume, exact intersections and normals of features, of small meshes by hand.

#include "faulty.h"
#include "mesh/exact.h"
#include "mesh/intersect.h"
#include "mesh/topology.h"
#include "mesh_gpu_common.h"

static fm_context *context;

static fm_mesh *make(const scene_mesh *from) {
    const fm_mesh_desc desc = scene_mesh_describe(from);
    fm_mesh *mesh = NULL;
    CHECK_OK(fm_mesh_create(context, &desc, &mesh));
    return mesh;
}

static fm_mesh_info describe(const float (*vertices)[3], uint64_t vertex_count, const uint32_t (*triangles)[3],
                             uint64_t triangle_count) {
    const fm_mesh_desc desc = {vertices, vertex_count, triangles, triangle_count};
    fm_mesh *mesh = NULL;
    fm_mesh_info info = {0};
    CHECK_OK(fm_mesh_create(context, &desc, &mesh));
    CHECK_OK(fm_mesh_describe(mesh, &info));
    fm_mesh_destroy(mesh);
    return info;
}

static bool near(double a, double b, double tolerance) {
    return fabs(a - b) <= tolerance * fabs(b);
}

// Corners of a cube with a vertex of its own for each use, as files of triangle soup have it.
static void apart(scene_mesh *mesh) {
    float(*vertices)[3] = malloc(3 * mesh->triangle_count * sizeof *vertices);
    for (uint64_t i = 0; i < 3 * mesh->triangle_count; i++) {
        memcpy(vertices[i], mesh->vertices[mesh->triangles[i / 3][i % 3]], sizeof *vertices);
        mesh->triangles[i / 3][i % 3] = (uint32_t)i;
    }
    free(mesh->vertices);
    mesh->vertices = vertices;
    mesh->vertex_count = 3 * mesh->triangle_count;
}

static void closed_shapes(void) {
    const float far_away[3] = {1e5f, -2e5f, 3e5f}, here[3] = {0};
    scene_mesh shapes[] = {scene_mesh_box((const float[]){-0.0f, 0, 0}, (const float[]){1, 2, 3}),
                           scene_mesh_sphere(60, 100, far_away, 500), scene_mesh_torus(60, 40, here, 2, 0.5f),
                           scene_mesh_tubes(40, here, 2)};
    const double pi = 3.14159265358979;
    const double volumes[] = {6, 4 / 3.0 * pi * 1.25e8, 2 * pi * pi * 2 * 0.25, 2 * pi * 0.0625 * 2};
    const double areas[] = {22, 4 * pi * 2.5e5, 4 * pi * pi * 2 * 0.5, 2 * (2 * pi * 0.25 * 2 + 2 * pi * 0.0625)};
    for (int i = 0; i < 4; i++) {
        for (int soup = 0; soup < 2; soup++) {
            const uint64_t distinct = i == 0 ? 8 : 0;
            const fm_mesh_info info = describe((const float(*)[3])shapes[i].vertices, shapes[i].vertex_count,
                                               (const uint32_t(*)[3])shapes[i].triangles, shapes[i].triangle_count);
            CHECK(info.closed && info.boundary == 0 && info.non_manifold == 0 && info.misoriented == 0);
            CHECK(info.components == (i == 3 ? 2 : 1) && info.degenerate == 0 && info.duplicate == 0 && info.dropped == 0);
            CHECK(near(info.volume, volumes[i], i == 0 ? 1e-12 : 0.01) && near(info.area, areas[i], i == 0 ? 1e-12 : 0.01));
            CHECK(distinct == 0 || info.distinct == distinct);
            CHECK(info.unused == 0 && info.triangles == shapes[i].triangle_count);
            apart(&shapes[i]);
        }
        for (uint64_t k = 0; k < shapes[i].triangle_count; k++) {
            const uint32_t corner = shapes[i].triangles[k][1];
            shapes[i].triangles[k][1] = shapes[i].triangles[k][2];
            shapes[i].triangles[k][2] = corner;
        }
        const fm_mesh_info inside_out = describe((const float(*)[3])shapes[i].vertices, shapes[i].vertex_count,
                                                 (const uint32_t(*)[3])shapes[i].triangles, shapes[i].triangle_count);
        CHECK(inside_out.closed && near(inside_out.volume, -volumes[i], 0.01));
        scene_mesh_free(&shapes[i]);
    }
}

static void by_hand(void) {
    // A square of two triangles and one more on their diagonal, a triangle apart, vertices that repeat and that nobody uses.
    const float vertices[][3] = {{0, 0, 0}, {1, 0, 0}, {1, 1, 0}, {0, 1, 0},    {0, -0.0f, 0}, {0.5f, 0.5f, 1}, {5, 5, 5},
                                 {6, 5, 5}, {5, 6, 5}, {9, 9, 9}, {5.5f, 5, 5}, {NAN, 0, 0},   {2e18f, 0, 0},   {NAN, 0, 0}};
    const uint32_t square[][3] = {{0, 1, 2}, {4, 2, 3}};
    fm_mesh_info info = describe(vertices, 14, square, 2);
    CHECK(info.boundary == 4 && info.non_manifold == 0 && info.misoriented == 0 && info.components == 1 && !info.closed);
    CHECK(info.distinct == 4 && info.unused == 9 && info.volume == 0 && near(info.area, 1, 1e-12));
    CHECK(info.low[0] == 0 && info.high[1] == 1 && info.high[2] == 0);

    const uint32_t turned[][3] = {{0, 1, 2}, {4, 3, 2}};
    info = describe(vertices, 14, turned, 2);
    CHECK(info.boundary == 4 && info.misoriented == 1);

    const uint32_t three[][3] = {{0, 1, 2}, {4, 2, 3}, {2, 0, 5}, {6, 7, 8}};
    info = describe(vertices, 14, three, 4);
    CHECK(info.non_manifold == 1 && info.boundary == 9 && info.components == 2);

    const uint32_t repeated[][3] = {{0, 1, 2}, {1, 2, 4}, {2, 1, 0}, {6, 7, 8}};
    info = describe(vertices, 14, repeated, 4);
    CHECK(info.duplicate == 2 && info.non_manifold == 3);

    // A point, a segment, three corners on a line, and two that cannot take part.
    const uint32_t flat[][3] = {{6, 6, 6}, {6, 7, 6}, {6, 7, 10}, {0, 1, 11}, {0, 1, 12}, {13, 13, 11}};
    info = describe(vertices, 14, flat, 6);
    CHECK(info.degenerate == 3 && info.dropped == 3 && info.area == 0 && info.boundary == 3 && info.components == 1);

    info = describe(vertices, 14, flat + 3, 3);
    CHECK(info.dropped == 3 && info.low[0] > info.high[0] && !info.closed && info.components == 0);

    info = describe(NULL, 0, NULL, 0);
    CHECK(info.triangles == 0 && !info.closed && info.low[0] > info.high[0]);
    CHECK_FAILS(fm_mesh_describe(NULL, &info), FM_ERROR_INVALID_ARGUMENT);
}

// ---------------------------------------------------------------------------------------------------------------------------
// Exact signs, against integers of 128 bits
// ---------------------------------------------------------------------------------------------------------------------------

__extension__ typedef __int128 wide;

static int sign_of(wide value) {
    return (value > 0) - (value < 0);
}

// Whole numbers of up to 24 bits, times a power of two, and close to a plane or a line.
static void exact_signs(void) {
    uint64_t seed = 3;
    int zeros = 0;
    for (int round = 0; round < 20000; round++) {
        const int bits = round % 4 == 0 ? 3 : round % 4 == 1 ? 12 : 23;
        int64_t p[4][3];
        float f[4][3];
        for (int i = 0; i < 4; i++) {
            for (int axis = 0; axis < 3; axis++) {
                p[i][axis] = (int64_t)(test_random(&seed) >> (63 - bits)) - (INT64_C(1) << bits);
            }
        }
        if (round % 3 == 0) {  // in the plane of the first three, or next to it
            for (int axis = 0; axis < 3; axis++) {
                p[3][axis] = p[1][axis] + p[2][axis] - p[0][axis];
                p[3][axis] += round % 2 == 0 && axis == 2;
                p[3][axis] = p[3][axis] > 16777215 || p[3][axis] < -16777215 ? 0 : p[3][axis];
            }
        }
        const int power = test_between(&seed, -120, 30);
        for (int i = 0; i < 12; i++) {
            f[i / 3][i % 3] = ldexpf((float)p[i / 3][i % 3], power);
        }
        wide d[3][3];
        for (int i = 0; i < 3; i++) {
            for (int axis = 0; axis < 3; axis++) {
                d[i][axis] = p[i][axis] - p[3][axis];
            }
        }
        const wide volume = d[0][0] * (d[1][1] * d[2][2] - d[1][2] * d[2][1]) + d[0][1] * (d[1][2] * d[2][0] - d[1][0] * d[2][2]) +
                            d[0][2] * (d[1][0] * d[2][1] - d[1][1] * d[2][0]);
        const wide area = (d[0][0] - d[2][0]) * (d[1][1] - d[2][1]) - (d[0][1] - d[2][1]) * (d[1][0] - d[2][0]);
        CHECK(fm_orient3(f[0], f[1], f[2], f[3]) == sign_of(volume));
        CHECK(fm_orient3(f[1], f[0], f[2], f[3]) == -sign_of(volume));
        CHECK(fm_orient2(f[0], f[1], f[2], 0, 1) == sign_of(area));
        zeros += volume == 0;
    }
    CHECK(zeros > 1000);
    // Differences that no double holds: three points of the plane z = x, and one that lies hardly above or below it.
    for (int round = 0; round < 2000; round++) {
        float p[4][3];
        for (int i = 0; i < 4; i++) {
            for (int axis = 0; axis < 2; axis++) {
                p[i][axis] = ldexpf(uniform(&seed, -1, 1), test_between(&seed, -60, 59));
            }
            p[i][2] = p[i][0];
        }
        const int left = fm_orient2(p[0], p[1], p[2], 0, 1);
        CHECK(left != 0 && fm_orient3(p[0], p[1], p[2], p[3]) == 0);
        p[3][2] = nextafterf(p[3][0], INFINITY);
        CHECK(fm_orient3(p[0], p[1], p[2], p[3]) == -left);
        p[3][2] = nextafterf(p[3][0], -INFINITY);
        CHECK(fm_orient3(p[0], p[1], p[2], p[3]) == left);
    }
    const float apart[4][3] = {{1e18f, 0, 0}, {0, 1e18f, 0}, {0, 0, 1e18f}, {1e-20f, 1e-20f, 1e-20f}};
    const float level[4][3] = {{1e18f, 1, 0}, {1e-20f, 1, 1e9f}, {3, 1, 1e-30f}, {7, 1, 1e18f}};
    const float beside[3] = {7, nextafterf(1, 2), 1e18f};
    CHECK(fm_orient3(apart[0], apart[1], apart[2], apart[3]) != 0);
    CHECK(fm_orient3(level[0], level[1], level[2], level[3]) == 0);
    CHECK(fm_orient3(level[0], level[1], level[2], beside) != 0);
    CHECK(fm_orient3(level[0], level[1], level[2], beside) == -fm_orient3(level[1], level[0], level[2], beside));
    CHECK(fm_collinear((const float[]){0.1f, 0.1f, 0.1f}, (const float[]){1e10f, 1e10f, 1e10f},
                       (const float[]){1e-30f, 1e-30f, 1e-30f}));
    CHECK(
        !fm_collinear((const float[]){0.1f, 0.1f, 0.1f}, (const float[]){1e10f, 1e10f, 1e10f}, (const float[]){1e-30f, 0, 1e-30f}));
}

static void pairs_by_hand(void) {
    const struct {
        float a[3][3], b[3][3];
        bool meet;
    } cases[] = {
        {{{0, 0, 0}, {2, 0, 0}, {0, 2, 0}}, {{0.5f, 0.5f, -1}, {0.5f, 0.5f, 1}, {3, 3, 0}}, true},       // through the middle
        {{{0, 0, 0}, {2, 0, 0}, {0, 2, 0}}, {{0.5f, 0.5f, 0}, {0.5f, 0.5f, 1}, {3, 3, 1}}, true},        // a corner on the face
        {{{0, 0, 0}, {2, 0, 0}, {0, 2, 0}}, {{0.5f, 0.5f, 1e-30f}, {0.5f, 0.5f, 1}, {3, 3, 1}}, false},  // hardly above it
        {{{0, 0, 0}, {2, 0, 0}, {0, 2, 0}}, {{1, 1, -1}, {1, 1, 1}, {3, 3, 0}}, true},                   // on the border
        {{{0, 0, 0}, {2, 0, 0}, {0, 2, 0}}, {{1, 1.0000001f, -1}, {1, 1.0000001f, 1}, {3, 3, 0}}, false},
        {{{0, 0, 0}, {2, 0, 0}, {0, 2, 0}}, {{-1, 0, -1}, {-1, 0, 1}, {-1, 1, 0}}, false},
        {{{0, 0, 0}, {4, 0, 0}, {0, 4, 0}}, {{1, 1, 0}, {1.5f, 1, 0}, {1, 1.5f, 0}}, true},  // within, in one plane
        {{{0, 0, 0}, {4, 0, 0}, {0, 4, 0}}, {{-1, 1, 0}, {5, 1, 0}, {5, 1.5f, 0}}, true},    // across, in one plane
        {{{0, 0, 0}, {4, 0, 0}, {0, 4, 0}}, {{3, 3, 0}, {5, 1, 0}, {5, 5, 0}}, false},       // beside, in one plane
        {{{0, 0, 0}, {4, 0, 0}, {0, 4, 0}}, {{2, 2, 0}, {5, 1, 0}, {5, 5, 0}}, true},        // a corner on the border
        {{{0, 0, 0}, {4, 0, 0}, {0, 4, 0}}, {{1, 1, -1}, {1, 1, 1}, {1, 1, -1}}, true},      // a segment through
        {{{0, 0, 0}, {4, 0, 0}, {0, 4, 0}}, {{1, 1, -1}, {1, 1, 0.5f}, {1, 1, 1}}, true},    // three on a line through
        {{{0, 0, 0}, {4, 0, 0}, {0, 4, 0}}, {{1, 1, 0.25f}, {1, 1, 0.5f}, {1, 1, 1}}, false},
        {{{0, 0, 0}, {4, 0, 0}, {0, 4, 0}}, {{1, 1, 0}, {1, 1, 0}, {1, 1, 0}}, true},   // a point on the face
        {{{0, 0, 0}, {4, 0, 0}, {0, 4, 0}}, {{3, 3, 0}, {3, 3, 0}, {3, 3, 0}}, false},  // a point in the plane
        {{{0, 0, 0}, {4, 0, 0}, {0, 4, 0}}, {{1, 1, 1}, {1, 1, 1}, {1, 1, 1}}, false},
        {{{0, 0, 0}, {2, 2, 2}, {1, 1, 1}}, {{0, 2, 1}, {2, 0, 1}, {1, 1, 1}}, true},  // two segments that cross
        {{{0, 0, 0}, {2, 2, 2}, {1, 1, 1}}, {{0, 2, 1}, {2, 0, 1.5f}, {1, 1, 1.25f}}, false},
        {{{0, 0, 0}, {2, 2, 2}, {1, 1, 1}}, {{1.5f, 1.5f, 1.5f}, {3, 3, 3}, {4, 4, 4}}, true},  // along one line
        {{{0, 0, 0}, {2, 2, 2}, {1, 1, 1}}, {{2.5f, 2.5f, 2.5f}, {3, 3, 3}, {4, 4, 4}}, false},
        {{{0, 0, 0}, {2, 2, 2}, {1, 1, 1}}, {{1, 1, 1}, {1, 1, 1}, {1, 1, 1}}, true},
        {{{1, 1, 1}, {1, 1, 1}, {1, 1, 1}}, {{1, 1, 1}, {1, 1, 1}, {1, 1, 1}}, true},
        {{{1, 1, 1}, {1, 1, 1}, {1, 1, 1}}, {{1, 1, 2}, {1, 1, 2}, {1, 1, 2}}, false},
    };
    for (size_t i = 0; i < sizeof cases / sizeof cases[0]; i++) {
        for (int turn = 0; turn < 18; turn++) {
            // Every axis, every first corner, mirrored too.
            float p[2][3][3];
            const float *corners[2][3];
            for (int k = 0; k < 9; k++) {
                const int corner = turn >= 9 ? 2 - k / 3 : k / 3;
                p[0][(corner + turn) % 3][(k % 3 + turn / 3) % 3] = cases[i].a[k / 3][k % 3];
                p[1][(corner + turn) % 3][(k % 3 + turn / 3) % 3] = cases[i].b[k / 3][k % 3];
            }
            for (int k = 0; k < 6; k++) {
                corners[k / 3][k % 3] = p[k / 3][k % 3];
            }
            const bool good = CHECK(fm_triangles_intersect(corners[0], corners[1]) == cases[i].meet) &&
                              CHECK(fm_triangles_intersect(corners[1], corners[0]) == cases[i].meet);
            if (!good) {
                fprintf(stderr, "    pair %zu, turn %d\n", i, turn);
            }
        }
    }
}

static void pairs_of_meshes(void) {
    scene_mesh soup = bad_soup(1200, 17), sphere = scene_mesh_sphere(20, 30, (const float[]){0, 0, 0}, 1);
    fm_mesh *mesh = make(&soup);
    uint64_t pairs, expected = 0;
    CHECK_OK(fm_mesh_intersections(mesh, 0, &pairs));
    for (uint64_t i = 0; i < soup.triangle_count; i++) {
        for (uint64_t k = i + 1; k < soup.triangle_count && triangle_fits(&soup, i); k++) {
            const float *a[3], *b[3];
            bool shared = false;
            for (int n = 0; n < 3; n++) {
                a[n] = soup.vertices[soup.triangles[i][n]];
                b[n] = soup.vertices[soup.triangles[k][n]];
            }
            for (int n = 0; n < 9; n++) {
                shared |= memcmp(a[n / 3], b[n % 3], sizeof(float[3])) == 0;
            }
            expected += !shared && triangle_fits(&soup, k) && fm_triangles_intersect(a, b);
        }
    }
    CHECK(pairs == expected && pairs > 100);
    CHECK_OK(fm_mesh_intersections(mesh, 3, &pairs));
    CHECK(pairs == 3);
    CHECK_FAILS(fm_mesh_intersections(mesh, 0, NULL), FM_ERROR_INVALID_ARGUMENT);
    CHECK_FAILS(fm_mesh_intersections(NULL, 0, &pairs), FM_ERROR_INVALID_ARGUMENT);
    fm_mesh_destroy(mesh);
    mesh = make(&sphere);
    bool intersects = true;
    CHECK_OK(fm_mesh_intersects(mesh, &intersects));
    CHECK(!intersects);
    // A corner is pulled through to the other side.
    sphere.vertices[100][0] = -1.5f * sphere.vertices[100][0];
    sphere.vertices[100][1] = -1.5f * sphere.vertices[100][1];
    sphere.vertices[100][2] = -1.5f * sphere.vertices[100][2];
    CHECK_OK(fm_mesh_deform(mesh, (const float(*)[3])sphere.vertices, FM_TREE_REFIT));
    CHECK_OK(fm_mesh_intersects(mesh, &intersects));
    CHECK(intersects);
    fm_mesh_destroy(mesh);
    scene_mesh_free(&soup);
    scene_mesh_free(&sphere);
}

// ---------------------------------------------------------------------------------------------------------------------------
// Normals
// ---------------------------------------------------------------------------------------------------------------------------

// On which side of closed meshes positions lie, by the nearest feature's normal, against the sum of all solid angles.
static void sides_of(const char *name, const scene_mesh *shape) {
    fm_mesh *mesh = make(shape);
    float low[3], high[3];
    uint64_t seed = 7;
    int wrong = 0;
    mesh_box(shape, low, high);
    CHECK_OK(fm_pseudonormals_prepare(mesh));
    CHECK_OK(fm_bvh_prepare(mesh));
    for (int i = 0; i < 1500; i++) {
        float p[3];
        double normal[3], side = 0;
        for (int axis = 0; axis < 3; axis++) {
            const float extent = high[axis] - low[axis];
            p[axis] = uniform(&seed, low[axis] - 0.2f * extent, high[axis] + 0.2f * extent);
        }
        fm_nearest nearest = {.distance2 = INFINITY, .triangle = FM_NO_TRIANGLE};
        fm_bvh_nearest(mesh, p, &nearest);
        if (!CHECK(nearest.triangle != FM_NO_TRIANGLE) || nearest.distance2 < 1e-10f) {
            continue;
        }
        fm_pseudonormal(mesh, nearest.triangle, nearest.feature, normal);
        for (int axis = 0; axis < 3; axis++) {
            side += ((double)p[axis] - nearest.point[axis]) * normal[axis];
        }
        wrong += (side < 0) != (oracle_winding(shape, p) > 0.5);
    }
    if (!CHECK(wrong == 0)) {
        fprintf(stderr, "    %s: %d wrong sides\n", name, wrong);
    }
    fm_mesh_destroy(mesh);
}

// Two pyramids on one another, of which one side of the seam has a corner more: a triangle without area joins them.
static void flat_triangle_in_a_crease(void) {
    float vertices[][3] = {{-1, -1, 0}, {1, -1, 0}, {1, 1, 0}, {-1, 1, 0}, {0, 0, 0.1f}, {0, 0, -0.1f}, {0.25f, -1, 0}};
    uint32_t triangles[][3] = {{0, 1, 4}, {1, 2, 4}, {2, 3, 4}, {3, 0, 4}, {6, 0, 5},
                               {1, 6, 5}, {2, 1, 5}, {3, 2, 5}, {0, 3, 5}, {0, 6, 1}};
    const scene_mesh shape = {vertices, triangles, 7, 10};
    const fm_mesh_info info = describe((const float(*)[3])vertices, 7, (const uint32_t(*)[3])triangles, 10);
    CHECK(info.closed && info.degenerate == 1);
    sides_of("a crease with a flat triangle", &shape);
    fm_mesh *mesh = make(&shape);
    CHECK_OK(fm_pseudonormals_prepare(mesh));
    double normal[3];
    // The corner on the seam looks along -y, as the pyramids are alike.
    fm_pseudonormal(mesh, 4, FM_FEATURE_CORNER_0, normal);
    CHECK(normal[1] < 0 && fabs(normal[2]) < 1e-9 * -normal[1] && fabs(normal[0]) < 1e-9 * -normal[1]);
    fm_pseudonormal(mesh, 4, FM_FEATURE_EDGE_0, normal);
    CHECK(normal[1] < 0 && fabs(normal[2]) < 1e-9 * -normal[1]);
    fm_mesh_destroy(mesh);
}

static fm_result describe_with_little_memory(fm_context *poor, void *user) {
    const fm_mesh_desc desc = scene_mesh_describe(user);
    fm_mesh *mesh = NULL;
    fm_result status = fm_mesh_create(poor, &desc, &mesh);
    if (status != FM_OK) {
        return status;
    }
    fm_mesh_info info;
    status = fm_mesh_describe(mesh, &info);
    status = status == FM_OK ? fm_pseudonormals_prepare(mesh) : status;
    fm_mesh_destroy(mesh);
    return status;
}

int main(void) {
    if (!CHECK_OK(fm_context_create(&(fm_context_desc){.backend = FM_BACKEND_CPU, .threads = 2}, &context))) {
        return check_summary();
    }
    closed_shapes();
    by_hand();
    exact_signs();
    pairs_by_hand();
    pairs_of_meshes();
    scene_mesh box = scene_mesh_box((const float[]){-1, -0.5f, -2}, (const float[]){1, 0.5f, 2});
    scene_mesh torus = scene_mesh_torus(12, 7, (const float[]){100, 200, -300}, 1, 0.4f);
    sides_of("a box", &box);
    sides_of("a torus", &torus);
    apart(&torus);
    sides_of("a torus without shared vertices", &torus);
    flat_triangle_in_a_crease();
    exhaust("a description", describe_with_little_memory, &torus, -1);
    scene_mesh_free(&box);
    scene_mesh_free(&torus);
    fm_context_destroy(context);
    return check_summary();
}
