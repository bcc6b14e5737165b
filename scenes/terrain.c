// SPDX-License-Identifier: MIT
// Hills of fractal noise, z up, with caves where two further noises are both near their middle: the places where two such bands
// cross are winding tunnels. Lengths scale with the grid, so that a bigger grid shows the same kind of land in more detail.

#include "fill.h"
#include "noise.h"

enum {
    LOWEST = 23000,  // of the ground, in 65,536ths of the grid's height
    RELIEF = 43000,  // from the lowest to the highest ground
    TUNNEL = 5200,   // half the width of the noise bands whose crossing is a tunnel
};

typedef struct land {
    const fm_scene_desc *desc;
    fm_noise hills, tunnel_a, tunnel_b;
    uint32_t shore, snow;  // heights between which grass grows
} land;

// Smallest shift whose cells are at least `length` long, but no smaller than `least`.
static uint32_t shift_of(uint32_t length, uint32_t least) {
    uint32_t shift = least;
    while (shift < 23 && (1u << shift) < length) {
        shift++;
    }
    return shift;
}

static uint32_t scaled(uint32_t extent, uint64_t part) {
    return (uint32_t)((extent * part + FM_NOISE_RANGE / 2) / FM_NOISE_RANGE);
}

static uint8_t material(const land *here, uint32_t ground, uint32_t z, uint32_t tunnel) {
    uint32_t depth = ground - 1 - z;
    if (depth == 0) {
        return ground < here->shore ? FM_MATERIAL_SAND : ground > here->snow ? FM_MATERIAL_SNOW : FM_MATERIAL_GRASS;
    }
    if (depth < 4) {
        return FM_MATERIAL_EARTH;
    }
    return tunnel < FM_NOISE_RANGE / 2 ? FM_MATERIAL_STONE : FM_MATERIAL_DARK_STONE;
}

static uint32_t from_middle(uint32_t noise) {
    return noise < FM_NOISE_RANGE / 2 ? FM_NOISE_RANGE / 2 - noise : noise - FM_NOISE_RANGE / 2;
}

static void fill_block(const land *here, uint32_t x0, uint32_t count, uint32_t y, uint32_t z_begin, uint32_t z_end, uint8_t *out) {
    const fm_shape shape = here->desc->shape;
    uint32_t ground[FM_NOISE_BLOCK], a[FM_NOISE_BLOCK], b[FM_NOISE_BLOCK];
    uint32_t highest = 0;
    fm_noise_row(&here->hills, x0, y, 0, count, ground);
    for (uint32_t i = 0; i < count; i++) {
        ground[i] = scaled(shape.z, LOWEST + ((uint64_t)ground[i] * RELIEF >> 16));
        highest = ground[i] > highest ? ground[i] : highest;
    }
    for (uint32_t z = z_begin; z < z_end; z++) {
        uint8_t *row = out + (uint64_t)shape.x * (y + (uint64_t)shape.y * (z - z_begin)) + x0;
        if (z < highest) {
            fm_noise_row(&here->tunnel_a, x0, y, z, count, a);
            fm_noise_row(&here->tunnel_b, x0, y, z, count, b);
        }
        for (uint32_t i = 0; i < count; i++) {
            bool solid = z < ground[i] && (from_middle(a[i]) > TUNNEL || from_middle(b[i]) > TUNNEL);
            row[i] = solid ? material(here, ground[i], z, a[i]) : FM_MATERIAL_EMPTY;
        }
    }
}

void fm_fill_terrain(const fm_scene_desc *desc, uint32_t z_begin, uint32_t z_end, uint8_t *out) {
    const uint32_t longest = fm_longest_axis(desc->shape);
    const land here = {
        .desc = desc,
        .hills = {fm_mix(desc->seed), shift_of(longest / 3, 6), 5},
        .tunnel_a = {fm_mix(desc->seed + 1), shift_of(longest / 12, 3), 2},
        .tunnel_b = {fm_mix(desc->seed + 2), shift_of(longest / 12, 3), 2},
        .shore = scaled(desc->shape.z, LOWEST + RELIEF * 35 / 100),
        .snow = scaled(desc->shape.z, LOWEST + RELIEF * 62 / 100),
    };
    for (uint32_t y = 0; y < desc->shape.y; y++) {
        for (uint32_t x = 0; x < desc->shape.x; x += FM_NOISE_BLOCK) {
            uint32_t left = desc->shape.x - x;
            fill_block(&here, x, left < FM_NOISE_BLOCK ? left : FM_NOISE_BLOCK, y, z_begin, z_end, out);
        }
    }
}
