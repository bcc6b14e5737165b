// SPDX-License-Identifier: MIT
#ifndef FM_OCTREE_FILE_H
#define FM_OCTREE_FILE_H

// How octrees lie in .fmo files (docs/formats.md). An image is an octree as a file has it: a page with its header and the table of
// its sections, then the sections, each from a new page on. A plain file is one image. A file with parts is the image of the coarse
// octree, then those of the parts that hold a surface, then the directory that says where they are, in the file's last pages.

#include "octree/octree.h"

#include "io/stream.h"

enum {
    FM_FMO_VERSION = 1,
    FM_FMO_PAGE = 4096,
    FM_FMO_SECTIONS = 4,
    FM_FMO_MOST_SECTIONS = 64,  // so that the table is in the first page
    FM_FMO_MOST_PARTS = 1 << 20,
    FM_FMO_MOST_ALONG = 1024,  // an axis
};

// The first byte is no text's, and line ends that a transfer has changed are found out, as in PNG.
#define FM_FMO_MAGIC                                                                                                               \
    "\x89"                                                                                                                         \
    "FMO\r\n\x1a\n"

typedef struct fm_fmo_header {
    uint8_t magic[8];
    uint32_t version, sections;
    uint64_t image_bytes;  // whole pages
    uint32_t kind, method, code, attribute, sign, shared;
    uint32_t size, rounds;
    double origin[3], cell;
    uint32_t cells[3], top[3], levels;
    float band;
    float low[3], high[3], cutoff, threshold;
    uint64_t internal, leaves[24], empty, unshared_bytes, top_bytes;
    double code_error;
    uint32_t parts[3], part_cells;  // all 0 where there are none
    double part_edge;               // parts are cubes from `low` on
    uint32_t table_sum;             // CRC-32 of the page behind the header
    uint32_t header_sum;            // of the header up to here
} fm_fmo_header;

typedef struct fm_fmo_section {
    uint32_t name;     // fm_fmo_name
    uint32_t element;  // bytes of each
    uint64_t offset;   // from the image's first byte
    uint64_t bytes;
    uint32_t sum;  // CRC-32
    uint32_t unused;
} fm_fmo_section;

// Where a part's image is in the file; all 0 where nothing of the surface is in the part. Parts are ordered with x fastest. Behind
// the last stands the sum of all, in four bytes.
typedef struct fm_fmo_part {
    uint64_t offset, bytes;
    uint32_t header_sum;  // of the image
    uint32_t unused;
} fm_fmo_part;

typedef enum fm_fmo_name {
    FM_FMO_WORDS = 0x44524f57,  // "WORD" as the bytes stand
    FM_FMO_VALUES = 0x554c4156,
    FM_FMO_ATTRIBUTES = 0x52545441,
    FM_FMO_EXTRA = 0x52545845
} fm_fmo_name;

_Static_assert(sizeof(fm_fmo_header) == 416 && sizeof(fm_fmo_section) == 32 && sizeof(fm_fmo_part) == 24, "no gaps");
_Static_assert(sizeof(fm_fmo_header) + FM_FMO_MOST_SECTIONS * sizeof(fm_fmo_section) <= FM_FMO_PAGE, "the table is in a page");

// file_write.c: writes the octree's image. Of `about`, which may be NULL, the parts are taken. `written` gets the header.
fm_result fm_fmo_write_image(fm_output *output, const fm_octree *octree, const fm_fmo_header *about, fm_fmo_header *written);
// Completes what is written and gives it its name, or takes it back where `result` is an error; gives that back.
fm_result fm_fmo_place(fm_output *output, fm_result result);
// Sets the sums of a first page.
void fm_fmo_seal(uint8_t page[FM_FMO_PAGE]);

// file_header.c: whether the numbers of a header go together, and are such that casts can count with them.
fm_result fm_fmo_check_header(const fm_fmo_header *header, const char *name);

// file_read.c. Fills an octree's numbers, whose arrays then point into the image: aligned to 8 bytes, `bytes` at hand, of which
// `header->image_bytes` are the image's. Checks what can be checked without looking at the sections. `name` is for messages.
fm_result fm_fmo_open_image(const uint8_t *image, uint64_t bytes, const char *name, fm_octree *octree, fm_fmo_header *header);
// Checks sums and contents. `marks` are fm_octree_marks(octree) bytes, all 0. Neither call takes memory or touches the context, so
// that any thread may make it.
fm_result fm_fmo_check_image(const uint8_t *image, const char *name, const fm_octree *octree, uint8_t *marks);

// The memory of an image, and what gives it back once an octree's `mapped` and `mapped_bytes` are it.
typedef struct fm_fmo_memory {
    void *data;
    uint64_t bytes;
    void (*release)(fm_octree *octree);
} fm_fmo_memory;

// Memory from the context's allocator, counted among its octrees.
fm_result fm_fmo_take_image(fm_context *context, uint64_t bytes, fm_fmo_memory *memory);
void fm_fmo_release(fm_context *context, const fm_fmo_memory *memory);  // of which no octree has been made

// An octree of checked numbers that keeps the memory.
fm_result fm_fmo_keep_image(fm_context *context, const fm_fmo_memory *memory, const fm_octree *numbers, fm_octree **octree);
// Everything together for a whole file in memory, which stays the caller's on failure.
fm_result fm_fmo_read_image(fm_context *context, const fm_fmo_memory *memory, const char *name, fm_octree **octree);

// parts.c. Bytes of a directory; a part of a file in memory; the rows of a file's directory, as many as its header says.
uint64_t fm_fmo_directory_bytes(uint64_t count);
fm_result fm_fmo_read_at(int file, uint64_t offset, void *target, uint64_t bytes, const char *name);
// The header of the image that a file of so many bytes begins with; its octree, in memory of its own.
fm_result fm_fmo_read_header(int file, uint64_t bytes, const char *name, fm_fmo_header *header);
fm_result fm_fmo_read_coarse(fm_context *context, int file, const fm_fmo_header *header, const char *name, fm_octree **octree);
fm_result fm_fmo_read_directory(int file, uint64_t file_bytes, const fm_fmo_header *header, const char *name, fm_fmo_part *rows);
// Reads a part into `image`, of the row's bytes, and checks it: that it is the one that the row tells of, of the kind, code and
// attributes of `like`, covers its cube of `grid`, and all that fm_fmo_check_image does. `marks`: as many bytes as the image, which
// need not be 0. `numbers` get the octree, whose arrays are in the image. Any thread may call it.
fm_result fm_fmo_read_part(int file, uint64_t part, const fm_fmo_part *row, const fm_octree_grid *grid, const fm_octree_info *like,
                           const char *name, uint8_t *image, uint8_t *marks, fm_octree *numbers);

// validate.c: whether rays can go through the octree without leaving its arrays or its levels; what is wrong is FM_ERROR_FORMAT.
fm_result fm_octree_validate(const fm_octree *octree, uint8_t *marks);
uint64_t fm_octree_marks(const fm_octree *octree);

#endif
