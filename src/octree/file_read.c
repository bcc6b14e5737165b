// SPDX-License-Identifier: MIT
// Octrees from .fmo files, of which nothing is trusted.

#include "octree/file.h"

#include <fcntl.h>
#include <math.h>
#include <string.h>
#include <sys/mman.h>
#include <sys/stat.h>
#include <unistd.h>
#include <zlib.h>

enum { MOST_CELLS = 1 << 20, MOST_LEVELS = 20 };
static const uint64_t MOST_BYTES = 1ull << 48;  // of a file that cannot be mapped

static fm_result check_start(const uint8_t *image, uint64_t bytes, const char *name, fm_fmo_header *header) {
    if (bytes < sizeof header->magic || memcmp(image, FM_FMO_MAGIC, sizeof header->magic) != 0) {
        return fm_fail(FM_ERROR_FORMAT, "%s: does not begin as an octree file (.fmo) does", name);
    }
    if (bytes < FM_FMO_PAGE) {
        return fm_fail(FM_ERROR_FORMAT, "%s: ends within its header: the file is truncated, get it again", name);
    }
    memcpy(header, image, sizeof *header);
    if (header->version != FM_FMO_VERSION) {
        return fm_fail(FM_ERROR_FORMAT, "%s: is of version %u: this library reads version %d", name, header->version,
                       FM_FMO_VERSION);
    }
    if (header->header_sum != crc32_z(0, image, offsetof(fm_fmo_header, header_sum)) ||
        header->table_sum != crc32_z(0, image + sizeof *header, FM_FMO_PAGE - sizeof *header)) {
        return fm_fail(FM_ERROR_FORMAT, "%s: the checksum of its header is wrong: the file is damaged, get it again", name);
    }
    if (header->image_bytes > bytes || header->image_bytes % FM_FMO_PAGE != 0) {
        return fm_fail(FM_ERROR_FORMAT, "%s: has %llu bytes of %llu: the file is truncated, get it again", name,
                       (unsigned long long)bytes, (unsigned long long)header->image_bytes);
    }
    return FM_OK;
}

static fm_result check_words(const fm_fmo_header *header, const char *name) {
    if (header->kind >= FM_OCTREE_KINDS || header->method > FM_OCTREE_GROWN || header->code > FM_OCTREE_FLOATS ||
        header->attribute > FM_OCTREE_TEXTURE || header->sign > FM_SIGN_NONE || header->shared > 1) {
        return fm_fail(FM_ERROR_FORMAT,
                       "%s: header: kind %u, method %u, code %u, attribute %u, sign %u, shared %u: one of them is not known", name,
                       header->kind, header->method, header->code, header->attribute, header->sign, header->shared);
    }
    if (header->levels < 1 || header->levels > MOST_LEVELS) {
        return fm_fail(FM_ERROR_FORMAT, "%s: header: %u levels: 1 to %d are possible", name, header->levels, MOST_LEVELS);
    }
    if (header->sections > FM_FMO_MOST_SECTIONS) {
        return fm_fail(FM_ERROR_FORMAT, "%s: header: %u sections: at most %d are possible", name, header->sections,
                       FM_FMO_MOST_SECTIONS);
    }
    return FM_OK;
}

static fm_result check_axis(const fm_fmo_header *header, const char *name, int axis) {
    const double width = ldexp(header->cell, (int)header->levels);
    const double low = (double)header->low[axis], high = (double)header->high[axis], origin = header->origin[axis];
    if (!isfinite(origin) || !isfinite(low) || !isfinite(high) || !isfinite((float)origin) || !(low < high)) {
        return fm_fail(FM_ERROR_FORMAT, "%s: header: the box runs from %g to %g along axis %d", name, low, high, axis);
    }
    if (header->cells[axis] < 1 || header->cells[axis] > MOST_CELLS ||
        header->top[axis] != fm_div_up(header->cells[axis], 1ull << header->levels)) {
        return fm_fail(FM_ERROR_FORMAT, "%s: header: %u cells along axis %d in a top grid of %u of 2^%u each", name,
                       header->cells[axis], axis, header->top[axis], header->levels);
    }
    const double slack = 1e-3 * header->cell + 1e-6 * fmax(fabs(low), fabs(high));
    const double end = origin + header->top[axis] * width;
    if (low < origin - slack || high > end + slack || !isfinite((float)end)) {
        return fm_fail(FM_ERROR_FORMAT, "%s: header: the box from %g to %g along axis %d is not within the grid", name, low, high,
                       axis);
    }
    return FM_OK;
}

static fm_result check_grid(const fm_fmo_header *header, const char *name) {
    if (!(header->cell > 0) || !isnormal((float)header->cell) || !(header->cutoff > 0) || !isfinite(header->cutoff) ||
        !isfinite(header->threshold) || !isfinite(header->band)) {
        return fm_fail(FM_ERROR_FORMAT,
                       "%s: header: cell %g, cutoff %g, threshold %g, band %g: finite numbers, the first two above 0, are possible",
                       name, header->cell, (double)header->cutoff, (double)header->threshold, (double)header->band);
    }
    for (int axis = 0; axis < 3; axis++) {
        FM_TRY(check_axis(header, name, axis));
    }
    return FM_OK;
}

// As many parts as there are cover the box, and no fewer would, but for what rounding and the coarse cells may hide.
static bool parts_cover(const fm_fmo_header *header) {
    bool good = isnormal((float)header->part_edge);
    for (int axis = 0; axis < 3; axis++) {
        const double extent = (double)header->high[axis] - (double)header->low[axis];
        const double slack = header->cell + 1e-3 * extent, parts = header->parts[axis];
        good = good && parts * header->part_edge >= extent - slack && (parts - 1) * header->part_edge <= extent + slack;
    }
    return good;
}

static fm_result check_parts(const fm_fmo_header *header, const char *name) {
    const uint32_t *parts = header->parts;
    const bool any = parts[0] > 0 || parts[1] > 0 || parts[2] > 0;
    bool good = any == (header->part_edge > 0) && isfinite((float)header->part_edge) && any == (header->part_cells > 0);
    uint64_t count = 1;
    for (int axis = 0; axis < 3; axis++) {
        good = good && any == (parts[axis] > 0) && parts[axis] <= FM_FMO_MOST_ALONG;
        count *= good ? parts[axis] : 0;
    }
    if (!good || count > FM_FMO_MOST_PARTS) {
        return fm_fail(FM_ERROR_FORMAT, "%s: header: %u x %u x %u parts of %u cells, edge %g: at most %d are possible", name,
                       parts[0], parts[1], parts[2], header->part_cells, header->part_edge, FM_FMO_MOST_PARTS);
    }
    if (any && !parts_cover(header)) {
        return fm_fail(FM_ERROR_FORMAT, "%s: header: %u x %u x %u parts of edge %g do not cover the box, or too many do", name,
                       parts[0], parts[1], parts[2], header->part_edge);
    }
    return FM_OK;
}

static fm_octree_array *array_of(fm_octree *octree, uint32_t name) {
    switch (name) {
    case FM_FMO_WORDS:
        return &octree->words;
    case FM_FMO_VALUES:
        return &octree->values;
    case FM_FMO_ATTRIBUTES:
        return &octree->attributes;
    case FM_FMO_EXTRA:
        return &octree->extra;
    default:
        return NULL;
    }
}

static fm_fmo_section section_at(const uint8_t *image, uint32_t i) {
    fm_fmo_section section;
    memcpy(&section, image + sizeof(fm_fmo_header) + i * sizeof section, sizeof section);
    return section;
}

static fm_result open_sections(const uint8_t *image, const char *name, const fm_fmo_header *header, fm_octree *octree) {
    uint64_t end = FM_FMO_PAGE;
    for (uint32_t i = 0; i < header->sections; i++) {
        const fm_fmo_section section = section_at(image, i);
        if (section.offset != end || section.bytes > header->image_bytes - end || section.element == 0 ||
            section.bytes % section.element != 0) {
            return fm_fail(FM_ERROR_FORMAT, "%s: section %u: %llu bytes from %llu on, in elements of %u, do not fit where they are",
                           name, i, (unsigned long long)section.bytes, (unsigned long long)section.offset, section.element);
        }
        end += fm_round_up(section.bytes, FM_FMO_PAGE);
        fm_octree_array *array = array_of(octree, section.name);
        if (!array) {
            continue;
        }
        if (array->count > 0 || section.element != array->size) {
            return fm_fail(FM_ERROR_FORMAT,
                           "%s: section %u: elements of %u bytes where %u are wanted, or a second section of a name", name, i,
                           section.element, array->size);
        }
        array->count = section.bytes / section.element;
        array->data = array->count > 0 ? (uint8_t *)(uintptr_t)image + section.offset : NULL;
    }
    if (end != header->image_bytes) {
        return fm_fail(FM_ERROR_FORMAT, "%s: its sections end at byte %llu, its header says %llu", name, (unsigned long long)end,
                       (unsigned long long)header->image_bytes);
    }
    return FM_OK;
}

static void fill(const fm_fmo_header *header, fm_octree *octree) {
    octree->info = (fm_octree_info){.kind = (fm_octree_kind)header->kind,
                                    .method = (fm_octree_method)header->method,
                                    .code = (fm_octree_code)header->code,
                                    .attribute = (fm_octree_attribute)header->attribute,
                                    .sign = (fm_sign)header->sign,
                                    .shared = header->shared != 0,
                                    .cell = header->cell,
                                    .levels = header->levels,
                                    .internal = header->internal,
                                    .empty = header->empty,
                                    .unshared_bytes = header->unshared_bytes,
                                    .code_error = header->code_error,
                                    .parts = header->parts[0] * header->parts[1] * header->parts[2]};
    fm_octree_info *info = &octree->info;
    octree->desc = (fm_octree_desc){.kind = info->kind,
                                    .size = header->size,
                                    .method = info->method,
                                    .rounds = header->rounds,
                                    .code = info->code,
                                    .threshold = header->threshold,
                                    .band = header->band,
                                    .share = info->shared,
                                    .top_bytes = header->top_bytes,
                                    .sign = info->sign,
                                    .attribute = info->attribute};
    octree->head = (fm_octree_head){.kind = (int32_t)header->kind,
                                    .code = (int32_t)header->code,
                                    .levels = (int32_t)header->levels,
                                    .cell = (float)header->cell,
                                    .cutoff = header->cutoff};
    for (int axis = 0; axis < 3; axis++) {
        info->origin[axis] = header->origin[axis];
        info->cells[axis] = header->cells[axis];
        info->top[axis] = header->top[axis];
        info->low[axis] = octree->desc.low[axis] = octree->head.low[axis] = header->low[axis];
        info->high[axis] = octree->desc.high[axis] = octree->head.high[axis] = header->high[axis];
        octree->head.origin[axis] = (float)header->origin[axis];
        octree->head.top[axis] = (int32_t)header->top[axis];
    }
    memcpy(info->leaves, header->leaves, sizeof info->leaves);
}

fm_result fm_fmo_open_image(const uint8_t *image, uint64_t bytes, const char *name, fm_octree *octree, fm_fmo_header *header) {
    FM_TRY(check_start(image, bytes, name, header));
    FM_TRY(check_words(header, name));
    FM_TRY(check_grid(header, name));
    FM_TRY(check_parts(header, name));
    *octree = (fm_octree){.version = 0};
    fill(header, octree);
    fm_octree_size_arrays(octree);
    FM_TRY(open_sections(image, name, header, octree));
    fm_octree_counted(octree);
    return FM_OK;
}

fm_result fm_fmo_check_image(const uint8_t *image, const char *name, const fm_octree *octree, uint8_t *marks) {
    fm_fmo_header header;
    memcpy(&header, image, sizeof header);
    for (uint32_t i = 0; i < header.sections; i++) {
        const fm_fmo_section section = section_at(image, i);
        if (section.sum != crc32_z(0, image + section.offset, section.bytes)) {
            return fm_fail(FM_ERROR_FORMAT, "%s: the checksum of section %u is wrong: the file is damaged, get it again", name, i);
        }
    }
    const fm_result result = fm_octree_validate(octree, marks);
    return result == FM_OK ? FM_OK : fm_fail_prefix(result, name);
}

// ---------------------------------------------------------------------------------------------------------------------------
// Whole files
// ---------------------------------------------------------------------------------------------------------------------------

static void unmap(fm_octree *octree) {
    munmap(octree->mapped, octree->mapped_bytes);
}

void fm_fmo_free_image(fm_octree *octree) {
    fm_meter_remove(&octree->context->host[FM_PURPOSE_OCTREES], octree->mapped_bytes);
    fm_free(&octree->context->allocator, octree->mapped, octree->mapped_bytes);
}

// A file that can be mapped and begins as it should; false: it is to be read, whatever the reason, and reading tells of errors.
static bool map(const char *path, void **memory, uint64_t *bytes) {
    struct stat status;
    const int file = strcmp(path, "-") == 0 ? -1 : open(path, O_RDONLY | O_CLOEXEC);
    if (file < 0) {
        return false;
    }
    *memory = MAP_FAILED;
    if (fstat(file, &status) == 0 && S_ISREG(status.st_mode) && status.st_size >= FM_FMO_PAGE) {
        *bytes = (uint64_t)status.st_size;
        // Updates may write into their own copy of a page.
        *memory = mmap(NULL, *bytes, PROT_READ | PROT_WRITE, MAP_PRIVATE, file, 0);
    }
    close(file);
    if (*memory == MAP_FAILED) {
        return false;
    }
    if (memcmp(*memory, FM_FMO_MAGIC, strlen(FM_FMO_MAGIC)) != 0) {
        munmap(*memory, *bytes);
        return false;
    }
    return true;
}

static fm_result slurp(fm_context *context, const char *path, void **memory, uint64_t *bytes) {
    fm_input *input = NULL;
    uint8_t *data = NULL;
    FM_TRY(fm_input_open(&context->allocator, path, &input));
    const fm_result result = fm_input_slurp(input, MOST_BYTES, &data, bytes);
    fm_input_close(input);
    *memory = data;
    return result;
}

static fm_result check_whole(const fm_octree *octree, const fm_fmo_header *header, const char *name) {
    if (header->parts[0] == 0 && header->image_bytes != octree->mapped_bytes) {
        return fm_fail(FM_ERROR_FORMAT, "%s: has %llu bytes after its last section: its header and its size do not agree", name,
                       (unsigned long long)(octree->mapped_bytes - header->image_bytes));
    }
    const fm_allocator *allocator = &octree->context->allocator;
    const uint64_t bytes = fm_octree_marks(octree);
    uint8_t *marks = fm_alloc_zero(allocator, bytes, "the check of an octree");
    if (!marks) {
        return FM_ERROR_OUT_OF_HOST_MEMORY;
    }
    const fm_result result = fm_fmo_check_image(octree->mapped, name, octree, marks);
    fm_free(allocator, marks, bytes);
    return result;
}

fm_result fm_fmo_keep_image(fm_context *context, const fm_fmo_memory *memory, const fm_octree *numbers, fm_octree **result) {
    fm_octree *octree = fm_alloc(&context->allocator, sizeof *octree, "an octree");
    if (!octree) {
        return FM_ERROR_OUT_OF_HOST_MEMORY;
    }
    *octree = *numbers;
    octree->context = context;
    octree->mapped = memory->data;
    octree->mapped_bytes = memory->bytes;
    octree->unmap = memory->release;
    *result = octree;
    return FM_OK;
}

fm_result fm_fmo_read_image(fm_context *context, const fm_fmo_memory *memory, const char *name, fm_octree **result) {
    fm_octree numbers;
    fm_fmo_header header;
    FM_TRY(fm_fmo_open_image(memory->data, memory->bytes, name, &numbers, &header));
    fm_octree *octree = NULL;
    FM_TRY(fm_fmo_keep_image(context, memory, &numbers, &octree));
    const fm_result status = check_whole(octree, &header, name);
    if (status != FM_OK) {
        octree->unmap = NULL;
        fm_octree_destroy(octree);
        return status;
    }
    *result = octree;
    return FM_OK;
}

fm_result fm_octree_read(fm_context *context, const char *path, fm_octree **result) {
    if (!context || !path || !result) {
        return fm_fail(FM_ERROR_INVALID_ARGUMENT, "context, path or octree is NULL");
    }
    fm_fmo_memory memory = {.release = unmap};
    if (!map(path, &memory.data, &memory.bytes)) {
        FM_TRY(slurp(context, path, &memory.data, &memory.bytes));
        memory.release = fm_fmo_free_image;
        fm_meter_add(&context->host[FM_PURPOSE_OCTREES], memory.bytes);
    }
    const fm_result status = fm_fmo_read_image(context, &memory, path, result);
    if (status != FM_OK) {
        fm_octree holder = {.context = context, .mapped = memory.data, .mapped_bytes = memory.bytes};
        memory.release(&holder);
    }
    return status;
}
