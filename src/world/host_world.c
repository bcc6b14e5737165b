// SPDX-License-Identifier: MIT
// Worlds on the CPU: their memory, and the rows of an update. Rows are shared out to the thread pool bundle by bundle; no two
// bundles of a batch have a row in common.

#include "world/host_world.h"

#include "world/brush.h"

#include <string.h>

enum { MAX_ROW_WORDS = FM_WORLD_MAX_AXIS / 32 };

static uint64_t row_words(const fm_world *world) {
    return fm_bits_row_words(world->desc.shape);
}

static void *take(fm_world *world, fm_purpose purpose, uint64_t bytes, bool zero, const char *what) {
    fm_context *context = world->context;
    void *memory = zero ? fm_alloc_zero(&context->allocator, bytes, what) : fm_alloc(&context->allocator, bytes, what);
    if (memory) {
        fm_meter_add(&context->host[purpose], bytes);
    }
    return memory;
}

static void give(fm_world *world, fm_purpose purpose, void *memory, uint64_t bytes) {
    if (memory) {
        fm_free(&world->context->allocator, memory, bytes);
        fm_meter_remove(&world->context->host[purpose], bytes);
    }
}

static void destroy(fm_world *world, fm_host_world *host) {
    fm_host_exact_destroy(world, host->exact);
    give(world, FM_PURPOSE_VOXELS, host->voxels, host->voxel_bytes);
    give(world, FM_PURPOSE_UPDATE, host->bits, host->bits_bytes);
    give(world, FM_PURPOSE_FIELD, host->field, host->field_bytes);
    fm_free(&world->context->allocator, host, sizeof *host);
}

// All is air, at the largest distance.
static void fill_rows(void *user, uint64_t begin, uint64_t end, uint32_t worker) {
    (void)worker;
    fm_world *world = user;
    const uint32_t cap = fm_world_cap(&world->desc);
    for (uint64_t i = begin * world->desc.shape.x; i < end * world->desc.shape.x; i++) {
        fm_host_set_distance(world, i, cap);
    }
}

// Systems promise more memory than they have: what is there is asked for first.
static fm_result check_memory(const fm_world *world, const fm_host_world *host) {
    uint64_t needed = host->voxel_bytes + host->bits_bytes + host->field_bytes;
    needed += world->desc.method.algorithm == FM_WORLD_EXACT ? fm_host_exact_bytes(world) : 0;
    const uint64_t there = world->context->device.memory;
    if (there != 0 && needed > there) {
        const fm_shape shape = world->desc.shape;
        return fm_fail(FM_ERROR_OUT_OF_HOST_MEMORY, "a world of %u x %u x %u needs %llu bytes: the machine has %llu", shape.x,
                       shape.y, shape.z, (unsigned long long)needed, (unsigned long long)there);
    }
    return FM_OK;
}

fm_result fm_host_world_create(fm_world *world, fm_host_world **result) {
    const fm_shape shape = world->desc.shape;
    const uint64_t voxels = fm_voxels(shape);
    const fm_field_format format = world->desc.format;
    fm_host_world *host = fm_alloc_zero(&world->context->allocator, sizeof *host, "a world");
    if (!host) {
        return FM_ERROR_OUT_OF_HOST_MEMORY;
    }
    host->voxel_bytes = voxels * sizeof(uint32_t);
    host->bits_bytes = row_words(world) * sizeof(uint32_t) * shape.y * shape.z;
    const uint64_t plane = voxels * fm_field_width(format);
    host->field_bytes = plane + (format == FM_FIELD_PACKED ? 0 : voxels);
    fm_result status = check_memory(world, host);
    if (status == FM_OK) {
        host->voxels = take(world, FM_PURPOSE_VOXELS, host->voxel_bytes, true, "a world's voxels");
        host->bits = take(world, FM_PURPOSE_UPDATE, host->bits_bytes, true, "a world's sites");
        host->field = take(world, FM_PURPOSE_FIELD, host->field_bytes, true, "a world's field");
        status = host->voxels && host->bits && host->field ? FM_OK : FM_ERROR_OUT_OF_HOST_MEMORY;
    }
    if (status == FM_OK && world->desc.method.algorithm == FM_WORLD_EXACT) {
        status = fm_host_exact_create(world, host);
    }
    if (status != FM_OK) {
        destroy(world, host);
        return status;
    }
    host->colors = format == FM_FIELD_PACKED ? NULL : (uint8_t *)host->field + plane;
    *result = host;
    fm_pool_run(world->context->pool, (uint64_t)shape.y * shape.z, 16, fill_rows, world);
    return FM_OK;
}

void fm_host_world_destroy(fm_world *world) {
    if (world->host) {
        destroy(world, world->host);
        world->host = NULL;
    }
}

fm_result fm_host_world_prepare(fm_world *world) {
    fm_host_world *host = world->host;
    const bool exact = world->desc.method.algorithm == FM_WORLD_EXACT;
    if (exact && !host->exact) {
        FM_TRY(check_memory(world, host));
        return fm_host_exact_create(world, host);
    }
    if (!exact) {
        fm_host_exact_destroy(world, host->exact);
        host->exact = NULL;
    }
    return FM_OK;
}

uint32_t fm_host_distance(const fm_world *world, uint64_t element) {
    return fm_field_distance(world->desc.format, world->host->field, element);
}

void fm_host_set_distance(fm_world *world, uint64_t element, uint32_t distance) {
    void *field = world->host->field;
    switch (world->desc.format) {
    case FM_FIELD_PACKED:
        ((uint32_t *)field)[element] = (((uint32_t *)field)[element] & 0xffffffu) | distance << 24;
        break;
    case FM_FIELD_SPLIT_U8:
        ((uint8_t *)field)[element] = (uint8_t)distance;
        break;
    case FM_FIELD_SPLIT_U16:
        ((uint16_t *)field)[element] = (uint16_t)distance;
        break;
    default:
        ((uint32_t *)field)[element] = distance;
        break;
    }
}

// What a row's voxels say about the field, for x of begin ... end - 1. `zero`: solid voxels get distance 0 too. The exact passes
// find out by themselves which distances have changed, and an edit that is taken back within an update changes none.
static void write_entries(fm_world *world, uint64_t row, uint32_t begin, uint32_t end, bool zero) {
    const uint64_t first = row * world->desc.shape.x + begin;
    const uint32_t count = end - begin;
    const uint32_t *voxels = world->host->voxels + first;
    if (world->desc.format == FM_FIELD_PACKED) {
        uint32_t *entries = (uint32_t *)world->host->field + first;
        const uint32_t solid_keeps = zero ? 0 : 0xff000000u;
        for (uint32_t i = 0; i < count; i++) {
            entries[i] = (entries[i] & (voxels[i] ? solid_keeps : 0xff000000u)) | (voxels[i] & 0xff);
        }
        return;
    }
    uint8_t *colors = world->host->colors + first;
    for (uint32_t i = 0; i < count; i++) {
        colors[i] = (uint8_t)voxels[i];
    }
    for (uint32_t i = 0; zero && i < count; i++) {
        if (voxels[i] != 0) {
            fm_host_set_distance(world, first + i, 0);
        }
    }
}

// Sites of words begin ... end - 1 of a row.
static void encode_words(fm_world *world, uint64_t row, uint32_t begin, uint32_t end) {
    const uint32_t x = world->desc.shape.x;
    const uint32_t *voxels = world->host->voxels + row * x;
    uint32_t *bits = world->host->bits + row * row_words(world);
    const uint32_t whole = end * 32 <= x ? end : end - 1;
    fm_host_encode(voxels + begin * 32, whole - begin, bits + begin);
    if (whole < end) {
        bits[whole] = 0;
        for (uint32_t i = whole * 32; i < x; i++) {
            bits[whole] |= (uint32_t)(voxels[i] != 0) << i % 32;
        }
    }
}

typedef struct rows_job {
    fm_world *world;
    const fm_world_batch *batch;
    bool full;
} rows_job;

// A brush covers a run of a row: all shapes are convex.
static void apply_brush(fm_world *world, const fm_gpu_brush *brush, uint32_t y, uint32_t z) {
    int32_t begin, end;
    if (!fm_brush_rows(brush, (int32_t)y, (int32_t)y + 1, (int32_t)z, &begin, &end)) {
        return;
    }
    while (begin < end && !fm_brush_covers(brush, begin, (int32_t)y, (int32_t)z)) {
        begin++;
    }
    while (begin < end && !fm_brush_covers(brush, end - 1, (int32_t)y, (int32_t)z)) {
        end--;
    }
    const fm_shape shape = world->desc.shape;
    uint32_t *voxels = world->host->voxels + ((uint64_t)z * shape.y + y) * shape.x;
    for (int32_t x = begin; x < end; x++) {
        voxels[x] = brush->voxel;
    }
}

static void update_row(const rows_job *job, const fm_gpu_bundle *bundle, uint32_t y) {
    fm_world *world = job->world;
    const fm_world_batch *batch = job->batch;
    for (uint32_t i = 0; i < bundle->brush_count; i++) {
        apply_brush(world, &batch->brushes[batch->order[bundle->first_brush + i]], y, bundle->z);
    }
    if (job->full) {
        return;
    }
    const uint64_t row = (uint64_t)bundle->z * world->desc.shape.y + y;
    uint32_t before[MAX_ROW_WORDS];
    uint32_t *bits = world->host->bits + row * row_words(world);
    memcpy(before, bits, row_words(world) * sizeof(uint32_t));
    const uint32_t begin = bundle->x_begin / 32;
    const uint32_t end = (uint32_t)fm_div_up(bundle->x_end, 32);
    encode_words(world, row, begin, end);
    write_entries(world, row, bundle->x_begin, bundle->x_end, !world->host->exact);
    if (world->host->exact && memcmp(before + begin, bits + begin, (end - begin) * sizeof(uint32_t)) != 0) {
        fm_host_exact_changed(world, before, y, bundle->z);
    }
}

static void run_bundles(void *user, uint64_t begin, uint64_t end, uint32_t worker) {
    const rows_job *job = user;
    (void)worker;
    for (uint64_t i = begin; i < end; i++) {
        const fm_gpu_bundle *bundle = &job->batch->bundles[i];
        const uint64_t last = fm_min_u64(bundle->y + FM_BUNDLE_ROWS, job->world->desc.shape.y);
        for (uint32_t y = bundle->y; y < last; y++) {
            update_row(job, bundle, y);
        }
    }
}

static void run_rows(void *user, uint64_t begin, uint64_t end, uint32_t worker) {
    const rows_job *job = user;
    fm_world *world = job->world;
    (void)worker;
    for (uint64_t row = begin; row < end; row++) {
        encode_words(world, row, 0, (uint32_t)row_words(world));
        // The exact passes read the voxels themselves when all of a packed field is written.
        if (!world->host->exact || world->host->colors) {
            write_entries(world, row, 0, world->desc.shape.x, !world->host->exact);
        }
    }
}

fm_result fm_host_world_update(fm_world *world, const fm_world_job *job) {
    const fm_shape shape = world->desc.shape;
    fm_context *context = world->context;
    const uint64_t rows = (uint64_t)shape.y * shape.z;
    world->stats = (fm_world_stats){.full = job->full};
    fm_passes_begin(context);
    for (uint32_t i = 0; i < job->batch_count; i++) {
        rows_job part = {world, &job->batches[i], job->full};
        fm_pool_run(context->pool, part.batch->bundle_count, 4, run_bundles, &part);
        for (uint32_t k = 0; k < part.batch->bundle_count && !job->full; k++) {
            world->stats.rows += fm_min_u64(FM_BUNDLE_ROWS, shape.y - part.batch->bundles[k].y);
        }
    }
    if (job->full) {
        rows_job all = {world, NULL, true};
        fm_pool_run(context->pool, rows, 16, run_rows, &all);
        world->stats.rows = rows;
    }
    fm_passes_end(context, "rows", world->stats.rows * (shape.x * sizeof(uint32_t) + row_words(world) * sizeof(uint32_t)));
    if (world->host->exact) {
        fm_host_exact_update(world, job->full);
        return FM_OK;
    }
    return fm_host_chunks(world, job);
}
