// SPDX-License-Identifier: MIT
// Whether an octree of child descriptors from a file is such that rays can go through it: see
// shaders/include/octree_contours_rule.h.

#include "octree/validate.h"

#include "shaders/include/octree_contours_rule.h"

typedef struct descriptors {
    fm_octree_head head;
    const uint32_t *words;
    uint64_t count, top, values;  // nothing but the top grid lies in its words, which updates overwrite
    uint8_t *visited;             // of each place
} descriptors;

static fm_result bad(uint64_t node, const char *what, uint64_t at) {
    return fm_fail(FM_ERROR_FORMAT, "descriptor %llu: %s at %llu are not all there", (unsigned long long)node, what,
                   (unsigned long long)at);
}

static uint32_t ones(uint32_t bits) {
    return (uint32_t)__builtin_popcount(bits);
}

static fm_result check_list(const descriptors *d, uint64_t node, uint32_t leaves) {
    const uint64_t back = d->words[node + 1] >> 8, contours = ones(d->words[node + 1] & 255);
    if (back > node || node - back < d->top || node - back + 1 + contours > d->count) {
        return bad(node, "its list's words", back);
    }
    const uint32_t base = d->words[node - back];
    const uint64_t first = base & ~FM_CONTOURS_SAME, numbers = base & FM_CONTOURS_SAME ? 1 : ones(leaves);
    return leaves == 0 || first + numbers <= d->values ? FM_OK : bad(node, "its leaves' numbers", first);
}

static fm_result check_descriptor(const descriptors *d, uint64_t node, uint32_t level) {
    if (node < d->top || node + 2 > d->count) {
        return bad(node, "its words", node);
    }
    if (d->visited[node]) {
        return fm_fail(FM_ERROR_FORMAT, "descriptor %llu: has more than one parent, or is below itself", (unsigned long long)node);
    }
    d->visited[node] = 1;
    const uint32_t masks = d->words[node], valid = masks >> 8 & 255, leaves = masks & 255, nodes = ones(valid & ~leaves);
    if ((leaves & ~valid) != 0 || (level == 1 && nodes > 0)) {
        return fm_fail(FM_ERROR_FORMAT, "descriptor %llu: its children, %u of which are leaves, cannot be on level %u",
                       (unsigned long long)node, leaves, level - 1);
    }
    FM_TRY(check_list(d, node, leaves));
    if (valid == 0) {
        return fm_fail(FM_ERROR_FORMAT, "descriptor %llu: holds nothing", (unsigned long long)node);
    }
    if (nodes == 0) {
        return masks >> 16 == 0
                   ? FM_OK
                   : fm_fail(FM_ERROR_FORMAT, "descriptor %llu: points to children, but all are leaves", (unsigned long long)node);
    }
    const uint64_t pointer = masks >> 17;
    if (masks & FM_CONTOURS_FAR ? node + pointer >= d->count : 2 * pointer > node) {
        return bad(node, "its children's place", pointer);
    }
    const uint64_t first = fm_contours_children(d->head, (uint32_t)node, masks);
    for (uint32_t i = 0; i < nodes; i++) {
        FM_TRY(check_descriptor(d, first + 2 * i, level - 1));
    }
    return FM_OK;
}

fm_result fm_octree_check_contours(const fm_octree *octree, uint8_t *marks) {
    uint64_t top = 0;
    FM_TRY(fm_octree_check_top(octree, &top));
    const descriptors d = {.head = fm_octree_host_head(octree),
                           .words = (const uint32_t *)(const void *)octree->words.data,
                           .count = octree->words.count,
                           .top = top,
                           .values = octree->values.count,
                           .visited = marks};
    if (octree->info.levels == 0) {
        return fm_fail(FM_ERROR_FORMAT, "0 levels: descriptors have children");
    }
    for (uint64_t i = 0; i < top; i++) {
        if (d.words[i] & FM_CONTOURS_SOLID) {
            FM_TRY((d.words[i] & ~FM_CONTOURS_SOLID) < d.values ? FM_OK : bad(i, "its leaves' numbers", d.words[i]));
        } else if (d.words[i] != 0) {
            FM_TRY(check_descriptor(&d, d.words[i], octree->info.levels));
        }
    }
    return FM_OK;
}
