// SPDX-License-Identifier: MIT
// A sample of what a frame computed, against nearest points and winding numbers of the same pose on the processor, and against a
// search of the voxels themselves.

#include "mesh.h"
#include "noise.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

static char message[256];

// Texels that are looked at: random ones.
typedef struct sampler {
    const fm_volume_desc *grid;
    uint64_t texels;
    uint32_t count;
    uint64_t *at;
    float (*places)[3];
    fm_closest *closest;  // of the mesh on the processor
} sampler;

static uint64_t texels_of(const fm_volume_desc *grid) {
    return (uint64_t)grid->shape.x * grid->shape.y * grid->shape.z;
}

static void place_of(const fm_volume_desc *grid, uint64_t texel, float place[3]) {
    const uint64_t index[3] = {texel % grid->shape.x, texel / grid->shape.x % grid->shape.y, texel / grid->shape.x / grid->shape.y};
    for (int i = 0; i < 3; i++) {
        place[i] = (float)(grid->origin[i] + (double)index[i] * grid->spacing[i]);
    }
}

static void sampler_free(sampler *s) {
    free(s->at);
    free(s->places);
    free(s->closest);
}

static bool sampler_make(const fm_volume_desc *grid, uint32_t count, fm_mesh *reference, sampler *s) {
    *s = (sampler){.grid = grid, .texels = texels_of(grid), .count = count};
    s->at = malloc((count + 1) * sizeof *s->at);
    s->places = malloc((count + 1) * sizeof *s->places);
    s->closest = malloc((count + 1) * sizeof *s->closest);
    for (uint32_t i = 0; s->at && s->places && i < count; i++) {
        s->at[i] = fm_mix(i) % s->texels;
        place_of(grid, s->at[i], s->places[i]);
    }
    return s->at && s->places && s->closest &&
           fm_mesh_closest(reference, (const float(*)[3])s->places, count, 0, s->closest) == FM_OK;
}

static float *download(const fm_volume *volume) {
    fm_volume_desc desc;
    uint64_t bytes = 0;
    fm_volume_info(volume, &desc);
    float *values = fm_array_bytes(desc.shape, desc.type, &bytes) == FM_OK ? malloc(bytes) : NULL;
    if (values && fm_volume_download((fm_volume *)(uintptr_t)volume, values) != FM_OK) {
        free(values);
        return NULL;
    }
    return values;
}

// Counts a texel, and keeps the first that is wrong as the message.
static void judge(bench_mesh_result *result, bool good, const float place[3], const char *what, double got, double wanted) {
    if (!good && result->wrong++ == 0) {
        snprintf(message, sizeof message, "%s at %g, %g, %g is %g where %g is right", what, (double)place[0], (double)place[1],
                 (double)place[2], got, wanted);
    }
}

// The coarse field between its texels.
static double between(const float *coarse, uint32_t n, uint64_t texel) {
    const uint64_t m = 2 * (uint64_t)n, at[3] = {texel % m, texel / m % m, texel / m / m};
    double sum = 0;
    for (int corner = 0; corner < 8; corner++) {
        double weight = 1;
        uint64_t index[3];
        for (int i = 0; i < 3; i++) {
            const double place = fmin(fmax(((double)at[i] + 0.5) / 2 - 0.5, 0), n - 1.0), low = floor(place);
            const bool upper = corner >> i & 1;
            weight *= upper ? place - low : 1 - (place - low);
            index[i] = (uint64_t)fmin(low + upper, n - 1.0);
        }
        sum += weight * (double)coarse[index[0] + n * (index[1] + n * index[2])];
    }
    return sum;
}

// A first frame, in which no hit of an earlier one is left: the field is the coarse one, or the distance of a hit, which is none
// too near. Coarse distances are those of voxels that the mesh passes, or by jump flooding of others about as near.
static bool check_rtsdf(bench_mesh_state *state, fm_mesh *reference, uint32_t samples, bench_mesh_result *result) {
    const bench_mesh_case *what = state->what;
    const double longest = what->mesh->high[0] - what->mesh->low[0], near = 1e-4 * longest, bias = 0.01 * longest;
    fm_volume *volumes[2];
    fm_volume_desc grids[2];
    sampler s[2] = {{0}, {0}};
    fm_rtsdf_fields(state->rtsdf, &volumes[0], &volumes[1]);
    bool good = fm_rtsdf_reset(state->rtsdf) == FM_OK && fm_rtsdf_update(state->rtsdf, state->mesh, NULL) == FM_OK;
    for (int i = 0; i < 2; i++) {
        fm_volume_info(volumes[i], &grids[i]);
        good = good && sampler_make(&grids[i], samples / 2, reference, &s[i]);
    }
    float *coarse = good ? download(volumes[0]) : NULL, *fine = good ? download(volumes[1]) : NULL;
    good = coarse && fine;
    for (uint32_t i = 0; good && i < samples / 2; i++) {
        const double d = (double)s[0].closest[i].distance, c = (double)coarse[s[0].at[i]];
        judge(result, fabs(c - d) <= 2 * grids[0].spacing[0], s[0].places[i], "the coarse field", c, d);
    }
    for (uint32_t i = 0; good && i < samples / 2; i++) {
        const double d = (double)s[1].closest[i].distance, c = between(coarse, what->edge, s[1].at[i]);
        const double f = (double)fine[s[1].at[i]] + bias;
        const bool far = c > (double)what->mask * longest + near, same = fabs(f - c) <= near;
        judge(result, same || (!far && f <= c && fabs(f) >= d - near), s[1].places[i], "the fine field", f, d);
    }
    free(coarse);
    free(fine);
    sampler_free(&s[0]);
    sampler_free(&s[1]);
    return good;
}

static bool bit(const uint32_t *voxels, const fm_shape shape, uint64_t texel) {
    const uint64_t words = (shape.x + 31) / 32, x = texel % shape.x;
    return voxels[texel / shape.x * words + x / 32] >> x % 32 & 1;
}

// The squared distance to the nearest voxel that is set, in voxels; the sample's own one comes first.
static double nearest_set(const uint64_t *set, uint64_t count, const fm_shape shape, uint64_t texel) {
    const double at[3] = {(double)(texel % shape.x), (double)(texel / shape.x % shape.y), (double)(texel / shape.x / shape.y)};
    double nearest = INFINITY;
    for (uint64_t i = 0; i < count; i++) {
        const double x = at[0] - (double)(set[i] % shape.x), y = at[1] - (double)(set[i] / shape.x % shape.y),
                     z = at[2] - (double)(set[i] / shape.x / shape.y);
        nearest = fmin(nearest, x * x + y * y + z * z);
    }
    return nearest;
}

static bool check_coarse(bench_mesh_state *state, fm_mesh *reference, uint32_t samples, bench_mesh_result *result) {
    const fm_shape shape = state->grid.shape;
    const double edge = state->grid.spacing[0];
    sampler s;
    float *field = download(state->field);
    uint32_t *voxels = (uint32_t *)(void *)download(state->voxels);
    uint64_t *set = malloc(texels_of(&state->grid) * sizeof *set), count = 0;
    bool good = sampler_make(&state->grid, samples, reference, &s) && field && voxels && set;
    for (uint64_t i = 0; good && i < s.texels; i++) {
        if (bit(voxels, shape, i)) {
            set[count++] = i;
        }
    }
    for (uint32_t i = 0; good && i < samples; i++) {
        const double d = (double)s.closest[i].distance, wanted = sqrt(nearest_set(set, count, shape, s.at[i])) * edge;
        const double f = (double)field[s.at[i]];
        judge(result, f == wanted || fabs(f - wanted) <= 1e-5 * wanted, s.places[i], "the distance", f, wanted);
        // The ball in the voxel, the ball around it.
        const bool is_set = bit(voxels, shape, s.at[i]);
        judge(result, d > 0.4999 * edge || is_set, s.places[i], "the voxel", is_set, 1);
        judge(result, d < 0.8661 * edge || !is_set, s.places[i], "the voxel", is_set, 0);
    }
    free(field);
    free(voxels);
    free(set);
    sampler_free(&s);
    return good;
}

static bool check_exact(bench_mesh_state *state, fm_mesh *reference, uint32_t samples, bench_mesh_result *result) {
    const double voxel = state->grid.spacing[0], band = (double)state->what->band * voxel;
    sampler s;
    fm_composed_info info = {0};
    if (state->composed) {
        fm_composed_describe(state->composed, &info);
    }
    float *field = download(state->composed ? fm_composed_field(state->composed) : state->field),
          *winding = malloc((samples + 1) * sizeof *winding);
    const bool good = sampler_make(&state->grid, samples, reference, &s) && field && winding &&
                      fm_mesh_winding(reference, (const float(*)[3])s.places, samples, INFINITY, winding) == FM_OK;
    for (uint32_t i = 0; good && i < samples; i++) {
        const double d = (double)s.closest[i].distance, f = (double)field[s.at[i]];
        const double slack = 1e-4 * voxel + 4e-7 * fabs(state->grid.origin[0]) + info.error;
        const bool outside = d > band && fabs(f) >= band - slack;
        judge(result, outside || fabs(fabs(f) - d) <= slack, s.places[i], "the distance", f, d);
        const bool told = state->what->sign != FM_SIGN_NONE && d > slack && fabsf(winding[i] - 0.5f) > 0.05f;
        judge(result, !told || (f < 0) == (winding[i] > 0.5f), s.places[i], "the side", f, winding[i] > 0.5f ? -d : d);
    }
    free(field);
    free(winding);
    sampler_free(&s);
    return good;
}

// Nearest points through the tree that was just made.
static bool check_tree(bench_mesh_state *state, fm_mesh *reference, uint32_t samples, bench_mesh_result *result) {
    const bench_mesh *mesh = state->what->mesh;
    const double size = mesh->high[0] - mesh->low[0];
    fm_volume_desc grid = {.shape = {64, 64, 64}};
    for (int i = 0; i < 3; i++) {
        grid.origin[i] = mesh->low[i];
        grid.spacing[i] = size / 64;
    }
    sampler s;
    fm_closest *found = malloc((samples + 1) * sizeof *found);
    const bool good = sampler_make(&grid, samples, reference, &s) && found &&
                      fm_mesh_closest(state->mesh, (const float(*)[3])s.places, samples, 0, found) == FM_OK;
    for (uint32_t i = 0; good && i < samples; i++) {
        const double d = (double)s.closest[i].distance, f = (double)found[i].distance;
        judge(result, fabs(f - d) <= 1e-6 * (size + fabs(mesh->low[0])), s.places[i], "the nearest point's distance", f, d);
    }
    free(found);
    sampler_free(&s);
    return good;
}

const char *bench_mesh_check(bench_session *session, bench_mesh_state *state, uint32_t samples, bench_mesh_result *result) {
    fm_context *context = bench_session_context(session, FM_BACKEND_CPU);
    fm_scene *scene = context && state->scene ? bench_mesh_scene(state->what, context, state->pose) : NULL;
    fm_mesh *own = context && !state->scene ? bench_mesh_on(state->what->mesh, context, state->pose) : NULL;
    fm_mesh *reference = scene && fm_scene_update(scene, FM_TREE_REFIT, NULL) == FM_OK ? fm_scene_mesh(scene) : own;
    if (!reference) {
        fm_scene_destroy(scene);
        return fm_last_error();
    }
    static bool (*const checks[])(bench_mesh_state *, fm_mesh *, uint32_t, bench_mesh_result *) = {
        [BENCH_MESH_RTSDF] = check_rtsdf,   [BENCH_MESH_COARSE] = check_coarse, [BENCH_MESH_EXACT] = check_exact,
        [BENCH_MESH_COMPOSE] = check_exact, [BENCH_MESH_SCENE] = check_exact,   [BENCH_MESH_BUILD] = check_tree,
        [BENCH_MESH_REFIT] = check_tree,
    };
    const bool done = samples == 0 || checks[state->what->mode](state, reference, samples, result);
    result->samples = done ? samples : 0;
    fm_scene_destroy(scene);
    fm_mesh_destroy(own);
    return !done ? fm_last_error() : result->wrong > 0 ? message : NULL;
}
