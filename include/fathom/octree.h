// SPDX-License-Identifier: MIT
#ifndef FATHOM_OCTREE_H
#define FATHOM_OCTREE_H

// Sparse octrees of surfaces: vectors to closest points, signed distances, and the voxel structures that they are measured against.
// The conventions of fathom.h hold here too. Places and lengths are in world units unless they are said to be in cells.
//
// Space is divided into cubic cells, the finest of edge `cell`; cell (x, y, z) fills the cube from origin + (x, y, z) cell to
// origin + (x + 1, y + 1, z + 1) cell. A cell of level l is 2^l finest ones wide. Trees do not end in one root but in a grid of
// cells of level `levels`, the top grid.
//
// NULL, where a comment does not allow it, is FM_ERROR_INVALID_ARGUMENT; outputs are written only by calls that succeed, but for
// arrays of results, which may then be filled in part. Inputs are read during the call alone and not kept, so that they may be
// freed or changed afterwards, and may not overlap outputs. Calls wait for the device unless they have a ticket.

#include "fathom/mesh.h"
#include "fathom/sdf.h"
#include "fathom/world.h"

#ifdef __cplusplus
extern "C" {
#endif

typedef enum fm_octree_kind {
    // Eight vectors to the closest points of the surface at the corners of each leaf near it; empty leaves say how far it is.
    // Source: Demir and Westermann 2015, "Vector-to-closest-point octree for surface ray-casting".
    FM_OCTREE_CLOSEST = 0,
    FM_OCTREE_DISTANCE,  // eight signed distances in place of vectors. Same source, section 5; Frisken et al. 2000
    FM_OCTREE_VOXELS,    // one voxel a leaf, solid or not, in the same nodes. Same source, section 5
    // Child descriptors with contours, traversed by a stack. Source: Laine and Karras 2010, "Efficient sparse voxel octrees".
    FM_OCTREE_CONTOURS,
    FM_OCTREE_DAG,     // identical subtrees shared. Source: Kaempe, Sintorn and Assarsson 2013, "High resolution sparse voxel DAGs"
    FM_OCTREE_TREE64,  // 4^3 children a node, of which a 64-bit mask says which are there
    FM_OCTREE_BRICKS,  // signed distances in bricks of 8^3 cells within a band, and the top grid that finds them
    FM_OCTREE_KINDS
} fm_octree_kind;

// How corners find their closest points.
typedef enum fm_octree_method {
    FM_OCTREE_EXACT = 0,  // by the mesh's tree
    // As published: each triangle proposes itself to the corners in its box, then corners take over their 26 neighbours' triangles
    // where these are nearer, `rounds` times. Never too near; near a surface seldom too far. Source: sections 3 and 3.1.
    FM_OCTREE_GROWN,
} fm_octree_method;

// How a vector is kept.
typedef enum fm_octree_code {
    FM_OCTREE_SPHERICAL = 0,  // 32 bits: radius 13, by its root; angles 9 and 10. Source: section 4.1
    FM_OCTREE_OCTAHEDRAL,     // ours, 32 bits: radius 10, by its root; 11 and 11 for the direction on an octahedron
    FM_OCTREE_FLOATS,         // three floats: for measuring what the others lose
    // Ours, 16 bits: radius 6, 5 and 5 for the direction. For bands up to 0.2, where vectors are short: half of the memory
    FM_OCTREE_SHORT,
} fm_octree_code;

typedef enum fm_octree_attribute {
    FM_OCTREE_PLAIN = 0,
    FM_OCTREE_TRIANGLE,  // the number of the closest triangle
    FM_OCTREE_COLOR,     // RGBA of 8 bits each at the closest point, interpolated from the vertices'
    FM_OCTREE_TEXTURE,   // texture coordinates there, two of 16 bits, as fractions of 1 after dropping whole turns
} fm_octree_attribute;

// All 0 asks for the defaults.
typedef struct fm_octree_desc {
    fm_octree_kind kind;
    uint32_t size;            // finest cells along the longest edge of the box, at most 2^20; 0: 256
    float low[3], high[3];    // the box; all 0: the mesh's, with a margin of 4 finest cells
    fm_octree_method method;  // CLOSEST, DISTANCE
    // GROWN: how often corners look at their neighbours, at each level of leaves; 0: 8. Corners that then know no
    // triangle take a neighbour's until none is left in the band, so that a small number costs exactness but makes no holes.
    uint32_t rounds;
    fm_octree_code code;  // CLOSEST
    float threshold;      // how far, in finest cells, interpolated values may be off where eight leaves become one; 0: 0.05;
                          // below 0: none do. CONTOURS: below 0 without contours
    // CLOSEST, DISTANCE: leaves all of whose corners are farther from the surface than this, in finest cells, are empty; 0.05 to
    // 3.5, 0: 2 sqrt(3), as published. From 1 on every place of the surface is in a leaf with values, and fewer of them are less
    // memory. Below 1 (ours) the octree is thin: only cells are leaves that the surface comes into, or within the band of (0.1 is
    // enough), by the closest points of their corners; and of CLOSEST leaves become one where the surface that rays find, not the
    // vectors, stays where it is within the threshold. Thin octrees are the smallest, not for rays that go sample by sample.
    float band;
    bool share;          // CLOSEST, DISTANCE: identical subtrees and leaves are kept once
    uint64_t top_bytes;  // of the top grid at most; 0: 1 MiB, of voxels 2 KiB
    // DISTANCE, BRICKS. AUTO is NONE for a mesh that is open (it has edges of one triangle or misoriented ones, or dropped
    // triangles; fm_mesh_info), or a sheet would not be seen: where a mesh has few holes and its inside matters, ask for
    // FM_SIGN_WINDING. fm_octree_info tells what was chosen
    fm_sign sign;
    fm_octree_attribute attribute;  // CLOSEST; VOXELS, CONTOURS and TREE64 of a mesh, but for TEXTURE; others have PLAIN alone
    const uint8_t (*colors)[4];     // COLOR: of each vertex
    const float (*texture)[2];      // TEXTURE: of each vertex
    // Streamed builds: where triangles wait that memory does not hold. NULL: the system's folder for temporary files
    const char *folder;
    uint64_t host_bytes;  // streamed builds: triangles kept in memory; 0: 1 GiB
} fm_octree_desc;

// Same thread rule as its context, which it must not outlive: one thread at a time for all that belongs to one context, casts and
// pictures too, for the first of them brings the octree to the device. What it was made of (mesh, world, source) may go.
typedef struct fm_octree fm_octree;

typedef struct fm_octree_info {
    fm_octree_kind kind;
    fm_octree_method method;
    fm_octree_code code;
    fm_octree_attribute attribute;
    fm_sign sign;
    bool shared;
    double origin[3], cell;                            // the finest
    uint32_t cells[3];                                 // finest ones along the axes
    uint32_t top[3];                                   // of the top grid
    uint32_t levels;                                   // of the top grid's cells
    float low[3], high[3];                             // the box that rays enter
    uint64_t internal;                                 // nodes with children
    uint64_t leaves[24];                               // with values or voxels, of each level
    uint64_t empty;                                    // leaves
    uint64_t node_bytes, leaf_bytes, attribute_bytes;  // what a device reads
    uint64_t unshared_bytes;                           // all three had nothing been shared; else their sum
    double code_error;        // CLOSEST: 99th percentile of how far a stored vector is off, in cells of its leaf's level
    uint32_t parts;           // of the file whose coarse octree this is; 0: it is whole
    double build_ms, gpu_ms;  // of the build or the last update; gpu_ms of kernels, 0 on the CPU backend
} fm_octree_info;

FM_API void fm_octree_destroy(fm_octree *octree);                               // waits for work in flight; NULL is ignored
FM_API void fm_octree_describe(const fm_octree *octree, fm_octree_info *info);  // NULL, for either, is ignored

// ---------------------------------------------------------------------------------------------------------------------------
// From meshes
// ---------------------------------------------------------------------------------------------------------------------------

// Builds an octree of any kind from a mesh in the mesh's context. Voxels are those that the surface touches (FM_SEPARATION_26), and
// their number is 182, a grey of worlds, that of a triangle there and 1 (FM_OCTREE_TRIANGLE), or its colour, red in the lowest bits
// (FM_OCTREE_COLOR). `desc` NULL: the defaults. Members that are said to be of other kinds are of no effect, but for `attribute`. A
// mesh without a triangle makes an octree that no ray meets. On Vulkan the device builds FM_OCTREE_CLOSEST by FM_OCTREE_EXACT,
// without attributes or with triangles, of bands from 1 on, as far as half of its memory goes; the processor builds all others. Its
// octree is the processor's but where rounding decides: which of two places that are equally far is nearest, and deviations at the
// threshold. Bounds of empty leaves may differ, too, and `code_error` is that of a sample where there are many vectors. Errors:
// FM_ERROR_INVALID_ARGUMENT for NULL, sizes and enumerators out of range, a box without volume, with a face beyond 2^61 or of cells
// below 2^-60, whose floats overflow or vanish, attributes without their arrays or of kinds that do not keep them;
// FM_ERROR_UNSUPPORTED for more nodes or leaves than their numbers hold, and for CLOSEST, DISTANCE and BRICKS in a box of more than
// 2^26 chunks of 128^3 cells (as a cube: a size above 51,968), which fm_octree_write_parts divides; FM_ERROR_OUT_OF_HOST_MEMORY,
// FM_ERROR_OUT_OF_DEVICE_MEMORY, FM_ERROR_DEVICE_LOST, FM_ERROR_INTERNAL.
FM_API fm_result fm_octree_build_mesh(fm_mesh *mesh, const fm_octree_desc *desc, fm_octree **octree);

// Builds one from triangles that come piece by piece, so that the mesh need not fit into memory: each is kept for every chunk of
// 128^3 cells that it comes near to, in memory as far as `host_bytes` go and else on disk, in a file that has no name and goes with
// the builder. The processor does it. The result equals, bit for bit, that of fm_octree_build_mesh there with all triangles, the
// same box and method. Same thread rule as its context, which it must not outlive.
typedef struct fm_octree_builder fm_octree_builder;

// `desc` and its folder's name are copied. The box must be given; kinds are FM_OCTREE_CLOSEST, and FM_OCTREE_DISTANCE with
// FM_SIGN_NONE. Errors: as fm_octree_build_mesh, also for `desc` NULL, which has no box; FM_ERROR_UNSUPPORTED for other kinds and
// signs. The folder is looked at when memory does not suffice.
FM_API fm_result fm_octree_builder_create(fm_context *context, const fm_octree_desc *desc, fm_octree_builder **builder);
FM_API void fm_octree_builder_destroy(fm_octree_builder *builder);  // NULL is ignored; a finished octree stays
// Triangles are copied, and numbered on from those before; none at all is fine. `colors` and `texture` of the descriptor do not
// count here: the attributes of these vertices are given with them, and may be NULL where the octree has no such attribute. Errors:
// FM_ERROR_INVALID_ARGUMENT for NULL, a corner that is no vertex, attributes without their array, 2^32 - 1 triangles or more in
// all, a builder that has failed or finished: then nothing has been added, and the builder is as it was; FM_ERROR_IO when the disk
// refuses and FM_ERROR_OUT_OF_HOST_MEMORY: then it is only to be destroyed.
FM_API fm_result fm_octree_builder_add(fm_octree_builder *builder, const fm_mesh_desc *triangles, const uint8_t (*colors)[4],
                                       const float (*texture)[2]);
// Once, and then the builder is only to be destroyed, whatever comes of it. The octree does not need it. Errors: as
// fm_octree_build_mesh, and FM_ERROR_IO; FM_ERROR_INVALID_ARGUMENT for NULL and for a builder that has failed or finished.
FM_API fm_result fm_octree_builder_finish(fm_octree_builder *builder, fm_octree **octree);

// ---------------------------------------------------------------------------------------------------------------------------
// From voxels: VOXELS, CONTOURS, DAG and TREE64
// ---------------------------------------------------------------------------------------------------------------------------

// Where voxels come from: numbers as a world's, 0 is air. Both are called for boxes within `shape` that hold a voxel, only until
// the call returns that the source is given to and, but for `concurrent`, by the thread that made it; they must not use the
// context. A call may ask for a voxel more than once and in any order. What `read` returns other than FM_OK ends the call, which
// returns it.
typedef struct fm_voxel_source {
    void *user;
    uint32_t shape[3];                                                   // each 1 to 2^20
    fm_result (*read)(void *user, const fm_box *box, uint32_t *voxels);  // x fastest
    bool (*air)(void *user, const fm_box *box);  // true: nothing solid is in the box. NULL: every box is read
    bool concurrent;                             // builds may call `read` from several threads of the context at once
} fm_voxel_source;

// Voxel (x, y, z) is the finest cell (x, y, z); origin is -0.5, -0.5, -0.5 and a cell 1, so that cameras of a world fit. Of `desc`
// count `kind`, which has to be given, for 0 is none of these, `top_bytes`, and of CONTOURS whether `threshold` is below 0: their
// contours are those of cells of more than one voxel, around the voxels in them. A world's voxels are taken as they are in its
// memory: edits are seen only after fm_world_update, and its distance field does not matter. On Vulkan they come to the host in
// slabs of 64 rows. Errors: as fm_octree_build_mesh; FM_ERROR_INVALID_ARGUMENT for a `read` that is NULL and a shape out of range;
// FM_ERROR_UNSUPPORTED for other kinds; what `read` returns.
FM_API fm_result fm_octree_build_voxels(fm_context *context, const fm_voxel_source *source, const fm_octree_desc *desc,
                                        fm_octree **octree);
FM_API fm_result fm_octree_build_world(fm_world *world, const fm_octree_desc *desc, fm_octree **octree);

// Takes over what has changed in boxes of the source: only the paths to them are built anew. The octree must have as many cells as
// the source has voxels; of one that was built from a mesh what is built anew has the source's numbers, and voxels no contours.
// Boxes may overlap, and what lies outside of the octree is cut off; `count` 0 is fine. What else has changed of the cells of 16^3
// voxels that boxes touch may be taken over, too. Memory that is no longer in use stays until it is as much as what is, and then
// everything is copied once. Pictures and casts that come later see the change; those in flight are waited for before the device's
// copy changes. On failure the octree is as it was. Errors: as fm_octree_build_voxels; FM_ERROR_INVALID_ARGUMENT for another shape
// and a world of another context; FM_ERROR_UNSUPPORTED for octrees of other kinds.
FM_API fm_result fm_octree_update_voxels(fm_octree *octree, const fm_voxel_source *source, const fm_box *boxes, uint32_t count);
FM_API fm_result fm_octree_update_world(fm_octree *octree, fm_world *world, const fm_box *boxes, uint32_t count);

// ---------------------------------------------------------------------------------------------------------------------------
// Rays
// ---------------------------------------------------------------------------------------------------------------------------

typedef struct fm_octree_hit {
    float t;             // +infinity where nothing is hit
    float normal[3];     // of length 1, towards the ray's origin
    uint32_t attribute;  // of the surface there; of voxels their number
    uint32_t reads;      // of nodes and of leaves' values
} fm_octree_hit;

// The first hit of each ray at `first` <= t <= `last`, t in lengths of its direction, which need not be 1. `epsilon`: how near to
// the surface of CLOSEST, and of DISTANCE without a sign, counts as on it, in finest cells; 0: 0.1. Below 0: rays through CLOSEST
// and DISTANCE go as published, sample by sample, with -epsilon. `count` 0 is fine; a ray that is not finite meets nothing, nor
// does one whose direction has no component of 1e-37 or more, nor one that has not met anything after 2^17 reads of nodes of
// VOXELS, CONTOURS, DAG or TREE64, or 2^14 steps through CLOSEST or DISTANCE. A ray that begins inside of solid voxels or on the
// surface has met it. On Vulkan rays go to the device and hits back in pieces, and the call waits; an octree that has changed is
// brought there first. The octree does not change for the caller. Errors: FM_ERROR_INVALID_ARGUMENT for NULL (`rays` and `hits` may
// be where `count` is 0) or an epsilon that is not finite; FM_ERROR_OUT_OF_HOST_MEMORY, FM_ERROR_OUT_OF_DEVICE_MEMORY,
// FM_ERROR_DEVICE_LOST, FM_ERROR_INTERNAL. Source: Demir and Westermann 2015, sections 2 and 4.2.
FM_API fm_result fm_octree_cast(fm_octree *octree, const fm_mesh_ray *rays, uint32_t count, float epsilon, fm_octree_hit *hits);

// ---------------------------------------------------------------------------------------------------------------------------
// Files (.fmo; docs/formats.md) and octrees larger than memory
// ---------------------------------------------------------------------------------------------------------------------------

// Written to a temporary name and renamed, so that a file that was there stays until all is written; "-" is standard output.
// Errors: FM_ERROR_INVALID_ARGUMENT for NULL, FM_ERROR_IO, FM_ERROR_OUT_OF_HOST_MEMORY.
FM_API fm_result fm_octree_write(const fm_octree *octree, const char *path);
// Nothing in the file is trusted: sizes, checksums, every index. Of a file with parts the coarse octree is read. The file is mapped
// where that is possible, and must then not be cut or changed in place as long as the octree lives; to write another by
// fm_octree_write is fine, for that takes its name only. `path` "-" reads standard input; gzipped files are read, too, and of both
// no more is unpacked or kept than the header says, which must agree with the file's size. Errors: FM_ERROR_INVALID_ARGUMENT for
// NULL; FM_ERROR_IO; FM_ERROR_FORMAT, the message says what is wrong and where; FM_ERROR_OUT_OF_HOST_MEMORY. The device is not
// needed yet: the first cast or picture brings the octree there.
FM_API fm_result fm_octree_read(fm_context *context, const char *path, fm_octree **octree);

// A file of a coarse octree and finer ones of the parts of its box: `parts` along the longest edge, each of `size` / `parts` cells
// along it. The coarse one has `coarse` cells along the longest edge. One part is in memory at a time. `parts` NULL: the defaults.
typedef struct fm_octree_parts {
    uint32_t parts;   // 0: 8
    uint32_t coarse;  // 0: size / 8
} fm_octree_parts;
// As fm_octree_build_mesh of each part, then as fm_octree_write; nothing is there under the name before all is written. Errors: of
// both, FM_ERROR_INVALID_ARGUMENT also for more parts or coarse cells than `size`, and for more parts than a file holds.
FM_API fm_result fm_octree_write_parts(fm_mesh *mesh, const fm_octree_desc *desc, const fm_octree_parts *parts, const char *path);

typedef struct fm_octree_parts_info {
    uint32_t along[3];  // parts along the axes
    uint32_t filled;    // of all parts those that hold some of the surface: the others are not in the file
    uint32_t cells;     // finest ones along a part's edge
    double cell;        // the finest
    uint64_t bytes;     // of the parts in the file
} fm_octree_parts_info;
// Tells of the parts of such a file, which must be one that can be read in any order and is not gzipped. The list of parts is
// checked; with `check`, every part is read and checked as fm_octree_read checks an octree, one at a time. `info` is set on success
// only. Errors: FM_ERROR_INVALID_ARGUMENT for NULL; FM_ERROR_IO; FM_ERROR_FORMAT, also for a file without parts, the message says
// which part is damaged; FM_ERROR_OUT_OF_HOST_MEMORY.
FM_API fm_result fm_octree_describe_parts(fm_context *context, const char *path, bool check, fm_octree_parts_info *info);

#ifdef __cplusplus
}
#endif

#endif
