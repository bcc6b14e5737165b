// SPDX-License-Identifier: MIT
// Octrees whose files hold parts: a coarse octree, and a finer one for each cube of the box that the surface passes.

#include "octree/build.h"
#include "octree/file.h"

#include "fathom/mesh.h"
#include "mesh/mesh.h"

#include <errno.h>
#include <fcntl.h>
#include <math.h>
#include <stdio.h>
#include <string.h>
#include <sys/stat.h>
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

static bool alike(const fm_octree_info *a, const fm_octree_info *b) {
    return a->kind == b->kind && a->code == b->code && a->attribute == b->attribute && a->sign == b->sign;
}

// Whether a part's box is its cube and no more than a border of cells around it.
static bool in_place(const fm_octree_grid *grid, uint64_t part, const fm_octree_info *info) {
    enum { MOST_BORDER = 8 };
    const double edge = (double)grid->size;
    const uint64_t x = (uint64_t)grid->count[0], y = (uint64_t)grid->count[1];
    const uint64_t place[3] = {part % x, part / x % y, part / x / y};
    bool good = true;
    for (int axis = 0; axis < 3; axis++) {
        const double low = (double)grid->origin[axis] + (double)place[axis] * edge, high = low + edge;
        const double slack = 1e-3 * edge + 1e-5 * fmax(fabs(low), fabs(high)), border = MOST_BORDER * info->cell + slack;
        const double below = low - (double)info->low[axis], above = (double)info->high[axis] - high;
        good = good && below >= -slack && below <= border && above >= -slack && above <= border;
    }
    return good;
}

fm_result fm_fmo_read_part(int file, uint64_t part, const fm_fmo_part *row, const fm_octree_grid *grid, const fm_octree_info *like,
                           const char *name, uint8_t *image, uint8_t *marks, fm_octree *numbers) {
    char place[200];
    fm_fmo_header header;
    snprintf(place, sizeof place, "%.150s: part %llu", name, (unsigned long long)part);
    FM_TRY(fm_fmo_read_at(file, row->offset, image, row->bytes, place));
    FM_TRY(fm_fmo_open_image(image, row->bytes, place, numbers, &header));
    if (header.header_sum != row->header_sum || header.image_bytes != row->bytes || !alike(&numbers->info, like)) {
        return fm_fail(FM_ERROR_FORMAT, "%s: is not the one that the directory tells of: the file is damaged", place);
    }
    if (!in_place(grid, part, &numbers->info)) {
        return fm_fail(FM_ERROR_FORMAT, "%s: its box is not that of its place among the parts: the file is damaged", place);
    }
    memset(marks, 0, fm_octree_marks(numbers));
    return fm_fmo_check_image(image, place, numbers, marks);
}

// ---------------------------------------------------------------------------------------------------------------------------
// Description
// ---------------------------------------------------------------------------------------------------------------------------

typedef struct survey {
    const char *name;
    int file;
    uint64_t bytes, count, most;  // of the file; parts; of the largest one
    fm_fmo_header header;
    fm_fmo_part *rows;
} survey;

static fm_result open_survey(survey *s) {
    struct stat status;
    s->file = open(s->name, O_RDONLY | O_CLOEXEC);
    if (s->file < 0 || fstat(s->file, &status) != 0) {
        return fm_fail(FM_ERROR_IO, "%s: cannot open: %s", s->name, strerror(errno));
    }
    if (!S_ISREG(status.st_mode)) {
        return fm_fail(FM_ERROR_IO, "%s: is no file that can be read in any order: copy what it gives into one", s->name);
    }
    s->bytes = (uint64_t)status.st_size;
    FM_TRY(fm_fmo_read_header(s->file, s->bytes, s->name, &s->header));
    if (s->header.parts[0] == 0) {
        return fm_fail(FM_ERROR_FORMAT, "%s: has no parts: fm_octree_write_parts writes files with parts", s->name);
    }
    s->count = (uint64_t)s->header.parts[0] * s->header.parts[1] * s->header.parts[2];
    return FM_OK;
}

static fm_result survey_rows(fm_context *context, survey *s, fm_octree_parts_info *info) {
    s->rows = fm_octree_alloc(context, s->count * sizeof *s->rows, "the directory of parts");
    if (!s->rows) {
        return FM_ERROR_OUT_OF_HOST_MEMORY;
    }
    FM_TRY(fm_fmo_read_directory(s->file, s->bytes, &s->header, s->name, s->rows));
    *info = (fm_octree_parts_info){.cells = s->header.part_cells, .cell = s->header.part_edge / s->header.part_cells};
    memcpy(info->along, s->header.parts, sizeof info->along);
    for (uint64_t part = 0; part < s->count; part++) {
        const uint64_t bytes = s->rows[part].bytes;
        info->filled += bytes > 0;
        info->bytes += bytes;
        s->most = fm_max_u64(s->most, bytes);
    }
    return FM_OK;
}

static fm_result check_rows(const survey *s, uint8_t *image, uint8_t *marks) {
    const fm_fmo_header *h = &s->header;
    const fm_octree_info like = {.kind = (fm_octree_kind)h->kind,
                                 .code = (fm_octree_code)h->code,
                                 .attribute = (fm_octree_attribute)h->attribute,
                                 .sign = (fm_sign)h->sign};
    fm_octree_grid grid = {.size = (float)h->part_edge};
    for (int axis = 0; axis < 3; axis++) {
        grid.count[axis] = (int32_t)h->parts[axis];
        grid.origin[axis] = h->low[axis];
    }
    for (uint64_t part = 0; part < s->count; part++) {
        fm_octree numbers;
        if (s->rows[part].bytes > 0) {
            FM_TRY(fm_fmo_read_part(s->file, part, &s->rows[part], &grid, &like, s->name, image, marks, &numbers));
        }
    }
    return FM_OK;
}

static fm_result check_parts(fm_context *context, const survey *s) {
    uint8_t *image = fm_octree_alloc(context, s->most, "a part of an octree");
    uint8_t *marks = fm_octree_alloc(context, s->most, "the check of an octree");
    const fm_result result = image && marks ? check_rows(s, image, marks) : FM_ERROR_OUT_OF_HOST_MEMORY;
    fm_octree_free(context, marks, s->most);
    fm_octree_free(context, image, s->most);
    return result;
}

fm_result fm_octree_describe_parts(fm_context *context, const char *path, bool check, fm_octree_parts_info *info) {
    if (!context || !path || !info) {
        return fm_fail(FM_ERROR_INVALID_ARGUMENT, "%s is NULL", !context ? "context" : !path ? "path" : "info");
    }
    survey s = {.name = path, .file = -1};
    fm_octree_parts_info found;
    fm_result result = open_survey(&s);
    result = result == FM_OK ? survey_rows(context, &s, &found) : result;
    result = result == FM_OK && check && found.filled > 0 ? check_parts(context, &s) : result;
    if (result == FM_OK) {
        *info = found;
    }
    fm_octree_free(context, s.rows, s.count * sizeof *s.rows);
    if (s.file >= 0) {
        close(s.file);
    }
    return result;
}
