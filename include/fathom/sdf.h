// SPDX-License-Identifier: MIT
#ifndef FATHOM_SDF_H
#define FATHOM_SDF_H

// From triangle meshes to voxels and to signed distance fields. The conventions of fathom.h hold here too.
//
// A field is a volume of FM_TYPE_F32; its spacing and origin say where its texels lie: texel (x, y, z) is the point origin +
// (x, y, z) spacing. Distances are in world units, negative inside.

#include "fathom/mesh.h"

#ifdef __cplusplus
extern "C" {
#endif

// Fits a grid of cubic voxels around a mesh: `longest` voxels along the longest edge of its box, of which `margin` on each side are
// left beside it. Fills shape, spacing and origin of `grid`; its type and storage stay. A mesh without extent gets a unit box. Of a
// scene that moved on Vulkan the box is that of its objects' boxes, turned and moved, which may leave room.
// Errors: FM_ERROR_INVALID_ARGUMENT for NULL, `longest` of 0 or above 16384, or a `longest` that `margin` leaves nothing of.
FM_API fm_result fm_mesh_fit(fm_mesh *mesh, uint32_t longest, uint32_t margin, fm_volume_desc *grid);

// ---------------------------------------------------------------------------------------------------------------------------
// Voxels
// ---------------------------------------------------------------------------------------------------------------------------

// Which voxels a surface sets. Voxels are the boxes of edge `spacing` around the texels. A contact that rounding cannot tell (on
// Vulkan that of floats, in the grid's units) counts as one.
typedef enum fm_separation {
    // Conservative: every voxel that the surface touches. No path over faces, edges or corners of voxels crosses it.
    FM_SEPARATION_26 = 0,
    // Thin: every voxel in which the surface touches one of the three lines that join the middles of opposite faces. No path over
    // faces crosses it, for such a path runs along these lines.
    FM_SEPARATION_6,
} fm_separation;

typedef struct fm_voxelize_desc {
    fm_separation separation;
    // Voxels whose centre is inside are set too: those from which a ray along x leaves more often than it enters. For closed
    // meshes.
    bool solid;
} fm_voxelize_desc;

// Writes 1 where the mesh is and 0 elsewhere. `voxels`: U8 or BITS, with the grid's spacing and origin, where the context computes.
// The CPU backend decides in doubles, a device in floats: contacts that the latter cannot tell set voxels there and not here.
// Asynchronous on Vulkan, complete at `ticket` (NULL: waits). Passes: "voxelize", and "fill"
// where `solid`. Errors: FM_ERROR_INVALID_ARGUMENT for NULL, another
// type or context; FM_ERROR_OUT_OF_HOST_MEMORY, FM_ERROR_OUT_OF_DEVICE_MEMORY, FM_ERROR_DEVICE_LOST, FM_ERROR_INTERNAL. Source:
// Schwarz and Seidel 2010, "Fast parallel surface and solid voxelization on GPUs"; Huang et al. 1998 for separability.
FM_API fm_result fm_mesh_voxelize(fm_mesh *mesh, const fm_voxelize_desc *desc, fm_volume *voxels, fm_ticket *ticket);

// ---------------------------------------------------------------------------------------------------------------------------
// Exact signed distance fields
// ---------------------------------------------------------------------------------------------------------------------------

typedef enum fm_sign {
    FM_SIGN_AUTO = 0,      // PSEUDONORMAL when the mesh is one closed surface, has no triangle without area and does not
                           // intersect itself, else WINDING
    FM_SIGN_PSEUDONORMAL,  // the side of the nearest feature's angle-weighted normal. Source: Baerentzen and Aanaes 2005
    FM_SIGN_WINDING,       // inside where the generalised winding number is above 1/2. Source: Barill et al. 2018
    FM_SIGN_NONE,          // unsigned
} fm_sign;

// What texels outside the band get.
typedef enum fm_far {
    FM_FAR_BAND = 0,  // the band's width, with the sign
    FM_FAR_FLOODED,   // the distance to a triangle that is nearest to a texel of the band nearby, as jump flooding finds one for
                      // 4 x 4 x 4 texels: never too small, and seldom much too great; on the CPU backend exact
    FM_FAR_EXACT,     // as the band: exact everywhere
} fm_far;

typedef struct fm_sdf_desc {
    float band;  // half the band's width in voxels of the largest spacing, within which texels are exact; 0: 3
    fm_far far_texels;
    fm_sign sign;
} fm_sdf_desc;

typedef struct fm_sdf_info {
    fm_sign sign;            // used, never AUTO
    const char *sign_why;    // in words; static storage
    uint64_t intersections;  // pairs found while AUTO decided, at most 1; 0 where it needed none
} fm_sdf_info;

// Computes the field. `distance`: F32, with the grid's spacing and origin, where the context computes. `triangles` (NULL: not
// wanted): U32 of the same shape, gets the triangle nearest to each texel of the band, or FM_NO_TRIANGLE. `info` NULL is fine. The
// sign of AUTO is decided from what fm_mesh_describe and fm_mesh_intersections see, again when a mesh is deformed or moved in host
// memory, whose intersections are searched for only if the rest speaks for PSEUDONORMAL. An empty mesh gives the band's width
// everywhere, +infinity under FM_FAR_EXACT and FLOODED. Deterministic: the same input gives the same bits on the same device.
// Unsigned distances are within 4 units in the last place of the largest coordinate that takes part. Asynchronous on Vulkan,
// complete at `ticket` (NULL: waits). Passes: "tree", "normals" or "moments" where they are made anew; then "sign" for winding
// numbers, "near", "nearest", "flood" but for FM_FAR_BAND, "fill" or for FM_FAR_EXACT "far"; or, for winding numbers of meshes that
// are not closed, "blocks", "nearest". Errors: as fm_mesh_voxelize, FM_ERROR_INVALID_ARGUMENT for a band below 0 or not finite, and
// FM_ERROR_UNSUPPORTED for more than 2^26 texels along an axis on the CPU backend, or 65,535 along x or y on Vulkan. On the CPU
// backend winding numbers decide as if summed exactly where the mesh's boundary has at most 4,096 edges; on Vulkan those of soups
// can be off within some units in the last place of the largest coordinate, and lengths below 1e-18 are not told apart.
FM_API fm_result fm_mesh_sdf(fm_mesh *mesh, const fm_sdf_desc *desc, fm_volume *distance, fm_volume *triangles, fm_sdf_info *info,
                             fm_ticket *ticket);

// ---------------------------------------------------------------------------------------------------------------------------
// Fields of moving scenes, composed of their objects' own
// ---------------------------------------------------------------------------------------------------------------------------

// All 0 but the shape asks for the defaults.
typedef struct fm_composed_desc {
    fm_shape shape;  // of the scene's field, at most 65535 an axis
    double spacing[3];
    double origin[3];
    float band;     // half the band's width in voxels of the largest spacing; 0: 3
    float detail;   // texels of a local field for each of the smallest spacing; 0: 1
    uint32_t most;  // texels along the longest edge of a local field, at least 16: larger objects get larger texels; 0: 512
    fm_sign sign;   // AUTO is decided for each object, and again when it deforms
} fm_composed_desc;

typedef struct fm_composed_info {
    // How far a texel of the band can be from the least of the objects' signed distances, in world units, but for rounding: sqrt(3)
    // / 2 times the edge of the largest local texel, for that is how far the mean of eight texels can be off when distances change
    // by no more than the way. Where the nearest surface is smooth, of radius r, errors are about the squared edge over 4 r.
    double error;
    uint64_t touched;       // texels of the scene's field that the newest update computed, in whole blocks
    uint64_t local_texels;  // of all local fields
} fm_composed_info;

// A field of a scene that is put together from a local field of each object, made once and again only when the object deforms, and
// placed as the object is: the least of the objects' signed distances, within the band. Beyond it texels have the band's width with
// the sign. Where closed objects overlap it is a field of their union: right outside, right in sign, and inside never deeper than
// it is. Only what moved is computed anew. Objects that were added with the same shape share a local field until they deform. Same
// thread rule as its context.
typedef struct fm_composed fm_composed;

// The scene must outlive it. Errors: FM_ERROR_INVALID_ARGUMENT for NULL and numbers outside their ranges; FM_ERROR_RANGE; the
// errors of memory.
FM_API fm_result fm_composed_create(fm_scene *scene, const fm_composed_desc *desc, fm_composed **composed);
// Waits for work in flight.
FM_API void fm_composed_destroy(fm_composed *composed);

// Makes the field that of the objects as they were last added, moved and deformed; fm_scene_update need not be called for that.
// Only texels around objects that have changed are touched, around where they were and where they are, and the field is, bit for
// bit, as if all had been computed anew. Asynchronous on Vulkan, complete at `ticket` (NULL: waits), but waits before the
// local fields of objects that are new or have deformed. Pass: "compose". Errors: FM_ERROR_INVALID_ARGUMENT for NULL, and for an
// object whose place is not rigid (rows that are off from right angles and lengths of 1 by more than 1e-4); those of fm_mesh_sdf.
FM_API fm_result fm_composed_update(fm_composed *composed, fm_ticket *ticket);

// The field: F32, as of the last update, where the context computes. It is the object's, and only it may write it.
FM_API fm_volume *fm_composed_field(fm_composed *composed);
FM_API void fm_composed_describe(const fm_composed *composed, fm_composed_info *info);

// ---------------------------------------------------------------------------------------------------------------------------
// RTSDF: approximate fields in real time, as published
// ---------------------------------------------------------------------------------------------------------------------------

typedef enum fm_flood {
    FM_FLOOD_JFA = 0,     // steps n/2, n/4, ..., 1
    FM_FLOOD_JFA_1_PLUS,  // a step of 1 first
    FM_FLOOD_JFA_PLUS_2,  // steps of 2 and 1 afterwards
} fm_flood;

// Lengths are fractions of the longest edge of the box, as the paper's fields live in a unit cube. 0 asks for the paper's value
// where it has one.
typedef struct fm_rtsdf_desc {
    fm_shape coarse;  // texels of the coarse field; the fine one has twice as many along each axis. All 0: 128, 128, 128
    double low[3];    // the box that both fields cover, texel centres half a voxel inside. All 0: from 0 to 1
    double high[3];
    fm_flood flood;
    float beta;     // taken off the coarse field. 0: a tenth of a coarse voxel
    float mask;     // rays are shot from fine texels whose coarse distance is at most this. 0: 0.1; +infinity: from all
    float alpha;    // decay of the frame before. 0: 0.95
    float bias;     // taken off the fine field. 0: 0.01; below 0: none
    uint32_t rays;  // a texel and frame, 0 to 64
    uint32_t seed;  // of the directions
} fm_rtsdf_desc;

// Same thread rule as its context.
typedef struct fm_rtsdf fm_rtsdf;

// Errors: FM_ERROR_INVALID_ARGUMENT for numbers outside their ranges; the errors of memory.
FM_API fm_result fm_rtsdf_create(fm_context *context, const fm_rtsdf_desc *desc, fm_rtsdf **rtsdf);
FM_API void fm_rtsdf_destroy(fm_rtsdf *rtsdf);

// A frame: voxelise, flood, mask, shoot, accumulate. Approximate and noisy, and what moves leaves a trace for some frames: that is
// the technique. Asynchronous on Vulkan, complete at `ticket` (NULL: waits). Passes: "voxelize", "flood", "trace". Source: Tan,
// Chua, Koh and Bhojan 2022, "RTSDF: Real-time signed distance fields for soft shadow approximation in games", sections 2.1 to 2.5.
// What the paper leaves open is said in docs/architecture.md.
FM_API fm_result fm_rtsdf_update(fm_rtsdf *rtsdf, fm_mesh *mesh, fm_ticket *ticket);

// Forgets the frames so far.
FM_API fm_result fm_rtsdf_reset(fm_rtsdf *rtsdf);

// The fields as of the last update; they are the object's. Either may be NULL.
FM_API void fm_rtsdf_fields(fm_rtsdf *rtsdf, fm_volume **coarse, fm_volume **fine);

#ifdef __cplusplus
}
#endif

#endif
