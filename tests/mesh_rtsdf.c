// SPDX-License-Identifier: MIT
// The fine field: convergence where nothing moves, the trace of what does, the mask, rays and signs, on both backends; and both
// against each other.

#include "mesh_rtsdf_common.h"

static const float middle[3] = {0, 0, 0};
static const float radius = 0.3f;
static const double slack = 0.004;  // the sphere's triangles lie at most this far within it

static double sphere_distance(const double at[3], const float centre[3]) {
    const double away[3] = {at[0] - centre[0], at[1] - centre[1], at[2] - centre[2]};
    return sqrt(away[0] * away[0] + away[1] * away[1] + away[2] * away[2]);
}

static fm_rtsdf_desc desc_of(uint32_t edge, uint32_t rays, float mask) {
    return (fm_rtsdf_desc){.coarse = {edge, edge, edge},
                           .low = {-0.5, -0.5, -0.5},
                           .high = {0.5, 0.5, 0.5},
                           .mask = mask,
                           .rays = rays,
                           .bias = -1,
                           .seed = 7};
}

static fm_rtsdf *create(fm_context *context, const fm_rtsdf_desc *desc) {
    fm_rtsdf *rtsdf = NULL;
    CHECK_OK(fm_rtsdf_create(context, desc, &rtsdf));
    return rtsdf;
}

// What the fine field holds after so many frames of a fresh one.
static float *field_after(fm_context *context, const fm_rtsdf_desc *desc, fm_mesh *mesh, int frames) {
    fm_rtsdf *rtsdf = create(context, desc);
    for (int i = 0; i < frames; i++) {
        CHECK_OK(fm_rtsdf_update(rtsdf, mesh, NULL));
    }
    float *field = rtsdf_field(rtsdf, true);
    fm_rtsdf_destroy(rtsdf);
    return field;
}

// The coarse field between its texels, in double precision.
static double interpolate(const float *coarse, uint32_t n, uint64_t fine) {
    const uint64_t m = 2 * (uint64_t)n, at[3] = {fine % m, fine / m % m, fine / m / m};
    double sum = 0;
    for (int corner = 0; corner < 8; corner++) {
        double weight = 1;
        uint64_t index[3];
        for (int axis = 0; axis < 3; axis++) {
            const double place = fmin(fmax(((double)at[axis] + 0.5) / 2 - 0.5, 0), n - 1.0);
            const double low = floor(place);
            const bool upper = corner >> axis & 1;
            weight *= upper ? place - low : 1 - (place - low);
            index[axis] = (uint64_t)fmin(low + upper, n - 1.0);
        }
        sum += weight * (double)coarse[index[0] + n * (index[1] + n * index[2])];
    }
    return sum;
}

static void check_no_rays(fm_context *context, fm_mesh *mesh) {
    fm_rtsdf_desc desc = desc_of(8, 0, INFINITY);
    desc.bias = 0.02f;
    fm_rtsdf *rtsdf = create(context, &desc);
    for (int frame = 0; frame < 3; frame++) {
        CHECK_OK(fm_rtsdf_update(rtsdf, mesh, NULL));
        float *coarse = rtsdf_field(rtsdf, false), *fine = rtsdf_field(rtsdf, true);
        for (uint64_t i = 0; i < 4096; i++) {
            CHECK(fabs((double)fine[i] - (interpolate(coarse, 8, i) - 0.02)) < 1e-6);
        }
        free(coarse);
        free(fine);
    }
    fm_rtsdf_destroy(rtsdf);
}

// Rays are cast where the coarse distance is at most `mask`, and nowhere else.
static void check_mask(fm_context *context, fm_mesh *mesh) {
    const fm_rtsdf_desc none = desc_of(8, 0, INFINITY), some = desc_of(8, 3, 0.15f), all = desc_of(8, 3, INFINITY);
    float *coarse = field_after(context, &none, mesh, 1);
    float *narrow = field_after(context, &some, mesh, 1), *wide = field_after(context, &all, mesh, 1);
    uint64_t within = 0, changed = 0;
    for (uint64_t i = 0; i < 4096; i++) {
        if (coarse[i] > 0.15f) {
            CHECK(fabsf(narrow[i] - coarse[i]) <= 1e-6f);
            changed += wide[i] < coarse[i] - 1e-5f;
        } else {
            within++;
            CHECK(narrow[i] == wide[i]);
        }
        CHECK(wide[i] <= coarse[i] + 1e-6f);
    }
    printf("%llu texels within the mask, %llu beyond it that rays would have changed\n", (unsigned long long)within,
           (unsigned long long)changed);
    CHECK(within > 500 && changed > 10);
    free(coarse);
    free(narrow);
    free(wide);
}

// Of N directions one lies within a cap of share p around the shortest way but with the probability (1 - p)^N < exp(-p N). For
// 4,096 texels and one failure in a thousand runs p = ln(4096 * 1000) / N. A cap of share p reaches to the angle a of which 1 - cos
// a = 2 p, and a ray at that angle meets the sphere at t(a) = s cos a - sqrt(R^2 - s^2 sin^2 a), s from its centre. Without decay
// the field is the least of all of these and of the coarse distance: never below the true one, for rays never hit too early.
static void check_convergence(fm_context *context, fm_mesh *mesh) {
    enum { FRAMES = 12, RAYS = 64 };
    fm_rtsdf_desc desc = desc_of(8, RAYS, INFINITY);
    desc.alpha = 1;
    const fm_rtsdf_desc none = desc_of(8, 0, INFINITY);
    float *coarse = field_after(context, &none, mesh, 1);
    fm_rtsdf *rtsdf = create(context, &desc);
    float *before = NULL;
    const double cosine = 1 - 2 * log(4096 * 1000.0) / (FRAMES * RAYS);
    double mean = 0;
    for (int frame = 0; frame < FRAMES; frame++) {
        CHECK_OK(fm_rtsdf_update(rtsdf, mesh, NULL));
        float *field = rtsdf_field(rtsdf, true);
        for (uint64_t i = 0; i < 4096; i++) {
            CHECK(!before || field[i] <= before[i]);
        }
        free(before);
        before = field;
    }
    for (uint64_t i = 0; i < 4096; i++) {
        double at[3];
        rtsdf_place(rtsdf, true, i, at);
        const double s = sphere_distance(at, middle), away = s - (double)radius, f = (double)before[i], c = (double)coarse[i];
        if (away > slack) {
            const double most = s * cosine - sqrt((double)(radius * radius) - s * s * (1 - cosine * cosine)) + slack;
            CHECK(f >= fmin(c, away) - 1e-5);
            CHECK(f <= fmin(c + 1e-6, fmax(most, away + slack)));
            mean += fmax(f - away, 0) / 4096;
        } else if (away < -slack) {
            CHECK(f <= away + slack);
        }
    }
    printf("%d rays a texel: %.5f too far in the mean\n", FRAMES * RAYS, mean);
    free(before);
    free(coarse);
    fm_rtsdf_destroy(rtsdf);
}

// With decay a texel's value goes up and down, for a near hit is forgotten; but the more frames it can be the least of, the lower
// it is to be expected.
static void check_frames(fm_context *context, fm_mesh *mesh) {
    const fm_rtsdf_desc desc = desc_of(8, 4, INFINITY);
    double mean[3] = {0};
    static const int frames[3] = {1, 4, 24};
    for (int k = 0; k < 3; k++) {
        float *field = field_after(context, &desc, mesh, frames[k]);
        for (uint64_t i = 0; i < 4096; i++) {
            mean[k] += fmax((double)field[i], 0) / 4096;
        }
        free(field);
    }
    CHECK(mean[0] > mean[1] && mean[1] > mean[2]);
}

static void check_signs(fm_context *context, fm_mesh *mesh) {
    const fm_rtsdf_desc desc = desc_of(8, 5, INFINITY), none = desc_of(8, 0, INFINITY);
    fm_rtsdf *rtsdf = create(context, &desc);
    CHECK_OK(fm_rtsdf_update(rtsdf, mesh, NULL));
    float *field = rtsdf_field(rtsdf, true), *coarse = field_after(context, &none, mesh, 1);
    uint64_t hollow = 0;
    for (uint64_t i = 0; i < 4096; i++) {
        double at[3];
        rtsdf_place(rtsdf, true, i, at);
        const double away = sphere_distance(at, middle) - (double)radius;
        if (away < -slack) {
            CHECK(field[i] < 0);
            hollow += coarse[i] > 0;
        } else if (away > 0.14) {  // beyond the coarse voxels that the surface touches, beta taken off
            CHECK(field[i] > 0);
        }
    }
    // The coarse field knows nothing of inside.
    CHECK(hollow > 100);
    free(field);
    free(coarse);
    fm_rtsdf_destroy(rtsdf);
}

static void shift(scene_mesh *shape, float along_x) {
    for (uint64_t i = 0; i < shape->vertex_count; i++) {
        shape->vertices[i][0] += along_x;
    }
}

// A sphere that moves at once from the left to the right leaves a trace: where it was the field stays near, and approaches the
// coarse distance c by the factor alpha a frame. Rays only hit what is there now, at `away` or farther.
static void check_ghost(fm_context *context) {
    enum { FRAMES = 60 };
    const float left[3] = {-0.25f, 0, 0}, right[3] = {0.25f, 0, 0};
    scene_mesh shape = scene_mesh_sphere(16, 24, left, 0.15f);
    const fm_rtsdf_desc desc = desc_of(8, 5, INFINITY), none = desc_of(8, 0, INFINITY);
    fm_mesh *mesh = rtsdf_mesh(context, &shape);
    fm_rtsdf *rtsdf = create(context, &desc);
    for (int frame = 0; frame < 5; frame++) {
        CHECK_OK(fm_rtsdf_update(rtsdf, mesh, NULL));
    }
    float *old = rtsdf_field(rtsdf, true);
    shift(&shape, 0.5f);
    CHECK_OK(fm_mesh_deform(mesh, (const float(*)[3])shape.vertices, FM_TREE_REFIT));
    float *coarse = field_after(context, &none, mesh, 1);
    uint64_t ghosts = 0;
    double decay = 1;
    for (int frame = 1; frame <= FRAMES; frame++) {
        CHECK_OK(fm_rtsdf_update(rtsdf, mesh, NULL));
        decay *= 0.95;
        if (frame != 1 && frame != 10 && frame != FRAMES) {
            continue;
        }
        float *field = rtsdf_field(rtsdf, true);
        for (uint64_t i = 0; i < 4096; i++) {
            double at[3];
            rtsdf_place(rtsdf, true, i, at);
            const double away = sphere_distance(at, right) - 0.15, c = (double)coarse[i];
            // On the old surface, and far from where the sphere is now.
            if (fabsf(old[i]) > 0.03f || away < 0.3) {
                continue;
            }
            const double trace = c - decay * (c - (double)old[i]), f = (double)field[i];
            CHECK(f <= trace + 1e-5);
            CHECK(f >= fmin(trace, away) - 1e-5);
            CHECK(frame != 1 || f < 0.2 * away);
            CHECK(frame != FRAMES || f > 0.8 * fmin(away, c));
            ghosts += frame == 1;
        }
        free(field);
    }
    CHECK(ghosts > 20);
    free(old);
    free(coarse);
    fm_rtsdf_destroy(rtsdf);
    fm_mesh_destroy(mesh);
    scene_mesh_free(&shape);
}

// Where the mask ends nothing is kept: the coarse distance is new each frame.
static void check_no_ghost(fm_context *context) {
    const float left[3] = {-0.25f, 0, 0};
    scene_mesh shape = scene_mesh_sphere(16, 24, left, 0.15f);
    const fm_rtsdf_desc desc = desc_of(8, 5, 0.1f), none = desc_of(8, 0, 0.1f);
    fm_mesh *mesh = rtsdf_mesh(context, &shape);
    fm_rtsdf *rtsdf = create(context, &desc);
    CHECK_OK(fm_rtsdf_update(rtsdf, mesh, NULL));
    shift(&shape, 0.5f);
    CHECK_OK(fm_mesh_deform(mesh, (const float(*)[3])shape.vertices, FM_TREE_REFIT));
    CHECK_OK(fm_rtsdf_update(rtsdf, mesh, NULL));
    float *coarse = field_after(context, &none, mesh, 1), *field = rtsdf_field(rtsdf, true);
    for (uint64_t i = 0; i < 4096; i++) {
        CHECK(coarse[i] <= 0.1f || field[i] == coarse[i]);
    }
    free(coarse);
    free(field);
    fm_rtsdf_destroy(rtsdf);
    fm_mesh_destroy(mesh);
    scene_mesh_free(&shape);
}

static bool same_fields(const float *a, const float *b, uint64_t count) {
    return memcmp(a, b, count * sizeof *a) == 0;
}

// A reset starts anew, and what starts alike ends alike.
static void check_reset(fm_context *context, fm_mesh *mesh) {
    const fm_rtsdf_desc desc = desc_of(5, 2, 0.3f);
    float *fresh = field_after(context, &desc, mesh, 2);
    fm_rtsdf *rtsdf = create(context, &desc);
    fm_ticket ticket = 0;
    for (int frame = 0; frame < 5; frame++) {
        CHECK_OK(fm_rtsdf_update(rtsdf, mesh, &ticket));
        if (frame == 2) {
            CHECK_OK(fm_rtsdf_reset(rtsdf));
        }
    }
    CHECK_OK(fm_wait(context, ticket));
    float *field = rtsdf_field(rtsdf, true);
    CHECK(same_fields(fresh, field, 1000));
    // Gone while at work.
    CHECK_OK(fm_rtsdf_update(rtsdf, mesh, &ticket));
    CHECK_OK(fm_rtsdf_update(rtsdf, mesh, &ticket));
    fm_rtsdf_destroy(rtsdf);
    free(field);
    free(fresh);
}

// Nothing is infinitely far, and is not so any more once there is something.
static void check_empty(fm_context *context, fm_mesh *mesh) {
    fm_mesh *none = NULL;
    CHECK_OK(fm_mesh_create(context, NULL, &none));
    const fm_rtsdf_desc desc = desc_of(4, 1, INFINITY);
    fm_rtsdf *rtsdf = create(context, &desc);
    for (int frame = 0; frame < 4; frame++) {
        CHECK_OK(fm_rtsdf_update(rtsdf, frame == 2 ? mesh : none, NULL));
        float *field = rtsdf_field(rtsdf, true);
        for (int i = 0; i < 512; i++) {
            CHECK(frame == 2 ? fabsf(field[i]) < 2 : field[i] == INFINITY);
        }
        free(field);
    }
    fm_rtsdf_destroy(rtsdf);
    fm_mesh_destroy(none);
}

static void check_refused(fm_context *context, const fm_rtsdf_desc *desc) {
    fm_rtsdf *rtsdf = NULL;
    CHECK_FAILS(fm_rtsdf_create(context, desc, &rtsdf), FM_ERROR_INVALID_ARGUMENT);
    CHECK(!rtsdf);
}

static void check_arguments(fm_context *context, fm_mesh *mesh) {
    static const fm_rtsdf_desc bad[] = {
        {.coarse = {1025, 1, 1}},
        {.coarse = {8, 0, 8}},
        {.low = {0, 0, 0}, .high = {1, 0, 1}},
        {.high = {1, 1, INFINITY}},
        {.high = {1, NAN, 1}},
        {.flood = (fm_flood)3},
        {.beta = -1},
        {.beta = NAN},
        {.mask = -0.1f},
        {.mask = NAN},
        {.alpha = 1.5f},
        {.alpha = NAN},
        {.bias = INFINITY},
        {.rays = 65},
    };
    for (size_t i = 0; i < sizeof bad / sizeof *bad; i++) {
        check_refused(context, &bad[i]);
    }
    const fm_rtsdf_desc small = desc_of(2, 1, 0);
    fm_rtsdf *rtsdf = create(context, &small);
    CHECK_FAILS(fm_rtsdf_create(NULL, &small, &rtsdf), FM_ERROR_INVALID_ARGUMENT);
    CHECK_FAILS(fm_rtsdf_create(context, &small, NULL), FM_ERROR_INVALID_ARGUMENT);
    CHECK_FAILS(fm_rtsdf_update(NULL, mesh, NULL), FM_ERROR_INVALID_ARGUMENT);
    CHECK_FAILS(fm_rtsdf_update(rtsdf, NULL, NULL), FM_ERROR_INVALID_ARGUMENT);
    CHECK_FAILS(fm_rtsdf_reset(NULL), FM_ERROR_INVALID_ARGUMENT);
    fm_rtsdf_destroy(rtsdf);
    fm_rtsdf_destroy(NULL);
    // The box of all zeros is the unit cube.
    const fm_rtsdf_desc unit = {.coarse = {3, 3, 3}};
    fm_volume *fine = NULL;
    fm_volume_desc place;
    rtsdf = create(context, &unit);
    fm_rtsdf_fields(rtsdf, NULL, &fine);
    fm_volume_info(fine, &place);
    CHECK(place.shape.x == 6 && place.shape.z == 6 && fabs(place.spacing[1] - 1 / 6.0) < 1e-12 &&
          fabs(place.origin[2] - 1 / 12.0) < 1e-12);
    fm_rtsdf_destroy(rtsdf);
}

static void check_passes(fm_context *context, fm_mesh *mesh) {
    const fm_rtsdf_desc desc = desc_of(6, 1, 0);
    fm_rtsdf *rtsdf = create(context, &desc);
    CHECK_OK(fm_rtsdf_update(rtsdf, mesh, NULL));
    fm_pass passes[16];
    uint32_t count = 16, seen = 0;
    CHECK_OK(fm_context_passes(context, &count, passes));
    static const char *const names[] = {"voxelize", "flood", "trace"};
    for (uint32_t i = 0; i < count; i++) {
        for (int name = 0; name < 3; name++) {
            seen |= strcmp(passes[i].name, names[name]) == 0 && passes[i].bytes > 0 ? 1u << name : 0;
        }
    }
    CHECK(seen == 7);
    fm_rtsdf_destroy(rtsdf);
}

static void check_backend(fm_context *context) {
    scene_mesh sphere = scene_mesh_sphere(24, 48, middle, radius);
    fm_mesh *mesh = rtsdf_mesh(context, &sphere);
    if (mesh) {
        check_no_rays(context, mesh);
        check_mask(context, mesh);
        check_convergence(context, mesh);
        check_frames(context, mesh);
        check_signs(context, mesh);
        check_ghost(context);
        check_no_ghost(context);
        check_reset(context, mesh);
        check_empty(context, mesh);
        check_arguments(context, mesh);
        check_passes(context, mesh);
    }
    fm_mesh_destroy(mesh);
    scene_mesh_free(&sphere);
}

// Both shoot the same rays. A ray may pass an edge on one side or on the other as rounding goes.
static void compare_backends(fm_context *host, fm_context *device, const char *name, scene_mesh *shape) {
    fm_rtsdf_desc desc = {.coarse = {9, 8, 7}, .low = {-0.5, -0.45, -0.4}, .high = {0.5, 0.4, 0.35}, .rays = 4, .mask = 0.4f};
    fm_rtsdf *fields[2] = {create(host, &desc), create(device, &desc)};
    fm_mesh *meshes[2] = {rtsdf_mesh(host, shape), rtsdf_mesh(device, shape)};
    uint64_t unlike = 0, texels = 0;
    for (int frame = 0; frame < 6; frame++) {
        float *values[2], *coarse[2];
        shift(shape, 0.01f);
        for (int side = 0; side < 2; side++) {
            CHECK_OK(fm_mesh_deform(meshes[side], (const float(*)[3])shape->vertices, frame % 2 ? FM_TREE_REFIT : FM_TREE_REBUILD));
            CHECK_OK(fm_rtsdf_update(fields[side], meshes[side], NULL));
            values[side] = rtsdf_field(fields[side], true);
            coarse[side] = rtsdf_field(fields[side], false);
        }
        for (int i = 0; i < 9 * 8 * 7; i++) {
            CHECK(fabsf(coarse[0][i] - coarse[1][i]) <= 1e-6f);
        }
        for (int i = 0; i < 8 * 9 * 8 * 7; i++) {
            unlike += !(fabsf(values[0][i] - values[1][i]) <= 2e-6f);
            texels++;
        }
        for (int side = 0; side < 2; side++) {
            free(values[side]);
            free(coarse[side]);
        }
    }
    printf("%s: %llu of %llu texels differ between the processor and the device\n", name, (unsigned long long)unlike,
           (unsigned long long)texels);
    CHECK(unlike <= texels / 500);
    for (int side = 0; side < 2; side++) {
        fm_rtsdf_destroy(fields[side]);
        fm_mesh_destroy(meshes[side]);
    }
}

int main(int count, char **arguments) {
    vulkan_options options;
    if (!vulkan_parse(count, arguments, &options)) {
        return 2;
    }
    const fm_context_desc on_host = {.backend = FM_BACKEND_CPU, .threads = 2};
    fm_context *host = NULL, *device = NULL;
    if (CHECK_OK(fm_context_create(&on_host, &host))) {
        check_backend(host);
    }
    if (vulkan_open(&options, NULL, &device) != FM_OK) {
        printf("not on Vulkan: %s\n", fm_last_error());
    } else {
        check_backend(device);
        scene_mesh torus = scene_mesh_torus(16, 24, middle, 0.25f, 0.1f), soup = scene_mesh_soup(80, 5, middle, 0.7f, 0.2f);
        compare_backends(host, device, "a torus", &torus);
        compare_backends(host, device, "a soup", &soup);
        scene_mesh_free(&torus);
        scene_mesh_free(&soup);
        vulkan_close(device);
    }
    fm_context_destroy(host);
    return check_summary();
}
