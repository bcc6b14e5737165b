// SPDX-License-Identifier: MIT
// What is known of a mesh follows its positions: measures, grids, signs and shadows after deforms and moves are those of a mesh
// that was made there. On the CPU, or with --backend vulkan there.

#include "fathom/deferred.h"
#include "fathom/sdf.h"
#include "mesh_gpu_common.h"

enum { WIDTH = 96, HEIGHT = 72, PIXELS = WIDTH * HEIGHT };

static fm_context *context;

static fm_mesh *make(const scene_mesh *from) {
    const fm_mesh_desc desc = scene_mesh_describe(from);
    fm_mesh *mesh = NULL;
    CHECK_OK(fm_mesh_create(context, &desc, &mesh));
    return mesh;
}

static fm_sign sign_of(fm_mesh *mesh) {
    const fm_volume_desc desc = {.shape = {6, 6, 6}, .type = FM_TYPE_F32, .spacing = {1, 1, 1}, .origin = {-3, -3, -3}};
    fm_volume *field = NULL;
    fm_sdf_info info = {.sign = FM_SIGN_AUTO};
    if (CHECK_OK(fm_volume_create(context, &desc, &field))) {
        CHECK_OK(fm_mesh_sdf(mesh, NULL, field, NULL, &info, NULL));
    }
    fm_volume_destroy(field);
    return info.sign;
}

static bool same_info(const fm_mesh_info *a, const fm_mesh_info *b) {
    return memcmp(a->low, b->low, sizeof a->low) == 0 && memcmp(a->high, b->high, sizeof a->high) == 0 && a->area == b->area &&
           a->volume == b->volume && a->dropped == b->dropped && a->degenerate == b->degenerate && a->boundary == b->boundary &&
           a->components == b->components && a->closed == b->closed;
}

// The deformed mesh is what a new one is.
static void check_as_new(fm_mesh *mesh, const scene_mesh *source, fm_sign sign) {
    fm_mesh *fresh = make(source);
    fm_mesh_info info, own;
    fm_volume_desc grid = {.type = FM_TYPE_F32}, wanted = grid;
    CHECK_OK(fm_mesh_describe(fresh, &info));
    CHECK_OK(fm_mesh_describe(mesh, &own));
    CHECK(same_info(&info, &own));
    CHECK_OK(fm_mesh_fit(fresh, 20, 2, &wanted));
    CHECK_OK(fm_mesh_fit(mesh, 20, 2, &grid));
    CHECK(memcmp(grid.spacing, wanted.spacing, sizeof grid.spacing) == 0 &&
          memcmp(grid.origin, wanted.origin, sizeof grid.origin) == 0);
    CHECK(sign_of(fresh) == sign && sign_of(mesh) == sign);
    fm_mesh_destroy(fresh);
}

static void deformed(void) {
    scene_mesh sphere = scene_mesh_sphere(10, 12, (const float[]){0, 0, 0}, 1);
    fm_mesh *mesh = make(&sphere);
    check_as_new(mesh, &sphere, FM_SIGN_PSEUDONORMAL);
    for (uint64_t i = 0; i < sphere.vertex_count; i++) {
        sphere.vertices[i][0] = 2 * sphere.vertices[i][0] + 1;
    }
    CHECK_OK(fm_mesh_deform(mesh, (const float(*)[3])sphere.vertices, FM_TREE_REFIT));
    check_as_new(mesh, &sphere, FM_SIGN_PSEUDONORMAL);
    const float kept = sphere.vertices[40][1];
    sphere.vertices[40][1] = NAN;
    CHECK_OK(fm_mesh_deform(mesh, (const float(*)[3])sphere.vertices, FM_TREE_REFIT));
    check_as_new(mesh, &sphere, FM_SIGN_WINDING);
    fm_mesh_info info;
    CHECK_OK(fm_mesh_describe(mesh, &info));
    CHECK(info.dropped > 0 && !info.closed && info.boundary > 0);
    sphere.vertices[40][1] = kept;
    CHECK_OK(fm_mesh_deform(mesh, (const float(*)[3])sphere.vertices, FM_TREE_REBUILD));
    check_as_new(mesh, &sphere, FM_SIGN_PSEUDONORMAL);
    // A corner is pulled through to the other side.
    for (int axis = 0; axis < 3; axis++) {
        sphere.vertices[40][axis] = 2 * (axis == 0) - 1.5f * (sphere.vertices[40][axis] - (axis == 0));
    }
    CHECK_OK(fm_mesh_deform(mesh, (const float(*)[3])sphere.vertices, FM_TREE_REFIT));
    check_as_new(mesh, &sphere, FM_SIGN_WINDING);
    fm_mesh_destroy(mesh);
    scene_mesh_free(&sphere);
}

static void shadows_of(fm_mesh *mesh, float *shares) {
    const fm_deferred_desc desc = {
        .camera = {.position = {0, -6, 5}, .forward = {0, 6, -5}, .up = {0, 0, 1}, .fov_y = 45},
        .width = WIDTH,
        .height = HEIGHT,
        .surface = FM_SURFACE_MESH,
        .mesh = mesh,
        .shadows = FM_SHADOWS_MAP,
        .map_edge = 256,
        .light_count = 1,
        .lights = {{.way = {0.3f, 0.1f, 1}, .size = 2}},
    };
    fm_deferred *deferred = NULL;
    if (CHECK_OK(fm_deferred_create(context, &deferred))) {
        CHECK_OK(fm_deferred_render(deferred, &desc, NULL));
        CHECK_OK(fm_deferred_shares(deferred, shares));
    }
    fm_deferred_destroy(deferred);
}

static void check_shadows(fm_mesh *mesh, fm_mesh *fresh, float tolerance) {
    static float own[PIXELS], wanted[PIXELS];
    shadows_of(mesh, own);
    shadows_of(fresh, wanted);
    int different = 0, dark = 0, lit = 0;
    for (int i = 0; i < PIXELS; i++) {
        different += !(fabsf(own[i] - wanted[i]) <= tolerance);
        dark += wanted[i] == 0;
        lit += wanted[i] == 1;
    }
    if (!CHECK(different <= (tolerance > 0 ? PIXELS / 500 : 0)) || !CHECK(dark > 20 && lit > 100)) {
        fprintf(stderr, "    %d pixels differ, %d are dark, %d are lit\n", different, dark, lit);
    }
}

// A floor, and a ball that rises out of the box in which both lay.
static void moved(void) {
    const fm_transform3 here = {{{1, 0, 0, 0}, {0, 1, 0, 0}, {0, 0, 1, 0}}};
    const fm_transform3 there = {{{0, -1, 0, -0.3f}, {1, 0, 0, 0.2f}, {0, 0, 1, 1.5f}}};
    scene_mesh floor = scene_mesh_box((const float[]){-2, -2, -0.1f}, (const float[]){2, 2, 0});
    scene_mesh ball = scene_mesh_sphere(12, 16, (const float[]){0, 0, 0}, 0.5f);
    fm_mesh *parts[2] = {make(&floor), make(&ball)};
    fm_scene *scenes[2] = {NULL, NULL};
    for (int i = 0; i < 2; i++) {
        CHECK_OK(fm_scene_create(context, &scenes[i]));
        CHECK_OK(fm_scene_add(scenes[i], parts[0], &here, NULL));
        CHECK_OK(fm_scene_add(scenes[i], parts[1], i == 0 ? &here : &there, NULL));
        CHECK_OK(fm_scene_update(scenes[i], FM_TREE_REFIT, NULL));
    }
    fm_mesh *mesh = fm_scene_mesh(scenes[0]), *fresh = fm_scene_mesh(scenes[1]);
    fm_volume_desc grid = {.type = FM_TYPE_F32}, wanted = grid;
    CHECK_OK(fm_mesh_fit(mesh, 64, 0, &grid));
    CHECK_OK(fm_scene_move(scenes[0], 1, &there));
    CHECK_OK(fm_scene_update(scenes[0], FM_TREE_REFIT, NULL));
    CHECK_OK(fm_mesh_fit(mesh, 64, 0, &grid));
    CHECK_OK(fm_mesh_fit(fresh, 64, 0, &wanted));
    for (int axis = 0; axis < 3; axis++) {
        CHECK(fabs(grid.spacing[axis] - wanted.spacing[axis]) < 1e-5 && fabs(grid.origin[axis] - wanted.origin[axis]) < 0.1);
    }
    // Where a device has moved it, the box is a little larger, and texels of the map lie elsewhere by as much.
    const float tolerance = fm_context_backend(context) == FM_BACKEND_CPU ? 0 : 0.5f;
    check_shadows(mesh, fresh, tolerance);
    // Out of its own shape.
    for (uint64_t i = 0; i < ball.vertex_count; i++) {
        ball.vertices[i][2] += 1;
    }
    CHECK_OK(fm_scene_deform(scenes[0], 1, (const float(*)[3])ball.vertices));
    fm_scene *third = NULL;
    fm_mesh *deformed_ball = make(&ball);
    CHECK_OK(fm_scene_update(scenes[0], FM_TREE_REFIT, NULL));
    CHECK_OK(fm_scene_create(context, &third));
    CHECK_OK(fm_scene_add(third, parts[0], &here, NULL));
    CHECK_OK(fm_scene_add(third, deformed_ball, &there, NULL));
    CHECK_OK(fm_scene_update(third, FM_TREE_REFIT, NULL));
    check_shadows(mesh, fm_scene_mesh(third), tolerance);
    const float(*vertices)[3];
    fm_mesh_arrays(fm_scene_mesh(third), &vertices, NULL, NULL, NULL);
    CHECK_OK(fm_mesh_deform(fresh, vertices, FM_TREE_REFIT));
    check_shadows(fresh, fm_scene_mesh(third), 0);
    fm_mesh_destroy(deformed_ball);
    fm_scene_destroy(third);
    for (int i = 0; i < 2; i++) {
        fm_scene_destroy(scenes[i]);
        fm_mesh_destroy(parts[i]);
    }
    scene_mesh_free(&floor);
    scene_mesh_free(&ball);
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
    deformed();
    moved();
    vulkan_close(context);
    return check_summary();
}
