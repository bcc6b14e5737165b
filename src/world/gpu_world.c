// SPDX-License-Identifier: MIT
// A world on Vulkan: its memory, the rows of an update, and the exact passes over the tiles that changed rows reach.

#include "world/gpu_world.h"

#include "transform/fit.h"
#include "world/refs.h"

#include <stdio.h>
#include <string.h>

enum {
    ENTRIES_AT = 64,         // bytes of the lists' headers
    UPLOAD_BYTES = 1 << 18,  // at least: a few hundred edits
};

_Static_assert(FM_GPU_PACKED == (int)FM_FIELD_PACKED && FM_GPU_SQUARED_U32 == (int)FM_FIELD_SQUARED_U32,
               "shared.h numbers the formats as fm_field_format does");

// Both axes are cut alike, by the longer one: they share the tiles' width.
static fm_result set_layout(const fm_world *world, fm_column_layout *layout) {
    const fm_device_info *device = &world->context->device;
    const fm_shape shape = world->desc.shape;
    const uint32_t longest = (uint32_t)fm_max_u64(shape.y, shape.z);
    const bool squared = world->desc.format == FM_FIELD_SQUARED_U32;
    const bool half = fm_world_cap(&world->desc) == UINT8_MAX && device->float16;
    // Registers are a GPU's; a software driver takes half a minute to compile what is unrolled that far.
    const uint32_t fewest = device->kind == FM_DEVICE_SOFTWARE ? 4 : half ? 32 : 16;
    fm_column_fit fit;
    // As the transform's kernels, and for a segment the changes of its rows.
    const bool fits = squared ? fm_fit_segments(device, longest, FM_SEGMENT_ROWS + 1 + 3, 2, &fit)
                              : fm_fit_scan(device, longest, shape.x, half, half ? 40 : 72, fewest, &fit);
    if (!fits) {
        return fm_fail(FM_ERROR_UNSUPPORTED, "shape is %u x %u x %u: columns of that length do not fit \"%s\"'s shared memory",
                       shape.x, shape.y, shape.z, device->name);
    }
    const uint32_t tile_width = squared ? fit.lanes : 4 * fit.lanes;
    *layout = (fm_column_layout){.kernel = squared ? FM_KERNEL_WORLD_ENVELOPE
                                           : half  ? FM_KERNEL_WORLD_SCAN_F16
                                                   : FM_KERNEL_WORLD_SCAN_U32,
                                 .lanes = fit.lanes,
                                 .rows = fit.rows,
                                 .tile_width = tile_width,
                                 .segments_y = (uint32_t)fm_div_up(shape.y, fit.rows),
                                 .segments_z = (uint32_t)fm_div_up(shape.z, fit.rows),
                                 .tiles = (uint32_t)fm_div_up(shape.x, tile_width)};
    return FM_OK;
}

// Places within the buffer of lists.
typedef struct list_places {
    uint64_t entries_y, entries_z, flags, changes, bytes;
} list_places;

static list_places lists_of(const fm_world *world) {
    uint64_t tiles = world->gpu->layout.tiles;
    uint64_t along_y = tiles * world->desc.shape.z;
    uint64_t along_z = tiles * world->desc.shape.y;
    list_places places = {.entries_y = ENTRIES_AT};
    places.entries_z = places.entries_y + 4 * along_y;
    places.flags = places.entries_z + 4 * along_z;
    places.changes = fm_round_up(places.flags + 4 * along_y, 16);
    places.bytes = places.changes + 16 * along_z;
    return places;
}

static fm_result create(fm_world *world, fm_purpose purpose, uint64_t bytes, bool exportable, fm_buffer **buffer) {
    return fm_buffer_create(world->gpu->gpu, purpose, bytes, exportable, buffer);
}

static uint64_t middle_bytes(const fm_world *world) {
    fm_shape shape = world->desc.shape;
    uint32_t width = fm_lane_width(world->desc.format);
    return (uint64_t)world->gpu->pitch * shape.y * shape.z * width;
}

void fm_gpu_world_empty_lists(uint32_t (*headers)[4], uint32_t count) {
    static const uint32_t empty[] = {FM_LIST_EMPTY};
    _Static_assert(sizeof empty == FM_LIST_HEADER_BYTES, "a count of entries and three of groups");
    for (uint32_t i = 0; i < count; i++) {
        memcpy(headers[i], empty, sizeof empty);
    }
}

// Nothing is flagged or changed (see world_grid.glsl), the lists are empty.
static fm_result clear_lists(fm_world *world) {
    fm_gpu_world *own = world->gpu;
    uint32_t headers[FM_LIST_HEADERS][4];
    fm_gpu_world_empty_lists(headers, FM_LIST_HEADERS);
    fm_slot *slot;
    FM_TRY(fm_commands_begin(own->gpu, &slot));
    fm_commands_fill(own->gpu, slot, own->lists, 0, lists_of(world).bytes, 0);
    FM_TRY(fm_commands_submit(own->gpu, slot, NULL));
    return fm_buffer_upload_at(own->lists, 0, headers, sizeof headers);
}

// What only FM_WORLD_EXACT needs.
fm_result fm_gpu_world_prepare(fm_world *world) {
    fm_gpu_world *own = world->gpu;
    if (world->desc.method.algorithm != FM_WORLD_EXACT) {
        FM_TRY(fm_gpu_wait(own->gpu, world->newest));
        fm_buffer_destroy(own->middle);
        fm_buffer_destroy(own->lists);
        own->middle = NULL;
        own->lists = NULL;
        return fm_gpu_chunks_prepare(world);
    }
    if (own->middle) {
        return FM_OK;
    }
    FM_TRY(set_layout(world, &own->layout));
    own->pitch = (uint32_t)fm_round_up(world->desc.shape.x, 16);
    FM_TRY(create(world, FM_PURPOSE_UPDATE, middle_bytes(world), false, &own->middle));
    fm_result status = create(world, FM_PURPOSE_UPDATE, lists_of(world).bytes, false, &own->lists);
    if (status == FM_OK) {
        status = clear_lists(world);
    }
    if (status != FM_OK) {
        fm_buffer_destroy(own->middle);
        fm_buffer_destroy(own->lists);
        own->middle = NULL;
        own->lists = NULL;
    }
    return status;
}

static fm_result create_planes(fm_world *world) {
    fm_gpu_world *own = world->gpu;
    fm_shape shape = world->desc.shape;
    uint64_t voxels = fm_voxels(shape);
    uint64_t words = (uint64_t)fm_bits_row_words(shape) * shape.y * shape.z;
    FM_TRY(create(world, FM_PURPOSE_VOXELS, 4 * voxels, false, &own->voxels));
    FM_TRY(create(world, FM_PURPOSE_FIELD, fm_field_width(world->desc.format) * voxels, world->desc.exportable, &own->field));
    if (world->desc.format != FM_FIELD_PACKED) {
        FM_TRY(create(world, FM_PURPOSE_FIELD, voxels, false, &own->colors));
    }
    FM_TRY(create(world, FM_PURPOSE_UPDATE, 4 * words, false, &own->bits));
    FM_TRY(create(world, FM_PURPOSE_UPDATE, 4 * words, false, &own->carries));
    for (uint32_t i = 0; i < FM_WORLD_IN_FLIGHT; i++) {
        FM_TRY(create(world, FM_PURPOSE_READBACK, 4 * FM_READBACK_WORDS, false, &own->flights[i].readback));
    }
    FM_TRY(fm_gpu_world_prepare(world));
    fm_slot *slot;
    FM_TRY(fm_commands_begin(own->gpu, &slot));
    fm_commands_fill(own->gpu, slot, own->voxels, 0, 4 * voxels, 0);
    // All is air, at the largest distance; no row has a site.
    fm_commands_fill(own->gpu, slot, own->bits, 0, 4 * words, 0);
    fm_commands_fill(own->gpu, slot, own->carries, 0, 4 * words, UINT32_MAX);
    uint32_t entry = world->desc.format == FM_FIELD_SQUARED_U32 ? fm_world_cap(&world->desc) : UINT32_MAX;
    entry = world->desc.format == FM_FIELD_PACKED ? 0xff000000u : entry;
    fm_commands_fill(own->gpu, slot, own->field, 0, fm_round_up(fm_field_width(world->desc.format) * voxels, 4), entry);
    if (own->colors) {
        fm_commands_fill(own->gpu, slot, own->colors, 0, fm_round_up(voxels, 4), 0);
    }
    return fm_commands_submit(own->gpu, slot, &world->newest);
}

fm_result fm_gpu_world_create(fm_world *world) {
    world->gpu = fm_alloc_zero(&world->context->allocator, sizeof *world->gpu, "a world");
    if (!world->gpu) {
        return FM_ERROR_OUT_OF_HOST_MEMORY;
    }
    world->gpu->gpu = world->context->gpu;
    fm_result status = create_planes(world);
    if (status == FM_ERROR_OUT_OF_DEVICE_MEMORY) {
        fm_shape shape = world->desc.shape;
        char need[160];
        uint64_t voxels = fm_voxels(shape);
        uint64_t bytes = voxels * (4 + fm_field_width(world->desc.format) + (world->desc.format == FM_FIELD_PACKED ? 0 : 1)) +
                         (world->desc.method.algorithm == FM_WORLD_EXACT ? middle_bytes(world) : 0) + voxels / 4;
        snprintf(need, sizeof need, "a world of %u x %u x %u voxels needs about %.1f MiB", shape.x, shape.y, shape.z,
                 (double)bytes / 1048576.0);
        return fm_fail_prefix(status, need);
    }
    return status;
}

void fm_gpu_world_destroy(fm_world *world) {
    fm_gpu_world *own = world->gpu;
    if (!own) {
        return;
    }
    // A lost device has nothing in flight.
    (void)fm_gpu_wait(own->gpu, fm_gpu_newest(own->gpu));
    fm_gpu_chunks_destroy(world);
    fm_gpu_samples_destroy(own->samples);
    fm_buffer *const buffers[] = {own->voxels, own->bits, own->carries, own->field, own->colors, own->middle, own->lists};
    for (size_t i = 0; i < sizeof buffers / sizeof buffers[0]; i++) {
        fm_buffer_destroy(buffers[i]);
    }
    for (uint32_t i = 0; i < FM_WORLD_IN_FLIGHT; i++) {
        fm_buffer_destroy(own->flights[i].upload);
        fm_buffer_destroy(own->flights[i].readback);
    }
    fm_free(&world->context->allocator, own, sizeof *own);
    world->gpu = NULL;
}

fm_world_refs fm_gpu_world_refs(const fm_world *world) {
    const fm_gpu_world *own = world->gpu;
    return (fm_world_refs){.voxels = fm_buffer_address(own->voxels),
                           .bits = fm_buffer_address(own->bits),
                           .field = fm_buffer_address(own->field),
                           .colors = own->colors ? fm_buffer_address(own->colors) : 0};
}

static fm_result grow_upload(fm_gpu_world *own, fm_world_flight *flight, uint64_t bytes) {
    uint64_t size = fm_max_u64(fm_round_up(2 * bytes, 4096), UPLOAD_BYTES);
    fm_buffer *upload;
    FM_TRY(fm_buffer_create(own->gpu, FM_PURPOSE_UPLOAD, size, false, &upload));
    fm_buffer_destroy(flight->upload);
    flight->upload = upload;
    flight->upload_bytes = size;
    return FM_OK;
}

fm_result fm_gpu_world_upload(fm_world *world, fm_slot **slot, uint64_t bytes, void **memory, uint64_t *address) {
    fm_gpu_world *own = world->gpu;
    fm_world_flight *flight = &own->flights[own->next];
    bytes = fm_round_up(bytes, 16);
    if (flight->used + bytes > flight->upload_bytes) {
        if (flight->used > 0) {
            FM_TRY(fm_commands_flush(own->gpu, slot));
            flight->used = 0;
        }
        if (bytes > flight->upload_bytes) {
            FM_TRY(grow_upload(own, flight, bytes));
        }
    }
    *memory = (uint8_t *)fm_buffer_mapped(flight->upload) + flight->used;
    *address = fm_buffer_address(flight->upload) + flight->used;
    flight->used += bytes;
    return FM_OK;
}

// The next flight, when the update that used it last is complete.
static fm_result begin_flight(fm_gpu_world *own) {
    own->next = (own->flight + 1) % FM_WORLD_IN_FLIGHT;
    fm_world_flight *flight = &own->flights[own->next];
    FM_TRY(fm_gpu_wait(own->gpu, flight->ticket));
    flight->used = 0;
    memset(fm_buffer_mapped(flight->readback), 0, 4 * FM_READBACK_WORDS);
    return FM_OK;
}

static fm_result dispatch_rows(fm_world *world, fm_slot *slot, fm_rows_push *push, bool listed, bool tracked, uint64_t groups) {
    const uint32_t constants[] = {world->desc.format, listed, push->row_words, tracked};
    fm_dispatch dispatch = {.kernel = FM_KERNEL_WORLD_ROWS,
                            .constants = constants,
                            .constant_count = sizeof constants / sizeof constants[0],
                            .push = push,
                            .push_bytes = sizeof *push,
                            .groups = groups};
    push->groups = (uint32_t)groups;
    return fm_commands_dispatch(world->gpu->gpu, slot, &dispatch);
}

static fm_result upload_batch(fm_world *world, fm_slot **slot, const fm_world_batch *batch, fm_rows_push *push) {
    uint64_t brush_bytes = (uint64_t)batch->brush_count * sizeof *batch->brushes;
    uint64_t bundle_bytes = fm_round_up((uint64_t)batch->bundle_count * sizeof *batch->bundles, 16);
    uint64_t order_bytes = (uint64_t)batch->order_count * sizeof *batch->order;
    void *memory;
    uint64_t address;
    FM_TRY(fm_gpu_world_upload(world, slot, brush_bytes + bundle_bytes + order_bytes, &memory, &address));
    uint8_t *to = memory;
    if (brush_bytes) {
        memcpy(to, batch->brushes, brush_bytes);
    }
    memcpy(to + brush_bytes, batch->bundles, (uint64_t)batch->bundle_count * sizeof *batch->bundles);
    if (order_bytes) {
        memcpy(to + brush_bytes + bundle_bytes, batch->order, order_bytes);
    }
    push->brushes = address;
    push->bundles = address + brush_bytes;
    push->order = address + brush_bytes + bundle_bytes;
    return FM_OK;
}

static fm_result do_rows(fm_world *world, const fm_world_job *job, fm_slot **slot) {
    fm_gpu_world *own = world->gpu;
    fm_shape shape = world->desc.shape;
    bool exact = world->desc.method.algorithm == FM_WORLD_EXACT;
    list_places places = exact ? lists_of(world) : (list_places){0};
    uint64_t lists = exact ? fm_buffer_address(own->lists) : 0;
    uint32_t cap = fm_world_cap(&world->desc);
    bool squared = world->desc.format == FM_FIELD_SQUARED_U32;
    fm_rows_push push = {.voxels = fm_buffer_address(own->voxels),
                         .bits = fm_buffer_address(own->bits),
                         .carries = fm_buffer_address(own->carries),
                         .field = fm_buffer_address(own->field),
                         .colors = own->colors ? fm_buffer_address(own->colors) : 0,
                         .lists = lists,
                         .entries = lists + places.entries_y,
                         .flags = lists + places.flags,
                         .x = shape.x,
                         .y = shape.y,
                         .z = shape.z,
                         .row_words = fm_bits_row_words(shape),
                         .tile_width = own->layout.tile_width,
                         .reach = squared && world->desc.max_distance ? world->desc.max_distance
                                  : squared                           ? UINT32_MAX
                                                                      : cap,
                         .parity = own->parity};
    uint64_t bytes = 0;
    own->rows = 0;
    for (uint32_t i = 0; i < job->batch_count; i++) {
        const fm_world_batch *batch = &job->batches[i];
        if (i > 0) {
            fm_commands_barrier(own->gpu, *slot);
        }
        FM_TRY(upload_batch(world, slot, batch, &push));
        FM_TRY(dispatch_rows(world, *slot, &push, true, exact && !job->full, batch->bundle_count));
        for (uint32_t k = 0; k < batch->bundle_count; k++) {
            const fm_gpu_bundle *bundle = &batch->bundles[k];
            uint64_t rows = fm_min_u64(FM_BUNDLE_ROWS, shape.y - bundle->y);
            own->rows += rows;
            bytes += 4 * rows * (bundle->x_end - bundle->x_begin);
        }
    }
    if (job->full) {
        if (job->batch_count > 0) {
            fm_commands_barrier(own->gpu, *slot);
        }
        FM_TRY(dispatch_rows(world, *slot, &push, false, false, fm_div_up(shape.y, FM_BUNDLE_ROWS) * shape.z));
        own->rows = (uint64_t)shape.y * shape.z;
        bytes = 4 * fm_voxels(shape);
    }
    // Bits and carries of each row are read whole or written.
    fm_commands_pass(own->gpu, *slot, "rows", bytes + own->rows * push.row_words * 8);
    return FM_OK;
}

static fm_result do_columns(fm_world *world, fm_slot *slot, bool along_z, bool listed) {
    fm_gpu_world *own = world->gpu;
    fm_shape shape = world->desc.shape;
    const fm_column_layout *layout = &own->layout;
    list_places places = lists_of(world);
    uint64_t lists = fm_buffer_address(own->lists);
    uint64_t header = (along_z ? FM_LIST_Z : own->parity) * FM_LIST_HEADER_BYTES;
    uint64_t counted = 4 * (along_z ? FM_COUNTED_Z : FM_COUNTED_Y);
    fm_world_push push = {.bits = fm_buffer_address(own->bits),
                          .carries = fm_buffer_address(own->carries),
                          .raw = fm_buffer_address(own->middle),
                          .distance = fm_buffer_address(own->field),
                          .list = lists + header,
                          .entries = lists + (along_z ? places.entries_z : places.entries_y),
                          .marks = lists + (along_z ? places.changes : places.flags),
                          .next_list = lists + FM_LIST_Z * FM_LIST_HEADER_BYTES,
                          .next_entries = lists + places.entries_z,
                          .next_marks = lists + places.changes,
                          .counted = fm_buffer_address(own->flights[own->next].readback) + counted,
                          .x = shape.x,
                          .y = shape.y,
                          .z = shape.z,
                          .row_words = fm_bits_row_words(shape),
                          .pitch = own->pitch,
                          .tiles = layout->tiles,
                          .cap = fm_world_cap(&world->desc)};
    uint32_t width = fm_lane_width(world->desc.format);
    const uint32_t constants[] = {layout->lanes,
                                  along_z ? layout->segments_z : layout->segments_y,
                                  layout->rows,
                                  world->desc.format,
                                  width,
                                  along_z ? FM_SOURCE_RAW : FM_SOURCE_BITS,
                                  along_z ? FM_TARGET_FINISH : FM_TARGET_RAW,
                                  layout->tile_width,
                                  listed,
                                  along_z,
                                  shape.x % 4 == 0};
    fm_dispatch dispatch = {.kernel = layout->kernel,
                            .constants = constants,
                            .constant_count = sizeof constants / sizeof constants[0],
                            .push = &push,
                            .push_bytes = sizeof push,
                            .groups = (uint64_t)layout->tiles * (along_z ? shape.y : shape.z),
                            .indirect = listed ? own->lists : NULL,
                            .indirect_offset = header + 4};
    FM_TRY(fm_commands_dispatch(own->gpu, slot, &dispatch));
    // What a listed pass moves is known only to the device.
    uint64_t voxels = listed ? 0 : fm_voxels(shape);
    uint64_t bits = listed ? 0 : (uint64_t)push.row_words * shape.y * shape.z * 8;
    uint64_t bytes = along_z ? voxels * (width + fm_field_width(world->desc.format)) : bits + voxels * width;
    fm_commands_pass(own->gpu, slot, along_z ? "z" : "y", bytes);
    return FM_OK;
}

static fm_result record(fm_world *world, const fm_world_job *job, fm_slot **slot) {
    FM_TRY(do_rows(world, job, slot));
    if (world->desc.method.algorithm != FM_WORLD_EXACT) {
        return fm_gpu_chunks_update(world, job, slot);
    }
    FM_TRY(do_columns(world, *slot, false, !job->full));
    return do_columns(world, *slot, true, !job->full);
}

fm_result fm_gpu_world_update(fm_world *world, const fm_world_job *job) {
    fm_gpu_world *own = world->gpu;
    fm_world_job whole = *job;
    if (job->batch_count > 1 && world->desc.method.algorithm == FM_WORLD_EXACT) {
        // A voxel that one batch makes solid and a later one air again has lost its distance, though nothing changed. So many edits
        // are worth a new field.
        whole.full = true;
        job = &whole;
    }
    FM_TRY(begin_flight(own));
    fm_slot *slot;
    FM_TRY(fm_commands_begin(own->gpu, &slot));
    FM_TRY(record(world, job, &slot));
    fm_ticket ticket;
    FM_TRY(fm_commands_submit(own->gpu, slot, &ticket));
    own->flight = own->next;
    own->flights[own->flight].ticket = ticket;
    // A full update has no list and clears none: the header in use stays clear.
    own->parity ^= job->full ? 0 : 1;
    world->newest = ticket;
    world->stats = (fm_world_stats){.rows = own->rows, .full = job->full, .tile_width = own->layout.tile_width};
    return FM_OK;
}

fm_result fm_gpu_world_stats(fm_world *world) {
    fm_gpu_world *own = world->gpu;
    FM_TRY(fm_gpu_wait(own->gpu, world->newest));
    const fm_column_layout *layout = &own->layout;
    if (world->desc.method.algorithm != FM_WORLD_EXACT) {
        fm_gpu_chunks_stats(world, &world->stats);
    } else if (world->stats.full) {
        world->stats.tiles_y = (uint64_t)layout->tiles * world->desc.shape.z;
        world->stats.tiles_z = (uint64_t)layout->tiles * world->desc.shape.y;
    } else {
        const uint32_t *counted = fm_buffer_mapped(own->flights[own->flight].readback);
        world->stats.tiles_y = counted[FM_COUNTED_Y];
        world->stats.tiles_z = counted[FM_COUNTED_Z];
    }
    return FM_OK;
}
