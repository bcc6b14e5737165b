// SPDX-License-Identifier: MIT
#ifndef FM_HOST_SHADE_H
#define FM_HOST_SHADE_H

#include "render/host_march.h"

// What a pixel is made from.
typedef struct fm_scenery {
    fm_grid grid;
    const fm_picture *picture;
    const uint32_t *map;
} fm_scenery;

// Field reads for a pixel's light.
typedef struct fm_light_reads {
    uint32_t sun, open;
} fm_light_reads;

// What a ray meets.
typedef struct fm_hit {
    fm_cell voxel, normal;  // normal 0: the ray begins in the voxel
    fm_vec3 at;
    float time;
} fm_hit;

fm_hit fm_hit_of(const fm_ray *ray, const fm_vec3 *cell);

// Light adds up in squares of what is stored.
fm_vec3 fm_light_of_map(const uint32_t map[256], float part);
fm_vec3 fm_sky_light(const fm_march_push *push, const float way[3]);
fm_vec3 fm_surface_light(const fm_scenery *scenery, const fm_hit *hit, fm_light_reads *reads);
// The field at a place on the slice; `width` of a line, in voxels.
fm_vec3 fm_slice_light(const fm_scenery *scenery, const float at[3], float width);
uint32_t fm_pack_light(fm_vec3 light);

#endif
