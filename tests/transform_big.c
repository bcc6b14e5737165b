// SPDX-License-Identifier: MIT
// More than 2^32 voxels on the CPU: bits in, L1 distances of one byte out, compared at samples with the nearest of a few sites.
// Takes 6 GB, and runs where FATHOM_BIG is 1.

#include "check.h"

#include <stdlib.h>
#include <string.h>

static const fm_shape shape = {2048, 2048, 1100};

// The ends, both sides of element 2^31 (slice 512) and of 2^32 (slice 1024), and one by itself.
static const uint32_t sites[][3] = {{0, 0, 0},    {2047, 2047, 511},  {0, 0, 512},       {2047, 2047, 1023},
                                    {0, 0, 1024}, {2047, 2047, 1099}, {1000, 1200, 1050}};
enum { SITES = sizeof sites / sizeof sites[0] };

static uint32_t apart(uint32_t a, uint32_t b) {
    return a < b ? b - a : a - b;
}

static uint32_t nearest(const uint32_t at[3]) {
    uint32_t least = UINT8_MAX;
    for (int i = 0; i < SITES; i++) {
        const uint32_t way = apart(at[0], sites[i][0]) + apart(at[1], sites[i][1]) + apart(at[2], sites[i][2]);
        least = way < least ? way : least;
    }
    return least;
}

static uint32_t random_below(uint64_t *state, uint32_t limit) {
    *state = *state * 6364136223846793005u + 1442695040888963407u;
    return (uint32_t)((*state >> 33) % limit);
}

// A random coordinate, up to 100 from `middle` or anywhere.
static uint32_t random_at(uint64_t *state, uint32_t middle, uint32_t size, bool near) {
    const uint32_t low = near && middle > 100 ? middle - 100 : 0;
    const uint32_t high = near && middle + 100 < size ? middle + 101 : size;
    return low + random_below(state, high - low);
}

static void check_samples(const uint8_t *distance) {
    uint64_t state = 1;
    uint32_t below = 0;
    for (uint32_t i = 0; i < 1000000; i++) {
        const uint32_t *site = sites[i % SITES];
        const bool near = i % 4 != 0;
        const uint32_t at[3] = {random_at(&state, site[0], shape.x, near), random_at(&state, site[1], shape.y, near),
                                random_at(&state, site[2], shape.z, near)};
        const uint32_t wanted = nearest(at);
        const uint8_t got = distance[at[0] + shape.x * (at[1] + (uint64_t)shape.y * at[2])];
        below += wanted < UINT8_MAX;
        if (!CHECK(got == wanted)) {
            fprintf(stderr, "    (%u, %u, %u): %u, wanted %u\n", at[0], at[1], at[2], got, wanted);
        }
    }
    printf("%u samples are nearer than 255\n", below);
    CHECK(below > 100000);
}

int main(void) {
    const char *big = getenv("FATHOM_BIG");
    if (!big || strcmp(big, "1") != 0) {
        return check_skip("takes 6 GB; FATHOM_BIG=1 runs it");
    }
    const uint64_t voxels = (uint64_t)shape.x * shape.y * shape.z;
    uint32_t *bits = calloc(voxels / 32, sizeof *bits);
    uint8_t *distance = malloc(voxels);
    if (!bits || !distance) {
        free(bits);
        free(distance);
        return check_skip("no 6 GB of memory");
    }
    for (int i = 0; i < SITES; i++) {
        const uint64_t at = sites[i][0] + shape.x * (sites[i][1] + (uint64_t)shape.y * sites[i][2]);
        bits[at / 32] |= 1u << (at % 32);
    }
    const fm_context_desc desc = {.backend = FM_BACKEND_CPU};
    fm_context *context = NULL;
    if (CHECK_OK(fm_context_create(&desc, &context))) {
        const fm_transform_desc wanted = {.metric = FM_METRIC_L1, .saturate = true};
        const fm_array solid = {bits, FM_TYPE_BITS, shape};
        const fm_array out = {distance, FM_TYPE_U8, shape};
        if (CHECK_OK(fm_transform_host(context, &wanted, &solid, &out, NULL))) {
            check_samples(distance);
        }
        fm_context_destroy(context);
    }
    free(bits);
    free(distance);
    return check_summary();
}
