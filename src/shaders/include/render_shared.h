// SPDX-License-Identifier: MIT
#ifndef FM_RENDER_SHARED_H
#define FM_RENDER_SHARED_H

// What C and GLSL both know of pictures, by the rules of shared.h.

#include "shared.h"

// The numbers of fm_march, fm_view and fm_shadow (render.c compares them).
#define FM_GPU_MARCH_SKIP 0
#define FM_GPU_MARCH_BOX 1
#define FM_GPU_MARCH_PLAIN 2
#define FM_GPU_VIEW_COLOR 0
#define FM_GPU_VIEW_STEPS 1
#define FM_GPU_VIEW_NORMAL 2
#define FM_GPU_VIEW_DISTANCE 3
#define FM_GPU_VIEW_SLICE 4
#define FM_GPU_VIEW_DIFFERENCE 5
#define FM_GPU_SHADOW_NONE 0
#define FM_GPU_SHADOW_HARD 1
#define FM_GPU_SHADOW_SOFT 2

// A beam is shared by the rays of so many pixels a side.
#define FM_TILE 8
// Two points whose coordinates differ by m in sum lie in cells at most m + 3 apart; the rest is for the rounding of positions.
#define FM_BEAM_APART 3.5f
#define FM_BEAM_READS 512  // at most
#define FM_BEAM_ROOM 4.0f  // a beam that could go less far than this leaves the rest to the rays

// Light, in squares of what is stored.
#define FM_SUN_LIGHT 1.05f, 0.97f, 0.82f
#define FM_AMBIENT_LIGHT 0.36f, 0.43f, 0.54f
#define FM_AMBIENT 0.82f       // of a face, ...
#define FM_AMBIENT_UP 0.18f    // ... more of one that looks up
#define FM_AMBIENT_SIDE 0.10f  // ... less of one that looks along x, so that corners show
#define FM_DARKEST 0.05f       // of a voxel's colour, before it is squared
#define FM_ZENITH 0.10f, 0.24f, 0.56f
#define FM_HORIZON 0.56f, 0.68f, 0.82f
#define FM_BELOW 0.30f, 0.32f, 0.36f
#define FM_DUSK 6.0f  // how fast the sky turns to FM_BELOW under the horizon
#define FM_GLOW 1.0f, 0.85f, 0.6f
#define FM_GLOW_PART 0.25f
#define FM_SUN_EDGE 0.9993f  // cosine of the sun's radius
#define FM_SUN_SHARP 4000.0f
#define FM_NOTHING 0.01f  // where a view has no sky
#define FM_TINT 1.0f, 0.75f, 0.1f
#define FM_TINT_PART 0.4f
#define FM_TINT_EDGE 0.85f

// How far from its occluder a ray is fully lit: the way to it / FM_PENUMBRA. The field is looked at closely where its steps, less
// FM_PENUMBRA_DOUBT, would make a penumbra, and not before FM_PENUMBRA_FROM, for a ray begins on a surface.
#define FM_PENUMBRA 12.0f
#define FM_PENUMBRA_DOUBT 1.5f
#define FM_PENUMBRA_FROM 1.0f

// Occlusion looks at the field so many voxels before the face, each with its weight; all closed, a face keeps 1 - the last.
#define FM_OPEN_PLACES 1, 3, 6
#define FM_OPEN_WEIGHTS 0.45f, 0.30f, 0.25f
#define FM_OPEN_COUNT 3
#define FM_OPEN_PART 0.85f

// Views.
#define FM_NORMAL_MIDDLE 0.5f
#define FM_NORMAL_PART 0.45f
#define FM_STEPS_SCALE 0.125f  // of the colour map for each doubling of the steps
#define FM_GREY 0.15f, 0.3f, 0.05f
#define FM_LINE_EVERY 8.0f   // voxels between two lines of a slice
#define FM_LINE_WIDTH 0.6f   // pixels
#define FM_LINE_LEAST 0.08f  // voxels
#define FM_LINE_PART 0.8f
#define FM_LINE_LIGHT 0.02f
#define FM_SLICE_HALF 24.0f  // distance with the middle of the map's colours
#define FM_SLICE_SOLID 0.8f

// A picture's sums. Word 2 i is the low half of sum i, word 2 i + 1 the high one; then come the most steps of a ray.
#define FM_SUM_RAYS 0
#define FM_SUM_HITS 1
#define FM_SUM_STEPS 2
#define FM_SUM_BEAM 3
#define FM_SUM_SUN 4
#define FM_SUM_OPEN 5
#define FM_SUM_WRONG 6
#define FM_SUM_COUNT 7
#define FM_STATS_MOST 14
#define FM_STATS_WORDS 15

// What a picture needs that has no room in its push constants, by offset in bytes: the address of the sums, the brush that is shown
// (fm_gpu_brush), 256 colours of a map.
#define FM_EXTRA_STATS 0
#define FM_EXTRA_BRUSH 16
#define FM_EXTRA_MAP 80
#define FM_EXTRA_BYTES 1104

// A picture. Places are in voxels, where voxel 0 begins at 0. The ray of pixel (x, y) goes along corner + x * right + y * down.
FM_PUSH_STRUCT(fm_march_push) {
    fm_address field;
    fm_address colors;
    fm_address bits;
    fm_address picture;
    fm_address beam;  // a float for each tile
    fm_address extra;
    fm_float origin[3];
    fm_float corner[3];
    fm_float right[3];
    fm_float down[3];
    fm_float sun[3];  // of length 1
    fm_uint size_xy;  // of the world: x | y << 16
    fm_uint size_z;
    fm_uint pixels;  // width | height << 16
    fm_uint slice;   // axis | index << 2
};

// One ray.
FM_PUSH_STRUCT(fm_pick_push) {
    fm_address field;
    fm_address bits;
    fm_address found;  // fm_gpu_pick
    fm_float origin[3];
    fm_float way[3];
    fm_uint size_xy;  // as above
    fm_uint size_z;
};

// What it meets: fm_pick.
FM_PUSH_STRUCT(fm_gpu_pick) {
    fm_uint hit;
    fm_int voxel[3];
    fm_int face;
    fm_float distance;
};

#ifdef __STDC__
_Static_assert(sizeof(fm_march_push) <= 128 && sizeof(fm_pick_push) <= 128, "push constants are 128 bytes on every device");
_Static_assert(sizeof(fm_gpu_pick) == 24, "as std430 lays it out");
#endif

#endif
