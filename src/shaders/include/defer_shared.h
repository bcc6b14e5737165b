// SPDX-License-Identifier: MIT
#ifndef FM_DEFER_SHARED_H
#define FM_DEFER_SHARED_H

// What C and GLSL both know of the deferred renderer, by the rules of shared.h.

#include "mesh_shared.h"

// The numbers of fm_surface, fm_shadows, fm_light_kind and fm_deferred_view (deferred.c compares them).
#define FM_GPU_SURFACE_MESH 0
#define FM_GPU_SURFACE_FIELD 1
#define FM_GPU_SHADOWS_NONE 0
#define FM_GPU_SHADOWS_RAY 1
#define FM_GPU_SHADOWS_RTSDF 2
#define FM_GPU_SHADOWS_FIELD 3
#define FM_GPU_SHADOWS_DISTRIBUTED 4
#define FM_GPU_SHADOWS_MAP 5
#define FM_GPU_LIGHT_DIRECTIONAL 0
#define FM_GPU_LIGHT_AREA 1
#define FM_GPU_DEFERRED_SHADED 0
#define FM_GPU_DEFERRED_NORMAL 1
#define FM_GPU_DEFERRED_STEPS 2
#define FM_GPU_DEFERRED_SHARE 3

#define FM_LIGHTS 4
#define FM_CASCADES 4
#define FM_MAP_FLOATS 4  // moments of a texel

// How far a field's cone is followed at most, in reads.
#define FM_SOFT_READS 192
// ... and how far above the surface it begins, in voxels: above what the field errs by there.
#define FM_CONE_LIFT 0.1f

// Exponents of the two warps of depth; a float's square holds e^(2 * 40).
#define FM_WARP_UP 40.0f
#define FM_WARP_DOWN 5.0f
#define FM_MAP_BLUR 7     // texels on each side
#define FM_BLEEDING 0.2f  // shares below this are shadow
#define FM_LEAST_VARIANCE 1e-4f

#define FM_HISTORY_PART 0.9f  // of what was before, in a blended picture

FM_PUSH_STRUCT(fm_defer_light) {
    fm_int kind;
    fm_float way[3];  // DIRECTIONAL: of length 1
    fm_float size;    // DIRECTIONAL: the tangent of half its angle
    fm_float color[3];
};

// A box that looks along the light. Texel (i, j) is seen from corner + i right + j down, against the light's way.
FM_PUSH_STRUCT(fm_defer_cascade) {
    fm_float corner[3];
    fm_float right[3];
    fm_float down[3];
    fm_float depth;  // of the box
};

// A picture, in memory that the host writes for each. The ray of pixel (x, y) goes along corner + x right + y down.
FM_PUSH_STRUCT(fm_defer_scene) {
    fm_mesh_refs mesh;
    fm_address field;
    fm_address surfaces;  // fm_defer_surface of each pixel
    fm_address light;     // four floats of each: linear colour, share of the first light
    fm_address history;   // four floats of each: linear colour and nothing; of the picture before
    fm_address next_history;
    fm_address picture;
    fm_address map;      // moments of all cascades
    fm_address blurred;  // the same, while they are blurred
    fm_float origin[3];
    fm_float corner[3];
    fm_float right[3];
    fm_float down[3];
    fm_float old_origin[3];   // of the picture before
    fm_float old_forward[3];  // of length 1
    fm_float old_right[3];    // a pixel's edge at distance 1 is 1 / length
    fm_float old_down[3];
    fm_float old_middle[2];  // the pixel that old_forward goes through
    fm_float shift[2];       // of this picture's rays, in pixels; `corner` has it already
    fm_int width, height;
    fm_int shape[3];  // of the field
    fm_float field_origin[3];
    fm_float field_scale[3];  // texels a world unit
    fm_float voxel;           // the least spacing
    fm_float diagonal;        // of a cell
    fm_float level;
    fm_float lift;  // how far above the surface rays through the mesh begin
    fm_float max_step;
    fm_uint max_steps;
    fm_uint samples;
    fm_uint frame;
    fm_uint jitter;
    fm_uint blend;  // there is a history
    fm_uint light_count;
    fm_uint map_edge;
    fm_defer_light lights[FM_LIGHTS];
    fm_defer_cascade cascades[FM_CASCADES];
};

// What a pixel shows.
FM_PUSH_STRUCT(fm_defer_surface) {
    fm_float at[3];
    fm_float depth;  // along the ray, in its lengths; +infinity: nothing
    fm_float normal[3];
    fm_uint steps;
};

FM_PUSH_STRUCT(fm_defer_push) {
    fm_address scene;
};

#ifdef __STDC__
_Static_assert(sizeof(fm_defer_surface) == 32 && sizeof(fm_defer_light) == 32 && sizeof(fm_defer_cascade) == 40,
               "as std430 lays them out");
_Static_assert(sizeof(fm_defer_scene) % 8 == 0, "as std430 lays it out");
#endif

#endif
