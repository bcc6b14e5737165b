// SPDX-License-Identifier: MIT
#ifndef FM_SCENES_FILL_H
#define FM_SCENES_FILL_H

// The scenes that need a file of their own, and the materials that scenes share.

#include "scenes.h"

typedef enum fm_material {
    FM_MATERIAL_EMPTY = 0,
    FM_MATERIAL_STONE,
    FM_MATERIAL_DARK_STONE,
    FM_MATERIAL_EARTH,
    FM_MATERIAL_SAND,
    FM_MATERIAL_GRASS,
    FM_MATERIAL_SNOW,
    FM_MATERIAL_ASPHALT,
    FM_MATERIAL_PAVEMENT,
    FM_MATERIAL_FACADE,  // the first of FM_FACADES
    FM_MATERIAL_COUNT = FM_MATERIAL_FACADE + 8
} fm_material;

enum { FM_FACADES = FM_MATERIAL_COUNT - FM_MATERIAL_FACADE };

void fm_fill_terrain(const fm_scene_desc *desc, uint32_t z_begin, uint32_t z_end, uint8_t *out);
void fm_fill_city(const fm_scene_desc *desc, uint32_t z_begin, uint32_t z_end, uint8_t *out);

static inline uint32_t fm_longest_axis(fm_shape shape) {
    uint32_t longest = shape.x > shape.y ? shape.x : shape.y;
    return longest > shape.z ? longest : shape.z;
}

#endif
