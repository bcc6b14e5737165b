// SPDX-License-Identifier: MIT
// Fields of meshes against sums over all triangles in double precision.

#include "check.h"
#include "fathom/sdf.h"
#include "mesh_oracle.h"
#include "vulkan_common.h"

#include <stdlib.h>
#include <string.h>

static fm_context *context;
static double worst;  // unsigned error in voxels of all fields

typedef struct field_case {
    const char *name;
    const scene_mesh *mesh;
    fm_volume_desc grid;
    fm_sign sign;    // asked for
    fm_sign wanted;  // used
} field_case;

static oracle_point texel_at(const fm_volume_desc *grid, uint32_t x, uint32_t y, uint32_t z) {
    return (oracle_point){grid->origin[0] + x * grid->spacing[0], grid->origin[1] + y * grid->spacing[1],
                          grid->origin[2] + z * grid->spacing[2]};
}

static double widest_of(const fm_volume_desc *grid) {
    return fmax(grid->spacing[0], fmax(grid->spacing[1], grid->spacing[2]));
}

// What all texels must hold, worked out once for a case.
typedef struct oracle_field {
    double *distance, *winding;
} oracle_field;

static oracle_field oracle_make(const field_case *c) {
    const fm_shape shape = c->grid.shape;
    const size_t count = (size_t)shape.x * shape.y * shape.z;
    oracle_field all = {malloc(count * sizeof(double)), malloc(count * sizeof(double))};
    size_t texel = 0;
    for (uint32_t z = 0; z < shape.z; z++) {
        for (uint32_t y = 0; y < shape.y; y++) {
            for (uint32_t x = 0; x < shape.x; x++, texel++) {
                const oracle_point p = texel_at(&c->grid, x, y, z);
                all.distance[texel] = oracle_distance(c->mesh, p);
                all.winding[texel] = c->wanted == FM_SIGN_NONE ? 0 : oracle_winding(c->mesh, p);
            }
        }
    }
    return all;
}

static void check_texel(const field_case *c, const fm_sdf_desc *desc, const oracle_field *oracle, size_t texel, float value,
                        uint32_t triangle, double band) {
    const double voxel = widest_of(&c->grid), distance = oracle->distance[texel], winding = oracle->winding[texel];
    const bool beyond = desc->far_texels == FM_FAR_BAND && distance > band;
    const double wanted = beyond ? band : distance;
    const double error = fabs(fabs((double)value) - wanted) / voxel;
    worst = fmax(worst, error);
    bool good = CHECK(error <= 1e-4);
    // On the surface, and where the winding number is 1/2, rounding decides.
    if (distance > 1e-5 * voxel && fabs(winding - 0.5) > 1e-6) {
        good = CHECK((value < 0) == (c->wanted != FM_SIGN_NONE && winding > 0.5)) && good;
    }
    const bool in_band = desc->far_texels == FM_FAR_EXACT || distance <= band;
    if (fabs(distance - band) > 1e-4 * voxel || desc->far_texels == FM_FAR_EXACT) {
        good = CHECK((triangle != FM_NO_TRIANGLE) == in_band) && good;
    }
    if (triangle != FM_NO_TRIANGLE && CHECK(triangle < c->mesh->triangle_count)) {
        const fm_shape shape = c->grid.shape;
        const uint32_t x = (uint32_t)(texel % shape.x), y = (uint32_t)(texel / shape.x % shape.y);
        const oracle_point p = texel_at(&c->grid, x, y, (uint32_t)(texel / shape.x / shape.y));
        good = CHECK(fabs(oracle_to_triangle(c->mesh, triangle, p) - distance) <= 1e-4 * voxel) && good;
    }
    if (!good && check_failures < 20) {
        fprintf(stderr, "    %s, far %d, texel %zu: %g where %g is right, winding number %g\n", c->name, (int)desc->far_texels,
                texel, (double)value, wanted, winding);
    }
}

static void check_field(const field_case *c, fm_mesh *mesh, const fm_sdf_desc *desc, const oracle_field *oracle) {
    fm_volume *distance = NULL, *triangles = NULL;
    fm_volume_desc grid = c->grid;
    grid.type = FM_TYPE_F32;
    fm_sdf_info info;
    const size_t count = (size_t)grid.shape.x * grid.shape.y * grid.shape.z;
    float *values = malloc(count * sizeof *values);
    uint32_t *nearest = malloc(count * sizeof *nearest);
    if (CHECK_OK(fm_volume_create(context, &grid, &distance))) {
        grid.type = FM_TYPE_U32;
        CHECK_OK(fm_volume_create(context, &grid, &triangles));
    }
    if (triangles && CHECK_OK(fm_mesh_sdf(mesh, desc, distance, triangles, &info, NULL)) &&
        CHECK_OK(fm_volume_download(distance, values)) && CHECK_OK(fm_volume_download(triangles, nearest))) {
        CHECK(info.sign == c->wanted);
        CHECK(info.sign_why && info.sign_why[0]);
        const double band = (desc->band > 0 ? (double)desc->band : 3) * widest_of(&c->grid);
        for (size_t i = 0; i < count; i++) {
            check_texel(c, desc, oracle, i, values[i], nearest[i], band);
        }
    }
    free(values);
    free(nearest);
    fm_volume_destroy(distance);
    fm_volume_destroy(triangles);
}

static void check_case(const field_case *c) {
    fm_mesh *mesh;
    const fm_mesh_desc desc = scene_mesh_describe(c->mesh);
    if (!CHECK_OK(fm_mesh_create(context, &desc, &mesh))) {
        return;
    }
    const oracle_field oracle = oracle_make(c);
    const double before = worst;
    worst = 0;
    for (fm_far far = FM_FAR_BAND; far <= FM_FAR_EXACT; far++) {
        // Flooded distances of a device may be too great far away.
        if (far != FM_FAR_FLOODED || fm_context_backend(context) == FM_BACKEND_CPU) {
            check_field(c, mesh, &(fm_sdf_desc){.far_texels = far, .sign = c->sign}, &oracle);
        }
    }
    check_field(c, mesh, &(fm_sdf_desc){.band = 0.25f, .sign = c->sign}, &oracle);
    printf("%s: error at most %.3g voxels\n", c->name, worst);
    worst = fmax(worst, before);
    free(oracle.distance);
    free(oracle.winding);
    fm_mesh_destroy(mesh);
}

static fm_volume_desc grid_of(uint32_t x, uint32_t y, uint32_t z, const double low[3], const double high[3]) {
    fm_volume_desc grid = {.shape = {x, y, z}};
    const uint32_t size[3] = {x, y, z};
    for (int axis = 0; axis < 3; axis++) {
        grid.spacing[axis] = size[axis] > 1 ? (high[axis] - low[axis]) / (size[axis] - 1) : 0.125;
        grid.origin[axis] = size[axis] > 1 ? low[axis] : (low[axis] + high[axis]) / 2;
    }
    return grid;
}

// Both, one after the other.
static scene_mesh join(scene_mesh a, scene_mesh b) {
    scene_mesh both = {0};
    both.vertices = malloc((a.vertex_count + b.vertex_count) * sizeof *both.vertices);
    both.triangles = malloc((a.triangle_count + b.triangle_count) * sizeof *both.triangles);
    both.vertex_count = a.vertex_count + b.vertex_count;
    both.triangle_count = a.triangle_count + b.triangle_count;
    memcpy(both.vertices, a.vertices, a.vertex_count * sizeof *a.vertices);
    memcpy(both.vertices + a.vertex_count, b.vertices, b.vertex_count * sizeof *b.vertices);
    memcpy(both.triangles, a.triangles, a.triangle_count * sizeof *a.triangles);
    for (uint64_t i = 0; i < b.triangle_count; i++) {
        for (int k = 0; k < 3; k++) {
            both.triangles[a.triangle_count + i][k] = b.triangles[i][k] + (uint32_t)a.vertex_count;
        }
    }
    scene_mesh_free(&a);
    scene_mesh_free(&b);
    return both;
}

// Triangles that share nothing; some without area, some not numbers, one huge.
static scene_mesh make_soup(void) {
    const float centre[3] = {0, 0, 0};
    scene_mesh soup = scene_mesh_soup(120, 7, centre, 2, 0.5f);
    for (uint64_t i = 0; i < soup.triangle_count; i += 10) {
        const uint32_t *corners = soup.triangles[i];
        float *a = soup.vertices[corners[0]], *b = soup.vertices[corners[1]], *c = soup.vertices[corners[2]];
        if (i % 40 == 0) {
            memcpy(b, a, sizeof *soup.vertices);
            memcpy(c, a, sizeof *soup.vertices);
        } else if (i % 40 == 10) {
            memcpy(c, b, sizeof *soup.vertices);
        } else if (i % 40 == 20) {
            a[1] = i % 80 == 20 ? NAN : INFINITY;
        } else {
            for (int axis = 0; axis < 3; axis++) {
                c[axis] = (a[axis] + b[axis]) / 2;
            }
        }
    }
    float(*last)[3] = &soup.vertices[soup.triangles[5][0]];
    (*last)[0] = -500;
    return soup;
}

// Thin triangles with a short edge at right angles to the long one, or beside it. Around y = 0, where floats tell the smallest.
static scene_mesh make_needles(void) {
    const float centre[3] = {0, 0, 0};
    scene_mesh needles = scene_mesh_soup(36, 3, centre, 2, 0.5f);
    for (uint64_t i = 0; i < needles.triangle_count; i++) {
        const uint32_t *corners = needles.triangles[i];
        float *a = needles.vertices[corners[0]], *b = needles.vertices[corners[1]], *c = needles.vertices[corners[2]];
        const float short_edge = powf(10, -2 - (float)(i % 12));
        a[1] = b[1] = 0;
        c[0] = i % 2 ? a[0] : nextafterf(b[0], 2);
        c[1] = i % 3 ? -short_edge : short_edge;
        c[2] = i % 2 ? a[2] : b[2];
    }
    return needles;
}

static void run_shapes(void) {
    static const float centre[3] = {0.01f, -0.02f, 0.03f};
    static const double low[3] = {-1.3, -1.2, -1.25}, high[3] = {1.2, 1.3, 1.25}, flat[3] = {1.2, 1.3, 0.4};
    scene_mesh sphere = scene_mesh_sphere(9, 14, centre, 1);
    scene_mesh torus = scene_mesh_torus(16, 9, centre, 0.8f, 0.3f);
    const float box_low[3] = {-1, -0.75f, -0.5f}, box_high[3] = {1, 0.5f, 0.75f};
    scene_mesh box = scene_mesh_box(box_low, box_high);
    scene_mesh sheet = scene_mesh_sheet(8, centre, 1.8f, 0.2f);
    scene_mesh tubes = scene_mesh_tubes(12, centre, 2);
    scene_mesh nested = join(scene_mesh_sphere(8, 12, centre, 1.1f), scene_mesh_sphere(7, 9, centre, 0.5f));
    scene_mesh soup = make_soup();
    scene_mesh needles = make_needles();
    const field_case cases[] = {
        {"sphere", &sphere, grid_of(23, 24, 25, low, high), FM_SIGN_AUTO, FM_SIGN_PSEUDONORMAL},
        {"sphere by winding", &sphere, grid_of(23, 24, 25, low, high), FM_SIGN_WINDING, FM_SIGN_WINDING},
        {"sphere, fine in a corner", &sphere, grid_of(34, 33, 17, (double[3]){0.4, 0.4, 0.4}, high), FM_SIGN_AUTO,
         FM_SIGN_PSEUDONORMAL},
        {"torus", &torus, grid_of(31, 29, 12, low, flat), FM_SIGN_AUTO, FM_SIGN_PSEUDONORMAL},
        {"torus, flat voxels", &torus, grid_of(37, 5, 12, low, high), FM_SIGN_AUTO, FM_SIGN_PSEUDONORMAL},
        {"torus, one slice", &torus, grid_of(1, 40, 33, low, high), FM_SIGN_AUTO, FM_SIGN_PSEUDONORMAL},
        {"torus, one row by winding", &torus, grid_of(1, 1, 90, low, high), FM_SIGN_WINDING, FM_SIGN_WINDING},
        {"box", &box, grid_of(21, 21, 21, low, high), FM_SIGN_AUTO, FM_SIGN_PSEUDONORMAL},
        {"box, texels on faces", &box, grid_of(17, 17, 17, (double[3]){-2, -2, -2}, (double[3]){2, 2, 2}), FM_SIGN_WINDING,
         FM_SIGN_WINDING},
        {"open sheet", &sheet, grid_of(24, 21, 19, low, high), FM_SIGN_AUTO, FM_SIGN_WINDING},
        {"open sheet, unsigned", &sheet, grid_of(24, 21, 19, low, high), FM_SIGN_NONE, FM_SIGN_NONE},
        {"tubes through each other", &tubes, grid_of(23, 24, 25, low, high), FM_SIGN_AUTO, FM_SIGN_WINDING},
        {"one sphere in another", &nested, grid_of(23, 24, 25, low, high), FM_SIGN_AUTO, FM_SIGN_WINDING},
        {"soup", &soup, grid_of(19, 20, 21, low, high), FM_SIGN_AUTO, FM_SIGN_WINDING},
        {"needles", &needles, grid_of(19, 20, 21, low, high), FM_SIGN_NONE, FM_SIGN_NONE},
        {"sphere far below the grid", &sphere, grid_of(9, 9, 9, (double[3]){20, 20, 20}, (double[3]){21, 21, 21}), FM_SIGN_AUTO,
         FM_SIGN_PSEUDONORMAL},
        {"within a sphere", &sphere, grid_of(9, 9, 9, (double[3]){-.05, -.05, -.05}, (double[3]){.05, .05, .05}), FM_SIGN_AUTO,
         FM_SIGN_PSEUDONORMAL},
    };
    for (size_t i = 0; i < sizeof cases / sizeof *cases; i++) {
        check_case(&cases[i]);
    }
    scene_mesh_free(&sphere);
    scene_mesh_free(&torus);
    scene_mesh_free(&box);
    scene_mesh_free(&sheet);
    scene_mesh_free(&tubes);
    scene_mesh_free(&nested);
    scene_mesh_free(&soup);
    scene_mesh_free(&needles);
}

// A grid that lies far from the origin, where texels are still whole floats.
static void run_far_away(void) {
    const float centre[3] = {4096, -8192, 2048};
    scene_mesh sphere = scene_mesh_sphere(9, 14, centre, 8);
    const double low[3] = {4086, -8202, 2038}, high[3] = {4106, -8182, 2058};
    const field_case far = {"far from the origin", &sphere, grid_of(21, 21, 21, low, high), FM_SIGN_AUTO, FM_SIGN_PSEUDONORMAL};
    check_case(&far);
    scene_mesh_free(&sphere);
}

static void run_empty(void) {
    fm_mesh *mesh;
    fm_volume *distance;
    const fm_volume_desc grid = {.shape = {3, 4, 5}, .type = FM_TYPE_F32, .spacing = {0.5, 0.5, 0.5}};
    float values[60];
    if (!CHECK_OK(fm_mesh_create(context, NULL, &mesh)) || !CHECK_OK(fm_volume_create(context, &grid, &distance))) {
        return;
    }
    for (fm_far far = FM_FAR_BAND; far <= FM_FAR_EXACT; far++) {
        fm_sdf_info info;
        CHECK_OK(fm_mesh_sdf(mesh, &(fm_sdf_desc){.far_texels = far}, distance, NULL, &info, NULL));
        CHECK_OK(fm_volume_download(distance, values));
        for (int i = 0; i < 60; i++) {
            CHECK(values[i] == (far == FM_FAR_BAND ? 1.5f : INFINITY));
        }
    }
    fm_volume_destroy(distance);
    fm_mesh_destroy(mesh);
}

static void run_arguments(void) {
    const float low[3] = {0, 0, 0}, high[3] = {1, 2, 4};
    scene_mesh box = scene_mesh_box(low, high);
    const fm_mesh_desc desc = scene_mesh_describe(&box);
    fm_mesh *mesh;
    fm_volume *distance, *bytes, *words;
    fm_volume_desc grid = {.shape = {4, 4, 4}, .type = FM_TYPE_F32};
    CHECK_OK(fm_mesh_create(context, &desc, &mesh));
    CHECK_OK(fm_volume_create(context, &grid, &distance));
    grid.type = FM_TYPE_U8;
    CHECK_OK(fm_volume_create(context, &grid, &bytes));
    grid = (fm_volume_desc){.shape = {4, 4, 5}, .type = FM_TYPE_U32};
    CHECK_OK(fm_volume_create(context, &grid, &words));
    CHECK_FAILS(fm_mesh_sdf(NULL, NULL, distance, NULL, NULL, NULL), FM_ERROR_INVALID_ARGUMENT);
    CHECK_FAILS(fm_mesh_sdf(mesh, NULL, NULL, NULL, NULL, NULL), FM_ERROR_INVALID_ARGUMENT);
    CHECK_FAILS(fm_mesh_sdf(mesh, NULL, bytes, NULL, NULL, NULL), FM_ERROR_INVALID_ARGUMENT);
    CHECK_FAILS(fm_mesh_sdf(mesh, NULL, distance, words, NULL, NULL), FM_ERROR_INVALID_ARGUMENT);
    CHECK_FAILS(fm_mesh_sdf(mesh, NULL, distance, bytes, NULL, NULL), FM_ERROR_INVALID_ARGUMENT);
    CHECK_FAILS(fm_mesh_sdf(mesh, &(fm_sdf_desc){.band = -1}, distance, NULL, NULL, NULL), FM_ERROR_INVALID_ARGUMENT);
    CHECK_FAILS(fm_mesh_sdf(mesh, &(fm_sdf_desc){.band = NAN}, distance, NULL, NULL, NULL), FM_ERROR_INVALID_ARGUMENT);
    CHECK_FAILS(fm_mesh_voxelize(mesh, NULL, distance, NULL), FM_ERROR_INVALID_ARGUMENT);
    CHECK_FAILS(fm_mesh_fit(mesh, 0, 0, &grid), FM_ERROR_INVALID_ARGUMENT);
    CHECK_FAILS(fm_mesh_fit(mesh, 8, 4, &grid), FM_ERROR_INVALID_ARGUMENT);
    CHECK_FAILS(fm_mesh_fit(mesh, 16385, 4, &grid), FM_ERROR_INVALID_ARGUMENT);
    CHECK_OK(fm_mesh_fit(mesh, 20, 2, &grid));
    CHECK(grid.shape.x == 8 && grid.shape.y == 12 && grid.shape.z == 20);
    CHECK(grid.spacing[0] == 0.25 && grid.spacing[2] == 0.25);
    CHECK(grid.origin[0] == -0.375 && grid.origin[1] == -0.375 && grid.origin[2] == -0.375);
    fm_volume_destroy(distance);
    fm_volume_destroy(bytes);
    fm_volume_destroy(words);
    fm_mesh_destroy(mesh);
    scene_mesh_free(&box);
}

static int allocations_left;

static void *counted_alloc(void *user, size_t size, size_t alignment) {
    (void)user;
    return allocations_left-- > 0 ? aligned_alloc(alignment, (size + alignment - 1) / alignment * alignment) : NULL;
}

static void counted_free(void *user, void *memory, size_t size) {
    (void)user, (void)size;
    free(memory);
}

// Each allocation in turn fails.
static void run_out_of_memory(fm_sign sign, const scene_mesh *shape) {
    const fm_allocator allocator = {counted_alloc, counted_free, NULL};
    const fm_context_desc desc = {.backend = FM_BACKEND_CPU, .threads = 2, .allocator = &allocator};
    const fm_mesh_desc about = scene_mesh_describe(shape);
    const fm_volume_desc grid = {.shape = {9, 9, 9}, .type = FM_TYPE_F32, .spacing = {0.3, 0.3, 0.3}, .origin = {-1.2, -1.2, -1.2}};
    fm_context *own;
    fm_mesh *mesh;
    fm_volume *distance;
    fm_result result = FM_ERROR_OUT_OF_HOST_MEMORY;
    int failed = 0;
    for (; result != FM_OK && failed < 200; failed++) {
        allocations_left = 1 << 20;
        if (!CHECK_OK(fm_context_create(&desc, &own))) {
            return;
        }
        CHECK_OK(fm_mesh_create(own, &about, &mesh));
        CHECK_OK(fm_volume_create(own, &grid, &distance));
        allocations_left = failed;
        result = fm_mesh_sdf(mesh, &(fm_sdf_desc){.sign = sign}, distance, NULL, NULL, NULL);
        CHECK(result == FM_OK || result == FM_ERROR_OUT_OF_HOST_MEMORY);
        allocations_left = 1 << 20;
        fm_volume_destroy(distance);
        fm_mesh_destroy(mesh);
        fm_context_destroy(own);
    }
    printf("%d allocations failed in turn\n", failed - 1);
    CHECK(result == FM_OK && failed > 5);
}

int main(int argc, char **argv) {
    vulkan_options options;
    if (!vulkan_parse(argc, argv, &options)) {
        return 2;
    }
    const bool vulkan = argc > 1;
    if (vulkan && vulkan_open(&options, NULL, &context) != FM_OK) {
        return vulkan_missing();
    }
    if (!vulkan && !CHECK_OK(fm_context_create(&(fm_context_desc){.backend = FM_BACKEND_CPU, .threads = 2}, &context))) {
        return check_summary();
    }
    run_shapes();
    run_far_away();
    run_empty();
    run_arguments();
    if (!vulkan) {
        const float centre[3] = {0, 0, 0};
        scene_mesh closed = scene_mesh_sphere(5, 8, centre, 1), open = scene_mesh_sheet(4, centre, 2, 0.1f);
        run_out_of_memory(FM_SIGN_AUTO, &closed);
        run_out_of_memory(FM_SIGN_WINDING, &closed);
        run_out_of_memory(FM_SIGN_WINDING, &open);
        scene_mesh_free(&closed);
        scene_mesh_free(&open);
    }
    printf("greatest unsigned error: %.3g voxels\n", worst);
    vulkan_close(context);
    return check_summary();
}
