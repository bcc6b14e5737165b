// SPDX-License-Identifier: MIT
#ifndef FM_OCTREE_BUILD_H
#define FM_OCTREE_BUILD_H

// Builds of CLOSEST, DISTANCE and BRICKS on the host. The grid is cut into chunks of 128^3 cells, worked one after the other, each
// by all threads: its triangles, the nearest of them at its corners, which cells become leaves, what these hold. Within a chunk
// lengths are in finest cells and places are counted from its low corner, so that equal parts of a surface give equal bits wherever
// they are.

#include "mesh/triangle.h"
#include "octree/octree.h"

enum {
    FM_CHUNK_LEVEL = 7,
    FM_CHUNK = 1 << FM_CHUNK_LEVEL,
    FM_LEAF_MOST = 4,  // leaves with values have at most this level: the corners of greater ones would be far from the surface
    FM_FIELDS = FM_LEAF_MOST + 1,
    FM_ERROR_BINS = 4096
};

static const float FM_ERROR_STEP = 2e-5f;  // in cells of the leaf's level

// A triangle in finest cells, from the box's origin.
typedef struct fm_cell_triangle {
    double corner[3][3], normal[3], low[3], high[3];
    double slack;  // of what is along the normal
} fm_cell_triangle;

// Triangles near a chunk.
typedef struct fm_octree_soup {
    fm_mesh mesh;             // no more than its arrays: three vertices a triangle
    uint32_t *numbers;        // rising
    uint32_t (*paint)[3][2];  // of each corner: a colour, or the bits of two texture coordinates; NULL: none
    uint64_t room;
} fm_octree_soup;

// Nearest points at the corners of cells of one level in a chunk, x fastest.
typedef struct fm_octree_field {
    uint32_t shape[3];    // corners
    float band;           // farther corners are not known
    float *distance;      // +infinity: not known. DISTANCE: negative inside
    uint32_t *triangles;  // places in the soup; FM_NO_TRIANGLE: not known
    float (*vectors)[3];  // to the nearest point
    uint32_t *codes;      // of the vectors, at corners of leaves
} fm_octree_field;

// A bound for how far the surface is, everywhere in the box: an exact transform of the coarse cells that it passes.
typedef struct fm_octree_far {
    int level;          // of the coarse cells
    uint32_t shape[3];  // of the box, with one cell more on each side
    uint64_t count;
    uint8_t *occupied;
    float *bound;  // in finest cells
    bool outside;  // something is outside of the box
} fm_octree_far;

typedef enum fm_node_state {
    FM_NODE_IS_EMPTY = 0,  // its word: the bound's bits
    FM_NODE_IS_LEAF,       // the number of its first column
    FM_NODE_IS_INTERNAL,   // the number of its children
    FM_NODE_IS_MERGED,     // a leaf that a coarser one replaces
} fm_node_state;

typedef struct fm_octree_nodes {
    uint32_t shape[3];
    uint8_t *states;
    uint32_t *words;
} fm_octree_nodes;

typedef struct fm_octree_chunk {
    uint32_t at[3];      // in chunks
    uint32_t extent[3];  // in finest cells, whole leaves of the greatest level
    fm_octree_field fields[FM_FIELDS];
    fm_octree_nodes nodes[FM_FIELDS];
    uint8_t *memory;
    uint64_t bytes;
} fm_octree_chunk;

typedef struct fm_octree_build fm_octree_build;

struct fm_octree_build {
    fm_context *context;
    fm_octree *octree;
    const fm_octree_desc *desc;  // filled
    double origin[3], cell;
    uint32_t cells[3], chunks[3];
    int grain;      // extents of chunks are multiples of its cells: leaf_most, of BRICKS that of bricks
    int leaf_most;  // the lesser of FM_LEAF_MOST and the top grid's level
    double margin;  // triangles farther from a chunk do not count for it
    fm_octree_far far;

    // The triangles of a chunk; chunks are asked for in rising order.
    void *user;
    fm_result (*soup_of)(fm_octree_build *build, uint64_t chunk, fm_octree_soup *soup);
    fm_octree_soup soup;
    // Of a mesh in memory: the triangles of each chunk, in rising order.
    fm_mesh *mesh;
    fm_sign sign;     // DISTANCE, else NONE; never AUTO
    uint64_t *first;  // chunks + 1
    uint32_t *listed;
    uint64_t chunk_count;

    fm_octree_chunk chunk;
    struct fm_octree_growth *growth;  // GROWN; NULL before the first chunk
    uint32_t *slots;                  // of each chunk: where its roots are, plus 1; 0: it is empty
    fm_octree_array roots;            // words of all nodes of level leaf_most of the chunks that are not empty
    uint64_t *errors;                 // FM_ERROR_BINS a thread: how many vectors are off by a multiple of FM_ERROR_STEP
};

// triangles.c
bool fm_cell_triangle_of(const fm_octree_build *build, const float *const corners[3], fm_cell_triangle *triangle);
// Whether it may come into a cube; false only where it does not.
bool fm_cell_triangle_touches(const fm_cell_triangle *triangle, const double low[3], double edge);
// Calls `fn` for the chunks that it comes near to.
typedef void (*fm_chunk_fn)(void *user, uint64_t chunk);
void fm_cell_triangle_chunks(const fm_octree_build *build, const fm_cell_triangle *triangle, fm_chunk_fn fn, void *user);
fm_result fm_octree_sort_mesh(fm_octree_build *build);
fm_result fm_octree_soup_of_mesh(fm_octree_build *build, uint64_t chunk, fm_octree_soup *soup);
fm_result fm_octree_soup_reserve(const fm_octree_build *build, fm_octree_soup *soup, uint64_t count, bool paint);
void fm_octree_soup_add(const fm_octree_build *build, fm_octree_soup *soup, uint64_t chunk, uint32_t number,
                        const float *const corners[3]);
void fm_octree_soup_free(const fm_octree_build *build, fm_octree_soup *soup);

// far.c
fm_result fm_octree_far_make(fm_octree_build *build);
void fm_octree_far_mark(const fm_octree_build *build, fm_octree_far *far, const fm_cell_triangle *triangle);
fm_result fm_octree_far_finish(fm_octree_build *build);
void fm_octree_far_free(fm_octree_build *build);
// Of a node, by its place in nodes of its level.
float fm_octree_far_bound(const fm_octree_far *far, int level, uint32_t x, uint32_t y, uint32_t z);

// Whether only cells that the surface comes into, or within the band of, are leaves.
static inline bool fm_octree_is_thin(const fm_octree_build *build) {
    return build->desc->band < 1;
}

// chunk.c
// How far the corners of a leaf of a level can be, in finest cells: one of them is within the band of a finest cell's corner, or of
// a thin octree all of them near a place that is within the band of the cell.
float fm_octree_reach(const fm_octree_build *build, int level);
fm_result fm_octree_chunk_make(fm_octree_build *build);
void fm_octree_chunk_place(fm_octree_build *build, uint64_t chunk);
void fm_octree_chunk_free(fm_octree_build *build);
// fields.c, grow.c
fm_result fm_octree_fields_exact(fm_octree_build *build);
fm_result fm_octree_fields_grown(fm_octree_build *build);
void fm_octree_growth_free(fm_octree_build *build);
// How far from every place of a cell growth knows all triangles, in finest cells.
float fm_octree_grown_reach(const fm_octree_chunk *chunk, int level, const uint32_t at[3]);
// What both end with: vectors, lengths and the signs of pseudonormals from triangles; then the signs of winding numbers.
void fm_octree_fields_finish(fm_octree_build *build);
fm_result fm_octree_fields_wind(fm_octree_build *build);
// merge.c: the states of the chunk's nodes.
void fm_octree_merge(fm_octree_build *build);
// sheet.c: of a thin octree, whether a leaf in place of a node's children gives rays the surface that is there.
typedef enum fm_sheet_answer {
    FM_SHEET_NONE = 0,  // its vectors are not those of one smooth sheet: rays go by another rule
    FM_SHEET_OFF,
    FM_SHEET_STAYS,
} fm_sheet_answer;
fm_sheet_answer fm_octree_sheet(const fm_octree_build *build, int level, uint32_t x, uint32_t y, uint32_t z);
// leaves.c: their values, and the words of the chunk's nodes.
fm_result fm_octree_chunk_emit(fm_octree_build *build, uint64_t chunk);
// bricks.c: every top cell's word from what is far, then the chunk's bricks.
void fm_octree_bricks_clear(fm_octree_build *build);
fm_result fm_octree_bricks_emit(fm_octree_build *build);
// share.c: of an octree that is whole. On failure it is of no use.
fm_result fm_octree_share(fm_octree *octree);
// build.c: a build is begun, told of all triangles (their chunks and fm_octree_far_mark), and run. What is begun must be ended,
// which destroys the octree unless it was taken out.
fm_result fm_octree_build_begin(fm_octree_build *build, const double low[3], const double high[3]);
fm_result fm_octree_build_run(fm_octree_build *build);
void fm_octree_build_end(fm_octree_build *build);
fm_result fm_octree_box_of(fm_mesh *mesh, const fm_octree_desc *desc, double low[3], double high[3]);
// Whether the kind keeps the attribute.
fm_result fm_octree_check_attribute(const fm_octree_desc *desc);
fm_result fm_octree_given_box(const fm_octree_desc *desc, double low[3], double high[3]);
// What a build ends with: the arrays are counted and, where the descriptor says so, shared.
fm_result fm_octree_finish(fm_octree *octree);
// From how many of its vectors are off by a multiple of FM_ERROR_STEP.
void fm_octree_tell_errors(fm_octree *octree, const uint64_t bins[FM_ERROR_BINS]);
// join.c: the words above the chunks'.
fm_result fm_octree_join(fm_octree_build *build);
uint32_t fm_octree_bound_word(const fm_octree_build *build, float bound);
fm_result fm_octree_more_words(fm_octree *octree, uint64_t more);

static inline uint64_t fm_node_at(const uint32_t shape[3], uint32_t x, uint32_t y, uint32_t z) {
    return x + (uint64_t)shape[0] * (y + (uint64_t)shape[1] * z);
}

#endif
