// SPDX-License-Identifier: MIT
#ifndef FM_VOXELS_H
#define FM_VOXELS_H

// Octrees of voxels: VOXELS, CONTOURS, DAG and TREE64. What differs between them is how a node lies in memory: five functions a
// kind. How voxels are read, cells merged, paths updated and memory that is no longer needed given back is the same for all.
//
// Nothing in the arrays but the top grid is ever overwritten. A node is written after its children, behind everything else; an
// update writes new nodes for the paths that it touches and then exchanges words of the top grid. So whatever fails, the words in
// front of the old ends are still the old octree. What is out of use stays until it is more than half, and then everything that is
// in use is copied.

#include "octree/octree.h"

typedef enum fm_ref_type { FM_REF_EMPTY = 0, FM_REF_SOLID, FM_REF_NODE } fm_ref_type;

// A cell of some level: nothing, solid voxels of one number, or a node of the kind.
typedef struct fm_voxel_ref {
    uint32_t type;
    uint32_t contour;  // CONTOURS: of this cell; 0: none
    uint32_t w[4];     // SOLID: w[0] is the voxels' number; NODE: the kind's own
} fm_voxel_ref;

enum { FM_BRANCHES = 64, FM_PALETTE = 4096 };

typedef struct fm_voxel_trees fm_voxel_trees;

typedef struct fm_voxel_kind {
    uint32_t (*branch)(uint32_t level);  // how many levels below a node its children are: 1 or 2
    // Children in order x + b y + b^2 z where b is 2 or 4; neither all of them are empty nor all solid of one number.
    fm_result (*join)(fm_voxel_trees *trees, uint32_t level, const fm_voxel_ref *children, fm_voxel_ref *node);
    void (*split)(const fm_voxel_trees *trees, uint32_t level, const fm_voxel_ref *node, fm_voxel_ref *children);
    // The contour around children; NULL: the kind has none
    uint32_t (*around)(const fm_voxel_trees *trees, const fm_voxel_ref *children);
    // Words of the top grid.
    fm_result (*place)(fm_voxel_trees *trees, const fm_voxel_ref *cell, uint32_t *word);
    fm_voxel_ref (*placed)(const fm_voxel_trees *trees, uint32_t word);
    bool shared;     // nodes have more than one parent; w[0] tells them apart
    bool colorless;  // numbers are not kept
} fm_voxel_kind;

extern const fm_voxel_kind fm_kind_voxels, fm_kind_contours, fm_kind_dag, fm_kind_tree64;

// A node that others can share: where it begins, and the hash of its words. FM_GONE_NODE: a failed update had written it.
#define FM_GONE_NODE UINT32_MAX

typedef struct fm_voxel_known {
    uint32_t word, hash;
} fm_voxel_known;

// NULL for kinds that are not of voxels.
const fm_voxel_kind *fm_voxel_kind_of(fm_octree_kind kind);

// octree->state of such octrees.
struct fm_voxel_trees {
    fm_octree *octree;
    const fm_voxel_kind *kind;
    uint64_t compact;               // elements of the arrays when they last held nothing else than what is in use
    uint32_t palette[FM_PALETTE];   // where a number may stand in `values`
    fm_voxel_known *nodes;          // DAG: by hash; word 0: none
    uint64_t node_room, node_used;  // of the table
    uint64_t node_count;            // nodes in the arrays
    uint64_t internal, unshared;    // nodes, and their words, were none of them shared
};

// Voxels are read in cubes of 2^6.
enum { FM_TILE_LEVEL = 6, FM_TILE = 1 << FM_TILE_LEVEL, FM_TILE_VOXELS = FM_TILE * FM_TILE * FM_TILE };

// Voxels of a cube in memory.
typedef struct fm_voxel_block {
    const uint32_t *at;
    uint64_t row, slice;  // from one row, and from one slice, to the next
} fm_voxel_block;

typedef struct fm_voxel_crew fm_voxel_crew;

// Where voxels are read from while an octree is built or updated.
typedef struct fm_voxel_feed {
    const fm_voxel_source *source;
    const uint32_t *dense;  // all voxels, where they lie in memory; else NULL
    // CONTOURS of a surface: that of a solid finest cell in the box that was read last. NULL: none
    uint32_t (*contour)(void *user, const uint32_t cell[3]);
    void *user;          // what `read` and `contour` are given
    void *const *users;  // one for each worker, who then all read at once, with the first in `user`; NULL: see source->concurrent
    uint32_t *tile, *part;  // what is read goes here; fm_voxel_feed_open
    fm_voxel_crew *crew;    // voxel_crew.c; NULL: the calling thread builds alone
} fm_voxel_feed;

// voxel_cells.c: cells from voxels.
fm_result fm_voxel_feed_open(fm_context *context, fm_voxel_feed *feed);
void fm_voxel_feed_close(fm_context *context, fm_voxel_feed *feed);
// The box of a cell, cut to the voxels that there are; false: nothing is left, or nothing but air.
bool fm_voxel_box(const fm_voxel_feed *feed, uint32_t level, const uint32_t corner[3], fm_box *box);
// The voxels in the box of a cell of FM_TILE_LEVEL at most; what lies outside is air.
fm_result fm_voxel_read(const fm_voxel_feed *feed, uint32_t level, const fm_box *box, fm_voxel_block *voxels);
fm_result fm_voxel_from_block(fm_voxel_trees *trees, const fm_voxel_feed *feed, fm_voxel_block from, uint32_t level,
                              const uint32_t corner[3], fm_voxel_ref *cell);
// Top cells that are smaller than tiles: those of one, of which number `i` has no place in the grid where this is false.
bool fm_voxel_small_top(const fm_octree *octree, const uint32_t tile[3], uint32_t i, uint32_t top[3]);
fm_result fm_voxel_from_tile(fm_voxel_trees *trees, const fm_voxel_feed *feed, fm_voxel_block tile, const uint32_t top[3],
                             fm_voxel_ref *cell);
// The cell of `level` at `corner` (finest cells).
fm_result fm_voxel_cell(fm_voxel_trees *trees, fm_voxel_feed *feed, uint32_t level, const uint32_t corner[3], fm_voxel_ref *cell);
// The same where `old` stood, but for what none of the boxes touches.
fm_result fm_voxel_changed(fm_voxel_trees *trees, fm_voxel_feed *feed, uint32_t level, const uint32_t corner[3],
                           const fm_box *boxes, uint32_t count, const fm_voxel_ref *old, fm_voxel_ref *cell);
// All top cells, of an octree whose arrays are empty.
fm_result fm_voxel_all(fm_voxel_trees *trees, fm_voxel_feed *feed);
// One cell from its children.
fm_result fm_voxel_joined(fm_voxel_trees *trees, uint32_t level, const fm_voxel_ref *children, fm_voxel_ref *cell);
// Counts children among what `info` tells, or no longer.
void fm_voxel_count(fm_voxel_trees *trees, uint32_t level, const fm_voxel_ref *children, bool away);
// A top cell that is no node.
void fm_voxel_count_top(fm_voxel_trees *trees, const fm_voxel_ref *cell, bool away);

// The top grid, empty, and what makes the words behind it begin where a kind's nodes may.
fm_result fm_voxel_begin(fm_voxel_trees *trees);

// A cell of one octree in another, with all that is in it. `known`, of shared nodes: where they went, by where they were; 0:
// nowhere yet.
typedef struct fm_voxel_copying {
    const fm_voxel_trees *from;
    fm_voxel_trees *to;
    uint32_t *known;
} fm_voxel_copying;

fm_result fm_voxel_copy(const fm_voxel_copying *work, uint32_t level, const fm_voxel_ref *cell, fm_voxel_ref *copy);

// voxel_crew.c: the threads of the context build the tiles of an octree, some at a time, each in memory of its own, from where they
// are copied in order. So the octree has the same bytes as one that one thread builds. Of one thread, or one tile, none is made.
fm_result fm_voxel_crew_open(fm_voxel_trees *trees, fm_voxel_feed *feed);
void fm_voxel_crew_close(fm_voxel_feed *feed);
// Whether the next tile is in a cell of FM_TILE_LEVEL at least.
fm_result fm_voxel_crew_reaches(fm_voxel_crew *crew, uint32_t level, const uint32_t corner[3], bool *reaches);
// Copies a cell of the next tile, the one or, where the top cells are smaller, number `i` of them.
fm_result fm_voxel_crew_copy(fm_voxel_crew *crew, uint32_t i, fm_voxel_ref *cell);
// On to the tile behind it.
void fm_voxel_crew_pass(fm_voxel_crew *crew);

static inline uint64_t fm_voxel_tops(const fm_octree *octree) {
    return (uint64_t)octree->info.top[0] * octree->info.top[1] * octree->info.top[2];
}

static inline uint32_t *fm_voxel_words(const fm_voxel_trees *trees) {
    return (uint32_t *)(void *)trees->octree->words.data;
}

// voxels.c: where a number stands in `values`, which it enters unless it has been seen lately.
fm_result fm_voxel_number(fm_voxel_trees *trees, uint32_t number, uint32_t *index);
// Room in an array, within what an index of `limit` reaches; the index of the first element is told.
fm_result fm_voxel_room(fm_voxel_trees *trees, fm_octree_array *array, uint64_t count, uint64_t limit, uint64_t *first);
// What builds from meshes (voxel_mesh.c) share with those from sources. `desc` is checked, its kind one of the four.
fm_result fm_voxel_build(fm_context *context, fm_voxel_feed *feed, const fm_octree_desc *desc, const double low[3],
                         const double high[3], fm_octree **octree);
// voxel_mesh.c: of the surface of a mesh. `desc` is checked; the numbers are 182, the triangle's and 1, or its colour.
fm_result fm_octree_voxels_from_mesh(fm_mesh *mesh, const fm_octree_desc *desc, const double low[3], const double high[3],
                                     fm_octree **octree);
// What sources and worlds share.
fm_result fm_voxel_build_fed(fm_context *context, fm_voxel_feed *feed, const fm_octree_desc *desc, fm_octree **octree);
fm_result fm_voxel_update_fed(fm_octree *octree, fm_voxel_feed *feed, const fm_box *boxes, uint32_t count);

#endif
