// SPDX-License-Identifier: MIT
#ifndef FM_OCTREE_PICTURE_H
#define FM_OCTREE_PICTURE_H

// A renderer of octrees as its parts see it. octree_picture.c checks arguments and makes a picture's constants;
// host_octree_picture.c and gpu_octree_picture.c go through the same steps with the same text
// (shaders/include/octree_pixel_rule.h).

#include "octree/octree.h"
#include "render/octree_stream.h"
#include "shaders/include/octree_picture_shared.h"

typedef struct fm_gpu_octree_renderer fm_gpu_octree_renderer;

// A picture on the CPU.
typedef struct fm_octree_room {
    fm_octree_pixel *pixels;
    uint32_t (*seconds)[2], (*beams)[2];  // seconds NULL where no picture has counted any
    uint32_t *picture;
    uint64_t count, tiles;  // pixels and tiles that there is room for
} fm_octree_room;

struct fm_octree_renderer {
    fm_context *context;
    fm_gpu_octree_renderer *gpu;  // NULL on the CPU
    fm_octree_room room;          // CPU
    uint32_t width, height;       // of the newest picture; 0: there is none
    bool counted;                 // statistics of the newest picture are asked for, ...
    bool has_seconds, has_beams;  // ... which has second rays, beams
};

// A picture that has been checked. The addresses in `scene`, but for the grid's, are the backend's.
typedef struct fm_octree_picture {
    fm_octree_render_desc desc;
    fm_octree *octree;  // the one, or the coarse one
    fm_octree_scene scene;
    bool beams, second;
} fm_octree_picture;

fm_result fm_host_octree_picture(fm_octree_renderer *renderer, fm_octree_picture *picture);
void fm_host_octree_picture_destroy(fm_octree_renderer *renderer);

fm_result fm_gpu_octree_picture_create(fm_octree_renderer *renderer);
void fm_gpu_octree_picture_destroy(fm_octree_renderer *renderer);
// The picture before stays where submitting fails.
fm_result fm_gpu_octree_picture(fm_octree_renderer *renderer, fm_octree_picture *picture, fm_ticket *ticket);
fm_result fm_gpu_octree_picture_read(fm_octree_renderer *renderer, uint8_t *pixels);
void fm_gpu_octree_picture_describe(const fm_octree_renderer *renderer, fm_volume_buffer *buffer);
// What the newest picture's pixels hold, and its second rays and beams; NULL is fine. Memory for as many as it has.
fm_result fm_gpu_octree_picture_words(fm_octree_renderer *renderer, fm_octree_pixel *pixels, uint32_t (*seconds)[2],
                                      uint32_t (*beams)[2]);

#endif
