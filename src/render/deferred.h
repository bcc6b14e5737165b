// SPDX-License-Identifier: MIT
#ifndef FM_DEFERRED_H
#define FM_DEFERRED_H

// A deferred renderer as its parts see it. deferred.c checks arguments and makes a picture's constants; host_deferred.c and
// gpu_deferred.c go through the same steps with the same text (shaders/include/defer_pixel.h).

#include "fathom/deferred.h"
#include "shaders/include/defer_shared.h"
#include "volume/volume.h"

typedef struct fm_gpu_deferred fm_gpu_deferred;

// Memory of a picture on the CPU.
typedef struct fm_deferred_room {
    fm_defer_surface *surfaces;
    float *light, *history[2], *map, *blurred;
    uint32_t *picture;
    uint64_t pixels, texels;  // that there is room for
} fm_deferred_room;

struct fm_deferred {
    fm_context *context;
    fm_gpu_deferred *gpu;    // NULL on the CPU
    fm_deferred_room room;   // CPU
    uint32_t width, height;  // of the newest picture; 0: there is none
    bool has_history;        // the newest picture was one to blend with
    uint32_t history;        // which of the two histories it wrote
    fm_defer_scene newest;   // its constants
};

// A picture that has been checked. The addresses in `scene`, but for the field's on the CPU, are the backend's.
typedef struct fm_deferred_picture {
    fm_deferred_desc desc;
    fm_defer_scene scene;
} fm_deferred_picture;

// deferred_view.c: what of `scene` follows from the camera, and the shadow map's cascades.
void fm_deferred_camera(const fm_deferred *deferred, fm_deferred_picture *picture);
void fm_deferred_cascades(fm_deferred_picture *picture, const float low[3], const float high[3]);

fm_result fm_host_deferred(fm_deferred *deferred, fm_deferred_picture *picture);
void fm_host_deferred_destroy(fm_deferred *deferred);

fm_result fm_gpu_deferred_create(fm_deferred *deferred);
void fm_gpu_deferred_destroy(fm_deferred *deferred);
// The picture before stays where submitting fails.
fm_result fm_gpu_deferred_picture(fm_deferred *deferred, fm_deferred_picture *picture, fm_ticket *ticket);
fm_result fm_gpu_deferred_read(fm_deferred *deferred, uint8_t *pixels);
void fm_gpu_deferred_describe(const fm_deferred *deferred, fm_volume_buffer *buffer);
// What the newest picture's surfaces and lights are, in memory of as many elements as it has pixels (four floats a light).
fm_result fm_gpu_deferred_surfaces(fm_deferred *deferred, fm_defer_surface *surfaces);
fm_result fm_gpu_deferred_lights(fm_deferred *deferred, float *light);

#endif
