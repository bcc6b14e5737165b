// SPDX-License-Identifier: MIT
// Checks results against a search that shares nothing with the transforms: the scene's voxels under a pyramid of "something solid
// in here" cells, walked nearest cell first and cut off at the best distance so far. Exact for every metric, in integers.

#include "bench.h"
#include "noise.h"
#include "parallel.h"

#include <inttypes.h>
#include <math.h>
#include <stdlib.h>
#include <string.h>

enum { MAX_LEVELS = 32 };

typedef struct level {
    uint32_t x, y, z;
    uint8_t *cells;  // non-zero: a voxel of the cell is solid
} level;

struct bench_scene {
    fm_shape shape;
    level levels[MAX_LEVELS];  // the voxels themselves, then cells of 2, 4, 8, ... voxels an axis
    uint32_t count;
    uint32_t *bits;  // made when first wanted
    double solid;
};

static uint64_t cell_index(const level *at, uint64_t x, uint64_t y, uint64_t z) {
    return x + at->x * (y + at->y * z);
}

typedef struct halve_job {
    const level *from;
    level *to;
} halve_job;

static void halve_slice(void *user, uint64_t z) {
    const halve_job *job = user;
    const level *from = job->from;
    uint8_t *out = job->to->cells + cell_index(job->to, 0, 0, z);
    memset(out, 0, (uint64_t)job->to->x * job->to->y);
    for (uint64_t fz = 2 * z; fz < 2 * z + 2 && fz < from->z; fz++) {
        for (uint64_t fy = 0; fy < from->y; fy++) {
            const uint8_t *row = from->cells + cell_index(from, 0, fy, fz);
            uint8_t *to = out + (fy / 2) * job->to->x;
            for (uint32_t x = 0; x < from->x; x++) {
                to[x / 2] |= row[x] != 0;
            }
        }
    }
}

bench_scene *bench_scene_create(const fm_scene *which, const fm_scene_desc *desc) {
    bench_scene *scene = calloc(1, sizeof *scene);
    if (!scene) {
        return NULL;
    }
    scene->shape = desc->shape;
    level next = {desc->shape.x, desc->shape.y, desc->shape.z, NULL};
    for (bool more = true; more && scene->count < MAX_LEVELS; scene->count++) {
        next.cells = malloc((uint64_t)next.x * next.y * next.z);
        if (!next.cells) {
            bench_scene_destroy(scene);
            return NULL;
        }
        scene->levels[scene->count] = next;
        if (scene->count == 0) {
            fm_scene_fill_threads(which, desc, 0, desc->shape.z, 0, next.cells);
        } else {
            halve_job job = {&scene->levels[scene->count - 1], &scene->levels[scene->count]};
            fm_parallel(0, next.z, halve_slice, &job);
        }
        more = next.x > 1 || next.y > 1 || next.z > 1;
        next = (level){(next.x + 1) / 2, (next.y + 1) / 2, (next.z + 1) / 2, NULL};
    }
    const uint64_t voxels = (uint64_t)desc->shape.x * desc->shape.y * desc->shape.z;
    uint64_t solid = 0;
    for (uint64_t i = 0; i < voxels; i++) {
        solid += scene->levels[0].cells[i] != 0;
    }
    scene->solid = (double)solid / (double)voxels;
    return scene;
}

void bench_scene_destroy(bench_scene *scene) {
    for (uint32_t i = 0; scene && i <= scene->count && i < MAX_LEVELS; i++) {
        free(scene->levels[i].cells);
    }
    if (scene) {
        free(scene->bits);
    }
    free(scene);
}

double bench_scene_solid(const bench_scene *scene) {
    return scene->solid;
}

typedef struct pack_job {
    const level *voxels;
    uint32_t *bits;
} pack_job;

static void pack_slice(void *user, uint64_t z) {
    const pack_job *job = user;
    const uint32_t words = (job->voxels->x + 31) / 32;
    for (uint64_t y = 0; y < job->voxels->y; y++) {
        const uint8_t *row = job->voxels->cells + cell_index(job->voxels, 0, y, z);
        uint32_t *out = job->bits + words * (y + job->voxels->y * z);
        memset(out, 0, words * sizeof *out);
        for (uint32_t x = 0; x < job->voxels->x; x++) {
            out[x / 32] |= (uint32_t)(row[x] != 0) << x % 32;
        }
    }
}

const void *bench_scene_input(bench_scene *scene, fm_type type) {
    const level *voxels = &scene->levels[0];
    if (type != FM_TYPE_BITS) {
        return voxels->cells;
    }
    if (!scene->bits) {
        scene->bits = malloc((uint64_t)(voxels->x + 31) / 32 * 4 * voxels->y * voxels->z);
        if (scene->bits) {
            fm_parallel(0, voxels->z, pack_slice, &(pack_job){voxels, scene->bits});
        }
    }
    return scene->bits;
}

typedef struct search {
    const bench_scene *scene;
    fm_metric metric;
    uint32_t x, y, z;
    uint64_t best;  // squared for L2; UINT64_MAX: nothing solid so far
} search;

static uint64_t gap(uint32_t position, uint64_t first, uint64_t last) {
    return position < first ? first - position : position > last ? position - last : 0;
}

static uint64_t cell_distance(const search *s, uint32_t k, uint64_t x, uint64_t y, uint64_t z) {
    const uint64_t dx = gap(s->x, x << k, ((x + 1) << k) - 1), dy = gap(s->y, y << k, ((y + 1) << k) - 1),
                   dz = gap(s->z, z << k, ((z + 1) << k) - 1);
    switch (s->metric) {
    case FM_METRIC_L1:
        return dx + dy + dz;
    case FM_METRIC_LINF:
        return dx > dy ? (dx > dz ? dx : dz) : (dy > dz ? dy : dz);
    case FM_METRIC_L2:
        break;
    }
    return dx * dx + dy * dy + dz * dz;
}

static void descend(search *s, uint32_t k, uint64_t x, uint64_t y, uint64_t z, uint64_t distance) {
    if (distance >= s->best) {
        return;
    }
    if (k == 0) {
        s->best = distance;
        return;
    }
    struct {
        uint64_t x, y, z, distance;
    } children[8];
    const level *below = &s->scene->levels[k - 1];
    uint32_t count = 0;
    for (uint32_t i = 0; i < 8; i++) {
        const uint64_t cx = 2 * x + i % 2, cy = 2 * y + i / 2 % 2, cz = 2 * z + i / 4;
        if (cx >= below->x || cy >= below->y || cz >= below->z || !below->cells[cell_index(below, cx, cy, cz)]) {
            continue;
        }
        const uint64_t to_child = cell_distance(s, k - 1, cx, cy, cz);
        uint32_t place = count++;
        for (; place > 0 && children[place - 1].distance > to_child; place--) {
            children[place] = children[place - 1];
        }
        children[place].x = cx;
        children[place].y = cy;
        children[place].z = cz;
        children[place].distance = to_child;
    }
    for (uint32_t i = 0; i < count; i++) {
        descend(s, k - 1, children[i].x, children[i].y, children[i].z, children[i].distance);
    }
}

static uint64_t nearest(const bench_scene *scene, fm_metric metric, uint32_t x, uint32_t y, uint32_t z) {
    search s = {scene, metric, x, y, z, UINT64_MAX};
    if (scene->levels[scene->count - 1].cells[0]) {
        descend(&s, scene->count - 1, 0, 0, 0, 0);
    }
    return s.best;
}

// The value that a correct field holds where the search found `raw`.
static double expected(const bench_case *what, uint64_t raw) {
    const bool none = raw == UINT64_MAX;
    switch (what->output) {
    case FM_TYPE_U8:
        return raw > UINT8_MAX ? UINT8_MAX : (double)raw;
    case FM_TYPE_U16:
        return raw > UINT16_MAX ? UINT16_MAX : (double)raw;
    case FM_TYPE_U32:
        return none ? UINT32_MAX : (double)raw;
    default:
        // A root of a whole number rounded to double and then to float is the correctly rounded float: double has more than twice
        // the bits.
        return none ? INFINITY : (double)(float)(what->metric == FM_METRIC_L2 ? sqrt((double)raw) : (double)raw);
    }
}

static double value_at(const void *output, fm_type type, uint64_t index) {
    switch (type) {
    case FM_TYPE_U8:
        return ((const uint8_t *)output)[index];
    case FM_TYPE_U16:
        return ((const uint16_t *)output)[index];
    case FM_TYPE_U32:
        return ((const uint32_t *)output)[index];
    default:
        return (double)((const float *)output)[index];
    }
}

typedef struct check_job {
    const bench_scene *scene;
    const bench_case *what;
    const void *output;
    bool *wrong;
} check_job;

// The first eight samples are the corners, the others random.
static void sample_place(const bench_scene *scene, uint64_t i, uint32_t place[3]) {
    const uint32_t extents[3] = {scene->shape.x, scene->shape.y, scene->shape.z};
    for (uint32_t axis = 0; axis < 3; axis++) {
        const uint64_t random = fm_mix(fm_mix(i) + axis) >> 32;
        place[axis] = i < 8 ? (i >> axis & 1) * (extents[axis] - 1) : (uint32_t)(random * extents[axis] >> 32);
    }
}

static void check_one(void *user, uint64_t i) {
    const check_job *job = user;
    uint32_t place[3];
    sample_place(job->scene, i, place);
    const uint64_t raw = nearest(job->scene, job->what->metric, place[0], place[1], place[2]);
    const uint64_t index = cell_index(&job->scene->levels[0], place[0], place[1], place[2]);
    job->wrong[i] = value_at(job->output, job->what->output, index) != expected(job->what, raw);
}

uint32_t bench_scene_check(const bench_scene *scene, const bench_case *what, const void *output, uint32_t samples, char *message,
                           size_t message_size) {
    bool *wrong = calloc(samples, sizeof *wrong);
    if (!wrong) {
        snprintf(message, message_size, "out of memory for %u samples", samples);
        return samples;
    }
    check_job job = {scene, what, output, wrong};
    fm_parallel(0, samples, check_one, &job);
    uint32_t count = 0;
    for (uint32_t i = 0; i < samples; i++) {
        if (wrong[i] && count++ == 0) {
            uint32_t p[3];
            sample_place(scene, i, p);
            const uint64_t index = cell_index(&scene->levels[0], p[0], p[1], p[2]);
            snprintf(message, message_size, "voxel (%u, %u, %u) is %g and should be %g", p[0], p[1], p[2],
                     value_at(output, what->output, index), expected(what, nearest(scene, what->metric, p[0], p[1], p[2])));
        }
    }
    free(wrong);
    return count;
}
