// SPDX-License-Identifier: MIT
// Fields of moving scenes from those of their objects: how far they are from exact ones, that only what moved is redone and all is
// as if made anew, and both backends. On the CPU, or with --backend vulkan there.

#include "fathom/sdf.h"

#include "faulty.h"
#include "mesh_gpu_common.h"

enum { OBJECTS = 5, WIDTH = 40, HEIGHT = 37, DEPTH = 30, TEXELS = WIDTH * HEIGHT * DEPTH };

static const double spacing[3] = {0.1, 0.1, 0.11}, origin[3] = {-2.0, -1.8, -1.6};
static const float band = 3, beyond = (float)(3 * 0.11);
static fm_context *context, *processor;
static uint64_t seed = 5;
static double worst;

// A stage is a scene with what the test knows of it.
typedef struct stage {
    scene_mesh shapes[OBJECTS];
    fm_transform3 places[OBJECTS];
    uint32_t count;
    fm_scene *scene, *twin;  // where the test runs, and on the processor
} stage;

static fm_transform3 random_place(float reach) {
    float q[4], length2 = 0;
    while (length2 < 0.01f || length2 > 1) {
        length2 = 0;
        for (int i = 0; i < 4; i++) {
            q[i] = uniform(&seed, -1, 1);
            length2 += q[i] * q[i];
        }
    }
    const double s = 2 / (double)length2, w = (double)q[0], x = (double)q[1], y = (double)q[2], z = (double)q[3];
    const double m[3][3] = {{1 - s * (y * y + z * z), s * (x * y - z * w), s * (x * z + y * w)},
                            {s * (x * y + z * w), 1 - s * (x * x + z * z), s * (y * z - x * w)},
                            {s * (x * z - y * w), s * (y * z + x * w), 1 - s * (x * x + y * y)}};
    fm_transform3 place;
    for (int row = 0; row < 3; row++) {
        for (int k = 0; k < 3; k++) {
            place.rows[row][k] = (float)m[row][k];
        }
        place.rows[row][3] = uniform(&seed, -reach, reach);
    }
    return place;
}

static fm_mesh *mesh_of(fm_context *where, const scene_mesh *shape) {
    const fm_mesh_desc desc = scene_mesh_describe(shape);
    fm_mesh *mesh = NULL;
    CHECK_OK(fm_mesh_create(where, &desc, &mesh));
    return mesh;
}

static void add(stage *s, scene_mesh shape, fm_transform3 place) {
    fm_context *const where[2] = {context, processor};
    fm_scene *const scenes[2] = {s->scene, s->twin};
    for (int i = 0; i < 2; i++) {
        fm_mesh *mesh = mesh_of(where[i], &shape);
        CHECK_OK(fm_scene_add(scenes[i], mesh, &place, NULL));
        fm_mesh_destroy(mesh);
    }
    s->shapes[s->count] = shape;
    s->places[s->count++] = place;
}

static void move(stage *s, uint32_t object, fm_transform3 place) {
    s->places[object] = place;
    CHECK_OK(fm_scene_move(s->scene, object, &place));
    CHECK_OK(fm_scene_move(s->twin, object, &place));
}

// Random factors of its three axes, so that it stays what it is.
static void deform(stage *s, uint32_t object) {
    scene_mesh *shape = &s->shapes[object];
    for (int axis = 0; axis < 3; axis++) {
        const float factor = uniform(&seed, 0.8f, 1.25f);
        for (uint64_t v = 0; v < shape->vertex_count; v++) {
            shape->vertices[v][axis] *= factor;
        }
    }
    CHECK_OK(fm_scene_deform(s->scene, object, (const float(*)[3])shape->vertices));
    CHECK_OK(fm_scene_deform(s->twin, object, (const float(*)[3])shape->vertices));
}

static bool open_stage(stage *s) {
    const float here[3] = {0, 0, 0};
    *s = (stage){.count = 0};
    if (!CHECK_OK(fm_scene_create(context, &s->scene)) || !CHECK_OK(fm_scene_create(processor, &s->twin))) {
        return false;
    }
    add(s, scene_mesh_sphere(20, 28, here, 0.6f), random_place(1));
    add(s, scene_mesh_box((const float[]){-0.5f, -0.3f, -0.7f}, (const float[]){0.5f, 0.3f, 0.7f}), random_place(1));
    add(s, scene_mesh_torus(30, 14, here, 0.5f, 0.2f), random_place(1));
    add(s, scene_mesh_tubes(16, here, 1.4f), random_place(1));
    return true;
}

static void close_stage(stage *s) {
    fm_scene_destroy(s->scene);
    fm_scene_destroy(s->twin);
    for (uint32_t i = 0; i < s->count; i++) {
        scene_mesh_free(&s->shapes[i]);
    }
}

static fm_composed_desc describe(float detail, uint32_t most) {
    fm_composed_desc desc = {.shape = {WIDTH, HEIGHT, DEPTH}, .band = band, .detail = detail, .most = most};
    memcpy(desc.spacing, spacing, sizeof spacing);
    memcpy(desc.origin, origin, sizeof origin);
    return desc;
}

static fm_composed *compose_anew(fm_scene *scene, const fm_composed_desc *desc) {
    fm_composed *composed = NULL;
    CHECK_OK(fm_composed_create(scene, desc, &composed));
    CHECK_OK(fm_composed_update(composed, NULL));
    return composed;
}

static float *download(fm_composed *composed) {
    float *values = malloc(TEXELS * sizeof *values);
    CHECK(values && fm_volume_download(fm_composed_field(composed), values) == FM_OK);
    return values;
}

static float *exact_field(fm_mesh *mesh, fm_sign sign) {
    const fm_sdf_desc desc = {.band = band, .sign = sign};
    fm_volume_desc grid = {.shape = {WIDTH, HEIGHT, DEPTH}, .type = FM_TYPE_F32};
    memcpy(grid.spacing, spacing, sizeof spacing);
    memcpy(grid.origin, origin, sizeof origin);
    fm_volume *field = NULL;
    float *values = malloc(TEXELS * sizeof *values);
    CHECK_OK(fm_volume_create(processor, &grid, &field));
    CHECK_OK(fm_mesh_sdf(mesh, &desc, field, NULL, NULL, NULL));
    CHECK(values && fm_volume_download(field, values) == FM_OK);
    fm_volume_destroy(field);
    return values;
}

// The least of the objects' exact fields, each of the object where it is.
static float *least_field(const stage *s) {
    float *least = NULL;
    for (uint32_t i = 0; i < s->count; i++) {
        scene_mesh placed = s->shapes[i];
        placed.vertices = malloc(placed.vertex_count * sizeof *placed.vertices);
        for (uint64_t v = 0; v < placed.vertex_count; v++) {
            for (int row = 0; row < 3; row++) {
                const float *m = s->places[i].rows[row], *p = s->shapes[i].vertices[v];
                placed.vertices[v][row] = (float)((double)m[0] * p[0] + (double)m[1] * p[1] + (double)m[2] * p[2] + (double)m[3]);
            }
        }
        fm_mesh *mesh = mesh_of(processor, &placed);
        float *own = exact_field(mesh, FM_SIGN_AUTO);
        for (int t = 0; least && t < TEXELS; t++) {
            own[t] = fminf(own[t], least[t]);
        }
        free(least);
        least = own;
        fm_mesh_destroy(mesh);
        free(placed.vertices);
    }
    return least;
}

static void check_field(const stage *s, fm_composed *composed) {
    static const double rounding = 2e-5;
    fm_composed_info info;
    fm_composed_describe(composed, &info);
    CHECK_OK(fm_scene_update(s->twin, FM_TREE_REFIT, NULL));
    float *values = download(composed), *least = least_field(s), *whole = exact_field(fm_scene_mesh(s->twin), FM_SIGN_WINDING);
    bool outside_right = true, signs_right = true;
    double most = 0;
    for (int t = 0; t < TEXELS; t++) {
        const double value = (double)values[t], exact = (double)least[t];
        most = fmax(most, fabs(value - exact));
        // Inside, the whole scene's mesh has faces of objects within others, which are nearer than the union's surface.
        outside_right &= exact < 0 || whole[t] < 0 || fabs(value - (double)whole[t]) <= info.error + rounding;
        signs_right &= fabs(exact) <= info.error + rounding || (value < 0) == (whole[t] < 0);
    }
    CHECK(most <= info.error + rounding);
    CHECK(outside_right);
    CHECK(signs_right);
    worst = fmax(worst, most / info.error);
    free(values);
    free(least);
    free(whole);
}

static double farthest(const float *a, const float *b) {
    double most = 0;
    for (int t = 0; t < TEXELS; t++) {
        most = fmax(most, fabs((double)a[t] - (double)b[t]));
    }
    return most;
}

// The field that followed the scene equals one made anew, and the processor's.
static void check_same(const stage *s, fm_composed *composed, const fm_composed_desc *desc) {
    fm_composed *anew = compose_anew(s->scene, desc), *other = compose_anew(s->twin, desc);
    float *values = download(composed), *again = download(anew), *twin = download(other);
    CHECK(memcmp(values, again, TEXELS * sizeof *values) == 0);
    CHECK(farthest(values, twin) <= 2e-6);
    free(values);
    free(again);
    free(twin);
    fm_composed_destroy(anew);
    fm_composed_destroy(other);
}

static uint64_t touched_by(fm_composed *composed) {
    fm_composed_info info;
    CHECK_OK(fm_composed_update(composed, NULL));
    fm_composed_describe(composed, &info);
    return info.touched;
}

static void moving(float detail, uint32_t most, int frames) {
    const fm_composed_desc desc = describe(detail, most);
    stage s;
    if (!open_stage(&s)) {
        return;
    }
    fm_composed *composed = NULL;
    CHECK_OK(fm_composed_create(s.scene, &desc, &composed));
    CHECK(touched_by(composed) == TEXELS);
    check_field(&s, composed);
    CHECK(touched_by(composed) == 0);
    for (int frame = 0; frame < frames; frame++) {
        if (frame == 3) {
            add(&s, scene_mesh_sphere(9, 12, (const float[]){0.2f, 0, 0}, 0.3f), random_place(0.5f));
        }
        if (frame == 5) {
            deform(&s, 2);
        }
        const uint32_t first = (uint32_t)frame % s.count;
        // Every third goes out of the grid, for the most part.
        move(&s, first, random_place(frame % 3 == 2 ? 6 : 1));
        if (frame % 2 == 0) {
            move(&s, (first + 2) % s.count, random_place(1));
        }
        const uint64_t touched = touched_by(composed);
        CHECK(touched > 0);
        check_same(&s, composed, &desc);
        check_field(&s, composed);
        CHECK_OK(fm_scene_move(s.scene, 0, &s.places[0]));
        CHECK(touched_by(composed) == 0);
    }
    fm_composed_destroy(composed);
    close_stage(&s);
}

// A small step of a small object touches little; one beyond the grid nothing.
static void little(void) {
    const fm_composed_desc desc = describe(0, 0);
    stage s = {.count = 0};
    fm_transform3 place = {{{1, 0, 0, 0}, {0, 1, 0, 0}, {0, 0, 1, 0}}};
    if (!CHECK_OK(fm_scene_create(context, &s.scene)) || !CHECK_OK(fm_scene_create(processor, &s.twin))) {
        return;
    }
    fm_composed *composed = compose_anew(s.scene, &desc);
    float *values = download(composed);
    CHECK(values[0] == beyond && values[TEXELS - 1] == beyond);
    free(values);
    add(&s, scene_mesh_sphere(8, 10, (const float[]){0, 0, 0}, 0.2f), place);
    const uint64_t touched = touched_by(composed);
    CHECK(touched > 0 && touched < TEXELS / 2);
    check_same(&s, composed, &desc);
    place.rows[0][3] = 100;
    move(&s, 0, place);
    CHECK(touched_by(composed) == touched);
    check_same(&s, composed, &desc);
    place.rows[1][3] = 1e30f;
    move(&s, 0, place);
    CHECK(touched_by(composed) == 0);
    // A mirror image is rigid.
    place = (fm_transform3){{{-1, 0, 0, 0.3f}, {0, 1, 0, 0}, {0, 0, 1, 0}}};
    move(&s, 0, place);
    CHECK(touched_by(composed) > 0);
    check_same(&s, composed, &desc);
    // Nothing of it is left.
    for (uint64_t v = 0; v < s.shapes[0].vertex_count; v++) {
        s.shapes[0].vertices[v][1] = NAN;
    }
    CHECK_OK(fm_scene_deform(s.scene, 0, (const float(*)[3])s.shapes[0].vertices));
    CHECK(touched_by(composed) > 0);
    values = download(composed);
    for (int t = 0; t < TEXELS; t++) {
        CHECK(values[t] == beyond);
    }
    free(values);
    fm_composed_destroy(composed);
    close_stage(&s);
}

// Tickets, updates in flight one upon another, and an end before they are done.
static void in_flight(void) {
    const fm_composed_desc desc = describe(0, 0);
    stage s;
    if (!open_stage(&s)) {
        return;
    }
    fm_composed *composed = NULL;
    fm_ticket ticket = 0;
    CHECK_OK(fm_composed_create(s.scene, &desc, &composed));
    for (uint32_t i = 0; i < 6; i++) {
        move(&s, i % s.count, random_place(1));
        if (i % 2 == 1) {
            deform(&s, 0);
        }
        CHECK_OK(fm_composed_update(composed, &ticket));
    }
    CHECK_OK(fm_wait(context, ticket));
    check_same(&s, composed, &desc);
    move(&s, 0, random_place(1));
    CHECK_OK(fm_composed_update(composed, &ticket));
    fm_composed_destroy(composed);
    CHECK_OK(fm_wait(context, ticket));
    close_stage(&s);
}

// An object without triangles, alone.
static void nothing(void) {
    const fm_composed_desc desc = describe(0, 0);
    stage s = {.count = 0};
    if (!CHECK_OK(fm_scene_create(context, &s.scene)) || !CHECK_OK(fm_scene_create(processor, &s.twin))) {
        return;
    }
    add(&s, scene_mesh_soup(0, 1, (const float[]){0, 0, 0}, 1, 0.1f), random_place(1));
    fm_composed *composed = compose_anew(s.scene, &desc);
    float *values = download(composed);
    bool all = true;
    for (int t = 0; t < TEXELS; t++) {
        all &= values[t] == beyond;
    }
    CHECK(all);
    move(&s, 0, random_place(1));
    CHECK(touched_by(composed) == 0);
    free(values);
    fm_composed_destroy(composed);
    close_stage(&s);
}

// Two of one shape share a local field until one of them deforms.
static void shared(void) {
    const fm_composed_desc desc = describe(0, 0);
    fm_composed_info one, two, three;
    stage s = {.count = 0};
    if (!CHECK_OK(fm_scene_create(context, &s.scene)) || !CHECK_OK(fm_scene_create(processor, &s.twin))) {
        return;
    }
    fm_composed *composed = compose_anew(s.scene, &desc);
    for (int i = 0; i < 2; i++) {
        add(&s, scene_mesh_torus(20, 10, (const float[]){0, 0, 0}, 0.5f, 0.2f), random_place(1));
        CHECK_OK(fm_composed_update(composed, NULL));
        fm_composed_describe(composed, i ? &two : &one);
        check_field(&s, composed);
    }
    CHECK(one.local_texels > 0 && two.local_texels == one.local_texels);
    for (uint32_t i = 0; i < 2; i++) {
        deform(&s, i);
        CHECK_OK(fm_composed_update(composed, NULL));
        fm_composed_describe(composed, &three);
        CHECK(three.local_texels > one.local_texels);
        check_field(&s, composed);
        check_same(&s, composed, &desc);
    }
    fm_composed_destroy(composed);
    close_stage(&s);
}

// More objects than a work group looks at in one go.
static void many(void) {
    scene_mesh box = scene_mesh_box((const float[]){-0.1f, -0.1f, -0.1f}, (const float[]){0.1f, 0.1f, 0.1f});
    const fm_composed_desc desc = describe(0, 16);
    fm_context *const where[2] = {context, processor};
    float *values[2];
    const uint64_t first = seed;
    for (int i = 0; i < 2; i++) {
        fm_mesh *mesh = mesh_of(where[i], &box);
        fm_scene *scene = NULL;
        CHECK_OK(fm_scene_create(where[i], &scene));
        seed = first;
        for (int object = 0; object < 260; object++) {
            const fm_transform3 place = random_place(1.7f);
            CHECK_OK(fm_scene_add(scene, mesh, &place, NULL));
        }
        fm_mesh_destroy(mesh);
        fm_composed *composed = compose_anew(scene, &desc);
        values[i] = download(composed);
        fm_composed_destroy(composed);
        fm_scene_destroy(scene);
    }
    CHECK(farthest(values[0], values[1]) <= 2e-6);
    free(values[0]);
    free(values[1]);
    scene_mesh_free(&box);
}

static void bad_arguments(void) {
    const fm_transform3 place = {{{1, 0, 0, 0}, {0, 1, 0, 0}, {0, 0, 1, 0}}};
    fm_composed_desc desc = describe(0, 0);
    stage s = {.count = 0};
    fm_composed *composed = NULL;
    CHECK_OK(fm_scene_create(context, &s.scene));
    CHECK_OK(fm_scene_create(processor, &s.twin));
    CHECK_FAILS(fm_composed_create(NULL, &desc, &composed), FM_ERROR_INVALID_ARGUMENT);
    CHECK_FAILS(fm_composed_create(s.scene, NULL, &composed), FM_ERROR_INVALID_ARGUMENT);
    CHECK_FAILS(fm_composed_create(s.scene, &desc, NULL), FM_ERROR_INVALID_ARGUMENT);
    for (int i = 0; i < 13; i++) {
        fm_composed_desc bad = desc;
        switch (i) {
        case 0:
            bad.shape.x = 0;
            break;
        case 1:
            bad.shape.z = 65536;
            break;
        case 2:
            bad.band = -1;
            break;
        case 3:
            bad.band = NAN;
            break;
        case 4:
            bad.band = INFINITY;
            break;
        case 5:
            bad.detail = -1;
            break;
        case 6:
            bad.detail = INFINITY;
            break;
        case 7:
            bad.most = 15;
            break;
        case 8:
            bad.most = 65536;
            break;
        case 9:
            bad.sign = (fm_sign)4;
            break;
        case 10:
            bad.spacing[1] = 0;
            break;
        case 11:
            bad.spacing[1] = NAN;
            break;
        default:
            bad.origin[2] = INFINITY;
            break;
        }
        CHECK_FAILS(fm_composed_create(s.scene, &bad, &composed), FM_ERROR_INVALID_ARGUMENT);
    }
    desc.shape = (fm_shape){65535, 65535, 65535};
    CHECK_FAILS(fm_composed_create(s.scene, &desc, &composed), FM_ERROR_RANGE);
    desc = describe(0, 0);
    CHECK_FAILS(fm_composed_update(NULL, NULL), FM_ERROR_INVALID_ARGUMENT);
    CHECK(fm_composed_field(NULL) == NULL);
    add(&s, scene_mesh_box((const float[]){-0.5f, -0.5f, -0.5f}, (const float[]){0.5f, 0.5f, 0.5f}), place);
    composed = compose_anew(s.scene, &desc);
    float *before = download(composed);
    for (int i = 0; i < 3; i++) {
        fm_transform3 bad = place;
        bad.rows[i][(i + 1) % 3] = 0.01f;
        bad.rows[i][i] = i == 2 ? 0 : 1.001f;
        move(&s, 0, bad);
        CHECK_FAILS(fm_composed_update(composed, NULL), FM_ERROR_INVALID_ARGUMENT);
    }
    float *after = download(composed);
    CHECK(memcmp(before, after, TEXELS * sizeof *after) == 0);
    free(before);
    free(after);
    move(&s, 0, random_place(1));
    CHECK_OK(fm_composed_update(composed, NULL));
    check_same(&s, composed, &desc);
    fm_composed_destroy(composed);
    fm_composed_destroy(NULL);
    close_stage(&s);
}

static fm_result compose_with_little_memory(fm_context *poor, void *user) {
    const scene_mesh *shape = user;
    const fm_mesh_desc desc = scene_mesh_describe(shape);
    const fm_composed_desc field = describe(0, 32);
    const fm_transform3 place = random_place(1);
    fm_scene *scene = NULL;
    fm_mesh *mesh = NULL;
    fm_composed *composed = NULL;
    fm_result status = fm_mesh_create(poor, &desc, &mesh);
    status = status == FM_OK ? fm_scene_create(poor, &scene) : status;
    status = status == FM_OK ? fm_composed_create(scene, &field, &composed) : status;
    for (int i = 0; i < 2 && status == FM_OK; i++) {
        status = fm_scene_add(scene, mesh, &place, NULL);
        status = status == FM_OK ? fm_composed_update(composed, NULL) : status;
    }
    status = status == FM_OK ? fm_scene_deform(scene, 0, (const float(*)[3])shape->vertices) : status;
    status = status == FM_OK ? fm_composed_update(composed, NULL) : status;
    fm_composed_destroy(composed);
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
    if (!CHECK_OK(fm_context_create(&(fm_context_desc){.backend = FM_BACKEND_CPU, .threads = 2}, &processor))) {
        return check_summary();
    }
    context = vulkan ? context : processor;
    moving(0, 0, 7);
    moving(2, 24, 3);
    printf("the largest error is %.3g of its bound\n", worst);
    little();
    nothing();
    shared();
    in_flight();
    if (vulkan) {
        many();
    }
    bad_arguments();
    scene_mesh sphere = scene_mesh_sphere(8, 9, (const float[]){0, 0, 0}, 0.5f);
    exhaust("a composed field", compose_with_little_memory, &sphere, -1);
    scene_mesh_free(&sphere);
    if (vulkan) {
        vulkan_close(context);
    }
    fm_context_destroy(processor);
    return check_summary();
}
