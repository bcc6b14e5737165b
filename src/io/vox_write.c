// SPDX-License-Identifier: MIT

// Writes a grid as MagicaVoxel models of at most 256 voxels an axis, placed side by side. Tiles without a voxel are left out, but
// for the two at opposite corners, which keep the scene's box as it was.

#include "io/vox.h"

#include <math.h>
#include <stdio.h>
#include <string.h>

enum { EDGE = FM_VOX_MAX_EDGE, CHUNK_HEAD = 12, MAX_ORIGIN = 1 << 20 };

typedef struct tile {
    uint32_t low[3], size[3];
    uint32_t count;  // voxels that are not empty
} tile;

typedef struct plan {
    tile *tiles;
    uint32_t count, capacity;
    uint64_t voxels;
    int32_t origin[3];
} plan;

static uint8_t color_at(const fm_writer *writer, uint32_t x, uint32_t y, uint32_t z) {
    fm_shape shape = writer->volume->desc.shape;
    uint64_t row = y + (uint64_t)shape.y * z;
    if (writer->volume->desc.type == FM_TYPE_BITS) {
        return fm_bit((const uint32_t *)writer->data + row * fm_bits_row_words(shape), x);
    }
    return ((const uint8_t *)writer->data)[row * shape.x + x];
}

// Counts the non-empty voxels of a tile, and writes them when `emit` says so.
static fm_result scan(fm_writer *writer, const tile *t, uint32_t *count, bool emit) {
    *count = 0;
    for (uint32_t z = 0; z < t->size[2]; z++) {
        for (uint32_t y = 0; y < t->size[1]; y++) {
            for (uint32_t x = 0; x < t->size[0]; x++) {
                uint8_t color = color_at(writer, t->low[0] + x, t->low[1] + y, t->low[2] + z);
                if (color == 0) {
                    continue;
                }
                ++*count;
                if (emit) {
                    const uint8_t voxel[4] = {(uint8_t)x, (uint8_t)y, (uint8_t)z, color};
                    FM_TRY(fm_output_write(writer->output, voxel, sizeof voxel));
                }
            }
        }
    }
    return FM_OK;
}

static fm_result make_plan(fm_writer *writer, plan *p) {
    const fm_volume_desc *desc = &writer->volume->desc;
    const uint32_t shape[3] = {desc->shape.x, desc->shape.y, desc->shape.z};
    uint32_t tiles[3];
    for (int i = 0; i < 3; i++) {
        tiles[i] = (uint32_t)fm_div_up(shape[i], EDGE);
        // Where the grid lay in the scene it came from, if it came from one.
        double corner = desc->origin[i];
        p->origin[i] = corner == floor(corner) && fabs(corner) <= MAX_ORIGIN ? (int32_t)corner : 0;
    }
    uint64_t all = (uint64_t)tiles[0] * tiles[1] * tiles[2];
    if (all > UINT32_MAX / sizeof(tile)) {
        return fm_fail(FM_ERROR_UNSUPPORTED, "%s: %u x %u x %u voxels are too many for a .vox file: write .nrrd or .npy",
                       writer->path, shape[0], shape[1], shape[2]);
    }
    p->capacity = (uint32_t)all;
    p->tiles = fm_alloc(writer->allocator, all * sizeof *p->tiles, "the tiles of a .vox file");
    if (!p->tiles) {
        return FM_ERROR_OUT_OF_HOST_MEMORY;
    }
    for (uint32_t i = 0; i < all; i++) {
        const uint32_t at[3] = {i % tiles[0], i / tiles[0] % tiles[1], i / tiles[0] / tiles[1]};
        tile t;
        for (int k = 0; k < 3; k++) {
            t.low[k] = at[k] * EDGE;
            t.size[k] = (uint32_t)fm_min_u64(EDGE, shape[k] - t.low[k]);
        }
        FM_TRY(scan(writer, &t, &t.count, false));
        if (t.count > 0 || i == 0 || i + 1 == all) {
            p->tiles[p->count++] = t;
            p->voxels += t.count;
        }
    }
    return FM_OK;
}

// A node's bytes while they are put together.
typedef struct chunk {
    uint8_t bytes[512];
    uint32_t size;
} chunk;

static void put_u32(chunk *c, uint32_t value) {
    fm_store_u32(c->bytes + c->size, value);
    c->size += 4;
}

static void put_text(chunk *c, const char *text) {
    uint32_t length = (uint32_t)strlen(text);
    put_u32(c, length);
    memcpy(c->bytes + c->size, text, length);
    c->size += length;
}

static fm_result write_head(fm_writer *writer, const char *id, uint32_t size, uint32_t children) {
    uint8_t head[CHUNK_HEAD];
    memcpy(head, id, 4);
    fm_store_u32(head + 4, size);
    fm_store_u32(head + 8, children);
    return fm_output_write(writer->output, head, sizeof head);
}

static fm_result write_chunk(fm_writer *writer, const char *id, const chunk *c) {
    FM_TRY(write_head(writer, id, c->size, 0));
    return fm_output_write(writer->output, c->bytes, c->size);
}

// Nodes: 0 the root's transform, 1 the group, then a transform 2 + 2 i and a shape 3 + 2 i for each tile.
static void make_transform(chunk *c, uint32_t id, uint32_t child, const int32_t *move) {
    char text[64];
    c->size = 0;
    put_u32(c, id);
    put_u32(c, 0);  // no attributes
    put_u32(c, child);
    put_u32(c, UINT32_MAX);             // reserved
    put_u32(c, move ? 0 : UINT32_MAX);  // layer
    put_u32(c, 1);                      // frames
    put_u32(c, move ? 1 : 0);           // attributes of the frame
    if (move) {
        snprintf(text, sizeof text, "%d %d %d", (int)move[0], (int)move[1], (int)move[2]);
        put_text(c, "_t");
        put_text(c, text);
    }
}

static void tile_transform(chunk *c, const plan *p, uint32_t i) {
    int32_t move[3];
    for (int k = 0; k < 3; k++) {
        move[k] = p->origin[k] + (int32_t)(p->tiles[i].low[k] + p->tiles[i].size[k] / 2);
    }
    make_transform(c, 2 + 2 * i, 3 + 2 * i, move);
}

static void tile_shape(chunk *c, uint32_t i) {
    const uint32_t words[] = {3 + 2 * i, 0, 1, i, 0};
    c->size = 0;
    for (size_t k = 0; k < sizeof words / sizeof words[0]; k++) {
        put_u32(c, words[k]);
    }
}

static fm_result write_nodes(fm_writer *writer, const plan *p) {
    chunk c;
    make_transform(&c, 0, 1, NULL);
    FM_TRY(write_chunk(writer, "nTRN", &c));
    FM_TRY(write_head(writer, "nGRP", 12 + 4 * p->count, 0));
    c.size = 0;
    put_u32(&c, 1);
    put_u32(&c, 0);
    put_u32(&c, p->count);
    FM_TRY(fm_output_write(writer->output, c.bytes, c.size));
    for (uint32_t i = 0; i < p->count; i++) {
        c.size = 0;
        put_u32(&c, 2 + 2 * i);
        FM_TRY(fm_output_write(writer->output, c.bytes, c.size));
    }
    for (uint32_t i = 0; i < p->count; i++) {
        tile_transform(&c, p, i);
        FM_TRY(write_chunk(writer, "nTRN", &c));
        tile_shape(&c, i);
        FM_TRY(write_chunk(writer, "nSHP", &c));
    }
    return FM_OK;
}

static uint64_t children_size(const plan *p) {
    chunk c;
    make_transform(&c, 0, 1, NULL);
    uint64_t size = CHUNK_HEAD + c.size + CHUNK_HEAD + 12 + 4 * (uint64_t)p->count + CHUNK_HEAD + FM_VOX_PALETTE_BYTES;
    for (uint32_t i = 0; i < p->count; i++) {
        tile_transform(&c, p, i);
        size += CHUNK_HEAD + 12 + CHUNK_HEAD + 4 + 4 * (uint64_t)p->tiles[i].count + CHUNK_HEAD + c.size;
        tile_shape(&c, i);
        size += CHUNK_HEAD + c.size;
    }
    return size;
}

static fm_result write_models(fm_writer *writer, const plan *p) {
    uint64_t done = 0;
    if (!fm_writer_progress(writer, 0, 4 * p->voxels)) {
        return FM_ERROR_IO;
    }
    for (uint32_t i = 0; i < p->count; i++) {
        const tile *t = &p->tiles[i];
        chunk c = {.size = 0};
        for (int k = 0; k < 3; k++) {
            put_u32(&c, t->size[k]);
        }
        FM_TRY(write_chunk(writer, "SIZE", &c));
        FM_TRY(write_head(writer, "XYZI", 4 + 4 * t->count, 0));
        c.size = 0;
        put_u32(&c, t->count);
        FM_TRY(fm_output_write(writer->output, c.bytes, c.size));
        uint32_t count;
        FM_TRY(scan(writer, t, &count, true));
        done += 4 * (uint64_t)count;
        if (!fm_writer_progress(writer, done, 4 * p->voxels)) {
            return FM_ERROR_IO;
        }
    }
    return FM_OK;
}

static fm_result write_palette(fm_writer *writer) {
    uint8_t palette[FM_VOX_PALETTE_BYTES];
    if (writer->volume->palette) {
        memcpy(palette, writer->volume->palette, sizeof palette);
    } else {
        fm_vox_default_palette(palette);
    }
    // In the file the colours begin with that of index 1.
    const uint8_t unused[4] = {0};
    FM_TRY(write_head(writer, "RGBA", FM_VOX_PALETTE_BYTES, 0));
    FM_TRY(fm_output_write(writer->output, palette + 4, sizeof palette - 4));
    return fm_output_write(writer->output, unused, sizeof unused);
}

static fm_result write_scene(fm_writer *writer, const plan *p) {
    uint64_t size = children_size(p);
    if (size > UINT32_MAX) {
        return fm_fail(FM_ERROR_UNSUPPORTED,
                       "%s: %llu voxels are too many for a .vox file, which ends at 4 GiB: write .nrrd or .npy", writer->path,
                       (unsigned long long)p->voxels);
    }
    const uint8_t head[8] = {'V', 'O', 'X', ' ', 150};
    FM_TRY(fm_writer_open(writer, false));
    FM_TRY(fm_output_write(writer->output, head, sizeof head));
    FM_TRY(write_head(writer, "MAIN", 0, (uint32_t)size));
    FM_TRY(write_models(writer, p));
    FM_TRY(write_nodes(writer, p));
    return write_palette(writer);
}

fm_result fm_vox_write(fm_writer *writer) {
    fm_type type = writer->volume->desc.type;
    if (type != FM_TYPE_U8 && type != FM_TYPE_BITS) {
        return fm_fail(FM_ERROR_UNSUPPORTED, "%s: .vox holds colour indices of uint8, or bits, not %s: write .nrrd or .npy",
                       writer->path, fm_type_name(type));
    }
    if (writer->gzip) {
        return fm_fail(FM_ERROR_UNSUPPORTED, "%s: .vox files are not compressed: leave that out", writer->path);
    }
    plan p = {0};
    fm_result result = make_plan(writer, &p);
    if (result == FM_OK) {
        result = write_scene(writer, &p);
    }
    fm_free(writer->allocator, p.tiles, p.capacity * sizeof *p.tiles);
    return result;
}
