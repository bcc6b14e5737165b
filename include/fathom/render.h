// SPDX-License-Identifier: MIT
#ifndef FATHOM_RENDER_H
#define FATHOM_RENDER_H

// Pictures of an editable world (world.h) by ray marching its distance field. The conventions of fathom.h hold here too.

#include "fathom/world.h"

#ifdef __cplusplus
extern "C" {
#endif

// Positions farther out are too coarse in floats to tell the voxels that a ray passes.
enum { FM_CAMERA_FARTHEST = 1 << 19 };

// A pinhole camera in voxel units: voxel (x, y, z) fills the cube from (x, y, z) - 0.5 to + 0.5. z points up in the scenes of this
// project; `up` need not be at right angles to the view.
typedef struct fm_camera {
    float position[3];  // each within FM_CAMERA_FARTHEST voxels of 0
    float forward[3];   // any length above 0
    float up[3];        // all 0: 0, 0, 1
    float fov_y;        // full vertical angle in degrees, above 0 and below 180; 0: 60
} fm_camera;

// How a ray from the camera finds the first solid voxel on its way. All three give the same picture, pixel for pixel, on exact
// fields. Rays towards the sun always go by FM_MARCH_SKIP.
typedef enum fm_march {
    // Reads the field and goes as many voxels as the Manhattan distance allows before it reads again; never over a solid voxel.
    FM_MARCH_SKIP = 0,
    // Leaves the largest box around the voxel that the distance vouches for: edge 2 floor((d - 1) / 3) + 1.
    FM_MARCH_BOX,
    // Voxel by voxel from the site bits, without a field. Source of all three: Amanatides and Woo 1987, "A fast voxel traversal
    // algorithm for ray tracing".
    FM_MARCH_PLAIN,
} fm_march;

typedef enum fm_shadow { FM_SHADOW_NONE = 0, FM_SHADOW_HARD, FM_SHADOW_SOFT } fm_shadow;

typedef enum fm_view {
    FM_VIEW_COLOR = 0,   // the voxel's colour, shaded by its face's normal; the sky where nothing is hit
    FM_VIEW_STEPS,       // field reads a ray, as a heat map
    FM_VIEW_NORMAL,      // faces by direction
    FM_VIEW_DISTANCE,    // how far the ray went
    FM_VIEW_SLICE,       // the field itself on the plane `slice_axis` = `slice_index`, a line at each multiple of 8 voxels, solid
                         // voxels in their colours, and what stands behind it: all before the plane is cut away
    FM_VIEW_DIFFERENCE,  // grey picture of FM_MARCH_PLAIN; red where this march shows something else
} fm_view;

typedef struct fm_render_desc {
    fm_camera camera;
    uint32_t width, height;  // pixels, 1 to 16384
    fm_march march;
    fm_view view;
    fm_shadow shadow;
    bool ambient_occlusion;  // from the field, along the face's normal
    float sun[3];            // towards the sun; all 0: a pleasant default
    uint32_t slice_axis;     // FM_VIEW_SLICE: 0 x, 1 y, 2 z
    int32_t slice_index;     // ... a slice of the world
    // Solid voxels that the brush covers are tinted, the outermost of them more so. NULL: none. Read during the call.
    const fm_brush *preview;
    bool crosshair;
    bool count;  // gather the statistics, which costs a little
} fm_render_desc;

// Sums over the newest picture rendered with `count`. A read is that of one entry of the field, or of a word of site bits for the
// steps of FM_MARCH_PLAIN.
typedef struct fm_render_stats {
    uint64_t rays;             // primary ones
    uint64_t hits;             // primary rays that reached a solid voxel
    uint64_t steps;            // reads of primary rays, without those of the beams that they start from
    uint64_t most_steps;       // of one primary ray
    uint64_t beam_reads;       // of the beams, one for 8 x 8 pixels
    uint64_t sun_reads;        // of rays towards the sun
    uint64_t occlusion_reads;  // of ambient occlusion
    uint64_t wrong;            // FM_VIEW_DIFFERENCE: pixels that show another voxel or face than FM_MARCH_PLAIN, or the sky
} fm_render_stats;

// Renders into memory of its own. Same thread rule as its context.
typedef struct fm_renderer fm_renderer;

// Errors: FM_ERROR_INVALID_ARGUMENT for NULL, FM_ERROR_OUT_OF_HOST_MEMORY, FM_ERROR_OUT_OF_DEVICE_MEMORY, FM_ERROR_DEVICE_LOST,
// FM_ERROR_INTERNAL when the driver fails.
FM_API fm_result fm_renderer_create(fm_context *context, fm_renderer **renderer);
FM_API void fm_renderer_destroy(fm_renderer *renderer);  // waits for the work in flight; NULL is ignored

// Renders a world as it is after its newest update, whatever its format, borders and exactness; asynchronous on Vulkan, complete at
// `ticket` (NULL: waits); but a picture of another size than the one before waits for the context's earlier work, whose memory
// goes, and at most three pictures are in flight: the fourth waits for the first. The world belongs to the renderer's context;
// before its first update it shows air. All voxels nearer to a voxel than its Manhattan distance are air, and so are those nearer
// than its Euclidean distance rounded up, for the Manhattan distance is never the smaller one: so FM_FIELD_SQUARED_U32 is marched
// by the root, rounded up. FM_MARCH_SKIP begins with beams: how far all rays of 8 x 8 pixels can go at once; not for
// FM_VIEW_DIFFERENCE, nor where the world's method may give distances that are too great. Passes: "beam" (Vulkan; part of "march"
// on the CPU) and "march". Errors: FM_ERROR_INVALID_ARGUMENT, also for NULL but for `ticket`; FM_ERROR_OUT_OF_DEVICE_MEMORY,
// FM_ERROR_OUT_OF_HOST_MEMORY, FM_ERROR_DEVICE_LOST; FM_ERROR_INTERNAL when the driver fails. The picture before stays the newest
// unless the wait for this one is what failed.
FM_API fm_result fm_render(fm_renderer *renderer, fm_world *world, const fm_render_desc *desc, fm_ticket *ticket);

// Copies the newest picture: `width` * `height` RGBA pixels of 8 bits each (sRGB, opaque), top row first. Waits for it. Errors:
// FM_ERROR_INVALID_ARGUMENT for NULL and before the first picture; FM_ERROR_OUT_OF_HOST_MEMORY and FM_ERROR_OUT_OF_DEVICE_MEMORY
// where the device's memory cannot be mapped, for what the pixels go through; FM_ERROR_DEVICE_LOST; FM_ERROR_INTERNAL when the
// driver fails.
FM_API fm_result fm_renderer_read(fm_renderer *renderer, uint8_t *pixels);
// The picture's buffer, RGBA8 as above, valid until the next fm_render of another size or the renderer's end. Does not wait: what
// reads it waits for fm_render's ticket, on the host or by the timeline of fm_context_vulkan. The next fm_render of the same size
// overwrites it, and asks no reader: by then reads must be complete, or be those of compute shaders and copies that were submitted
// to the context's own queue before, after which the library's work comes.
// Errors: FM_ERROR_INVALID_ARGUMENT for NULL and before the first picture, FM_ERROR_UNSUPPORTED on the CPU.
FM_API fm_result fm_renderer_vulkan(const fm_renderer *renderer, fm_volume_buffer *buffer);
// Waits for the newest picture that was counted. Errors: FM_ERROR_INVALID_ARGUMENT for NULL and before the first such picture;
// FM_ERROR_DEVICE_LOST; FM_ERROR_INTERNAL when the driver fails.
FM_API fm_result fm_renderer_stats(fm_renderer *renderer, fm_render_stats *stats);

// What is under a place in the picture (whole numbers are the pixels' centres): the first solid voxel on its ray and the axis of
// the face, signed (-x is -1, +z is 3); for placing and deleting with the mouse. Of `desc` camera, size and march matter. Marches
// one ray on the device or CPU and waits; the newest picture stays as it is. Pass: "pick". `hit` false: nothing is there, and the
// other members are 0.
typedef struct fm_pick {
    bool hit;
    int32_t voxel[3];
    int32_t face;    // -3 ... -1, 1 ... 3: outward normal; 0 when the camera is inside the voxel
    float distance;  // from the camera to the face, in voxels
} fm_pick;
// Errors: FM_ERROR_INVALID_ARGUMENT for NULL, for what fm_render refuses, and for places beyond 16384 pixels from the first;
// FM_ERROR_OUT_OF_HOST_MEMORY, FM_ERROR_DEVICE_LOST, FM_ERROR_INTERNAL when the driver fails. `pick` is not written then.
FM_API fm_result fm_render_pick(fm_renderer *renderer, fm_world *world, const fm_render_desc *desc, float pixel_x, float pixel_y,
                                fm_pick *pick);

// The same in two halves, for programs that wait for nothing between frames: the first asks, asynchronous on Vulkan and complete at
// `ticket`; the second gives the answer, and waits unless fm_poll says that it is there. The newest three questions keep theirs;
// the CPU backend keeps that of the newest, whatever the ticket. Errors: as above; FM_ERROR_INVALID_ARGUMENT also for a ticket
// whose answer is not kept.
FM_API fm_result fm_render_pick_begin(fm_renderer *renderer, fm_world *world, const fm_render_desc *desc, float pixel_x,
                                      float pixel_y, fm_ticket *ticket);
FM_API fm_result fm_render_pick_end(fm_renderer *renderer, fm_ticket ticket, fm_pick *pick);

#ifdef __cplusplus
}
#endif

#endif
