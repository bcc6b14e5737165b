// SPDX-License-Identifier: MIT
#ifndef FM_BLOCKS_H
#define FM_BLOCKS_H

// An input in pieces of a few MiB, for parsers that are to keep up with the disk: they look at bytes in place and ask for more only
// when few are left.

#include "io/stream.h"

enum {
    FM_BLOCK = 4 << 20,
    FM_BLOCK_MOST = FM_BLOCK / 2,  // bytes that can be asked for at once
};

// `at` to `end` have not been taken; NULs follow `end`, which no number and no word goes past.
typedef struct fm_blocks {
    fm_input *input;
    const fm_allocator *allocator;
    uint8_t *at, *end;
    bool ended;  // nothing comes after `end`
    uint8_t *memory;
    uint64_t capacity;
    fm_progress_fn progress;  // NULL: nobody is told
    void *progress_user;
} fm_blocks;

// Leaves `blocks` ready for fm_blocks_close whatever it returns.
fm_result fm_blocks_open(fm_blocks *blocks, const fm_allocator *allocator, fm_input *input, fm_progress_fn progress,
                         void *progress_user);
void fm_blocks_close(fm_blocks *blocks);

// Room behind what is left, filled as far as the file goes.
fm_result fm_blocks_fill(fm_blocks *blocks);

static inline size_t fm_blocks_left(const fm_blocks *blocks) {
    return (size_t)(blocks->end - blocks->at);
}

// Sees to it that `wanted` bytes (at most FM_BLOCK_MOST) are there, or as many as the file has.
static inline fm_result fm_blocks_want(fm_blocks *blocks, size_t wanted) {
    return fm_blocks_left(blocks) >= wanted || blocks->ended ? FM_OK : fm_blocks_fill(blocks);
}

// The same, but a file that ends before is a FM_ERROR_FORMAT that names `part`.
fm_result fm_blocks_need_more(fm_blocks *blocks, size_t wanted, const char *part);
static inline fm_result fm_blocks_need(fm_blocks *blocks, size_t wanted, const char *part) {
    return fm_blocks_left(blocks) >= wanted ? FM_OK : fm_blocks_need_more(blocks, wanted, part);
}

// Exactly `size` bytes, however many, straight to where they belong.
fm_result fm_blocks_read(fm_blocks *blocks, void *target, uint64_t size, const char *part);
fm_result fm_blocks_skip(fm_blocks *blocks, uint64_t size, const char *part);
// All that is left; `*bytes` tells how much that was, blanks and line ends not counted.
fm_result fm_blocks_drain(fm_blocks *blocks, uint64_t *bytes);

// A line that lies complete at `at`; `*line_end` is where its "\n" stands, or the end of the file. A backslash at the end of a line
// joins the next one to it (both bytes become blanks) and counts in `*joined`.
fm_result fm_blocks_line(fm_blocks *blocks, uint8_t **line_end, uint64_t *joined);

// ---------------------------------------------------------------------------------------------------------------------------
// Numbers
// ---------------------------------------------------------------------------------------------------------------------------

// A number at `text`, correctly rounded; NULL when there is none, else where it ends. Bytes that no number holds must follow.
const uint8_t *fm_parse_float(const uint8_t *text, float *value);
// A whole number of at most 18 digits.
const uint8_t *fm_parse_integer(const uint8_t *text, int64_t *value);

static inline bool fm_is_blank(uint8_t byte) {
    return byte == ' ' || byte == '\t' || byte == '\r' || byte == '\v' || byte == '\f';
}

static inline bool fm_is_space(uint8_t byte) {
    return fm_is_blank(byte) || byte == '\n';
}

#endif
