// SPDX-License-Identifier: MIT
// Octrees whose files hold parts: a coarse octree, and a finer one for each cube of the box that the surface passes.

#include "octree/build.h"
#include "octree/file.h"

#include "fathom/mesh.h"
#include "mesh/mesh.h"

#include <errno.h>
#include <math.h>
#include <string.h>
#include <unistd.h>
#include <zlib.h>

enum { PARTS = 8, COARSER = 8 };

typedef struct division {
    fm_octree_desc desc;  // of the finest
    double low[3], high[3];
    double cell, edge;
    uint32_t coarse, part_cells, border, count[3];
    uint64_t total;
} division;

static fm_result divide(fm_mesh *mesh, const fm_octree_desc *desc, const fm_octree_parts *parts, division *d) {
    FM_TRY(fm_octree_check_desc(desc, &d->desc));
    const uint32_t along = parts && parts->parts > 0 ? parts->parts : PARTS, size = d->desc.size;
    d->coarse = parts && parts->coarse > 0 ? parts->coarse : size / COARSER > 0 ? size / COARSER : 1;
    if (along > size || d->coarse > size) {
        return fm_fail(FM_ERROR_INVALID_ARGUMENT, "%u parts and %u coarse cells along %u cells: at most as many are possible",
                       along, d->coarse, size);
    }
    FM_TRY(fm_octree_box_of(mesh, &d->desc, d->low, d->high));
    double longest = 0;
    for (int axis = 0; axis < 3; axis++) {
        longest = fmax(longest, d->high[axis] - d->low[axis]);
    }
    d->cell = longest / size;
    d->part_cells = (uint32_t)fm_div_up(size, along);
    d->edge = d->part_cells * d->cell;
    // So that rays do not meet the end of a part's octree at its faces; growing needs the triangles beyond them, too.
    d->border = d->desc.method == FM_OCTREE_GROWN ? 4 : 1;
    d->total = 1;
    for (int axis = 0; axis < 3; axis++) {
        d->count[axis] = (uint32_t)fmax(1, ceil((d->high[axis] - d->low[axis]) / d->edge * (1 - 1e-6)));
        d->total *= d->count[axis];
    }
    if (d->total > FM_FMO_MOST_PARTS || fmax(d->count[0], fmax(d->count[1], d->count[2])) > FM_FMO_MOST_ALONG) {
        return fm_fail(FM_ERROR_INVALID_ARGUMENT, "%u x %u x %u parts: at most %d, and %d along an axis, are possible", d->count[0],
                       d->count[1], d->count[2], FM_FMO_MOST_PARTS, FM_FMO_MOST_ALONG);
    }
    return FM_OK;
}

static void part_middle(const division *d, uint64_t part, float middle[3]) {
    const uint64_t place[3] = {part % d->count[0], part / d->count[0] % d->count[1], part / d->count[0] / d->count[1]};
    for (int axis = 0; axis < 3; axis++) {
        middle[axis] = (float)(d->low[axis] + ((double)place[axis] + 0.5) * d->edge);
    }
}

// A cube around the part's middle, of whole cells.
static fm_octree_desc part_desc(const division *d, uint64_t part) {
    fm_octree_desc desc = d->desc;
    float middle[3];
    part_middle(d, part, middle);
    desc.size = d->part_cells + 2 * d->border;
    for (int axis = 0; axis < 3; axis++) {
        desc.low[axis] = (float)((double)middle[axis] - 0.5 * desc.size * d->cell);
        desc.high[axis] = (float)((double)middle[axis] + 0.5 * desc.size * d->cell);
    }
    return desc;
}

static bool has_leaves(const fm_octree *octree) {
    for (size_t level = 0; level < sizeof octree->info.leaves / sizeof octree->info.leaves[0]; level++) {
        if (octree->info.leaves[level] > 0) {
            return true;
        }
    }
    return false;
}

// The surface comes within this of the part's middle if it comes into its octree's box.
static fm_result is_passed(fm_mesh *mesh, const division *d, uint64_t part, bool *passed) {
    float middle[1][3];
    fm_closest nearest;
    const float reach = (float)(0.87 * (d->edge + 2 * d->border * d->cell));
    part_middle(d, part, middle[0]);
    FM_TRY(fm_mesh_closest(mesh, (const float(*)[3])middle, 1, reach, &nearest));
    *passed = nearest.triangle != FM_NO_TRIANGLE;
    return FM_OK;
}

static fm_result write_part(fm_mesh *mesh, const division *d, uint64_t part, fm_output *output, uint64_t *end, fm_fmo_part *row) {
    bool passed = false;
    *row = (fm_fmo_part){0};
    FM_TRY(is_passed(mesh, d, part, &passed));
    if (!passed) {
        return FM_OK;
    }
    const fm_octree_desc desc = part_desc(d, part);
    fm_octree *octree = NULL;
    FM_TRY(fm_octree_build_mesh(mesh, &desc, &octree));
    fm_result result = FM_OK;
    if (has_leaves(octree)) {
        fm_fmo_header header;
        result = fm_fmo_write_image(output, octree, NULL, &header);
        *row = (fm_fmo_part){.offset = *end, .bytes = header.image_bytes, .header_sum = header.header_sum};
        *end += header.image_bytes;
    }
    fm_octree_destroy(octree);
    return result;
}

static fm_result write_coarse(fm_mesh *mesh, const division *d, fm_output *output, uint64_t *end) {
    fm_octree_desc desc = d->desc;
    desc.size = d->coarse;
    for (int axis = 0; axis < 3; axis++) {
        desc.low[axis] = (float)d->low[axis];
        desc.high[axis] = (float)d->high[axis];
    }
    fm_octree *octree = NULL;
    FM_TRY(fm_octree_build_mesh(mesh, &desc, &octree));
    fm_fmo_header about = {.part_cells = d->part_cells, .part_edge = d->edge}, header;
    memcpy(about.parts, d->count, sizeof about.parts);
    const fm_result result = fm_fmo_write_image(output, octree, &about, &header);
    *end = result == FM_OK ? header.image_bytes : 0;
    fm_octree_destroy(octree);
    return result;
}

static fm_result write_directory(fm_output *output, const fm_fmo_part *rows, uint64_t count) {
    static const uint8_t zeros[FM_FMO_PAGE];
    const uint64_t bytes = count * sizeof *rows;
    const uint32_t sum = (uint32_t)crc32_z(0, (const Bytef *)rows, bytes);
    FM_TRY(fm_output_write(output, rows, bytes));
    FM_TRY(fm_output_write(output, &sum, sizeof sum));
    return fm_output_write(output, zeros, fm_fmo_directory_bytes(count) - bytes - sizeof sum);
}

static fm_result write_all(fm_mesh *mesh, const division *d, fm_output *output, fm_fmo_part *rows) {
    uint64_t end = 0;
    FM_TRY(write_coarse(mesh, d, output, &end));
    for (uint64_t part = 0; part < d->total; part++) {
        FM_TRY(write_part(mesh, d, part, output, &end, &rows[part]));
    }
    return write_directory(output, rows, d->total);
}

fm_result fm_octree_write_parts(fm_mesh *mesh, const fm_octree_desc *desc, const fm_octree_parts *parts, const char *path) {
    if (!mesh || !path) {
        return fm_fail(FM_ERROR_INVALID_ARGUMENT, "%s is NULL", mesh ? "path" : "mesh");
    }
    division d;
    FM_TRY(divide(mesh, desc, parts, &d));
    fm_fmo_part *rows = fm_octree_alloc(mesh->context, d.total * sizeof *rows, "the directory of parts");
    if (!rows) {
        return FM_ERROR_OUT_OF_HOST_MEMORY;
    }
    fm_output *output = NULL;
    fm_result result = fm_output_open(&mesh->context->allocator, path, false, &output);
    if (result == FM_OK) {
        result = fm_fmo_place(output, write_all(mesh, &d, output, rows));
    }
    fm_octree_free(mesh->context, rows, d.total * sizeof *rows);
    return result;
}

// ---------------------------------------------------------------------------------------------------------------------------
// Reading
// ---------------------------------------------------------------------------------------------------------------------------

uint64_t fm_fmo_directory_bytes(uint64_t count) {
    return fm_round_up(count * sizeof(fm_fmo_part) + sizeof(uint32_t), FM_FMO_PAGE);
}

fm_result fm_fmo_read_at(int file, uint64_t offset, void *target, uint64_t bytes, const char *name) {
    uint8_t *to = target;
    while (bytes > 0) {
        const ssize_t got = pread(file, to, (size_t)fm_min_u64(bytes, 1 << 30), (off_t)offset);
        if (got < 0 && errno == EINTR) {
            continue;
        }
        if (got < 0) {
            return fm_fail(FM_ERROR_IO, "%s: cannot read: %s", name, strerror(errno));
        }
        if (got == 0) {
            return fm_fail(FM_ERROR_FORMAT, "%s: ends at byte %llu: the file is truncated, get it again", name,
                           (unsigned long long)offset);
        }
        to += got;
        offset += (uint64_t)got;
        bytes -= (uint64_t)got;
    }
    return FM_OK;
}

fm_result fm_fmo_read_header(int file, uint64_t bytes, const char *name, fm_fmo_header *header) {
    _Alignas(8) uint8_t page[FM_FMO_PAGE];
    fm_octree numbers;
    // What a file of less than a page lacks is told by the message for it.
    FM_TRY(fm_fmo_read_at(file, 0, page, fm_min_u64(bytes, sizeof page), name));
    if (bytes >= 2 && page[0] == 0x1f && page[1] == 0x8b) {
        return fm_fail(FM_ERROR_FORMAT, "%s: is gzipped: its parts are read in any order, so unpack it first (gunzip)", name);
    }
    return fm_fmo_open_image(page, bytes, name, &numbers, header);
}

fm_result fm_fmo_read_coarse(fm_context *context, int file, const fm_fmo_header *header, const char *name, fm_octree **octree) {
    fm_fmo_memory memory;
    FM_TRY(fm_fmo_take_image(context, header->image_bytes, &memory));
    fm_result result = fm_fmo_read_at(file, 0, memory.data, memory.bytes, name);
    if (result == FM_OK) {
        result = fm_fmo_read_image(context, &memory, name, octree);
    }
    if (result != FM_OK) {
        fm_fmo_release(context, &memory);
    }
    return result;
}

static bool row_fits(const fm_fmo_part *row, uint64_t begin, uint64_t end) {
    return row->bytes == 0 || (row->offset >= begin && row->offset % FM_FMO_PAGE == 0 && row->bytes >= FM_FMO_PAGE &&
                               row->bytes % FM_FMO_PAGE == 0 && row->bytes <= end && row->offset <= end - row->bytes);
}

fm_result fm_fmo_read_directory(int file, uint64_t file_bytes, const fm_fmo_header *header, const char *name, fm_fmo_part *rows) {
    const uint64_t count = (uint64_t)header->parts[0] * header->parts[1] * header->parts[2];
    const uint64_t pages = fm_fmo_directory_bytes(count);
    uint32_t sum = 0;
    if (file_bytes % FM_FMO_PAGE != 0 || file_bytes < header->image_bytes || file_bytes - header->image_bytes < pages) {
        return fm_fail(FM_ERROR_FORMAT, "%s: has %llu bytes, too few for the directory of its %llu parts: the file is truncated",
                       name, (unsigned long long)file_bytes, (unsigned long long)count);
    }
    const uint64_t begin = file_bytes - pages;
    FM_TRY(fm_fmo_read_at(file, begin, rows, count * sizeof *rows, name));
    FM_TRY(fm_fmo_read_at(file, begin + count * sizeof *rows, &sum, sizeof sum, name));
    if (sum != crc32_z(0, (const Bytef *)rows, count * sizeof *rows)) {
        return fm_fail(FM_ERROR_FORMAT, "%s: the checksum of the directory of parts is wrong: the file is damaged or truncated",
                       name);
    }
    for (uint64_t part = 0; part < count; part++) {
        if (!row_fits(&rows[part], header->image_bytes, begin)) {
            return fm_fail(FM_ERROR_FORMAT, "%s: part %llu: %llu bytes from %llu on are not within the file", name,
                           (unsigned long long)part, (unsigned long long)rows[part].bytes, (unsigned long long)rows[part].offset);
        }
    }
    return FM_OK;
}
