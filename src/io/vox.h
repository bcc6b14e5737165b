// SPDX-License-Identifier: MIT
#ifndef FM_VOX_H
#define FM_VOX_H

// MagicaVoxel scenes, from their bytes to placed models.

#include "io/file.h"

enum { FM_VOX_MAX_EDGE = 256, FM_VOX_PALETTE_BYTES = 1024 };

typedef struct fm_vox_model {
    uint32_t size[3];
    const uint8_t *voxels;  // x, y, z, colour index; `count` times
    uint32_t count;
} fm_vox_model;

// A turn by quarters, with mirrors: row i of the matrix is `sign[i]` in column `column[i]` and 0 elsewhere.
typedef struct fm_vox_turn {
    uint8_t column[3];
    int8_t sign[3];
} fm_vox_turn;

typedef struct fm_vox_place {
    uint32_t model;
    fm_vox_turn turn;
    int64_t move[3];   // of the model's pivot
    int64_t low[3];    // lowest corner of its box in the scene
    uint32_t size[3];  // of its box in the scene
} fm_vox_place;

typedef struct fm_vox_node {
    uint32_t id;
    char kind;            // 'T'ransform, 'G'roup or 'S'hape
    bool open;            // between being entered and left
    const uint8_t *body;  // behind the id
    uint64_t size;
} fm_vox_node;

typedef struct fm_vox_scene {
    uint8_t *bytes;  // the file
    uint64_t size;
    fm_vox_model *models;
    fm_vox_node *nodes;  // by rising id
    uint32_t *hidden_layers;
    fm_vox_place *places;
    uint32_t model_count, node_count, hidden_layer_count, place_count;
    uint32_t model_capacity, node_capacity, hidden_layer_capacity, place_capacity;
    uint32_t hidden_places;
    uint64_t work;
    const uint8_t *colors;  // RGBA of indices 1 to 255; NULL: the default palette
} fm_vox_scene;

// Finds the models, the nodes, the layers and the palette. The scene refers to the bytes.
fm_result fm_vox_parse(fm_reader *reader, fm_vox_scene *scene);
// Walks the nodes and lists what is placed.
fm_result fm_vox_walk(fm_reader *reader, fm_vox_scene *scene);
void fm_vox_free(const fm_allocator *allocator, fm_vox_scene *scene);

// Where a model's voxel lies in the scene.
static inline void fm_vox_position(const fm_vox_place *place, const uint32_t model_size[3], const uint8_t voxel[3],
                                   int64_t position[3]) {
    for (int i = 0; i < 3; i++) {
        int column = place->turn.column[i];
        int64_t offset = (int64_t)voxel[column] - model_size[column] / 2;
        // A cell [v, v + 1) that is mirrored becomes (-v - 1, -v].
        position[i] = place->move[i] + (place->turn.sign[i] < 0 ? -offset - 1 : offset);
    }
}

// MagicaVoxel's palette for files that have none.
void fm_vox_default_palette(uint8_t palette[FM_VOX_PALETTE_BYTES]);

fm_result fm_vox_write(fm_writer *writer);

#endif
