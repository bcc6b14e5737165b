// SPDX-License-Identifier: MIT
#ifndef FM_OCTREE_MADE_H
#define FM_OCTREE_MADE_H

// Octrees without a surface: random nodes and values, as a builder might leave them, and files of them with true checksums.

#include "check.h"
#include "octree/file.h"
#include "random.h"

#include <string.h>
#include <zlib.h>

static inline void made_word(fm_octree *octree, uint64_t at, uint32_t word) {
    memcpy(octree->words.data + at * 4, &word, sizeof word);
}

// Up to eight children of a random node of a level, and so on.
static inline void made_below(fm_octree *octree, uint64_t at, uint32_t level, uint64_t *seed) {
    const int choice = at == 0 ? 0 : test_between(seed, 0, 5);
    if (level > 0 && choice < 2 && fm_octree_reserve(octree, &octree->words, 8)) {
        const uint64_t first = octree->words.count;
        octree->words.count += 8;
        memset(octree->words.data + first * 4, 0x7f, 32);
        made_word(octree, at, (uint32_t)first);
        octree->info.internal++;
        for (uint64_t i = 0; i < 8; i++) {
            made_below(octree, first + i, level - 1, seed);
        }
    } else if (choice == 2) {
        uint64_t leaf = 0;
        for (int l = 0; l < 24; l++) {
            leaf += octree->info.leaves[l];
        }
        made_word(octree, at, ~(uint32_t)leaf);
        octree->info.leaves[level]++;
    } else {
        made_word(octree, at, fm_octree_empty_word(0.3, 1));
        octree->info.empty++;
    }
}

static inline bool made_values(fm_octree *octree, uint64_t count, uint64_t *seed) {
    fm_octree_array *const arrays[] = {&octree->values, &octree->attributes, &octree->extra};
    const bool plain = octree->info.attribute == FM_OCTREE_PLAIN;
    for (int i = 0; i < 3; i++) {
        const uint64_t wanted = i == 0 || (i == 1 && !plain) ? count : i == 2 ? 5 : 0;
        if (wanted > 0 && !fm_octree_reserve(octree, arrays[i], wanted)) {
            return false;
        }
        arrays[i]->count = wanted;
        for (uint64_t k = 0; k < wanted * arrays[i]->size / 4; k++) {
            const float value = (float)test_between(seed, -1000, 1000) / 500;
            memcpy(arrays[i]->data + k * 4, &value, sizeof value);
        }
    }
    return true;
}

// Blocks of voxels of some numbers, many of them alike.
static inline fm_result made_read(void *user, const fm_box *box, uint32_t *voxels) {
    const uint64_t seed = *(const uint64_t *)user;
    uint64_t i = 0;
    for (int64_t z = box->begin[2]; z < box->end[2]; z++) {
        for (int64_t y = box->begin[1]; y < box->end[1]; y++) {
            for (int64_t x = box->begin[0]; x < box->end[0]; x++) {
                uint64_t block = seed + (uint64_t)(x / 6 % 3 + 5 * (y / 7 % 2) + 11 * (z / 5));
                voxels[i++] = test_random(&block) % 4 == 0 ? 1 + (uint32_t)(x + y) % 3 : 0;
            }
        }
    }
    return FM_OK;
}

static inline fm_octree *made_voxels(fm_context *context, const fm_octree_desc *desc, uint64_t seed) {
    const fm_voxel_source source = {.user = &seed, .shape = {desc->size, 29, 17}, .read = made_read};
    fm_octree *octree = NULL;
    CHECK_OK(fm_octree_build_voxels(context, &source, desc, &octree));
    return octree;
}

static inline fm_octree *made_bricks(fm_context *context, const fm_octree_desc *desc) {
    static const float vertices[4][3] = {{0, 0, 0}, {1, 0, 0}, {0, 1, 0}, {0, 0, 0.5f}};
    static const uint32_t triangles[4][3] = {{0, 2, 1}, {0, 1, 3}, {0, 3, 2}, {1, 2, 3}};
    const fm_mesh_desc tetrahedron = {vertices, 4, triangles, 4};
    fm_mesh *mesh = NULL;
    fm_octree *octree = NULL;
    if (CHECK_OK(fm_mesh_create(context, &tetrahedron, &mesh))) {
        CHECK_OK(fm_octree_build_mesh(mesh, desc, &octree));
    }
    fm_mesh_destroy(mesh);
    return octree;
}

// Some kinds are made by their builders, of voxels and of a tetrahedron.
static inline fm_octree *made_octree(fm_context *context, const fm_octree_desc *desc, uint64_t seed) {
    static const double low[3] = {-1, 2, 0.5}, high[3] = {2, 4, 1.75};
    fm_octree_desc filled;
    fm_octree *octree = NULL;
    if (desc->kind > FM_OCTREE_VOXELS) {
        return desc->kind == FM_OCTREE_BRICKS ? made_bricks(context, desc) : made_voxels(context, desc, seed);
    }
    if (!CHECK_OK(fm_octree_check_desc(desc, &filled)) || !CHECK_OK(fm_octree_new(context, &filled, low, high, &octree))) {
        return NULL;
    }
    const uint64_t top = (uint64_t)octree->info.top[0] * octree->info.top[1] * octree->info.top[2];
    if (!CHECK(fm_octree_reserve(octree, &octree->words, top))) {
        fm_octree_destroy(octree);
        return NULL;
    }
    octree->words.count = top;
    for (uint64_t node = 0; node < top; node++) {
        made_below(octree, node, octree->info.levels, &seed);
    }
    uint64_t leaves = 0;
    for (int level = 0; level < 24; level++) {
        leaves += octree->info.leaves[level];
    }
    CHECK(made_values(octree, desc->kind == FM_OCTREE_VOXELS ? leaves : (leaves + 1) * FM_COLUMN_VALUES, &seed));
    octree->info.code_error = 0.25;
    octree->info.unshared_bytes = 12345;
    fm_octree_counted(octree);
    return octree;
}

// Makes the checksums of an image those of what it now holds, so that a reader looks further.
static inline void made_seal(uint8_t *image, uint64_t bytes) {
    fm_fmo_header header;
    if (bytes < FM_FMO_PAGE) {
        return;
    }
    memcpy(&header, image, sizeof header);
    for (uint32_t i = 0; i < header.sections && i < FM_FMO_MOST_SECTIONS; i++) {
        uint8_t *at = image + sizeof header + i * sizeof(fm_fmo_section);
        fm_fmo_section section;
        memcpy(&section, at, sizeof section);
        if (section.offset <= bytes && section.bytes <= bytes - section.offset) {
            section.sum = (uint32_t)crc32_z(0, image + section.offset, section.bytes);
            memcpy(at, &section, sizeof section);
        }
    }
    fm_fmo_seal(image);
}

// The same of a file with parts: of every image in it that lies within, and of the directory.
static inline void made_seal_parts(uint8_t *file, uint64_t bytes) {
    fm_fmo_header header;
    if (bytes < FM_FMO_PAGE) {
        return;
    }
    memcpy(&header, file, sizeof header);
    made_seal(file, header.image_bytes < bytes ? header.image_bytes : bytes);
    uint64_t count = 1;
    for (int axis = 0; axis < 3; axis++) {
        count *= header.parts[axis] < FM_FMO_MOST_ALONG ? header.parts[axis] : FM_FMO_MOST_ALONG;
    }
    const uint64_t pages = fm_fmo_directory_bytes(count);
    if (count == 0 || bytes < pages) {
        return;
    }
    uint8_t *rows = file + bytes - pages;
    for (uint64_t part = 0; part < count; part++) {
        fm_fmo_part row;
        fm_fmo_header own;
        memcpy(&row, rows + part * sizeof row, sizeof row);
        if (row.bytes >= FM_FMO_PAGE && row.bytes <= bytes - pages && row.offset <= bytes - pages - row.bytes &&
            row.offset % sizeof(uint64_t) == 0) {
            made_seal(file + row.offset, row.bytes);
            memcpy(&own, file + row.offset, sizeof own);
            row.header_sum = own.header_sum;
            memcpy(rows + part * sizeof row, &row, sizeof row);
        }
    }
    const uint32_t sum = (uint32_t)crc32_z(0, rows, count * sizeof(fm_fmo_part));
    memcpy(rows + count * sizeof(fm_fmo_part), &sum, sizeof sum);
}

#endif
