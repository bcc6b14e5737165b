// SPDX-License-Identifier: MIT

// Patrick Min's .binvox: runs of a value and a count, over y first, then z, then x.

#include "io/file.h"

#include <stdio.h>
#include <string.h>

enum { MAX_LINE = 256 };

static const uint64_t default_limit = (uint64_t)16 << 30;

static bool binvox_matches(const uint8_t *head, size_t size) {
    return size >= 7 && memcmp(head, "#binvox", 7) == 0;
}

typedef struct binvox_header {
    uint64_t dim[3];  // x, z, y: slowest first
    double translate[3];
    double scale;
    bool has_dim;
} binvox_header;

static bool parse_dim(const char *text, binvox_header *header) {
    int used = 0;
    long long values[3];
    if (sscanf(text, "%lld %lld %lld %n", &values[0], &values[1], &values[2], &used) != 3 || text[used] != 0) {
        return false;
    }
    for (int i = 0; i < 3; i++) {
        if (values[i] < 1) {
            return false;
        }
        header->dim[i] = (uint64_t)values[i];
    }
    return header->has_dim = true;
}

static bool parse_line(const char *line, binvox_header *header) {
    if (strncmp(line, "dim ", 4) == 0) {
        return parse_dim(line + 4, header);
    }
    int used = 0;
    double *move = header->translate;
    if (sscanf(line, "translate %lf %lf %lf %n", &move[0], &move[1], &move[2], &used) == 3 && line[used] == 0) {
        return true;
    }
    if (sscanf(line, "scale %lf %n", &header->scale, &used) == 1 && line[used] == 0) {
        return true;
    }
    return line[0] == '#' || line[0] == 0;
}

static fm_result read_header(fm_reader *reader, binvox_header *header) {
    char line[MAX_LINE];
    for (bool data = false; !data;) {
        FM_TRY(fm_input_line(reader->input, line, sizeof line, NULL));
        data = strcmp(line, "data") == 0;
        if (!data && !parse_line(line, header)) {
            return fm_input_fail(reader->input, FM_ERROR_FORMAT, "has a header line that is not understood: \"%s\"", line);
        }
    }
    if (!header->has_dim) {
        return fm_input_fail(reader->input, FM_ERROR_FORMAT, "has no line \"dim\" in its header");
    }
    return FM_OK;
}

static fm_result binvox_open(fm_reader *reader) {
    binvox_header header = {.scale = 1};
    FM_TRY(read_header(reader, &header));
    const uint64_t axes[3] = {header.dim[0], header.dim[2], header.dim[1]};
    FM_TRY(fm_reader_shape(reader, axes, 3, NULL));
    reader->default_limit = default_limit;
    reader->info.type = FM_TYPE_U8;
    // `scale` is the length of the longest side; `translate` the position of the grid's lowest corner.
    uint64_t longest = fm_max_u64(axes[0], fm_max_u64(axes[1], axes[2]));
    reader->info.has_spacing = true;
    for (int i = 0; i < 3; i++) {
        reader->info.spacing[i] = header.scale / (double)longest;
        reader->info.origin[i] = header.translate[i] + 0.5 * reader->info.spacing[i];
    }
    // Two bytes stand for at most 255 voxels.
    uint64_t bytes;
    if (fm_array_bytes(reader->info.shape, FM_TYPE_U8, &bytes) != FM_OK) {
        return fm_fail_prefix(FM_ERROR_FORMAT, fm_input_name(reader->input));
    }
    return fm_input_require(reader->input, fm_div_up(bytes, 255) * 2, "the smallest run coding of its shape");
}

static fm_result load_runs(fm_reader *reader, uint8_t *data, uint64_t total) {
    fm_shape shape = reader->info.shape;
    uint32_t x = 0, y = 0, z = 0;
    uint64_t told_at = 0;
    for (uint64_t done = 0; done < total;) {
        uint8_t run[2];
        FM_TRY(fm_input_read(reader->input, run, 2, "its runs"));
        if (run[0] > 1 || run[1] == 0 || run[1] > total - done) {
            return fm_input_fail(reader->input, FM_ERROR_FORMAT, "has a bad run (value %u, count %u) at voxel %llu of %llu", run[0],
                                 run[1], (unsigned long long)done, (unsigned long long)total);
        }
        for (uint32_t i = 0; i < run[1]; i++) {
            data[x + shape.x * (y + (uint64_t)shape.y * z)] = run[0];
            if (++y == shape.y) {
                y = 0;
                if (++z == shape.z) {
                    z = 0;
                    x++;
                }
            }
        }
        done += run[1];
        if (done - told_at >= 4 << 20 || done == total) {
            told_at = done;
            if (!fm_reader_progress(reader, done, total)) {
                return FM_ERROR_IO;
            }
        }
    }
    return FM_OK;
}

static fm_result binvox_load(fm_reader *reader, fm_volume *volume) {
    uint64_t total = fm_voxels(reader->info.shape);
    if (!fm_reader_progress(reader, 0, total)) {
        return FM_ERROR_IO;
    }
    return load_runs(reader, volume->data, total);
}

static const char *const extensions[] = {".binvox", NULL};

const fm_codec fm_codec_binvox = {
    .format = FM_FORMAT_BINVOX,
    .name = "binvox",
    .extensions = extensions,
    .matches = binvox_matches,
    .open = binvox_open,
    .load = binvox_load,
};
