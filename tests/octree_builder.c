// SPDX-License-Identifier: MIT
// Streamed builds: equal to those of a mesh in memory, bit for bit, with hardly any memory; and what is on the leaves.

#include "octree_build_common.h"

#include <signal.h>
#include <stdio.h>
#include <sys/resource.h>

static const float CENTRE[3] = {0.1f, -0.2f, 0.3f};

typedef struct paints {
    uint8_t (*colors)[4];
    float (*texture)[2];
} paints;

// Texture coordinates that are linear in space, and colours that follow from them.
static paints paint(const scene_mesh *mesh) {
    const paints made = {calloc(mesh->vertex_count, sizeof *made.colors), calloc(mesh->vertex_count, sizeof *made.texture)};
    for (uint64_t i = 0; i < mesh->vertex_count; i++) {
        for (int k = 0; k < 2; k++) {
            made.texture[i][k] = mesh->vertices[i][k] * 0.25f + 10.5f;
        }
        for (int k = 0; k < 3; k++) {
            made.colors[i][k] = (uint8_t)lrintf(100 * (mesh->vertices[i][k] - CENTRE[k]) + 128);
        }
        made.colors[i][3] = 255;
    }
    return made;
}

static bool same_array(const fm_octree_array *a, const fm_octree_array *b) {
    return a->count == b->count && a->size == b->size && (a->count == 0 || memcmp(a->data, b->data, a->count * a->size) == 0);
}

static void check_same(const fm_octree *a, const fm_octree *b) {
    CHECK(same_array(&a->words, &b->words));
    CHECK(same_array(&a->values, &b->values));
    CHECK(same_array(&a->attributes, &b->attributes));
    CHECK(memcmp(&a->head, &b->head, sizeof a->head) == 0);
    fm_octree_info left = a->info, right = b->info;
    left.build_ms = right.build_ms = 0;
    CHECK(memcmp(&left, &right, sizeof left) == 0);
}

// Adds the mesh's triangles a few at a time.
static fm_result add_all(fm_octree_builder *builder, const scene_mesh *mesh, const paints *own, uint64_t few) {
    for (uint64_t i = 0; i < mesh->triangle_count; i += few) {
        const uint64_t count = mesh->triangle_count - i < few ? mesh->triangle_count - i : few;
        const fm_mesh_desc some = {(const float(*)[3])mesh->vertices, mesh->vertex_count,
                                   (const uint32_t(*)[3])(mesh->triangles + i), count};
        const fm_result result =
            fm_octree_builder_add(builder, &some, (const uint8_t(*)[4])own->colors, (const float(*)[2])own->texture);
        if (result != FM_OK) {
            return result;
        }
    }
    return FM_OK;
}

static void compare(fm_context *context, const scene_mesh *mesh, const paints *own, fm_octree_desc desc) {
    const fm_mesh_desc what = scene_mesh_describe(mesh);
    fm_mesh *whole = NULL;
    fm_octree *wanted = NULL, *got = NULL;
    fm_octree_builder *builder = NULL;
    desc.colors = (const uint8_t(*)[4])own->colors;
    desc.texture = (const float(*)[2])own->texture;
    CHECK_OK(fm_mesh_create(context, &what, &whole));
    CHECK_OK(fm_octree_build_mesh(whole, &desc, &wanted));
    desc.colors = NULL;
    desc.texture = NULL;
    if (CHECK_OK(fm_octree_builder_create(context, &desc, &builder)) && CHECK_OK(add_all(builder, mesh, own, 7)) &&
        CHECK_OK(fm_octree_builder_finish(builder, &got)) && wanted) {
        wanted->desc.host_bytes = got->desc.host_bytes;
        check_same(wanted, got);
        CHECK(got->info.leaves[0] > 0);
    }
    fm_octree *again = NULL;
    CHECK_FAILS(fm_octree_builder_finish(builder, &again), FM_ERROR_INVALID_ARGUMENT);
    fm_octree_builder_destroy(builder);
    fm_octree_destroy(wanted);
    fm_octree_destroy(got);
    fm_mesh_destroy(whole);
}

static void test_same(fm_context *context) {
    scene_mesh torus = scene_mesh_torus(20, 12, CENTRE, 1, 0.3f);
    torus.vertices[3][1] = NAN;
    const paints own = paint(&torus);
    const fm_octree_desc base = {.size = 150, .low = {-1.4f, -1.2f, -0.2f}, .high = {1.2f, 1.3f, 0.7f}, .host_bytes = 1};
    for (int attribute = 0; attribute <= FM_OCTREE_TEXTURE; attribute++) {
        fm_octree_desc desc = base;
        desc.attribute = (fm_octree_attribute)attribute;
        desc.method = attribute % 2 ? FM_OCTREE_EXACT : FM_OCTREE_GROWN;
        desc.share = attribute == FM_OCTREE_TRIANGLE;
        desc.host_bytes = attribute == FM_OCTREE_COLOR ? 0 : 3000;
        desc.size = attribute == 0 ? 150 : 40;
        compare(context, &torus, &own, desc);
    }
    fm_octree_desc desc = base;
    desc.band = 0.1f;
    desc.code = FM_OCTREE_SHORT;
    desc.threshold = 0.15f;
    compare(context, &torus, &own, desc);
    desc = base;
    desc.kind = FM_OCTREE_DISTANCE;
    desc.sign = FM_SIGN_NONE;
    desc.size = 30;
    compare(context, &torus, &own, desc);
    free(own.colors);
    free(own.texture);
    scene_mesh_free(&torus);
}

static fm_octree *build_with(uint32_t threads, const scene_mesh *mesh, const fm_octree_desc *desc, fm_context **context,
                             fm_mesh **own) {
    const fm_mesh_desc what = scene_mesh_describe(mesh);
    fm_octree *octree = NULL;
    CHECK_OK(fm_context_create(&(fm_context_desc){.backend = FM_BACKEND_CPU, .threads = threads}, context));
    CHECK_OK(fm_mesh_create(*context, &what, own));
    CHECK_OK(fm_octree_build_mesh(*own, desc, &octree));
    return octree;
}

// The threads that share the work do not show.
static void test_threads(void) {
    const fm_octree_desc descs[] = {{.size = 150},
                                    {.size = 150, .band = 0.1f, .threshold = 0.3f},
                                    {.size = 40, .method = FM_OCTREE_GROWN, .share = true},
                                    {.kind = FM_OCTREE_DISTANCE, .size = 140},
                                    {.kind = FM_OCTREE_BRICKS, .size = 50}};
    scene_mesh torus = scene_mesh_torus(20, 12, CENTRE, 1, 0.3f);
    for (size_t i = 0; i < sizeof descs / sizeof *descs; i++) {
        fm_context *contexts[2] = {NULL};
        fm_mesh *meshes[2] = {NULL};
        fm_octree *octrees[2];
        for (uint32_t k = 0; k < 2; k++) {
            octrees[k] = build_with(1 + 2 * k, &torus, &descs[i], &contexts[k], &meshes[k]);
        }
        if (octrees[0] && octrees[1]) {
            check_same(octrees[0], octrees[1]);
        }
        for (int k = 0; k < 2; k++) {
            fm_octree_destroy(octrees[k]);
            fm_mesh_destroy(meshes[k]);
            fm_context_destroy(contexts[k]);
        }
    }
    scene_mesh_free(&torus);
}

typedef struct paint_check {
    const scene_mesh *mesh;
    fm_octree_attribute attribute;
    uint64_t count;
} paint_check;

// What a corner's attribute says must be true of its closest point.
static void check_paint(void *user, const fm_octree *octree, const tree_node *node) {
    paint_check *check = user;
    const double edge = (double)(1u << node->level), cell = octree->info.cell;
    for (uint32_t corner = 0; corner < 8 && !tree_is_empty(node); corner++) {
        const double cells[3] = {(node->at[0] + (corner & 1)) * edge, (node->at[1] + (corner >> 1 & 1)) * edge,
                                 (node->at[2] + (corner >> 2)) * edge};
        const oracle_point at = tree_place(octree, cells);
        const fm_v3 v = tree_vector(octree, node, corner);
        const double end[3] = {at.x + (double)v.x, at.y + (double)v.y, at.z + (double)v.z};
        const uint32_t word = ((const uint32_t *)octree->attributes.data)[tree_value(node, corner)];
        check->count++;
        if (check->attribute == FM_OCTREE_TRIANGLE) {
            const double distance = oracle_to_triangle(check->mesh, word, (oracle_point){end[0], end[1], end[2]});
            CHECK(distance < 1e-3 * cell);
        } else if (check->attribute == FM_OCTREE_COLOR) {
            for (int k = 0; k < 3; k++) {
                CHECK(fabs((word >> 8 * k & 255) - (100 * (end[k] - (double)CENTRE[k]) + 128)) < 1.5);
            }
            CHECK(word >> 24 == 255);
        } else {
            for (int k = 0; k < 2; k++) {
                const double wanted = end[k] * 0.25 + 10.5, part = wanted - floor(wanted);
                const double off = fabs((word >> 16 * k & 65535) / 65536.0 - part);
                CHECK(off < 1e-4 || off > 1 - 1e-4);
            }
        }
    }
}

static void test_attributes(fm_context *context) {
    scene_mesh sphere = scene_mesh_sphere(7, 9, CENTRE, 1);
    const paints own = paint(&sphere);
    const fm_mesh_desc what = scene_mesh_describe(&sphere);
    fm_mesh *mesh = NULL;
    CHECK_OK(fm_mesh_create(context, &what, &mesh));
    for (int attribute = FM_OCTREE_TRIANGLE; attribute <= FM_OCTREE_TEXTURE; attribute++) {
        const fm_octree_desc desc = {.size = 24,
                                     .code = FM_OCTREE_FLOATS,
                                     .attribute = (fm_octree_attribute)attribute,
                                     .share = attribute == FM_OCTREE_COLOR,
                                     .colors = (const uint8_t(*)[4])own.colors,
                                     .texture = (const float(*)[2])own.texture};
        fm_octree *octree = NULL;
        if (CHECK_OK(fm_octree_build_mesh(mesh, &desc, &octree))) {
            paint_check check = {&sphere, desc.attribute, 0};
            CHECK(octree->attributes.count == octree->values.count);
            tree_leaves(octree, check_paint, &check);
            CHECK(check.count > 1000);
        }
        fm_octree_destroy(octree);
    }
    fm_mesh_destroy(mesh);
    free(own.colors);
    free(own.texture);
    scene_mesh_free(&sphere);
}

static void test_bad(fm_context *context) {
    scene_mesh box = scene_mesh_sphere(9, 9, CENTRE, 1);
    const fm_mesh_desc what = scene_mesh_describe(&box);
    fm_octree_builder *builder = NULL;
    fm_octree *octree = NULL;
    fm_octree_desc desc = {.size = 64, .high = {1, 1, 1}, .host_bytes = 1, .folder = "/no/such/folder"};
    CHECK_FAILS(fm_octree_builder_create(context, NULL, &builder), FM_ERROR_INVALID_ARGUMENT);
    CHECK_FAILS(fm_octree_builder_create(NULL, &desc, &builder), FM_ERROR_INVALID_ARGUMENT);
    CHECK_FAILS(fm_octree_builder_create(context, &(fm_octree_desc){.kind = FM_OCTREE_DAG, .high = {1, 1, 1}}, &builder),
                FM_ERROR_UNSUPPORTED);
    CHECK_FAILS(fm_octree_builder_create(context, &(fm_octree_desc){.kind = FM_OCTREE_DISTANCE, .high = {1, 1, 1}}, &builder),
                FM_ERROR_UNSUPPORTED);
    CHECK_OK(fm_octree_builder_create(context, &desc, &builder));
    CHECK_FAILS(fm_octree_builder_add(builder, NULL, NULL, NULL), FM_ERROR_INVALID_ARGUMENT);
    fm_mesh_desc wrong = what;
    wrong.vertex_count = 3;
    CHECK_FAILS(fm_octree_builder_add(builder, &wrong, NULL, NULL), FM_ERROR_INVALID_ARGUMENT);
    CHECK_FAILS(fm_octree_builder_add(builder, &what, NULL, NULL), FM_ERROR_IO);
    CHECK(strstr(fm_last_error(), "/no/such/folder") != NULL);
    CHECK_FAILS(fm_octree_builder_add(builder, &what, NULL, NULL), FM_ERROR_INVALID_ARGUMENT);
    CHECK_FAILS(fm_octree_builder_finish(builder, &octree), FM_ERROR_INVALID_ARGUMENT);
    fm_octree_builder_destroy(builder);
    builder = NULL;
    desc.folder = NULL;
    // What is not there is named, and the builder is as it was.
    const fm_octree_desc textured = {.size = 8, .high = {1, 1, 1}, .attribute = FM_OCTREE_TEXTURE};
    CHECK_OK(fm_octree_builder_create(context, &textured, &builder));
    CHECK_FAILS(fm_octree_builder_add(builder, &what, NULL, NULL), FM_ERROR_INVALID_ARGUMENT);
    CHECK(strstr(fm_last_error(), "texture") != NULL);
    CHECK_OK(fm_octree_builder_add(builder, &(fm_mesh_desc){0}, NULL, NULL));
    CHECK_OK(fm_octree_builder_finish(builder, &octree));
    fm_octree_destroy(octree);
    fm_octree_builder_destroy(builder);
    octree = NULL;
    builder = NULL;
    // A disk that takes 512 bytes.
    signal(SIGXFSZ, SIG_IGN);
    struct rlimit limit;
    getrlimit(RLIMIT_FSIZE, &limit);
    const struct rlimit small = {512, limit.rlim_max};
    CHECK_OK(fm_octree_builder_create(context, &desc, &builder));
    setrlimit(RLIMIT_FSIZE, &small);
    const fm_result result = fm_octree_builder_add(builder, &what, NULL, NULL);
    setrlimit(RLIMIT_FSIZE, &limit);
    CHECK(result == FM_ERROR_IO);
    fm_octree_builder_destroy(builder);
    builder = NULL;
    // Nothing at all is fine.
    CHECK_OK(fm_octree_builder_create(context, &desc, &builder));
    CHECK_OK(fm_octree_builder_finish(builder, &octree));
    CHECK(octree && octree->info.internal == 0 && octree->values.count == 0);
    fm_octree_destroy(octree);
    fm_octree_builder_destroy(builder);
    fm_octree_builder_destroy(NULL);
    scene_mesh_free(&box);
}

int main(void) {
    fm_context *context = NULL;
    if (!CHECK_OK(fm_context_create(&(fm_context_desc){.backend = FM_BACKEND_CPU}, &context))) {
        return check_summary();
    }
    test_same(context);
    test_threads();
    test_attributes(context);
    test_bad(context);
    fm_context_destroy(context);
    return check_summary();
}
