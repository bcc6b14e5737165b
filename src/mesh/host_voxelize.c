// SPDX-License-Identifier: MIT
// Voxels of a mesh on the processor. A worker owns a slab of slices. A voxel's middle lines are boxes without thickness.

#include "mesh/touch.h"
#include "mesh/voxelize.h"

#include <string.h>

typedef struct job {
    const fm_mesh *mesh;
    const fm_voxelize_desc *desc;
    fm_volume *voxels;
    fm_grid grid;
    fm_slabs slabs;
    int32_t *changes;  // a slice for each worker
    double half[3][3];
    int boxes;
} job;

static void set(void *user, uint32_t x, uint32_t y, uint32_t z) {
    const fm_volume *voxels = user;
    const uint64_t row = y + (uint64_t)voxels->desc.shape.y * z;
    if (voxels->desc.type == FM_TYPE_U8) {
        ((uint8_t *)voxels->data)[x + row * voxels->desc.shape.x] = 1;
    } else {
        ((uint32_t *)voxels->data)[x / 32 + row * fm_bits_row_words(voxels->desc.shape)] |= UINT32_C(1) << x % 32;
    }
}

static void fill(const job *work, uint32_t slab, uint32_t z, int32_t *changes) {
    const fm_shape shape = work->grid.shape;
    const uint64_t first = work->slabs.first[slab];
    memset(changes, 0, (uint64_t)shape.x * shape.y * sizeof *changes);
    fm_crossings_add(work->mesh, &work->grid, work->slabs.triangles + first, work->slabs.first[slab + 1] - first, z, changes);
    for (uint32_t y = 0; y < shape.y; y++) {
        int32_t left = 0;
        for (uint32_t x = shape.x; x-- > 0;) {
            left += changes[x + (uint64_t)shape.x * y];
            if (left > 0) {
                set(work->voxels, x, y, z);
            }
        }
    }
}

static void work_slabs(void *user, uint64_t begin, uint64_t end, uint32_t worker) {
    const job *work = user;
    const fm_shape shape = work->grid.shape;
    const uint64_t slice = work->voxels->bytes / shape.z;
    for (uint64_t slab = begin; slab < end; slab++) {
        const uint32_t z_from = (uint32_t)slab * work->slabs.depth;
        const uint32_t z_to = (uint32_t)fm_min_u64(z_from + (uint64_t)work->slabs.depth, shape.z) - 1;
        memset((uint8_t *)work->voxels->data + z_from * slice, 0, (z_to - z_from + 1) * slice);
        for (uint64_t i = work->slabs.first[slab]; i < work->slabs.first[slab + 1]; i++) {
            for (int box = 0; box < work->boxes; box++) {
                const fm_touch_range range = {{0, 0, z_from}, {shape.x - 1, shape.y - 1, z_to}};
                fm_touch(work->mesh, &work->grid, work->slabs.triangles[i], work->half[box], &range, set, work->voxels);
            }
        }
        for (uint32_t z = z_from; work->changes && z <= z_to; z++) {
            fill(work, (uint32_t)slab, z, work->changes + (uint64_t)shape.x * shape.y * worker);
        }
    }
}

fm_result fm_host_voxelize(fm_mesh *mesh, const fm_voxelize_desc *desc, fm_volume *voxels) {
    fm_context *context = mesh->context;
    job work = {.mesh = mesh, .desc = desc, .voxels = voxels, .grid = {.shape = voxels->desc.shape}};
    memcpy(work.grid.spacing, voxels->desc.spacing, sizeof work.grid.spacing);
    memcpy(work.grid.origin, voxels->desc.origin, sizeof work.grid.origin);
    work.boxes = desc->separation == FM_SEPARATION_26 ? 1 : 3;
    for (int box = 0; box < work.boxes; box++) {
        for (int axis = 0; axis < 3; axis++) {
            work.half[box][axis] = work.boxes == 1 || box == axis ? 0.5 : 0;
        }
    }
    fm_passes_begin(context);
    if (desc->solid) {
        const uint64_t texels = (uint64_t)work.grid.shape.x * work.grid.shape.y * fm_pool_threads(context->pool);
        void *memory;
        FM_TRY(fm_context_scratch(context, texels * sizeof *work.changes, &memory));
        work.changes = memory;
    }
    FM_TRY(fm_slabs_make(mesh, &work.grid, &work.slabs));
    fm_pool_run(context->pool, work.slabs.count, 1, work_slabs, &work);
    fm_slabs_destroy(&context->allocator, &work.slabs);
    fm_passes_end(context, "voxelize", voxels->bytes + mesh->triangle_count * 12);
    return FM_OK;
}
