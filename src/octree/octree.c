// SPDX-License-Identifier: MIT
// What all octrees have in common: their descriptors, their grids, their arrays.

#include "octree/voxels.h"
#include "volume/volume.h"

#include <math.h>
#include <string.h>

_Static_assert((int)FM_OCTREE_CLOSEST == FM_GPU_CLOSEST && (int)FM_OCTREE_DISTANCE == FM_GPU_DISTANCE &&
                   (int)FM_OCTREE_VOXELS == FM_GPU_VOXELS && (int)FM_OCTREE_CONTOURS == FM_GPU_CONTOURS &&
                   (int)FM_OCTREE_DAG == FM_GPU_DAG && (int)FM_OCTREE_TREE64 == FM_GPU_TREE64 &&
                   (int)FM_OCTREE_BRICKS == FM_GPU_BRICKS && (int)FM_OCTREE_SPHERICAL == FM_GPU_SPHERICAL &&
                   (int)FM_OCTREE_OCTAHEDRAL == FM_GPU_OCTAHEDRAL && (int)FM_OCTREE_FLOATS == FM_GPU_FLOATS &&
                   (int)FM_OCTREE_SHORT == FM_GPU_SHORT && (int)FM_OCTREE_COLOR == FM_GPU_COLOR,
               "shaders number kinds and codes as the header does");

enum { MOST_CELLS = 1 << 20, LEAST_LEVELS = 3, MOST_LEVELS = 20 };
// Rays cross the top grid cell by cell; empty cells of values tell how far nothing is, those of voxels do not, and a coarse grid of
// them is crossed in fewer steps: 8^3 cells.
static const uint64_t TOP_BYTES = 1 << 20, VOXEL_TOP_BYTES = 1 << 11, HOST_BYTES = 1 << 30;

const char *fm_octree_kind_name(fm_octree_kind kind) {
    static const char *const names[FM_OCTREE_KINDS] = {"FM_OCTREE_CLOSEST",  "FM_OCTREE_DISTANCE", "FM_OCTREE_VOXELS",
                                                       "FM_OCTREE_CONTOURS", "FM_OCTREE_DAG",      "FM_OCTREE_TREE64",
                                                       "FM_OCTREE_BRICKS"};
    return names[kind];
}

static fm_result check_numbers(const fm_octree_desc *desc) {
    if (desc->size > MOST_CELLS) {
        return fm_fail(FM_ERROR_INVALID_ARGUMENT, "size is %u: at most %d cells", desc->size, MOST_CELLS);
    }
    if (isnan(desc->threshold)) {
        return fm_fail(FM_ERROR_INVALID_ARGUMENT, "threshold is no number");
    }
    if (desc->band != 0 && !(desc->band >= 0.05f && desc->band <= 3.5f)) {
        return fm_fail(FM_ERROR_INVALID_ARGUMENT, "band is %g: 0.05 to 3.5 cells, or 0 for 2 sqrt(3)", (double)desc->band);
    }
    if (desc->kind == FM_OCTREE_CLOSEST && desc->code == FM_OCTREE_SHORT && !(desc->band > 0 && desc->band <= 0.2f)) {
        return fm_fail(FM_ERROR_INVALID_ARGUMENT, "code FM_OCTREE_SHORT with a band of %g: 0.05 to 0.2 cells", (double)desc->band);
    }
    for (int axis = 0; axis < 3; axis++) {
        if (!isfinite(desc->low[axis]) || !isfinite(desc->high[axis]) || desc->low[axis] > desc->high[axis]) {
            return fm_fail(FM_ERROR_INVALID_ARGUMENT, "the box runs from %g to %g along axis %d: finite numbers in order",
                           (double)desc->low[axis], (double)desc->high[axis], axis);
        }
    }
    return FM_OK;
}

fm_result fm_octree_check_desc(const fm_octree_desc *desc, fm_octree_desc *filled) {
    *filled = desc ? *desc : (fm_octree_desc){0};
    if ((uint32_t)filled->kind >= FM_OCTREE_KINDS || (uint32_t)filled->method > FM_OCTREE_GROWN ||
        (uint32_t)filled->code > FM_OCTREE_SHORT || (uint32_t)filled->attribute > FM_OCTREE_TEXTURE ||
        (uint32_t)filled->sign > FM_SIGN_NONE) {
        return fm_fail(FM_ERROR_INVALID_ARGUMENT, "kind %d, method %d, code %d, attribute %d, sign %d: one of them is not known",
                       (int)filled->kind, (int)filled->method, (int)filled->code, (int)filled->attribute, (int)filled->sign);
    }
    FM_TRY(check_numbers(filled));
    filled->size = filled->size > 0 ? filled->size : 256;
    filled->threshold = filled->threshold == 0 ? 0.05f : filled->threshold;
    filled->band = filled->band == 0 ? 3.4641016f : filled->band;
    filled->top_bytes = filled->top_bytes > 0 ? filled->top_bytes : fm_voxel_kind_of(filled->kind) ? VOXEL_TOP_BYTES : TOP_BYTES;
    filled->host_bytes = filled->host_bytes > 0 ? filled->host_bytes : HOST_BYTES;
    return FM_OK;
}

static uint64_t top_count(const fm_octree_info *info, uint32_t levels, uint32_t top[3]) {
    uint64_t count = 1;
    for (int axis = 0; axis < 3; axis++) {
        top[axis] = (uint32_t)fm_div_up(info->cells[axis], 1ull << levels);
        count *= top[axis];
    }
    return count;
}

// What floats carry, and what reading a file of it takes.
static fm_result check_reach(double cell, const double low[3], const double high[3]) {
    double farthest = 0;
    for (int axis = 0; axis < 3; axis++) {
        farthest = fmax(farthest, fmax(fabs(low[axis]), fabs(high[axis])));
    }
    if (cell < FM_OCTREE_LEAST_CELL || cell > FM_OCTREE_GREATEST_CELL || farthest > FM_OCTREE_FARTHEST) {
        return fm_fail(FM_ERROR_INVALID_ARGUMENT, "cells of %g in a box as far as %g: cells from %g on, and boxes as far as %g",
                       cell, farthest, FM_OCTREE_LEAST_CELL, FM_OCTREE_FARTHEST);
    }
    return FM_OK;
}

static fm_result make_grid(fm_octree *octree, const double low[3], const double high[3]) {
    fm_octree_info *info = &octree->info;
    double longest = 0;
    for (int axis = 0; axis < 3; axis++) {
        longest = fmax(longest, high[axis] - low[axis]);
    }
    if (!(longest > 0) || !isfinite(longest)) {
        return fm_fail(FM_ERROR_INVALID_ARGUMENT, "the box has no volume");
    }
    info->cell = longest / octree->desc.size;
    FM_TRY(check_reach(info->cell, low, high));
    for (int axis = 0; axis < 3; axis++) {
        const double cells = ceil((high[axis] - low[axis]) / info->cell * (1 - 1e-9));
        info->cells[axis] = (uint32_t)fmax(1, cells);
        info->origin[axis] = low[axis];
        info->low[axis] = (float)low[axis];
        info->high[axis] = (float)high[axis];
    }
    info->levels = LEAST_LEVELS;
    while (top_count(info, info->levels, info->top) * 4 > octree->desc.top_bytes && info->levels < MOST_LEVELS) {
        info->levels++;
    }
    return FM_OK;
}

static void fill_head(fm_octree *octree) {
    const fm_octree_info *info = &octree->info;
    fm_octree_head *head = &octree->head;
    *head = (fm_octree_head){.kind = (int32_t)info->kind, .code = (int32_t)info->code, .levels = (int32_t)info->levels};
    double diagonal2 = 0;
    for (int axis = 0; axis < 3; axis++) {
        head->top[axis] = (int32_t)info->top[axis];
        head->origin[axis] = (float)info->origin[axis];
        head->low[axis] = info->low[axis];
        head->high[axis] = info->high[axis];
        diagonal2 += pow(info->cells[axis] * info->cell, 2);
    }
    head->cell = (float)info->cell;
    head->cutoff = (float)sqrt(diagonal2);
}

void fm_octree_size_arrays(fm_octree *octree) {
    octree->words.size = octree->attributes.size = octree->extra.size = 4;
    octree->values.size = 4;
    if (octree->info.kind == FM_OCTREE_CLOSEST) {
        octree->values.size = octree->info.code == FM_OCTREE_FLOATS ? 12 : octree->info.code == FM_OCTREE_SHORT ? 2 : 4;
    }
}

fm_result fm_octree_new(fm_context *context, const fm_octree_desc *desc, const double low[3], const double high[3],
                        fm_octree **result) {
    fm_octree *octree = fm_alloc_zero(&context->allocator, sizeof *octree, "an octree");
    if (!octree) {
        return FM_ERROR_OUT_OF_HOST_MEMORY;
    }
    octree->context = context;
    octree->desc = *desc;
    octree->desc.colors = NULL;
    octree->desc.texture = NULL;
    octree->desc.folder = NULL;
    octree->info = (fm_octree_info){.kind = desc->kind,
                                    .method = desc->method,
                                    .code = desc->code,
                                    .attribute = desc->attribute,
                                    .sign = desc->sign,
                                    .shared = desc->share};
    octree->version = 1;
    fm_octree_size_arrays(octree);
    const fm_result status = make_grid(octree, low, high);
    if (status != FM_OK) {
        fm_octree_destroy(octree);
        return status;
    }
    fill_head(octree);
    *result = octree;
    return FM_OK;
}

void *fm_octree_alloc(fm_context *context, uint64_t bytes, const char *what) {
    void *memory = fm_alloc(&context->allocator, bytes, what);
    if (memory) {
        fm_meter_add(&context->host[FM_PURPOSE_OCTREES], bytes);
    }
    return memory;
}

void *fm_octree_alloc_zero(fm_context *context, uint64_t bytes, const char *what) {
    void *memory = fm_octree_alloc(context, bytes, what);
    if (memory) {
        memset(memory, 0, bytes);
    }
    return memory;
}

void fm_octree_free(fm_context *context, void *memory, uint64_t bytes) {
    if (memory) {
        fm_meter_remove(&context->host[FM_PURPOSE_OCTREES], bytes);
        fm_free(&context->allocator, memory, bytes);
    }
}

bool fm_octree_reserve(fm_octree *octree, fm_octree_array *array, uint64_t more) {
    uint64_t wanted, bytes;
    if (fm_add_overflows(array->count, more, &wanted)) {
        (void)fm_fail(FM_ERROR_OUT_OF_HOST_MEMORY, "an octree's array cannot have so many elements");
        return false;
    }
    if (wanted <= array->room) {
        return true;
    }
    const uint64_t room = fm_max_u64(wanted, array->room + array->room / 2);
    if (fm_mul_overflows(room, array->size, &bytes)) {
        (void)fm_fail(FM_ERROR_OUT_OF_HOST_MEMORY, "an octree's array cannot have so many bytes");
        return false;
    }
    uint8_t *data = fm_octree_alloc(octree->context, bytes, "an octree");
    if (!data) {
        return false;
    }
    if (array->count > 0) {
        memcpy(data, array->data, array->count * array->size);
    }
    const uint64_t count = array->count;
    fm_octree_array_free(octree, array);
    array->data = data;
    array->count = count;
    array->room = room;
    return true;
}

void fm_octree_array_free(fm_octree *octree, fm_octree_array *array) {
    if (array->room > 0) {
        fm_octree_free(octree->context, array->data, array->room * array->size);
    }
    array->data = NULL;
    array->count = array->room = 0;
}

void fm_octree_counted(fm_octree *octree) {
    fm_octree_info *info = &octree->info;
    info->node_bytes = octree->words.count * octree->words.size + octree->extra.count * octree->extra.size;
    info->leaf_bytes = octree->values.count * octree->values.size;
    info->attribute_bytes = octree->attributes.count * octree->attributes.size;
    octree->version++;
}

void fm_octree_note_change(fm_octree *octree, const fm_octree_change *change) {
    fm_octree_change *all = &octree->change;
    if (all->until != octree->version) {
        *all = *change;
        all->since = octree->version;
    } else {
        for (int i = 0; i < 4; i++) {
            all->kept[i] = fm_min_u64(all->kept[i], change->kept[i]);
        }
        all->low = all->low < all->high ? fm_min_u64(all->low, change->low) : change->low;
        all->high = fm_max_u64(all->high, change->high);
    }
    all->until = octree->version + 1;
}

fm_octree_head fm_octree_host_head(const fm_octree *octree) {
    fm_octree_head head = octree->head;
    head.mark = (int32_t)octree->info.attribute;
    head.sign = octree->info.sign != FM_SIGN_NONE;
    head.words = (uintptr_t)octree->words.data;
    head.values = (uintptr_t)octree->values.data;
    head.attributes = (uintptr_t)octree->attributes.data;
    head.extra = (uintptr_t)octree->extra.data;
    return head;
}

void fm_octree_describe(const fm_octree *octree, fm_octree_info *info) {
    if (octree && info) {
        *info = octree->info;
    }
}

void fm_octree_destroy(fm_octree *octree) {
    if (!octree) {
        return;
    }
    fm_gpu_octree_destroy(octree);
    if (octree->forget) {
        octree->forget(octree);
    }
    fm_octree_array *const arrays[] = {&octree->words, &octree->values, &octree->attributes, &octree->extra};
    for (size_t i = 0; i < sizeof arrays / sizeof *arrays; i++) {
        fm_octree_array_free(octree, arrays[i]);
    }
    if (octree->unmap) {
        octree->unmap(octree);
    }
    fm_free(&octree->context->allocator, octree, sizeof *octree);
}
