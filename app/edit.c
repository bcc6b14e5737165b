// SPDX-License-Identifier: MIT
#include "edit.h"

#include <stdlib.h>
#include <string.h>

fm_brush edit_brush(const int32_t voxel[3], int32_t face, uint32_t radius, uint32_t color, bool erase) {
    // High bits make black, whose colour is 0, solid.
    fm_brush brush = {.kind = FM_BRUSH_SPHERE, .voxel = erase ? 0 : 0x100 | color, .radius = radius};
    memcpy(brush.from, voxel, sizeof brush.from);
    if (!erase && face) {
        brush.from[abs(face) - 1] += face > 0 ? 1 : -1;
    }
    return brush;
}

static void forget(edit_history *h, uint32_t first, uint32_t count) {
    for (uint32_t i = first; i < first + count; i++) {
        h->bytes -= h->steps[i].bytes;
        free(h->steps[i].before);
    }
    if (count > 0) {
        memmove(h->steps + first, h->steps + first + count, (h->count - first - count) * sizeof *h->steps);
        h->count -= count;
    }
}

void edit_clear(edit_history *h) {
    forget(h, 0, h->count);
    free(h->steps);
    *h = (edit_history){.limit = h->limit};
}

static bool box_of(const fm_world *world, const fm_brush *brush, fm_box *box, uint64_t *voxels) {
    fm_world_desc desc;
    fm_world_info(world, &desc);
    const int64_t shape[3] = {desc.shape.x, desc.shape.y, desc.shape.z}, radius = brush->radius;
    *voxels = 1;
    for (int axis = 0; axis < 3; axis++) {
        const int64_t begin = brush->from[axis] - radius, end = brush->from[axis] + radius + 1;
        box->begin[axis] = begin < 0 ? 0 : begin;
        box->end[axis] = end > shape[axis] ? shape[axis] : end;
        if (box->begin[axis] >= box->end[axis]) {
            return false;
        }
        *voxels *= (uint64_t)(box->end[axis] - box->begin[axis]);
    }
    return true;
}

// Memory for the voxels of one more step of `bytes` and for the step, or NULL when it cannot be remembered.
static uint32_t *memory_for(edit_history *h, uint64_t bytes) {
    if (bytes > h->limit) {
        return NULL;
    }
    if (h->count == h->capacity) {
        const uint32_t capacity = h->capacity ? 2 * h->capacity : 64;
        edit_step *steps = realloc(h->steps, capacity * sizeof *steps);
        if (!steps) {
            return NULL;
        }
        h->steps = steps;
        h->capacity = capacity;
    }
    return malloc(bytes);
}

// The newest step; what was undone, and what is too old for the memory, is forgotten.
static void remember(edit_history *h, const edit_step *step) {
    forget(h, h->at, h->count - h->at);
    uint32_t oldest = 0;
    for (uint64_t bytes = h->bytes; bytes + step->bytes > h->limit; oldest++) {
        bytes -= h->steps[oldest].bytes;
    }
    forget(h, 0, oldest);
    h->steps[h->count++] = *step;
    h->at = h->count;
    h->bytes += step->bytes;
}

// Whether a sphere makes any voxel of its box another one.
static bool makes_other(const edit_step *step) {
    const fm_box *box = &step->box;
    const int64_t radius = step->brush.radius;
    const uint32_t *voxel = step->before;
    for (int64_t z = box->begin[2] - step->brush.from[2]; z < box->end[2] - step->brush.from[2]; z++) {
        for (int64_t y = box->begin[1] - step->brush.from[1]; y < box->end[1] - step->brush.from[1]; y++) {
            for (int64_t x = box->begin[0] - step->brush.from[0]; x < box->end[0] - step->brush.from[0]; x++, voxel++) {
                if (x * x + y * y + z * z <= radius * radius && *voxel != step->brush.voxel) {
                    return true;
                }
            }
        }
    }
    return false;
}

// An edit that cannot be taken back ends what could be before it.
static bool apply_for_good(edit_history *h, fm_world *world, const fm_brush *brush) {
    if (fm_world_edit(world, brush, 1) != FM_OK) {
        return false;
    }
    forget(h, 0, h->count);
    h->at = 0;
    return true;
}

bool edit_apply(edit_history *h, fm_world *world, const fm_brush *brush, bool *changes) {
    edit_step step = {.brush = *brush};
    uint64_t voxels;
    *changes = box_of(world, brush, &step.box, &voxels);
    if (!*changes) {
        return true;
    }
    step.bytes = voxels * sizeof *step.before;
    step.before = memory_for(h, step.bytes);
    if (!step.before) {
        return apply_for_good(h, world, brush);
    }
    const bool read = fm_world_read(world, &step.box, step.before) == FM_OK;
    *changes = read && makes_other(&step);
    if (!*changes || fm_world_edit(world, brush, 1) != FM_OK) {
        free(step.before);
        return read && !*changes;
    }
    remember(h, &step);
    return true;
}

bool edit_undo(edit_history *h, fm_world *world, bool *failed) {
    *failed = false;
    if (h->at == 0) {
        return false;
    }
    const edit_step *step = &h->steps[h->at - 1];
    *failed = fm_world_write(world, &step->box, step->before) != FM_OK;
    h->at -= !*failed;
    return !*failed;
}

bool edit_redo(edit_history *h, fm_world *world, bool *failed) {
    *failed = false;
    if (h->at == h->count) {
        return false;
    }
    *failed = fm_world_edit(world, &h->steps[h->at].brush, 1) != FM_OK;
    h->at += !*failed;
    return !*failed;
}
