// SPDX-License-Identifier: MIT
#include "io/blocks.h"

#include <string.h>

enum {
    GUARD = 64,  // NULs behind the end
    LEAST = 1 << 14,
};

fm_result fm_blocks_open(fm_blocks *blocks, const fm_allocator *allocator, fm_input *input, fm_progress_fn progress,
                         void *progress_user) {
    *blocks = (fm_blocks){.input = input, .allocator = allocator, .progress = progress, .progress_user = progress_user};
    // A small file fits as a whole, and a byte that it does not have shows its end.
    blocks->capacity = fm_max_u64(LEAST, fm_min_u64(FM_BLOCK, fm_min_u64(fm_input_bound(input), FM_BLOCK) + 1));
    blocks->memory = fm_alloc(allocator, blocks->capacity + GUARD, "a file's buffer");
    if (!blocks->memory) {
        return FM_ERROR_OUT_OF_HOST_MEMORY;
    }
    blocks->at = blocks->end = blocks->memory;
    memset(blocks->end, 0, GUARD);
    return FM_OK;
}

void fm_blocks_close(fm_blocks *blocks) {
    fm_free(blocks->allocator, blocks->memory, blocks->capacity + GUARD);
    blocks->memory = NULL;
}

static fm_result tell(const fm_blocks *blocks) {
    const uint64_t size = fm_input_file_size(blocks->input);
    const uint64_t done = fm_input_source_position(blocks->input);
    if (blocks->progress && !blocks->progress(blocks->progress_user, done, size == UINT64_MAX ? 0 : size)) {
        return fm_fail(FM_ERROR_IO, "cancelled");
    }
    return FM_OK;
}

fm_result fm_blocks_fill(fm_blocks *blocks) {
    FM_TRY(tell(blocks));
    const size_t left = fm_blocks_left(blocks);
    const uint64_t room = blocks->capacity - left;
    if (room == 0) {
        return fm_input_fail(blocks->input, FM_ERROR_FORMAT, "grew while it was read: read it again");
    }
    memmove(blocks->memory, blocks->at, left);
    blocks->at = blocks->memory;
    uint64_t got = 0;
    FM_TRY(fm_input_read_some(blocks->input, blocks->memory + left, room, &got));
    blocks->end = blocks->memory + left + got;
    blocks->ended = got < room;
    memset(blocks->end, 0, GUARD);
    return FM_OK;
}

static fm_result cut_off(const fm_blocks *blocks, uint64_t lacking, const char *part) {
    return fm_input_fail(blocks->input, FM_ERROR_FORMAT,
                         "ends after %llu bytes, within %s, %llu bytes short: the file is truncated, get it again",
                         (unsigned long long)fm_input_position(blocks->input), part, (unsigned long long)lacking);
}

fm_result fm_blocks_need_more(fm_blocks *blocks, size_t wanted, const char *part) {
    FM_TRY(fm_blocks_want(blocks, wanted));
    const size_t left = fm_blocks_left(blocks);
    return left >= wanted ? FM_OK : cut_off(blocks, wanted - left, part);
}

fm_result fm_blocks_read(fm_blocks *blocks, void *target, uint64_t size, const char *part) {
    uint8_t *to = target;
    const uint64_t there = fm_min_u64(size, fm_blocks_left(blocks));
    if (there > 0) {
        memcpy(to, blocks->at, (size_t)there);
        blocks->at += there;
    }
    for (uint64_t done = there; done < size;) {
        const uint64_t piece = fm_min_u64(size - done, FM_BLOCK);
        FM_TRY(tell(blocks));
        FM_TRY(fm_input_read(blocks->input, to + done, piece, part));
        done += piece;
    }
    return FM_OK;
}

fm_result fm_blocks_skip(fm_blocks *blocks, uint64_t size, const char *part) {
    for (;;) {
        const uint64_t there = fm_min_u64(size, fm_blocks_left(blocks));
        blocks->at += there;
        size -= there;
        if (size == 0) {
            return FM_OK;
        }
        if (blocks->ended) {
            return cut_off(blocks, size, part);
        }
        FM_TRY(fm_blocks_fill(blocks));
    }
}

fm_result fm_blocks_drain(fm_blocks *blocks, uint64_t *bytes) {
    *bytes = 0;
    for (;;) {
        for (const uint8_t *at = blocks->at; at < blocks->end; at++) {
            *bytes += !fm_is_space(*at);
        }
        blocks->at = blocks->end;
        if (blocks->ended) {
            return FM_OK;
        }
        FM_TRY(fm_blocks_fill(blocks));
    }
}

fm_result fm_blocks_line(fm_blocks *blocks, uint8_t **line_end, uint64_t *joined) {
    size_t seen = 0;
    for (;;) {
        uint8_t *newline = memchr(blocks->at + seen, '\n', fm_blocks_left(blocks) - seen);
        if (!newline && !blocks->ended) {
            seen = fm_blocks_left(blocks);
            if (seen > FM_BLOCK_MOST) {
                return fm_input_fail(blocks->input, FM_ERROR_FORMAT,
                                     "has a line of over %d bytes: it is not text or its line ends are damaged", FM_BLOCK_MOST);
            }
            FM_TRY(fm_blocks_fill(blocks));
            continue;
        }
        uint8_t *end = newline ? newline : blocks->end;
        uint8_t *last = end - (end > blocks->at && end[-1] == '\r');
        if (!newline || last == blocks->at || last[-1] != '\\') {
            *line_end = end;
            return FM_OK;
        }
        memset(last - 1, ' ', (size_t)(newline + 1 - (last - 1)));
        seen = (size_t)(newline + 1 - blocks->at);
        ++*joined;
    }
}
