// SPDX-License-Identifier: MIT
#ifndef FM_SHARED_H
#define FM_SHARED_H

// What C and GLSL both know: the push constants of every kernel and the numbers that select variants. Members are ordered so that
// both languages lay them out alike: 64-bit ones first, then 32-bit ones.

#ifdef __STDC__
#include <stdint.h>
typedef uint64_t fm_address;
typedef uint32_t fm_uint;
typedef int32_t fm_int;
typedef float fm_float;
// clang-format off
#define FM_PUSH_STRUCT(name) typedef struct name name; struct name
// clang-format on
#else
#define fm_address uint64_t
#define fm_uint uint
#define fm_int int
#define fm_float float
#define FM_PUSH_STRUCT(name) struct name
#endif

// Element types, as fm_type numbers them.
#define FM_GPU_U8 0
#define FM_GPU_U16 1
#define FM_GPU_U32 2
#define FM_GPU_F32 3
#define FM_GPU_BITS 4
#define FM_GPU_I8 5
#define FM_GPU_I16 6
#define FM_GPU_I32 7
#define FM_GPU_U64 8

// Metrics, as fm_metric numbers them.
#define FM_GPU_L2 0
#define FM_GPU_L1 1
#define FM_GPU_LINF 2

// Where a column kernel reads its rows.
#define FM_SOURCE_BITS 0  // site bits and carries: the distance along x is worked out on the way
#define FM_SOURCE_RAW 1   // the raw distances of the pass before

// What a column kernel writes.
#define FM_TARGET_RAW 0     // raw distances for the next pass
#define FM_TARGET_FINISH 1  // the result
#define FM_TARGET_NEGATE 2  // the inner side of a signed result: only where the raw distance is above 0, negated

#define FM_GPU_NONE 0xffffffffu

// Field formats of a world, as fm_field_format numbers them.
#define FM_GPU_PACKED 0
#define FM_GPU_SPLIT_U8 1
#define FM_GPU_SPLIT_U16 2
#define FM_GPU_SQUARED_U32 3

// A world's work lists. Two headers for tiles along y, of which updates use one in turn while they clear the other, and one for
// tiles along z: a count of entries, then the three group counts of an indirect dispatch.
#define FM_LIST_HEADER_BYTES 16
#define FM_LIST_EMPTY 0, 0, 1, 1
#define FM_LIST_Z 2
#define FM_LIST_HEADERS 3
#define FM_LIST_MAX_GROUPS 65535u

// From the caller's elements to site bits, with the way from each word's ends to the nearest sites in the words beside it.
FM_PUSH_STRUCT(fm_encode_push) {
    fm_address solid;
    fm_address bits;
    fm_address carries;
    fm_address rows;
    fm_uint x;          // voxels of a row
    fm_uint row_words;  // words of a row of bits
    fm_uint low;        // a voxel is solid when low <= value <= low + span (as unsigned numbers, or ordered floats)
    fm_uint span;
};

// One pass along y or z, for the columns of x_begin <= x < x_end.
FM_PUSH_STRUCT(fm_column_push) {
    fm_address bits;
    fm_address carries;
    fm_address raw;       // raw distances of those columns: written by the pass along y, read by the one along z
    fm_address distance;  // 0: not wanted
    fm_address sites_y;   // 32-bit y of the nearest site within the slice; halve.comp: the ways along x
    fm_address index;
    fm_address first_word;  // brute force: the words of bits that this dispatch tries; `raw` and `sites_y` hold the best so far
    fm_uint word_count;
    fm_uint x, y, z;
    fm_uint x_begin, x_end;
    fm_uint pitch;  // elements of a row of raw
    fm_uint row_words;
    fm_uint cap_raw;    // exact, or the bits of a float when weighted
    fm_uint none_bits;  // result where there is no site or none within the cap, in the distance type
    fm_float weight_x, weight_y, weight_z;
    fm_float scale;
};

// An edit of a world, ready to be tried voxel by voxel: fm_brush with a sphere's box, a line's ends in order, and the radius cut to
// what matters. A voxel p is covered where begin <= p <= end, and
//   sphere: |p - from|^2 <= radius2;
//   line: with d = to - from and t = (p - from) . d, where t is in 0 ... d . d: |p - from|^2 d . d - t^2 <= radius2 d . d,
//         else by the nearer end as a sphere. All in 64-bit integers.
FM_PUSH_STRUCT(fm_gpu_brush) {
    fm_address radius2;
    fm_uint kind;   // fm_brush_kind
    fm_uint voxel;  // what it writes
    fm_int from[3];
    fm_int to[3];
    fm_int begin[3];  // first and last voxel of its box, inside the world
    fm_int end[3];
};

// Eight rows y ... y + 7 of slice z, the range of x that is looked at, and the brushes that may touch it: order[first_brush] and
// the next `brush_count` ones.
FM_PUSH_STRUCT(fm_gpu_bundle) {
    fm_uint y, z;
    fm_uint x_begin, x_end;
    fm_uint first_brush, brush_count;
};

// The rows of a world: edits, site bits, carries, solid voxels' entries of the field.
FM_PUSH_STRUCT(fm_rows_push) {
    fm_address voxels;
    fm_address bits;
    fm_address carries;
    fm_address field;
    fm_address colors;
    fm_address lists;    // headers
    fm_address entries;  // of the tiles along y
    fm_address flags;    // a word a tile along y: whether it is listed
    fm_address bundles;
    fm_address brushes;
    fm_address order;
    fm_uint x, y, z;
    fm_uint row_words;
    fm_uint tile_width;
    fm_uint reach;   // carries above this are alike
    fm_uint parity;  // which header of the tiles along y is in use
    fm_uint groups;  // bundles
};

// Columns of a world along y or z. A tile is identified by its place along x + tiles * slice.
FM_PUSH_STRUCT(fm_world_push) {
    fm_address bits;
    fm_address carries;
    fm_address raw;       // distances after the pass along y
    fm_address distance;  // the field
    fm_address list;      // header of the tiles to do
    fm_address entries;
    fm_address marks;  // along y: the flags of the tiles; along z: what changed (world_grid.glsl)
    fm_address next_list;
    fm_address next_entries;
    fm_address next_marks;
    fm_address counted;  // gets the number of tiles done
    fm_uint x, y, z;
    fm_uint row_words;
    fm_uint pitch;  // elements of a row of raw
    fm_uint tiles;  // along x
    fm_uint cap;    // distances saturate here; L2: squared
};

// Which blocks a dispatch of chunk_relax.comp relaxes.
#define FM_CHUNK_LISTED 0  // those of the list
#define FM_CHUNK_INIT 1    // all of the domains, from the site bits
#define FM_CHUNK_SEEDED 2  // all of the domains, from the distances that are there

// A domain of a chunked method. Axes: the first voxel in the low 16 bits, the number of voxels in the high ones.
FM_PUSH_STRUCT(fm_gpu_domain) {
    fm_address scratch;  // its two arrays, one behind the other, each rounded up to 16 bytes
    fm_uint domain[3];
    fm_uint result[3];
};

// Chunked methods. A dispatch covers `count` domains by `groups` work groups each.
FM_PUSH_STRUCT(fm_chunk_push) {
    fm_address bits;
    fm_address field;
    fm_address domains;
    fm_address list;  // blocks to relax, and those to relax in the next round
    fm_address entries;
    fm_address next_list;
    fm_address next_entries;
    fm_address stamps;   // a word a block: the round that it was listed for last
    fm_address counted;  // gets the number of the round; chunk_fim.comp: whether anything changed
    fm_uint x, y, z;
    fm_uint row_words;
    fm_uint chunk;  // edge of the domains, 0: the whole world is one
    fm_uint cap;
    fm_uint count;
    fm_uint groups;
    fm_uint groups_x, groups_y;  // of a domain, along the axes
    fm_uint step;                // of jump flooding; chunk_brute.comp: words of bits that this dispatch tries
    fm_uint which;               // array of scratch memory that holds the input
    fm_uint stamp;               // of the next round
    fm_uint first;               // chunk_relax.comp: number of the round; chunk_brute.comp: the first word
};

// Distances and gradients of a world at positions.
FM_PUSH_STRUCT(fm_sample_push) {
    fm_address field;
    fm_address positions;  // three floats each
    fm_address samples;    // four
    fm_uint count;
    fm_uint x, y, z;
};

// Buffers are whole numbers of pieces of 16 bytes.
FM_PUSH_STRUCT(fm_copy_push) {
    fm_address source;
    fm_address target;
    fm_address pieces;
};

#ifdef __STDC__
_Static_assert(sizeof(fm_gpu_brush) == 64 && sizeof(fm_gpu_bundle) == 24, "as std430 lays them out");
_Static_assert(sizeof(fm_encode_push) <= 128, "push constants are 128 bytes on every device");
_Static_assert(sizeof(fm_column_push) <= 128, "push constants are 128 bytes on every device");
_Static_assert(sizeof(fm_rows_push) <= 128, "push constants are 128 bytes on every device");
_Static_assert(sizeof(fm_world_push) <= 128, "push constants are 128 bytes on every device");
_Static_assert(sizeof(fm_chunk_push) <= 128, "push constants are 128 bytes on every device");
_Static_assert(sizeof(fm_gpu_domain) == 32, "as std430 lays it out");
#endif

#endif
