// SPDX-License-Identifier: MIT
#ifndef FM_APP_WINDOW_H
#define FM_APP_WINDOW_H

// The window and what its keys and mouse ask for. Esc and Tab free the cursor for the panel, a click into the picture captures it.

#include "gpu.h"

// What was asked for since the last poll.
typedef struct window_input {
    float move[3];  // right, forwards, up: -1 to 1
    float look[2];  // right, down, in pixels
    bool fast;
    uint32_t places, erases;  // edits: presses, and repeats of a button that is held
    int wheel;                // notches up
    int color;                // number key: 0 to 8; -1: none
    bool undo, redo, save, load, screenshot, toggle_panel, quit;
} window_input;

typedef struct window {
    GLFWwindow *handle;
    bool captured;  // the mouse looks around
    bool clicked;   // the cursor being free, since the last poll
    bool resized;   // since this was last set to false
    double cursor[2];
    double held_since[2];  // left, right; 0: not held
    double next_repeat[2];
    uint32_t tapped;  // bits of keys for movement pressed since the last poll
    window_input pending;
} window;

// False when there is no display or no Vulkan for windows: stderr has been told why. The address of `w` must stay.
bool window_open(window *w, uint32_t width, uint32_t height);
void window_close(window *w);

// Handles events, waiting for them up to `wait_seconds` when that is above 0.
window_input window_poll(window *w, double wait_seconds);
void window_capture(window *w, bool captured);
bool window_hidden(const window *w);  // minimised or without area
double window_seconds(void);

#endif
