// SPDX-License-Identifier: MIT
// Nearest triangles as published: each proposes itself to the corners around it, then corners take over their neighbours' triangles
// where these are nearer. Source: Demir and Westermann 2015, section 3.1. What the paper leaves open: boxes are widened to whole
// cells, or a triangle smaller than a cell would reach no corner; rounds look at the state before them, so that their order does
// not count, and only at what the last round changed, which gives the same; nothing is taken over that is farther than the band.
// Corners of coarser cells, of which the paper says nothing, go on from those of the finer ones in the same way.

#include "octree/build.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

enum { MARGIN = 8, ROUNDS = 8, SLAB = 8, LONGEST = FM_CHUNK + 2 * MARGIN + 1, ROW = LONGEST + 2 };

// What is known at the corners of a lattice that reaches beyond the chunk.
struct fm_octree_growth {
    int level;
    int32_t low[3];  // in finest cells, a multiple of the lattice's step
    uint32_t shape[3];
    double band2;
    bool fill_only;
    uint64_t room;
    double *distance2, *next_distance2;
    uint32_t *triangles, *next_triangles;
    uint8_t *changed, *next_changed;
    uint8_t *slices;  // whether a slice has changed
    const fm_octree_build *build;
};

typedef struct fm_octree_growth growth;

static void set_lattice(growth *g, const fm_octree_chunk *chunk, int level) {
    const int32_t step = 1 << level, beside = MARGIN / step * step;
    g->level = level;
    for (int axis = 0; axis < 3; axis++) {
        g->low[axis] = -beside;
        g->shape[axis] = (chunk->extent[axis] + 2 * (uint32_t)beside) / (uint32_t)step + 1;
    }
}

float fm_octree_grown_reach(const fm_octree_chunk *chunk, int level, const uint32_t at[3]) {
    uint32_t beside = UINT32_MAX;
    for (int axis = 0; axis < 3; axis++) {
        const uint32_t low = at[axis] << level, high = (at[axis] + 1) << level;
        const uint32_t left = high < chunk->extent[axis] ? chunk->extent[axis] - high : 0;
        const uint32_t least = low < left ? low : left;
        beside = least < beside ? least : beside;
    }
    return (float)(beside + MARGIN);
}

void fm_octree_growth_free(fm_octree_build *build) {
    growth *g = build->growth;
    if (!g) {
        return;
    }
    fm_context *context = build->context;
    fm_octree_free(context, g->distance2, g->room * sizeof *g->distance2);
    fm_octree_free(context, g->next_distance2, g->room * sizeof *g->next_distance2);
    fm_octree_free(context, g->triangles, g->room * sizeof *g->triangles);
    fm_octree_free(context, g->next_triangles, g->room * sizeof *g->next_triangles);
    fm_octree_free(context, g->changed, g->room);
    fm_octree_free(context, g->next_changed, g->room);
    fm_octree_free(context, g->slices, LONGEST);
    fm_octree_free(context, g, sizeof *g);
    build->growth = NULL;
}

// For the first chunk, which no other is greater than.
static fm_result growth_make(fm_octree_build *build) {
    fm_context *context = build->context;
    growth *g = fm_octree_alloc_zero(context, sizeof *g, "a chunk's growth");
    if (!g) {
        return FM_ERROR_OUT_OF_HOST_MEMORY;
    }
    build->growth = g;
    g->build = build;
    uint64_t room = 1;
    for (int axis = 0; axis < 3; axis++) {
        room *= fm_min_u64(FM_CHUNK, fm_round_up(build->cells[axis], UINT64_C(1) << build->grain)) + 2 * MARGIN + 1;
    }
    g->room = room;
    g->distance2 = fm_octree_alloc(context, room * sizeof *g->distance2, "a chunk's growth");
    g->next_distance2 = fm_octree_alloc(context, room * sizeof *g->next_distance2, "a chunk's growth");
    g->triangles = fm_octree_alloc(context, room * sizeof *g->triangles, "a chunk's growth");
    g->next_triangles = fm_octree_alloc(context, room * sizeof *g->next_triangles, "a chunk's growth");
    g->changed = fm_octree_alloc(context, room, "a chunk's growth");
    g->next_changed = fm_octree_alloc(context, room, "a chunk's growth");
    g->slices = fm_octree_alloc(context, LONGEST, "a chunk's growth");
    const bool made = g->distance2 && g->next_distance2 && g->triangles && g->next_triangles && g->changed && g->next_changed;
    return made && g->slices ? FM_OK : FM_ERROR_OUT_OF_HOST_MEMORY;
}

static double distance2_to(const growth *g, uint32_t triangle, const uint32_t corner[3]) {
    const fm_mesh *mesh = &g->build->soup.mesh;
    const float *const corners[3] = {mesh->vertices[3 * (uint64_t)triangle], mesh->vertices[3 * (uint64_t)triangle + 1],
                                     mesh->vertices[3 * (uint64_t)triangle + 2]};
    const int32_t step = 1 << g->level;
    const float at[3] = {(float)(g->low[0] + (int32_t)corner[0] * step), (float)(g->low[1] + (int32_t)corner[1] * step),
                         (float)(g->low[2] + (int32_t)corner[2] * step)};
    return fm_point_nearest(corners, at).distance2;
}

// --- Triangles to the corners around them ---

typedef struct corner_range {
    uint32_t from[3], to[3];  // of corners, both included
    double normal[3], level, within;
} corner_range;

// False where no corner of slices [begin, end) is around it.
static bool range_of(const growth *g, uint32_t triangle, uint32_t begin, uint32_t end, corner_range *range) {
    const float(*v)[3] = (const float(*)[3])g->build->soup.mesh.vertices + 3 * (uint64_t)triangle;
    double u[3], w[3];
    for (int axis = 0; axis < 3; axis++) {
        const double low = fmin((double)v[0][axis], fmin((double)v[1][axis], (double)v[2][axis])) - g->low[axis];
        const double high = fmax((double)v[0][axis], fmax((double)v[1][axis], (double)v[2][axis])) - g->low[axis];
        const double first = axis == 2 ? begin : 0, last = axis == 2 ? end - 1.0 : g->shape[axis] - 1.0;
        if (ceil(high) < first || floor(low) > last) {
            return false;
        }
        range->from[axis] = (uint32_t)fmax(first, floor(low));
        range->to[axis] = (uint32_t)fmin(last, ceil(high));
        u[axis] = (double)v[1][axis] - (double)v[0][axis];
        w[axis] = (double)v[2][axis] - (double)v[0][axis];
    }
    double length2 = 0;
    range->level = 0;
    for (int axis = 0; axis < 3; axis++) {
        const int a = (axis + 1) % 3, b = (axis + 2) % 3;
        range->normal[axis] = u[a] * w[b] - u[b] * w[a];
        range->level += range->normal[axis] * ((double)v[0][axis] - g->low[axis]);
        length2 += range->normal[axis] * range->normal[axis];
    }
    range->within = sqrt(length2 * g->band2) * (1 + 1e-9) + fabs(range->level) * 1e-9;
    return true;
}

static void propose(growth *g, uint32_t triangle, const corner_range *range) {
    for (uint32_t z = range->from[2]; z <= range->to[2]; z++) {
        for (uint32_t y = range->from[1]; y <= range->to[1]; y++) {
            for (uint32_t x = range->from[0]; x <= range->to[0]; x++) {
                const double along = range->normal[0] * x + range->normal[1] * y + range->normal[2] * z - range->level;
                if (fabs(along) > range->within) {
                    continue;
                }
                const uint32_t corner[3] = {x, y, z};
                const uint64_t i = fm_node_at(g->shape, x, y, z);
                const double distance2 = distance2_to(g, triangle, corner);
                if (distance2 < g->distance2[i] && distance2 <= g->band2) {
                    g->distance2[i] = distance2;
                    g->triangles[i] = triangle;
                    g->changed[i] = 1;
                }
            }
        }
    }
}

static void seed_slabs(void *user, uint64_t first, uint64_t last, uint32_t worker) {
    growth *g = user;
    const uint64_t slice = (uint64_t)g->shape[0] * g->shape[1];
    (void)worker;
    for (uint64_t slab = first; slab < last; slab++) {
        const uint32_t begin = (uint32_t)slab * SLAB, end = (uint32_t)fm_min_u64(begin + SLAB, g->shape[2]);
        for (uint64_t i = begin * slice; i < end * slice; i++) {
            g->distance2[i] = (double)INFINITY;
            g->triangles[i] = FM_NO_TRIANGLE;
            g->changed[i] = 0;
        }
        for (uint32_t triangle = 0; triangle < g->build->soup.mesh.triangle_count; triangle++) {
            corner_range range;
            if (range_of(g, triangle, begin, end, &range)) {
                propose(g, triangle, &range);
            }
        }
    }
}

// --- Rounds ---

// Looks at those of the 26 neighbours that changed.
static void grow_corner(const growth *g, const uint32_t corner[3], uint64_t own) {
    uint32_t tried[26], count = 0, best = g->triangles[own];
    double distance2 = g->distance2[own];
    const double step = (double)(1u << g->level);
    for (uint32_t n = 0; n < 27; n++) {
        const uint32_t at[3] = {corner[0] + n % 3 - 1, corner[1] + n / 3 % 3 - 1, corner[2] + n / 9 - 1};
        if (n == 13 || at[0] >= g->shape[0] || at[1] >= g->shape[1] || at[2] >= g->shape[2]) {
            continue;
        }
        const uint64_t i = fm_node_at(g->shape, at[0], at[1], at[2]);
        if (!g->changed[i] || g->triangles[i] == g->triangles[own]) {
            continue;
        }
        // No place is nearer to a triangle than its neighbour is, less the way between them.
        const double way = sqrt((double)(abs((int)(n % 3) - 1) + abs((int)(n / 3 % 3) - 1) + abs((int)(n / 9) - 1))) * step;
        const double least = sqrt(g->distance2[i]) - way;
        if (least > 0 && least * least > distance2 * (1 + 1e-9)) {
            continue;
        }
        uint32_t k = 0;
        while (k < count && tried[k] != g->triangles[i]) {
            k++;
        }
        if (k < count) {
            continue;
        }
        tried[count++] = g->triangles[i];
        const double other = distance2_to(g, g->triangles[i], corner);
        if (other < distance2 && other <= g->band2) {
            distance2 = other;
            best = g->triangles[i];
        }
    }
    g->next_distance2[own] = distance2;
    g->next_triangles[own] = best;
    g->next_changed[own] = best != g->triangles[own];
}

// Which corners of a row have a neighbour that changed, or did so themselves. False: none.
static bool row_to_do(const growth *g, uint32_t y, uint32_t z, uint8_t *wanted) {
    const uint32_t size = g->shape[0];
    uint8_t beside[ROW] = {0}, any = 0;
    for (uint32_t k = z > 0 ? z - 1 : 0; k <= z + 1 && k < g->shape[2]; k++) {
        for (uint32_t j = y > 0 ? y - 1 : 0; j <= y + 1 && j < g->shape[1]; j++) {
            const uint8_t *row = g->changed + fm_node_at(g->shape, 0, j, k);
            for (uint32_t x = 0; x < size; x++) {
                beside[x + 1] |= row[x];
            }
        }
    }
    for (uint32_t x = 0; x < size; x++) {
        wanted[x] = beside[x] | beside[x + 1] | beside[x + 2];
        any |= wanted[x];
    }
    return any;
}

static void grow_slices(void *user, uint64_t begin, uint64_t end, uint32_t worker) {
    const growth *g = user;
    const uint64_t size = g->shape[0];
    (void)worker;
    for (uint32_t z = (uint32_t)begin; z < end; z++) {
        uint8_t any = 0;
        for (uint32_t y = 0; y < g->shape[1]; y++) {
            const uint64_t row = fm_node_at(g->shape, 0, y, z);
            uint8_t wanted[ROW];
            memcpy(g->next_distance2 + row, g->distance2 + row, size * sizeof *g->distance2);
            memcpy(g->next_triangles + row, g->triangles + row, size * sizeof *g->triangles);
            memset(g->next_changed + row, 0, size);
            if (!row_to_do(g, y, z, wanted)) {
                continue;
            }
            for (uint32_t x = 0; x < size; x++) {
                if (wanted[x] && !(g->fill_only && g->triangles[row + x] != FM_NO_TRIANGLE)) {
                    const uint32_t corner[3] = {x, y, z};
                    grow_corner(g, corner, row + x);
                    any |= g->next_changed[row + x];
                }
            }
        }
        g->slices[z] = any;
    }
}

// After the rounds only corners that know no triangle take one, so that no leaf lacks a corner: what is within the band of one
// corner of a cell is within reach of the others.
static void grow(growth *g, uint32_t rounds) {
    for (uint32_t round = 0;; round++) {
        g->fill_only = round >= rounds;
        fm_pool_run(g->build->context->pool, g->shape[2], 1, grow_slices, g);
        double *distance2 = g->distance2;
        uint32_t *triangles = g->triangles;
        uint8_t *changed = g->changed;
        g->distance2 = g->next_distance2;
        g->triangles = g->next_triangles;
        g->changed = g->next_changed;
        g->next_distance2 = distance2;
        g->next_triangles = triangles;
        g->next_changed = changed;
        if (!memchr(g->slices, 1, g->shape[2])) {
            return;
        }
    }
}

// --- From one lattice to the next ---

// Every other corner; towards lower addresses, so that nothing is overwritten before it is read.
static void coarsen(growth *g, const fm_octree_chunk *chunk) {
    growth finer = *g;
    set_lattice(g, chunk, finer.level + 1);
    const int32_t step = 1 << g->level;
    for (uint32_t z = 0; z < g->shape[2]; z++) {
        for (uint32_t y = 0; y < g->shape[1]; y++) {
            for (uint32_t x = 0; x < g->shape[0]; x++) {
                const int32_t shift = finer.level;
                const uint64_t from = fm_node_at(finer.shape, (uint32_t)(g->low[0] + (int32_t)x * step - finer.low[0]) >> shift,
                                                 (uint32_t)(g->low[1] + (int32_t)y * step - finer.low[1]) >> shift,
                                                 (uint32_t)(g->low[2] + (int32_t)z * step - finer.low[2]) >> shift);
                const uint64_t to = fm_node_at(g->shape, x, y, z);
                g->distance2[to] = g->distance2[from];
                g->triangles[to] = g->triangles[from];
                g->changed[to] = g->triangles[to] != FM_NO_TRIANGLE;
            }
        }
    }
}

static void take_field(const growth *g, const fm_octree_field *field) {
    const uint32_t beside = (uint32_t)-g->low[0] >> g->level;
    for (uint32_t z = 0; z < field->shape[2]; z++) {
        for (uint32_t y = 0; y < field->shape[1]; y++) {
            const uint64_t from = fm_node_at(g->shape, beside, y + beside, z + beside), to = fm_node_at(field->shape, 0, y, z);
            memcpy(field->triangles + to, g->triangles + from, field->shape[0] * sizeof *field->triangles);
        }
    }
}

fm_result fm_octree_fields_grown(fm_octree_build *build) {
    if (!build->growth) {
        FM_TRY(growth_make(build));
    }
    growth *g = build->growth;
    const fm_octree_chunk *chunk = &build->chunk;
    const uint32_t rounds = build->desc->rounds > 0 ? build->desc->rounds : ROUNDS;
    for (int level = 0; level <= build->leaf_most; level++) {
        // The next lattice begins with what is known here.
        const double band = (double)chunk->fields[level < build->leaf_most ? level + 1 : level].band;
        g->band2 = band * band;
        if (level == 0) {
            set_lattice(g, chunk, 0);
            fm_pool_run(build->context->pool, fm_div_up(g->shape[2], SLAB), 1, seed_slabs, g);
        } else {
            coarsen(g, chunk);
        }
        grow(g, rounds);
        take_field(g, &chunk->fields[level]);
    }
    return FM_OK;
}
