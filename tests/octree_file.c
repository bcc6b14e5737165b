// SPDX-License-Identifier: MIT

// Octree files: what is read is what was written, and nothing that is wrong with a file is taken.

#include "faulty.h"
#include "measured.h"
#include "octree_made.h"

#include <sys/mman.h>

static const fm_octree_desc kinds[] = {
    {.kind = FM_OCTREE_CLOSEST, .size = 48},
    {.kind = FM_OCTREE_CLOSEST, .size = 40, .code = FM_OCTREE_FLOATS, .attribute = FM_OCTREE_COLOR, .method = FM_OCTREE_GROWN},
    {.kind = FM_OCTREE_CLOSEST, .size = 32, .code = FM_OCTREE_OCTAHEDRAL, .share = true, .threshold = -1, .rounds = 7},
    {.kind = FM_OCTREE_CLOSEST, .size = 36, .code = FM_OCTREE_SHORT, .band = 0.1f, .attribute = FM_OCTREE_TRIANGLE},
    {.kind = FM_OCTREE_DISTANCE, .size = 50, .sign = FM_SIGN_WINDING},
    {.kind = FM_OCTREE_VOXELS, .size = 64, .top_bytes = 8},
    {.kind = FM_OCTREE_DAG, .size = 40, .top_bytes = 64},
    {.kind = FM_OCTREE_TREE64, .size = 40, .top_bytes = 64},
    {.kind = FM_OCTREE_CONTOURS, .size = 40, .top_bytes = 64},
    {.kind = FM_OCTREE_BRICKS, .size = 32},
};
enum { KINDS = sizeof kinds / sizeof kinds[0] };

static bool same_array(const fm_octree_array *a, const fm_octree_array *b) {
    return a->count == b->count && a->size == b->size && (a->count == 0 || memcmp(a->data, b->data, a->count * a->size) == 0);
}

static bool same_info(const fm_octree *a, const fm_octree *b) {
    fm_octree_info x, y;
    fm_octree_describe(a, &x);
    fm_octree_describe(b, &y);
    return x.kind == y.kind && x.method == y.method && x.code == y.code && x.attribute == y.attribute && x.sign == y.sign &&
           x.shared == y.shared && memcmp(x.origin, y.origin, sizeof x.origin) == 0 && memcmp(&x.cell, &y.cell, 8) == 0 &&
           memcmp(x.cells, y.cells, sizeof x.cells) == 0 && memcmp(x.top, y.top, sizeof x.top) == 0 && x.levels == y.levels &&
           memcmp(x.low, y.low, sizeof x.low) == 0 && memcmp(x.high, y.high, sizeof x.high) == 0 && x.internal == y.internal &&
           memcmp(x.leaves, y.leaves, sizeof x.leaves) == 0 && x.empty == y.empty && x.node_bytes == y.node_bytes &&
           x.leaf_bytes == y.leaf_bytes && x.attribute_bytes == y.attribute_bytes && x.unshared_bytes == y.unshared_bytes &&
           memcmp(&x.code_error, &y.code_error, 8) == 0;
}

static void round_trip(fm_context *context, const fm_octree_desc *desc) {
    const char *path = io_path("a.fmo"), *again = io_path("b.fmo");
    fm_octree *octree = made_octree(context, desc, 7), *read = NULL;
    if (!octree || !CHECK_OK(fm_octree_write(octree, path)) || !CHECK_OK(fm_octree_read(context, path, &read))) {
        fm_octree_destroy(octree);
        return;
    }
    CHECK(octree->words.count > 20 && (octree->values.count > 20 || desc->kind == FM_OCTREE_DAG));
    CHECK(same_info(octree, read));
    CHECK(same_array(&octree->words, &read->words) && same_array(&octree->values, &read->values));
    CHECK(same_array(&octree->attributes, &read->attributes) && same_array(&octree->extra, &read->extra));
    CHECK(octree->desc.threshold == read->desc.threshold && octree->desc.rounds == read->desc.rounds &&
          octree->desc.size == read->desc.size && octree->desc.top_bytes == read->desc.top_bytes);
    CHECK(memcmp(&octree->head, &read->head, sizeof octree->head) == 0);
    // What is mapped can be written to, and the file stays as it is.
    CHECK(read->unmap && read->words.room == 0);
    size_t size = 0, size2 = 0;
    uint8_t *bytes = io_contents(path, &size);
    made_word(read, 0, 77);
    made_word(read, 0, *(const uint32_t *)(const void *)octree->words.data);
    CHECK(fm_octree_reserve(read, &read->words, 8) && same_array(&octree->words, &read->words));
    CHECK_OK(fm_octree_write(read, again));
    uint8_t *bytes2 = io_contents(again, &size2);
    CHECK(size == size2 && memcmp(bytes, bytes2, size) == 0);
    CHECK(size % FM_FMO_PAGE == 0);
    free(bytes);
    free(bytes2);
    fm_octree_destroy(octree);
    fm_octree_destroy(read);
    io_clear();
}

// From memory, so that no disk is worn: the result of reading it.
static void keep(fm_octree *octree) {
    (void)octree;
}

static fm_result read_bytes(fm_context *context, const uint8_t *bytes, uint64_t size) {
    // At the end of a page of its own, so that a read beyond it is found by a sanitizer.
    uint8_t *copy = aligned_alloc(64, fm_round_up(size + 1, 64));
    memcpy(copy, bytes, size);
    const fm_fmo_memory memory = {copy, size, keep};
    fm_octree *octree = NULL;
    const fm_result result = fm_fmo_read_image(context, &memory, "some.fmo", &octree);
    if (result == FM_OK) {
        fm_octree_destroy(octree);
    } else {
        CHECK(octree == NULL && strstr(fm_last_error(), "some.fmo: ") == fm_last_error());
    }
    free(copy);
    return result;
}

static uint8_t *made_file(fm_context *context, const fm_octree_desc *desc, size_t *size) {
    fm_octree *octree = made_octree(context, desc, 11);
    CHECK_OK(fm_octree_write(octree, io_path("c.fmo")));
    fm_octree_destroy(octree);
    uint8_t *bytes = io_contents(io_path("c.fmo"), size);
    io_clear();
    return bytes;
}

static void truncated(fm_context *context, const uint8_t *bytes, size_t size) {
    CHECK_OK(read_bytes(context, bytes, size));
    for (size_t length = 0; length < size; length += length < 600 ? 1 : 509) {
        if (!CHECK_FAILS(read_bytes(context, bytes, length), FM_ERROR_FORMAT)) {
            fprintf(stderr, "    cut after %zu bytes\n", length);
        }
    }
    uint8_t *longer = calloc(1, size + FM_FMO_PAGE);
    memcpy(longer, bytes, size);
    CHECK_FAILS(read_bytes(context, longer, size + FM_FMO_PAGE), FM_ERROR_FORMAT);
    CHECK_FAILS(read_bytes(context, longer, size + 1), FM_ERROR_FORMAT);
    free(longer);
}

// Whether a byte is one that a checksum covers: the rest fills pages.
static bool covered(const uint8_t *bytes, size_t at) {
    for (uint32_t i = 0; at >= FM_FMO_PAGE && i < FM_FMO_SECTIONS; i++) {
        fm_fmo_section section;
        memcpy(&section, bytes + sizeof(fm_fmo_header) + i * sizeof section, sizeof section);
        if (at >= section.offset && at < section.offset + section.bytes) {
            return true;
        }
    }
    return at < FM_FMO_PAGE;
}

static void one_bit(fm_context *context, uint8_t *bytes, size_t size) {
    for (size_t at = 0; at < size; at += at < 700 ? 1 : 61) {
        bytes[at] ^= (uint8_t)(1u << at % 8);
        const fm_result result = read_bytes(context, bytes, size);
        bytes[at] ^= (uint8_t)(1u << at % 8);
        if (!CHECK(result == (covered(bytes, at) ? FM_ERROR_FORMAT : FM_OK))) {
            fprintf(stderr, "    bit at byte %zu\n", at);
        }
    }
}

// With the checksums made right again.
static void wrong_bytes(fm_context *context, const uint8_t *bytes, size_t size, size_t at, const void *wrong, size_t length,
                        const char *says) {
    uint8_t *copy = malloc(size);
    memcpy(copy, bytes, size);
    memcpy(copy + at, wrong, length);
    made_seal(copy, size);
    if (!CHECK_FAILS(read_bytes(context, copy, size), FM_ERROR_FORMAT) || !CHECK(strstr(fm_last_error(), says) != NULL)) {
        fprintf(stderr, "    \"%s\" is not in: %s\n", says, fm_last_error());
    }
    free(copy);
}

#define WRONG(context, bytes, size, type, at, value, says)                                                                         \
    wrong_bytes(context, bytes, size, at, &(const type){value}, sizeof(type), says)
#define WRONG_HEADER(type, field, value, says) WRONG(context, bytes, size, type, offsetof(fm_fmo_header, field), value, says)

static void wrong_header(fm_context *context, const uint8_t *bytes, size_t size) {
    WRONG_HEADER(uint32_t, version, 2, "version 2");
    WRONG_HEADER(uint32_t, version, 0, "version 0");
    WRONG_HEADER(uint32_t, kind, FM_OCTREE_KINDS, "kind 7");
    WRONG_HEADER(uint32_t, kind, UINT32_MAX, "kind");
    WRONG_HEADER(uint32_t, method, 2, "method 2");
    WRONG_HEADER(uint32_t, code, 4, "code 4");
    WRONG_HEADER(uint32_t, attribute, 9, "attribute 9");
    WRONG_HEADER(uint32_t, sign, 99, "sign 99");
    WRONG_HEADER(uint32_t, shared, 2, "shared 2");
    WRONG_HEADER(uint32_t, levels, 0, "0 levels");
    WRONG_HEADER(uint32_t, levels, 21, "21 levels");
    WRONG_HEADER(uint32_t, sections, 65, "65 sections");
    WRONG_HEADER(uint32_t, sections, 3, "sections end");
    WRONG_HEADER(uint32_t, sections, 5, "section");
    WRONG_HEADER(uint64_t, image_bytes, size + FM_FMO_PAGE, "truncated");
    WRONG_HEADER(uint64_t, image_bytes, size - FM_FMO_PAGE, "section");
    WRONG_HEADER(uint64_t, image_bytes, size - 1, "truncated");
    WRONG_HEADER(uint64_t, image_bytes, 0, "truncated");
    WRONG_HEADER(uint32_t, size, 0, "size 0");
    WRONG_HEADER(uint32_t, size, (1 << 20) + 1, "size 1048577");
    static const double cells[] = {0, -1, (double)NAN, 1e-60, 1e-40, 1e-300, 0x1p-1074, 4e-19, 1e19, 1e38, 1e300, (double)INFINITY};
    for (size_t i = 0; i < sizeof cells / sizeof *cells; i++) {
        WRONG_HEADER(double, cell, cells[i], "cell");
    }
    fm_fmo_header header;
    memcpy(&header, bytes, sizeof header);
    WRONG_HEADER(double, cell, header.cell * 1.05, "is not that of");
    WRONG_HEADER(double, cell, header.cell * 0.95, "is not that of");
    static const float cutoffs[] = {0, -1, INFINITY, NAN, 1e-44f, 1e30f, 7};  // the diagonal is 3.82
    for (size_t i = 0; i < sizeof cutoffs / sizeof *cutoffs; i++) {
        WRONG_HEADER(float, cutoff, cutoffs[i], "cutoff");
    }
    WRONG_HEADER(float, threshold, NAN, "threshold");
    WRONG_HEADER(float, band, INFINITY, "band");
    WRONG_HEADER(double, origin, (double)NAN, "box");
    WRONG_HEADER(double, origin, 1e300, "farthest");
    WRONG_HEADER(double, origin, -3e18, "farthest");
    WRONG_HEADER(double, origin, 0x1p-1074, "is not that of");
    WRONG_HEADER(double, origin, 1000, "is not that of");
    WRONG_HEADER(float, low[1], NAN, "axis 1");
    WRONG_HEADER(float, low[2], 5, "axis 2");
    WRONG_HEADER(float, low[2], -3e18f, "farthest");
    WRONG_HEADER(float, high[0], -INFINITY, "axis 0");
    WRONG_HEADER(float, high[0], 3e38f, "farthest");
    WRONG_HEADER(float, high[0], 1000, "is not that of");
    WRONG_HEADER(uint32_t, cells[0], 0, "cells");
    WRONG_HEADER(uint32_t, cells[0], 1 << 21, "cells");
    WRONG_HEADER(uint64_t, internal, UINT64_MAX, "so many nodes");
    WRONG_HEADER(uint64_t, empty, UINT64_MAX, "so many nodes");
    WRONG_HEADER(uint64_t, unshared_bytes, 1ull << 63, "so many nodes");
    WRONG_HEADER(uint64_t, leaves[0], 1ull << 60, "so many nodes");
    WRONG_HEADER(uint64_t, leaves[23], 1, "so many nodes");
    WRONG_HEADER(double, code_error, (double)NAN, "so many nodes");
    WRONG_HEADER(double, code_error, -1, "so many nodes");
    WRONG_HEADER(uint32_t, parts[0], 1, "parts");
    WRONG_HEADER(uint32_t, part_cells, 8, "parts");
    WRONG_HEADER(double, part_edge, 1, "parts");
    WRONG_HEADER(uint32_t, top[1], 0, "top grid");
    WRONG_HEADER(uint32_t, top[1], UINT32_MAX, "top grid");
    WRONG_HEADER(uint32_t, top[1], 1 << 20, "top grid");
}

// Top grids of 2^31 cells and more, of which places are counted in 32 bits, and sections whose sum wraps around to a header without
// an image: numbers that agree with each other.
static void wrong_together(fm_context *context, const uint8_t *bytes, size_t size) {
    uint8_t *copy = malloc(size);
    fm_fmo_header header;
    memcpy(copy, bytes, size);
    memcpy(&header, bytes, sizeof header);
    const float end = header.low[0] + (float)((1 << 14) * header.cell);
    header.levels = 3;
    for (int axis = 0; axis < 3; axis++) {
        header.low[axis] = header.low[0];
        header.origin[axis] = header.origin[0];
        header.high[axis] = end;
        header.cells[axis] = 1 << 14;
        header.top[axis] = 1 << 11;
    }
    memset(header.leaves, 0, sizeof header.leaves);
    memcpy(copy, &header, sizeof header);
    made_seal(copy, size);
    CHECK_FAILS(read_bytes(context, copy, size), FM_ERROR_FORMAT);
    CHECK(strstr(fm_last_error(), "fewer than 2^31") != NULL);
    memcpy(copy, bytes, size);
    memcpy(&header, bytes, sizeof header);
    header.image_bytes = 0;
    header.sections = header.parts[0] = header.parts[1] = header.parts[2] = header.part_cells = 1;
    header.part_edge = (double)header.high[0] - (double)header.low[0];
    memcpy(copy, &header, sizeof header);
    const fm_fmo_section section = {.name = FM_FMO_WORDS, .element = 4, .offset = FM_FMO_PAGE, .bytes = UINT64_MAX - 4095};
    memcpy(copy + sizeof header, &section, sizeof section);
    fm_fmo_seal(copy);
    CHECK_FAILS(read_bytes(context, copy, size), FM_ERROR_FORMAT);
    free(copy);
}

static size_t bytes_of_values(const uint8_t *bytes) {
    fm_fmo_section values;
    memcpy(&values, bytes + sizeof(fm_fmo_header) + sizeof values, sizeof values);
    return values.offset;
}

static void wrong_voxels(fm_context *context, const uint8_t *bytes, size_t size) {
    fm_fmo_header header;
    fm_fmo_section section;
    memcpy(&header, bytes, sizeof header);
    memcpy(&section, bytes + sizeof header, sizeof section);
    const uint32_t *words = (const uint32_t *)(const void *)(bytes + FM_FMO_PAGE), count = (uint32_t)(section.bytes / 4);
    uint32_t top = 0;
    while (words[top] == 0 || words[top] == UINT32_MAX) {
        top++;
    }
    const size_t at = FM_FMO_PAGE + 4 * (size_t)top;
    if (header.kind == FM_OCTREE_BRICKS) {
        WRONG(context, bytes, size, uint32_t, FM_FMO_PAGE, 0, "has children");
        WRONG(context, bytes, size, uint32_t, FM_FMO_PAGE, count - 8, "has children");
        WRONG(context, bytes, size, uint32_t, FM_FMO_PAGE, 0x80000000, "leaves");
        WRONG(context, bytes, size, float, bytes_of_values(bytes) + 40, NAN, "finite");
        WRONG_HEADER(uint32_t, levels, 2, "");
    } else if (header.kind == FM_OCTREE_CONTOURS) {
        const size_t node = FM_FMO_PAGE + 4 * (size_t)words[top];
        const uint32_t masks = words[words[top]];
        WRONG(context, bytes, size, uint32_t, at, count - 1, "not all there");
        WRONG(context, bytes, size, uint32_t, at, 0x7fffffff, "not all there");
        WRONG(context, bytes, size, uint32_t, at, 0xffffffff, "not all there");
        // Children in front of the first word, far ones behind the last; a list in front of the first word.
        WRONG(context, bytes, size, uint32_t, node, (masks & 0xffff) | 0xfffe0000, "not all there");
        WRONG(context, bytes, size, uint32_t, node, (masks & 0xffff) | 0xffff0000, "not all there");
        WRONG(context, bytes, size, uint32_t, node + 4, 0xffffffff, "not all there");
        // Pointers of a descriptor all of whose children are leaves.
        WRONG(context, bytes, size, uint32_t, node, 0xffff0101, "all are leaves");
        WRONG(context, bytes, size, uint32_t, node, 0x00020101, "all are leaves");
        WRONG(context, bytes, size, uint32_t, node, 0, "holds nothing");
    } else if (header.kind == FM_OCTREE_DAG) {
        const size_t child = FM_FMO_PAGE + 4 * ((size_t)words[top] + 1);
        WRONG(context, bytes, size, uint32_t, at, count, "has words");
        WRONG(context, bytes, size, uint32_t, at, count - 1, "has words");
        WRONG(context, bytes, size, uint32_t, at, UINT32_MAX - 1, "has words");
        WRONG(context, bytes, size, uint32_t, child, count - 1, "has words");
        WRONG(context, bytes, size, uint32_t, child, 0, "no child");
        WRONG(context, bytes, size, uint32_t, child - 4, 0, "holds nothing");
        WRONG_HEADER(uint32_t, levels, 1, "");
    } else {
        const size_t base = FM_FMO_PAGE + 4 * ((size_t)words[top] + 2);
        WRONG(context, bytes, size, uint32_t, at, count - 2, "has words");
        WRONG(context, bytes, size, uint32_t, at, UINT32_MAX, "has words");
        WRONG(context, bytes, size, uint32_t, base, count - 2, "has words");
        WRONG(context, bytes, size, uint32_t, base, 0x40000000 | (count - 1), "has words");
        WRONG(context, bytes, size, uint32_t, base, 0x40000000, "has words");
        WRONG(context, bytes, size, uint32_t, base, 0xffffffff, "has values");
        // A node that is its own child.
        WRONG(context, bytes, size, uint32_t, base, words[top], "");
        WRONG_HEADER(uint32_t, levels, header.levels - 1, "");
    }
}

static fm_result read_air(void *user, const fm_box *box, uint32_t *voxels) {
    (void)user;
    const int64_t x = box->end[0] - box->begin[0], y = box->end[1] - box->begin[1], z = box->end[2] - box->begin[2];
    memset(voxels, 0, (size_t)(x * y * z) * sizeof *voxels);
    return FM_OK;
}

// Random words of a section changed: what is taken all the same, rays and an update go through; a sanitizer sees them leave it.
static void changed(fm_context *context, const uint8_t *bytes, size_t size, uint64_t seed, bool bricks) {
    enum { TRIES = 300, RAYS = 20 };
    uint8_t *copy = aligned_alloc(64, fm_round_up(size, 64));
    fm_fmo_section section;
    memcpy(&section, bytes + sizeof(fm_fmo_header), sizeof section);
    int taken = 0;
    for (int i = 0; i < TRIES; i++) {
        memcpy(copy, bytes, size);
        for (int k = test_between(&seed, 1, 3); k > 0; k--) {
            const uint64_t at = test_random(&seed) % (section.bytes / 4);
            const uint32_t word = (uint32_t)(test_random(&seed) >> test_between(&seed, 32, 60));
            memcpy(copy + section.offset + 4 * at, &word, sizeof word);
        }
        made_seal(copy, size);
        const fm_fmo_memory memory = {copy, size, keep};
        fm_octree *octree = NULL;
        if (fm_fmo_read_image(context, &memory, "changed", &octree) != FM_OK) {
            continue;
        }
        taken++;
        fm_mesh_ray rays[RAYS];
        fm_octree_hit hits[RAYS];
        for (int r = 0; r < RAYS; r++) {
            rays[r] = (fm_mesh_ray){.last = INFINITY};
            for (int axis = 0; axis < 3; axis++) {
                const float width = octree->info.high[axis] - octree->info.low[axis];
                rays[r].origin[axis] = octree->info.low[axis] + width * (float)test_between(&seed, -50, 150) / 100;
                rays[r].direction[axis] = width * (float)test_between(&seed, -5, 5);
            }
        }
        CHECK_OK(fm_octree_cast(octree, rays, RAYS, 0, hits));
        const uint32_t *cells = octree->info.cells;
        const fm_voxel_source source = {.shape = {cells[0], cells[1], cells[2]}, .read = read_air};
        if (octree->info.kind >= FM_OCTREE_VOXELS && octree->info.kind <= FM_OCTREE_TREE64) {
            CHECK_OK(fm_octree_update_voxels(octree, &source, &(fm_box){{0, 0, 0}, {1, 1, 1}}, 1));
        }
        fm_octree_destroy(octree);
    }
    CHECK((taken > 0 || bricks) && taken < TRIES);
    free(copy);
}

static void wrong_nodes(fm_context *context, const uint8_t *bytes, size_t size) {
    fm_fmo_header header;
    memcpy(&header, bytes, sizeof header);
    const uint32_t *words = (const uint32_t *)(const void *)(bytes + FM_FMO_PAGE);
    fm_fmo_section section;
    memcpy(&section, bytes + sizeof header, sizeof section);
    const uint32_t count = (uint32_t)(section.bytes / 4);
    size_t internal = 0, leaf = 0;
    while (words[internal] >= FM_NODE_EMPTY) {
        internal++;
    }
    while (!(words[leaf] >> 31)) {
        leaf++;
    }
    const size_t child = FM_FMO_PAGE + 4ull * words[internal];
    internal = FM_FMO_PAGE + 4 * internal;
    leaf = FM_FMO_PAGE + 4 * leaf;
    WRONG(context, bytes, size, uint32_t, internal, count, "children begin");
    WRONG(context, bytes, size, uint32_t, internal, count - 7, "children begin");
    WRONG(context, bytes, size, uint32_t, internal, FM_NODE_EMPTY - 1, "children begin");
    WRONG(context, bytes, size, uint32_t, internal, 0, "the top grid's");
    // A child that is its own parent.
    WRONG(context, bytes, size, uint32_t, child, (uint32_t)(child - FM_FMO_PAGE) / 4, "too deep");
    WRONG(context, bytes, size, uint32_t, leaf, 0x80000000, "leaves");
    WRONG(context, bytes, size, uint32_t, leaf, 0x81000000, "leaves");
    fm_fmo_section values;
    memcpy(&values, bytes + sizeof header + sizeof section, sizeof values);
    const uint32_t columns = (uint32_t)(values.bytes / values.element / FM_COLUMN_VALUES);
    if (header.kind == FM_OCTREE_VOXELS) {
        WRONG(context, bytes, size, uint32_t, leaf, ~(uint32_t)(values.bytes / 4), "leaves");
    } else {
        WRONG(context, bytes, size, uint32_t, leaf, ~(columns - 1), "leaves");
    }
    if (header.kind == FM_OCTREE_DISTANCE || header.code == FM_OCTREE_FLOATS) {
        WRONG(context, bytes, size, float, values.offset + 8, NAN, "finite");
        WRONG(context, bytes, size, float, values.offset + 8, 1e30f, "up to");
        WRONG(context, bytes, size, float, values.offset + values.bytes - 4, INFINITY, "finite");
    }
    const size_t at = sizeof header + offsetof(fm_fmo_section, offset);
    WRONG(context, bytes, size, uint64_t, at, FM_FMO_PAGE + 1, "section 0");
    WRONG(context, bytes, size, uint64_t, at, UINT64_MAX - 4095, "section 0");
    WRONG(context, bytes, size, uint64_t, sizeof header + offsetof(fm_fmo_section, bytes), UINT64_MAX, "section 0");
    WRONG(context, bytes, size, uint64_t, sizeof header + offsetof(fm_fmo_section, bytes), section.bytes - 1, "section 0");
    WRONG(context, bytes, size, uint32_t, sizeof header + offsetof(fm_fmo_section, element), 0, "section 0");
    WRONG(context, bytes, size, uint32_t, sizeof header + offsetof(fm_fmo_section, element), 2, "elements");
    WRONG(context, bytes, size, uint32_t, sizeof header + offsetof(fm_fmo_section, name), FM_FMO_VALUES, "");
    // Without any nodes.
    WRONG(context, bytes, size, uint32_t, sizeof header + offsetof(fm_fmo_section, name), 1, "top grid");
}

// A ray along which all finest cells are empty, of which there are 2^20, ends.
static void cast_long(fm_octree *octree) {
    const float cell = (float)octree->info.cell;
    const fm_mesh_ray ray = {.origin = {-cell, 0.25f * cell, 0.25f * cell}, .direction = {1, 0, 0}, .last = INFINITY};
    fm_octree_hit hit;
    if (CHECK_OK(fm_octree_cast(octree, &ray, 1, 0, &hit))) {
        CHECK(!(hit.t < INFINITY) && hit.reads >= 1 << 17 && hit.reads < (1 << 17) + 64);
    }
}

static fm_result write_and_read(const fm_octree *octree) {
    fm_octree *read = NULL;
    CHECK_OK(fm_octree_write(octree, io_path("deep.fmo")));
    const fm_result result = fm_octree_read(octree->context, io_path("deep.fmo"), &read);
    fm_octree_destroy(read);
    io_clear();
    return result;
}

// The same of other kinds, all of whose nodes of a level are alike; of each lowest node only the last voxel is solid.
static uint64_t long_words(fm_octree_kind kind, uint32_t words[]) {
    uint64_t count = 8, below = 0;
    if (kind == FM_OCTREE_CONTOURS) {
        words[count++] = 0x80000000u;  // the list of all: number 0
        count++;
    }
    const int step = kind == FM_OCTREE_TREE64 ? 2 : 1, least = kind == FM_OCTREE_CONTOURS ? 1 : 2;
    for (int level = least; level <= 20; level += step) {
        const uint64_t first = count;
        const bool lowest = level == least;
        if (kind == FM_OCTREE_DAG) {
            words[count++] = lowest ? 0 : 0xff;
            for (int i = 0; i < (lowest ? 1 : 8); i++) {
                words[count++] = lowest ? 1u << 31 : (uint32_t)below;
            }
        }
        for (int i = 0; kind == FM_OCTREE_TREE64 && i < 64; i++) {
            words[count++] = lowest ? 0 : UINT32_MAX;
            words[count++] = lowest ? 1u << 31 : UINT32_MAX;
            words[count++] = lowest ? 0xc0000000u : (uint32_t)below;
        }
        for (int i = 0; kind == FM_OCTREE_CONTOURS && i < 8; i++) {
            words[count] = lowest ? 0x8080u : (uint32_t)(count - below) / 2 << 17 | 0xff00u;
            words[count + 1] = (uint32_t)(count - 8) << 8;
            count += 2;
        }
        below = first;
    }
    words[0] = (uint32_t)below;
    return count;
}

static void long_rays(fm_context *context, fm_octree_kind kind) {
    static const double low[3] = {0}, high[3] = {1, 1, 1};
    uint32_t words[4096] = {0}, number = 7;
    fm_octree_desc filled;
    fm_octree *octree = NULL;
    if (!CHECK_OK(fm_octree_check_desc(&(fm_octree_desc){.kind = kind, .size = 1 << 20, .top_bytes = 4}, &filled)) ||
        !CHECK_OK(fm_octree_new(context, &filled, low, high, &octree))) {
        return;
    }
    const uint64_t count = long_words(kind, words);
    CHECK(octree->info.levels == 20);
    CHECK(fm_octree_reserve(octree, &octree->words, count) && fm_octree_reserve(octree, &octree->values, 1));
    memcpy(octree->words.data, words, count * sizeof *words);
    memcpy(octree->values.data, &number, sizeof number);
    octree->words.count = count;
    octree->values.count = kind != FM_OCTREE_DAG;
    fm_octree_counted(octree);
    cast_long(octree);
    if (kind == FM_OCTREE_DAG) {
        CHECK_OK(write_and_read(octree));
    } else {
        CHECK_FAILS(write_and_read(octree), FM_ERROR_FORMAT);
        CHECK(strstr(fm_last_error(), "more than one parent") != NULL);
    }
    fm_octree_destroy(octree);
}

// Deep sharing: every node of a level has the same eight children. Looked at one by one they would be 8^20.
static fm_octree *make_deep(fm_context *context, fm_octree_kind kind) {
    const fm_octree_desc desc = {.kind = kind, .size = 1 << 20, .top_bytes = 4, .sign = FM_SIGN_NONE};
    static const double low[3] = {0}, high[3] = {1, 1, 1};
    fm_octree_desc filled;
    fm_octree *octree = NULL;
    if (!CHECK_OK(fm_octree_check_desc(&desc, &filled)) || !CHECK_OK(fm_octree_new(context, &filled, low, high, &octree))) {
        return NULL;
    }
    CHECK(octree->info.levels == 20);
    const uint64_t count = 1 + 8ull * octree->info.levels, values = kind == FM_OCTREE_VOXELS ? 1 : 8;
    CHECK(fm_octree_reserve(octree, &octree->words, count + 8) && fm_octree_reserve(octree, &octree->values, values));
    octree->words.count = count;
    octree->values.count = values;
    memset(octree->values.data, 0, 4 * values);
    for (uint64_t i = 0; i < count; i++) {
        made_word(octree, i, i < count - 8 ? (uint32_t)(1 + (i + 7) / 8 * 8) : UINT32_MAX);
    }
    fm_octree_counted(octree);
    return octree;
}

// After updates, and after copies that leave out what is no longer in use, octrees of voxels are still such as files may hold. One
// begins as a node whose children are all empty.
static void updated(fm_context *context, fm_octree_kind kind) {
    enum { STEPS = 60 };
    fm_octree_desc desc = {.kind = kind, .size = 160, .top_bytes = 64};
    fm_octree *octree = made_voxels(context, &desc, 3);
    uint64_t seed = 4, before = 0;
    int copies = 0;
    if (kind == FM_OCTREE_VOXELS && CHECK(fm_octree_reserve(octree, &octree->words, 8))) {
        const uint64_t first = octree->words.count;
        octree->words.count += 8;
        for (uint64_t i = 0; i < 8; i++) {
            made_word(octree, first + i, FM_NODE_EMPTY);
        }
        made_word(octree, 0, (uint32_t)first);
        fm_octree *read = NULL;
        fm_octree_counted(octree);
        CHECK_OK(fm_octree_write(octree, io_path("empty.fmo")));
        if (CHECK_OK(fm_octree_read(context, io_path("empty.fmo"), &read))) {
            fm_octree_destroy(octree);
            octree = read;
        }
    }
    for (int i = 0; i < STEPS; i++) {
        uint64_t own = (uint64_t)i;
        const fm_voxel_source source = {.user = &own, .shape = {desc.size, 29, 17}, .read = made_read};
        const int64_t x = test_between(&seed, 0, 80), y = test_between(&seed, 0, 10);
        const fm_box box = i % 7 == 0 ? (fm_box){{0, 0, 0}, {160, 29, 17}} : (fm_box){{x, y, 0}, {x + 80, y + 19, 17}};
        CHECK_OK(fm_octree_update_voxels(octree, &source, &box, 1));
        copies += octree->words.count < before;
        before = octree->words.count;
        CHECK_OK(write_and_read(octree));
    }
    CHECK(copies > 0 || kind == FM_OCTREE_DAG);  // which stays small
    fm_octree_destroy(octree);
    io_clear();
}

static void shared(fm_context *context) {
    fm_octree *octree = make_deep(context, FM_OCTREE_DISTANCE);
    if (!octree) {
        return;
    }
    const uint64_t count = octree->words.count;
    CHECK_OK(write_and_read(octree));
    // Two of the root's children have what lies below in common, on levels of which one is too low for it.
    octree->words.count += 8;
    for (uint64_t i = 0; i < 8; i++) {
        made_word(octree, count + i, i == 0 ? 9 : i == 1 ? 1 : UINT32_MAX);
    }
    made_word(octree, 0, (uint32_t)count);
    CHECK_FAILS(write_and_read(octree), FM_ERROR_FORMAT);
    made_word(octree, count + 1, 9);
    CHECK_OK(write_and_read(octree));
    octree->info.levels = 19;
    octree->info.top[0] = octree->info.top[1] = octree->info.top[2] = 2;
    CHECK_FAILS(write_and_read(octree), FM_ERROR_FORMAT);
    fm_octree_destroy(octree);
}

// What builds of voxels do not share must not be shared: updates that copy it would never end.
static void shared_voxels(fm_context *context) {
    fm_octree *octree = make_deep(context, FM_OCTREE_VOXELS);
    if (!octree) {
        return;
    }
    CHECK_FAILS(write_and_read(octree), FM_ERROR_FORMAT);
    CHECK(strstr(fm_last_error(), "more than one parent") != NULL);
    const uint64_t count = octree->words.count;
    for (uint64_t i = count - 8; i < count - 1; i++) {
        made_word(octree, i, FM_NODE_EMPTY);
    }
    cast_long(octree);
    fm_octree_destroy(octree);
}

static void places(fm_context *context) {
    fm_octree *octree = made_octree(context, &kinds[0], 3), *read = NULL;
    CHECK_FAILS(fm_octree_write(NULL, io_path("a.fmo")), FM_ERROR_INVALID_ARGUMENT);
    CHECK_FAILS(fm_octree_write(octree, NULL), FM_ERROR_INVALID_ARGUMENT);
    CHECK_FAILS(fm_octree_write(octree, ""), FM_ERROR_INVALID_ARGUMENT);
    CHECK_FAILS(fm_octree_write(octree, io_path("nowhere/a.fmo")), FM_ERROR_IO);
    CHECK_FAILS(fm_octree_write(octree, io_directory), FM_ERROR_IO);
    CHECK_FAILS(fm_octree_write(octree, "/dev/full"), FM_ERROR_IO);
    CHECK_FAILS(fm_octree_read(NULL, io_path("a.fmo"), &read), FM_ERROR_INVALID_ARGUMENT);
    CHECK_FAILS(fm_octree_read(context, NULL, &read), FM_ERROR_INVALID_ARGUMENT);
    CHECK_FAILS(fm_octree_read(context, io_path("a.fmo"), NULL), FM_ERROR_INVALID_ARGUMENT);
    CHECK_FAILS(fm_octree_read(context, io_path("a.fmo"), &read), FM_ERROR_IO);
    CHECK_FAILS(fm_octree_read(context, io_directory, &read), FM_ERROR_IO);
    CHECK_FAILS(fm_octree_read(context, "/dev/null", &read), FM_ERROR_FORMAT);
    io_store(io_path("text.fmo"), "some text", 9);
    CHECK_FAILS(fm_octree_read(context, io_path("text.fmo"), &read), FM_ERROR_FORMAT);
    CHECK(read == NULL && io_file_count() == 1);
    // A gzipped one is read, too.
    CHECK_OK(fm_octree_write(octree, io_path("a.fmo")));
    size_t size = 0;
    uint8_t *bytes = io_contents(io_path("a.fmo"), &size);
    gzFile packed = gzopen(io_path("a.fmo.gz"), "wb");
    CHECK(gzwrite(packed, bytes, (unsigned)size) == (int)size && gzclose(packed) == Z_OK);
    CHECK_OK(fm_octree_read(context, io_path("a.fmo.gz"), &read));
    CHECK(read && same_info(octree, read) && same_array(&octree->words, &read->words));
    free(bytes);
    fm_octree_destroy(read);
    fm_octree_destroy(octree);
    io_clear();
}

static void pack(const char *path, const uint8_t *bytes, size_t size, size_t zeros) {
    static const uint8_t nothing[1 << 16];
    gzFile packed = gzopen(path, "wb");
    CHECK(gzwrite(packed, bytes, (unsigned)size) == (int)size);
    for (size_t done = 0; done < zeros; done += sizeof nothing) {
        CHECK(gzwrite(packed, nothing, sizeof nothing) == (int)sizeof nothing);
    }
    CHECK(gzclose(packed) == Z_OK);
}

// Of a gzipped file no more is unpacked than its header says, and a header that says more than the file can hold is refused before
// memory is taken. Of a file with parts the coarse octree is all.
static void bombs(void) {
    enum { ZEROS = 1 << 28, MOST = 1 << 21 };
    measured m;
    fm_allocator allocator;
    fm_context *context = NULL;
    if (!CHECK_OK(measured_context(&m, &allocator, &context))) {
        return;
    }
    size_t size = 0;
    uint8_t *bytes = made_file(context, &kinds[0], &size);
    const char *path = io_path("bomb.fmo.gz");
    fm_octree *read = NULL;
    m.most = m.now;
    pack(path, bytes, size, ZEROS);
    CHECK_FAILS(fm_octree_read(context, path, &read), FM_ERROR_FORMAT);
    CHECK(strstr(fm_last_error(), "after its last element") != NULL);
    fm_fmo_header header;
    memcpy(&header, bytes, sizeof header);
    header.parts[0] = header.parts[1] = header.parts[2] = header.part_cells = 1;
    header.part_edge = (double)header.high[0] - (double)header.low[0];
    memcpy(bytes, &header, sizeof header);
    made_seal(bytes, size);
    pack(path, bytes, size, ZEROS);
    if (CHECK_OK(fm_octree_read(context, path, &read))) {
        CHECK(read->info.parts == 1 && read->mapped_bytes == size);
    }
    fm_octree_destroy(read);
    read = NULL;
    CHECK(m.most < MOST);
    // Sections that reach to 2^40, as the header says.
    fm_fmo_section section;
    uint8_t *last = bytes + sizeof header + (header.sections - 1) * sizeof section;
    memcpy(&section, last, sizeof section);
    section.bytes = (1ull << 40) - section.offset;
    memcpy(last, &section, sizeof section);
    header.image_bytes = 1ull << 40;
    memcpy(bytes, &header, sizeof header);
    fm_fmo_seal(bytes);
    pack(path, bytes, size, 0);
    CHECK_FAILS(fm_octree_read(context, path, &read), FM_ERROR_FORMAT);
    CHECK(strstr(fm_last_error(), "needs 1099511627776 bytes") != NULL && read == NULL && m.most < MOST);
    free(bytes);
    fm_context_destroy(context);
    CHECK(m.now == 0);
    io_clear();
}

static fm_result attempt(fm_context *context, void *user) {
    fm_octree *octree = NULL;
    fm_result result = fm_octree_read(context, user, &octree);
    if (result == FM_OK) {
        result = fm_octree_write(octree, io_path("out.fmo"));
    }
    fm_octree_destroy(octree);
    return result;
}

int main(void) {
    fm_context *context = NULL;
    const fm_context_desc cpu = {.backend = FM_BACKEND_CPU, .threads = 1};
    if (!io_begin() || !CHECK_OK(fm_context_create(&cpu, &context))) {
        return check_summary();
    }
    for (int i = 0; i < KINDS; i++) {
        round_trip(context, &kinds[i]);
        size_t size = 0;
        uint8_t *bytes = made_file(context, &kinds[i], &size);
        if (i == 0) {
            truncated(context, bytes, size);
            one_bit(context, bytes, size);
            wrong_header(context, bytes, size);
            wrong_together(context, bytes, size);
        }
        if (kinds[i].kind <= FM_OCTREE_VOXELS) {
            wrong_nodes(context, bytes, size);
        } else {
            wrong_voxels(context, bytes, size);
        }
        changed(context, bytes, size, (uint64_t)i, kinds[i].kind == FM_OCTREE_BRICKS);
        free(bytes);
    }
    for (int kind = FM_OCTREE_VOXELS; kind <= FM_OCTREE_TREE64; kind++) {
        updated(context, (fm_octree_kind)kind);
    }
    shared(context);
    shared_voxels(context);
    long_rays(context, FM_OCTREE_CONTOURS);
    long_rays(context, FM_OCTREE_DAG);
    long_rays(context, FM_OCTREE_TREE64);
    places(context);
    bombs();
    fm_octree *octree = made_octree(context, &kinds[1], 5);
    char path[512];
    snprintf(path, sizeof path, "%s", io_path("in.fmo"));
    CHECK_OK(fm_octree_write(octree, path));
    fm_octree_destroy(octree);
    exhaust("an octree's file", attempt, path, -1);
    fm_context_destroy(context);
    return io_end();
}
