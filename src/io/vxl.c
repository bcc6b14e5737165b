// SPDX-License-Identifier: MIT

// Ace of Spades maps: 512 x 512 columns of 64 voxels, z downwards, each a chain of spans. A span is four bytes (its length in
// words, or 0 for the last one; first and last voxel of the coloured top; first voxel of the air above it) and a word for each
// colour. Everything that is not air is solid. The file has no header.

#include "io/file.h"

#include <string.h>

enum { EDGE = 512, HEIGHT = 64, WORD = 4 };

static bool vxl_matches(const uint8_t *head, size_t size) {
    (void)head;
    (void)size;
    return false;
}

static fm_result vxl_open(fm_reader *reader) {
    reader->info.shape = (fm_shape){EDGE, EDGE, HEIGHT};
    reader->info.type = FM_TYPE_U8;
    fm_reader_note(reader, "z runs downwards; colours set aside");
    return fm_input_require(reader->input, (uint64_t)EDGE * EDGE * WORD, "the smallest map");
}

static fm_result load_column(fm_reader *reader, uint8_t *column) {
    const uint64_t layer = (uint64_t)EDGE * EDGE;
    for (uint32_t floor = 0;;) {
        uint8_t span[WORD];
        FM_TRY(fm_input_read(reader->input, span, sizeof span, "its columns"));
        uint32_t words = span[0], top = span[1], last = span[2], air = span[3];
        uint32_t colors = last + 1 >= top ? last + 1 - top : HEIGHT;
        // Spans go down the column, and a span that is followed by another holds at least its own colours.
        if (air < floor || air > top || top > HEIGHT || last >= HEIGHT || colors >= HEIGHT || (words != 0 && words < 1 + colors)) {
            return fm_input_fail(reader->input, FM_ERROR_FORMAT,
                                 "has a bad span (%u %u %u %u): it is damaged or no map of 512 x 512 x 64", words, top, last, air);
        }
        for (uint32_t z = air; z < top; z++) {
            column[layer * z] = 0;
        }
        FM_TRY(fm_input_skip(reader->input, (uint64_t)WORD * (words ? words - 1 : colors), "its columns"));
        if (words == 0) {
            return FM_OK;
        }
        floor = top;
    }
}

static fm_result vxl_load(fm_reader *reader, fm_volume *volume) {
    uint8_t *data = volume->data;
    memset(data, 1, (size_t)volume->bytes);
    for (uint32_t y = 0; y < EDGE; y++) {
        if (!fm_reader_progress(reader, y, EDGE)) {
            return FM_ERROR_IO;
        }
        for (uint32_t x = 0; x < EDGE; x++) {
            FM_TRY(load_column(reader, data + x + EDGE * y));
        }
    }
    return fm_reader_progress(reader, EDGE, EDGE) ? FM_OK : FM_ERROR_IO;
}

static const char *const extensions[] = {".vxl", NULL};

const fm_codec fm_codec_vxl = {
    .format = FM_FORMAT_VXL,
    .name = "Ace of Spades",
    .extensions = extensions,
    .no_magic = true,
    .matches = vxl_matches,
    .open = vxl_open,
    .load = vxl_load,
};
