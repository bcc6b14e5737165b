// SPDX-License-Identifier: MIT
// Meshes on Vulkan: the tree and what is asked of it, against brute force in doubles.

#include "mesh/gpu_mesh.h"
#include "mesh_gpu_common.h"

enum { POSITIONS = 400 };

static float spread_of(const float low[3], const float high[3]) {
    return low[0] <= high[0] ? fmaxf(high[0] - low[0], fmaxf(high[1] - low[1], high[2] - low[2])) : 1;
}

// Near, within and beside the mesh, on its corners, and where no number is.
static void choose_positions(const scene_mesh *mesh, float (*positions)[3]) {
    float low[3], high[3];
    mesh_box(mesh, low, high);
    const float spread = spread_of(low, high);
    uint64_t seed = 11;
    for (uint32_t i = 0; i < POSITIONS; i++) {
        const float *corner = mesh->vertex_count ? mesh->vertices[test_random(&seed) % mesh->vertex_count] : NULL;
        for (int axis = 0; axis < 3; axis++) {
            const bool boxed = low[0] <= high[0];
            positions[i][axis] = uniform(&seed, boxed ? low[axis] - spread / 2 : -1, boxed ? high[axis] + spread / 2 : 1);
            if (corner && corner_fits(corner) && i % 4 < 2) {
                positions[i][axis] = corner[axis] + (i % 4 ? uniform(&seed, -spread, spread) * 0.01f : 0);
            }
        }
    }
    positions[POSITIONS - 1][1] = NAN;
    positions[POSITIONS - 2][2] = INFINITY;
}

static bool is_place(const float p[3]) {
    return isfinite(p[0]) && isfinite(p[1]) && isfinite(p[2]);
}

// What the contract of fields allows, for the mesh's and the position's coordinates.
static double allowed(float largest, const float p[3]) {
    const float most = fmaxf(fmaxf(largest, fabsf(p[0])), fmaxf(fabsf(p[1]), fabsf(p[2])));
    return 4.0 * (nextafterf(most, INFINITY) - most);
}

static void check_closest(fm_mesh *mesh, const scene_mesh *source, float (*positions)[3], float bound) {
    float low[3], high[3];
    const float largest = mesh_box(source, low, high);
    static fm_closest closest[POSITIONS];
    if (!CHECK_OK(fm_gpu_mesh_closest(mesh, (const float(*)[3])positions, POSITIONS, bound, closest))) {
        return;
    }
    uint32_t wrong = 0, too_far = 0, elsewhere = 0, lost = 0;
    for (uint32_t i = 0; i < POSITIONS; i++) {
        const float *p = positions[i];
        const fm_closest *c = &closest[i];
        const double want = is_place(p) ? sqrt(oracle_nearest2(source, p)) : INFINITY;
        const double error = is_place(p) ? allowed(largest, p) : 0;
        if (c->triangle == FM_NO_TRIANGLE) {
            wrong += c->distance != INFINITY;
            lost += !(want == INFINITY || (bound > 0 && want >= bound - error));
            continue;
        }
        wrong += !(fabs(c->distance - want) <= error) || c->triangle >= source->triangle_count;
        too_far += bound > 0 && !(c->distance < bound + (float)error);
        const vector3 way = from(p, c->point);
        elsewhere += !(fabs(sqrt(dot3(way, way)) - want) <= error) ||
                     !(sqrt(oracle_distance2(source, c->triangle, p)) <= want + error) ||
                     !(sqrt(oracle_distance2(source, c->triangle, c->point)) <= error);
    }
    CHECK(wrong == 0);
    CHECK(too_far == 0);
    CHECK(elsewhere == 0);
    CHECK(lost == 0);
}

// The first hit, in doubles; `doubt` is set when an edge is so near that rounding may decide.
static double oracle_cast(const scene_mesh *mesh, const fm_mesh_ray *ray, bool *doubt) {
    const vector3 d = {ray->direction[0], ray->direction[1], ray->direction[2]};
    double best = INFINITY;
    *doubt = false;
    for (uint64_t i = 0; i < mesh->triangle_count; i++) {
        const uint32_t *t = mesh->triangles[i];
        if (!triangle_fits(mesh, i)) {
            continue;
        }
        const float *a = mesh->vertices[t[0]];
        const vector3 e1 = from(a, mesh->vertices[t[1]]), e2 = from(a, mesh->vertices[t[2]]), s = from(a, ray->origin);
        const vector3 n = cross3(e1, e2), q = cross3(s, d);
        const double det = -dot3(n, d);
        const double scale = sqrt(dot3(n, n) * dot3(d, d));
        const double u = dot3(e2, q) / det, v = -dot3(e1, q) / det, along = dot3(s, n) / det;
        if (fabs(det) <= 1e-3 * scale) {
            *doubt |= fabs(dot3(s, n)) <= 1e-2 * sqrt(dot3(n, n));
            continue;
        }
        const double edge = fmin(fmin(u, v), 1 - u - v);
        *doubt |= fabs(edge) < 1e-4 && along < best;
        *doubt |= edge > -1e-4 && (fabs(along - ray->first) < 1e-4 || fabs(along - ray->last) < 1e-4);
        if (edge >= 0 && along >= ray->first && along <= ray->last && along < best) {
            best = along;
        }
    }
    return best;
}

static void check_cast(fm_mesh *mesh, const scene_mesh *source, float (*positions)[3]) {
    static fm_mesh_ray rays[POSITIONS];
    static fm_mesh_hit first[POSITIONS], any[POSITIONS];
    uint64_t seed = 5;
    for (uint32_t i = 0; i < POSITIONS; i++) {
        memcpy(rays[i].origin, positions[i], sizeof rays[i].origin);
        for (int axis = 0; axis < 3; axis++) {
            rays[i].direction[axis] = i % 5 == 0 && axis != (int)(i % 3) ? 0 : uniform(&seed, -1, 1);
        }
        rays[i].first = i % 3 ? 0 : -1;
        rays[i].last = i % 2 ? INFINITY : 1;
    }
    memset(rays[0].direction, 0, sizeof rays[0].direction);
    if (!CHECK_OK(fm_gpu_mesh_cast(mesh, (const fm_mesh_ray *)rays, POSITIONS, false, first)) ||
        !CHECK_OK(fm_gpu_mesh_cast(mesh, (const fm_mesh_ray *)rays, POSITIONS, true, any))) {
        return;
    }
    uint32_t wrong = 0, hits = 0;
    for (uint32_t i = 0; i < POSITIONS; i++) {
        const fm_mesh_ray *ray = &rays[i];
        wrong += (first[i].t < INFINITY) != (first[i].triangle != FM_NO_TRIANGLE);
        wrong += (any[i].triangle == FM_NO_TRIANGLE) != (first[i].triangle == FM_NO_TRIANGLE);
        wrong += any[i].t < first[i].t;
        hits += first[i].triangle != FM_NO_TRIANGLE;
        bool doubt = false;
        const double want = is_place(ray->origin) && i > 0 ? oracle_cast(source, ray, &doubt) : INFINITY;
        if (doubt) {
            continue;
        }
        wrong += !(fabs(first[i].t - want) <= 1e-4 * (1 + fabs(want))) && !(want == INFINITY && first[i].t == INFINITY);
    }
    CHECK(wrong == 0);
    CHECK(hits > 0 || source->triangle_count < 100);
}

// Through each corner and the middle of each edge of a closed mesh, from within.
static void check_watertight(fm_context *context) {
    scene_mesh source = scene_mesh_sphere(20, 31, (const float[]){0.1f, 0.2f, 0.3f}, 1);
    const fm_mesh_desc desc = scene_mesh_describe(&source);
    fm_mesh *mesh = NULL;
    const uint32_t count = (uint32_t)source.triangle_count * 2;
    fm_mesh_ray *rays = calloc(count, sizeof *rays);
    fm_mesh_hit *hits = calloc(count, sizeof *hits);
    if (CHECK(rays && hits) && CHECK_OK(fm_mesh_create(context, &desc, &mesh))) {
        for (uint32_t i = 0; i < count; i++) {
            const uint32_t *t = source.triangles[i / 2];
            for (int axis = 0; axis < 3; axis++) {
                rays[i].origin[axis] = axis == 0 ? 0.25f : 0.125f;
                const float a = source.vertices[t[0]][axis], b = source.vertices[t[1]][axis];
                rays[i].direction[axis] = (i % 2 ? a : a + 0.5f * (b - a)) - rays[i].origin[axis];
            }
            rays[i].last = INFINITY;
        }
        CHECK_OK(fm_gpu_mesh_cast(mesh, rays, count, false, hits));
        uint32_t slipped = 0, outside = 0;
        for (uint32_t i = 0; i < count; i++) {
            const bool missed = !(fabsf(hits[i].t - 1) < 1e-4f), front = !hits[i].back;
            if ((missed || front) && slipped + outside < 8) {
                fprintf(stderr, "    ray %u through %s of triangle %u: hit %u at %g, %s\n", i, i % 2 ? "a corner" : "an edge",
                        i / 2, hits[i].triangle, (double)hits[i].t, front ? "in front" : "from behind");
            }
            slipped += missed;
            outside += front;
        }
        if (slipped + outside > 0) {
            fprintf(stderr, "    of %u rays %u slipped, %u hit a front\n", count, slipped, outside);
        }
        CHECK(slipped == 0);
        CHECK(outside == 0);
    }
    fm_mesh_destroy(mesh);
    free(rays);
    free(hits);
    scene_mesh_free(&source);
}

static void check_winding(fm_mesh *mesh, const scene_mesh *source, float (*positions)[3]) {
    static float every[POSITIONS], coarse[POSITIONS], fine[POSITIONS];
    if (!CHECK_OK(fm_gpu_mesh_winding(mesh, (const float(*)[3])positions, POSITIONS, INFINITY, every)) ||
        !CHECK_OK(fm_gpu_mesh_winding(mesh, (const float(*)[3])positions, POSITIONS, 0, coarse)) ||
        !CHECK_OK(fm_gpu_mesh_winding(mesh, (const float(*)[3])positions, POSITIONS, 8, fine))) {
        return;
    }
    double worst[3] = {0, 0, 0};
    for (uint32_t i = 0; i < POSITIONS; i++) {
        const float *p = positions[i];
        if (!is_place(p)) {
            CHECK(every[i] == 0 && coarse[i] == 0);
            continue;
        }
        // On the surface itself the number jumps.
        if (!(oracle_nearest2(source, p) > 1e-6)) {
            continue;
        }
        const double want = oracle_winding(source, p), scale = fmax(1, fabs(want));
        worst[0] = fmax(worst[0], fabs(every[i] - want) / scale);
        worst[1] = fmax(worst[1], fabs(coarse[i] - want) / scale);
        worst[2] = fmax(worst[2], fabs(fine[i] - want) / scale);
        CHECK(isfinite(coarse[i]) && isfinite(every[i]) && isfinite(fine[i]));
    }
    if (!CHECK(worst[0] < fmax(1e-4, 1e-6 * (double)source->triangle_count)) || !CHECK(worst[1] < 0.05) ||
        !CHECK(worst[2] < 2e-3)) {
        fprintf(stderr, "    off by %g, %g and %g\n", worst[0], worst[1], worst[2]);
    }
}

static void check_all(fm_mesh *mesh, const scene_mesh *source) {
    static float positions[POSITIONS][3];
    choose_positions(source, positions);
    check_closest(mesh, source, positions, 0);
    check_closest(mesh, source, positions, 0.25f);
    check_cast(mesh, source, positions);
    check_winding(mesh, source, positions);
}

// Vertices move; then the tree is refitted, and built anew.
static void check_deform(fm_mesh *mesh, scene_mesh *source) {
    for (int round = 0; round < 2; round++) {
        for (uint64_t i = 0; i < source->vertex_count; i++) {
            float *v = source->vertices[i];
            v[0] += 0.3f * sinf(3 * v[1]), v[2] *= 1.5f;
        }
        CHECK_OK(fm_mesh_deform(mesh, (const float(*)[3])source->vertices, round == 0 ? FM_TREE_REFIT : FM_TREE_REBUILD));
        check_all(mesh, source);
    }
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
        const fm_mesh_desc desc = scene_mesh_describe(&meshes[i].mesh);
        fm_mesh *mesh = NULL;
        const int failures = check_failures;
        if (CHECK_OK(fm_mesh_create(context, &desc, &mesh))) {
            check_all(mesh, &meshes[i].mesh);
            check_deform(mesh, &meshes[i].mesh);
        }
        if (check_failures > failures) {
            fprintf(stderr, "    so far with the mesh \"%s\"\n", meshes[i].name);
        }
        fm_mesh_destroy(mesh);
        scene_mesh_free(&meshes[i].mesh);
    }
    check_watertight(context);
    vulkan_close(context);
    return check_summary();
}
