// SPDX-License-Identifier: MIT
// Fields of scenes from those of their objects: arguments, and which blocks of texels an update does.

#include "mesh/compose.h"

#include "gpu/gpu.h"

#include <string.h>

enum { LEAST_MOST = 16, DEFAULT_MOST = 512, MOST_AXIS = 65535 };

static const uint32_t block_edges[3] = {FM_COMPOSE_X, FM_COMPOSE_Y, FM_COMPOSE_Z};

static fm_result check_desc(const fm_composed_desc *desc) {
    const uint32_t axes[3] = {desc->shape.x, desc->shape.y, desc->shape.z};
    uint64_t blocks = 1;
    for (int i = 0; i < 3; i++) {
        if (axes[i] == 0 || axes[i] > MOST_AXIS) {
            return fm_fail(FM_ERROR_INVALID_ARGUMENT, "shape is %u x %u x %u: 1 to %d an axis", axes[0], axes[1], axes[2],
                           MOST_AXIS);
        }
        blocks *= fm_div_up(axes[i], block_edges[i]);
    }
    if (blocks > UINT32_MAX) {
        return fm_fail(FM_ERROR_RANGE, "shape is %u x %u x %u: more than 2^32 blocks of %d texels", axes[0], axes[1], axes[2],
                       FM_COMPOSE_TEXELS);
    }
    if (!(desc->band >= 0) || !isfinite(desc->band)) {
        return fm_fail(FM_ERROR_INVALID_ARGUMENT, "band is %g: finite and at least 0 voxels", (double)desc->band);
    }
    if (!(desc->detail >= 0) || !isfinite(desc->detail)) {
        return fm_fail(FM_ERROR_INVALID_ARGUMENT, "detail is %g: finite and at least 0 texels a voxel", (double)desc->detail);
    }
    if (desc->most != 0 && (desc->most < LEAST_MOST || desc->most > MOST_AXIS)) {
        return fm_fail(FM_ERROR_INVALID_ARGUMENT, "most is %u: %d to %d texels, or 0", desc->most, LEAST_MOST, MOST_AXIS);
    }
    if ((unsigned)desc->sign > FM_SIGN_NONE) {
        return fm_fail(FM_ERROR_INVALID_ARGUMENT, "sign is %d: one of FM_SIGN_AUTO, _PSEUDONORMAL, _WINDING, _NONE",
                       (int)desc->sign);
    }
    return FM_OK;
}

static fm_result make_field(fm_composed *composed, const fm_composed_desc *desc) {
    fm_context *context = composed->context;
    fm_volume_desc grid = {.shape = desc->shape, .type = FM_TYPE_F32};
    memcpy(grid.spacing, desc->spacing, sizeof grid.spacing);
    memcpy(grid.origin, desc->origin, sizeof grid.origin);
    FM_TRY(fm_volume_create(context, &grid, &composed->field));
    const double *spacing = composed->field->desc.spacing;
    const double detail = desc->detail > 0 ? (double)desc->detail : 1, band = desc->band > 0 ? (double)desc->band : 3;
    composed->spacing = fmin(spacing[0], fmin(spacing[1], spacing[2])) / detail;
    composed->band = (float)(band * fmax(spacing[0], fmax(spacing[1], spacing[2])));
    const uint32_t axes[3] = {desc->shape.x, desc->shape.y, desc->shape.z};
    for (int i = 0; i < 3; i++) {
        composed->blocks[i] = (uint32_t)fm_div_up(axes[i], block_edges[i]);
    }
    const uint64_t blocks = (uint64_t)composed->blocks[0] * composed->blocks[1] * composed->blocks[2];
    composed->marks = fm_mesh_alloc_zero(context, blocks, "a composed field's blocks");
    composed->list = composed->marks ? fm_mesh_alloc(context, blocks * sizeof *composed->list, "a composed field's blocks") : NULL;
    return composed->list ? FM_OK : FM_ERROR_OUT_OF_HOST_MEMORY;
}

fm_result fm_composed_create(fm_scene *scene, const fm_composed_desc *desc, fm_composed **result) {
    if (!scene || !desc || !result) {
        return fm_fail(FM_ERROR_INVALID_ARGUMENT, "%s is NULL", !scene ? "scene" : desc ? "composed" : "desc");
    }
    FM_TRY(check_desc(desc));
    fm_context *context = scene->context;
    fm_composed *composed = fm_mesh_alloc_zero(context, sizeof *composed, "a composed field");
    if (!composed) {
        return FM_ERROR_OUT_OF_HOST_MEMORY;
    }
    composed->context = context;
    composed->scene = scene;
    composed->most = desc->most > 0 ? desc->most : DEFAULT_MOST;
    composed->sign = desc->sign;
    composed->fresh = true;
    const fm_result status = make_field(composed, desc);
    if (status != FM_OK) {
        fm_composed_destroy(composed);
        return status;
    }
    *result = composed;
    return FM_OK;
}

void fm_composed_destroy(fm_composed *composed) {
    if (!composed) {
        return;
    }
    fm_context *context = composed->context;
    const uint64_t blocks = (uint64_t)composed->blocks[0] * composed->blocks[1] * composed->blocks[2];
    if (context->gpu) {
        // A device that is lost has nothing in flight.
        (void)fm_gpu_wait(context->gpu, fm_gpu_newest(context->gpu));
        fm_gpu_compose_destroy(composed);
    }
    for (uint64_t i = 0; i < composed->item_count; i++) {
        fm_composed_release(composed, &composed->items[i]);
        fm_mesh_destroy(composed->items[i].mesh);
    }
    fm_volume_destroy(composed->field);
    fm_mesh_free(context, composed->items, composed->item_room * sizeof *composed->items);
    fm_mesh_free(context, composed->marks, blocks);
    fm_mesh_free(context, composed->list, blocks * sizeof *composed->list);
    fm_mesh_free(context, composed, sizeof *composed);
}

fm_volume *fm_composed_field(fm_composed *composed) {
    return composed ? composed->field : NULL;
}

static bool first_user(const fm_composed *composed, uint64_t number) {
    uint64_t first = 0;
    while (composed->items[first].local != composed->items[number].local) {
        first++;
    }
    return first == number;
}

void fm_composed_describe(const fm_composed *composed, fm_composed_info *info) {
    double largest = 0;
    *info = (fm_composed_info){.touched = composed->touched};
    for (uint64_t i = 0; i < composed->item_count; i++) {
        const fm_composed_local *local = composed->items[i].local;
        if (local && first_user(composed, i)) {
            largest = fmax(largest, local->volume->desc.spacing[0]);
            info->local_texels += fm_voxels(local->volume->desc.shape);
        }
    }
    info->error = sqrt(3) / 2 * largest;
}

static fm_result make_items(fm_composed *composed) {
    const uint64_t count = composed->scene->object_count;
    if (count > composed->item_room) {
        const uint64_t room = fm_max_u64(count, 2 * composed->item_room), used = composed->item_count;
        fm_composed_item *items = fm_mesh_alloc_zero(composed->context, room * sizeof *items, "a composed field's objects");
        if (!items) {
            return FM_ERROR_OUT_OF_HOST_MEMORY;
        }
        if (used > 0) {
            memcpy(items, composed->items, used * sizeof *items);
        }
        fm_mesh_free(composed->context, composed->items, composed->item_room * sizeof *items);
        composed->items = items;
        composed->item_room = room;
    }
    composed->item_count = count;
    return FM_OK;
}

// Marks the blocks that the object's box meets, and widens `begin` ... `end`, in blocks, to hold them.
static void mark(fm_composed *composed, const fm_compose_object *record, uint32_t begin[3], uint32_t end[3]) {
    uint32_t first[3], last[3];
    for (int axis = 0; axis < 3; axis++) {
        if (record->begin[axis] >= record->end[axis]) {
            return;
        }
        first[axis] = (uint32_t)record->begin[axis] / block_edges[axis];
        last[axis] = (uint32_t)(record->end[axis] - 1) / block_edges[axis] + 1;
    }
    for (int axis = 0; axis < 3; axis++) {
        begin[axis] = first[axis] < begin[axis] ? first[axis] : begin[axis];
        end[axis] = last[axis] > end[axis] ? last[axis] : end[axis];
    }
    for (uint32_t z = first[2]; z < last[2]; z++) {
        for (uint32_t y = first[1]; y < last[1]; y++) {
            memset(composed->marks + ((uint64_t)z * composed->blocks[1] + y) * composed->blocks[0] + first[0], 1,
                   last[0] - first[0]);
        }
    }
}

// Lists the marked blocks within the box, and clears their marks.
static uint64_t collect(fm_composed *composed, const uint32_t begin[3], const uint32_t end[3]) {
    uint64_t count = 0;
    for (uint32_t z = begin[2]; z < end[2]; z++) {
        for (uint32_t y = begin[1]; y < end[1]; y++) {
            const uint64_t row = ((uint64_t)z * composed->blocks[1] + y) * composed->blocks[0];
            for (uint32_t x = begin[0]; x < end[0]; x++) {
                composed->list[count] = (uint32_t)(row + x);
                count += composed->marks[row + x];
            }
            memset(composed->marks + row + begin[0], 0, end[0] - begin[0]);
        }
    }
    return count;
}

static fm_compose_work find_work(fm_composed *composed) {
    if (composed->fresh) {
        return (fm_compose_work){NULL, (uint64_t)composed->blocks[0] * composed->blocks[1] * composed->blocks[2]};
    }
    uint32_t begin[3] = {UINT32_MAX, UINT32_MAX, UINT32_MAX}, end[3] = {0, 0, 0};
    for (uint64_t i = 0; i < composed->item_count; i++) {
        const fm_composed_item *item = &composed->items[i];
        if (item->changed) {
            mark(composed, &item->record, begin, end);
            mark(composed, &item->next, begin, end);
        }
    }
    return (fm_compose_work){composed->list, collect(composed, begin, end)};
}

static uint64_t texels_of(const fm_composed *composed, const fm_compose_work *work) {
    const fm_shape shape = composed->field->desc.shape;
    return fm_min_u64(work->count * FM_COMPOSE_TEXELS, fm_voxels(shape));
}

static fm_result compose(fm_composed *composed, fm_ticket *ticket) {
    const fm_compose_work work = find_work(composed);
    fm_context *context = composed->context;
    if (work.count > 0 && context->gpu) {
        FM_TRY(fm_gpu_compose(composed, &work, ticket));
    } else if (work.count > 0) {
        fm_passes_begin(context);
        fm_host_compose(composed, &work);
        fm_passes_end(context, "compose", work.count * FM_COMPOSE_TEXELS * sizeof(float));
    }
    for (uint64_t i = 0; i < composed->item_count; i++) {
        composed->items[i].record = composed->items[i].next;
        composed->items[i].changed = false;
    }
    composed->fresh = false;
    composed->touched = texels_of(composed, &work);
    return FM_OK;
}

fm_result fm_composed_update(fm_composed *composed, fm_ticket *ticket) {
    if (!composed) {
        return fm_fail(FM_ERROR_INVALID_ARGUMENT, "composed is NULL");
    }
    const fm_scene *scene = composed->scene;
    for (uint64_t i = 0; i < scene->object_count; i++) {
        FM_TRY(fm_composed_check_place(&scene->objects[i], i));
    }
    FM_TRY(make_items(composed));
    for (uint64_t i = 0; i < composed->item_count; i++) {
        FM_TRY(fm_composed_prepare(composed, i));
    }
    fm_gpu *gpu = composed->context->gpu;
    fm_ticket done = 0;
    FM_TRY(compose(composed, &done));
    // Local fields may be in flight though no texel of the field was touched.
    done = gpu ? fm_gpu_newest(gpu) : 0;
    if (ticket) {
        *ticket = done;
        return FM_OK;
    }
    return gpu ? fm_gpu_wait(gpu, done) : FM_OK;
}
