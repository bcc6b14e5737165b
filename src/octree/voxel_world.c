// SPDX-License-Identifier: MIT
// Octrees from worlds. On the CPU backend voxels are read where they lie. On Vulkan they come in slabs of whole rows, which is how
// the world hands them out, or for updates in the box that has changed.

#include "octree/voxels.h"
#include "world/refs.h"

#include <string.h>

enum { SLAB = 64, PATCH = 16, MOST_PATCH_VOXELS = 1 << 22 };

typedef struct slabs {
    fm_world *world;
    fm_context *context;
    fm_shape shape;
    fm_octree *octree;      // that is updated
    const fm_box *patches;  // what is wanted, at once where it is not too much
    uint32_t patch_count;
    fm_box box;  // of what is in memory
    uint32_t *voxels;
    uint64_t room;  // bytes
} slabs;

static uint64_t voxels_in(const fm_box *box) {
    uint64_t count = 1;
    for (int axis = 0; axis < 3; axis++) {
        count *= (uint64_t)(box->end[axis] - box->begin[axis]);
    }
    return count;
}

static bool holds(const fm_box *outer, const fm_box *inner) {
    for (int axis = 0; axis < 3; axis++) {
        if (inner->begin[axis] < outer->begin[axis] || inner->end[axis] > outer->end[axis]) {
            return false;
        }
    }
    return true;
}

static fm_box widened(const slabs *own, const fm_box *box, int64_t step, bool rows) {
    const int64_t size[3] = {own->shape.x, own->shape.y, own->shape.z};
    fm_box wide;
    for (int axis = 0; axis < 3; axis++) {
        const bool whole = rows && axis == 0;
        const int64_t begin = whole ? 0 : box->begin[axis] / step * step;
        const int64_t end = whole ? size[0] : (box->end[axis] + step - 1) / step * step;
        wide.begin[axis] = begin > 0 ? begin : 0;
        wide.end[axis] = end < size[axis] ? end : size[axis];
    }
    return wide;
}

// `patch`: one that the device gathers.
static fm_box choose(const slabs *own, const fm_box *box, bool *patch) {
    for (uint32_t i = 0; i < own->patch_count; i++) {
        const fm_box wide = widened(own, &own->patches[i], PATCH, false);
        if (voxels_in(&wide) <= MOST_PATCH_VOXELS && holds(&wide, box)) {
            *patch = true;
            return wide;
        }
    }
    *patch = false;
    return widened(own, box, SLAB, true);
}

static fm_result load(slabs *own, const fm_box *box) {
    bool patch;
    const fm_box wanted = choose(own, box, &patch);
    fm_context *context = own->context;
    const uint64_t bytes = voxels_in(&wanted) * sizeof *own->voxels;
    own->box = (fm_box){{0}, {0}};
    if (bytes > own->room) {
        fm_octree_free(context, own->voxels, own->room);
        own->voxels = fm_octree_alloc(context, bytes, "voxels of a world");
        own->room = own->voxels ? bytes : 0;
    }
    if (!own->voxels) {
        return FM_ERROR_OUT_OF_HOST_MEMORY;
    }
    FM_TRY(patch ? fm_gpu_octree_gather(own->octree, own->world, &wanted, own->voxels)
                 : fm_world_read(own->world, &wanted, own->voxels));
    own->box = wanted;
    return FM_OK;
}

static fm_result read_slab(void *user, const fm_box *box, uint32_t *voxels) {
    slabs *own = user;
    if (!holds(&own->box, box)) {
        FM_TRY(load(own, box));
    }
    const uint64_t row = (uint64_t)(own->box.end[0] - own->box.begin[0]);
    const uint64_t slice = row * (uint64_t)(own->box.end[1] - own->box.begin[1]);
    const uint64_t width = (uint64_t)(box->end[0] - box->begin[0]);
    const uint32_t *from = own->voxels + (box->begin[0] - own->box.begin[0]);
    for (int64_t z = box->begin[2]; z < box->end[2]; z++) {
        for (int64_t y = box->begin[1]; y < box->end[1]; y++, voxels += width) {
            const uint64_t at = (uint64_t)(z - own->box.begin[2]) * slice + (uint64_t)(y - own->box.begin[1]) * row;
            memcpy(voxels, from + at, width * sizeof *voxels);
        }
    }
    return FM_OK;
}

// The world as a source; what `feed` points to must stay while it is used.
static void open_feed(fm_world *world, slabs *own, fm_voxel_source *source, fm_voxel_feed *feed) {
    fm_world_desc about;
    fm_world_info(world, &about);
    const fm_shape shape = own->shape = about.shape;
    own->context = fm_world_context(world);
    const bool here = own->context->backend == FM_BACKEND_CPU;
    *source = (fm_voxel_source){.user = own, .shape = {shape.x, shape.y, shape.z}, .read = read_slab};
    own->world = world;
    *feed = (fm_voxel_feed){.source = source, .user = own, .dense = here ? fm_world_map(world) : NULL};
}

static void close_feed(slabs *own) {
    fm_octree_free(own->context, own->voxels, own->room);
}

fm_result fm_octree_build_world(fm_world *world, const fm_octree_desc *desc, fm_octree **octree) {
    if (!world || !octree) {
        return fm_fail(FM_ERROR_INVALID_ARGUMENT, "%s is NULL", world ? "octree" : "world");
    }
    slabs own = {0};
    fm_voxel_source source;
    fm_voxel_feed feed;
    open_feed(world, &own, &source, &feed);
    const fm_result result = fm_voxel_build_fed(own.context, &feed, desc, octree);
    close_feed(&own);
    return result;
}

fm_result fm_octree_update_world(fm_octree *octree, fm_world *world, const fm_box *boxes, uint32_t count) {
    if (!octree || !world) {
        return fm_fail(FM_ERROR_INVALID_ARGUMENT, "%s is NULL", world ? "octree" : "world");
    }
    if (octree->context != fm_world_context(world)) {
        return fm_fail(FM_ERROR_INVALID_ARGUMENT, "the world is of another context than the octree");
    }
    slabs own = {.octree = octree, .patches = boxes, .patch_count = boxes ? count : 0};
    fm_voxel_source source;
    fm_voxel_feed feed;
    open_feed(world, &own, &source, &feed);
    const fm_result result = fm_voxel_update_fed(octree, &feed, boxes, count);
    close_feed(&own);
    return result;
}
