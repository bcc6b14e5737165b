// SPDX-License-Identifier: MIT
// Fields of closed meshes on Vulkan in grids of all sorts against those of the CPU backend: sides that far texels get from near
// ones, and how much too great flooded distances are.

#include "fathom/sdf.h"
#include "mesh_gpu_common.h"

static fm_context *device, *processor;

typedef struct near_case {
    const char *name;
    const scene_mesh *mesh;
    fm_shape shape;
    double low[3], high[3];  // of the first and last texel; an axis of one texel lies at `low`
    float band;
    fm_sign sign;
} near_case;

// What a backend makes of a case.
static bool make_field(fm_context *context, const near_case *c, fm_far far, float *values) {
    const fm_mesh_desc about = scene_mesh_describe(c->mesh);
    const uint32_t sizes[3] = {c->shape.x, c->shape.y, c->shape.z};
    fm_volume_desc grid = {.shape = c->shape, .type = FM_TYPE_F32};
    for (int axis = 0; axis < 3; axis++) {
        grid.spacing[axis] = (c->high[axis] - c->low[axis]) / (sizes[axis] > 1 ? sizes[axis] - 1 : 16);
        grid.origin[axis] = c->low[axis];
    }
    fm_mesh *mesh = NULL;
    fm_volume *distance = NULL;
    const fm_sdf_desc desc = {.band = c->band, .far_texels = far, .sign = c->sign};
    const bool good = CHECK_OK(fm_mesh_create(context, &about, &mesh)) && CHECK_OK(fm_volume_create(context, &grid, &distance)) &&
                      CHECK_OK(fm_mesh_sdf(mesh, &desc, distance, NULL, NULL, NULL)) &&
                      CHECK_OK(fm_volume_download(distance, values));
    fm_volume_destroy(distance);
    fm_mesh_destroy(mesh);
    return good;
}

// Flooded distances are never too small, and hardly too great: by texels, where all of the surface lies far from the grid.
static void compare(const near_case *c, fm_far far, const float *got, const float *want, uint64_t count) {
    const uint32_t sizes[3] = {c->shape.x, c->shape.y, c->shape.z};
    double spacing = 0;
    for (int axis = 0; axis < 3; axis++) {
        spacing = fmax(spacing, (c->high[axis] - c->low[axis]) / (sizes[axis] > 1 ? sizes[axis] - 1 : 16));
    }
    uint64_t wrong = 0, turned = 0, exact = 0;
    double excess = 0, most = 0, coordinate = 1;
    for (int axis = 0; axis < 3; axis++) {
        coordinate = fmax(coordinate, fmax(fabs(c->low[axis]), fabs(c->high[axis])));
    }
    const double error = 8 * coordinate * (double)FLT_EPSILON;
    for (uint64_t i = 0; i < count; i++) {
        const double own = fabs((double)got[i]), right = fabs((double)want[i]);
        const double beyond = (own - right) / spacing;
        wrong += far == FM_FAR_FLOODED ? !(own >= right - error) : !(fabs(own - right) <= error);
        turned += right > error && (got[i] < 0) != (want[i] < 0);
        exact += own - right <= error;
        excess += beyond;
        most = fmax(most, beyond);
    }
    const double share = (double)exact / (double)count;
    if (!CHECK(wrong == 0) || !CHECK(turned == 0) || !CHECK(excess <= 1.3 * (double)count) || !CHECK(most <= 12)) {
        fprintf(stderr, "    %s, far %d: of %u x %u x %u texels %llu wrong, %llu on the other side\n", c->name, (int)far,
                c->shape.x, c->shape.y, c->shape.z, (unsigned long long)wrong, (unsigned long long)turned);
    }
    if (far == FM_FAR_FLOODED) {
        printf("%s: %.1f %% exact, on average %.2f texels too great, at most %.2f\n", c->name, 100 * share, excess / (double)count,
               most);
    }
}

static void check_case(const near_case *c) {
    const uint64_t count = (uint64_t)c->shape.x * c->shape.y * c->shape.z;
    float *got = malloc(count * sizeof *got), *want = malloc(count * sizeof *want);
    for (fm_far far = FM_FAR_BAND; CHECK(got && want) && far <= FM_FAR_FLOODED; far++) {
        if (make_field(device, c, far, got) && make_field(processor, c, far, want)) {
            compare(c, far, got, want, count);
        }
    }
    free(got);
    free(want);
}

// A sphere within another that is turned inside out: a shell.
static scene_mesh make_shell(void) {
    static const float centre[3] = {0, 0, 0};
    scene_mesh outer = scene_mesh_sphere(14, 20, centre, 1), inner = scene_mesh_sphere(9, 12, centre, 0.4f);
    scene_mesh shell = {.vertex_count = outer.vertex_count + inner.vertex_count,
                        .triangle_count = outer.triangle_count + inner.triangle_count};
    shell.vertices = malloc(shell.vertex_count * sizeof *shell.vertices);
    shell.triangles = malloc(shell.triangle_count * sizeof *shell.triangles);
    if (CHECK(shell.vertices && shell.triangles)) {
        memcpy(shell.vertices, outer.vertices, outer.vertex_count * sizeof *outer.vertices);
        memcpy(shell.vertices + outer.vertex_count, inner.vertices, inner.vertex_count * sizeof *inner.vertices);
        memcpy(shell.triangles, outer.triangles, outer.triangle_count * sizeof *outer.triangles);
        for (uint64_t i = 0; i < inner.triangle_count; i++) {
            for (int k = 0; k < 3; k++) {
                shell.triangles[outer.triangle_count + i][k] = inner.triangles[i][2 - k] + (uint32_t)outer.vertex_count;
            }
        }
    }
    scene_mesh_free(&outer);
    scene_mesh_free(&inner);
    return shell;
}

static void run_cases(void) {
    const fm_sign p = FM_SIGN_PSEUDONORMAL, w = FM_SIGN_WINDING, n = FM_SIGN_NONE;
    static const float centre[3] = {0.01f, -0.02f, 0.03f}, far_away[3] = {1000, -2000, 500};
    static const float low[3] = {-1, -0.9f, -0.1f}, high[3] = {1, 0.8f, 0.2f};
    scene_mesh sphere = scene_mesh_sphere(16, 24, centre, 1), torus = scene_mesh_torus(24, 12, centre, 0.8f, 0.25f);
    scene_mesh distant = scene_mesh_sphere(16, 24, far_away, 1), slab = scene_mesh_box(low, high), shell = make_shell();
    const near_case cases[] = {
        {"sphere, rows and slices beside it", &sphere, {61, 54, 47}, {-2.5, -1.9, -2.2}, {1.7, 2.3, 2.4}, 1, p},
        {"sphere by winding", &sphere, {61, 54, 47}, {-2.5, -1.9, -2.2}, {1.7, 2.3, 2.4}, 1, w},
        {"sphere, unsigned", &sphere, {37, 34, 45}, {-2.5, -1.9, -2.2}, {1.7, 2.3, 2.4}, 2, n},
        {"sphere, wide band", &sphere, {40, 41, 43}, {-1.5, -1.5, -1.5}, {1.5, 1.5, 1.5}, 9, p},
        {"sphere cut by the grid", &sphere, {48, 50, 44}, {0.1, -0.3, 0.2}, {1.4, 1.3, 1.5}, 1.5f, p},
        {"sphere cut on all sides", &sphere, {45, 45, 45}, {-0.8, -0.8, -0.8}, {0.8, 0.8, 0.8}, 1, p},
        {"shell", &shell, {64, 63, 62}, {-1.2, -1.2, -1.2}, {1.2, 1.2, 1.2}, 0.5f, p},
        {"shell by winding", &shell, {64, 63, 62}, {-1.2, -1.2, -1.2}, {1.2, 1.2, 1.2}, 0.5f, w},
        {"shell, within its hollow", &shell, {20, 21, 22}, {-0.1, -0.1, -0.1}, {0.1, 0.1, 0.1}, 3, p},
        {"within a sphere", &sphere, {21, 20, 19}, {-0.1, -0.1, -0.1}, {0.1, 0.1, 0.1}, 3, p},
        {"beside a sphere", &sphere, {21, 20, 19}, {1.5, 1.5, 1.5}, {1.7, 1.7, 1.7}, 3, p},
        {"beside a sphere by winding", &sphere, {21, 20, 19}, {1.5, 1.5, 1.5}, {1.7, 1.7, 1.7}, 3, w},
        {"torus, a slice", &torus, {70, 66, 1}, {-1.4, -1.4, 0.05}, {1.4, 1.4, 0.06}, 2, p},
        {"torus, a slice along x", &torus, {1, 70, 66}, {0.7, -1.4, -0.7}, {0.8, 1.4, 0.7}, 2, p},
        {"torus, a row", &torus, {131, 1, 1}, {-1.4, 0.1, 0.05}, {1.4, 0.2, 0.1}, 1, p},
        {"torus, flat texels", &torus, {16, 90, 45}, {-1.4, -1.4, -0.7}, {1.4, 1.4, 0.7}, 0.25f, p},
        {"torus, flat texels by winding", &torus, {80, 12, 40}, {-1.4, -1.4, -0.7}, {1.4, 1.4, 0.7}, 0.25f, w},
        {"large triangles", &slab, {160, 150, 9}, {-1.1, -1.1, -0.3}, {1.1, 1.1, 0.4}, 1, p},
        {"far from the origin", &distant, {40, 40, 40}, {998.6, -2001.4, 498.6}, {1001.4, -1998.6, 501.4}, 2, p},
    };
    for (size_t i = 0; i < sizeof cases / sizeof *cases; i++) {
        check_case(&cases[i]);
    }
    scene_mesh *const all[] = {&sphere, &torus, &distant, &slab, &shell};
    for (size_t i = 0; i < sizeof all / sizeof *all; i++) {
        scene_mesh_free(all[i]);
    }
}

int main(int count, char **arguments) {
    vulkan_options options;
    if (!vulkan_parse(count, arguments, &options)) {
        return 2;
    }
    if (vulkan_open(&options, NULL, &device) != FM_OK) {
        return vulkan_missing();
    }
    if (CHECK_OK(fm_context_create(&(fm_context_desc){.backend = FM_BACKEND_CPU, .threads = 2}, &processor))) {
        run_cases();
    }
    fm_context_destroy(processor);
    vulkan_close(device);
    return check_summary();
}
