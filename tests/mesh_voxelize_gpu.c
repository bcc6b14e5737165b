// SPDX-License-Identifier: MIT
// Voxels of meshes on Vulkan: bit for bit those of the rule that the kernels share with C, tried here for every triangle and voxel;
// and never fewer than the processor's, which are computed in double precision.

#include "fathom/sdf.h"
#include "mesh/voxel_grid.h"
#include "meshes.h"
#include "random.h"
#include "vulkan_common.h"

#include <math.h>

typedef struct sample {
    const char *name;
    scene_mesh mesh;
    fm_volume_desc grid;
    // Triangles so large that floats cannot tell what they touch: the processor's voxels may be far fewer.
    bool coarse;
} sample;

static bool fits(const float p[3]) {
    return fabsf(p[0]) <= 1e18f && fabsf(p[1]) <= 1e18f && fabsf(p[2]) <= 1e18f;
}

static void oracle_surface(const fm_voxel_triangle *t, bool thin, fm_shape shape, uint8_t *voxels) {
    for (int z = t->begin[2]; z < t->end[2]; z++) {
        for (int y = t->begin[1]; y < t->end[1]; y++) {
            for (int x = t->begin[0]; x < t->end[0]; x++) {
                voxels[(uint32_t)x + shape.x * ((uint32_t)y + (uint64_t)shape.y * (uint32_t)z)] |= fm_voxel_sets(*t, thin, x, y, z);
            }
        }
    }
}

static void oracle_crossings(const fm_voxel_triangle *t, fm_shape shape, int32_t *counts) {
    for (int z = 0; z < (int)shape.z; z++) {
        for (int y = 0; y < (int)shape.y; y++) {
            const int crossing = fm_voxel_crossing(*t, y, z);
            const int before = crossing != 0 ? fm_voxel_before(*t, crossing, y, z, (int)shape.x) : 0;
            for (int x = 0; x < before; x++) {
                counts[(uint32_t)x + shape.x * ((uint32_t)y + (uint64_t)shape.y * (uint32_t)z)] += crossing;
            }
        }
    }
}

// Rows beyond those that the rule calls candidates are tried too: they must not be crossed.
static void oracle(const sample *s, const fm_voxelize_desc *desc, uint8_t *voxels) {
    const fm_shape shape = s->grid.shape;
    const uint64_t count = (uint64_t)shape.x * shape.y * shape.z;
    int32_t *counts = calloc(count, sizeof *counts);
    const fm_voxel_grid grid = fm_voxel_grid_of(&s->grid);
    memset(voxels, 0, count);
    for (uint64_t i = 0; counts && i < s->mesh.triangle_count; i++) {
        float corners[3][3];
        for (int c = 0; c < 3; c++) {
            memcpy(corners[c], s->mesh.vertices[s->mesh.triangles[i][c]], sizeof corners[c]);
        }
        if (!fits(corners[0]) || !fits(corners[1]) || !fits(corners[2])) {
            continue;
        }
        const fm_voxel_triangle t = fm_voxel_axes(fm_voxel_box(grid, corners[0], corners[1], corners[2]));
        oracle_surface(&t, desc->separation == FM_SEPARATION_6, shape, voxels);
        if (desc->solid) {
            oracle_crossings(&t, shape, counts);
        }
    }
    for (uint64_t i = 0; counts && i < count; i++) {
        voxels[i] |= counts[i] > 0;
    }
    free(counts);
}

// Voxelises on `context` and downloads a byte a voxel.
static bool voxels_of(fm_context *context, fm_mesh *mesh, const sample *s, const fm_voxelize_desc *desc, fm_type type,
                      uint8_t *voxels) {
    fm_volume_desc grid = s->grid;
    grid.type = type;
    fm_volume *volume = NULL;
    uint64_t bytes = 0;
    bool good = CHECK_OK(fm_volume_create(context, &grid, &volume)) && CHECK_OK(fm_array_bytes(grid.shape, type, &bytes));
    uint8_t *raw = malloc(bytes + 1);
    // What was there before must go.
    memset(raw, 0xff, bytes);
    good = good && CHECK_OK(fm_volume_upload(volume, raw)) && CHECK_OK(fm_mesh_voxelize(mesh, desc, volume, NULL)) &&
           CHECK_OK(fm_volume_download(volume, raw));
    const uint64_t row_words = (grid.shape.x + 31) / 32;
    for (uint64_t row = 0; good && row < (uint64_t)grid.shape.y * grid.shape.z; row++) {
        for (uint32_t x = 0; x < grid.shape.x; x++) {
            const uint8_t *word = raw + (row * row_words + x / 32) * 4;
            voxels[row * grid.shape.x + x] = type == FM_TYPE_U8 ? raw[row * grid.shape.x + x] : word[x % 32 / 8] >> x % 8 & 1;
        }
        for (uint64_t x = grid.shape.x; type == FM_TYPE_BITS && x < 32 * row_words; x++) {
            CHECK((raw[(row * row_words + x / 32) * 4 + x % 32 / 8] >> x % 8 & 1) == 0);
        }
    }
    free(raw);
    fm_volume_destroy(volume);
    return good;
}

static void compare_host(fm_mesh *mesh, const sample *s, const fm_voxelize_desc *desc, fm_context *host, const uint8_t *device) {
    const uint64_t count = (uint64_t)s->grid.shape.x * s->grid.shape.y * s->grid.shape.z;
    uint8_t *voxels = malloc(count);
    uint64_t fewer = 0, more = 0, set = 0;
    if (voxels && voxels_of(host, mesh, s, desc, FM_TYPE_U8, voxels)) {
        for (uint64_t i = 0; i < count; i++) {
            set += voxels[i];
            fewer += voxels[i] && !device[i];
            more += !voxels[i] && device[i];
        }
        if (fewer + more > 0) {
            printf("%s, %s%s: %llu voxels by doubles, %llu more and %llu fewer by floats\n", s->name,
                   desc->separation == FM_SEPARATION_6 ? "thin" : "conservative", desc->solid ? ", solid" : "",
                   (unsigned long long)set, (unsigned long long)more, (unsigned long long)fewer);
        }
        // A centre on the surface itself may be inside for one and not for the other.
        CHECK(desc->solid || fewer == 0);
        CHECK(s->coarse || more + fewer <= 8 + set / 100);
    }
    free(voxels);
}

static void check_sample(fm_context *context, fm_context *host, const sample *s) {
    const uint64_t count = (uint64_t)s->grid.shape.x * s->grid.shape.y * s->grid.shape.z;
    const fm_mesh_desc desc = scene_mesh_describe(&s->mesh);
    fm_mesh *mesh = NULL, *host_mesh = NULL;
    uint8_t *wanted = malloc(count), *got = malloc(count);
    if (CHECK_OK(fm_mesh_create(context, &desc, &mesh)) && CHECK_OK(fm_mesh_create(host, &desc, &host_mesh)) && wanted && got) {
        for (int i = 0; i < 8; i++) {
            const fm_voxelize_desc what = {.separation = i & 1 ? FM_SEPARATION_6 : FM_SEPARATION_26, .solid = i & 2};
            const fm_type type = i & 4 ? FM_TYPE_U8 : FM_TYPE_BITS;
            oracle(s, &what, wanted);
            memset(got, 0xee, count);
            if (!voxels_of(context, mesh, s, &what, type, got)) {
                continue;
            }
            uint64_t wrong = 0;
            for (uint64_t v = 0; v < count; v++) {
                wrong += got[v] != wanted[v];
            }
            if (!CHECK(wrong == 0)) {
                fprintf(stderr, "    %s, %s, %s, %s: %llu of %llu voxels\n", s->name, fm_type_name(type), i & 1 ? "thin" : "full",
                        i & 2 ? "solid" : "surface", (unsigned long long)wrong, (unsigned long long)count);
            }
            if (type == FM_TYPE_BITS) {
                compare_host(host_mesh, s, &what, host, got);
            }
        }
    }
    free(wanted);
    free(got);
    fm_mesh_destroy(mesh);
    fm_mesh_destroy(host_mesh);
}

static fm_volume_desc grid_of(uint32_t x, uint32_t y, uint32_t z, double spacing_x, double spacing_y, double spacing_z) {
    const uint32_t size[3] = {x, y, z};
    fm_volume_desc grid = {.shape = {x, y, z}, .spacing = {spacing_x, spacing_y, spacing_z}};
    for (int i = 0; i < 3; i++) {
        grid.origin[i] = -(size[i] - 1.0) / 2 * grid.spacing[i];
    }
    return grid;
}

// Triangles from nine numbers each.
static scene_mesh mesh_of(const float (*corners)[3], uint32_t triangles) {
    scene_mesh mesh = {.vertices = malloc(triangles * 3 * sizeof *mesh.vertices),
                       .triangles = malloc(triangles * sizeof *mesh.triangles),
                       .vertex_count = 3 * (uint64_t)triangles,
                       .triangle_count = triangles};
    memcpy(mesh.vertices, corners, triangles * 3 * sizeof *mesh.vertices);
    for (uint32_t i = 0; i < 3 * triangles; i++) {
        mesh.triangles[i / 3][i % 3] = i;
    }
    return mesh;
}

static const float middle[3] = {0.1f, -0.07f, 0.03f};

static void check_shapes(fm_context *context, fm_context *host) {
    const sample samples[] = {
        {"a sphere", scene_mesh_sphere(12, 20, middle, 9), grid_of(24, 24, 24, 1, 1, 1), false},
        {"a fine sphere", scene_mesh_sphere(40, 60, middle, 9), grid_of(33, 20, 27, 0.7, 1.1, 0.9), false},
        {"a coarse torus in wide rows", scene_mesh_torus(5, 4, middle, 40, 13), grid_of(130, 34, 20, 1, 3.3, 2.1), false},
        {"an open sheet", scene_mesh_sheet(8, middle, 18, 4), grid_of(24, 24, 24, 1, 1, 1), false},
        {"two tubes", scene_mesh_tubes(16, middle, 20), grid_of(24, 24, 24, 1, 1, 1), false},
        {"a box on the voxels' faces", scene_mesh_box((float[3]){-4, -4, -4}, (float[3]){5, 3, 2}), grid_of(16, 16, 16, 1, 1, 1),
         false},
        {"a box on the voxels' centres", scene_mesh_box((float[3]){-4.5f, -4.5f, -4.5f}, (float[3]){3.5f, 2.5f, 1.5f}),
         grid_of(16, 16, 16, 1, 1, 1), false},
        {"a box in long rows", scene_mesh_box((float[3]){-2400, -1, -4}, (float[3]){2345, 1.2f, 4}), grid_of(5000, 3, 2, 1, 1, 1),
         false},
        {"a box around the grid", scene_mesh_box((float[3]){-40, -40, -40}, (float[3]){50, 30, 20}), grid_of(16, 16, 16, 1, 1, 1),
         false},
        {"a soup", scene_mesh_soup(300, 7, middle, 24, 5), grid_of(24, 24, 24, 1, 1, 1), false},
        {"a soup of large triangles", scene_mesh_soup(20, 8, middle, 60, 50), grid_of(80, 75, 70, 1, 1, 1), false},
        {"a soup in a plane of voxels", scene_mesh_soup(60, 9, middle, 12, 6), grid_of(1, 19, 23, 1, 1, 1), false},
        {"a soup in a row of voxels", scene_mesh_soup(60, 10, middle, 12, 6), grid_of(1, 1, 37, 1, 1, 0.5), false},
        {"a soup in a voxel", scene_mesh_soup(60, 11, middle, 4, 2), grid_of(1, 1, 1, 1, 1, 1), false},
        {"no triangle", {0}, grid_of(5, 4, 3, 1, 1, 1), false},
    };
    for (size_t i = 0; i < sizeof samples / sizeof *samples; i++) {
        check_sample(context, host, &samples[i]);
        scene_mesh copy = samples[i].mesh;
        scene_mesh_free(&copy);
    }
}

static void check_odd(fm_context *context, fm_context *host) {
    static const float degenerate[][3] = {{1, 1, 1},           {1, 1, 1},          {1, 1, 1},  // a point on a corner of voxels
                                          {0.5f, 0.5f, 0.5f},  {0.5f, 0.5f, 0.5f}, {0.5f, 0.5f, 0.5f}, {-3, -3, -3},  {3, 3, 3},
                                          {0, 0, 0},                                                 // a segment through corners
                                          {-3.2f, 1.1f, 0.3f}, {4.7f, 1.1f, 0.3f}, {1, 1.1f, 0.3f},  // along x
                                          {NAN, 0, 0},         {1, 2, 3},          {3, 2, 1},        // dropped
                                          {1, 2, 3},           {INFINITY, 0, 0},   {3, 2, 1},          {2e18f, 0, 0}, {1, 2, 3},
                                          {3, 2, 1},           {-4, 1e-30f, 2},    {4, -1e-30f, 2},    {0, 1e-38f, 2}};  // a sliver
    static const float huge[][3] = {{-1e6f, -1e6f, 1.3f}, {1e6f, -1e6f, 1.3f}, {0, 1e6f, 1.3f},  // across the whole grid
                                    {-1e5f, -3, -1e5f},   {1e5f, 2, -1e5f},    {0, 1, 1e5f}};
    static const float vast[][3] = {{-1e18f, -1e18f, 2}, {1e18f, -1e18f, 2}, {0, 1e18f, 2},
                                    {5e17f, 3, 1},       {-1e12f, -5, 0},    {2, 3, 1e18f}};
    const sample samples[] = {
        {"degenerate triangles", mesh_of(degenerate, 8), grid_of(12, 12, 12, 1, 1, 1), false},
        {"huge triangles", mesh_of(huge, 2), grid_of(20, 18, 16, 1, 1, 1), true},
        {"vast triangles", mesh_of(vast, 2), grid_of(9, 8, 7, 1, 1, 1), true},
        {"voxels of 1e-12", mesh_of(huge, 2), grid_of(9, 8, 7, 1e-12, 1e-12, 1e-12), true},
        {"voxels of 1e30", mesh_of(huge, 2), grid_of(9, 8, 7, 1e30, 1e30, 1e30), true},
    };
    for (size_t i = 0; i < sizeof samples / sizeof *samples; i++) {
        check_sample(context, host, &samples[i]);
        scene_mesh copy = samples[i].mesh;
        scene_mesh_free(&copy);
    }
    // Far from the origin floats of world units are coarse, those of the grid are not.
    sample far = {"a soup far away", scene_mesh_soup(100, 12, (float[3]){4096, -8192, 1024}, 20, 6), grid_of(20, 20, 20, 1, 1, 1),
                  false};
    for (int axis = 0; axis < 3; axis++) {
        far.grid.origin[axis] += (double[3]){4096, -8192, 1024}[axis];
    }
    check_sample(context, host, &far);
    scene_mesh_free(&far.mesh);
}

// Closed surfaces at any place: what is inside is what it is on paper, but for centres near the surface.
static void check_inside(fm_context *context) {
    uint64_t seed = 3;
    enum { N = 20 };
    static uint8_t voxels[N * N * N];
    for (int turn = 0; turn < 4; turn++) {
        const float centre[3] = {(float)test_between(&seed, -400, 400) / 100, (float)test_between(&seed, -400, 400) / 100,
                                 (float)test_between(&seed, -400, 400) / 100};
        sample s = {"a sphere somewhere", scene_mesh_sphere(60, 90, centre, 7), grid_of(N, N, N, 1, 1, 1), false};
        const fm_mesh_desc desc = scene_mesh_describe(&s.mesh);
        const fm_voxelize_desc what = {.separation = FM_SEPARATION_6, .solid = true};
        fm_mesh *mesh = NULL;
        if (CHECK_OK(fm_mesh_create(context, &desc, &mesh)) && voxels_of(context, mesh, &s, &what, FM_TYPE_BITS, voxels)) {
            for (int i = 0; i < N * N * N; i++) {
                const double p[3] = {s.grid.origin[0] + i % N, s.grid.origin[1] + i / N % N, s.grid.origin[2] + i / N / N};
                const double away = sqrt(pow(p[0] - centre[0], 2) + pow(p[1] - centre[1], 2) + pow(p[2] - centre[2], 2));
                CHECK(away > 6.95 || voxels[i]);
                CHECK(away < 7.9 || !voxels[i]);
            }
        }
        fm_mesh_destroy(mesh);
        scene_mesh_free(&s.mesh);
    }
}

int main(int count, char **arguments) {
    vulkan_options options;
    if (!vulkan_parse(count, arguments, &options)) {
        return 2;
    }
    fm_context *context = NULL, *host = NULL;
    const fm_context_desc on_host = {.backend = FM_BACKEND_CPU, .threads = 1};
    if (vulkan_open(&options, NULL, &context) != FM_OK || fm_context_create(&on_host, &host) != FM_OK) {
        return vulkan_missing();
    }
    check_shapes(context, host);
    check_odd(context, host);
    check_inside(context);
    // Inside is decided a few slices at a time.
    setenv("FATHOM_SCRATCH", "6000", 1);
    check_inside(context);
    fm_context_destroy(host);
    vulkan_close(context);
    return check_summary();
}
