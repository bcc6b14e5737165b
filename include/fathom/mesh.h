// SPDX-License-Identifier: MIT
#ifndef FATHOM_MESH_H
#define FATHOM_MESH_H

// Triangle meshes: what they are made of, where their nearest points are, and what rays hit. The conventions of fathom.h hold here
// too. Positions and distances are in world units.
//
// Open, non-manifold, self-intersecting, nested and degenerate meshes are normal input. A triangle with a coordinate that is not
// finite, or above 1e18 in size, is left out of everything and counted in `fm_mesh_info.dropped`. A triangle without area takes
// part as the segment or point that it is.

#include "fathom/fathom.h"

#ifdef __cplusplus
extern "C" {
#endif

// Of a query that found no triangle.
#define FM_NO_TRIANGLE UINT32_MAX

typedef struct fm_mesh_desc {
    const float (*vertices)[3];
    uint64_t vertex_count;           // below 2^32
    const uint32_t (*triangles)[3];  // counter-clockwise seen from outside
    uint64_t triangle_count;         // below 2^31
} fm_mesh_desc;

// Same thread rule as its context.
typedef struct fm_mesh fm_mesh;

// Copies the arrays. An empty mesh is fine: nothing is near it. Errors: FM_ERROR_INVALID_ARGUMENT for NULL arrays of a count above
// 0, counts above their limits, and an index that names no vertex (the message names the first such triangle);
// FM_ERROR_OUT_OF_HOST_MEMORY; FM_ERROR_OUT_OF_DEVICE_MEMORY, FM_ERROR_DEVICE_LOST and FM_ERROR_INTERNAL on Vulkan.
FM_API fm_result fm_mesh_create(fm_context *context, const fm_mesh_desc *desc, fm_mesh **mesh);

// Waits for work in flight that reads it.
FM_API void fm_mesh_destroy(fm_mesh *mesh);

// How a tree follows vertices that have moved.
typedef enum fm_tree {
    FM_TREE_REFIT = 0,  // the boxes follow, the tree stays: cheap, and good while neighbours stay neighbours
    FM_TREE_REBUILD,
} fm_tree;

// Replaces all positions, as many as there are, so that the mesh deforms. What is joined stays (which vertices count as one, edges,
// parts), but which triangles are dropped is judged anew: when others are, edges and parts are found again from the new positions.
// On Vulkan waits for all work in flight. Errors: as fm_mesh_create.
FM_API fm_result fm_mesh_deform(fm_mesh *mesh, const float (*vertices)[3], fm_tree tree);

// The mesh's own arrays, in host memory: valid until the mesh is deformed or destroyed. Any pointer may be NULL.
FM_API void fm_mesh_arrays(const fm_mesh *mesh, const float (**vertices)[3], uint64_t *vertex_count,
                           const uint32_t (**triangles)[3], uint64_t *triangle_count);

// What a mesh is. Vertices of bit-equal positions count as one here (-0 equals 0): files often repeat them.
typedef struct fm_mesh_info {
    uint64_t vertices, triangles;  // as given
    uint64_t distinct;             // vertices of different position that a triangle names
    uint64_t unused;               // vertices that no triangle names
    uint64_t dropped;              // triangles with a coordinate that is not finite or above 1e18
    uint64_t degenerate;           // triangles without area, not dropped
    uint64_t duplicate;            // triangles with the same three corners as an earlier one, however turned
    uint64_t boundary;             // edges with one triangle
    uint64_t non_manifold;         // edges with more than two
    uint64_t misoriented;          // edges whose two triangles run along them in the same direction
    uint64_t components;           // parts that share no vertex
    bool closed;                   // no boundary, no non-manifold, no misoriented edge, and at least one triangle
    float low[3], high[3];         // box; low above high when there is no triangle
    double area;
    double volume;  // enclosed, negative when the faces look inwards; of a closed mesh only, else 0
} fm_mesh_info;

// Worked out on the host when asked for and kept: what is joined once for the same dropped triangles, box, area, volume and
// degenerate triangles once for each deform or move. Of a scene on Vulkan it tells of the update that made the scene's mesh, for
// what moved since moved on the device alone. Errors: FM_ERROR_OUT_OF_HOST_MEMORY.
FM_API fm_result fm_mesh_describe(fm_mesh *mesh, fm_mesh_info *info);

// Number of pairs of triangles that intersect and share no vertex (by position). Exact: decided without rounding; touching counts,
// and so do triangles without area. Stops at `most` (0: counts all). On the host, of the positions that fm_mesh_describe sees.
// Errors: FM_ERROR_OUT_OF_HOST_MEMORY.
FM_API fm_result fm_mesh_intersections(fm_mesh *mesh, uint64_t most, uint64_t *pairs);

// ---------------------------------------------------------------------------------------------------------------------------
// Queries: on the processor by the CPU backend, in one dispatch on Vulkan; they return when the answers are there
// ---------------------------------------------------------------------------------------------------------------------------

typedef struct fm_closest {
    float point[3];
    float distance;     // +infinity where no triangle lies within the bound
    uint32_t triangle;  // FM_NO_TRIANGLE likewise. Of equally near ones any: float rounding decides
} fm_closest;

// The nearest point of the mesh to each position, if nearer than `bound` (0: no bound). `count` 0 is fine; a position that is not
// finite, or above 1e18 in size, finds nothing. Lengths below 1e-18 are not told apart. Errors: FM_ERROR_INVALID_ARGUMENT for NULL
// or a bound below 0 or NaN, FM_ERROR_OUT_OF_HOST_MEMORY, FM_ERROR_OUT_OF_DEVICE_MEMORY, FM_ERROR_DEVICE_LOST, FM_ERROR_INTERNAL.
// Source: Ericson 2005, "Real-Time Collision Detection", section 5.1.5.
FM_API fm_result fm_mesh_closest(fm_mesh *mesh, const float (*positions)[3], uint32_t count, float bound, fm_closest *closest);

typedef struct fm_mesh_ray {
    float origin[3];
    float first;  // only hits at `first` <= t <= `last` count, where the place is origin + t direction
    float direction[3];
    float last;
} fm_mesh_ray;

typedef struct fm_mesh_hit {
    float t;            // +infinity where nothing is hit
    uint32_t triangle;  // FM_NO_TRIANGLE likewise
    float u, v;         // weights of the triangle's second and third corner
    bool back;          // hit from behind
} fm_mesh_hit;

// The first hit of each ray, or with `any` some hit. A ray through an edge or a corner of triangles that share it does not slip
// through. Errors: as fm_mesh_closest. Source: Woop, Benthin and Wald 2013, "Watertight ray/triangle intersection".
FM_API fm_result fm_mesh_cast(fm_mesh *mesh, const fm_mesh_ray *rays, uint32_t count, bool any, fm_mesh_hit *hits);

// Generalised winding number at each position: how often the mesh goes around it, 1 inside of a closed mesh that looks outwards, 0
// outside, in between where it is open. Groups of triangles that are farther than `accuracy` times their radius (0: 2) count by
// their moments; +infinity sums every triangle. Errors: as fm_mesh_closest. Source: Barill et al. 2018, "Fast winding numbers for
// soups and clouds".
FM_API fm_result fm_mesh_winding(fm_mesh *mesh, const float (*positions)[3], uint32_t count, float accuracy, float *winding);

// ---------------------------------------------------------------------------------------------------------------------------
// Scenes of several objects
// ---------------------------------------------------------------------------------------------------------------------------

// Rows of a matrix: place = (row . (x, y, z, 1)) for each row. Rigid: a rotation and a shift; that is not checked.
typedef struct fm_transform3 {
    float rows[3][4];
} fm_transform3;

// Objects that move rigidly. The scene is a mesh itself, of all objects' triangles in the order of the objects, whose vertices
// follow the objects, so that everything that takes a mesh takes a scene's. Same thread rule as its context.
typedef struct fm_scene fm_scene;

FM_API fm_result fm_scene_create(fm_context *context, fm_scene **scene);
FM_API void fm_scene_destroy(fm_scene *scene);

// Adds an object of the mesh's present shape, which is copied. `object` (NULL allowed) gets its number: 0, 1, ...
// Errors: FM_ERROR_INVALID_ARGUMENT for NULL or a mesh of another context; as fm_mesh_create.
FM_API fm_result fm_scene_add(fm_scene *scene, const fm_mesh *mesh, const fm_transform3 *place, uint32_t *object);

// Where the object is from the next update on, absolutely. Errors: FM_ERROR_INVALID_ARGUMENT for NULL, no such object, or a number
// that is not finite.
FM_API fm_result fm_scene_move(fm_scene *scene, uint32_t object, const fm_transform3 *place);

// New positions of an object in its own frame, from the next update on. Errors: as fm_scene_move and fm_mesh_deform.
FM_API fm_result fm_scene_deform(fm_scene *scene, uint32_t object, const float (*vertices)[3]);

// Carries out what was asked for: only objects that moved or deformed are touched. On Vulkan asynchronous, complete at `ticket`
// (NULL: waits), but after objects were added it makes a new mesh and waits for all work in flight. Passes: "scene", "tree".
// Errors: as fm_mesh_create.
FM_API fm_result fm_scene_update(fm_scene *scene, fm_tree tree, fm_ticket *ticket);

// The scene's mesh, as of the last update; it is the scene's and goes with it, and becomes another by the update after an object
// was added. On Vulkan its arrays in host memory are those of the update that made it, and what moves later moves on the device
// alone: fm_mesh_arrays, _describe, _intersections and fm_mesh_write see the former, as does FM_SIGN_AUTO; queries, voxels, fields,
// pictures and the box of fm_mesh_fit follow the device.
FM_API fm_mesh *fm_scene_mesh(fm_scene *scene);

#ifdef __cplusplus
}
#endif

#endif
