// SPDX-License-Identifier: MIT
#ifndef FATHOM_OCTREE_RENDER_H
#define FATHOM_OCTREE_RENDER_H

// Pictures of octrees (octree.h), also of such as do not fit into memory. The conventions of fathom.h hold here too.

#include "fathom/octree.h"
#include "fathom/render.h"

#ifdef __cplusplus
extern "C" {
#endif

// ---------------------------------------------------------------------------------------------------------------------------
// Octrees larger than memory
// ---------------------------------------------------------------------------------------------------------------------------

typedef struct fm_octree_stream fm_octree_stream;

typedef struct fm_octree_stream_desc {
    uint64_t budget;  // bytes of device memory (CPU backend: of host memory) for all octrees; 0: 256 MiB
    float distance;   // from the camera within which parts are refined; 0: a quarter of the box's diagonal
    float fade_ms;    // how long a part takes to appear and to go; 0: 250; below 0: at once
} fm_octree_stream_desc;

typedef struct fm_octree_stream_info {
    uint32_t parts, resident, wanted;  // wanted: seen by the newest picture and within the distance
    uint64_t bytes, budget;
    uint64_t loaded, dropped;  // so far
    uint64_t failed;           // reads that failed: those parts stay coarse
    char failure[256];         // the newest
} fm_octree_stream_info;

// Opens such a file. Parts are loaded by a thread of the stream's own, those first that rays meet early. Same thread rule as its
// context. Errors: as fm_octree_read; FM_ERROR_INVALID_ARGUMENT for a budget that does not hold the coarse octree.
FM_API fm_result fm_octree_stream_open(fm_context *context, const char *path, const fm_octree_stream_desc *desc,
                                       fm_octree_stream **stream);
FM_API void fm_octree_stream_close(fm_octree_stream *stream);
// Asks which parts the camera's rays meet (24 x 16 of them), takes over what has been loaded, and drops what is least wanted. Call
// before each picture. Never waits for the disk; with `wait`, until everything wanted is there or has failed.
FM_API fm_result fm_octree_stream_update(fm_octree_stream *stream, const fm_camera *camera, bool wait);
FM_API void fm_octree_stream_describe(const fm_octree_stream *stream, fm_octree_stream_info *info);

// ---------------------------------------------------------------------------------------------------------------------------
// Pictures
// ---------------------------------------------------------------------------------------------------------------------------

typedef enum fm_octree_picture_view {
    FM_OCTREE_SHADED = 0,
    FM_OCTREE_NORMALS,
    FM_OCTREE_READS,   // of memory by each ray, as a heat map
    FM_OCTREE_LEVELS,  // the level of the leaf that was hit
} fm_octree_picture_view;

typedef struct fm_octree_render_desc {
    fm_camera camera;        // in world units
    uint32_t width, height;  // pixels, 1 to 16384
    fm_octree_picture_view view;
    fm_octree *octree;
    fm_octree_stream *stream;  // not NULL: takes the place of `octree`
    float epsilon;             // as fm_octree_cast, at most 8 in size; of a stream's parts in their own cells
    float sun[3];              // towards the sun; all 0: that of fm_render_desc
    bool shadow;               // a ray to the sun from each place that is seen
    float reflection;          // 0 to 1: part of the light that comes by a reflected ray
    float refraction;          // 0: opaque; above 1 to 8: refractive index of the surface's inside, which is clear
    bool count;                // gather the statistics, which costs memory and a little time
} fm_octree_render_desc;

typedef struct fm_octree_render_stats {
    uint64_t rays, hits, reads, most_reads;  // primary; a read is that of a node or of a leaf's values
    uint64_t beam_reads;                     // for all rays of 8 x 8 pixels together, before these begin
    uint64_t second_rays, second_reads;      // to the sun, reflected and refracted
} fm_octree_render_stats;

// Renders into memory of its own. Same thread rule as its context.
typedef struct fm_octree_renderer fm_octree_renderer;

FM_API fm_result fm_octree_renderer_create(fm_context *context, fm_octree_renderer **renderer);
FM_API void fm_octree_renderer_destroy(fm_octree_renderer *renderer);
// Asynchronous on Vulkan, complete at `ticket` (NULL: waits). Passes: "beams" where the kind has bounds for them (CLOSEST,
// DISTANCE, VOXELS, BRICKS), "primary", "second" where there are secondary rays. Of a clear surface reflection and refraction
// follow from the angle (Fresnel); its rays are followed through both interfaces, and their colour is that of the sky or of what is
// lit behind. Errors: FM_ERROR_INVALID_ARGUMENT for NULL, numbers out of range, an octree of another context;
// FM_ERROR_OUT_OF_HOST_MEMORY, FM_ERROR_OUT_OF_DEVICE_MEMORY, FM_ERROR_DEVICE_LOST, FM_ERROR_INTERNAL.
FM_API fm_result fm_octree_render(fm_octree_renderer *renderer, const fm_octree_render_desc *desc, fm_ticket *ticket);
// Each waits for the newest picture: RGBA of 8 bits (sRGB, opaque), top row first; or of each pixel what its ray hit.
FM_API fm_result fm_octree_renderer_read(fm_octree_renderer *renderer, uint8_t *pixels);
FM_API fm_result fm_octree_renderer_hits(fm_octree_renderer *renderer, fm_octree_hit *hits);
FM_API fm_result fm_octree_renderer_vulkan(const fm_octree_renderer *renderer, fm_volume_buffer *buffer);
FM_API fm_result fm_octree_renderer_stats(fm_octree_renderer *renderer, fm_octree_render_stats *stats);

#ifdef __cplusplus
}
#endif

#endif
