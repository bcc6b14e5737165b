// SPDX-License-Identifier: MIT
#ifndef FATHOM_WORLD_H
#define FATHOM_WORLD_H

// An editable voxel world and its distance field, kept exact while it is dug and built in.
//
// A voxel is a 32-bit number: 0 is air, anything else is solid; its low 8 bits are an RGB332 colour (red in the highest three
// bits). Edits are queued on the host and carried out, with the field's regeneration, by `fm_world_update`: one submission,
// asynchronous on Vulkan. The conventions of fathom.h hold here too.

#include "fathom/fathom.h"

#ifdef __cplusplus
extern "C" {
#endif

// How the field lies in memory. Distances saturate at the largest value of their type; the colour of air is 0.
typedef enum fm_field_format {
    FM_FIELD_PACKED = 0,   // 32 bits a voxel: the highest 8 are the distance, the lowest 8 the colour. L1 only
    FM_FIELD_SPLIT_U8,     // a plane of 8-bit distances, then a plane of 8-bit colours. L1 only
    FM_FIELD_SPLIT_U16,    // a plane of 16-bit distances, then a plane of 8-bit colours. L1 only
    FM_FIELD_SQUARED_U32,  // a plane of 32-bit squared Euclidean distances, then a plane of 8-bit colours. L2 only
} fm_field_format;

typedef enum fm_world_algorithm {
    // Ours: exact, the whole world, an update costs what it changes. The intermediate results of the separable passes are kept; an
    // edit repeats pass x for the rows that it touches and pass y and z for the columns whose input changed.
    FM_WORLD_EXACT = 0,
    // Every voxel searches all solid voxels of its domain. Exact within it.
    FM_WORLD_BRUTE_FORCE,
    // Fast iterative method: solid 0, air unknown; relaxed with the 6 neighbours until nothing changes. Exact within the domain.
    // Source: Jeong and Whitaker 2008, "A fast iterative method for Eikonal equations"; Fedor 2025, section 4.3.
    FM_WORLD_FIM,
    // Jump flooding of distances, as published: steps halve from the largest power of two below the domains' longest edge to 1, and
    // a voxel takes the least of its own distance and step + that of the 6 voxels a step away. Approximate: never below the exact
    // distance within the domain, and often far above. A ray that trusts it can pass through solid voxels. Source: Fedor 2025,
    // section 4.4, algorithm 6.
    FM_WORLD_JFA_PUBLISHED,
    // Jump flooding of nearest sites over 26 neighbours. Approximate for other metrics, but with these steps exact within the
    // domain for Manhattan distances, the only ones that it computes here: src/world/chunks.h says why. So are the two variants. A
    // domain's edge is at most 1024. Source: Rong and Tan 2006, "Jump flooding in GPU with applications to Voronoi diagram and
    // distance transform".
    FM_WORLD_JFA,
    FM_WORLD_JFA_1_PLUS,  // a step of 1 first. Source: Rong and Tan 2007, "Variants of jump flooding algorithm ..."
    FM_WORLD_JFA_PLUS_2,  // steps of 2 and 1 afterwards
    // FM_WORLD_JFA_PUBLISHED, then FM_WORLD_FIM from there. Exact within the domain. Source: Fedor 2025, section 4.5.
    FM_WORLD_JFA_FIM,
    // Chunks within `focus_chunks` of the focus by `near_algorithm`, the others by `far_algorithm`. Source: Fedor 2025, 4.6.
    FM_WORLD_SELECTIVE,
    // The final kernel of Fedor 2025, kept so that its times can be reproduced: it starts air at 1 and takes minima, so that its
    // field is 1 in all air. No distance field, though a safe one.
    FM_WORLD_PUBLISHED_FINAL,
} fm_world_algorithm;

// What a chunk takes for granted beyond its faces.
typedef enum fm_world_border {
    FM_BORDER_PADDING = 0,  // solid, the world's own faces too: no distance exceeds the way out of the chunk; never too far by that
    FM_BORDER_HALO,         // the 26 chunks around it are input; what lies beyond them counts as air: distances may be too far
    FM_BORDER_EXCHANGE,     // values cross the faces until nothing changes anywhere: exact. FIM and JFA_FIM only
} fm_world_border;

typedef enum fm_world_convergence {
    FM_CONVERGE_DEVICE = 0,  // active blocks relaxed in shared memory, lists and counts on the device
    // One dispatch an iteration; the host reads whether anything changed, as published. Of no effect on the CPU backend.
    FM_CONVERGE_HOST,
} fm_world_convergence;

// How the field is made.
typedef struct fm_world_method {
    fm_world_algorithm algorithm;
    uint32_t chunk;                    // edge: 8, 16, 32, 64, 128 or 256; 0: the whole world is one domain. FM_WORLD_EXACT wants 0
    fm_world_border border;            // of no effect where `chunk` is 0
    fm_world_convergence convergence;  // FIM, JFA_FIM, and SELECTIVE of these
    fm_world_algorithm near_algorithm, far_algorithm;  // SELECTIVE: FIM, JFA_FIM; JFA_PUBLISHED, JFA, JFA_1_PLUS, JFA_PLUS_2. EXACT
                                                       // (0) stands for JFA_FIM and JFA_PUBLISHED
    uint32_t focus_chunks;  // SELECTIVE: edge of the focus box in chunks, centred on the chunk of the focus
    int32_t focus[3];       // SELECTIVE: a voxel position, inside the world or not
} fm_world_method;

// Whether distances by this method may be above the exact ones, so that a ray that trusts them may pass through solid voxels: for
// FM_WORLD_JFA_PUBLISHED, alone or far from the focus of FM_WORLD_SELECTIVE, and for chunks with FM_BORDER_HALO. The other methods
// never are above. Nothing is checked: a method that fm_world_create refuses has an answer too. NULL: false. Any thread.
FM_API bool fm_world_method_overestimates(const fm_world_method *method);

typedef struct fm_world_desc {
    fm_shape shape;  // every axis 1 to 16384
    fm_field_format format;
    fm_world_method method;
    // FM_FIELD_SQUARED_U32: distances (not squared) above this become this; 0: no limit. At most 65535.
    uint32_t max_distance;
    bool exportable;  // the field's memory can be given out, as for fm_volume_desc
} fm_world_desc;

// Same thread rule as its context.
typedef struct fm_world fm_world;

// Creates a world of air. Its field is that of air, the largest distance everywhere; the first update regenerates it.
// Errors: FM_ERROR_INVALID_ARGUMENT, also for a NULL argument. FM_ERROR_UNSUPPORTED for FM_FIELD_SQUARED_U32 with an algorithm
// other than EXACT; for jump flooding of sites in a whole world with an axis above 1024; for `exportable` on the CPU backend or on
// a device without VK_KHR_external_memory_fd; and for EXACT on Vulkan where the device's shared memory does not hold a column along
// y or z. With 48 KiB, and 1,024 invocations a group, FM_FIELD_SQUARED_U32 takes 8192 voxels along these axes, FM_FIELD_SPLIT_U16
// takes 5440, and the other two formats take all that a world may have (5440 on a device without 16-bit floats).
// FM_ERROR_OUT_OF_DEVICE_MEMORY and FM_ERROR_OUT_OF_HOST_MEMORY: the message says how much is needed and how much there is.
// FM_ERROR_DEVICE_LOST; FM_ERROR_INTERNAL when the driver fails.
FM_API fm_result fm_world_create(fm_context *context, const fm_world_desc *desc, fm_world **world);
// Waits for the work in flight. NULL is ignored.
FM_API void fm_world_destroy(fm_world *world);
// The world's descriptor as it is now: the method last set, with the algorithms that SELECTIVE's EXACT stands for and the focus
// where it was moved. NULL, for either, is ignored.
FM_API void fm_world_info(const fm_world *world, fm_world_desc *desc);

// Changes how the field is made; the next update regenerates all of it. Errors: as fm_world_create; then nothing has changed.
FM_API fm_result fm_world_set_method(fm_world *world, const fm_world_method *method);
// Moves the focus of FM_WORLD_SELECTIVE: chunks that change sides are regenerated by the next update. Otherwise it is only noted.
// NULL, for either, is ignored.
FM_API void fm_world_set_focus(fm_world *world, const int32_t focus[3]);

// A box of voxels: first and one past the last, along x, y, z. What lies outside the world is cut off.
typedef struct fm_box {
    int64_t begin[3], end[3];
} fm_box;

typedef enum fm_brush_kind {
    FM_BRUSH_SPHERE = 0,  // all voxels whose centre is at most `radius` from that of `from`; radius 0: one voxel
    FM_BRUSH_BOX,         // from `from` to `to`, both included, in either order
    FM_BRUSH_LINE,        // all voxels whose centre is at most `radius` from the segment between the centres of `from` and `to`
} fm_brush_kind;

// An edit. Positions are voxels, inside the world or not: what falls outside changes nothing. All arithmetic is in integers, so
// that the voxels are the same on every device.
typedef struct fm_brush {
    fm_brush_kind kind;
    uint32_t voxel;   // what the voxels become; 0 deletes
    int32_t from[3];  // |coordinate| <= 2^30; FM_BRUSH_LINE: at most 8192 outside of the world
    int32_t to[3];    // BOX, LINE
    uint32_t radius;  // SPHERE, LINE; larger ones than 2^30 count as that
} fm_brush;

// Queues edits for the next update, in order: a later one overrides an earlier one. They are copied. `count` 0 is fine. Errors:
// FM_ERROR_INVALID_ARGUMENT (the message names the brush), FM_ERROR_RANGE for more than 2^32 - 1 edits in an update,
// FM_ERROR_OUT_OF_HOST_MEMORY; then none of them is queued.
FM_API fm_result fm_world_edit(fm_world *world, const fm_brush *brushes, uint32_t count);

// Copies voxels of a box from or to a dense host array of the box's own shape, x fastest; the box must lie inside the world and
// hold at least one voxel. `write` marks the box dirty and takes effect at once: it waits for the updates in flight, and edits that
// are queued come after it. `read` waits for the newest update; edits that are still queued are not seen. Errors:
// FM_ERROR_INVALID_ARGUMENT; where the device's memory cannot be mapped FM_ERROR_OUT_OF_HOST_MEMORY and
// FM_ERROR_OUT_OF_DEVICE_MEMORY, for what the voxels go through; FM_ERROR_DEVICE_LOST; FM_ERROR_INTERNAL when the driver fails. All
// but the first may leave a part of the box copied, which `write` has not marked then.
FM_API fm_result fm_world_write(fm_world *world, const fm_box *box, const uint32_t *voxels);
FM_API fm_result fm_world_read(fm_world *world, const fm_box *box, uint32_t *voxels);

// Where the voxels lie for the host (element x + X * (y + Y * z)), or NULL where the device's memory cannot be mapped (and for a
// NULL world). Between updates (wait for the newest ticket first) the host may write voxels there and mark what it wrote; reading
// may be slow. Valid until the world is destroyed.
FM_API uint32_t *fm_world_map(fm_world *world);
// Marks voxels dirty that were changed through `fm_world_map` or by the caller's own kernels. NULL, for either, is ignored.
FM_API void fm_world_mark(fm_world *world, const fm_box *box);

// Fills the world from a volume of its shape, in host or device memory of the world's context: integer types, bits and F32.
// A U32 volume is taken as it is, unless it has a palette. Otherwise 0 is air, and value v becomes a solid voxel of the RGB332
// colour nearest to the volume's palette entry v, or, without one, of a colour that stands for v. F32: above 0 is solid.
// Marks everything dirty; queued edits are dropped. The save gives a U8 volume of palette indices (colour 0 of a solid voxel
// becomes the nearest that is not 0) with the RGB332 palette, or a U32 volume of the voxels as they are; `volume` is in host
// memory. Both wait for the newest update. Errors: FM_ERROR_INVALID_ARGUMENT for NULL, another shape, a volume in the device memory
// of another context (load) or of any (save), F64 (load), a type other than U8 and U32 (save); FM_ERROR_OUT_OF_HOST_MEMORY,
// FM_ERROR_OUT_OF_DEVICE_MEMORY, FM_ERROR_DEVICE_LOST, FM_ERROR_INTERNAL as for fm_world_write: these may leave a part of the
// voxels changed and nothing marked.
FM_API fm_result fm_world_load(fm_world *world, const fm_volume *volume);
FM_API fm_result fm_world_save(fm_world *world, fm_volume *volume);

// Carries out what is queued and regenerates the field where that is needed. Returns at once with a ticket on Vulkan (`ticket`
// NULL: waits), except under FM_CONVERGE_HOST, which waits for each iteration as published. Nothing queued and nothing dirty: does
// nothing and gives the ticket of the newest update. Kernels that read the field while an update is in flight must be ordered by
// the ticket; work on the same queue is. At most three updates are in flight: the fourth waits for the first. Edits that fill more
// than one batch (2^20 pairs of an edit and eight rows that it touches) make EXACT on Vulkan regenerate everything, and may wait
// for each other.
// Errors: FM_ERROR_INVALID_ARGUMENT for a NULL world; FM_ERROR_OUT_OF_HOST_MEMORY; FM_ERROR_OUT_OF_DEVICE_MEMORY (what is uploaded,
// and the scratch memory of chunked algorithms); FM_ERROR_RANGE for more than 2^32 - 1 pairs as above; FM_ERROR_UNSUPPORTED for
// more chunks, blocks of 8 x 8 x 8 or work groups than 32 bits count, and for FM_WORLD_BRUTE_FORCE in a domain of more than 2^32
// voxels; FM_ERROR_DEVICE_LOST; FM_ERROR_INTERNAL when the driver fails. The edits stay queued: the next update tries them again.
FM_API fm_result fm_world_update(fm_world *world, fm_ticket *ticket);

// What the newest update did. Waits for it.
typedef struct fm_world_stats {
    uint64_t rows;     // rows of voxels whose sites were looked at, eight together
    uint64_t tiles_y;  // EXACT: tiles of columns (tile_width voxels along x) computed along y
    uint64_t tiles_z;  // ... along z
    uint32_t tile_width;
    uint64_t chunks;  // chunks regenerated
    // FIM, JFA_FIM. On the CPU and under FM_CONVERGE_HOST the most iterations over any domain, the last one that changed nothing
    // left out. Under FM_CONVERGE_DEVICE rounds of blocks, each of which iterates by itself. On the CPU FM_BORDER_EXCHANGE adds its
    // rounds. So these numbers do not compare between backends or convergences.
    uint64_t iterations;
    double host_wait_ms;  // FM_CONVERGE_HOST: time spent waiting for the device
    bool full;            // everything was regenerated
} fm_world_stats;
// Errors: FM_ERROR_INVALID_ARGUMENT for NULL, FM_ERROR_DEVICE_LOST.
FM_API fm_result fm_world_stats_get(fm_world *world, fm_world_stats *stats);

// The field where it lies, for programs that read it on the device: the buffer of the distance plane (or the packed field) and that
// of the colour plane (`colors.buffer` NULL for FM_FIELD_PACKED) and of the voxels. `voxels`, `field`, `colors` may be NULL.
// Valid until the world is destroyed. Errors: FM_ERROR_INVALID_ARGUMENT for a NULL world; FM_ERROR_UNSUPPORTED on the CPU backend:
// see fm_world_field_data.
FM_API fm_result fm_world_vulkan(const fm_world *world, fm_volume_buffer *voxels, fm_volume_buffer *field,
                                 fm_volume_buffer *colors);
// As fm_volume_export_fd, for the packed field or the plane of distances; the plane of colours cannot be exported. Errors:
// FM_ERROR_INVALID_ARGUMENT for NULL, FM_ERROR_UNSUPPORTED on the CPU backend and for a world that was not made `exportable`,
// FM_ERROR_OUT_OF_HOST_MEMORY and FM_ERROR_INTERNAL when the driver fails.
FM_API fm_result fm_world_export_fd(const fm_world *world, int *fd);
// The CPU backend's field in its format, a plane of colours right behind that of distances, as it is after the newest update. NULL
// on Vulkan and for a NULL world.
FM_API const void *fm_world_field_data(const fm_world *world);

// Copies the distances of a box, or of the whole world where `box` is NULL, to a host array of its shape: U8, U16, U32 or F32 (the
// squared distance for FM_FIELD_SQUARED_U32), saturated to the type. A value that the format saturates stays what the format holds.
// `colors` (NULL allowed) is a U8 array. Waits for the newest update. Errors: FM_ERROR_INVALID_ARGUMENT for NULL, a box that holds
// no voxel or reaches out of the world, another shape or type, data that is not aligned to its elements;
// FM_ERROR_OUT_OF_HOST_MEMORY, FM_ERROR_OUT_OF_DEVICE_MEMORY, FM_ERROR_DEVICE_LOST, FM_ERROR_INTERNAL as for fm_world_read: the
// arrays may then be filled in part.
FM_API fm_result fm_world_read_field(fm_world *world, const fm_box *box, const fm_array *distance, const fm_array *colors);

// Distance and gradient at positions in voxel units (voxel centres are whole numbers), by trilinear interpolation of the distances
// (their roots for L2) of the 8 voxels around; positions outside the world take the nearest place in it, and a coordinate that is
// not a number counts as 0. All in one dispatch; waits. `count` 0 is fine. Errors: FM_ERROR_INVALID_ARGUMENT for NULL,
// FM_ERROR_OUT_OF_HOST_MEMORY, FM_ERROR_OUT_OF_DEVICE_MEMORY, FM_ERROR_DEVICE_LOST, FM_ERROR_INTERNAL when the driver fails.
typedef struct fm_world_sample {
    float distance;
    float gradient[3];
} fm_world_sample;
FM_API fm_result fm_world_query(fm_world *world, const float (*positions)[3], uint32_t count, fm_world_sample *samples);

#ifdef __cplusplus
}
#endif

#endif
