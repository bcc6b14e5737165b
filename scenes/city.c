// SPDX-License-Identifier: MIT
// A flat town of square lots with streets between them, z up. A lot holds up to three boxes on top of each other, or a park.

#include "fill.h"
#include "noise.h"

#include <string.h>

typedef struct box {
    uint32_t x0, x1, y0, y1, top;  // within the lot; the box reaches from the ground up to `top`
} box;

typedef struct lot {
    box boxes[3];
    uint32_t count;
    uint8_t material;
} lot;

// Uniform in 0 to `range` - 1.
static uint32_t draw(uint64_t *state, uint32_t range) {
    *state = fm_mix(*state + 0x9e3779b97f4a7c15u);
    return (uint32_t)(((*state >> 32) * range) >> 32);
}

static lot lot_at(const fm_scene_desc *desc, uint32_t size, uint32_t lot_x, uint32_t lot_y) {
    uint64_t state = fm_hash_x(fm_hash_row(fm_mix(desc->seed), lot_y, 0), lot_x);
    lot result = {.count = 0, .material = (uint8_t)(FM_MATERIAL_FACADE + draw(&state, FM_FACADES))};
    if (draw(&state, 8) == 0) {
        return result;
    }
    const uint32_t height = desc->shape.z;
    uint32_t margin = 1 + size / 8;
    // The smaller of two draws: most houses are low, few are towers.
    uint32_t first = draw(&state, height), second = draw(&state, height);
    uint32_t top = height / 16 + (first < second ? first : second) * 3 / 4;
    const uint32_t stories = 1 + draw(&state, 3);
    while (result.count < stories && size > 2 * margin + 1 && top < height) {
        uint32_t shift = draw(&state, margin);
        result.boxes[result.count++] = (box){margin - shift / 2, size - margin, margin, size - margin + shift / 2, top};
        margin += 1 + draw(&state, 1 + size / 6);
        top += 1 + draw(&state, 1 + height / 6);
    }
    return result;
}

static void fill_lot_row(const lot *here, uint32_t size, uint32_t y, uint32_t z, uint8_t *row, uint32_t left) {
    for (uint32_t i = 0; i < here->count; i++) {
        const box *b = &here->boxes[i];
        if (z <= b->top && y >= b->y0 && y < b->y1 && b->x0 < left) {
            memset(row + b->x0, here->material, (b->x1 < left ? b->x1 : left) - b->x0);
        }
    }
    if (z == 0) {
        uint32_t walk = 1 + size / 16;
        for (uint32_t x = 0; x < size && x < left; x++) {
            bool street = x < walk || y < walk || x >= size - walk || y >= size - walk;
            row[x] = row[x] ? row[x] : street ? FM_MATERIAL_ASPHALT : here->count ? FM_MATERIAL_PAVEMENT : FM_MATERIAL_GRASS;
        }
    }
}

void fm_fill_city(const fm_scene_desc *desc, uint32_t z_begin, uint32_t z_end, uint8_t *out) {
    const fm_shape shape = desc->shape;
    const uint32_t tenth = fm_longest_axis(shape) / 10;
    const uint32_t size = tenth < 8 ? 8 : tenth > 64 ? 64 : tenth;
    memset(out, FM_MATERIAL_EMPTY, (uint64_t)shape.x * shape.y * (z_end - z_begin));
    for (uint32_t y0 = 0; y0 < shape.y; y0 += size) {
        for (uint32_t x0 = 0; x0 < shape.x; x0 += size) {
            const lot here = lot_at(desc, size, x0 / size, y0 / size);
            for (uint32_t z = z_begin; z < z_end; z++) {
                for (uint32_t y = 0; y < size && y < shape.y - y0; y++) {
                    uint8_t *row = out + (uint64_t)shape.x * (y0 + y + (uint64_t)shape.y * (z - z_begin)) + x0;
                    fill_lot_row(&here, size, y, z, row, shape.x - x0);
                }
            }
        }
    }
}
