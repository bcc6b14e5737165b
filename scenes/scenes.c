// SPDX-License-Identifier: MIT
#include "scenes.h"

#include "fill.h"
#include "noise.h"
#include "parallel.h"

#include <assert.h>
#include <string.h>

struct fm_scene {
    const char *name, *summary;
    void (*fill)(const fm_scene_desc *desc, uint32_t z_begin, uint32_t z_end, uint8_t *out);
};

static uint64_t slice_bytes(fm_shape shape) {
    return (uint64_t)shape.x * shape.y;
}

static void fill_empty(const fm_scene_desc *desc, uint32_t z_begin, uint32_t z_end, uint8_t *out) {
    memset(out, FM_MATERIAL_EMPTY, slice_bytes(desc->shape) * (z_end - z_begin));
}

static void fill_full(const fm_scene_desc *desc, uint32_t z_begin, uint32_t z_end, uint8_t *out) {
    memset(out, FM_MATERIAL_STONE, slice_bytes(desc->shape) * (z_end - z_begin));
}

static void fill_single(const fm_scene_desc *desc, uint32_t z_begin, uint32_t z_end, uint8_t *out) {
    fill_empty(desc, z_begin, z_end, out);
    const uint32_t x = desc->shape.x / 2, y = desc->shape.y / 2, z = desc->shape.z / 2;
    if (z >= z_begin && z < z_end) {
        out[x + (uint64_t)desc->shape.x * (y + (uint64_t)desc->shape.y * (z - z_begin))] = FM_MATERIAL_STONE;
    }
}

static void fill_checker(const fm_scene_desc *desc, uint32_t z_begin, uint32_t z_end, uint8_t *out) {
    for (uint32_t z = z_begin; z < z_end; z++) {
        for (uint32_t y = 0; y < desc->shape.y; y++) {
            for (uint32_t x = 0; x < desc->shape.x; x++) {
                *out++ = (x + y + z) % 2 == 0 ? FM_MATERIAL_STONE : FM_MATERIAL_EMPTY;
            }
        }
    }
}

static void fill_sparse(const fm_scene_desc *desc, uint32_t z_begin, uint32_t z_end, uint8_t *out) {
    // Scaling by a power of two is exact, and so is the comparison.
    const uint64_t threshold = (uint64_t)((desc->density == 0 ? 0.001 : desc->density) * 4294967296.0);
    for (uint32_t z = z_begin; z < z_end; z++) {
        for (uint32_t y = 0; y < desc->shape.y; y++) {
            const uint64_t row = fm_hash_row(desc->seed, y, z);
            for (uint32_t x = 0; x < desc->shape.x; x++) {
                *out++ = (fm_hash_x(row, x) >> 32) < threshold ? FM_MATERIAL_STONE : FM_MATERIAL_EMPTY;
            }
        }
    }
}

static uint64_t squared_offset(uint32_t position, uint32_t extent) {
    int64_t doubled = 2 * (int64_t)position - ((int64_t)extent - 1);
    return (uint64_t)(doubled * doubled);
}

// A sphere around the middle whose diameter is 4/5 of the shortest axis: the voxels whose centres are less than half a voxel
// inside it or at most half outside. In half voxels, so that all is whole.
static void fill_shell(const fm_scene_desc *desc, uint32_t z_begin, uint32_t z_end, uint8_t *out) {
    const fm_shape shape = desc->shape;
    uint32_t shortest = shape.x < shape.y ? shape.x : shape.y;
    shortest = shape.z < shortest ? shape.z : shortest;
    const uint64_t radius = shortest < 2 ? 1 : (uint64_t)shortest * 4 / 5;
    const uint64_t inner = (radius - 1) * (radius - 1), outer = (radius + 1) * (radius + 1);
    for (uint32_t z = z_begin; z < z_end; z++) {
        for (uint32_t y = 0; y < shape.y; y++, out += shape.x) {
            const uint64_t yz = squared_offset(y, shape.y) + squared_offset(z, shape.z);
            if (yz >= outer) {
                memset(out, FM_MATERIAL_EMPTY, shape.x);
                continue;
            }
            for (uint32_t x = 0; x < shape.x; x++) {
                const uint64_t all = yz + squared_offset(x, shape.x);
                out[x] = all >= inner && all < outer ? FM_MATERIAL_STONE : FM_MATERIAL_EMPTY;
            }
        }
    }
}

enum { MENGER_LEVELS = 19 };  // 3^19 is the largest power below 2^31

// Bit k: the ternary digit k of the position is 1. The sponge has 3^levels cells an axis, stretched over the grid.
static uint32_t middle_digits(uint32_t position, uint32_t extent, uint32_t levels, uint64_t cells) {
    uint64_t cell = position * cells / extent;
    uint32_t digits = 0;
    for (uint32_t k = 0; k < levels; k++, cell /= 3) {
        digits |= (uint32_t)(cell % 3 == 1) << k;
    }
    return digits;
}

static void fill_menger(const fm_scene_desc *desc, uint32_t z_begin, uint32_t z_end, uint8_t *out) {
    enum { BLOCK = 1024 };
    const fm_shape shape = desc->shape;
    const uint32_t longest = fm_longest_axis(shape);
    uint32_t levels = 0;
    uint64_t cells = 1;
    while (levels < MENGER_LEVELS && cells * 3 <= longest) {
        cells *= 3;
        levels++;
    }
    uint32_t x_digits[BLOCK];
    for (uint32_t x0 = 0; x0 < shape.x; x0 += BLOCK) {
        const uint32_t count = shape.x - x0 < BLOCK ? shape.x - x0 : BLOCK;
        for (uint32_t i = 0; i < count; i++) {
            x_digits[i] = middle_digits(x0 + i, shape.x, levels, cells);
        }
        for (uint32_t z = z_begin; z < z_end; z++) {
            const uint32_t z_digits = middle_digits(z, shape.z, levels, cells);
            for (uint32_t y = 0; y < shape.y; y++) {
                const uint32_t y_digits = middle_digits(y, shape.y, levels, cells);
                const uint32_t either = y_digits | z_digits, both = y_digits & z_digits;
                uint8_t *row = out + (uint64_t)shape.x * (y + (uint64_t)shape.y * (z - z_begin)) + x0;
                for (uint32_t i = 0; i < count; i++) {
                    row[i] = ((x_digits[i] & either) | both) == 0 ? FM_MATERIAL_STONE : FM_MATERIAL_EMPTY;
                }
            }
        }
    }
}

static const fm_scene scenes[] = {
    {"terrain", "hills with caves, z up, about half solid, with materials", fm_fill_terrain},
    {"sparse", "single voxels strewn at a density", fill_sparse},
    {"shell", "a sphere shell one voxel thick", fill_shell},
    {"menger", "a Menger sponge, as deep as the grid resolves it", fill_menger},
    {"city", "houses and towers of boxes on a street grid, z up, with materials", fm_fill_city},
    {"checker", "every other voxel: the most changes that a grid can have", fill_checker},
    {"single", "one voxel in the middle", fill_single},
    {"empty", "nothing", fill_empty},
    {"full", "every voxel", fill_full},
};
enum { SCENE_COUNT = sizeof scenes / sizeof scenes[0] };

const fm_scene *fm_scene_at(uint32_t i) {
    return i < SCENE_COUNT ? &scenes[i] : NULL;
}

const fm_scene *fm_scene_find(const char *name) {
    for (uint32_t i = 0; i < SCENE_COUNT; i++) {
        if (strcmp(scenes[i].name, name) == 0) {
            return &scenes[i];
        }
    }
    return NULL;
}

const char *fm_scene_name(const fm_scene *scene) {
    return scene->name;
}

const char *fm_scene_summary(const fm_scene *scene) {
    return scene->summary;
}

void fm_scene_fill(const fm_scene *scene, const fm_scene_desc *desc, uint32_t z_begin, uint32_t z_end, uint8_t *out) {
    assert(z_begin <= z_end && z_end <= desc->shape.z && desc->density >= 0 && desc->density <= 1);
    scene->fill(desc, z_begin, z_end, out);
}

typedef struct fill_job {
    const fm_scene *scene;
    const fm_scene_desc *desc;
    uint32_t z_begin, z_end, step;
    uint8_t *out;
} fill_job;

static void fill_step(void *user, uint64_t i) {
    const fill_job *job = user;
    const uint32_t begin = job->z_begin + (uint32_t)i * job->step;
    const uint32_t end = job->z_end - begin < job->step ? job->z_end : begin + job->step;
    fm_scene_fill(job->scene, job->desc, begin, end, job->out + slice_bytes(job->desc->shape) * (begin - job->z_begin));
}

void fm_scene_fill_threads(const fm_scene *scene, const fm_scene_desc *desc, uint32_t z_begin, uint32_t z_end, uint32_t threads,
                           uint8_t *out) {
    enum { STEP = 8 };
    fill_job job = {scene, desc, z_begin, z_end, STEP, out};
    fm_parallel(threads, ((uint64_t)z_end - z_begin + STEP - 1) / STEP, fill_step, &job);
}

const uint8_t *fm_scene_palette(void) {
    static const uint8_t palette[1024] = {
        0,   0,   0,   0,    // empty
        130, 126, 122, 255,  // stone
        92,  90,  94,  255,  // dark stone
        121, 85,  58,  255,  // earth
        214, 196, 148, 255,  // sand
        92,  148, 66,  255,  // grass
        240, 244, 248, 255,  // snow
        58,  60,  66,  255,  // asphalt
        168, 166, 160, 255,  // pavement
        196, 120, 92,  255,  // facades
        214, 188, 142, 255, 160, 176, 188, 255, 226, 222, 210, 255, 140, 96,
        80,  255, 104, 128, 150, 255, 186, 160, 150, 255, 120, 116, 108, 255,
    };
    return palette;
}
