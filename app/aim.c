// SPDX-License-Identifier: MIT
#include "aim.h"

#include <string.h>

void aim_forget(aim *a) {
    *a = (aim){0};
}

static bool good(aim *a, fm_result result) {
    if (result != FM_OK) {
        aim_forget(a);
    }
    return result == FM_OK;
}

static float middle(uint32_t pixels) {
    return (float)(pixels / 2);
}

bool aim_hear(aim *a, fm_context *context, fm_renderer *renderer) {
    while (a->count > 0) {
        bool complete = false;
        if (!good(a, fm_poll(context, a->tickets[0], &complete))) {
            return false;
        }
        if (!complete) {
            break;
        }
        if (!good(a, fm_render_pick_end(renderer, a->tickets[0], &a->pick))) {
            return false;
        }
        a->count--;
        memmove(a->tickets, a->tickets + 1, a->count * sizeof a->tickets[0]);
    }
    return true;
}

bool aim_ask(aim *a, fm_renderer *renderer, fm_world *world, const fm_render_desc *desc) {
    fm_ticket ticket;
    if (a->count == AIM_IN_FLIGHT) {
        return true;
    }
    if (!good(a, fm_render_pick_begin(renderer, world, desc, middle(desc->width), middle(desc->height), &ticket))) {
        return false;
    }
    a->tickets[a->count++] = ticket;
    return true;
}

bool aim_now(aim *a, fm_renderer *renderer, fm_world *world, const fm_render_desc *desc) {
    aim_forget(a);
    return good(a, fm_render_pick(renderer, world, desc, middle(desc->width), middle(desc->height), &a->pick));
}
