// SPDX-License-Identifier: MIT
// Octrees into .fmo files.

#include "octree/file.h"

#include <string.h>
#include <zlib.h>

#if __BYTE_ORDER__ != __ORDER_LITTLE_ENDIAN__
#error "octree files are written as memory has them, with the low byte first"
#endif

static uint32_t sum_of(const void *data, uint64_t bytes) {
    return (uint32_t)crc32_z(0, data, bytes);
}

void fm_fmo_seal(uint8_t page[FM_FMO_PAGE]) {
    fm_fmo_header header;
    memcpy(&header, page, sizeof header);
    header.table_sum = sum_of(page + sizeof header, FM_FMO_PAGE - sizeof header);
    header.header_sum = sum_of(&header, offsetof(fm_fmo_header, header_sum));
    memcpy(page, &header, sizeof header);
}

static fm_fmo_header header_of(const fm_octree *octree, const fm_fmo_header *about) {
    const fm_octree_info *info = &octree->info;
    fm_fmo_header header = {.magic = {0},
                            .version = FM_FMO_VERSION,
                            .sections = FM_FMO_SECTIONS,
                            .kind = (uint32_t)info->kind,
                            .method = (uint32_t)info->method,
                            .code = (uint32_t)info->code,
                            .attribute = (uint32_t)info->attribute,
                            .sign = (uint32_t)info->sign,
                            .shared = info->shared,
                            .size = octree->desc.size,
                            .rounds = octree->desc.rounds,
                            .cell = info->cell,
                            .levels = info->levels,
                            .cutoff = octree->head.cutoff,
                            .threshold = octree->desc.threshold,
                            .band = octree->desc.band,
                            .internal = info->internal,
                            .empty = info->empty,
                            .unshared_bytes = info->unshared_bytes,
                            .top_bytes = octree->desc.top_bytes,
                            .code_error = info->code_error};
    memcpy(header.magic, FM_FMO_MAGIC, sizeof header.magic);
    for (int axis = 0; axis < 3; axis++) {
        header.origin[axis] = info->origin[axis];
        header.cells[axis] = info->cells[axis];
        header.top[axis] = info->top[axis];
        header.low[axis] = info->low[axis];
        header.high[axis] = info->high[axis];
        header.parts[axis] = about ? about->parts[axis] : 0;
    }
    header.part_cells = about ? about->part_cells : 0;
    header.part_edge = about ? about->part_edge : 0;
    memcpy(header.leaves, info->leaves, sizeof header.leaves);
    return header;
}

static fm_result write_padded(fm_output *output, const void *data, uint64_t bytes) {
    static const uint8_t zeros[FM_FMO_PAGE];
    FM_TRY(fm_output_write(output, data, bytes));
    return fm_output_write(output, zeros, fm_round_up(bytes, FM_FMO_PAGE) - bytes);
}

fm_result fm_fmo_write_image(fm_output *output, const fm_octree *octree, const fm_fmo_header *about, fm_fmo_header *written) {
    const struct {
        fm_fmo_name name;
        const fm_octree_array *array;
    } parts[FM_FMO_SECTIONS] = {{FM_FMO_WORDS, &octree->words},
                                {FM_FMO_VALUES, &octree->values},
                                {FM_FMO_ATTRIBUTES, &octree->attributes},
                                {FM_FMO_EXTRA, &octree->extra}};
    fm_fmo_header header = header_of(octree, about);
    _Alignas(8) uint8_t page[FM_FMO_PAGE] = {0};
    header.image_bytes = FM_FMO_PAGE;
    for (int i = 0; i < FM_FMO_SECTIONS; i++) {
        const fm_octree_array *array = parts[i].array;
        const fm_fmo_section section = {.name = (uint32_t)parts[i].name,
                                        .element = array->size,
                                        .offset = header.image_bytes,
                                        .bytes = array->count * array->size,
                                        .sum = sum_of(array->data, array->count * array->size)};
        memcpy(page + sizeof header + (size_t)i * sizeof section, &section, sizeof section);
        header.image_bytes += fm_round_up(section.bytes, FM_FMO_PAGE);
    }
    memcpy(page, &header, sizeof header);
    fm_fmo_seal(page);
    memcpy(written, page, sizeof *written);
    FM_TRY(fm_output_write(output, page, sizeof page));
    for (int i = 0; i < FM_FMO_SECTIONS; i++) {
        const fm_octree_array *array = parts[i].array;
        if (array->count > 0) {
            FM_TRY(write_padded(output, array->data, array->count * array->size));
        }
    }
    return FM_OK;
}

fm_result fm_fmo_place(fm_output *output, fm_result result) {
    if (result != FM_OK) {
        fm_output_destroy(output);
        return result;
    }
    fm_file_batch own = {.count = 0};
    result = fm_batch_add(&own, output);
    if (result == FM_OK) {
        result = fm_file_batch_commit(&own);
    }
    fm_batch_clear(&own);
    return result;
}

fm_result fm_octree_write(const fm_octree *octree, const char *path) {
    if (!octree || !path) {
        return fm_fail(FM_ERROR_INVALID_ARGUMENT, "octree or path is NULL");
    }
    fm_output *output = NULL;
    fm_fmo_header header;
    FM_TRY(fm_output_open(&octree->context->allocator, path, false, &output));
    return fm_fmo_place(output, fm_fmo_write_image(output, octree, NULL, &header));
}
