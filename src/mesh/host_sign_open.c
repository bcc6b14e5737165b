// SPDX-License-Identifier: MIT
// Sides of texels by winding numbers that change gradually, for the mesh is open. A block of texels falls into parts within which
// neighbours have no surface between them: the balls that their distances leave empty overlap. Along a way through a part the
// winding number changes by no more than its gradient allows, so that mostly one of the part's texels speaks for many.

#include "mesh/boundary.h"
#include "mesh/winding.h"

enum {
    BLOCK = 8,
    BLOCK_TEXELS = BLOCK * BLOCK * BLOCK,
    SHORT_BOUNDARY = 1 << 12,  // edges: one that is longer is not walked for single texels
    LONG_BOUNDARY = 1 << 16    // nor for blocks
};

typedef struct job {
    const fm_mesh *mesh;
    const fm_grid *grid;
    const fm_boundary *boundary;
    double band, widest;
    float *distance;
    uint64_t blocks[3];
} job;

typedef struct block {
    uint32_t low[3], size[3];
    float distance[BLOCK_TEXELS];  // at most this far from the surface there is none
    bool seen[BLOCK_TEXELS], inside[BLOCK_TEXELS];
    uint16_t part[BLOCK_TEXELS];  // the texels that the one at hand speaks for
    uint32_t count;
} block;

static void place(const job *work, const block *b, uint32_t texel, double at[3]) {
    const uint32_t index[3] = {texel % BLOCK, texel / BLOCK % BLOCK, texel / (BLOCK * BLOCK)};
    for (int axis = 0; axis < 3; axis++) {
        at[axis] = fm_grid_at(work->grid, axis, (int64_t)b->low[axis] + index[axis]);
    }
}

// The winding number, approximate where that leaves no doubt about 1/2.
static double winding_at(const job *work, const double at[3]) {
    const float position[3] = {(float)at[0], (float)at[1], (float)at[2]};
    const double about = (double)fm_winding_at(work->mesh, position, 2);
    if (fabs(about - 0.5) > 0.03) {
        return about;
    }
    if (work->boundary->count > SHORT_BOUNDARY) {
        return (double)fm_winding_at(work->mesh, position, 8);
    }
    const double curtain = fm_boundary_curtain(work->boundary, at);
    return round(about + curtain) - curtain;
}

// Lists the texels that are in one part with the seed and at most so many steps away.
static void gather(const job *work, block *b, uint32_t seed, uint32_t most) {
    static const uint32_t strides[3] = {1, BLOCK, BLOCK * BLOCK};
    uint16_t steps[BLOCK_TEXELS];
    b->count = 0;
    b->part[b->count++] = (uint16_t)seed;
    b->seen[seed] = true;
    steps[seed] = 0;
    for (uint32_t next = 0; next < b->count; next++) {
        const uint32_t texel = b->part[next];
        for (int way = 0; way < 6 && steps[texel] < most; way++) {
            const int axis = way / 2;
            const uint32_t index = texel / strides[axis] % BLOCK;
            if (way % 2 ? index + 1 >= b->size[axis] : index == 0) {
                continue;
            }
            const uint32_t other = way % 2 ? texel + strides[axis] : texel - strides[axis];
            if (!b->seen[other] && (double)(b->distance[texel] + b->distance[other]) > work->grid->spacing[axis] * 1.0001) {
                b->seen[other] = true;
                steps[other] = (uint16_t)(steps[texel] + 1);
                b->part[b->count++] = (uint16_t)other;
            }
        }
    }
}

// Decides the seed and what the gradient lets it speak for.
static void decide(const job *work, block *b, uint32_t seed, double gradient) {
    double at[3];
    place(work, b, seed, at);
    const double winding = winding_at(work, at);
    const double steps = (fabs(winding - 0.5) - 1e-5) / (gradient * work->widest);
    gather(work, b, seed, steps > 0 ? (uint32_t)fmin(steps, BLOCK_TEXELS) : 0);
    for (uint32_t i = 0; i < b->count; i++) {
        b->inside[b->part[i]] = winding > 0.5;
    }
}

static uint64_t texel_of(const job *work, const block *b, uint32_t x, uint32_t y, uint32_t z) {
    const fm_shape shape = work->grid->shape;
    return b->low[0] + x + shape.x * (b->low[1] + y + (uint64_t)shape.y * (b->low[2] + z));
}

static void load(const job *work, uint64_t number, block *b) {
    const uint32_t shape[3] = {work->grid->shape.x, work->grid->shape.y, work->grid->shape.z};
    const uint64_t index[3] = {number % work->blocks[0], number / work->blocks[0] % work->blocks[1],
                               number / (work->blocks[0] * work->blocks[1])};
    for (int axis = 0; axis < 3; axis++) {
        b->low[axis] = (uint32_t)index[axis] * BLOCK;
        b->size[axis] = (uint32_t)fm_min_u64(BLOCK, shape[axis] - b->low[axis]);
    }
    for (uint32_t texel = 0; texel < BLOCK_TEXELS; texel++) {
        const uint32_t x = texel % BLOCK, y = texel / BLOCK % BLOCK, z = texel / (BLOCK * BLOCK);
        b->seen[texel] = x >= b->size[0] || y >= b->size[1] || z >= b->size[2];
        if (!b->seen[texel]) {
            b->distance[texel] = fminf(work->distance[texel_of(work, b, x, y, z)], (float)work->band);
        }
    }
}

static void store(const job *work, const block *b) {
    for (uint32_t z = 0; z < b->size[2]; z++) {
        for (uint32_t y = 0; y < b->size[1]; y++) {
            for (uint32_t x = 0; x < b->size[0]; x++) {
                if (b->inside[x + BLOCK * (y + BLOCK * z)]) {
                    float *value = &work->distance[texel_of(work, b, x, y, z)];
                    *value = -*value;
                }
            }
        }
    }
}

static void sign_blocks(void *user, uint64_t begin, uint64_t end, uint32_t worker) {
    const job *work = user;
    (void)worker;
    for (uint64_t number = begin; number < end; number++) {
        block b;
        load(work, number, &b);
        double middle[3], radius2 = 0;
        for (int axis = 0; axis < 3; axis++) {
            const double half = (b.size[axis] - 1) / 2.0 * work->grid->spacing[axis];
            middle[axis] = fm_grid_at(work->grid, axis, b.low[axis]) + half;
            radius2 += half * half;
        }
        const bool walked = work->boundary->count <= LONG_BOUNDARY;
        const double gradient = walked ? fm_boundary_gradient(work->boundary, middle, sqrt(radius2)) : INFINITY;
        // The middle first: from there ways are short.
        const uint32_t first = b.size[0] / 2 + BLOCK * (b.size[1] / 2 + BLOCK * (b.size[2] / 2));
        for (uint32_t i = 0; i < BLOCK_TEXELS; i++) {
            const uint32_t seed = (first + i) % BLOCK_TEXELS;
            if (!b.seen[seed]) {
                decide(work, &b, seed, gradient);
            }
        }
        store(work, &b);
    }
}

fm_result fm_sign_open(fm_mesh *mesh, const fm_grid *grid, double band, const fm_boundary *boundary, float *distance) {
    FM_TRY(fm_winding_prepare(mesh));
    const uint32_t shape[3] = {grid->shape.x, grid->shape.y, grid->shape.z};
    job work = {.mesh = mesh, .grid = grid, .boundary = boundary, .band = band, .distance = distance};
    for (int axis = 0; axis < 3; axis++) {
        work.blocks[axis] = fm_div_up(shape[axis], BLOCK);
        work.widest = fmax(work.widest, grid->spacing[axis]);
    }
    fm_pool_run(mesh->context->pool, work.blocks[0] * work.blocks[1] * work.blocks[2], 4, sign_blocks, &work);
    return FM_OK;
}
