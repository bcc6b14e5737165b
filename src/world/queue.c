// SPDX-License-Identifier: MIT
// Edits and dirty boxes that wait for an update, and their binning: each bundle of rows gets the brushes that may touch it, in
// order, so that the backends write a voxel once, whatever overlaps there.

#include "world/brush.h"

#include <stdio.h>
#include <string.h>

enum {
    MAX_BOXES = 64,
    ORDER_LIMIT = 1 << 20,  // entries of a batch, unless a single brush needs more
};

typedef struct grown {
    void *data;
    uint64_t bytes;  // of the memory
    uint32_t count;
} grown;

struct fm_world_queue {
    fm_allocator allocator;
    fm_shape shape;
    uint32_t bundles_y;
    grown brushes;  // fm_gpu_brush
    fm_box boxes[MAX_BOXES];
    uint32_t box_count;
    uint32_t *bundle_of;  // per place (y / 8, z): number of its bundle in the batch + 1, or 0
    uint64_t bundle_of_bytes;
    grown bundles, order, batches, starts;
    grown touched;  // fm_box
};

// Where a batch's share of the arrays begins; pointers are set when they have stopped growing.
typedef struct batch_start {
    uint32_t bundle, order, brush;
} batch_start;

// NULL of an array that has never held anything: there is nothing to count from.
static void *element(const grown *array, uint64_t i, size_t size) {
    return array->data ? (uint8_t *)array->data + i * size : NULL;
}

static fm_result grow(fm_world_queue *queue, grown *array, uint64_t count, size_t size, const char *what) {
    uint64_t wanted = count * size;
    if (count > UINT32_MAX) {
        return fm_fail(FM_ERROR_RANGE, "one update has more than 2^32 - 1 %s: update more often", what);
    }
    if (wanted > array->bytes) {
        uint64_t bytes = fm_max_u64(fm_max_u64(wanted, 2 * array->bytes), 4096);
        void *data = fm_alloc(&queue->allocator, bytes, what);
        if (!data) {
            return FM_ERROR_OUT_OF_HOST_MEMORY;
        }
        if (array->data) {
            memcpy(data, array->data, array->count * size);
            fm_free(&queue->allocator, array->data, array->bytes);
        }
        array->data = data;
        array->bytes = bytes;
    }
    array->count = (uint32_t)count;
    return FM_OK;
}

fm_result fm_queue_create(fm_world *world, fm_world_queue **result) {
    const fm_allocator *allocator = &world->context->allocator;
    fm_world_queue *queue = fm_alloc_zero(allocator, sizeof *queue, "a world's queue of edits");
    if (!queue) {
        return FM_ERROR_OUT_OF_HOST_MEMORY;
    }
    queue->allocator = *allocator;
    queue->shape = world->desc.shape;
    queue->bundles_y = (uint32_t)fm_div_up(queue->shape.y, FM_BUNDLE_ROWS);
    queue->bundle_of_bytes = (uint64_t)queue->bundles_y * queue->shape.z * sizeof *queue->bundle_of;
    queue->bundle_of = fm_alloc_zero(allocator, queue->bundle_of_bytes, "a world's queue of edits");
    if (!queue->bundle_of) {
        fm_queue_destroy(queue);
        return FM_ERROR_OUT_OF_HOST_MEMORY;
    }
    *result = queue;
    return FM_OK;
}

void fm_queue_destroy(fm_world_queue *queue) {
    if (!queue) {
        return;
    }
    fm_allocator allocator = queue->allocator;
    grown *arrays[] = {&queue->brushes, &queue->bundles, &queue->order, &queue->batches, &queue->starts, &queue->touched};
    for (size_t i = 0; i < sizeof arrays / sizeof arrays[0]; i++) {
        fm_free(&allocator, arrays[i]->data, arrays[i]->bytes);
    }
    fm_free(&allocator, queue->bundle_of, queue->bundle_of_bytes);
    fm_free(&allocator, queue, sizeof *queue);
}

fm_result fm_queue_brushes(fm_world_queue *queue, const fm_brush *brushes, uint32_t count) {
    uint32_t before = queue->brushes.count;
    FM_TRY(grow(queue, &queue->brushes, (uint64_t)before + count, sizeof(fm_gpu_brush), "edits"));
    fm_gpu_brush *prepared = queue->brushes.data;
    uint32_t kept = before;
    for (uint32_t i = 0; i < count; i++) {
        bool reaches;
        fm_result result = fm_brush_prepare(&brushes[i], queue->shape, &prepared[kept], &reaches);
        if (result != FM_OK) {
            char prefix[32];
            snprintf(prefix, sizeof prefix, "brush %u", i);
            queue->brushes.count = before;
            return fm_fail_prefix(result, prefix);
        }
        kept += reaches;
    }
    queue->brushes.count = kept;
    return FM_OK;
}

static void include(fm_box *box, const fm_box *other) {
    for (int i = 0; i < 3; i++) {
        box->begin[i] = other->begin[i] < box->begin[i] ? other->begin[i] : box->begin[i];
        box->end[i] = other->end[i] > box->end[i] ? other->end[i] : box->end[i];
    }
}

void fm_queue_mark(fm_world_queue *queue, const fm_box *box) {
    const uint32_t size[3] = {queue->shape.x, queue->shape.y, queue->shape.z};
    fm_box cut = *box;
    for (int i = 0; i < 3; i++) {
        cut.begin[i] = cut.begin[i] < 0 ? 0 : cut.begin[i];
        cut.end[i] = cut.end[i] > size[i] ? size[i] : cut.end[i];
        if (cut.begin[i] >= cut.end[i]) {
            return;
        }
    }
    if (queue->box_count < MAX_BOXES) {
        queue->boxes[queue->box_count++] = cut;
    } else {
        include(&queue->boxes[MAX_BOXES - 1], &cut);
    }
}

bool fm_queue_empty(const fm_world_queue *queue) {
    return queue->brushes.count == 0 && queue->box_count == 0;
}

static fm_box brush_box(const fm_gpu_brush *brush) {
    fm_box box;
    for (int i = 0; i < 3; i++) {
        box.begin[i] = brush->begin[i];
        box.end[i] = (int64_t)brush->end[i] + 1;
    }
    return box;
}

// The bundle of rows y ... y + 7 of slice z in the batch that begins at `first`, widened to x_begin ... x_end - 1.
static fm_result widen(fm_world_queue *queue, uint32_t first, uint32_t y_bundle, uint32_t z, uint32_t x_begin, uint32_t x_end,
                       fm_gpu_bundle **result) {
    uint32_t *number = &queue->bundle_of[y_bundle + (uint64_t)queue->bundles_y * z];
    if (*number == 0) {
        FM_TRY(grow(queue, &queue->bundles, (uint64_t)queue->bundles.count + 1, sizeof(fm_gpu_bundle), "bundles of rows"));
        *number = queue->bundles.count - first;
        fm_gpu_bundle *bundle = (fm_gpu_bundle *)queue->bundles.data + queue->bundles.count - 1;
        *bundle = (fm_gpu_bundle){.y = y_bundle * FM_BUNDLE_ROWS, .z = z, .x_begin = x_begin, .x_end = x_end};
    }
    fm_gpu_bundle *bundle = (fm_gpu_bundle *)queue->bundles.data + first + *number - 1;
    bundle->x_begin = x_begin < bundle->x_begin ? x_begin : bundle->x_begin;
    bundle->x_end = x_end > bundle->x_end ? x_end : bundle->x_end;
    *result = bundle;
    return FM_OK;
}

// Calls for each bundle that a brush may touch: the first time it counts, the second time it fills in.
static fm_result bin_brush(fm_world_queue *queue, uint32_t first, uint32_t number, uint32_t *order) {
    const fm_gpu_brush *brush = (const fm_gpu_brush *)queue->brushes.data + number;
    uint32_t y_first = (uint32_t)brush->begin[1] / FM_BUNDLE_ROWS;
    uint32_t y_last = (uint32_t)brush->end[1] / FM_BUNDLE_ROWS;
    for (uint32_t z = (uint32_t)brush->begin[2]; z <= (uint32_t)brush->end[2]; z++) {
        for (uint32_t y = y_first; y <= y_last; y++) {
            int32_t rows = (int32_t)(y * FM_BUNDLE_ROWS);
            int32_t x_begin, x_end;
            if (!fm_brush_rows(brush, rows, rows + FM_BUNDLE_ROWS, (int32_t)z, &x_begin, &x_end)) {
                continue;
            }
            fm_gpu_bundle *bundle;
            FM_TRY(widen(queue, first, y, z, (uint32_t)x_begin, (uint32_t)x_end, &bundle));
            if (order) {
                order[bundle->first_brush + bundle->brush_count] = number;
            }
            bundle->brush_count++;
        }
    }
    return FM_OK;
}

static fm_result bin_box(fm_world_queue *queue, uint32_t first, const fm_box *box) {
    for (int64_t z = box->begin[2]; z < box->end[2]; z++) {
        for (int64_t y = box->begin[1] / FM_BUNDLE_ROWS; y * FM_BUNDLE_ROWS < box->end[1]; y++) {
            fm_gpu_bundle *bundle;
            FM_TRY(widen(queue, first, (uint32_t)y, (uint32_t)z, (uint32_t)box->begin[0], (uint32_t)box->end[0], &bundle));
        }
    }
    return FM_OK;
}

static void forget_bundles(fm_world_queue *queue, uint32_t first) {
    const fm_gpu_bundle *bundles = queue->bundles.data;
    for (uint32_t i = first; i < queue->bundles.count; i++) {
        queue->bundle_of[bundles[i].y / FM_BUNDLE_ROWS + (uint64_t)queue->bundles_y * bundles[i].z] = 0;
    }
}

// Bins brushes begin ... end - 1, and the boxes where `boxes` says so. Brush numbers in `order` count from `begin`.
static fm_result bin_into(fm_world_queue *queue, uint32_t first, uint32_t begin, uint32_t end, bool boxes) {
    for (uint32_t i = 0; boxes && i < queue->box_count; i++) {
        FM_TRY(bin_box(queue, first, &queue->boxes[i]));
    }
    for (uint32_t i = begin; i < end; i++) {
        FM_TRY(bin_brush(queue, first, i, NULL));
    }
    uint64_t start = queue->order.count;
    uint64_t entries = 0;
    fm_gpu_bundle *bundles = queue->bundles.data;
    for (uint64_t i = first; i < queue->bundles.count; i++) {
        bundles[i].first_brush = (uint32_t)entries;
        entries += bundles[i].brush_count;
        bundles[i].brush_count = 0;
    }
    FM_TRY(grow(queue, &queue->order, start + entries, sizeof(uint32_t), "pairs of an edit and a bundle of rows"));
    uint32_t *order = element(&queue->order, start, sizeof *order);
    for (uint32_t i = begin; i < end; i++) {
        FM_TRY(bin_brush(queue, first, i, order));
    }
    for (uint64_t i = 0; i < entries; i++) {
        order[i] -= begin;
    }
    return FM_OK;
}

static fm_result bin(fm_world_queue *queue, uint32_t begin, uint32_t end, bool boxes) {
    uint32_t batch = queue->batches.count;
    FM_TRY(grow(queue, &queue->batches, (uint64_t)batch + 1, sizeof(fm_world_batch), "batches of edits"));
    FM_TRY(grow(queue, &queue->starts, (uint64_t)batch + 1, sizeof(batch_start), "batches of edits"));
    batch_start *start = (batch_start *)queue->starts.data + batch;
    *start = (batch_start){queue->bundles.count, queue->order.count, begin};
    fm_result result = bin_into(queue, start->bundle, begin, end, boxes);
    forget_bundles(queue, start->bundle);
    FM_TRY(result);
    if (queue->bundles.count == start->bundle) {
        // The brushes' boxes reach the world, the brushes do not.
        queue->batches.count--;
        queue->starts.count--;
        return FM_OK;
    }
    fm_world_batch *made = (fm_world_batch *)queue->batches.data + batch;
    *made = (fm_world_batch){.bundle_count = queue->bundles.count - start->bundle,
                             .brush_count = end - begin,
                             .order_count = queue->order.count - start->order};
    return FM_OK;
}

static uint64_t bundles_of(const fm_gpu_brush *brush) {
    uint64_t rows = (uint64_t)(brush->end[1] / FM_BUNDLE_ROWS - brush->begin[1] / FM_BUNDLE_ROWS + 1);
    return rows * (uint64_t)(brush->end[2] - brush->begin[2] + 1);
}

static void drop_job(fm_world_queue *queue) {
    queue->bundles.count = 0;
    queue->order.count = 0;
    queue->batches.count = 0;
    queue->starts.count = 0;
}

// Edits before a box that covers the world leave no trace.
static uint32_t first_that_counts(const fm_world_queue *queue) {
    const fm_gpu_brush *brushes = queue->brushes.data;
    const int32_t last[3] = {(int32_t)queue->shape.x - 1, (int32_t)queue->shape.y - 1, (int32_t)queue->shape.z - 1};
    for (uint32_t i = queue->brushes.count; i-- > 0;) {
        bool all = brushes[i].kind == FM_BRUSH_BOX;
        for (int k = 0; k < 3; k++) {
            all = all && brushes[i].begin[k] == 0 && brushes[i].end[k] == last[k];
        }
        if (all) {
            return i;
        }
    }
    return 0;
}

static fm_result bin_all(fm_world_queue *queue) {
    const fm_gpu_brush *brushes = queue->brushes.data;
    uint32_t begin = first_that_counts(queue);
    uint64_t entries = 0;
    bool boxes = true;
    for (uint32_t i = begin; i < queue->brushes.count; i++) {
        uint64_t own = bundles_of(&brushes[i]);
        if (i > begin && entries + own > ORDER_LIMIT) {
            FM_TRY(bin(queue, begin, i, boxes));
            boxes = false;
            begin = i;
            entries = 0;
        }
        entries += own;
    }
    if (begin < queue->brushes.count || (boxes && queue->box_count > 0)) {
        FM_TRY(bin(queue, begin, queue->brushes.count, boxes));
    }
    return FM_OK;
}

fm_result fm_queue_job(fm_world_queue *queue, fm_world_job *job, const fm_box **touched, uint32_t *touched_count) {
    drop_job(queue);
    FM_TRY(bin_all(queue));
    fm_world_batch *batches = queue->batches.data;
    const batch_start *starts = queue->starts.data;
    for (uint32_t i = 0; i < queue->batches.count; i++) {
        batches[i].bundles = element(&queue->bundles, starts[i].bundle, sizeof *batches[i].bundles);
        batches[i].order = element(&queue->order, starts[i].order, sizeof *batches[i].order);
        batches[i].brushes = element(&queue->brushes, starts[i].brush, sizeof *batches[i].brushes);
    }
    job->batches = batches;
    job->batch_count = queue->batches.count;
    uint32_t count = job->batch_count > 0 ? queue->box_count + queue->brushes.count : 0;
    // One more, so that no boxes are not NULL.
    FM_TRY(grow(queue, &queue->touched, (uint64_t)count + 1, sizeof(fm_box), "boxes of edits"));
    fm_box *all = queue->touched.data;
    const fm_gpu_brush *brushes = queue->brushes.data;
    for (uint32_t i = 0; i < count; i++) {
        all[i] = i < queue->box_count ? queue->boxes[i] : brush_box(&brushes[i - queue->box_count]);
    }
    *touched = all;
    *touched_count = count;
    return FM_OK;
}

void fm_queue_clear(fm_world_queue *queue) {
    drop_job(queue);
    queue->brushes.count = 0;
    queue->box_count = 0;
}
