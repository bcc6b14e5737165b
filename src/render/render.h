// SPDX-License-Identifier: MIT
#ifndef FM_RENDER_H
#define FM_RENDER_H

// A renderer as its parts see it. render.c checks arguments and turns a descriptor into a picture's constants, camera.c those of
// its rays; host_render.c and gpu_render.c make the picture from these, with the same arithmetic.

#include "fathom/render.h"
#include "shaders/include/render_shared.h"
#include "world/world.h"

enum { FM_MAX_PIXELS = 16384 };

typedef struct fm_gpu_render fm_gpu_render;

struct fm_renderer {
    fm_context *context;
    fm_gpu_render *gpu;      // NULL on the CPU
    uint32_t width, height;  // of the newest picture; 0: there is none
    bool counted;            // `stats` are asked for
    fm_render_stats stats;   // of the newest counted picture; the Vulkan backend fills it in when asked
    bool picked;             // CPU: there is a pick
    fm_pick pick;            // CPU: the newest
    uint32_t *pixels;        // CPU
    uint64_t pixel_bytes;
    uint32_t map[256];  // colours of a number from 0 to 255: RGBA, red in the lowest byte
};

// A picture that has been checked. The addresses of `push` are the backend's.
typedef struct fm_picture {
    fm_render_desc desc;
    fm_march_push push;
    fm_gpu_brush brush;
    bool preview;
    bool beams;  // rays begin where the beam of their tile ends
} fm_picture;

// camera.c
fm_result fm_camera_check(const fm_camera *camera);
// The same of a camera whose places are not voxels: at most `farthest` from 0 along each axis.
fm_result fm_camera_check_within(const fm_camera *camera, float farthest);
bool fm_all_finite(const float v[3]);
void fm_cross_product(const double a[3], const double b[3], double out[3]);
// Of `push`: origin, corner, right, down.
void fm_camera_rays(const fm_render_desc *desc, fm_march_push *push);
// Of length 1; the default where `sun` is 0.
void fm_sun_way(const float sun[3], float way[3]);

// The way of the ray of a place in the picture.
static inline void fm_pixel_way(const fm_march_push *push, float x, float y, float way[3]) {
    for (int i = 0; i < 3; i++) {
        way[i] = (push->corner[i] + push->right[i] * x) + push->down[i] * y;
    }
}

fm_result fm_host_render(fm_renderer *renderer, const fm_world *world, const fm_picture *picture);
void fm_host_pick(const fm_world *world, const fm_picture *picture, const float way[3], fm_pick *pick);

fm_result fm_gpu_render_create(fm_renderer *renderer);
void fm_gpu_render_destroy(fm_renderer *renderer);
// Submits; renderer->width and height are those of the picture before, and stay so where it fails.
fm_result fm_gpu_render_picture(fm_renderer *renderer, const fm_world *world, const fm_picture *picture, fm_ticket *ticket);
// Along the ray from `picture`'s camera on `way`.
fm_result fm_gpu_pick_begin(fm_renderer *renderer, const fm_world *world, const fm_picture *picture, const float way[3],
                            fm_ticket *ticket);
fm_result fm_gpu_pick_end(fm_renderer *renderer, fm_ticket ticket, fm_pick *pick);
fm_result fm_gpu_render_read(fm_renderer *renderer, uint8_t *pixels);
void fm_gpu_render_describe(const fm_renderer *renderer, fm_volume_buffer *buffer);
fm_result fm_gpu_render_stats(fm_renderer *renderer);

#endif
