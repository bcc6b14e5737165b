// SPDX-License-Identifier: MIT
// Octrees of meshes as they come: empty, flat, torn, outside of the box; of every small size; with little memory; and what merging
// may change.

#include "octree_build_common.h"

#include "faulty.h"

#include <stdio.h>

static const float CENTRE[3] = {0.1f, -0.2f, 0.3f};

typedef struct odd_check {
    const scene_mesh *mesh;
    uint64_t seed;
    double volume;
    uint64_t leaves;
    double threshold, worst;  // finest cells
} odd_check;

// Of leaves a corner, of empty ones a place.
static void check_odd(void *user, const fm_octree *octree, const tree_node *node) {
    odd_check *check = user;
    const double edge = (double)(1u << node->level), cell = octree->info.cell;
    double cells[3];
    bool inside = true;
    const uint32_t corner = (uint32_t)test_random(&check->seed) & 7;
    for (int axis = 0; axis < 3; axis++) {
        const double part = tree_is_empty(node) ? tree_uniform(&check->seed) : corner >> axis & 1;
        cells[axis] = (node->at[axis] + part) * edge;
        inside = inside && cells[axis] <= octree->info.cells[axis];
    }
    check->volume += edge * edge * edge;
    check->leaves += !tree_is_empty(node);
    const double distance = oracle_distance(check->mesh, tree_place(octree, cells));
    if (tree_is_empty(node)) {
        CHECK(!inside || distance >= tree_bound(octree, node));
        return;
    }
    const fm_v3 v = tree_vector(octree, node, corner);
    CHECK(fabs(sqrt((double)fm_dot(v, v)) - distance) <= 2e-4 * edge * cell);
}

static void check_mesh(fm_context *context, const scene_mesh *mesh, const fm_octree_desc *desc, bool leaves) {
    const fm_mesh_desc what = scene_mesh_describe(mesh);
    fm_mesh *own = NULL;
    fm_octree *octree = NULL;
    fm_octree_desc filled = *desc;
    filled.code = FM_OCTREE_FLOATS;
    if (CHECK_OK(fm_mesh_create(context, &what, &own)) && CHECK_OK(fm_octree_build_mesh(own, &filled, &octree))) {
        odd_check check = {.mesh = mesh, .seed = 5};
        tree_leaves(octree, check_odd, &check);
        const fm_octree_info *info = &octree->info;
        CHECK(check.volume == pow((double)(1u << info->levels), 3) * info->top[0] * info->top[1] * info->top[2]);
        CHECK((check.leaves > 0) == leaves);
        fm_octree_destroy(octree);
        octree = NULL;
        for (int kind = FM_OCTREE_DISTANCE; kind <= FM_OCTREE_BRICKS; kind += FM_OCTREE_BRICKS - FM_OCTREE_DISTANCE) {
            filled.kind = (fm_octree_kind)kind;
            CHECK_OK(fm_octree_build_mesh(own, &filled, &octree));
            fm_octree_destroy(octree);
            octree = NULL;
        }
    }
    fm_mesh_destroy(own);
}

// Triangles beyond the box, and of other chunks, are as near as they are; boxes that are not of whole coarse cells.
static void test_beyond(fm_context *context) {
    for (int i = 0; i < 40; i++) {
        const float inside = 4 + (float)(i % 4) * 3, beyond = (float)(i % 5) * 3 + 1.5f, wide = i % 2 ? 64 : 30;
        float places[6][3] = {{inside, 20, 20}, {inside, 21, 20}, {inside, 20, 21},
                              {-99, -99, -99},  {299, -99, -99},  {-99, 299, 299}};
        for (int k = 3; k < 6; k++) {
            places[k][i % 3] = wide + beyond;
        }
        if (i % 3 == 0) {
            places[4][1] = 299;
        }
        uint32_t two[][3] = {{0, 1, 2}, {3, 4, 5}};
        const scene_mesh apart = {places, two, 6, 2};
        const fm_octree_desc desc = {.size = (uint32_t)wide,
                                     .low = {0, 0, 0},
                                     .high = {wide, wide, wide},
                                     .top_bytes = 4,
                                     .method = i / 2 % 2 ? FM_OCTREE_GROWN : FM_OCTREE_EXACT};
        check_mesh(context, &apart, &desc, true);
    }
}

static void test_odd(fm_context *context) {
    float vertices[][3] = {{0, 0, 0}, {1, 0, 0}, {0, 1, 0}, {0, 0, 1}, {1, 1, 1}, {0.5f, 0.5f, 0.5f}, {NAN, 0, 0}, {2e18f, 0, 0}};
    uint32_t none[][3] = {{0, 1, 6}, {0, 1, 7}}, point[][3] = {{5, 5, 5}}, line[][3] = {{0, 4, 4}, {0, 4, 5}};
    uint32_t flat[][3] = {{0, 1, 2}}, fan[][3] = {{0, 1, 2}, {0, 1, 3}, {0, 1, 4}, {1, 0, 2}, {0, 1, 2}};
    uint32_t mixed[][3] = {{0, 1, 2}, {0, 1, 6}, {4, 4, 4}};
    const scene_mesh meshes[] = {{vertices, none, 8, 0}, {vertices, none, 8, 2}, {vertices, point, 8, 1}, {vertices, line, 8, 2},
                                 {vertices, flat, 8, 1}, {vertices, fan, 8, 5},  {vertices, mixed, 8, 3}};
    for (size_t i = 0; i < sizeof meshes / sizeof *meshes; i++) {
        check_mesh(context, &meshes[i], &(fm_octree_desc){.size = 16}, i >= 2);
        check_mesh(context, &meshes[i], &(fm_octree_desc){.size = 13, .method = FM_OCTREE_GROWN}, i >= 2);
    }
    for (uint32_t size = 1; size <= 10; size++) {
        check_mesh(context, &meshes[5], &(fm_octree_desc){.size = size, .method = size % 2 ? FM_OCTREE_EXACT : FM_OCTREE_GROWN},
                   true);
    }
    // A box that misses the mesh, one that is within it, ones that cut it, and a long one.
    const fm_octree_desc boxes[] = {
        {.size = 40, .low = {5, 5, 5}, .high = {6, 6, 6}},
        {.size = 40, .low = {1.8f, -0.5f, 0}, .high = {2.8f, 0.5f, 1}},
        {.size = 16, .low = {-0.1f, -0.3f, 0.2f}, .high = {0.1f, -0.1f, 0.4f}},
        {.size = 20, .low = {0, 0, 0}, .high = {1, 2, 3}},
        {.size = 140, .low = {-1, 0, 0}, .high = {1.3f, 0.05f, 0.02f}, .top_bytes = 4},
        {.size = 3000, .low = {-100, -0.2f, 0.3f}, .high = {100, -0.1f, 0.35f}, .top_bytes = 4},
    };
    scene_mesh sphere = scene_mesh_sphere(8, 12, CENTRE, 1);
    for (size_t i = 0; i < sizeof boxes / sizeof *boxes; i++) {
        check_mesh(context, &sphere, &boxes[i], i >= 3);
    }
    fm_octree_desc huge = {.size = 1 << 20, .low = {-1, -1, -1}, .high = {1, 1, 1}};
    const fm_mesh_desc what = scene_mesh_describe(&sphere);
    fm_mesh *mesh = NULL;
    fm_octree *octree = NULL;
    CHECK_OK(fm_mesh_create(context, &what, &mesh));
    CHECK_FAILS(fm_octree_build_mesh(mesh, &huge, &octree), FM_ERROR_UNSUPPORTED);
    CHECK(strstr(fm_last_error(), "at most 67108864 are possible") != NULL);
    // A chunk too many along one axis of 2^26, in pieces too; and boxes that floats do not carry.
    const fm_octree_desc more = {.size = 512 * 128 + 1, .low = {0, 0, 0}, .high = {2, 2, 1}};
    fm_octree_builder *builder = NULL;
    CHECK_FAILS(fm_octree_build_mesh(mesh, &more, &octree), FM_ERROR_UNSUPPORTED);
    CHECK_FAILS(fm_octree_builder_create(context, &more, &builder), FM_ERROR_UNSUPPORTED);
    CHECK(strstr(fm_last_error(), "at most 67108864 are possible") != NULL && !octree && !builder);
    const fm_octree_desc boxes_beyond[] = {{.size = 16, .low = {-3e38f, -3e38f, -3e38f}, .high = {3e38f, 3e38f, 3e38f}},
                                           {.size = 16, .low = {0, 0, 0}, .high = {3e18f, 1e18f, 1e18f}},
                                           {.size = 16, .low = {0, 0, 0}, .high = {1e-18f, 1e-18f, 1e-18f}},
                                           {.kind = FM_OCTREE_VOXELS, .low = {0, 0, 0}, .high = {1e-40f, 1e-40f, 1e-40f}}};
    for (size_t i = 0; i < sizeof boxes_beyond / sizeof *boxes_beyond; i++) {
        CHECK_FAILS(fm_octree_build_mesh(mesh, &boxes_beyond[i], &octree), FM_ERROR_INVALID_ARGUMENT);
        CHECK(strstr(fm_last_error(), "cells of") != NULL);
    }
    fm_mesh_destroy(mesh);
    scene_mesh_free(&sphere);
}

// --- Sheets, and what kinds keep ---

// A sheet has no inside: rays must meet what AUTO makes of it, from both sides.
static void test_sheet(fm_context *context) {
    float vertices[][3] = {{-1, -1, 0.13f}, {1, -1, 0.13f}, {1, 1, 0.13f}, {-1, 1, 0.13f}};
    uint32_t triangles[][3] = {{0, 1, 2}, {0, 2, 3}};
    const scene_mesh quad = {vertices, triangles, 4, 2};
    const fm_octree_kind kinds[] = {FM_OCTREE_DISTANCE, FM_OCTREE_BRICKS};
    const fm_mesh_desc what = scene_mesh_describe(&quad);
    fm_mesh *mesh = NULL;
    if (!CHECK_OK(fm_mesh_create(context, &what, &mesh))) {
        return;
    }
    for (int k = 0; k < 2; k++) {
        const fm_octree_desc desc = {.kind = kinds[k], .size = 107};
        fm_octree *octree = NULL;
        enum { RAYS = 300 };
        fm_mesh_ray rays[RAYS];
        fm_octree_hit hits[RAYS];
        uint64_t seed = 3;
        for (int i = 0; i < RAYS; i++) {
            const float side = i % 2 ? 1 : -1;
            rays[i] = (fm_mesh_ray){{(float)tree_uniform(&seed) * 1.8f - 0.9f, (float)tree_uniform(&seed) * 1.8f - 0.9f, 2 * side},
                                    0,
                                    {0.01f, 0.02f, -side},
                                    INFINITY};
        }
        int missed = 0;
        if (CHECK_OK(fm_octree_build_mesh(mesh, &desc, &octree)) && CHECK_OK(fm_octree_cast(octree, rays, RAYS, 0, hits))) {
            CHECK(octree->info.sign == FM_SIGN_NONE);
            for (int i = 0; i < RAYS; i++) {
                const double wanted = 2 - (i % 2 ? 1 : -1) * 0.13;
                missed += !(fabs((double)hits[i].t - wanted) < octree->info.cell);
            }
            printf("a sheet of kind %d: %d of %d rays miss it\n", (int)kinds[k], missed, RAYS);
            CHECK(missed == 0);
        }
        fm_octree_destroy(octree);
    }
    fm_mesh_destroy(mesh);
}

static void test_attributes(fm_context *context) {
    scene_mesh sphere = scene_mesh_sphere(5, 6, CENTRE, 1);
    uint8_t colors[64][4] = {{0}};
    float texture[64][2] = {{0}};
    const fm_mesh_desc what = scene_mesh_describe(&sphere);
    fm_mesh *mesh = NULL;
    CHECK(sphere.vertex_count <= 64);
    CHECK_OK(fm_mesh_create(context, &what, &mesh));
    for (int kind = 0; mesh && kind < FM_OCTREE_KINDS; kind++) {
        const bool all = kind == FM_OCTREE_CLOSEST;
        const bool numbers = kind == FM_OCTREE_VOXELS || kind == FM_OCTREE_CONTOURS || kind == FM_OCTREE_TREE64;
        for (int attribute = 0; attribute <= FM_OCTREE_TEXTURE; attribute++) {
            const fm_octree_desc desc = {.kind = (fm_octree_kind)kind,
                                         .size = 12,
                                         .attribute = (fm_octree_attribute)attribute,
                                         .colors = (const uint8_t(*)[4])colors,
                                         .texture = (const float(*)[2])texture};
            fm_octree *octree = NULL;
            if (attribute == FM_OCTREE_PLAIN || all || (numbers && attribute != FM_OCTREE_TEXTURE)) {
                CHECK_OK(fm_octree_build_mesh(mesh, &desc, &octree));
                CHECK(octree && octree->info.attribute == desc.attribute);
            } else {
                CHECK_FAILS(fm_octree_build_mesh(mesh, &desc, &octree), FM_ERROR_INVALID_ARGUMENT);
                CHECK(!octree && strstr(fm_last_error(), "FM_OCTREE_CLOSEST keeps all") != NULL);
            }
            fm_octree_destroy(octree);
        }
    }
    const fm_octree_desc streamed = {
        .kind = FM_OCTREE_DISTANCE, .size = 12, .high = {1, 1, 1}, .sign = FM_SIGN_NONE, .attribute = FM_OCTREE_TRIANGLE};
    fm_octree_builder *builder = NULL;
    CHECK_FAILS(fm_octree_builder_create(context, &streamed, &builder), FM_ERROR_INVALID_ARGUMENT);
    fm_mesh_destroy(mesh);
    scene_mesh_free(&sphere);
}

// --- Merging ---

static void check_merged(void *user, const fm_octree *octree, const tree_node *node) {
    odd_check *check = user;
    const uint32_t edge = 1u << node->level;
    if (tree_is_empty(node) || node->level == 0) {
        return;
    }
    check->leaves++;
    fm_v3 v[8];
    for (uint32_t corner = 0; corner < 8; corner++) {
        v[corner] = fm_times(tree_vector(octree, node, corner), 1 / (float)(edge * octree->info.cell));
    }
    for (uint32_t i = 0; i < (edge + 1) * (edge + 1) * (edge + 1); i++) {
        const uint32_t part[3] = {i % (edge + 1), i / (edge + 1) % (edge + 1), i / (edge + 1) / (edge + 1)};
        double cells[3];
        for (int axis = 0; axis < 3; axis++) {
            cells[axis] = node->at[axis] * (double)edge + part[axis];
        }
        const double distance = oracle_distance(check->mesh, tree_place(octree, cells)) / octree->info.cell;
        const bool half = part[0] % (edge / 2) == 0 && part[1] % (edge / 2) == 0 && part[2] % (edge / 2) == 0;
        if (distance <= sqrt(3) || (half && distance <= 2 * sqrt(3))) {
            const float scale = 1 / (float)edge;
            const fm_v3 at = {(float)part[0] * scale, (float)part[1] * scale, (float)part[2] * scale};
            const fm_v3 said = fm_vcp_between(v, at);
            const double off = fabs(sqrt((double)fm_dot(said, said)) * edge - distance);
            check->worst = fmax(check->worst, off);
            CHECK(off <= check->threshold + 1e-3);
        }
    }
}

static void test_merged(fm_context *context) {
    static const float thresholds[] = {-1, 0, 0.2f, 1};
    scene_mesh meshes[] = {scene_mesh_sphere(20, 24, CENTRE, 1), scene_mesh_box((const float[3]){-1, -0.5f, -0.2f}, CENTRE)};
    for (int m = 0; m < 2; m++) {
        const fm_mesh_desc what = scene_mesh_describe(&meshes[m]);
        fm_mesh *mesh = NULL;
        CHECK_OK(fm_mesh_create(context, &what, &mesh));
        uint64_t before = 0;
        for (int i = 0; i < 4; i++) {
            const fm_octree_desc desc = {.size = 32, .code = FM_OCTREE_FLOATS, .threshold = thresholds[i]};
            fm_octree *octree = NULL;
            if (CHECK_OK(fm_octree_build_mesh(mesh, &desc, &octree))) {
                odd_check check = {.mesh = &meshes[m], .threshold = i == 1 ? 0.05 : (double)thresholds[i]};
                tree_leaves(octree, check_merged, &check);
                printf("threshold %g: %llu leaves merged, off by %.4f cells at most\n", (double)thresholds[i],
                       (unsigned long long)check.leaves, check.worst);
                CHECK(i == 0 ? check.leaves == 0 : check.leaves > 0);
                CHECK(i == 0 || octree->info.leaf_bytes <= before);
                before = octree->info.leaf_bytes;
            }
            fm_octree_destroy(octree);
        }
        fm_mesh_destroy(mesh);
        scene_mesh_free(&meshes[m]);
    }
}

// --- Memory ---

static fm_result build_with_little_memory(fm_context *context, void *user) {
    const fm_octree_desc *desc = user;
    scene_mesh sphere = scene_mesh_sphere(5, 6, CENTRE, 1);
    const fm_mesh_desc what = scene_mesh_describe(&sphere);
    fm_mesh *mesh = NULL;
    fm_octree *octree = NULL;
    fm_result result = fm_mesh_create(context, &what, &mesh);
    result = result == FM_OK ? fm_octree_build_mesh(mesh, desc, &octree) : result;
    CHECK(result == FM_OK || octree == NULL);
    fm_octree_destroy(octree);
    fm_mesh_destroy(mesh);
    scene_mesh_free(&sphere);
    CHECK_OK(fm_context_trim(context));
    return result;
}

static fm_result stream_with_little_memory(fm_context *context, void *user) {
    const fm_octree_desc *desc = user;
    scene_mesh sphere = scene_mesh_sphere(5, 6, CENTRE, 1);
    const fm_mesh_desc what = scene_mesh_describe(&sphere);
    fm_octree_builder *builder = NULL;
    fm_octree *octree = NULL;
    fm_result result = fm_octree_builder_create(context, desc, &builder);
    result = result == FM_OK ? fm_octree_builder_add(builder, &what, NULL, NULL) : result;
    result = result == FM_OK ? fm_octree_builder_finish(builder, &octree) : result;
    CHECK(result == FM_OK || octree == NULL);
    fm_octree_destroy(octree);
    fm_octree_builder_destroy(builder);
    scene_mesh_free(&sphere);
    return result;
}

static void test_memory(void) {
    const fm_octree_desc descs[] = {
        {.size = 12, .share = true, .attribute = FM_OCTREE_TRIANGLE},
        {.size = 12, .method = FM_OCTREE_GROWN},
        {.kind = FM_OCTREE_DISTANCE, .size = 12, .sign = FM_SIGN_WINDING},
        {.kind = FM_OCTREE_BRICKS, .size = 12},
    };
    for (size_t i = 0; i < sizeof descs / sizeof *descs; i++) {
        exhaust("an octree", build_with_little_memory, (void *)&descs[i], -1);
    }
    const fm_octree_desc streamed = {.size = 12, .low = {-1, -1, -1}, .high = {1, 1, 1}, .host_bytes = 1};
    exhaust("a streamed octree", stream_with_little_memory, (void *)&streamed, -1);
}

int main(void) {
    fm_context *context = NULL;
    if (!CHECK_OK(fm_context_create(&(fm_context_desc){.backend = FM_BACKEND_CPU}, &context))) {
        return check_summary();
    }
    test_odd(context);
    test_beyond(context);
    test_sheet(context);
    test_attributes(context);
    test_merged(context);
    test_memory();
    fm_context_destroy(context);
    return check_summary();
}
