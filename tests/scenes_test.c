// SPDX-License-Identifier: MIT
// Scenes: the same bits however the slices are split, the densities and structures that their names promise.

#include "check.h"
#include "scenes.h"

#include <stdlib.h>
#include <string.h>

static uint64_t voxels_of(fm_shape shape) {
    return (uint64_t)shape.x * shape.y * shape.z;
}

static uint8_t *make(const char *name, const fm_scene_desc *desc, uint32_t threads) {
    const fm_scene *scene = fm_scene_find(name);
    uint8_t *out = malloc(voxels_of(desc->shape));
    if (CHECK(scene != NULL) && CHECK(out != NULL)) {
        memset(out, 0xee, voxels_of(desc->shape));
        fm_scene_fill_threads(scene, desc, 0, desc->shape.z, threads, out);
    }
    return out;
}

// FNV-1a, 64 bits.
static uint64_t checksum(const uint8_t *data, uint64_t size) {
    uint64_t hash = 0xcbf29ce484222325u;
    for (uint64_t i = 0; i < size; i++) {
        hash = (hash ^ data[i]) * 0x100000001b3u;
    }
    return hash;
}

static uint64_t count_solid(const uint8_t *data, uint64_t size) {
    uint64_t solid = 0;
    for (uint64_t i = 0; i < size; i++) {
        solid += data[i] != 0;
    }
    return solid;
}

static void test_splits(void) {
    const fm_shape shapes[] = {{1, 1, 1}, {1, 1, 9}, {7, 1, 1}, {33, 17, 5}, {300, 3, 20}, {64, 64, 64}};
    for (uint32_t i = 0; fm_scene_at(i); i++) {
        const fm_scene *scene = fm_scene_at(i);
        CHECK(fm_scene_find(fm_scene_name(scene)) == scene);
        CHECK(strlen(fm_scene_summary(scene)) > 0);
        for (uint32_t s = 0; s < sizeof shapes / sizeof shapes[0]; s++) {
            const fm_scene_desc desc = {.shape = shapes[s], .seed = 5};
            const uint64_t size = voxels_of(desc.shape), slice = (uint64_t)desc.shape.x * desc.shape.y;
            uint8_t *one = make(fm_scene_name(scene), &desc, 1), *many = make(fm_scene_name(scene), &desc, 5);
            CHECK(memcmp(one, many, size) == 0);
            for (uint32_t z = 0; z < desc.shape.z; z++) {
                fm_scene_fill(scene, &desc, z, z + 1, many + slice * z);
            }
            CHECK(memcmp(one, many, size) == 0);
            free(one);
            free(many);
        }
    }
}

// Fixed for good: other programs compare their fields across machines by these scenes.
static void test_checksums(void) {
    static const struct {
        const char *name;
        uint64_t checksum;
    } known[] = {
        {"terrain", 0xd46b80a4ba69fca9u}, {"sparse", 0xcb139c753af1f370u}, {"shell", 0x256f148f036cc235u},
        {"menger", 0xfd19dab9cd340b9fu},  {"city", 0xa5d102b942b1503cu},   {"checker", 0x724df52c4493c5a5u},
        {"single", 0xed9bd65080a09a8au},
    };
    for (uint32_t i = 0; i < sizeof known / sizeof known[0]; i++) {
        const fm_scene_desc desc = {.shape = {70, 50, 40}, .seed = 3};
        uint8_t *data = make(known[i].name, &desc, 2);
        if (!CHECK(checksum(data, voxels_of(desc.shape)) == known[i].checksum)) {
            fprintf(stderr, "    %s: 0x%016llx\n", known[i].name, (unsigned long long)checksum(data, voxels_of(desc.shape)));
        }
        free(data);
    }
}

static double density(const char *name, uint32_t n, uint64_t seed, double wanted) {
    const fm_scene_desc desc = {.shape = {n, n, n}, .seed = seed, .density = wanted};
    uint8_t *data = make(name, &desc, 0);
    double part = (double)count_solid(data, voxels_of(desc.shape)) / (double)voxels_of(desc.shape);
    free(data);
    return part;
}

static void test_densities(void) {
    for (uint64_t seed = 0; seed < 4; seed++) {
        const double terrain = density("terrain", 96, seed, 0);
        CHECK(terrain > 0.38 && terrain < 0.65);
        const double city = density("city", 96, seed, 0);
        CHECK(city > 0.05 && city < 0.4);
    }
    // Six standard deviations of 128^3 draws.
    CHECK(density("sparse", 128, 1, 0) > 0.001 - 0.00014 && density("sparse", 128, 1, 0) < 0.001 + 0.00014);
    CHECK(density("sparse", 128, 1, 0.25) > 0.25 - 0.0018 && density("sparse", 128, 1, 0.25) < 0.25 + 0.0018);
    CHECK(density("sparse", 16, 1, 1) == 1);
    CHECK(density("empty", 16, 0, 0) == 0);
    CHECK(density("full", 16, 0, 0) == 1);
    CHECK(density("checker", 16, 0, 0) == 0.5);
    CHECK(density("single", 16, 0, 0) == 1.0 / (16 * 16 * 16));
    // A sponge of level n fills (20 / 27)^n of its cube.
    CHECK(density("menger", 27, 0, 0) == 20.0 * 20 * 20 / (27.0 * 27 * 27));
}

static void test_seeds(void) {
    const fm_scene_desc a = {.shape = {40, 40, 40}, .seed = 1}, b = {.shape = {40, 40, 40}, .seed = 2};
    const char *const random[] = {"terrain", "sparse", "city"};
    for (int i = 0; i < 3; i++) {
        uint8_t *first = make(random[i], &a, 0), *second = make(random[i], &b, 0);
        CHECK(memcmp(first, second, voxels_of(a.shape)) != 0);
        free(first);
        free(second);
    }
}

// The shell keeps what is inside apart from what is outside: a flood from a corner does not reach the middle.
static void test_shell(void) {
    enum { N = 40 };
    const fm_scene_desc desc = {.shape = {N, N, N}};
    uint8_t *data = make("shell", &desc, 0);
    uint32_t *stack = malloc(sizeof *stack * N * N * N);
    uint32_t depth = 0;
    stack[depth++] = 0;
    data[0] = 2;
    while (depth > 0) {
        const uint32_t at = stack[--depth];
        const uint32_t x = at % N, y = at / N % N, z = at / (N * N);
        const uint32_t next[6] = {x > 0 ? at - 1 : at,     x + 1 < N ? at + 1 : at, y > 0 ? at - N : at,
                                  y + 1 < N ? at + N : at, z > 0 ? at - N * N : at, z + 1 < N ? at + N * N : at};
        for (int i = 0; i < 6; i++) {
            if (data[next[i]] == 0) {
                data[next[i]] = 2;
                stack[depth++] = next[i];
            }
        }
    }
    CHECK(data[N / 2 + N * (N / 2 + N * (N / 2))] == 0);
    // One voxel thick: along the middle row two voxels are solid.
    uint32_t solid = 0;
    for (uint32_t x = 0; x < N; x++) {
        solid += data[x + N * (N / 2 + N * (N / 2))] == 1;
    }
    CHECK(solid == 2);
    free(stack);
    free(data);
}

int main(void) {
    CHECK(fm_scene_find("no such scene") == NULL);
    CHECK(fm_scene_find("") == NULL);
    CHECK(fm_scene_palette()[3] == 0 && fm_scene_palette()[7] == 255);
    test_splits();
    test_checksums();
    test_densities();
    test_seeds();
    test_shell();
    return check_summary();
}
