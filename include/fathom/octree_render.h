// SPDX-License-Identifier: MIT
#ifndef FATHOM_OCTREE_RENDER_H
#define FATHOM_OCTREE_RENDER_H

// Pictures of octrees (octree.h), also of such as do not fit into memory. The conventions of fathom.h and octree.h hold here too.
//
// All kinds of octrees are drawn by one renderer; the kind is chosen when they are built (fm_octree_desc.kind). Of a mesh, from one
// camera, `fathom octree render MESH --kind KIND` draws vectors to closest points (closest) and all that they are compared with:
// 1. signed distances (distance), 2. binary voxels (voxels), 3. voxels with contours (svo), 4. a DAG (dag), 5. a 64-tree (tree64),
// 6. a dense distance field (field), 7. a band of bricks (bricks). The dense field is no octree: fm_mesh_sdf makes it and
// deferred.h draws it, a world's own field render.h (`fathom render WORLD`), with the same fm_camera.

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
    // A part whose read failed stays coarse. While it is wanted it is read again so much later, after each further failure twice as
    // long as before, at most 64 times this; 0: 1000; below 0: never.
    float retry_ms;
} fm_octree_stream_desc;

typedef struct fm_octree_stream_info {
    uint32_t parts, resident, wanted;  // wanted: seen by the newest picture and within the distance
    uint64_t bytes, budget;
    uint64_t loaded, dropped;  // so far
    uint64_t failed;           // reads that failed, so far
    uint32_t failing;          // parts whose newest read failed: they are coarse until a later one succeeds
    char failure[256];         // what the newest failed with; empty: none has
} fm_octree_stream_info;

// Opens such a file, which must not be gzipped. Parts are loaded by a thread of the stream's own, those first that rays meet early;
// one that cannot be read, or is not what it should be, is no error but told by fm_octree_stream_describe, and the coarse octree is
// shown in its place. Same thread rule as its context. Errors: as fm_octree_read; FM_ERROR_INVALID_ARGUMENT for numbers that are
// not finite, or a budget that does not hold the coarse octree and the list of parts: the message says what they take.
FM_API fm_result fm_octree_stream_open(fm_context *context, const char *path, const fm_octree_stream_desc *desc,
                                       fm_octree_stream **stream);
// Waits for the read that is under way and for pictures in flight; NULL is ignored. Pictures stay in their renderers.
FM_API void fm_octree_stream_close(fm_octree_stream *stream);
// Asks which parts the camera's rays meet (24 x 16 of them), takes over what has been loaded, and drops what is least wanted. Call
// before each picture. Never waits for the disk; with `wait`, until everything wanted is there, has failed, or finds no room in the
// budget.
// Errors: FM_ERROR_INVALID_ARGUMENT for NULL and for a camera that fm_octree_render refuses: then nothing has changed;
// FM_ERROR_OUT_OF_HOST_MEMORY, FM_ERROR_DEVICE_LOST, FM_ERROR_INTERNAL: then pictures show what was there, or the coarse octree,
// and the next update goes on. Source: Demir and Westermann 2015, sections 4.3 and 4.4.
FM_API fm_result fm_octree_stream_update(fm_octree_stream *stream, const fm_camera *camera, bool wait);
FM_API void fm_octree_stream_describe(const fm_octree_stream *stream, fm_octree_stream_info *info);  // NULL, for either, is ignored

// ---------------------------------------------------------------------------------------------------------------------------
// Pictures
// ---------------------------------------------------------------------------------------------------------------------------

typedef enum fm_octree_picture_view {
    FM_OCTREE_SHADED = 0,
    FM_OCTREE_NORMALS,
    FM_OCTREE_READS,   // of memory by each ray, as a heat map: 64 and more are brightest
    FM_OCTREE_LEVELS,  // the level of the leaf that was hit
} fm_octree_picture_view;

typedef struct fm_octree_render_desc {
    fm_camera camera;        // in world units
    uint32_t width, height;  // pixels, 1 to 16384
    fm_octree_picture_view view;
    fm_octree *octree;         // NULL where there is a stream
    fm_octree_stream *stream;  // not NULL: takes the place of `octree`, as it is after the newest fm_octree_stream_update
    float epsilon;             // as fm_octree_cast, at most 8 in size; of a stream's parts in their own cells
    float sun[3];              // towards the sun, of any length; all 0: that of fm_render_desc
    bool shadow;               // a ray to the sun from each place that is seen
    float reflection;          // 0 to 1: part of the light that comes by a reflected ray
    float refraction;          // 0: opaque; above 1 to 8: refractive index of the surface's inside, which is clear
    bool count;                // gather the statistics; with secondary rays this takes 8 bytes a pixel more, and a little time
} fm_octree_render_desc;

typedef struct fm_octree_render_stats {
    uint64_t rays, hits, reads, most_reads;  // primary; a read is that of a node or of a leaf's values
    uint64_t beam_reads;                     // for all rays of 8 x 8 pixels together, before these begin
    uint64_t second_rays, second_reads;      // to the sun, reflected and refracted
} fm_octree_render_stats;

// Renders into memory of its own, about 20 bytes a pixel (FM_PURPOSE_PICTURES). Same thread rule as its context, which it must not
// outlive; one renderer may draw many octrees and streams of its context, one after the other.
typedef struct fm_octree_renderer fm_octree_renderer;

// Errors: FM_ERROR_INVALID_ARGUMENT for NULL, FM_ERROR_OUT_OF_HOST_MEMORY.
FM_API fm_result fm_octree_renderer_create(fm_context *context, fm_octree_renderer **renderer);
FM_API void fm_octree_renderer_destroy(fm_octree_renderer *renderer);  // waits for the work in flight; NULL is ignored

// Asynchronous on Vulkan, complete at `ticket` (NULL: waits; 0 on the CPU); but the first picture of an octree, or after a change
// of it, waits until it is on the device, a picture of another size than the one before waits for the context's earlier work, whose
// memory goes, and at most three pictures are in flight: the fourth waits for the first. Octree and stream may be destroyed while
// it is in flight. Passes: "beams" (Vulkan; part of "primary" on the CPU) where the kind has bounds for them (CLOSEST, DISTANCE,
// VOXELS, BRICKS), "primary", "second" where there are secondary rays. Of a clear surface reflection and refraction follow from the
// angle (Fresnel); its rays are followed through both interfaces, and their colour is that of the sky or of what is lit behind;
// they and `shadow` are of FM_OCTREE_SHADED alone. Errors: FM_ERROR_INVALID_ARGUMENT for NULL but for `ticket`, numbers out of
// range, an octree or a stream of another context; FM_ERROR_OUT_OF_HOST_MEMORY, FM_ERROR_OUT_OF_DEVICE_MEMORY,
// FM_ERROR_DEVICE_LOST, FM_ERROR_INTERNAL. The picture before stays the newest unless the wait for this one is what failed. Source:
// Demir and Westermann 2015, sections 2, 4.2 and, of streams, 4.3.
FM_API fm_result fm_octree_render(fm_octree_renderer *renderer, const fm_octree_render_desc *desc, fm_ticket *ticket);
// Each waits for the newest picture and copies `width` x `height` of them, top row first: RGBA of 8 bits (sRGB, opaque); or of each
// pixel what its ray hit, as fm_octree_cast of a ray whose direction is of length 1, with normals of 32 bits. Errors:
// FM_ERROR_INVALID_ARGUMENT for NULL and before the first picture; FM_ERROR_OUT_OF_HOST_MEMORY; where the device's memory cannot be
// mapped FM_ERROR_OUT_OF_DEVICE_MEMORY, for what they go through; FM_ERROR_DEVICE_LOST, FM_ERROR_INTERNAL.
FM_API fm_result fm_octree_renderer_read(fm_octree_renderer *renderer, uint8_t *pixels);
FM_API fm_result fm_octree_renderer_hits(fm_octree_renderer *renderer, fm_octree_hit *hits);
// The picture's buffer, as fm_renderer_vulkan (render.h): valid until the next picture of another size or the renderer's end, and
// not waited for. Errors: FM_ERROR_INVALID_ARGUMENT for NULL and before the first picture, FM_ERROR_UNSUPPORTED on the CPU.
FM_API fm_result fm_octree_renderer_vulkan(const fm_octree_renderer *renderer, fm_volume_buffer *buffer);
// Waits for the newest picture, which must have been rendered with `count`. Errors: FM_ERROR_INVALID_ARGUMENT also where it was
// not; else as fm_octree_renderer_hits.
FM_API fm_result fm_octree_renderer_stats(fm_octree_renderer *renderer, fm_octree_render_stats *stats);

#ifdef __cplusplus
}
#endif

#endif
