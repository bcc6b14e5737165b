// SPDX-License-Identifier: MIT

// Reads the fuzzer's bytes as an octree file: as they are, and with checksums made right, so that what lies behind them is
// reached. Rays then go through what was taken, and octrees of voxels are updated, and gone through again.

#include "octree_made.h"

#include <math.h>
#include <stdlib.h>

int LLVMFuzzerTestOneInput(const uint8_t *data, size_t size);

static void keep(fm_octree *octree) {
    (void)octree;
}

// From outside through the middle and along an edge, and from within.
static void cast(fm_octree *octree) {
    enum { RAYS = 8 };
    fm_octree_info info;
    fm_octree_describe(octree, &info);
    fm_mesh_ray rays[RAYS] = {0};
    fm_octree_hit hits[RAYS];
    for (int i = 0; i < RAYS; i++) {
        for (int axis = 0; axis < 3; axis++) {
            const float low = info.low[axis], high = info.high[axis];
            const float part = i == 7 ? 0.3f : (i >> axis & 1 ? 1.25f : -0.25f);
            rays[i].origin[axis] = low + (high - low) * part;
            rays[i].direction[axis] = i == 7 ? (float)(axis == 1) : (0.4f - part) * (high - low);
        }
        rays[i].last = INFINITY;
    }
    const fm_result result = fm_octree_cast(octree, rays, RAYS, 0, hits);
    if (result != FM_OK && fm_last_error()[0] == 0) {
        abort();
    }
}

// Solid up to the middle of each cube of eight.
static fm_result read_half(void *user, const fm_box *box, uint32_t *voxels) {
    (void)user;
    for (int64_t z = box->begin[2]; z < box->end[2]; z++) {
        for (int64_t y = box->begin[1]; y < box->end[1]; y++) {
            for (int64_t x = box->begin[0]; x < box->end[0]; x++) {
                *voxels++ = z % 8 < 4 ? 1 + (uint32_t)(x / 3 % 2) : 0;
            }
        }
    }
    return FM_OK;
}

// At both ends, and all of what is small.
static void update(fm_octree *octree) {
    enum { SMALL = 48 };
    fm_octree_info info;
    fm_octree_describe(octree, &info);
    if (info.kind < FM_OCTREE_VOXELS || info.kind > FM_OCTREE_TREE64) {
        return;
    }
    const int64_t x = info.cells[0], y = info.cells[1], z = info.cells[2];
    const fm_voxel_source source = {.shape = {info.cells[0], info.cells[1], info.cells[2]}, .read = read_half};
    const fm_box boxes[] = {{{0, 0, 0}, {1, 1, 1}},
                            {{x - 1, y - 1, z - 1}, {x, y, z}},
                            {{0, 0, 0}, {x < SMALL ? x : SMALL, y < SMALL ? y : SMALL, z < SMALL ? z : SMALL}}};
    for (uint32_t i = 0; i < 3; i++) {
        if (fm_octree_update_voxels(octree, &source, &boxes[i], 1) != FM_OK && fm_last_error()[0] == 0) {
            abort();
        }
    }
    cast(octree);
}

static void read_once(fm_context *context, uint8_t *image, size_t size) {
    const fm_fmo_memory memory = {image, size, keep};
    fm_octree *octree = NULL;
    const fm_result result = fm_fmo_read_image(context, &memory, "input", &octree);
    if (result == FM_OK) {
        cast(octree);
        update(octree);
        fm_octree_destroy(octree);
    } else if (octree || fm_last_error()[0] == 0) {
        abort();
    }
}

int LLVMFuzzerTestOneInput(const uint8_t *data, size_t size) {
    static fm_context *context;
    const fm_context_desc cpu = {.backend = FM_BACKEND_CPU, .threads = 1};
    if (!context && fm_context_create(&cpu, &context) != FM_OK) {
        abort();
    }
    uint8_t *copy = malloc(size + 1);
    memcpy(copy, data, size);
    read_once(context, copy, size);
    made_seal(copy, size);
    read_once(context, copy, size);
    free(copy);
    return 0;
}
