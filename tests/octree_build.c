// SPDX-License-Identifier: MIT
// Octrees of vectors and of distances from meshes: every corner of every leaf, every empty leaf's bound, what merging may change.

#include "octree_build_common.h"
#include "vulkan_common.h"

#include <stdio.h>

static const float CENTRE[3] = {0.1f, -0.2f, 0.3f};

typedef struct named_mesh {
    const char *name;
    scene_mesh mesh;
} named_mesh;

enum { MESHES = 6 };

static void make_meshes(named_mesh meshes[MESHES]) {
    static const float low[3] = {-1, -0.5f, -0.25f}, high[3] = {1, 0.75f, 0.5f};
    meshes[0] = (named_mesh){"sphere", scene_mesh_sphere(8, 12, CENTRE, 1)};
    meshes[1] = (named_mesh){"box", scene_mesh_box(low, high)};
    meshes[2] = (named_mesh){"torus", scene_mesh_torus(12, 8, CENTRE, 1, 0.3f)};
    meshes[3] = (named_mesh){"sheet", scene_mesh_sheet(6, CENTRE, 2, 0.2f)};
    meshes[4] = (named_mesh){"tubes", scene_mesh_tubes(9, CENTRE, 2)};
    meshes[5] = (named_mesh){"soup", scene_mesh_soup(60, 3, CENTRE, 2, 0.3f)};
}

typedef struct tree_check {
    const scene_mesh *mesh;
    uint64_t seed;
    uint64_t leaves[24], empty;
    double volume;  // of all leaves, in finest cells
    double slack;   // world units: what a value may be off
    double worst;   // value, in cells
    bool grown;
    uint64_t corners, farther;  // corners that GROWN has another triangle for
} tree_check;

static bool in_box(const fm_octree *octree, const double cells[3]) {
    for (int axis = 0; axis < 3; axis++) {
        if (cells[axis] < 0 || cells[axis] > octree->info.cells[axis]) {
            return false;
        }
    }
    return true;
}

static void check_empty(tree_check *check, const fm_octree *octree, const tree_node *node) {
    const double edge = (double)(1u << node->level), bound = tree_bound(octree, node);
    for (int axis = 0; axis < 3; axis++) {
        // What is beyond the box is empty, whatever is there.
        if (node->at[axis] * edge >= octree->info.cells[axis]) {
            return;
        }
    }
    for (int i = 0; i < 4; i++) {
        double cells[3];
        for (int axis = 0; axis < 3; axis++) {
            // Corners too.
            const double part = i == 0 ? 0 : i == 1 ? 1 : tree_uniform(&check->seed);
            cells[axis] = (node->at[axis] + part) * edge;
        }
        if (in_box(octree, cells)) {
            // What is grown may be farther than what is true.
            CHECK(oracle_distance(check->mesh, tree_place(octree, cells)) >= bound - (check->grown ? 2 * octree->info.cell : 0));
        }
    }
}

static void check_vector(tree_check *check, const fm_octree *octree, const tree_node *node, uint32_t corner, oracle_point at,
                         double distance) {
    const fm_v3 v = tree_vector(octree, node, corner);
    const double length = sqrt((double)fm_dot(v, v)), slack = check->slack * (double)(1u << node->level);
    const oracle_point end = {at.x + (double)v.x, at.y + (double)v.y, at.z + (double)v.z};
    check->worst = fmax(check->worst, fabs(length - distance) / octree->info.cell);
    CHECK(length >= distance - slack);
    CHECK(check->grown || length <= distance + slack);
    CHECK(oracle_distance(check->mesh, end) <= 2 * slack);
    check->farther += length > distance + slack;
    check->corners++;
}

static void check_distance(tree_check *check, const fm_octree *octree, const tree_node *node, uint32_t corner, oracle_point at,
                           double distance) {
    const double value = (double)((const float *)octree->values.data)[tree_value(node, corner)];
    check->worst = fmax(check->worst, fabs(fabs(value) - distance) / octree->info.cell);
    CHECK(fabs(fabs(value) - distance) <= check->slack);
    const double winding = octree->info.sign == FM_SIGN_NONE ? 0 : oracle_winding(check->mesh, at);
    CHECK(distance < check->slack || fabs(fabs(winding) - 0.5) < 0.02 || (value < 0) == (winding > 0.5));
}

static void check_brick(tree_check *check, const fm_octree *octree, const tree_node *node) {
    const uint64_t first = (uint64_t)~node->word * FM_BRICK_VALUES;
    const double cut = (3 + sqrt(3)) * octree->info.cell;
    if (!CHECK(node->level == FM_BRICK_LEVEL) || !CHECK(first + FM_BRICK_VALUES <= octree->values.count)) {
        return;
    }
    double nearest = INFINITY;
    for (uint32_t i = 0; i < FM_BRICK_VALUES; i++) {
        const double cells[3] = {8.0 * node->at[0] + i % 9, 8.0 * node->at[1] + i / 9 % 9, 8.0 * node->at[2] + i / 81};
        const oracle_point at = tree_place(octree, cells);
        const double distance = oracle_distance(check->mesh, at);
        const double value = (double)((const float *)octree->values.data)[first + i];
        CHECK(fabs(fabs(value) - fmin(distance, cut)) <= 1e-3 * octree->info.cell);
        const double winding = octree->info.sign == FM_SIGN_NONE ? 0 : oracle_winding(check->mesh, at);
        CHECK(distance < check->slack || fabs(fabs(winding) - 0.5) < 0.02 || (value < 0) == (winding > 0.5));
        nearest = fmin(nearest, distance);
    }
    CHECK(nearest <= (3 + 1e-3) * octree->info.cell);
}

static void check_leaf(void *user, const fm_octree *octree, const tree_node *node) {
    tree_check *check = user;
    const double edge = (double)(1u << node->level);
    check->volume += edge * edge * edge;
    if (tree_is_empty(node)) {
        check->empty++;
        check_empty(check, octree, node);
        return;
    }
    check->leaves[node->level]++;
    if (octree->info.kind == FM_OCTREE_BRICKS) {
        check_brick(check, octree, node);
        return;
    }
    if (!CHECK(4 * ((uint64_t)~node->word + 2) <= octree->values.count)) {
        return;
    }
    for (uint32_t corner = 0; corner < 8; corner++) {
        const double cells[3] = {(node->at[0] + (corner & 1)) * edge, (node->at[1] + (corner >> 1 & 1)) * edge,
                                 (node->at[2] + (corner >> 2)) * edge};
        const oracle_point at = tree_place(octree, cells);
        const double distance = oracle_distance(check->mesh, at);
        if (octree->info.kind == FM_OCTREE_CLOSEST) {
            check_vector(check, octree, node, corner, at, distance);
        } else {
            check_distance(check, octree, node, corner, at, distance);
        }
    }
}

// No place of the surface lies in an empty leaf.
static void check_surface(const fm_octree *octree, const scene_mesh *mesh) {
    uint64_t seed = 11;
    const fm_octree_info *info = &octree->info;
    for (uint64_t i = 0; i < 3000; i++) {
        const oracle_point p = random_on_triangle(mesh, i % mesh->triangle_count, &seed);
        const double cells[3] = {(p.x - info->origin[0]) / info->cell, (p.y - info->origin[1]) / info->cell,
                                 (p.z - info->origin[2]) / info->cell};
        if (in_box(octree, cells)) {
            const tree_node node = tree_find(octree, cells);
            CHECK(!tree_is_empty(&node));
        }
    }
}

static void check_tree(const fm_octree *octree, const scene_mesh *mesh, tree_check *check) {
    const fm_octree_info *info = &octree->info;
    check->mesh = mesh;
    check->seed = 7;
    const double code = info->kind != FM_OCTREE_CLOSEST || info->code == FM_OCTREE_FLOATS ? 0
                        : info->code == FM_OCTREE_SHORT                                   ? 0.16
                        : info->code == FM_OCTREE_OCTAHEDRAL                              ? 0.016
                                                                                          : 0.032;
    check->slack = (code + 1e-4) * info->cell;
    tree_leaves(octree, check_leaf, check);
    check_surface(octree, mesh);
    const double top = pow((double)(1u << info->levels), 3);
    CHECK(check->volume == top * info->top[0] * info->top[1] * info->top[2]);
    CHECK(memcmp(check->leaves, info->leaves, sizeof check->leaves) == 0);
    CHECK(check->empty == info->empty);
    CHECK(info->node_bytes == 4 * octree->words.count);
    CHECK(info->leaf_bytes == octree->values.count * octree->values.size);
    CHECK(octree->words.count == 8 * info->internal + (uint64_t)info->top[0] * info->top[1] * info->top[2]);
}

static void report(const char *name, const fm_octree *octree, const tree_check *check) {
    const fm_octree_info *info = &octree->info;
    printf("%s: kind %d method %d: leaves", name, (int)info->kind, (int)info->method);
    for (int level = 0; level < 6; level++) {
        printf(" %llu", (unsigned long long)info->leaves[level]);
    }
    printf(", empty %llu, internal %llu, %.1f KiB, code error %.4f, worst %.5f cells", (unsigned long long)info->empty,
           (unsigned long long)info->internal, (double)(info->node_bytes + info->leaf_bytes + info->attribute_bytes) / 1024,
           info->code_error, check->worst);
    printf(check->grown ? ", %llu of %llu corners farther\n" : "\n", (unsigned long long)check->farther,
           (unsigned long long)check->corners);
}

static void build_and_check(fm_context *context, const named_mesh *named, const fm_octree_desc *desc) {
    const fm_mesh_desc what = scene_mesh_describe(&named->mesh);
    fm_mesh *mesh = NULL;
    fm_octree *octree = NULL;
    if (CHECK_OK(fm_mesh_create(context, &what, &mesh)) && CHECK_OK(fm_octree_build_mesh(mesh, desc, &octree))) {
        tree_check check = {.grown = desc->method == FM_OCTREE_GROWN};
        check_tree(octree, &named->mesh, &check);
        CHECK(desc->rounds > 0 || check.farther * 50 <= check.corners);
        report(named->name, octree, &check);
    }
    fm_octree_destroy(octree);
    fm_mesh_destroy(mesh);
}

static void test_shapes(fm_context *context) {
    named_mesh meshes[MESHES];
    make_meshes(meshes);
    for (int i = 0; i < MESHES; i++) {
        build_and_check(context, &meshes[i], &(fm_octree_desc){.size = 23, .code = FM_OCTREE_FLOATS});
        build_and_check(context, &meshes[i], &(fm_octree_desc){.size = 33, .code = FM_OCTREE_OCTAHEDRAL, .top_bytes = 4});
        build_and_check(context, &meshes[i],
                        &(fm_octree_desc){.size = 20, .method = FM_OCTREE_GROWN, .top_bytes = 256, .threshold = -1});
        // Too few rounds make vectors too long, no worse.
        build_and_check(context, &meshes[i], &(fm_octree_desc){.size = 20, .method = FM_OCTREE_GROWN, .rounds = 1});
        build_and_check(context, &meshes[i], &(fm_octree_desc){.kind = FM_OCTREE_DISTANCE, .size = 21, .share = i % 2});
        build_and_check(context, &meshes[i], &(fm_octree_desc){.kind = FM_OCTREE_BRICKS, .size = 21});
        build_and_check(context, &meshes[i], &(fm_octree_desc){.size = 26, .code = FM_OCTREE_FLOATS, .band = 1});
        build_and_check(context, &meshes[i], &(fm_octree_desc){.size = 41, .band = 0.1f, .threshold = 0.25f, .share = i % 2});
        build_and_check(context, &meshes[i], &(fm_octree_desc){.size = 30, .band = 0.1f, .method = FM_OCTREE_GROWN});
        build_and_check(context, &meshes[i], &(fm_octree_desc){.size = 37, .band = 0.2f, .code = FM_OCTREE_SHORT, .share = i % 2});
        build_and_check(context, &meshes[i], &(fm_octree_desc){.size = 25, .code = FM_OCTREE_OCTAHEDRAL, .share = true});
        scene_mesh_free(&meshes[i].mesh);
    }
}

// Parts that repeat by whole cells are kept once, as are the cells along a wall; and nothing else changes.
static void test_share(fm_context *context) {
    enum { PARTS = 27 };
    scene_mesh part = scene_mesh_sphere(6, 9, (const float[3]){8, 8, 8}, 5);
    const uint64_t vertices = part.vertex_count * PARTS, triangles = part.triangle_count * PARTS;
    scene_mesh all = {calloc(vertices, sizeof *all.vertices), calloc(triangles, sizeof *all.triangles), vertices, triangles};
    for (uint64_t i = 0; i < vertices; i++) {
        const uint32_t at[3] = {(uint32_t)(i / part.vertex_count % 3), (uint32_t)(i / part.vertex_count / 3 % 3),
                                (uint32_t)(i / part.vertex_count / 9)};
        for (int axis = 0; axis < 3; axis++) {
            // Multiples of 2^-16, so that what repeats repeats exactly.
            const float place = roundf(part.vertices[i % part.vertex_count][axis] * 65536) / 65536;
            all.vertices[i][axis] = place + 16.0f * (float)at[axis];
        }
    }
    for (uint64_t i = 0; i < triangles; i++) {
        for (int corner = 0; corner < 3; corner++) {
            all.triangles[i][corner] =
                part.triangles[i % part.triangle_count][corner] + (uint32_t)(i / part.triangle_count * part.vertex_count);
        }
    }
    const fm_mesh_desc what = scene_mesh_describe(&all);
    fm_octree_desc desc = {.size = 48, .high = {48, 48, 48}, .code = FM_OCTREE_OCTAHEDRAL};
    fm_mesh *mesh = NULL;
    fm_octree *whole = NULL, *shared = NULL;
    CHECK_OK(fm_mesh_create(context, &what, &mesh));
    CHECK_OK(fm_octree_build_mesh(mesh, &desc, &whole));
    desc.share = true;
    CHECK_OK(fm_octree_build_mesh(mesh, &desc, &shared));
    if (whole && shared) {
        const fm_octree_info *a = &whole->info, *b = &shared->info;
        printf("%d equal parts: %llu and %llu bytes\n", PARTS, (unsigned long long)(a->node_bytes + a->leaf_bytes),
               (unsigned long long)(b->node_bytes + b->leaf_bytes));
        CHECK(b->unshared_bytes == a->node_bytes + a->leaf_bytes);
        CHECK((b->node_bytes + b->leaf_bytes) * 12 < a->node_bytes + a->leaf_bytes);
        uint64_t seed = 1;
        for (int i = 0; i < 20000; i++) {
            const double at[3] = {48 * tree_uniform(&seed), 48 * tree_uniform(&seed), 48 * tree_uniform(&seed)};
            const tree_node left = tree_find(whole, at), right = tree_find(shared, at);
            CHECK(left.level == right.level && tree_is_empty(&left) == tree_is_empty(&right));
            for (uint32_t corner = 0; corner < 8 && !tree_is_empty(&left); corner++) {
                CHECK(((const uint32_t *)whole->values.data)[tree_value(&left, corner)] ==
                      ((const uint32_t *)shared->values.data)[tree_value(&right, corner)]);
            }
            CHECK(!tree_is_empty(&left) || tree_bound(whole, &left) >= tree_bound(shared, &right));
        }
    }
    fm_octree_destroy(whole);
    fm_octree_destroy(shared);
    fm_mesh_destroy(mesh);
    scene_mesh_free(&part);
    scene_mesh_free(&all);
}

static void test_bad(fm_context *context) {
    const scene_mesh box = scene_mesh_sphere(4, 4, CENTRE, 1);
    const fm_mesh_desc what = scene_mesh_describe(&box);
    fm_mesh *mesh = NULL;
    fm_octree *octree = NULL;
    CHECK_OK(fm_mesh_create(context, &what, &mesh));
    CHECK_FAILS(fm_octree_build_mesh(NULL, NULL, &octree), FM_ERROR_INVALID_ARGUMENT);
    CHECK_FAILS(fm_octree_build_mesh(mesh, NULL, NULL), FM_ERROR_INVALID_ARGUMENT);
    const fm_octree_desc bad[] = {
        {.kind = FM_OCTREE_KINDS},
        {.size = (1u << 20) + 1},
        {.low = {0, 0, 0}, .high = {1, 1, 0}},
        {.low = {0, 0, 0}, .high = {1, 1, -1}},
        {.low = {0, NAN, 0}, .high = {1, 1, 1}},
        {.high = {1, INFINITY, 1}},
        {.threshold = NAN},
        {.band = 0.04f},
        {.band = 3.6f},
        {.band = NAN},
        {.attribute = FM_OCTREE_COLOR},
        {.attribute = FM_OCTREE_TEXTURE},
        {.method = (fm_octree_method)2},
        {.code = (fm_octree_code)4},
        {.code = FM_OCTREE_SHORT},
        {.code = FM_OCTREE_SHORT, .band = 0.3f},
        {.attribute = (fm_octree_attribute)4},
    };
    for (size_t i = 0; i < sizeof bad / sizeof *bad; i++) {
        CHECK_FAILS(fm_octree_build_mesh(mesh, &bad[i], &octree), FM_ERROR_INVALID_ARGUMENT);
    }
    CHECK(octree == NULL);
    fm_mesh_destroy(mesh);
    scene_mesh tmp = box;
    scene_mesh_free(&tmp);
}

// What the device builds: the same checks, and the host's octree but for rounding.
static void test_device(fm_context *context) {
    named_mesh meshes[MESHES];
    make_meshes(meshes);
    for (int i = 0; i < MESHES; i++) {
        build_and_check(context, &meshes[i], &(fm_octree_desc){.size = 23, .code = FM_OCTREE_FLOATS});
        build_and_check(context, &meshes[i], &(fm_octree_desc){.size = 33, .code = FM_OCTREE_OCTAHEDRAL, .top_bytes = 4});
        build_and_check(context, &meshes[i], &(fm_octree_desc){.size = 20, .top_bytes = 256, .threshold = -1});
        build_and_check(context, &meshes[i], &(fm_octree_desc){.size = 26, .code = FM_OCTREE_FLOATS, .band = 1});
        build_and_check(context, &meshes[i], &(fm_octree_desc){.size = 25, .code = FM_OCTREE_OCTAHEDRAL, .share = true});
        scene_mesh_free(&meshes[i].mesh);
    }
}

int main(int argc, char **argv) {
    fm_context *context = NULL;
    vulkan_options options;
    if (argc > 1) {
        if (!vulkan_parse(argc, argv, &options)) {
            return 2;
        }
        if (vulkan_open(&options, NULL, &context) != FM_OK) {
            return vulkan_missing();
        }
        test_device(context);
        CHECK(fm_context_validation_messages(context) == 0);
        fm_context_destroy(context);
        return check_summary();
    }
    if (!CHECK_OK(fm_context_create(&(fm_context_desc){.backend = FM_BACKEND_CPU}, &context))) {
        return check_summary();
    }
    test_shapes(context);
    test_share(context);
    test_bad(context);
    fm_context_destroy(context);
    return check_summary();
}
