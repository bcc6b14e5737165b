// SPDX-License-Identifier: MIT
#include "stats.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

enum { PIECE = 1024, SLOTS = 2 * STATS_MAX_DISTINCT };

// Walks the elements of a host volume, row by row, a piece of a row at a time.
typedef struct walk {
    const uint8_t *data;
    fm_volume_desc about;
    uint64_t row, rows;
    uint32_t x;
    long double piece[PIECE];
    uint32_t count;  // of elements in `piece`
} walk;

static void walk_begin(walk *w, fm_volume *volume) {
    fm_volume_info(volume, &w->about);
    w->data = fm_volume_data(volume);
    w->rows = (uint64_t)w->about.shape.y * w->about.shape.z;
    w->row = 0;
    w->x = 0;
}

#define WIDEN(type)                                                                                                                \
    for (uint32_t i = 0; i < w->count; i++) {                                                                                      \
        w->piece[i] = (long double)((const type *)(const void *)w->data)[first + i];                                               \
    }                                                                                                                              \
    break

static bool walk_next(walk *w) {
    if (w->row == w->rows) {
        return false;
    }
    const uint32_t length = w->about.shape.x;
    const uint64_t first = w->row * length + w->x;
    w->count = length - w->x < PIECE ? length - w->x : PIECE;
    switch (w->about.type) {
    case FM_TYPE_U8:
        WIDEN(uint8_t);
    case FM_TYPE_U16:
        WIDEN(uint16_t);
    case FM_TYPE_U32:
        WIDEN(uint32_t);
    case FM_TYPE_U64:
        WIDEN(uint64_t);
    case FM_TYPE_I8:
        WIDEN(int8_t);
    case FM_TYPE_I16:
        WIDEN(int16_t);
    case FM_TYPE_I32:
        WIDEN(int32_t);
    case FM_TYPE_I64:
        WIDEN(int64_t);
    case FM_TYPE_F32:
        WIDEN(float);
    case FM_TYPE_F64:
        WIDEN(double);
    case FM_TYPE_BITS: {
        const uint32_t *words = (const uint32_t *)(const void *)w->data + w->row * ((length + 31ull) / 32);
        for (uint32_t i = 0; i < w->count; i++) {
            w->piece[i] = words[(w->x + i) / 32] >> ((w->x + i) % 32) & 1;
        }
        break;
    }
    }
    w->x += w->count;
    if (w->x == length) {
        w->x = 0;
        w->row++;
    }
    return true;
}

// How often each value occurs: open addressing, never more than half full.
typedef struct tally {
    stats_value *slots;  // free where `voxels` is 0
    stats_value *last;
    uint64_t distinct;
    bool more;
} tally;

static stats_value *tally_slot(const tally *t, long double value) {
    // Integers of 64 bits are told apart by value, and by sign where they need the 64th bit.
    const uint64_t bits = value < 0 ? (uint64_t)(int64_t)value : (uint64_t)value;
    for (uint64_t i = (bits * 0x9e3779b97f4a7c15u) >> 40;; i++) {
        stats_value *slot = &t->slots[i % SLOTS];
        if (slot->voxels == 0 || slot->value == value) {
            return slot;
        }
    }
}

static void tally_add(tally *t, long double value) {
    if (t->more) {
        return;
    }
    if (!t->last || t->last->value != value) {
        t->last = tally_slot(t, value);
        if (t->last->voxels == 0) {
            if (t->distinct == STATS_MAX_DISTINCT) {
                t->more = true;
                return;
            }
            t->last->value = value;
            t->distinct++;
        }
    }
    t->last->voxels++;
}

static int commoner(const void *a, const void *b) {
    const stats_value *x = a, *y = b;
    if (x->voxels != y->voxels) {
        return x->voxels > y->voxels ? -1 : 1;
    }
    return (x->value > y->value) - (x->value < y->value);
}

static void tally_end(tally *t, stats *result) {
    result->more = t->more;
    result->distinct = t->distinct;
    if (!t->more) {
        qsort(t->slots, SLOTS, sizeof *t->slots, commoner);
        result->listed = t->distinct < STATS_LISTED ? (uint32_t)t->distinct : STATS_LISTED;
        memcpy(result->values, t->slots, result->listed * sizeof *t->slots);
    }
    free(t->slots);
}

bool stats_of(fm_volume *volume, stats *result) {
    walk w;
    walk_begin(&w, volume);
    *result = (stats){.min = INFINITY, .max = -INFINITY};
    result->integer = w.about.type != FM_TYPE_F32 && w.about.type != FM_TYPE_F64;
    tally t = {.slots = result->integer ? calloc(SLOTS, sizeof *t.slots) : NULL};
    if (result->integer && !t.slots) {
        return false;
    }
    while (walk_next(&w)) {
        result->voxels += w.count;
        for (uint32_t i = 0; i < w.count; i++) {
            const long double value = w.piece[i];
            result->nonzero += value != 0;
            if (!isfinite(value)) {
                *(isnan(value) ? &result->nan : &result->infinite) += 1;
                continue;
            }
            result->min = value < result->min ? value : result->min;
            result->max = value > result->max ? value : result->max;
            if (result->integer) {
                tally_add(&t, value);
            }
        }
    }
    if (result->min > result->max) {
        result->min = result->max = 0;
    }
    if (result->integer) {
        tally_end(&t, result);
    }
    return true;
}

void stats_sides(fm_volume *field, bool *solid, bool *empty) {
    walk w;
    walk_begin(&w, field);
    *solid = *empty = false;
    while (!(*solid && *empty) && walk_next(&w)) {
        for (uint32_t i = 0; i < w.count; i++) {
            *(w.piece[i] > 0 ? empty : solid) = true;
        }
    }
}

bool stats_type_range(fm_type type, long double *least, long double *most) {
    static const uint64_t greatest[] = {
        [FM_TYPE_U8] = UINT8_MAX,   [FM_TYPE_U16] = UINT16_MAX, [FM_TYPE_U32] = UINT32_MAX,
        [FM_TYPE_U64] = UINT64_MAX, [FM_TYPE_I8] = INT8_MAX,    [FM_TYPE_I16] = INT16_MAX,
        [FM_TYPE_I32] = INT32_MAX,  [FM_TYPE_I64] = INT64_MAX,  [FM_TYPE_BITS] = 1,
    };
    if (type == FM_TYPE_F32 || type == FM_TYPE_F64) {
        return false;
    }
    const bool negative = type == FM_TYPE_I8 || type == FM_TYPE_I16 || type == FM_TYPE_I32 || type == FM_TYPE_I64;
    *most = (long double)greatest[type];
    *least = negative ? -*most - 1 : 0;
    return true;
}
