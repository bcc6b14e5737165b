// SPDX-License-Identifier: MIT
#include "render/octree_residents.h"

#include <float.h>
#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

// A part has to be wanted by so much more than one that is there to take its place: what is wanted wavers with the camera.
static const float MORE = 1.25f;

enum { MOST_DOUBLINGS = 6 };  // of the time until a part that failed is tried again

fm_result fm_residents_create(fm_octree_residents *r) {
    fm_context *context = r->context;
    r->parts = fm_octree_alloc_zero(context, r->count * sizeof *r->parts, "the parts of an octree");
    r->table = fm_octree_alloc_zero(context, r->count * sizeof *r->table, "the parts of an octree");
    r->wishes = fm_octree_alloc(context, r->count * sizeof *r->wishes, "the parts of an octree");
    r->places = fm_octree_alloc(context, r->count * sizeof *r->places, "the parts of an octree");
    return r->parts && r->table && r->wishes && r->places ? FM_OK : FM_ERROR_OUT_OF_HOST_MEMORY;
}

static fm_result take_image(fm_octree_residents *r, uint64_t at) {
    r->parts[at].image = fm_octree_alloc(r->context, r->rows[at].bytes, "a part of an octree");
    return r->parts[at].image ? FM_OK : FM_ERROR_OUT_OF_HOST_MEMORY;
}

static void free_image(fm_octree_residents *r, uint64_t at) {
    fm_octree_free(r->context, r->parts[at].image, r->rows[at].bytes);
    r->parts[at].image = NULL;
}

void fm_residents_destroy(fm_octree_residents *r) {
    fm_context *context = r->context;
    fm_octree_loader_destroy(r->loader);
    for (uint64_t at = 0; r->parts && at < r->count; at++) {
        free_image(r, at);
    }
    fm_octree_store_destroy(r->store);
    fm_octree_free(context, r->parts, r->count * sizeof *r->parts);
    fm_octree_free(context, r->table, r->count * sizeof *r->table);
    fm_octree_free(context, r->wishes, r->count * sizeof *r->wishes);
    fm_octree_free(context, r->places, r->count * sizeof *r->places);
}

static void leave(fm_octree_residents *r, uint64_t at, fm_part_state state) {
    free_image(r, at);
    r->used -= r->rows[at].bytes;
    r->parts[at].state = state;
    r->table[at] = (fm_octree_part){0};
}

static void drop(fm_octree_residents *r, uint64_t at) {
    leave(r, at, FM_PART_ABSENT);
    r->dropped++;
    r->resident--;
}

static void fail(fm_octree_residents *r, uint64_t at, const char *why) {
    fm_part *part = &r->parts[at];
    const uint32_t doublings = part->tries < MOST_DOUBLINGS ? part->tries : MOST_DOUBLINGS;
    leave(r, at, FM_PART_FAILED);
    part->again = r->retry_ms < 0 ? UINT64_MAX : fm_now_ns() + (uint64_t)(1e6 * (double)r->retry_ms * (double)(1u << doublings));
    part->tries++;
    r->failed++;
    r->failing++;
    snprintf(r->failure, sizeof r->failure, "%s", why);
}

// A part that could not be read is no error here, a device that fails is.
static fm_result settle(fm_octree_residents *r, const fm_octree_load *load) {
    fm_part *part = &r->parts[load->part];
    uint64_t head = (uintptr_t)part->image;
    r->loading--;
    if (load->result != FM_OK) {
        fail(r, load->part, load->message);
        return FM_OK;
    }
    if (r->store) {
        const fm_result result = fm_octree_store_put(r->store, part->offset, part->image, load->row.bytes, &load->numbers, &head);
        if (result != FM_OK) {
            fail(r, load->part, fm_last_error());
            return result;
        }
        free_image(r, load->part);
    } else {
        const fm_octree_head own = fm_octree_host_head(&load->numbers);
        memcpy(part->image, &own, sizeof own);
    }
    part->state = FM_PART_THERE;
    part->tries = 0;
    r->table[load->part] = (fm_octree_part){.head = head, .shown = r->fade_ms < 0 ? 1.0f : 0.0f};
    r->loaded++;
    r->resident++;
    return FM_OK;
}

fm_result fm_residents_settle(fm_octree_residents *r, bool wait) {
    fm_octree_load load;
    for (bool first = true; fm_octree_loader_take(r->loader, wait && first, &load); first = false) {
        FM_TRY(settle(r, &load));
    }
    return FM_OK;
}

void fm_residents_fade(fm_octree_residents *r, double ms) {
    const float step = r->fade_ms > 0 ? (float)ms / r->fade_ms : 1;
    for (uint64_t at = 0; at < r->count; at++) {
        float *shown = &r->table[at].shown;
        if (r->parts[at].state == FM_PART_THERE) {
            *shown = fminf(1, *shown + step);
        } else if (r->parts[at].state == FM_PART_LEAVING) {
            *shown -= step;
            if (!(*shown > 0)) {
                drop(r, at);
            }
        }
    }
}

// ---------------------------------------------------------------------------------------------------------------------------
// What comes next
// ---------------------------------------------------------------------------------------------------------------------------

static int by_offset(const void *a, const void *b) {
    const uint64_t x = (*(const fm_part *const *)a)->offset, y = (*(const fm_part *const *)b)->offset;
    return (x > y) - (x < y);
}

static bool is_held(fm_part_state state) {
    return state == FM_PART_LOADING || state == FM_PART_THERE || state == FM_PART_LEAVING;
}

// The first place of `bytes` between the parts that stay where those that are wanted less than `below` go, and with `soon` those
// that are leaving.
static bool find_place(const fm_octree_residents *r, const float *scores, float below, bool soon, uint64_t bytes,
                       uint64_t *offset) {
    uint64_t held = 0, i = 0;
    for (uint64_t at = 0; at < r->count; at++) {
        const fm_part_state state = r->parts[at].state;
        const bool goes = (state == FM_PART_THERE && scores[at] < below) || (state == FM_PART_LEAVING && soon);
        if (is_held(state) && !goes) {
            r->places[held++] = &r->parts[at];
        }
    }
    qsort(r->places, held, sizeof *r->places, by_offset);
    for (*offset = 0; i < held && r->places[i]->offset - *offset < bytes; i++) {
        *offset = r->places[i]->offset + r->rows[r->places[i] - r->parts].bytes;
    }
    return i < held || bytes <= r->room - *offset;
}

// Parts in a place are to go; false: they still fade.
static bool clear_place(fm_octree_residents *r, uint64_t offset, uint64_t bytes, bool at_once) {
    bool free_now = true;
    for (uint64_t at = 0; at < r->count; at++) {
        fm_part *part = &r->parts[at];
        if (!is_held(part->state) || part->offset >= offset + bytes || offset >= part->offset + r->rows[at].bytes) {
            continue;
        }
        if (at_once) {
            drop(r, at);
        } else {
            part->state = FM_PART_LEAVING;
            free_now = false;
        }
    }
    return free_now;
}

typedef enum room_found { ROOM_NONE = 0, ROOM_SOON, ROOM_NOW } room_found;

// Nothing has to go where that would not do: what is wanted less would be loaded again, and so on for ever.
static room_found make_room(fm_octree_residents *r, const float *scores, const fm_part_wish *wish, bool at_once, uint64_t *offset) {
    const uint64_t bytes = r->rows[wish->part].bytes;
    if (find_place(r, scores, 0, false, bytes, offset)) {
        return ROOM_NOW;
    }
    // Those that nobody wants go before others.
    if (find_place(r, scores, FLT_MIN, true, bytes, offset) || find_place(r, scores, wish->score / MORE, true, bytes, offset)) {
        return clear_place(r, *offset, bytes, at_once) ? ROOM_NOW : ROOM_SOON;
    }
    return ROOM_NONE;
}

static int by_score(const void *a, const void *b) {
    const fm_part_wish *x = a, *y = b;
    return x->score != y->score ? (x->score < y->score ? 1 : -1) : (x->part > y->part) - (x->part < y->part);
}

// Parts that are to be loaded, the most wanted first.
static uint64_t make_wishes(fm_octree_residents *r, const float *scores) {
    uint64_t count = 0;
    r->wanted = 0;
    for (uint64_t at = 0; at < r->count; at++) {
        const fm_part *part = &r->parts[at];
        const bool failed = part->state == FM_PART_FAILED;
        if (!(scores[at] > 0) || r->rows[at].bytes == 0 || (failed && r->now < part->again)) {
            continue;
        }
        r->wanted++;
        if ((part->state == FM_PART_ABSENT || failed) && r->rows[at].bytes <= r->room) {
            r->wishes[count++] = (fm_part_wish){scores[at], (uint32_t)at};
        }
    }
    qsort(r->wishes, count, sizeof *r->wishes, by_score);
    return count;
}

fm_result fm_residents_choose(fm_octree_residents *r, const float *scores, bool at_once) {
    const uint64_t count = make_wishes(r, scores);
    for (uint64_t i = 0; i < count && r->loading < FM_LOADS; i++) {
        const uint64_t at = r->wishes[i].part;
        fm_part *part = &r->parts[at];
        uint64_t offset = 0;
        const room_found found = make_room(r, scores, &r->wishes[i], at_once, &offset);
        if (found == ROOM_SOON) {
            return FM_OK;
        }
        if (found == ROOM_NONE) {
            continue;
        }
        FM_TRY(take_image(r, at));
        r->failing -= part->state == FM_PART_FAILED;
        part->state = FM_PART_LOADING;
        part->offset = offset;
        r->used += r->rows[at].bytes;
        r->loading++;
        const bool asked = fm_octree_loader_ask(r->loader, at, &r->rows[at], part->image);
        (void)asked;  // no more are under way than it takes
    }
    return FM_OK;
}
