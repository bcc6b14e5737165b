// SPDX-License-Identifier: MIT
#ifndef FATHOM_DEFERRED_H
#define FATHOM_DEFERRED_H

// Pictures of triangle meshes and of signed distance fields, with the soft shadows that a field gives and those that it is to be
// measured by: a deferred renderer in compute. Places and lengths are in world units. The conventions of fathom.h hold here too.

#include "fathom/mesh.h"
#include "fathom/render.h"

#ifdef __cplusplus
extern "C" {
#endif

// What a ray from the camera meets.
typedef enum fm_surface {
    FM_SURFACE_MESH = 0,  // the mesh's triangles, by its tree
    // Where the field, trilinear between its texels, falls to `level`. The cubic that it is along a ray through a cell of texels is
    // solved, and normals are gradients interpolated between texels, so that neither shows the cells. Source: Soederlund, Evans and
    // Akenine-Moeller 2022, "Ray tracing of signed distance function grids".
    FM_SURFACE_FIELD,
} fm_surface;

typedef enum fm_light_kind {
    FM_LIGHT_DIRECTIONAL = 0,  // a disc in the sky
    FM_LIGHT_AREA,             // a disc at a place, which faces whom it lights
} fm_light_kind;

typedef struct fm_light {
    fm_light_kind kind;
    float way[3];    // DIRECTIONAL: towards the light, of any length above 0; AREA: where its centre is
    float size;      // DIRECTIONAL: half the angle of its disc in degrees, below 45; AREA: its radius. 0: a point
    float color[3];  // light that arrives, 1 being white; all 0: 1, 1, 1
} fm_light;

// How much of a light a place sees. Rays through the mesh begin above what they leave: above FM_SURFACE_FIELD by a voxel's
// diagonal.
typedef enum fm_shadows {
    FM_SHADOWS_NONE = 0,
    FM_SHADOWS_RAY,  // one ray to the light's middle through the mesh: hard
    // The light's share that a cone through the field leaves, as published: steps of at most `max_step`, the nearest distance
    // triangulated between two samples (Aaltonen 2018), 0 once the field is no more than a voxel: penumbrae only widen.
    // Source: Tan et al. 2022, sections 2.4 and 2.5.
    FM_SHADOWS_RTSDF,
    // Ours: the signed depth to which the cone is cut, on both sides of the surface, gives the visible part of the light's disc, so
    // that there is a true umbra; steps are bounded by the cone and not by a constant. The light can be split into `samples` cones.
    // Needs a signed field whose distances are not cut at a band.
    FM_SHADOWS_FIELD,
    FM_SHADOWS_DISTRIBUTED,  // `samples` rays through the mesh to places of the light: the truth, as samples grow
    // Cascaded shadow maps with exponential variance: four cascades, blurred over 15 x 15 texels. one DIRECTIONAL light only,
    // whose size is not heeded. Source: Lauritzen and McCool 2008, "Layered variance shadow maps", for the warp; Engel 2006 for
    // cascades.
    FM_SHADOWS_MAP,
} fm_shadows;

typedef enum fm_deferred_view {
    FM_DEFERRED_SHADED = 0,  // clay in the lights, and a sky
    FM_DEFERRED_NORMAL,
    FM_DEFERRED_STEPS,  // reads of the field for the surface and for the first light, as a heat map
    FM_DEFERRED_SHARE,  // how much of the first light is seen, as grey
} fm_deferred_view;

enum { FM_MAX_LIGHTS = 4 };

typedef struct fm_deferred_desc {
    fm_camera camera;        // in world units; its place within 1e18 of 0 along each axis
    uint32_t width, height;  // pixels, 1 to 16384
    fm_surface surface;
    fm_deferred_view view;
    fm_mesh *mesh;           // for FM_SURFACE_MESH and for RAY, DISTRIBUTED and MAP shadows; else NULL is fine
    const fm_volume *field;  // F32, where the context computes; for FM_SURFACE_FIELD and for RTSDF and FIELD shadows
    float level;             // taken off the field's distances, for surface and shadows
    fm_shadows shadows;
    uint32_t light_count;  // 0: one sun of 2 degrees from the default way of fm_render_desc
    fm_light lights[4];    // FM_MAX_LIGHTS
    uint32_t samples;      // DISTRIBUTED, 0: 1024; FIELD, 0: 1; at most 65,536
    float max_step;        // RTSDF; 0: 0.05 of the field's longest edge
    uint32_t max_steps;    // RTSDF, 0: 128; at most 4096
    bool jitter;           // RTSDF: the first step is a random part of one
    bool taa;  // blend with the pictures before, from where they showed the place; jitters the pixels. What moves smears a little
    uint32_t frame;     // seed of jitter and of samples
    uint32_t map_edge;  // MAP: texels along a cascade's edge, 0: 1024; at most 8192
    float extent;       // MAP: how far from the camera the last cascade ends; 0: where the mesh does
} fm_deferred_desc;

// Renders into memory of its own, and keeps what pictures to come need of those before. Same thread rule as its context.
typedef struct fm_deferred fm_deferred;

// Errors: FM_ERROR_INVALID_ARGUMENT for NULL, FM_ERROR_OUT_OF_HOST_MEMORY, FM_ERROR_OUT_OF_DEVICE_MEMORY, FM_ERROR_DEVICE_LOST.
FM_API fm_result fm_deferred_create(fm_context *context, fm_deferred **deferred);
FM_API void fm_deferred_destroy(fm_deferred *deferred);  // waits for the work in flight; NULL is ignored

// Renders a picture; asynchronous on Vulkan, complete at `ticket` (NULL: waits). Mesh and field belong to the same context and must
// stay until then. Passes: "tree" (Vulkan, where the mesh has changed), "map", "surface", "light", "resolve".
// Errors: FM_ERROR_INVALID_ARGUMENT for NULL, numbers outside what is said of them, a mesh or field that is wanted and not there;
// FM_ERROR_UNSUPPORTED for MAP with an AREA light; the errors of memory; FM_ERROR_DEVICE_LOST; FM_ERROR_INTERNAL.
FM_API fm_result fm_deferred_render(fm_deferred *deferred, const fm_deferred_desc *desc, fm_ticket *ticket);

// Copies the newest picture: RGBA of 8 bits each (sRGB, opaque), top row first. Waits for it. Errors: FM_ERROR_INVALID_ARGUMENT for
// NULL and before the first picture; the errors of memory; FM_ERROR_DEVICE_LOST; FM_ERROR_INTERNAL.
FM_API fm_result fm_deferred_read(fm_deferred *deferred, uint8_t *pixels);

// The picture's buffer, RGBA8 as above, valid until the next fm_deferred_render of another size or the end of `deferred`. Does not
// wait. Errors: FM_ERROR_INVALID_ARGUMENT for NULL and before the first picture, FM_ERROR_UNSUPPORTED on the CPU.
FM_API fm_result fm_deferred_vulkan(const fm_deferred *deferred, fm_volume_buffer *buffer);

// How much of the first light each pixel's surface sees, 0 to 1; below 0 where a pixel shows no surface, and 0 where the surface
// looks away from the light. Errors: as fm_deferred_read.
FM_API fm_result fm_deferred_shares(fm_deferred *deferred, float *shares);

// How far along its ray each pixel's surface lies, +infinity where there is none. Errors: as fm_deferred_read.
FM_API fm_result fm_deferred_depths(fm_deferred *deferred, float *depths);

#ifdef __cplusplus
}
#endif

#endif
