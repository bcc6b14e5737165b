// SPDX-License-Identifier: MIT
// Rays through octrees of vectors and of distances, against shapes whose surfaces are known; the device against the processor.

#include "octree_shapes.h"

enum { RAYS = 3000 };

static const float far_away = 1e30f;

// What a cast is held to, in finest cells where nothing else is said.
typedef struct limits {
    double off;       // hits from the surface: 99 of 100
    double most_off;  // all
    double angle;     // normals, in degrees: 95 of 100
    double miss;      // rays that truly meet the surface but not here, and those that come no nearer than 3 epsilon but do, of 1
} limits;

typedef struct cast_case {
    const char *name;
    fm_octree_desc desc;
    float epsilon;
    limits limits;
} cast_case;

#define OCTREE(of_kind, of_code, of_size) .desc = {.kind = of_kind, .code = of_code, .size = of_size, .top_bytes = 256}

static const cast_case cases[] = {
    {"spherical", OCTREE(FM_OCTREE_CLOSEST, FM_OCTREE_SPHERICAL, 64), 0, {0.2, 0.45, 8, 0.004}},
    {"octahedral", OCTREE(FM_OCTREE_CLOSEST, FM_OCTREE_OCTAHEDRAL, 64), 0, {0.2, 0.45, 8, 0.004}},
    {"floats", OCTREE(FM_OCTREE_CLOSEST, FM_OCTREE_FLOATS, 64), 0, {0.2, 0.45, 8, 0.004}},
    {"as published", OCTREE(FM_OCTREE_CLOSEST, FM_OCTREE_SPHERICAL, 64), -0.1f, {0.2, 0.5, 45, 0.004}},
    {"distances", OCTREE(FM_OCTREE_DISTANCE, FM_OCTREE_SPHERICAL, 64), 0, {0.1, 0.5, 8, 0.004}},
    {"distances, sampled", OCTREE(FM_OCTREE_DISTANCE, FM_OCTREE_SPHERICAL, 64), -0.1f, {0.2, 0.5, 8, 0.004}},
};
enum { CASES = sizeof cases / sizeof *cases };

// At ends and edges of sheets less can be said than on smooth surfaces, and of what is hardly wider than a cell.
static limits limits_of(const cast_case *c, const shape *s) {
    const limits usual = c->limits;
    if (!s->closed) {
        return c->desc.kind == FM_OCTREE_DISTANCE ? (limits){1, 1, 90, 0.1} : (limits){0.25, 0.7, usual.angle, 0.01};
    }
    if (s->closest == shape_rod) {
        return (limits){0.25, 0.5, 2 * usual.angle, 0.06};
    }
    // Where a cell has one sheet, what is left is of the third order.
    const bool sheets = c->desc.kind == FM_OCTREE_CLOSEST && c->epsilon >= 0 && s->closest != shape_box;
    return sheets ? (limits){0.005, 0.03, usual.angle, usual.miss} : usual;
}

static void set_ray(fm_mesh_ray *ray, const float origin[3], const float way[3]) {
    *ray = (fm_mesh_ray){.last = far_away};
    memcpy(ray->origin, origin, sizeof ray->origin);
    memcpy(ray->direction, way, sizeof ray->direction);
}

// From outside and inside, along the axes, in faces of cells and through their corners, past the surface at a grazing angle.
static void make_rays(fm_mesh_ray *rays, uint64_t seed) {
    for (int i = 0; i < RAYS; i++) {
        float origin[3], target[3], way[3];
        const bool inside = i % 4 == 3;
        for (int k = 0; k < 3; k++) {
            origin[k] = shape_random(&seed, -1, 1) * (inside ? 0.8f : 2);
            target[k] = shape_random(&seed, -0.8f, 0.8f);
        }
        if (!inside) {
            const int axis = i % 3;
            origin[axis] = i % 2 ? 2.5f : -2.5f;
        }
        if (i % 8 == 2) {
            const int axis = i % 3;
            memcpy(target, origin, sizeof target);
            for (int k = 0; k < 3; k++) {
                // On faces of cells every second time.
                origin[k] = k == axis ? -3 : i % 16 == 2 ? (float)test_between(&seed, -28, 28) / 32 : target[k] * 0.4f;
                target[k] = k == axis ? 0 : origin[k];
            }
        } else if (i % 8 == 4) {
            for (int k = 0; k < 3; k++) {
                target[k] = (float)test_between(&seed, -28, 28) / 32;
            }
        }
        for (int k = 0; k < 3; k++) {
            way[k] = (target[k] - origin[k]) * (i % 5 == 0 ? 3.0f : 1.0f);
        }
        set_ray(&rays[i], origin, way);
    }
}

static int by_size(const void *a, const void *b) {
    const double x = *(const double *)a, y = *(const double *)b;
    return (x > y) - (x < y);
}

static double part_of(double *values, int count, double part) {
    qsort(values, (size_t)count, sizeof *values, by_size);
    return count > 0 ? values[(int)(part * (count - 1))] : 0;
}

static double angle_between(const shape *s, const double p[3], const fm_octree_hit *hit) {
    // On the surface the vector has no length: from a little outside, where the normal points.
    double off[3], v[3], sign, along = 0;
    for (int i = 0; i < 3; i++) {
        off[i] = p[i] + 0.01 * (double)hit->normal[i];
    }
    s->closest(off, v, &sign);
    for (int i = 0; i < 3; i++) {
        along -= v[i] * (double)hit->normal[i] / fmax(shape_length(v), 1e-9);
    }
    return acos(fmin(fmax(along, -1), 1)) * 180 / 3.14159265358979;
}

static void check_hits(const shape *s, const cast_case *c, const fm_mesh_ray *rays, const fm_octree_hit *hits, double cell) {
    static double off[RAYS], angle[RAYS];
    const double thin = fabs((double)c->epsilon) > 0 ? fabs((double)c->epsilon) : 0.1;
    int met = 0, missed = 0, imagined = 0, looked = 0, reads = 0;
    for (int i = 0; i < RAYS; i++) {
        const shape_truth truth = shape_trace(s, &rays[i]);
        const bool there = hits[i].t < far_away;
        reads += (int)hits[i].reads;
        if (isfinite(truth.t)) {
            looked++;
            missed += !there;
        } else if (truth.nearest > 3 * thin * cell) {
            looked++;
            imagined += there;
        }
        if (!there) {
            continue;
        }
        double p[3], way = 0, turned = 0;
        for (int k = 0; k < 3; k++) {
            p[k] = (double)rays[i].origin[k] + (double)rays[i].direction[k] * (double)hits[i].t;
            way += (double)hits[i].normal[k] * (double)hits[i].normal[k];
            turned += (double)hits[i].normal[k] * (double)rays[i].direction[k];
        }
        CHECK(fabs(way - 1) < 1e-3 && turned <= 1e-4);
        off[met] = shape_distance(s, p) / cell;
        angle[met++] = angle_between(s, p, &hits[i]);
    }
    const double most = part_of(off, met, 1), usual = part_of(off, met, 0.99), turn = part_of(angle, met, 0.95);
    printf(
        "%-8s %-18s hits %4d missed %d imagined %d off %.3f (all %.3f) cells, median %.4f; normals %.2f median %.2f; reads %.1f\n",
        s->name, c->name, met, missed, imagined, usual, most, part_of(off, met, 0.5), turn, part_of(angle, met, 0.5),
        (double)reads / RAYS);
    CHECK(met > RAYS / 100);
    const limits within = limits_of(c, s);
    CHECK(missed + imagined <= within.miss * looked);
    CHECK(usual <= within.off && most <= within.most_off);
    CHECK(turn <= within.angle);
}

// Rays of which the two backends say something else but for rounding.
static int differing(const fm_octree_hit *a, const fm_octree_hit *b, double cell) {
    int count = 0;
    for (int i = 0; i < RAYS; i++) {
        const bool same = isinf(a[i].t) ? isinf(b[i].t) : fabs((double)a[i].t - (double)b[i].t) < 0.02 * cell;
        count += !same;
    }
    return count;
}

static fm_mesh_ray rays[RAYS];
static fm_octree_hit hits[RAYS], other[RAYS];

static void check_shape(fm_context *context, fm_context *cpu, const shape *s, const cast_case *c) {
    fm_octree_desc desc = c->desc;
    desc.sign = s->closed ? FM_SIGN_AUTO : FM_SIGN_NONE;
    fm_octree *octree = shape_octree(context, s, &desc, 0.02);
    if (!octree) {
        return;
    }
    make_rays(rays, 7);
    if (CHECK_OK(fm_octree_cast(octree, rays, RAYS, c->epsilon, hits))) {
        check_hits(s, c, rays, hits, octree->info.cell);
    }
    if (context != cpu) {
        fm_octree *same = shape_octree(cpu, s, &desc, 0.02);
        if (same && CHECK_OK(fm_octree_cast(same, rays, RAYS, c->epsilon, other))) {
            const int apart = differing(hits, other, octree->info.cell);
            printf("         %d of %d rays differ from the processor's\n", apart, RAYS);
            CHECK(apart <= RAYS / 200);
        }
        fm_octree_destroy(same);
    }
    fm_octree_destroy(octree);
}

// Lengths of ways, first and last; what is no ray; rays that begin on the surface, within a leaf, on a face of cells.
static void check_ranges(fm_context *context) {
    const float infinite = INFINITY, nan = NAN;
    const fm_octree_desc desc = {.size = 32, .top_bytes = 256};
    fm_octree *octree = shape_octree(context, &shapes[2], &desc, 0.02);
    if (!octree) {
        return;
    }
    const fm_mesh_ray few[] = {{{-3, 0.1f, 0.1f}, 0, {1, 0, 0}, infinite},   {{-3, 0.1f, 0.1f}, 0, {4, 0, 0}, infinite},
                               {{-3, 0.1f, 0.1f}, 0, {1, 0, 0}, 2.3f},       {{-3, 0.1f, 0.1f}, 3, {1, 0, 0}, infinite},
                               {{-3, 0.1f, 0.1f}, 0, {-1, 0, 0}, infinite},  {{-3, 0.1f, 0.1f}, -infinite, {1, 0, 0}, infinite},
                               {{-3, 0.1f, 0.1f}, 0, {0, 0, 0}, infinite},   {{nan, 0.1f, 0.1f}, 0, {1, 0, 0}, infinite},
                               {{-3, 0.1f, 0.1f}, nan, {1, 0, 0}, infinite}, {{-3, 0.1f, 0.1f}, 0, {1, nan, 0}, infinite},
                               {{-3, 0.1f, 0.1f}, 0, {1, infinite, 0}, 1},   {{-0.5f, 0.1f, 0.1f}, 0, {-1, 0, 0}, infinite},
                               {{-0.53125f, 0, 0}, 0, {1, 0, 0}, infinite},  {{0, 0, 0}, 0, {0, 0, 1}, infinite},
                               {{3, 1, 1}, 0, {-1, 0, 0}, infinite},         {{-3, -1, -1}, 0, {1, 0, 0}, infinite},
                               {{-3, 0.1f, 0.1f}, 0, {1e-22f, 0, 0}, 1e30f}, {{-3, 0.1f, 0.1f}, 0, {1e-30f, 0, 0}, infinite},
                               {{-3, 0.1f, 0.1f}, 0, {2e-37f, 0, 0}, 1e38f}, {{-3, 0.1f, 0.1f}, 0, {1e-30f, 0, 0}, 2e30f},
                               {{-3, 0.1f, 0.1f}, 0, {1e17f, 0, 0}, 1},      {{-3, 0.1f, 0.1f}, 0, {1e-40f, 0, 0}, infinite}};
    const float wanted[] = {2.5f,     0.625f,   infinite, 3.5f,     infinite, 2.5f,    infinite, infinite,
                            infinite, infinite, infinite, 0,        0.03125f, 0.5f,    infinite, infinite,
                            2.5e22f,  2.5e30f,  1.25e37f, infinite, 2.5e-17f, infinite};
    enum { FEW = sizeof few / sizeof *few };
    fm_octree_hit met[FEW];
    if (CHECK_OK(fm_octree_cast(octree, few, FEW, 0, met))) {
        for (int i = 0; i < FEW; i++) {
            const bool good = isinf(wanted[i])
                                  ? isinf(met[i].t)
                                  : fabsf(met[i].t - wanted[i]) <= fmaxf(wanted[i] * 5e-4f, few[i].last == 1 ? 0 : 2e-3f);
            if (!CHECK(good)) {
                fprintf(stderr, "    ray %d: t %g, wanted %g\n", i, (double)met[i].t, (double)wanted[i]);
            }
        }
    }
    fm_octree_destroy(octree);
}

static void check_attributes(fm_context *context) {
    const uint32_t red = 0xff0000ffu, blue = 0xffff0000u;
    for (int color = 0; color < 2; color++) {
        const fm_octree_desc desc = {.size = 32, .top_bytes = 256, .attribute = color ? FM_OCTREE_COLOR : FM_OCTREE_TRIANGLE};
        fm_octree *octree = shape_octree(context, &shapes[0], &desc, 0.02);
        const fm_mesh_ray few[] = {
            {{0.3f, 0, -3}, 0, {0, 0, 1}, 10}, {{-0.3f, 0, -3}, 0, {0, 0, 1}, 10}, {{0.02f, 0, -3}, 0, {0, 0, 1}, 10}};
        fm_octree_hit met[3];
        if (octree && CHECK_OK(fm_octree_cast(octree, few, 3, 0, met))) {
            CHECK(met[0].attribute == red && met[1].attribute == blue);
            CHECK(color ? (met[2].attribute & 0xffu) > 0 && (met[2].attribute & 0xffu) < 0xff && met[2].attribute >> 24 == 0xff
                        : met[2].attribute == red || met[2].attribute == blue);
        }
        fm_octree_destroy(octree);
    }
}

// Whatever nodes and leaves say, casts end.
static void check_nonsense(fm_context *context) {
    static const fm_octree_kind kinds[] = {FM_OCTREE_CLOSEST, FM_OCTREE_DISTANCE};
    uint64_t seed = 3;
    for (int round = 0; round < 8; round++) {
        const fm_octree_desc desc = {.kind = kinds[round & 1], .size = 64, .top_bytes = 256};
        fm_octree *octree = shape_octree(context, &shapes[1], &desc, 0.02);
        if (!octree) {
            return;
        }
        uint32_t *words = (uint32_t *)octree->words.data;
        const uint64_t count = octree->words.count, leaves = octree->values.count / 4 - 1;
        for (uint64_t i = 0; i < count; i++) {
            if (test_random(&seed) % 3 == 0) {
                const uint64_t pick = test_random(&seed);
                words[i] = pick % 3 == 0   ? (uint32_t)(pick / 3 % (count - 7))
                           : pick % 3 == 1 ? FM_NODE_EMPTY + (uint32_t)(pick / 3 % 100)
                                           : 0xffffffffu - (uint32_t)(pick / 3 % leaves);
            }
        }
        for (uint64_t i = 0; i < octree->values.count; i++) {
            if (test_random(&seed) % 4 == 0) {
                ((uint32_t *)octree->values.data)[i] = (uint32_t)test_random(&seed);
            }
        }
        octree->version++;
        make_rays(rays, seed);
        CHECK_OK(fm_octree_cast(octree, rays, 400, round & 2 ? -1e-6f : 1e-6f, hits));
        fm_octree_destroy(octree);
    }
}

static void check_arguments(fm_context *context) {
    const fm_octree_desc desc = {.size = 16, .top_bytes = 256};
    fm_octree *octree = shape_octree(context, &shapes[0], &desc, 0.02);
    if (octree) {
        CHECK_FAILS(fm_octree_cast(NULL, rays, 1, 0, hits), FM_ERROR_INVALID_ARGUMENT);
        CHECK_FAILS(fm_octree_cast(octree, NULL, 1, 0, hits), FM_ERROR_INVALID_ARGUMENT);
        CHECK_FAILS(fm_octree_cast(octree, rays, 1, 0, NULL), FM_ERROR_INVALID_ARGUMENT);
        CHECK_FAILS(fm_octree_cast(octree, rays, 1, NAN, hits), FM_ERROR_INVALID_ARGUMENT);
        CHECK_FAILS(fm_octree_cast(octree, rays, 1, INFINITY, hits), FM_ERROR_INVALID_ARGUMENT);
        CHECK_OK(fm_octree_cast(octree, NULL, 0, 0, NULL));
    }
    fm_octree_destroy(octree);
}

int main(int count, char **arguments) {
    vulkan_options options;
    const bool vulkan = count > 1;
    if (!vulkan_parse(count, arguments, &options)) {
        return 2;
    }
    fm_context *cpu = NULL, *context = NULL;
    const fm_context_desc desc = {.backend = FM_BACKEND_CPU, .threads = 1};
    if (!CHECK_OK(fm_context_create(&desc, &cpu))) {
        return check_summary();
    }
    if (vulkan && vulkan_open(&options, NULL, &context) != FM_OK) {
        fm_context_destroy(cpu);
        return vulkan_missing();
    }
    for (int s = 0; s < SHAPES; s++) {
        for (int c = 0; c < CASES; c++) {
            check_shape(vulkan ? context : cpu, cpu, &shapes[s], &cases[c]);
        }
    }
    fm_context *const used = vulkan ? context : cpu;
    check_ranges(used);
    check_attributes(used);
    check_nonsense(used);
    check_arguments(used);
    if (vulkan) {
        vulkan_close(context);
    }
    fm_context_destroy(cpu);
    return check_summary();
}
