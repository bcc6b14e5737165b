// SPDX-License-Identifier: MIT
// Fields of meshes on Vulkan: distances against brute force in doubles, sides against exact winding numbers.

#include "mesh/gpu_mesh.h"
#include "mesh/sdf.h"
#include "mesh_gpu_common.h"
#include "volume/volume.h"

enum { SAMPLES = 300 };

typedef struct field {
    fm_volume *distance, *triangles;
    float *values;
    uint32_t *nearest;
    uint64_t texels;
} field;

typedef struct scene_grid {
    fm_shape shape;
    double spacing[3], origin[3];
    double widest;
} scene_grid;

// Around what fits of the mesh, cut through it, or beside it.
static scene_grid grid_for(const scene_mesh *mesh, fm_shape shape, bool cut) {
    float low[3], high[3];
    mesh_box(mesh, low, high);
    scene_grid g = {.shape = shape};
    const uint32_t sizes[3] = {shape.x, shape.y, shape.z};
    for (int axis = 0; axis < 3; axis++) {
        const double from = low[0] <= high[0] ? low[axis] : -1, to = low[0] <= high[0] ? high[axis] : 1;
        const double size = fmax(to - from, 0.1) * (cut ? 0.6 : 1.4);
        g.spacing[axis] = size / (sizes[axis] > 1 ? sizes[axis] - 1 : 1);
        g.origin[axis] = (from + to) / 2 - size / 2 + (cut ? 0.2 * size : 0);
        g.widest = fmax(g.widest, g.spacing[axis]);
    }
    return g;
}

static field make_field(fm_context *context, const scene_grid *g) {
    const uint64_t texels = fm_voxels(g->shape);
    fm_volume_desc desc = {.shape = g->shape, .type = FM_TYPE_F32};
    memcpy(desc.spacing, g->spacing, sizeof desc.spacing);
    memcpy(desc.origin, g->origin, sizeof desc.origin);
    field f = {.values = calloc(texels, sizeof(float)), .nearest = calloc(texels, sizeof(uint32_t)), .texels = texels};
    CHECK_OK(fm_volume_create(context, &desc, &f.distance));
    desc.type = FM_TYPE_U32;
    CHECK_OK(fm_volume_create(context, &desc, &f.triangles));
    CHECK(f.values && f.nearest);
    return f;
}

static void free_field(field *f) {
    fm_volume_destroy(f->distance);
    fm_volume_destroy(f->triangles);
    free(f->values);
    free(f->nearest);
}

static void read_field(field *f) {
    CHECK_OK(fm_volume_download(f->distance, f->values));
    CHECK_OK(fm_volume_download(f->triangles, f->nearest));
}

static fm_sdf_plan plan_for(const scene_grid *g, float band, fm_far far_texels, fm_sign sign) {
    fm_sdf_plan plan = {.shape = g->shape,
                        .band = far_texels == FM_FAR_EXACT ? INFINITY : (float)(band * g->widest),
                        .far_texels = far_texels,
                        .sign = sign};
    memcpy(plan.spacing, g->spacing, sizeof plan.spacing);
    memcpy(plan.origin, g->origin, sizeof plan.origin);
    return plan;
}

static void texel_at(const scene_grid *g, uint64_t i, float p[3]) {
    const uint64_t at[3] = {i % g->shape.x, i / g->shape.x % g->shape.y, i / g->shape.x / g->shape.y};
    for (int axis = 0; axis < 3; axis++) {
        p[axis] = (float)(g->origin[axis] + (double)at[axis] * g->spacing[axis]);
    }
}

// What the contract allows.
static double allowed(const scene_mesh *mesh, const scene_grid *g) {
    float low[3], high[3], corner[3];
    float most = mesh_box(mesh, low, high);
    texel_at(g, 0, corner);
    for (int axis = 0; axis < 3; axis++) {
        most = fmaxf(most, fabsf(corner[axis]));
    }
    texel_at(g, fm_voxels(g->shape) - 1, corner);
    for (int axis = 0; axis < 3; axis++) {
        most = fmaxf(most, fabsf(corner[axis]));
    }
    return 4.0 * (nextafterf(most, INFINITY) - most);
}

static void check_distances(const scene_mesh *mesh, const scene_grid *g, const fm_sdf_plan *plan, const field *f) {
    const double error = allowed(mesh, g);
    uint64_t seed = 3;
    uint32_t wrong = 0, elsewhere = 0, nearer = 0;
    for (int i = 0; i < SAMPLES; i++) {
        const uint64_t texel = test_random(&seed) % f->texels;
        float p[3];
        texel_at(g, texel, p);
        const double want = sqrt(oracle_nearest2(mesh, p)), got = fabs((double)f->values[texel]);
        if (want <= plan->band) {
            wrong += !(fabs(got - want) <= error) && !(got == INFINITY && want == INFINITY);
            const uint32_t triangle = f->nearest[texel];
            elsewhere += want <= plan->band - error && want < INFINITY &&
                         !(triangle < mesh->triangle_count && sqrt(oracle_distance2(mesh, triangle, p)) <= want + error);
        } else if (plan->far_texels == FM_FAR_BAND) {
            wrong += !(fabs(got - plan->band) <= error);
            elsewhere += want > plan->band + error && f->nearest[texel] != FM_NO_TRIANGLE;
        } else {
            // Flooded: never too near, and not more than a block's diagonal too far.
            nearer += !(got >= want - error) || (want < INFINITY && !(got <= want + 2 * 16 * 2 * g->widest));
        }
    }
    CHECK(wrong == 0);
    CHECK(elsewhere == 0);
    CHECK(nearer == 0);
}

// Inside is where the winding number is above 1/2, by pseudonormals too if the mesh is closed.
static void check_sides(const scene_mesh *mesh, const scene_grid *g, const field *f) {
    const double error = allowed(mesh, g);
    uint64_t seed = 3;
    uint32_t turned = 0;
    for (int i = 0; i < SAMPLES; i++) {
        const uint64_t texel = test_random(&seed) % f->texels;
        float p[3];
        texel_at(g, texel, p);
        const double winding = oracle_winding(mesh, p);
        const bool doubt = fabs((double)f->values[texel]) <= error || fabs(winding - 0.5) < 2e-3;
        turned += !doubt && (f->values[texel] < 0) != (winding > 0.5);
    }
    CHECK(turned == 0);
}

static void check_field(fm_mesh *mesh, const scene_mesh *source, const scene_grid *g, fm_sdf_plan plan) {
    field f = make_field(mesh->context, g);
    if (CHECK_OK(fm_gpu_mesh_sdf(mesh, &plan, f.distance, f.triangles, NULL))) {
        read_field(&f);
        check_distances(source, g, &plan, &f);
    }
    if (plan.sign == FM_SIGN_NONE) {
        uint64_t negative = 0;
        for (uint64_t i = 0; i < f.texels; i++) {
            negative += signbit(f.values[i]) != 0;
        }
        CHECK(negative == 0);
    } else {
        check_sides(source, g, &f);
    }
    free_field(&f);
}

// The same bits again, also in a context of its own.
static void check_repeats(fm_mesh *mesh, fm_mesh *other, const scene_grid *g, fm_sdf_plan plan) {
    field f = make_field(mesh->context, g);
    fm_mesh *const meshes[] = {mesh, other};
    float *values = calloc(f.texels, sizeof *values);
    uint32_t *nearest = calloc(f.texels, sizeof *nearest);
    for (int i = 0; CHECK(values && nearest) && i < 2; i++) {
        CHECK_OK(fm_gpu_mesh_sdf(meshes[i], &plan, f.distance, f.triangles, NULL));
        read_field(&f);
        CHECK(i == 0 || memcmp(f.values, values, f.texels * sizeof *values) == 0);
        CHECK(i == 0 || memcmp(f.nearest, nearest, f.texels * sizeof *nearest) == 0);
        memcpy(values, f.values, f.texels * sizeof *values);
        memcpy(nearest, f.nearest, f.texels * sizeof *nearest);
    }
    free(values);
    free(nearest);
    free_field(&f);
}

static void check_mesh(fm_context *context, scene_mesh *source, bool oriented) {
    static const fm_shape shapes[] = {{36, 17, 9}, {17, 4, 50}, {1, 1, 1}};
    const fm_mesh_desc desc = scene_mesh_describe(source);
    fm_mesh *mesh = NULL, *other = NULL;
    if (!CHECK_OK(fm_mesh_create(context, &desc, &mesh)) || !CHECK_OK(fm_mesh_create(context, &desc, &other))) {
        fm_mesh_destroy(mesh);
        return;
    }
    for (int i = 0; i < 3; i++) {
        const scene_grid whole = grid_for(source, shapes[i], false), cut = grid_for(source, shapes[i], true);
        const fm_sign sign = oriented ? FM_SIGN_PSEUDONORMAL : FM_SIGN_WINDING;
        check_field(mesh, source, &whole, plan_for(&whole, 3, FM_FAR_BAND, sign));
        check_field(mesh, source, &cut, plan_for(&cut, 1.5f, FM_FAR_FLOODED, sign));
        if (i == 0) {
            check_field(mesh, source, &whole, plan_for(&whole, 3, FM_FAR_BAND, FM_SIGN_NONE));
            check_field(mesh, source, &cut, plan_for(&cut, 3, FM_FAR_EXACT, FM_SIGN_WINDING));
            check_repeats(mesh, other, &whole, plan_for(&whole, 3, FM_FAR_BAND, sign));
        }
    }
    // What has moved has other normals and moments.
    for (uint64_t i = 0; i < source->vertex_count; i++) {
        source->vertices[i][0] += 0.2f * source->vertices[i][1];
    }
    CHECK_OK(fm_mesh_deform(mesh, (const float(*)[3])source->vertices, FM_TREE_REFIT));
    const scene_grid g = grid_for(source, shapes[0], false);
    check_field(mesh, source, &g, plan_for(&g, 3, FM_FAR_BAND, FM_SIGN_WINDING));
    if (oriented) {
        check_field(mesh, source, &g, plan_for(&g, 3, FM_FAR_BAND, FM_SIGN_PSEUDONORMAL));
    }
    fm_mesh_destroy(mesh);
    fm_mesh_destroy(other);
}

int main(int count, char **arguments) {
    vulkan_options options;
    if (!vulkan_parse(count, arguments, &options)) {
        return 2;
    }
    fm_context *context;
    if (vulkan_open(&options, NULL, &context) != FM_OK) {
        return vulkan_missing();
    }
    static named_mesh meshes[NAMED_MESHES];
    make_meshes(meshes);
    for (int i = 0; i < NAMED_MESHES; i++) {
        const int failures = check_failures;
        check_mesh(context, &meshes[i].mesh, meshes[i].oriented);
        if (check_failures > failures) {
            fprintf(stderr, "    so far with the mesh \"%s\"\n", meshes[i].name);
        }
        scene_mesh_free(&meshes[i].mesh);
    }
    vulkan_close(context);
    return check_summary();
}
