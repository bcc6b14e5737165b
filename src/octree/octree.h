// SPDX-License-Identifier: MIT
#ifndef FM_OCTREE_H
#define FM_OCTREE_H

// An octree as its parts see it. Whatever made it, it ends as arrays in host memory and numbers about them (`head`); gpu_octree.c
// keeps a copy of the arrays on the device where the context computes there.

#include "fathom/octree.h"
#include "shaders/include/octree_shared.h"
#include "volume/context.h"

typedef struct fm_gpu_octree fm_gpu_octree;

// An array that grows. `count` elements of `size` bytes are in use.
typedef struct fm_octree_array {
    uint8_t *data;
    uint64_t count, room;
    uint32_t size;
} fm_octree_array;

// What has changed between two versions of the arrays. Array i (words, values, attributes, extra) is as it was up to element
// kept[i], but for words [low, high).
typedef struct fm_octree_change {
    uint64_t since, until;
    uint64_t kept[4], low, high;
} fm_octree_change;

struct fm_octree {
    fm_context *context;
    fm_octree_desc desc;  // as given, with defaults filled in and pointers NULL
    fm_octree_info info;
    fm_octree_head head;         // but for its addresses, which depend on where it is read
    fm_octree_array words;       // of 4 bytes
    fm_octree_array values;      // of 4 bytes; 3 x 4 under FM_OCTREE_FLOATS, 2 under FM_OCTREE_SHORT
    fm_octree_array attributes;  // of 4 bytes, as many as values; none where there are none
    fm_octree_array extra;       // of 4 bytes
    void *state;                 // what updates of the kind need besides (octree_voxels.c), freed by `forget`
    void (*forget)(fm_octree *octree);
    uint64_t version;         // rises with every change of the arrays
    fm_octree_change change;  // up to the newest version, or an earlier one where not all is known
    // Not NULL: the arrays are those of a mapped file (room 0), and this gives it back.
    void (*unmap)(fm_octree *octree);
    void *mapped;
    uint64_t mapped_bytes;
    fm_gpu_octree *gpu;  // made when it is first needed
};

// Between these the floats of a ray neither overflow nor vanish, whatever it divides by whatever. Meshes keep to 1e18, to which a
// box of theirs adds no more than as much again.
#define FM_OCTREE_FARTHEST 0x1p61     // a face of the box
#define FM_OCTREE_LEAST_CELL 0x1p-60  // 8.7e-19
#define FM_OCTREE_GREATEST_CELL 0x1p62

// octree.c
const char *fm_octree_kind_name(fm_octree_kind kind);  // a known one, as the header has it
fm_result fm_octree_check_desc(const fm_octree_desc *desc, fm_octree_desc *filled);
// A new octree with `info` and `head` of the grid that `desc` (checked) asks for in a box; arrays empty.
fm_result fm_octree_new(fm_context *context, const fm_octree_desc *desc, const double low[3], const double high[3],
                        fm_octree **octree);
// Sets how many bytes an element of each array has, which kind and code decide.
void fm_octree_size_arrays(fm_octree *octree);
// Memory that counts as the context's for octrees (FM_PURPOSE_OCTREES): what builds, files and streams of them need besides their
// arrays. As fm_alloc and fm_free; any thread may call them.
void *fm_octree_alloc(fm_context *context, uint64_t bytes, const char *what);
void *fm_octree_alloc_zero(fm_context *context, uint64_t bytes, const char *what);
void fm_octree_free(fm_context *context, void *memory, uint64_t bytes);
// Room for `more` elements behind those in use; false: no memory, with the error set.
bool fm_octree_reserve(fm_octree *octree, fm_octree_array *array, uint64_t more);
void fm_octree_array_free(fm_octree *octree, fm_octree_array *array);
// Counts what `info` tells of the arrays: called when a build or an update is complete.
void fm_octree_counted(fm_octree *octree);
// Called before fm_octree_counted by an update that left the arrays as the change says, whose versions do not count.
void fm_octree_note_change(fm_octree *octree, const fm_octree_change *change);
// The head with the addresses of the host's arrays.
fm_octree_head fm_octree_host_head(const fm_octree *octree);

static inline uint32_t fm_octree_empty_word(double distance, double cutoff) {
    const double part = distance >= cutoff ? 1 : distance <= 0 ? 0 : distance / cutoff;
    // Rounded down, where the published code rounds up: a step must not be longer than the distance.
    return FM_NODE_EMPTY + (uint32_t)(part * (FM_NODE_EMPTY - 1));
}

// gpu_octree.c (gpu_none.c): brings the arrays to the device if they have changed, or only words [begin, end) of them where an
// update says so; the address of the head there.
fm_result fm_gpu_octree_head(fm_octree *octree, uint64_t *address);
// gpu_build.c (gpu_none.c): whether the device builds what a descriptor (filled) asks for, and does so. Where it fails for want of
// its memory, or because its numbers do not suffice (FM_ERROR_UNSUPPORTED), the host may build.
bool fm_gpu_octree_builds(const fm_mesh *mesh, const fm_octree_desc *desc);
fm_result fm_gpu_octree_build(fm_mesh *mesh, const fm_octree_desc *desc, const double low[3], const double high[3],
                              fm_octree **octree);
void fm_gpu_octree_destroy(fm_octree *octree);
// Reads a box, cut to the world, of a world of the octree's context.
fm_result fm_gpu_octree_gather(fm_octree *octree, const fm_world *world, const fm_box *box, uint32_t *voxels);
// gpu_cast.c (gpu_none.c): `epsilon` in world units; `stepped`: sample by sample.
fm_result fm_gpu_octree_cast(fm_octree *octree, const fm_mesh_ray *rays, uint32_t count, float epsilon, bool stepped,
                             fm_octree_hit *hits);

#endif
