// SPDX-License-Identifier: MIT
// Boxes of a world on their way to and from host arrays. What the host does not reach goes through a piece of a few MiB, whole rows
// of the world at a time.

#include "world/transfer.h"

#include "world/gpu_world.h"
#include "world/host_world.h"

#include <string.h>

static uint64_t row_voxels(const fm_world *world) {
    return world->desc.shape.x;
}

uint32_t *fm_world_reached_voxels(const fm_world *world) {
    return world->host ? world->host->voxels : fm_buffer_mapped(world->gpu->voxels);
}

uint64_t fm_world_piece_rows(const fm_world *world) {
    enum { PIECE_VOXELS = 1 << 20 };
    return fm_max_u64(1, PIECE_VOXELS / row_voxels(world));
}

fm_result fm_world_put(fm_world *world, uint64_t first, const uint32_t *voxels, uint64_t count) {
    uint32_t *there = fm_world_reached_voxels(world);
    if (there) {
        memcpy(there + first, voxels, count * sizeof *voxels);
        return FM_OK;
    }
    return fm_buffer_upload_at(world->gpu->voxels, first * sizeof *voxels, voxels, count * sizeof *voxels);
}

fm_result fm_world_get(const fm_world *world, uint64_t first, uint32_t *voxels, uint64_t count) {
    if (world->host) {
        memcpy(voxels, world->host->voxels + first, count * sizeof *voxels);
        return FM_OK;
    }
    return fm_buffer_download_at(world->gpu->voxels, first * sizeof *voxels, voxels, count * sizeof *voxels);
}

fm_result fm_world_check_box(const fm_world *world, const fm_box *box) {
    const fm_shape shape = world->desc.shape;
    const int64_t axes[3] = {shape.x, shape.y, shape.z};
    for (int i = 0; i < 3; i++) {
        if (box->begin[i] < 0 || box->end[i] > axes[i] || box->begin[i] >= box->end[i]) {
            return fm_fail(FM_ERROR_INVALID_ARGUMENT,
                           "box is %lld to %lld along %c: it must hold a voxel and lie within 0 to %lld, its end excluded",
                           (long long)box->begin[i], (long long)box->end[i], "xyz"[i], (long long)axes[i]);
        }
    }
    return FM_OK;
}

// A run of rows of a box within one slice (all of the box where its rows follow each other), or what is left of it.
typedef struct box_walk {
    fm_shape shape;
    fm_box box;
    uint64_t width, rows;  // of the box in a slice
    bool whole_rows;       // of the world
    bool linear;           // no gap between slices either
    uint64_t next;         // row of the box
    uint64_t most;         // rows of a step
    uint64_t first;        // element of the world at which the step's first row begins
    uint64_t count;        // rows of the step
    uint64_t done;         // voxels of the box before the step
} box_walk;

static box_walk walk_box(const fm_world *world, const fm_box *box, uint64_t most) {
    box_walk walk = {.shape = world->desc.shape, .box = *box};
    walk.width = (uint64_t)(box->end[0] - box->begin[0]);
    walk.rows = (uint64_t)(box->end[1] - box->begin[1]);
    walk.whole_rows = walk.width == walk.shape.x;
    walk.linear = walk.whole_rows && walk.rows == walk.shape.y;
    walk.most = fm_min_u64(most, walk.linear ? walk.rows * (uint64_t)(box->end[2] - box->begin[2]) : walk.rows);
    return walk;
}

static bool walk_next(box_walk *walk) {
    const uint64_t all = walk->rows * (uint64_t)(walk->box.end[2] - walk->box.begin[2]);
    walk->next += walk->count;
    if (walk->next == all) {
        return false;
    }
    const uint64_t y = (uint64_t)walk->box.begin[1] + walk->next % walk->rows;
    const uint64_t z = (uint64_t)walk->box.begin[2] + walk->next / walk->rows;
    const uint64_t left = walk->linear ? all - walk->next : walk->rows - walk->next % walk->rows;
    walk->first = walk->shape.x * (y + walk->shape.y * z);
    walk->count = fm_min_u64(left, walk->most);
    walk->done = walk->next * walk->width;
    return true;
}

// Copies `count` rows between a dense box and rows of the world.
static void copy_rows(uint32_t *to, uint64_t to_pitch, const uint32_t *from, uint64_t from_pitch, uint64_t width, uint64_t count) {
    for (uint64_t i = 0; i < count; i++) {
        memcpy(to + i * to_pitch, from + i * from_pitch, width * sizeof *to);
    }
}

static fm_result check_voxels(const fm_world *world, const fm_box *box, const void *voxels) {
    if (!world || !box || !voxels) {
        return fm_fail(FM_ERROR_INVALID_ARGUMENT, "%s is NULL", !world ? "world" : box ? "voxels" : "box");
    }
    return fm_world_check_box(world, box);
}

fm_result fm_world_write(fm_world *world, const fm_box *box, const uint32_t *voxels) {
    FM_TRY(check_voxels(world, box, voxels));
    FM_TRY(fm_wait(world->context, world->newest));
    const uint64_t pitch = row_voxels(world), begin = (uint64_t)box->begin[0];
    uint32_t *there = fm_world_reached_voxels(world);
    void *piece = NULL;
    box_walk walk = walk_box(world, box, there ? UINT64_MAX : fm_world_piece_rows(world));
    if (!there && !walk.whole_rows) {
        FM_TRY(fm_context_scratch(world->context, walk.most * pitch * sizeof(uint32_t), &piece));
    }
    while (walk_next(&walk)) {
        if (there) {
            copy_rows(there + walk.first + begin, pitch, voxels + walk.done, walk.width, walk.width, walk.count);
        } else if (walk.whole_rows) {
            FM_TRY(fm_world_put(world, walk.first, voxels + walk.done, walk.count * pitch));
        } else {
            FM_TRY(fm_world_get(world, walk.first, piece, walk.count * pitch));
            copy_rows((uint32_t *)piece + begin, pitch, voxels + walk.done, walk.width, walk.width, walk.count);
            FM_TRY(fm_world_put(world, walk.first, piece, walk.count * pitch));
        }
    }
    fm_world_mark(world, box);
    return FM_OK;
}

// Hands the rows of a step over, which lie whole and side by side from `rows` on.
static void take_rows(const box_walk *walk, const uint8_t *rows, uint32_t width, fm_take_fn take, void *user) {
    if (walk->whole_rows) {
        take(user, rows, walk->done, walk->count * walk->width);
        return;
    }
    for (uint64_t i = 0; i < walk->count; i++) {
        const uint64_t first = i * walk->shape.x + (uint64_t)walk->box.begin[0];
        take(user, rows + first * width, walk->done + i * walk->width, walk->width);
    }
}

fm_result fm_world_read_plane(fm_world *world, const fm_plane *plane, const fm_box *box, fm_take_fn take, void *user) {
    const uint64_t row_bytes = row_voxels(world) * plane->width;
    const uint8_t *there = plane->there;
    box_walk walk = walk_box(world, box, there ? UINT64_MAX : fm_world_piece_rows(world));
    void *piece = NULL;
    if (!there) {
        FM_TRY(fm_context_scratch(world->context, walk.most * row_bytes, &piece));
    }
    while (walk_next(&walk)) {
        if (!there) {
            FM_TRY(fm_buffer_download_at(plane->buffer, walk.first * plane->width, piece, walk.count * row_bytes));
        }
        take_rows(&walk, there ? there + walk.first * plane->width : piece, plane->width, take, user);
    }
    return FM_OK;
}

typedef struct copy_target {
    uint8_t *to;
    uint32_t width;
} copy_target;

static void copy_run(void *user, const void *entries, uint64_t first, uint64_t count) {
    const copy_target *target = user;
    memcpy(target->to + first * target->width, entries, count * target->width);
}

fm_result fm_world_copy_plane(fm_world *world, const fm_plane *plane, const fm_box *box, void *to) {
    const uint64_t row_bytes = row_voxels(world) * plane->width;
    box_walk walk = walk_box(world, box, UINT64_MAX);
    if (plane->there || !walk.whole_rows) {
        copy_target target = {to, plane->width};
        return fm_world_read_plane(world, plane, box, copy_run, &target);
    }
    while (walk_next(&walk)) {
        FM_TRY(fm_buffer_download_at(plane->buffer, walk.first * plane->width, (uint8_t *)to + walk.done * plane->width,
                                     walk.count * row_bytes));
    }
    return FM_OK;
}

fm_result fm_world_read(fm_world *world, const fm_box *box, uint32_t *voxels) {
    FM_TRY(check_voxels(world, box, voxels));
    FM_TRY(fm_wait(world->context, world->newest));
    const fm_plane plane = {.there = world->host ? world->host->voxels : NULL,
                            .buffer = world->gpu ? world->gpu->voxels : NULL,
                            .width = sizeof *voxels};
    return fm_world_copy_plane(world, &plane, box, voxels);
}
