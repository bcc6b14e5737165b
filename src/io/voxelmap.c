// SPDX-License-Identifier: MIT

// The text maps of the 3D voxel benchmarks for path finding (Brewer and Sturtevant, SoCS 2018): "voxel X Y Z", then a line "x y z"
// for each occupied voxel.

#include "io/file.h"

#include <stdlib.h>
#include <string.h>

enum { MAX_LINE = 128, TOLD_EVERY = 1 << 16 };

static const uint64_t default_limit = (uint64_t)16 << 30;

static bool voxelmap_matches(const uint8_t *head, size_t size) {
    return size >= 6 && memcmp(head, "voxel ", 6) == 0;
}

// Three whole numbers from 0, and nothing else.
static bool parse_three(const char *text, uint64_t values[3]) {
    for (int i = 0; i < 3; i++) {
        char *end;
        text += strspn(text, " \t");
        if (*text < '0' || *text > '9') {
            return false;
        }
        values[i] = strtoull(text, &end, 10);
        text = end;
    }
    return text[strspn(text, " \t")] == 0;
}

static fm_result voxelmap_open(fm_reader *reader) {
    char line[MAX_LINE];
    uint64_t axes[3];
    FM_TRY(fm_input_line(reader->input, line, sizeof line, NULL));
    if (!parse_three(line + 5, axes)) {
        return fm_input_fail(reader->input, FM_ERROR_FORMAT, "has the first line \"%s\": \"voxel X Y Z\" is expected", line);
    }
    reader->info.type = FM_TYPE_U8;
    reader->default_limit = default_limit;
    return fm_reader_shape(reader, axes, 3, NULL);
}

static fm_result voxelmap_load(fm_reader *reader, fm_volume *volume) {
    fm_shape shape = reader->info.shape;
    uint8_t *data = volume->data;
    uint64_t total = fm_max_u64(1, fm_input_bound(reader->input));
    uint64_t start = fm_input_position(reader->input);
    memset(data, 0, (size_t)volume->bytes);
    for (uint64_t count = 0;; count++) {
        char line[MAX_LINE];
        uint64_t at[3];
        bool end = false;
        if (count % TOLD_EVERY == 0) {
            uint64_t done = fm_input_position(reader->input) - start;
            if (!fm_reader_progress(reader, fm_min_u64(done, total), total)) {
                return FM_ERROR_IO;
            }
        }
        FM_TRY(fm_input_line(reader->input, line, sizeof line, &end));
        if (end) {
            break;
        }
        if (line[0] == 0) {
            continue;
        }
        if (!parse_three(line, at) || at[0] >= shape.x || at[1] >= shape.y || at[2] >= shape.z) {
            return fm_input_fail(reader->input, FM_ERROR_FORMAT, "has the line \"%s\": a voxel of the %u x %u x %u map is expected",
                                 line, shape.x, shape.y, shape.z);
        }
        data[at[0] + shape.x * (at[1] + shape.y * at[2])] = 1;
    }
    return fm_reader_progress(reader, total, total) ? FM_OK : FM_ERROR_IO;
}

static const char *const extensions[] = {".3dmap", NULL};

const fm_codec fm_codec_voxelmap = {
    .format = FM_FORMAT_3DMAP,
    .name = "3dmap",
    .extensions = extensions,
    .matches = voxelmap_matches,
    .open = voxelmap_open,
    .load = voxelmap_load,
};
