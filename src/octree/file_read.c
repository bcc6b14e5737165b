// SPDX-License-Identifier: MIT
// Octrees from .fmo files, of which nothing is trusted.

#include "octree/file.h"

#include <fcntl.h>
#include <string.h>
#include <sys/mman.h>
#include <sys/stat.h>
#include <unistd.h>
#include <zlib.h>

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
    if (header->image_bytes < FM_FMO_PAGE || header->image_bytes > bytes || header->image_bytes % FM_FMO_PAGE != 0) {
        return fm_fail(FM_ERROR_FORMAT, "%s: has %llu bytes of %llu: the file is truncated, get it again", name,
                       (unsigned long long)bytes, (unsigned long long)header->image_bytes);
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
    FM_TRY(fm_fmo_check_header(header, name));
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

static void free_image(fm_octree *octree) {
    fm_octree_free(octree->context, octree->mapped, octree->mapped_bytes);
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

fm_result fm_fmo_take_image(fm_context *context, uint64_t bytes, fm_fmo_memory *memory) {
    *memory = (fm_fmo_memory){.bytes = bytes, .release = free_image};
    memory->data = fm_octree_alloc(context, bytes, "an octree");
    return memory->data ? FM_OK : FM_ERROR_OUT_OF_HOST_MEMORY;
}

void fm_fmo_release(fm_context *context, const fm_fmo_memory *memory) {
    fm_octree holder = {.context = context, .mapped = memory->data, .mapped_bytes = memory->bytes};
    memory->release(&holder);
}

// The image that a pipe or a gzipped file begins with, and no more of it than its header says: that must agree with the file's
// size before memory is taken, and behind a plain one nothing may come.
static fm_result read_stream(fm_context *context, fm_input *input, const char *path, fm_fmo_memory *memory) {
    _Alignas(8) uint8_t page[FM_FMO_PAGE];
    const uint8_t *start;
    size_t bytes;
    fm_octree numbers;
    fm_fmo_header header;
    FM_TRY(fm_input_peek(input, sizeof page, &start, &bytes));
    memcpy(page, start, bytes);
    FM_TRY(fm_fmo_open_image(page, bytes < sizeof page ? bytes : UINT64_MAX, path, &numbers, &header));
    FM_TRY(fm_input_require(input, header.image_bytes, "an octree"));
    FM_TRY(fm_fmo_take_image(context, header.image_bytes, memory));
    fm_result result = fm_input_read(input, memory->data, memory->bytes, "an octree");
    result = result == FM_OK && header.parts[0] == 0 ? fm_input_expect_end(input) : result;
    if (result != FM_OK) {
        fm_fmo_release(context, memory);
    }
    return result;
}

static fm_result slurp(fm_context *context, const char *path, fm_fmo_memory *memory) {
    fm_input *input = NULL;
    FM_TRY(fm_input_open(&context->allocator, path, &input));
    const fm_result result = read_stream(context, input, path, memory);
    fm_input_close(input);
    return result;
}

static fm_result check_whole(const fm_octree *octree, const fm_fmo_header *header, const char *name) {
    if (header->parts[0] == 0 && header->image_bytes != octree->mapped_bytes) {
        return fm_fail(FM_ERROR_FORMAT, "%s: has %llu bytes after its last section: its header and its size do not agree", name,
                       (unsigned long long)(octree->mapped_bytes - header->image_bytes));
    }
    fm_context *context = octree->context;
    const uint64_t bytes = fm_octree_marks(octree);
    uint8_t *marks = fm_alloc_zero(&context->allocator, bytes, "the check of an octree");
    if (!marks) {
        return FM_ERROR_OUT_OF_HOST_MEMORY;
    }
    fm_meter_add(&context->host[FM_PURPOSE_SCRATCH], bytes);
    const fm_result result = fm_fmo_check_image(octree->mapped, name, octree, marks);
    fm_meter_remove(&context->host[FM_PURPOSE_SCRATCH], bytes);
    fm_free(&context->allocator, marks, bytes);
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
        FM_TRY(slurp(context, path, &memory));
    }
    const fm_result status = fm_fmo_read_image(context, &memory, path, result);
    if (status != FM_OK) {
        fm_fmo_release(context, &memory);
    }
    return status;
}
