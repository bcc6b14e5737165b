// SPDX-License-Identifier: MIT

// OctoMap's binary tree. Each node is 16 bits, two for each of its children: 0 unknown, 1 a free leaf, 2 an occupied leaf, 3 a node
// of its own, which follows in depth-first order. The tree has 16 levels; a leaf above the lowest stands for a cube of voxels.

#include "io/file.h"

#include <stdio.h>
#include <stdlib.h>
#include <string.h>

enum { LEVELS = 16, MAX_LINE = 256, CENTRE = 1 << (LEVELS - 1) };

static const char magic[] = "# Octomap OcTree binary file";
static const uint64_t max_file = (uint64_t)4 << 30;
static const uint64_t default_limit = (uint64_t)16 << 30;

typedef struct octomap {
    uint8_t *bytes;  // the nodes
    uint64_t size;
    uint64_t nodes;
    double resolution;
    uint32_t low[3], high[3];  // keys of the known voxels
} octomap;

// What walking the tree does with a leaf.
typedef struct walk {
    octomap *map;
    uint8_t *data;  // NULL: only the bounds are wanted
    fm_shape shape;
    uint64_t at;  // next node's byte
} walk;

static bool octomap_matches(const uint8_t *head, size_t size) {
    return size >= sizeof magic - 1 && memcmp(head, magic, sizeof magic - 1) == 0;
}

static void bound_leaf(octomap *map, const uint32_t key[3], uint32_t edge) {
    for (int i = 0; i < 3; i++) {
        map->low[i] = key[i] < map->low[i] ? key[i] : map->low[i];
        map->high[i] = key[i] + edge > map->high[i] ? key[i] + edge : map->high[i];
    }
}

static void fill_leaf(walk *w, const uint32_t key[3], uint32_t edge, uint8_t value) {
    const uint32_t *low = w->map->low;
    for (uint32_t z = 0; z < edge; z++) {
        for (uint32_t y = 0; y < edge; y++) {
            uint64_t row = (key[1] - low[1] + y) + w->shape.y * (uint64_t)(key[2] - low[2] + z);
            memset(w->data + row * w->shape.x + (key[0] - low[0]), value, edge);
        }
    }
}

// The node at `key`, whose children have the given edge. False: the bytes end before the tree does.
static bool walk_node(walk *w, const uint32_t key[3], uint32_t edge) {
    if (w->map->size - w->at < 2) {
        return false;
    }
    uint32_t bits = w->map->bytes[w->at] | (uint32_t)w->map->bytes[w->at + 1] << 8;
    w->at += 2;
    w->map->nodes++;
    for (uint32_t child = 0; child < 8; child++) {
        uint32_t state = bits >> 2 * child & 3;
        const uint32_t at[3] = {key[0] + (child & 1) * edge, key[1] + (child >> 1 & 1) * edge, key[2] + (child >> 2) * edge};
        if (state == 3) {
            // Below the lowest level there is nothing.
            if (edge == 1 || !walk_node(w, at, edge / 2)) {
                return false;
            }
        } else if (state != 0) {
            w->map->nodes++;
            if (w->data) {
                fill_leaf(w, at, edge, (uint8_t)state);
            } else {
                bound_leaf(w->map, at, edge);
            }
        }
    }
    return true;
}

static fm_result read_header(fm_reader *reader, octomap *map, uint64_t *claimed) {
    char line[MAX_LINE];
    bool has_size = false;
    for (;;) {
        FM_TRY(fm_input_line(reader->input, line, sizeof line, NULL));
        if (strncmp(line, "data", 4) == 0) {
            break;
        }
        char *end = line;
        if (strncmp(line, "id ", 3) == 0 && strcmp(line + 3, "OcTree") != 0) {
            return fm_input_fail(reader->input, FM_ERROR_UNSUPPORTED,
                                 "holds a tree of kind \"%s\": OcTree is read; convert it with "
                                 "octomap's tools",
                                 line + 3);
        }
        if (strncmp(line, "size ", 5) == 0) {
            *claimed = strtoull(line + 5, &end, 10);
            has_size = end > line + 5;
        } else if (strncmp(line, "res ", 4) == 0) {
            map->resolution = strtod(line + 4, &end);
        }
    }
    if (!has_size || !(map->resolution > 0)) {
        return fm_input_fail(reader->input, FM_ERROR_FORMAT, "lacks a line \"%s\" with a number above 0 in its header",
                             has_size ? "res" : "size");
    }
    return FM_OK;
}

static fm_result octomap_open(fm_reader *reader) {
    octomap *map = fm_reader_state(reader, sizeof *map);
    if (!map) {
        return FM_ERROR_OUT_OF_HOST_MEMORY;
    }
    uint64_t claimed = 0;
    FM_TRY(read_header(reader, map, &claimed));
    FM_TRY(fm_input_slurp(reader->input, max_file, &map->bytes, &map->size));
    memset(map->low, 0xff, sizeof map->low);
    walk w = {.map = map};
    const uint32_t root[3] = {0, 0, 0};
    if (claimed > 0 && !walk_node(&w, root, CENTRE)) {
        return fm_input_fail(reader->input, FM_ERROR_FORMAT,
                             "has a tree that is cut off or too deep: the file is damaged, get it again");
    }
    if (w.at != map->size || map->nodes != claimed) {
        return fm_input_fail(reader->input, FM_ERROR_FORMAT,
                             "claims %llu nodes; its tree has %llu and leaves %llu bytes over: the file is damaged, get it again",
                             (unsigned long long)claimed, (unsigned long long)map->nodes, (unsigned long long)(map->size - w.at));
    }
    if (map->high[0] == 0) {
        return fm_input_fail(reader->input, FM_ERROR_FORMAT, "knows no voxel: its tree is empty");
    }
    uint64_t axes[3];
    reader->info.has_spacing = true;
    for (int i = 0; i < 3; i++) {
        axes[i] = map->high[i] - map->low[i];
        reader->info.spacing[i] = map->resolution;
        reader->info.origin[i] = ((double)map->low[i] - CENTRE + 0.5) * map->resolution;
    }
    reader->info.type = FM_TYPE_U8;
    reader->default_limit = default_limit;
    fm_reader_note(reader, "0 unknown, 1 free, 2 occupied");
    return fm_reader_shape(reader, axes, 3, NULL);
}

static fm_result octomap_load(fm_reader *reader, fm_volume *volume) {
    octomap *map = reader->state;
    const uint32_t root[3] = {0, 0, 0};
    walk w = {.map = map, .data = volume->data, .shape = reader->info.shape};
    if (!fm_reader_progress(reader, 0, map->size)) {
        return FM_ERROR_IO;
    }
    memset(volume->data, 0, (size_t)volume->bytes);
    walk_node(&w, root, CENTRE);
    return fm_reader_progress(reader, map->size, map->size) ? FM_OK : FM_ERROR_IO;
}

static void octomap_close(fm_reader *reader) {
    octomap *map = reader->state;
    fm_free(reader->allocator, map->bytes, map->size);
}

static const char *const extensions[] = {".bt", NULL};

const fm_codec fm_codec_octomap = {
    .format = FM_FORMAT_OCTOMAP,
    .name = "OctoMap",
    .extensions = extensions,
    .matches = octomap_matches,
    .open = octomap_open,
    .load = octomap_load,
    .close = octomap_close,
};
