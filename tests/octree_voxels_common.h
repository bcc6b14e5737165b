// SPDX-License-Identifier: MIT
#ifndef FM_OCTREE_VOXELS_COMMON_H
#define FM_OCTREE_VOXELS_COMMON_H

// Arrays of voxels as sources of octrees, and rays through them by the plainest march in doubles.

#include "check.h"
#include "fathom/octree.h"
#include "octree/voxels.h"
#include "random.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

static const fm_octree_kind grid_kinds[] = {FM_OCTREE_VOXELS, FM_OCTREE_CONTOURS, FM_OCTREE_DAG, FM_OCTREE_TREE64};
enum { GRID_KINDS = sizeof grid_kinds / sizeof *grid_kinds };

typedef struct grid {
    uint32_t shape[3];
    uint32_t *voxels;
    int reads_left;  // below 0: no read fails
} grid;

static inline uint64_t grid_count(const grid *g) {
    return (uint64_t)g->shape[0] * g->shape[1] * g->shape[2];
}

static inline uint32_t *grid_at(const grid *g, int64_t x, int64_t y, int64_t z) {
    return &g->voxels[x + (int64_t)g->shape[0] * (y + (int64_t)g->shape[1] * z)];
}

static inline grid grid_new(uint32_t x, uint32_t y, uint32_t z) {
    grid g = {{x, y, z}, NULL, -1};
    g.voxels = calloc(grid_count(&g), sizeof *g.voxels);
    if (!g.voxels) {
        abort();
    }
    return g;
}

static inline fm_result grid_read(void *user, const fm_box *box, uint32_t *voxels) {
    grid *g = user;
    if (g->reads_left == 0) {
        return FM_ERROR_IO;
    }
    if (g->reads_left > 0) {
        g->reads_left--;
    }
    for (int64_t z = box->begin[2]; z < box->end[2]; z++) {
        for (int64_t y = box->begin[1]; y < box->end[1]; y++) {
            for (int64_t x = box->begin[0]; x < box->end[0]; x++) {
                *voxels++ = *grid_at(g, x, y, z);
            }
        }
    }
    return FM_OK;
}

static inline bool grid_air(void *user, const fm_box *box) {
    const grid *g = user;
    for (int64_t z = box->begin[2]; z < box->end[2]; z++) {
        for (int64_t y = box->begin[1]; y < box->end[1]; y++) {
            for (int64_t x = box->begin[0]; x < box->end[0]; x++) {
                if (*grid_at(g, x, y, z) != 0) {
                    return false;
                }
            }
        }
    }
    return true;
}

static inline fm_voxel_source grid_source(grid *g, bool air) {
    return (fm_voxel_source){
        .user = g, .shape = {g->shape[0], g->shape[1], g->shape[2]}, .read = grid_read, .air = air ? grid_air : NULL};
}

static inline void grid_random(grid *g, double density, uint32_t numbers, uint64_t seed) {
    for (uint64_t i = 0; i < grid_count(g); i++) {
        const bool solid = (double)(test_random(&seed) >> 11) < density * 9007199254740992.0;
        g->voxels[i] = solid ? 1 + (uint32_t)(test_random(&seed) % numbers) : 0;
    }
}

// Whether all voxels of a cell are those of the array.
static inline bool grid_cell_equal(const grid *g, const fm_voxel_trees *trees, uint32_t level, const uint32_t corner[3],
                                   const fm_voxel_ref *cell) {
    if (corner[0] >= g->shape[0] || corner[1] >= g->shape[1] || corner[2] >= g->shape[2]) {
        return cell->type == FM_REF_EMPTY;
    }
    if (cell->type == FM_REF_NODE) {
        fm_voxel_ref children[FM_BRANCHES];
        const uint32_t branch = trees->kind->branch(level), edge = 1u << branch, below = level - branch;
        bool equal = true;
        trees->kind->split(trees, level, cell, children);
        for (uint32_t i = 0; i < edge * edge * edge && equal; i++) {
            const uint32_t at[3] = {corner[0] + (i % edge << below), corner[1] + (i / edge % edge << below),
                                    corner[2] + (i / edge / edge << below)};
            equal = grid_cell_equal(g, trees, below, at, &children[i]);
        }
        return equal;
    }
    const uint32_t wanted = cell->type == FM_REF_SOLID ? cell->w[0] : 0;
    uint64_t end[3];
    for (int i = 0; i < 3; i++) {
        end[i] = corner[i] + (1ull << level);
        if (end[i] > g->shape[i]) {
            if (wanted != 0) {
                return false;
            }
            end[i] = g->shape[i];
        }
    }
    for (uint64_t z = corner[2]; z < end[2]; z++) {
        for (uint64_t y = corner[1]; y < end[1]; y++) {
            for (uint64_t x = corner[0]; x < end[0]; x++) {
                const uint32_t number = *grid_at(g, (int64_t)x, (int64_t)y, (int64_t)z);
                if ((trees->kind->colorless ? number != 0 : number) != wanted) {
                    return false;
                }
            }
        }
    }
    return true;
}

// Whether all voxels that the octree holds are those of the array.
static inline bool grid_equal(const grid *g, fm_octree *octree) {
    const fm_voxel_trees trees = {.octree = octree, .kind = fm_voxel_kind_of(octree->info.kind)};
    const uint32_t *top = octree->info.top, levels = octree->info.levels;
    for (uint64_t i = 0; i < fm_voxel_tops(octree); i++) {
        const uint32_t corner[3] = {(uint32_t)(i % top[0]) << levels, (uint32_t)(i / top[0] % top[1]) << levels,
                                    (uint32_t)(i / top[0] / top[1]) << levels};
        const fm_voxel_ref cell = trees.kind->placed(&trees, fm_voxel_words(&trees)[i]);
        if (!grid_cell_equal(g, &trees, levels, corner, &cell)) {
            return false;
        }
    }
    return true;
}

typedef struct grid_hit {
    double t;  // infinity: nothing
    int axis;  // 3: the ray begins in a solid voxel
    uint32_t number;
    double doubt;  // how near to an edge of a voxel the ray ran anywhere on its way, in voxels
} grid_hit;

// Positions as cameras have them: voxel (0, 0, 0) is around 0.
static inline grid_hit grid_cast(const grid *g, const float origin[3], const float way[3]) {
    double from[3], t = 0;
    int64_t cell[3];
    grid_hit hit = {INFINITY, 3, 0, INFINITY};
    for (int i = 0; i < 3; i++) {
        from[i] = (double)origin[i] + 0.5;
    }
    // Into the grid.
    double last = INFINITY;
    for (int i = 0; i < 3; i++) {
        const double w = (double)way[i];
        if (w == 0) {
            last = from[i] < 0 || from[i] >= g->shape[i] ? -1 : last;
            continue;
        }
        const double a = (w > 0 ? 0 - from[i] : g->shape[i] - from[i]) / w, b = (w > 0 ? g->shape[i] - from[i] : 0 - from[i]) / w;
        hit.axis = a > t ? i : hit.axis;
        t = fmax(t, a);
        last = fmin(last, b);
    }
    hit.doubt = fabs(last - t);
    if (t >= last) {
        return hit;
    }
    for (int i = 0; i < 3; i++) {
        const int64_t at = (int64_t)floor(from[i] + (double)way[i] * t);
        cell[i] = i == hit.axis ? (way[i] > 0 ? 0 : (int64_t)g->shape[i] - 1) : at;
        cell[i] = cell[i] < 0 ? 0 : cell[i] >= g->shape[i] ? g->shape[i] - 1 : cell[i];
    }
    for (;;) {
        hit.number = *grid_at(g, cell[0], cell[1], cell[2]);
        if (hit.number != 0) {
            hit.t = t;
            return hit;
        }
        double leave[3], first = INFINITY;
        for (int i = 0; i < 3; i++) {
            const double w = (double)way[i];
            leave[i] = w == 0 ? INFINITY : ((double)cell[i] + (w > 0) - from[i]) / w;
            first = fmin(first, leave[i]);
        }
        hit.axis = leave[0] == first ? 0 : leave[1] == first ? 1 : 2;
        for (int i = 0; i < 3; i++) {
            if (i != hit.axis) {
                // How far from the next face along this axis the ray is where it leaves.
                const double at = from[i] + (double)way[i] * first;
                hit.doubt = fmin(hit.doubt, fmin(fabs(at - (double)cell[i]), fabs((double)cell[i] + 1 - at)));
            }
        }
        cell[hit.axis] += way[hit.axis] > 0 ? 1 : -1;
        t = first;
        if (cell[hit.axis] < 0 || cell[hit.axis] >= g->shape[hit.axis]) {
            hit.number = 0;
            return hit;
        }
    }
}

// The way from a place to a solid voxel, if there is any.
static inline void grid_aim(const grid *g, uint64_t *seed, const float origin[3], float way[3]) {
    uint64_t at = test_random(seed) % grid_count(g);
    for (uint64_t i = 0; i < grid_count(g) && g->voxels[at] == 0; i++) {
        at = (at + 1) % grid_count(g);
    }
    for (int i = 0; i < 3; i++) {
        way[i] = (float)(at % g->shape[i]) + (float)test_between(seed, -400, 400) * 0.001f - origin[i];
        at /= g->shape[i];
    }
}

// A ray from somewhere in or around the grid.
static inline void grid_ray(const grid *g, uint64_t *seed, float origin[3], float way[3]) {
    double square = 0;
    for (int i = 0; i < 3; i++) {
        const double size = g->shape[i] + 4.0;
        origin[i] = (float)((double)(test_random(seed) >> 11) / 9007199254740992.0 * 2 * size - 0.5 * size);
        way[i] = (float)test_between(seed, -1000, 1000) * 0.001f;
    }
    if (test_random(seed) % 2 == 0) {
        grid_aim(g, seed, origin, way);
    } else if (test_random(seed) % 4 == 0) {
        way[test_random(seed) % 3] = 0;
    }
    for (int i = 0; i < 3; i++) {
        square += (double)way[i] * (double)way[i];
    }
    if (square == 0) {
        way[0] = 1;
        square = 1;
    }
    for (int i = 0; i < 3; i++) {
        way[i] = (float)((double)way[i] / sqrt(square));
    }
}

#endif
