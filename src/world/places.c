// SPDX-License-Identifier: MIT
// Where a world lies, for programs that read or write it there.

#include "world/gpu_world.h"
#include "world/host_world.h"
#include "world/transfer.h"

uint32_t *fm_world_map(fm_world *world) {
    return world ? fm_world_reached_voxels(world) : NULL;
}

const void *fm_world_field_data(const fm_world *world) {
    return world && world->host ? world->host->field : NULL;
}

static fm_result check_on_device(const fm_world *world) {
    if (!world) {
        return fm_fail(FM_ERROR_INVALID_ARGUMENT, "world is NULL");
    }
    if (!world->gpu) {
        return fm_fail(FM_ERROR_UNSUPPORTED, "the world lies in host memory: it has no Vulkan buffers");
    }
    return FM_OK;
}

static void describe(const fm_buffer *buffer, uint64_t bytes, fm_volume_buffer *description) {
    if (!description) {
        return;
    }
    *description = (fm_volume_buffer){0};
    if (buffer) {
        fm_buffer_describe(buffer, description);
        description->size = bytes;
    }
}

fm_result fm_world_vulkan(const fm_world *world, fm_volume_buffer *voxels, fm_volume_buffer *field, fm_volume_buffer *colors) {
    FM_TRY(check_on_device(world));
    const uint64_t count = fm_voxels(world->desc.shape);
    describe(world->gpu->voxels, count * sizeof(uint32_t), voxels);
    describe(world->gpu->field, count * fm_field_width(world->desc.format), field);
    describe(world->gpu->colors, count, colors);
    return FM_OK;
}

fm_result fm_world_export_fd(const fm_world *world, int *fd) {
    if (!fd) {
        return fm_fail(FM_ERROR_INVALID_ARGUMENT, "fd is NULL");
    }
    FM_TRY(check_on_device(world));
    if (!world->desc.exportable) {
        return fm_fail(FM_ERROR_UNSUPPORTED, "the world was not made exportable: set exportable in its descriptor");
    }
    return fm_buffer_export_fd(world->gpu->field, fd);
}
