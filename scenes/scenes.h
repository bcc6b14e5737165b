// SPDX-License-Identifier: MIT
#ifndef FM_SCENES_H
#define FM_SCENES_H

// Deterministic procedural scenes for tests, benchmarks, programs and pictures. A scene is a pure function of its parameters and
// the voxel's position, in integers only, so that it has the same bits on every machine, compiler and number of threads, and any
// range of slices can be made alone.

#include "fathom/fathom.h"

typedef struct fm_scene fm_scene;

typedef struct fm_scene_desc {
    fm_shape shape;  // every axis 1 to 2^31 - 1
    uint64_t seed;
    double density;  // "sparse" only: the chance of a voxel to be solid, above 0 and at most 1; 0: 0.001
} fm_scene_desc;

// The scene called `name`, or NULL.
const fm_scene *fm_scene_find(const char *name);

// Scene number `i` in the order of listings, or NULL past the last one.
const fm_scene *fm_scene_at(uint32_t i);

const char *fm_scene_name(const fm_scene *scene);
// One line on what it shows.
const char *fm_scene_summary(const fm_scene *scene);

// Writes the slices z_begin <= z < z_end, X * Y * (z_end - z_begin) bytes, x fastest: 0 is empty, another value is the material
// of a solid voxel and an index into fm_scene_palette. Thread-safe.
void fm_scene_fill(const fm_scene *scene, const fm_scene_desc *desc, uint32_t z_begin, uint32_t z_end, uint8_t *out);

// The same on `threads` threads (0: one a logical processor), with the same result.
void fm_scene_fill_threads(const fm_scene *scene, const fm_scene_desc *desc, uint32_t z_begin, uint32_t z_end, uint32_t threads,
                           uint8_t *out);

// 256 RGBA colours, 1,024 bytes: what the materials look like. Colour 0 is transparent.
const uint8_t *fm_scene_palette(void);

#endif
