// SPDX-License-Identifier: MIT
#ifndef FM_APP_AIM_H
#define FM_APP_AIM_H

// What is under the cross-hair. Frames ask and take the answer that is there, which is of a frame or two ago; edits wait for
// theirs.

#include "fathom/render.h"

enum { AIM_IN_FLIGHT = 3 };  // as many as a renderer keeps

typedef struct aim {
    fm_pick pick;                      // the newest answer
    fm_ticket tickets[AIM_IN_FLIGHT];  // of the questions that wait, oldest first
    uint32_t count;
} aim;

// All return false where fm_last_error says why; then nothing is under the cross-hair.
//
// Takes the answers that are there, of `context` and the renderer that was asked.
bool aim_hear(aim *a, fm_context *context, fm_renderer *renderer);
// Asks for the middle of the picture. Does nothing while AIM_IN_FLIGHT questions wait.
bool aim_ask(aim *a, fm_renderer *renderer, fm_world *world, const fm_render_desc *desc);
// Asks and waits for the answer.
bool aim_now(aim *a, fm_renderer *renderer, fm_world *world, const fm_render_desc *desc);
// Nothing is under the cross-hair until it is asked again.
void aim_forget(aim *a);

#endif
