// SPDX-License-Identifier: MIT
// The benchmark of worlds: its script is what it says, and its check counts the errors that a search over all voxels finds.

#include "check.h"
#include "world.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

static void test_edits(void) {
    enum { COUNT = 2000 };
    static fm_brush brushes[COUNT], again[COUNT];
    const bench_edits edits = {.seed = 7,
                               .per_update = COUNT,
                               .least_radius = 2,
                               .greatest_radius = 5,
                               .kinds = {FM_BRUSH_SPHERE, FM_BRUSH_LINE},
                               .kind_count = 2};
    const fm_shape shape = {40, 9, 1};
    bench_edits_at(&edits, shape, 3, brushes);
    bench_edits_at(&edits, shape, 3, again);
    CHECK(memcmp(brushes, again, sizeof brushes) == 0);
    bench_edits_at(&edits, shape, 4, again);
    CHECK(memcmp(brushes, again, sizeof brushes) != 0);
    uint32_t placed = 0, lines = 0, radii[8] = {0};
    bool ends[2] = {false, false};
    for (int i = 0; i < COUNT; i++) {
        const fm_brush *b = &brushes[i];
        CHECK(b->from[0] >= 0 && b->from[0] < 40 && b->from[1] >= 0 && b->from[1] < 9 && b->from[2] == 0);
        CHECK(b->radius >= 2 && b->radius <= 5 && b->voxel < 256);
        CHECK(abs(b->to[0] - b->from[0]) <= 2 * (int)b->radius);
        placed += b->voxel != 0;
        lines += b->kind == FM_BRUSH_LINE;
        radii[b->radius & 7]++;
        ends[0] = ends[0] || b->from[0] == 0;
        ends[1] = ends[1] || b->from[0] == 39;
    }
    // Within 5 standard deviations of a half, of a half and of a quarter.
    CHECK(abs((int)placed - COUNT / 2) < 112 && abs((int)lines - COUNT / 2) < 112 && ends[0] && ends[1]);
    for (int radius = 2; radius <= 5; radius++) {
        CHECK(abs((int)radii[radius] - COUNT / 4) < 97);
    }
}

enum { X = 13, Y = 9, Z = 17, VOXELS = X * Y * Z, EDGE = 8 };

// Steps to the nearest solid voxel of a box that the voxel is in, or out of the box where that counts.
static uint32_t nearest(const uint32_t *voxels, const int begin[3], const int end[3], const int at[3], bool padded) {
    uint32_t best = UINT32_MAX;
    for (int a = 0; padded && a < 3; a++) {
        const int before = at[a] - begin[a] + 1, after = end[a] - at[a];
        best = (uint32_t)before < best ? (uint32_t)before : best;
        best = (uint32_t)after < best ? (uint32_t)after : best;
    }
    for (int z = begin[2]; z < end[2]; z++) {
        for (int y = begin[1]; y < end[1]; y++) {
            for (int x = begin[0]; x < end[0]; x++) {
                const uint32_t steps = (uint32_t)(abs(x - at[0]) + abs(y - at[1]) + abs(z - at[2]));
                best = voxels[x + X * (y + Y * z)] && steps < best ? steps : best;
            }
        }
    }
    return best > UINT8_MAX ? UINT8_MAX : best;
}

static void add(bench_world_errors *errors, uint32_t value, uint32_t wanted) {
    errors->compared++;
    errors->above += value > wanted;
    errors->below += value < wanted;
    errors->most_above = fmax(errors->most_above, (double)value - wanted);
    errors->most_below = fmax(errors->most_below, (double)wanted - value);
    errors->sum += fabs((double)value - wanted);
}

static bool equal(const bench_world_errors *a, const bench_world_errors *b) {
    return a->compared == b->compared && a->above == b->above && a->below == b->below && a->most_above == b->most_above &&
           a->most_below == b->most_below && a->sum == b->sum;
}

// What the check should count, from the voxels and the field alone.
static void count_errors(fm_world *world, fm_world_border border, bench_world_errors *whole, bench_world_errors *domain) {
    static uint32_t voxels[VOXELS];
    static uint8_t field[VOXELS];
    const int extents[3] = {X, Y, Z}, zero[3] = {0, 0, 0};
    CHECK_OK(fm_world_read(world, &(fm_box){{0, 0, 0}, {X, Y, Z}}, voxels));
    CHECK_OK(fm_world_read_field(world, NULL, &(fm_array){field, FM_TYPE_U8, {X, Y, Z}}, NULL));
    for (int i = 0; i < VOXELS; i++) {
        const int at[3] = {i % X, i / X % Y, i / X / Y};
        int begin[3], end[3];
        for (int a = 0; a < 3; a++) {
            const int grown = border == FM_BORDER_HALO ? EDGE : 0, first = at[a] / EDGE * EDGE;
            begin[a] = first - grown < 0 ? 0 : first - grown;
            end[a] = first + EDGE + grown > extents[a] ? extents[a] : first + EDGE + grown;
        }
        add(whole, field[i], nearest(voxels, zero, extents, at, false));
        add(domain, field[i], nearest(voxels, begin, end, at, border == FM_BORDER_PADDING));
    }
}

static void test_check(bench_session *session, fm_world_algorithm algorithm, uint32_t chunk, fm_world_border border) {
    const fm_world_desc desc = {.shape = {X, Y, Z}, .method = {.algorithm = algorithm, .chunk = chunk, .border = border}};
    const bench_edits edits = {.seed = 1, .per_update = 12, .greatest_radius = 2, .kinds = {FM_BRUSH_SPHERE}, .kind_count = 1};
    fm_brush brushes[12];
    fm_world *world;
    bench_world_errors whole = {0}, domain = {0}, some = {0}, same = {0}, wanted_whole = {0}, wanted_domain = {0};
    CHECK_OK(fm_world_create(bench_session_context(session, FM_BACKEND_CPU), &desc, &world));
    bench_edits_at(&edits, desc.shape, 0, brushes);
    CHECK_OK(fm_world_edit(world, brushes, edits.per_update));
    CHECK_OK(fm_world_update(world, NULL));
    CHECK(bench_world_check(session, world, VOXELS, &whole, &domain) == NULL);
    count_errors(world, border, &wanted_whole, &wanted_domain);
    CHECK(equal(&whole, &wanted_whole));
    if (chunk && border != FM_BORDER_EXCHANGE) {
        CHECK(equal(&domain, &wanted_domain));
    } else {
        CHECK(domain.compared == 0);
    }
    // A sample is of as many voxels as were asked for; a second check adds to the first.
    CHECK(bench_world_check(session, world, 100, &some, &same) == NULL && some.compared == 100);
    CHECK(bench_world_check(session, world, VOXELS + 1, &some, &same) == NULL && some.compared == 100 + VOXELS);
    const bool exact = algorithm == FM_WORLD_EXACT || border == FM_BORDER_EXCHANGE;
    CHECK(exact == (whole.above + whole.below == 0));
    CHECK(whole.above == 0 || algorithm == FM_WORLD_JFA_PUBLISHED);
    CHECK(whole.above > 0 || algorithm != FM_WORLD_JFA_PUBLISHED);
    fm_world_destroy(world);
}

static void test_methods(void) {
    fm_world_method a = {
        .algorithm = FM_WORLD_EXACT, .chunk = 32, .border = FM_BORDER_HALO, .near_algorithm = FM_WORLD_FIM, .focus_chunks = 3};
    a = bench_world_method(&a);
    CHECK(a.chunk == 0 && a.border == FM_BORDER_PADDING && a.near_algorithm == FM_WORLD_EXACT && a.focus_chunks == 0);
    fm_world_desc desc = {.method = {.algorithm = FM_WORLD_SELECTIVE, .chunk = 16}};
    CHECK(bench_world_method(&desc.method).far_algorithm == FM_WORLD_JFA_PUBLISHED && bench_world_refuses(&desc) == NULL);
    desc.method.near_algorithm = FM_WORLD_JFA;
    CHECK(bench_world_refuses(&desc) != NULL);
    desc.method = (fm_world_method){.algorithm = FM_WORLD_JFA, .chunk = 8, .border = FM_BORDER_EXCHANGE};
    CHECK(bench_world_refuses(&desc) != NULL);
    desc.method.algorithm = FM_WORLD_FIM;
    CHECK(bench_world_refuses(&desc) == NULL);
    desc.format = FM_FIELD_SQUARED_U32;
    CHECK(bench_world_refuses(&desc) != NULL);
}

int main(void) {
    bench_session *session = bench_session_create(&(bench_session_desc){.backend = FM_BACKEND_CPU});
    test_edits();
    test_methods();
    test_check(session, FM_WORLD_EXACT, 0, FM_BORDER_PADDING);
    test_check(session, FM_WORLD_FIM, EDGE, FM_BORDER_EXCHANGE);
    test_check(session, FM_WORLD_FIM, EDGE, FM_BORDER_PADDING);
    test_check(session, FM_WORLD_JFA_PUBLISHED, EDGE, FM_BORDER_HALO);
    test_check(session, FM_WORLD_PUBLISHED_FINAL, EDGE, FM_BORDER_HALO);
    test_check(session, FM_WORLD_PUBLISHED_FINAL, EDGE, FM_BORDER_PADDING);
    bench_session_destroy(session);
    return check_summary();
}
