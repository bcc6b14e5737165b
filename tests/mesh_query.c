// SPDX-License-Identifier: MIT
// Nearest points and rays of the CPU backend against loops over all triangles in doubles.

#include "faulty.h"
#include "mesh_gpu_common.h"

enum { POSITIONS = 240, RAYS = 240 };

static fm_context *context;

static fm_mesh *make(const scene_mesh *from) {
    const fm_mesh_desc desc = scene_mesh_describe(from);
    fm_mesh *mesh = NULL;
    CHECK_OK(fm_mesh_create(context, &desc, &mesh));
    return mesh;
}

static void scale_mesh(scene_mesh *mesh, float scale, float shift) {
    for (uint64_t i = 0; i < mesh->vertex_count; i++) {
        for (int axis = 0; axis < 3; axis++) {
            mesh->vertices[i][axis] = mesh->vertices[i][axis] * scale + shift;
        }
    }
}

// In and around the box, far away, and on corners.
static float choose_positions(const scene_mesh *mesh, float (*positions)[3], uint64_t seed) {
    float low[3], high[3];
    float largest = mesh_box(mesh, low, high);
    for (int i = 0; i < POSITIONS; i++) {
        const float wide = i % 10 == 0 ? 20 : 0.3f;
        const uint64_t corner = mesh->vertex_count > 0 ? test_random(&seed) % mesh->vertex_count : 0;
        for (int axis = 0; axis < 3; axis++) {
            const float a = low[axis] <= high[axis] ? low[axis] : -1, b = low[axis] <= high[axis] ? high[axis] : 1;
            positions[i][axis] = uniform(&seed, a - wide * (b - a), b + wide * (b - a));
            if (i % 10 == 1 && mesh->vertex_count > 0 && corner_fits(mesh->vertices[corner])) {
                positions[i][axis] = mesh->vertices[corner][axis];
            }
            largest = fmaxf(largest, fabsf(positions[i][axis]));
        }
    }
    return largest;
}

static bool check_one(const scene_mesh *shape, const float p[3], const fm_closest *found, double nearest, double tolerance) {
    if (isinf(nearest)) {
        return CHECK(found->triangle == FM_NO_TRIANGLE && isinf(found->distance));
    }
    if (!CHECK(found->triangle < shape->triangle_count)) {
        return false;
    }
    const double own = sqrt(oracle_distance2(shape, found->triangle, p));
    double apart = 0;
    for (int axis = 0; axis < 3; axis++) {
        apart += pow((double)found->point[axis] - p[axis], 2);
    }
    return CHECK(fabs(found->distance - nearest) <= tolerance) && CHECK(fabs(found->distance - own) <= tolerance) &&
           CHECK(fabs(sqrt(apart) - nearest) <= tolerance);
}

static void nearest_of(const char *name, const scene_mesh *shape, fm_mesh *mesh) {
    float positions[POSITIONS][3];
    fm_closest closest[POSITIONS], bounded[POSITIONS];
    const double tolerance = 4.0 * FLT_EPSILON * choose_positions(shape, positions, 11);
    CHECK_OK(fm_mesh_closest(mesh, (const float(*)[3])positions, POSITIONS, 0, closest));
    bool good = true;
    for (int i = 0; i < POSITIONS; i++) {
        const double nearest = sqrt(oracle_nearest2(shape, positions[i]));
        good = check_one(shape, positions[i], &closest[i], nearest, tolerance) && good;
    }
    const float bound = closest[5].distance;
    if (bound > 0 && isfinite(bound)) {
        CHECK_OK(fm_mesh_closest(mesh, (const float(*)[3])positions, POSITIONS, bound, bounded));
        for (int i = 0; i < POSITIONS; i++) {
            const bool found = bounded[i].triangle != FM_NO_TRIANGLE;
            const bool clear = fabs((double)closest[i].distance - bound) > tolerance;
            good = CHECK(!clear || found == (closest[i].distance < bound)) && good;
            good = CHECK(!found || fabs((double)bounded[i].distance - closest[i].distance) <= tolerance) && good;
            good = CHECK(found || isinf(bounded[i].distance)) && good;
        }
    }
    if (!good) {
        fprintf(stderr, "    nearest points of %s\n", name);
    }
}

typedef struct crossing {
    double t, least;  // least: of the three weights; below 0 the ray passes beside the triangle
    bool back;
} crossing;

static crossing cross_triangle(const scene_mesh *shape, uint64_t i, const fm_mesh_ray *ray) {
    const float *a = shape->vertices[shape->triangles[i][0]], *b = shape->vertices[shape->triangles[i][1]];
    const float *c = shape->vertices[shape->triangles[i][2]];
    const vector3 ab = from(a, b), ac = from(a, c), ao = from(a, ray->origin);
    const vector3 d = {ray->direction[0], ray->direction[1], ray->direction[2]};
    const vector3 n = cross3(ab, ac);
    const double slope = -dot3(d, n);
    const vector3 e = cross3(ao, d);
    const double v = dot3(ac, e) / slope, w = -dot3(ab, e) / slope;
    return (crossing){dot3(ao, n) / slope, slope == 0 ? -1 : fmin(fmin(v, w), 1 - v - w), slope < 0};
}

// Hits that rounding cannot decide otherwise must be found; what is found must be a hit.
static bool check_hit(const scene_mesh *shape, const fm_mesh_ray *ray, const fm_mesh_hit *hit, bool any) {
    const double margin = 1e-4;
    double first = INFINITY;
    for (uint64_t i = 0; i < shape->triangle_count; i++) {
        if (triangle_fits(shape, i)) {
            const crossing c = cross_triangle(shape, i, ray);
            const bool sure = c.least > margin && c.t > ray->first * (1 + margin) && c.t < ray->last * (1 - margin);
            first = sure && c.t < first ? c.t : first;
        }
    }
    if (hit->triangle == FM_NO_TRIANGLE) {
        return CHECK(isinf(first)) && CHECK(isinf(hit->t));
    }
    if (!CHECK(hit->triangle < shape->triangle_count)) {
        return false;
    }
    const crossing own = cross_triangle(shape, hit->triangle, ray);
    return CHECK(own.least > -margin) && CHECK(fabs(own.t - hit->t) <= 1e-4 * (1 + fabs(own.t))) && CHECK(own.back == hit->back) &&
           CHECK(hit->u >= 0 && hit->v >= 0 && hit->u + hit->v <= 1.000001f) && CHECK(any || hit->t <= first * (1 + 1e-5) + 1e-6) &&
           CHECK(hit->t >= ray->first && hit->t <= ray->last);
}

static void rays_of(const char *name, const scene_mesh *shape, fm_mesh *mesh) {
    float positions[POSITIONS][3], others[POSITIONS][3];
    fm_mesh_ray rays[RAYS];
    fm_mesh_hit hits[RAYS], some[RAYS];
    choose_positions(shape, positions, 23);
    choose_positions(shape, others, 29);
    for (int i = 0; i < RAYS; i++) {
        rays[i] = (fm_mesh_ray){.first = i % 5 == 0 ? 0.25f : 0, .last = i % 7 == 0 ? 0.75f : INFINITY};
        for (int axis = 0; axis < 3; axis++) {
            rays[i].origin[axis] = positions[i][axis];
            const bool along = i % 4 != 0 || axis == i / 4 % 3;
            rays[i].direction[axis] = along ? others[i][axis] - positions[i][axis] : 0;
        }
    }
    CHECK_OK(fm_mesh_cast(mesh, rays, RAYS, false, hits));
    CHECK_OK(fm_mesh_cast(mesh, rays, RAYS, true, some));
    bool good = true;
    for (int i = 0; i < RAYS; i++) {
        good = check_hit(shape, &rays[i], &hits[i], false) && good;
        good = check_hit(shape, &rays[i], &some[i], true) && good;
        good = CHECK((hits[i].triangle == FM_NO_TRIANGLE) == (some[i].triangle == FM_NO_TRIANGLE)) && good;
    }
    if (!good) {
        fprintf(stderr, "    rays of %s\n", name);
    }
}

// No ray from inside slips through: not at corners, not at middles of edges.
static void watertight(const scene_mesh *shape, const float inside[3]) {
    fm_mesh *mesh = make(shape);
    const uint64_t count = shape->vertex_count + 3 * shape->triangle_count;
    fm_mesh_ray *rays = calloc(count, sizeof *rays);
    fm_mesh_hit *hits = calloc(count, sizeof *hits);
    for (uint64_t i = 0; i < count; i++) {
        const uint64_t edge = i - shape->vertex_count;
        for (int axis = 0; axis < 3; axis++) {
            float aim;
            if (i < shape->vertex_count) {
                aim = shape->vertices[i][axis];
            } else {
                const uint32_t *t = shape->triangles[edge / 3];
                aim = 0.5f * (shape->vertices[t[edge % 3]][axis] + shape->vertices[t[(edge + 1) % 3]][axis]);
            }
            rays[i].origin[axis] = inside[axis];
            rays[i].direction[axis] = aim - inside[axis];
        }
        rays[i].last = INFINITY;
    }
    CHECK_OK(fm_mesh_cast(mesh, rays, (uint32_t)count, false, hits));
    for (uint64_t i = 0; i < count; i++) {
        CHECK(hits[i].triangle != FM_NO_TRIANGLE && hits[i].back);
    }
    free(rays);
    free(hits);
    fm_mesh_destroy(mesh);
}

static void odd_rays(void) {
    scene_mesh shape = scene_mesh_box((const float[]){0, 0, 0}, (const float[]){1, 1, 1});
    fm_mesh *mesh = make(&shape);
    const float huge = ldexpf(1, 100), tiny = ldexpf(1, -100);
    const struct {
        fm_mesh_ray ray;
        float t;  // infinite: no hit
    } cases[] = {
        {{{0.5f, 0.4f, -1}, 0, {0, 0, 1}, INFINITY}, 1},
        {{{0.5f, 0.4f, -1}, 0, {0, 0, -1}, INFINITY}, INFINITY},
        {{{0.5f, 0.4f, -1}, 0, {0, 0, huge}, INFINITY}, 1 / huge},
        {{{0.5f, 0.4f, -1}, 0, {0, 0, tiny}, INFINITY}, 1 / tiny},
        {{{0.5f, 0.4f, -1}, 1, {0, 0, 1}, 1}, 1},
        {{{0.5f, 0.4f, -1}, 1.5f, {0, 0, 1}, INFINITY}, 2},
        {{{0.5f, 0.4f, -1}, 1.5f, {0, 0, 1}, 1.75f}, INFINITY},
        {{{0.5f, 0.4f, 3}, -10, {0, 0, 1}, 0}, -3},
        {{{0.5f, 0.4f, -1}, 2, {0, 0, 1}, 1}, INFINITY},
        {{{0.5f, 0.4f, -1}, 0, {0, 0, 0}, INFINITY}, INFINITY},
        {{{0.5f, 0.4f, -1}, 0, {0, NAN, 1}, INFINITY}, INFINITY},
        {{{NAN, 0.4f, -1}, 0, {0, 0, 1}, INFINITY}, INFINITY},
        {{{0.5f, 0.4f, -1}, NAN, {0, 0, 1}, INFINITY}, INFINITY},
        {{{0.5f, 0.4f, -1}, 0, {0, 0, 1}, NAN}, INFINITY},
        {{{0.5f, 0.4f, -1}, 0, {0, 0, INFINITY}, INFINITY}, INFINITY},
        {{{INFINITY, 0.4f, -1}, 0, {0, 0, 1}, INFINITY}, INFINITY},
        // In the plane of a side: what it passes are the sides that it meets at an angle.
        {{{0.5f, 0, -1}, 0, {0, 0, 1}, INFINITY}, 1},
        {{{1, 1, -1}, 0, {0, 0, 1}, INFINITY}, 1},
        {{{0, 0.25f, -1}, 0, {-0.0f, 0, 1}, INFINITY}, 1},
    };
    for (size_t i = 0; i < sizeof cases / sizeof cases[0]; i++) {
        for (int any = 0; any < 2; any++) {
            fm_mesh_hit hit;
            CHECK_OK(fm_mesh_cast(mesh, &cases[i].ray, 1, any, &hit));
            const bool range = cases[i].ray.first <= cases[i].ray.last;
            const bool good = isinf(cases[i].t) ? hit.triangle == FM_NO_TRIANGLE && isinf(hit.t)
                              : any             ? hit.triangle != FM_NO_TRIANGLE && range
                                                : fabsf(hit.t - cases[i].t) <= 1e-6f * fabsf(cases[i].t);
            if (!CHECK(good)) {
                fprintf(stderr, "    ray %zu, any %d: t %g\n", i, any, (double)hit.t);
            }
        }
    }
    fm_mesh_destroy(mesh);
    scene_mesh_free(&shape);
}

// A tree that is refitted answers as one that is built anew, also where triangles stop taking part and come back.
static void deformed(void) {
    scene_mesh shape = scene_mesh_soup(800, 3, (const float[]){0, 0, 0}, 2, 0.2f);
    fm_mesh *mesh = make(&shape);
    uint64_t seed = 5;
    for (int round = 0; round < 6; round++) {
        nearest_of("a deformed soup", &shape, mesh);
        rays_of("a deformed soup", &shape, mesh);
        for (uint64_t i = 0; i < shape.vertex_count; i++) {
            for (int axis = 0; axis < 3; axis++) {
                shape.vertices[i][axis] =
                    (isnan(shape.vertices[i][axis]) ? 0 : shape.vertices[i][axis]) + uniform(&seed, -0.2f, 0.2f);
            }
            shape.vertices[i][0] = round % 3 == 1 && i % 97 == 0 ? NAN : shape.vertices[i][0];
        }
        CHECK_OK(fm_mesh_deform(mesh, (const float(*)[3])shape.vertices, round == 3 ? FM_TREE_REBUILD : FM_TREE_REFIT));
    }
    fm_mesh_destroy(mesh);
    scene_mesh_free(&shape);
}

// Every instruction set finds the same, bit for bit.
static void portable(const scene_mesh *shape) {
    float positions[POSITIONS][3];
    fm_closest one[POSITIONS] = {0}, other[POSITIONS] = {0};
    float winding[2][POSITIONS];
    fm_mesh *best = make(shape);
    choose_positions(shape, positions, 31);
    CHECK_OK(fm_mesh_closest(best, (const float(*)[3])positions, POSITIONS, 0, one));
    CHECK_OK(fm_mesh_winding(best, (const float(*)[3])positions, POSITIONS, 0, winding[0]));
    setenv("FATHOM_SIMD", "portable", 1);
    fm_mesh *plain = make(shape);
    CHECK_OK(fm_mesh_closest(plain, (const float(*)[3])positions, POSITIONS, 0, other));
    CHECK_OK(fm_mesh_winding(plain, (const float(*)[3])positions, POSITIONS, 0, winding[1]));
    unsetenv("FATHOM_SIMD");
    CHECK(memcmp(one, other, sizeof one) == 0);
    CHECK(memcmp(winding[0], winding[1], sizeof winding[0]) == 0);
    fm_mesh_destroy(best);
    fm_mesh_destroy(plain);
}

static void bad_arguments(void) {
    const float corners[3][3] = {{0}, {1}, {0, 1}};
    const uint32_t triangles[2][3] = {{0, 1, 2}, {0, 3, 1}};
    fm_mesh *mesh = NULL;
    fm_mesh_desc desc = {corners, 3, triangles, 2};
    CHECK_FAILS(fm_mesh_create(context, &desc, &mesh), FM_ERROR_INVALID_ARGUMENT);
    CHECK(strstr(fm_last_error(), "triangle 1") && strstr(fm_last_error(), "vertex 3"));
    CHECK_FAILS(fm_mesh_create(NULL, NULL, &mesh), FM_ERROR_INVALID_ARGUMENT);
    CHECK_FAILS(fm_mesh_create(context, NULL, NULL), FM_ERROR_INVALID_ARGUMENT);
    desc = (fm_mesh_desc){NULL, 3, triangles, 1};
    CHECK_FAILS(fm_mesh_create(context, &desc, &mesh), FM_ERROR_INVALID_ARGUMENT);
    desc = (fm_mesh_desc){corners, 3, NULL, 1};
    CHECK_FAILS(fm_mesh_create(context, &desc, &mesh), FM_ERROR_INVALID_ARGUMENT);
    desc = (fm_mesh_desc){corners, UINT64_C(1) << 32, triangles, 1};
    CHECK_FAILS(fm_mesh_create(context, &desc, &mesh), FM_ERROR_INVALID_ARGUMENT);
    desc = (fm_mesh_desc){corners, 3, triangles, UINT64_C(1) << 31};
    CHECK_FAILS(fm_mesh_create(context, &desc, &mesh), FM_ERROR_INVALID_ARGUMENT);
    CHECK(mesh == NULL);
    desc = (fm_mesh_desc){corners, 3, triangles, 1};
    if (!CHECK_OK(fm_mesh_create(context, &desc, &mesh))) {
        return;
    }
    CHECK_FAILS(fm_mesh_deform(NULL, corners, FM_TREE_REFIT), FM_ERROR_INVALID_ARGUMENT);
    CHECK_FAILS(fm_mesh_deform(mesh, NULL, FM_TREE_REFIT), FM_ERROR_INVALID_ARGUMENT);
    CHECK_FAILS(fm_mesh_deform(mesh, corners, (fm_tree)7), FM_ERROR_INVALID_ARGUMENT);
    fm_closest closest;
    fm_mesh_hit hit;
    fm_mesh_ray ray = {.direction = {1}, .last = 1};
    float winding;
    CHECK_FAILS(fm_mesh_closest(NULL, corners, 1, 0, &closest), FM_ERROR_INVALID_ARGUMENT);
    CHECK_FAILS(fm_mesh_closest(mesh, NULL, 1, 0, &closest), FM_ERROR_INVALID_ARGUMENT);
    CHECK_FAILS(fm_mesh_closest(mesh, corners, 1, 0, NULL), FM_ERROR_INVALID_ARGUMENT);
    CHECK_FAILS(fm_mesh_closest(mesh, corners, 1, -1, &closest), FM_ERROR_INVALID_ARGUMENT);
    CHECK_FAILS(fm_mesh_closest(mesh, corners, 1, NAN, &closest), FM_ERROR_INVALID_ARGUMENT);
    CHECK_FAILS(fm_mesh_cast(mesh, NULL, 1, false, &hit), FM_ERROR_INVALID_ARGUMENT);
    CHECK_FAILS(fm_mesh_cast(mesh, &ray, 1, false, NULL), FM_ERROR_INVALID_ARGUMENT);
    CHECK_FAILS(fm_mesh_cast(NULL, &ray, 1, false, &hit), FM_ERROR_INVALID_ARGUMENT);
    CHECK_FAILS(fm_mesh_winding(mesh, corners, 1, -1, &winding), FM_ERROR_INVALID_ARGUMENT);
    CHECK_FAILS(fm_mesh_winding(mesh, corners, 1, NAN, &winding), FM_ERROR_INVALID_ARGUMENT);
    CHECK_FAILS(fm_mesh_winding(mesh, NULL, 1, 0, &winding), FM_ERROR_INVALID_ARGUMENT);
    CHECK_OK(fm_mesh_closest(mesh, NULL, 0, 0, NULL));
    CHECK_OK(fm_mesh_cast(mesh, NULL, 0, false, NULL));
    CHECK_OK(fm_mesh_winding(mesh, NULL, 0, 0, NULL));
    const float nowhere[3][3] = {{NAN, 0, 0}, {0, INFINITY, 0}, {0, 0, -INFINITY}};
    for (int i = 0; i < 3; i++) {
        CHECK_OK(fm_mesh_closest(mesh, &nowhere[i], 1, 0, &closest));
        CHECK(closest.triangle == FM_NO_TRIANGLE && isinf(closest.distance));
        CHECK_OK(fm_mesh_winding(mesh, &nowhere[i], 1, 0, &winding));
        CHECK(winding == 0);
    }
    fm_mesh_destroy(mesh);
    fm_mesh_destroy(NULL);
}

static fm_result query_with_little_memory(fm_context *poor, void *user) {
    const scene_mesh *shape = user;
    const fm_mesh_desc desc = scene_mesh_describe(shape);
    fm_mesh *mesh = NULL;
    fm_result status = fm_mesh_create(poor, &desc, &mesh);
    if (status != FM_OK) {
        return status;
    }
    fm_closest closest;
    float winding;
    uint64_t pairs;
    fm_mesh_info info;
    const float position[3] = {1, 2, 3};
    status = fm_mesh_closest(mesh, &position, 1, 0, &closest);
    status = status == FM_OK ? fm_mesh_winding(mesh, &position, 1, 0, &winding) : status;
    status = status == FM_OK ? fm_mesh_describe(mesh, &info) : status;
    status = status == FM_OK ? fm_mesh_intersections(mesh, 0, &pairs) : status;
    status = status == FM_OK ? fm_mesh_deform(mesh, desc.vertices, FM_TREE_REBUILD) : status;
    status = status == FM_OK ? fm_mesh_closest(mesh, &position, 1, 0, &closest) : status;
    fm_mesh_destroy(mesh);
    return status;
}

// Host memory is counted as that of meshes, and given back.
static uint64_t mesh_bytes(void) {
    enum { MOST = 32 };
    fm_memory memory[MOST];
    uint32_t count = MOST;
    uint64_t bytes = 0;
    CHECK_OK(fm_context_memory(context, &count, memory));
    for (uint32_t i = 0; i < count; i++) {
        bytes += !memory[i].device && strcmp(memory[i].purpose, "meshes") == 0 ? memory[i].bytes : 0;
    }
    return bytes;
}

int main(void) {
    if (!CHECK_OK(fm_context_create(&(fm_context_desc){.backend = FM_BACKEND_CPU, .threads = 2}, &context))) {
        return check_summary();
    }
    named_mesh meshes[NAMED_MESHES];
    make_meshes(meshes);
    for (int i = 0; i < NAMED_MESHES; i++) {
        fm_mesh *mesh = make(&meshes[i].mesh);
        nearest_of(meshes[i].name, &meshes[i].mesh, mesh);
        rays_of(meshes[i].name, &meshes[i].mesh, mesh);
        portable(&meshes[i].mesh);
        fm_mesh_destroy(mesh);
        for (int k = 0; k < 3 && strcmp(meshes[i].name, "bad soup") != 0; k++) {
            const float scales[] = {1e-9f, 1e24f, 1e-11f};  // one after the other
            scale_mesh(&meshes[i].mesh, scales[k], 0);
            mesh = make(&meshes[i].mesh);
            nearest_of(meshes[i].name, &meshes[i].mesh, mesh);
            fm_mesh_destroy(mesh);
        }
        scene_mesh_free(&meshes[i].mesh);
    }
    scene_mesh sphere = scene_mesh_sphere(30, 50, (const float[]){3, -7, 11}, 2);
    watertight(&sphere, (const float[]){3.25f, -7.1f, 10.7f});
    exhaust("queries of a mesh", query_with_little_memory, &sphere, -1);
    scene_mesh_free(&sphere);
    sphere = scene_mesh_sphere(30, 50, (const float[]){0, 0, 0}, 1);
    watertight(&sphere, (const float[]){0, 0, 0});
    scene_mesh_free(&sphere);
    odd_rays();
    deformed();
    bad_arguments();
    CHECK(mesh_bytes() == 0);
    scene_mesh box = scene_mesh_box((const float[]){0, 0, 0}, (const float[]){1, 1, 1});
    fm_mesh *mesh = make(&box);
    CHECK(mesh_bytes() > 8 * sizeof *box.vertices + 12 * sizeof *box.triangles);
    fm_mesh_destroy(mesh);
    scene_mesh_free(&box);
    CHECK(mesh_bytes() == 0);
    fm_context_destroy(context);
    return check_summary();
}
