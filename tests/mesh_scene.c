// SPDX-License-Identifier: MIT
// Scenes of objects: where their vertices are after updates, and that queries follow. On the CPU, or with --backend vulkan there.

#include "faulty.h"
#include "mesh_gpu_common.h"

enum { OBJECTS = 4 };

static fm_context *context;

// A turn about an axis, then a shift.
static fm_transform3 place_at(double angle, int axis, const float shift[3]) {
    const int x = (axis + 1) % 3, y = (axis + 2) % 3;
    fm_transform3 place = {{{0}}};
    place.rows[axis][axis] = 1;
    place.rows[x][x] = place.rows[y][y] = (float)cos(angle);
    place.rows[y][x] = (float)sin(angle);
    place.rows[x][y] = (float)-sin(angle);
    for (int row = 0; row < 3; row++) {
        place.rows[row][3] = shift[row];
    }
    return place;
}

static void apply(const fm_transform3 *place, const float from[3], double to[3]) {
    for (int row = 0; row < 3; row++) {
        const float *m = place->rows[row];
        to[row] = (double)m[0] * from[0] + (double)m[1] * from[1] + (double)m[2] * from[2] + m[3];
    }
}

typedef struct expected {
    scene_mesh shapes[OBJECTS];
    fm_transform3 places[OBJECTS];
    uint32_t count;
} expected;

// All objects in one, placed in doubles.
static scene_mesh merged(const expected *e) {
    scene_mesh all = {0};
    for (uint32_t i = 0; i < e->count; i++) {
        all.vertex_count += e->shapes[i].vertex_count;
        all.triangle_count += e->shapes[i].triangle_count;
    }
    all.vertices = malloc((all.vertex_count + 1) * sizeof *all.vertices);
    all.triangles = malloc((all.triangle_count + 1) * sizeof *all.triangles);
    uint64_t v = 0, t = 0;
    for (uint32_t i = 0; i < e->count; i++) {
        const uint32_t first = (uint32_t)v;
        for (uint64_t k = 0; k < e->shapes[i].vertex_count; k++, v++) {
            double to[3];
            apply(&e->places[i], e->shapes[i].vertices[k], to);
            for (int axis = 0; axis < 3; axis++) {
                all.vertices[v][axis] = (float)to[axis];
            }
        }
        for (uint64_t k = 0; k < 3 * e->shapes[i].triangle_count; k++) {
            all.triangles[t + k / 3][k % 3] = first + e->shapes[i].triangles[k / 3][k % 3];
        }
        t += e->shapes[i].triangle_count;
    }
    return all;
}

static void check_scene(fm_scene *scene, const expected *e) {
    scene_mesh all = merged(e);
    const float(*vertices)[3];
    const uint32_t(*triangles)[3];
    uint64_t vertex_count, triangle_count, seed = 3;
    fm_mesh *mesh = fm_scene_mesh(scene);
    fm_mesh_arrays(mesh, &vertices, &vertex_count, &triangles, &triangle_count);
    if (CHECK(vertex_count == all.vertex_count && triangle_count == all.triangle_count)) {
        // On a device they have moved there alone.
        for (uint64_t i = 0; i < vertex_count && fm_context_backend(context) == FM_BACKEND_CPU; i++) {
            for (int axis = 0; axis < 3; axis++) {
                CHECK(fabsf(vertices[i][axis] - all.vertices[i][axis]) < 4e-6f);
            }
        }
        CHECK(triangle_count == 0 || memcmp(triangles, all.triangles, triangle_count * sizeof *triangles) == 0);
    }
    enum { POSITIONS = 60 };
    float positions[POSITIONS][3];
    fm_closest closest[POSITIONS];
    for (int i = 0; i < 3 * POSITIONS; i++) {
        positions[i / 3][i % 3] = uniform(&seed, -5, 5);
    }
    CHECK_OK(fm_mesh_closest(mesh, (const float(*)[3])positions, POSITIONS, 0, closest));
    for (int i = 0; i < POSITIONS; i++) {
        const double nearest = sqrt(oracle_nearest2(&all, positions[i]));
        CHECK(isinf(nearest) ? closest[i].triangle == FM_NO_TRIANGLE : fabs(closest[i].distance - nearest) < 1e-5);
    }
    scene_mesh_free(&all);
}

static void add(fm_scene *scene, expected *e, scene_mesh shape, fm_transform3 place) {
    const fm_mesh_desc desc = scene_mesh_describe(&shape);
    fm_mesh *mesh = NULL;
    uint32_t number = 99;
    CHECK_OK(fm_mesh_create(context, &desc, &mesh));
    CHECK_OK(fm_scene_add(scene, mesh, &place, &number));
    CHECK(number == e->count);
    fm_mesh_destroy(mesh);
    e->shapes[e->count] = shape;
    e->places[e->count++] = place;
}

static void moving(void) {
    const float here[3] = {0, 0, 0};
    expected e = {0};
    fm_scene *scene = NULL;
    if (!CHECK_OK(fm_scene_create(context, &scene))) {
        return;
    }
    check_scene(scene, &e);
    CHECK_OK(fm_scene_update(scene, FM_TREE_REFIT, NULL));
    add(scene, &e, scene_mesh_sphere(12, 16, here, 1), place_at(0, 0, (const float[]){2, 0, 0}));
    add(scene, &e, scene_mesh_box((const float[]){-1, -1, -1}, (const float[]){1, 1, 1}),
        place_at(0.5, 1, (const float[]){-2, 1, 0}));
    add(scene, &e, scene_mesh_soup(0, 1, here, 1, 0.1f), place_at(0, 0, here));
    fm_ticket ticket = 7;
    CHECK_OK(fm_scene_update(scene, FM_TREE_REFIT, &ticket));
    CHECK_OK(fm_wait(context, ticket));
    check_scene(scene, &e);
    fm_mesh *before = fm_scene_mesh(scene);
    for (int frame = 0; frame < 6; frame++) {
        e.places[0] = place_at(0.3 * frame, 2, (const float[]){2, 0.1f * (float)frame, -1});
        CHECK_OK(fm_scene_move(scene, 0, &e.places[0]));
        if (frame % 2 == 0) {
            e.places[1] = place_at(-0.2 * frame, 0, (const float[]){-2, 1, 0.2f * (float)frame});
            CHECK_OK(fm_scene_move(scene, 1, &e.places[1]));
        }
        if (frame == 3) {
            for (uint64_t i = 0; i < e.shapes[0].vertex_count; i++) {
                e.shapes[0].vertices[i][2] *= 1.5f;
            }
            CHECK_OK(fm_scene_deform(scene, 0, (const float(*)[3])e.shapes[0].vertices));
        }
        CHECK_OK(fm_scene_update(scene, frame == 4 ? FM_TREE_REBUILD : FM_TREE_REFIT, NULL));
        check_scene(scene, &e);
        CHECK(fm_scene_mesh(scene) == before);
    }
    add(scene, &e, scene_mesh_sheet(5, here, 2, 0.2f), place_at(1, 0, (const float[]){0, -3, 0}));
    CHECK_OK(fm_scene_update(scene, FM_TREE_REFIT, NULL));
    check_scene(scene, &e);
    // Nothing moved: the tree need not follow.
    CHECK_OK(fm_scene_update(scene, FM_TREE_REFIT, NULL));
    check_scene(scene, &e);
    fm_scene_destroy(scene);
    for (uint32_t i = 0; i < e.count; i++) {
        scene_mesh_free(&e.shapes[i]);
    }
}

// Two of one shape are two parts, wherever they are.
static void twins(void) {
    expected e = {0};
    fm_scene *scene = NULL;
    CHECK_OK(fm_scene_create(context, &scene));
    for (int i = 0; i < 2; i++) {
        add(scene, &e, scene_mesh_box((const float[]){-1, -1, -1}, (const float[]){1, 1, 1}),
            place_at(0, 0, (const float[]){3.0f * (float)i, 0, 0}));
    }
    CHECK_OK(fm_scene_update(scene, FM_TREE_REFIT, NULL));
    fm_mesh_info info;
    CHECK_OK(fm_mesh_describe(fm_scene_mesh(scene), &info));
    CHECK(info.closed && info.components == 2 && info.duplicate == 0 && fabs(info.volume - 16) < 1e-9);
    fm_scene_destroy(scene);
    scene_mesh_free(&e.shapes[0]);
    scene_mesh_free(&e.shapes[1]);
}

static void bad_arguments(void) {
    const fm_transform3 place = place_at(0, 0, (const float[]){0, 0, 0});
    fm_context *other = NULL;
    fm_scene *scene = NULL;
    fm_mesh *mesh = NULL, *foreign = NULL;
    CHECK_FAILS(fm_scene_create(NULL, &scene), FM_ERROR_INVALID_ARGUMENT);
    CHECK_FAILS(fm_scene_create(context, NULL), FM_ERROR_INVALID_ARGUMENT);
    CHECK_OK(fm_context_create(&(fm_context_desc){.backend = FM_BACKEND_CPU}, &other));
    CHECK_OK(fm_scene_create(context, &scene));
    CHECK_OK(fm_mesh_create(context, NULL, &mesh));
    CHECK_OK(fm_mesh_create(other, NULL, &foreign));
    CHECK_FAILS(fm_scene_add(NULL, mesh, &place, NULL), FM_ERROR_INVALID_ARGUMENT);
    CHECK_FAILS(fm_scene_add(scene, NULL, &place, NULL), FM_ERROR_INVALID_ARGUMENT);
    CHECK_FAILS(fm_scene_add(scene, mesh, NULL, NULL), FM_ERROR_INVALID_ARGUMENT);
    CHECK_FAILS(fm_scene_add(scene, foreign, &place, NULL), FM_ERROR_INVALID_ARGUMENT);
    for (int i = 0; i < 12; i++) {
        fm_transform3 bad = place;
        bad.rows[i / 4][i % 4] = i % 2 ? NAN : INFINITY;
        CHECK_FAILS(fm_scene_add(scene, mesh, &bad, NULL), FM_ERROR_INVALID_ARGUMENT);
    }
    CHECK_OK(fm_scene_add(scene, mesh, &place, NULL));
    CHECK_FAILS(fm_scene_move(scene, 1, &place), FM_ERROR_INVALID_ARGUMENT);
    CHECK_FAILS(fm_scene_move(scene, 0, NULL), FM_ERROR_INVALID_ARGUMENT);
    CHECK_FAILS(fm_scene_move(NULL, 0, &place), FM_ERROR_INVALID_ARGUMENT);
    CHECK_FAILS(fm_scene_deform(scene, 1, NULL), FM_ERROR_INVALID_ARGUMENT);
    CHECK_FAILS(fm_scene_deform(NULL, 0, NULL), FM_ERROR_INVALID_ARGUMENT);
    CHECK_OK(fm_scene_deform(scene, 0, NULL));  // no vertices are needed
    CHECK_FAILS(fm_scene_update(NULL, FM_TREE_REFIT, NULL), FM_ERROR_INVALID_ARGUMENT);
    CHECK_FAILS(fm_scene_update(scene, (fm_tree)2, NULL), FM_ERROR_INVALID_ARGUMENT);
    CHECK_OK(fm_scene_update(scene, FM_TREE_REBUILD, NULL));
    CHECK(fm_scene_mesh(NULL) == NULL);
    fm_scene_destroy(scene);
    fm_scene_destroy(NULL);
    fm_mesh_destroy(mesh);
    fm_mesh_destroy(foreign);
    fm_context_destroy(other);
}

static fm_result build_with_little_memory(fm_context *poor, void *user) {
    const fm_mesh_desc desc = scene_mesh_describe(user);
    const fm_transform3 place = place_at(0.1, 0, (const float[]){1, 2, 3});
    fm_scene *scene = NULL;
    fm_mesh *mesh = NULL;
    fm_closest closest;
    fm_result status = fm_mesh_create(poor, &desc, &mesh);
    status = status == FM_OK ? fm_scene_create(poor, &scene) : status;
    for (int i = 0; i < 3 && status == FM_OK; i++) {
        status = fm_scene_add(scene, mesh, &place, NULL);
    }
    status = status == FM_OK ? fm_scene_update(scene, FM_TREE_REFIT, NULL) : status;
    status = status == FM_OK ? fm_mesh_closest(fm_scene_mesh(scene), desc.vertices, 1, 0, &closest) : status;
    fm_scene_destroy(scene);
    fm_mesh_destroy(mesh);
    return status;
}

int main(int count, char **arguments) {
    vulkan_options options;
    if (!vulkan_parse(count, arguments, &options)) {
        return 2;
    }
    const bool vulkan = count > 1;
    if (vulkan && vulkan_open(&options, NULL, &context) != FM_OK) {
        return vulkan_missing();
    }
    if (!vulkan && !CHECK_OK(fm_context_create(&(fm_context_desc){.backend = FM_BACKEND_CPU, .threads = 2}, &context))) {
        return check_summary();
    }
    moving();
    twins();
    bad_arguments();
    scene_mesh sphere = scene_mesh_sphere(8, 9, (const float[]){0, 0, 0}, 1);
    exhaust("a scene", build_with_little_memory, &sphere, -1);
    scene_mesh_free(&sphere);
    vulkan_close(context);
    return check_summary();
}
