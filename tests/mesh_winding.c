// SPDX-License-Identifier: MIT
// Winding numbers by moments against the sum of all solid angles.

#include "mesh_gpu_common.h"

enum { POSITIONS = 400 };

static fm_context *context;

static fm_mesh *make(const scene_mesh *from) {
    const fm_mesh_desc desc = scene_mesh_describe(from);
    fm_mesh *mesh = NULL;
    CHECK_OK(fm_mesh_create(context, &desc, &mesh));
    return mesh;
}

static void choose_positions(const scene_mesh *shape, float (*positions)[3], uint64_t seed) {
    float low[3], high[3];
    mesh_box(shape, low, high);
    for (int i = 0; i < POSITIONS; i++) {
        for (int axis = 0; axis < 3; axis++) {
            const float wide = i % 8 == 0 ? 3 * (high[axis] - low[axis]) : 0.2f * (high[axis] - low[axis]);
            positions[i][axis] =
                low[axis] <= high[axis] ? uniform(&seed, low[axis] - wide, high[axis] + wide) : uniform(&seed, -1, 1);
        }
    }
}

// Moments to the second order leave an error that falls with the fourth power of the accuracy at least.
static void check_mesh(const char *name, const scene_mesh *shape, fm_mesh *mesh, double worst) {
    float positions[POSITIONS][3], all[POSITIONS], winding[POSITIONS];
    choose_positions(shape, positions, 3);
    CHECK_OK(fm_mesh_winding(mesh, (const float(*)[3])positions, POSITIONS, INFINITY, all));
    bool good = true;
    for (int i = 0; i < POSITIONS; i++) {
        good = CHECK(fabs(all[i] - oracle_winding(shape, positions[i])) < 1e-6 * (1 + fabsf(all[i]))) && good;
    }
    for (int accuracy = 0; accuracy <= 8; accuracy += 2) {
        CHECK_OK(fm_mesh_winding(mesh, (const float(*)[3])positions, POSITIONS, (float)accuracy, winding));
        const double least = accuracy == 0 ? 2 : accuracy;
        for (int i = 0; i < POSITIONS; i++) {
            good = CHECK(fabsf(winding[i] - all[i]) <= (worst * pow(2 / least, 4) + 2e-6) * (1 + fabsf(all[i]))) && good;
        }
    }
    if (!good) {
        fprintf(stderr, "    winding numbers of %s\n", name);
    }
}

// Where a closed mesh goes around once, twice, not at all.
static void whole_numbers(void) {
    scene_mesh tubes = scene_mesh_tubes(48, (const float[]){500, -300, 200}, 2);
    fm_mesh *mesh = make(&tubes);
    const float positions[][3] = {
        {500, -300, 200.01f}, {500.7f, -300, 200}, {500, -299.3f, 200}, {500.7f, -299.3f, 200}, {0, 0, 0}};
    const float expected[] = {2, 1, 1, 0, 0};
    float winding[5];
    CHECK_OK(fm_mesh_winding(mesh, positions, 5, 0, winding));
    for (int i = 0; i < 5; i++) {
        CHECK(fabsf(winding[i] - expected[i]) < 0.01f);
    }
    fm_mesh_destroy(mesh);
    scene_mesh_free(&tubes);
}

// Moments follow vertices that move.
static void deformed(void) {
    scene_mesh shape = scene_mesh_torus(30, 20, (const float[]){0, 0, 0}, 1, 0.3f);
    fm_mesh *mesh = make(&shape);
    uint64_t seed = 9;
    for (int round = 0; round < 3; round++) {
        check_mesh("a deformed torus", &shape, mesh, 0.005);
        for (uint64_t i = 0; i < shape.vertex_count; i++) {
            for (int axis = 0; axis < 3; axis++) {
                shape.vertices[i][axis] = 3 * shape.vertices[i][axis] + uniform(&seed, -0.05f, 0.05f);
            }
        }
        CHECK_OK(fm_mesh_deform(mesh, (const float(*)[3])shape.vertices, round == 1 ? FM_TREE_REBUILD : FM_TREE_REFIT));
    }
    fm_mesh_destroy(mesh);
    scene_mesh_free(&shape);
}

int main(void) {
    if (!CHECK_OK(fm_context_create(&(fm_context_desc){.backend = FM_BACKEND_CPU, .threads = 2}, &context))) {
        return check_summary();
    }
    named_mesh meshes[NAMED_MESHES];
    make_meshes(meshes);
    for (int i = 0; i < NAMED_MESHES; i++) {
        fm_mesh *mesh = make(&meshes[i].mesh);
        // Of 1,200 in one place the errors add up.
        check_mesh(meshes[i].name, &meshes[i].mesh, mesh, strcmp(meshes[i].name, "all equal") == 0 ? 0.03 : 0.005);
        fm_mesh_destroy(mesh);
        scene_mesh_free(&meshes[i].mesh);
    }
    whole_numbers();
    deformed();
    fm_context_destroy(context);
    return check_summary();
}
